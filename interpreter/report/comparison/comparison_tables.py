"""HTML tables of a comparison: points, effort for an error, frame rates, orders, distances, and single changes."""

from __future__ import annotations

from collections.abc import Sequence

from softmark.interpreter.language.number_formatting import format_quantity, group_digits, typeset_number
from softmark.interpreter.report.comparison.comparison_view import SceneView, spread_range, status_of
from softmark.interpreter.report.page.embedded_csv import Cell, csv_link
from softmark.interpreter.report.page.html_markup import count, prose, tag, text, wrappable_name
from softmark.interpreter.study.analysis.comparison_analysis import EffortAtLevel
from softmark.interpreter.study.analysis.comparison_point import ComparedPoint, Spread
from softmark.interpreter.study.analysis.configuration_pairs import ChangeEffect, ErrorChange
from softmark.interpreter.study.analysis.pareto_front import BestInFrame
from softmark.interpreter.study.analysis.refinement_convergence import Limit, LineOrders
from softmark.references.convergence_orders import ConvergenceEstimate

MOODS = {
    "converged": ("✓", "good"), "capped": ("~", "quiet"), "read": ("✓", "good"), "skipped": ("–", "quiet"),
    "unsupported": ("–", "quiet"),
}  # fmt: skip
DASH = "–"


def table(caption: str, head: Sequence[str], rows: Sequence[str], kind: str = "") -> str:
    """Return an HTML table in a scrolling box; `head` and `rows` are markup."""
    label = tag("caption", tag("span", prose(caption)))
    own = tag("table", label, tag("thead", tag("tr", *head)), tag("tbody", *rows), class_=f"compared {kind}".strip())
    return tag("div", own, class_="scroll", tabindex=0, role="region", aria_label=caption.replace("`", ""))


def heading(words: str, number: bool = False) -> str:
    """Return the HTML of a column header."""
    return tag("th", prose(words), scope="col", class_="n" if number else None)


def row_head(name: str, below: str = "") -> str:
    """Return the HTML of a row header, with a smaller text `below`."""
    return tag("th", tag("code", wrappable_name(name)), tag("small", text(below)) if below else "", scope="row")


def cell(words: str, below: str = "", best: bool = False) -> str:
    """Return the HTML of a table cell with a number, and a smaller text below it."""
    shown = tag("strong", text(words)) if best else text(words)
    return tag("td", shown, tag("small", prose(below)) if below else "", class_="n")


def row(*cells: str) -> str:
    """Return the HTML of a table row with some cells."""
    return tag("tr", *cells)


# ------------------------------------------------------------------ all points


def all_points(view: SceneView) -> str:
    """Return the table of all configurations with status, size, errors, times and solver, and a CSV file of them."""
    return configurations(view) + _points_csv(view)


def configurations(view: SceneView, most: int | None = None) -> str:
    """Return the table of configurations, with at most `most` rows."""
    head = [heading(w) for w in ("Configuration", "Status")]
    named = (f"`{m}`" for m in (*view.metrics, *view.measurements))
    head += [heading(w, True) for w in (*named, "Unknowns", *_effort_headings(view))]
    head += [heading("Solver"), heading("Timing")]
    known = view.metrics.values()
    star = " ★: on the Pareto front for this error." if any(own.front for own in known) else ""
    dagger = " ±: uncertainty of the reference; †: error below it." if any(own.uncertainty for own in known) else ""
    rows = [_point(view, point) for point in view.distinct_points[:most]]
    which = "All" if most is None or len(view.distinct_points) <= most else f"{most} of {len(view.distinct_points)}"
    return table(f"{which} configurations.{star}{dagger}", head, rows, "points-table")


def _effort_headings(view: SceneView) -> tuple[str, ...]:
    return (view.effort_name, "Set-up", "Memory") if view.timed else ()


def _point(view: SceneView, point: ComparedPoint) -> str:
    sign, mood = MOODS.get(point.status, ("✗", "bad"))
    words = " " + text(status_of(point.status))
    if point.status == "converged":  # the usual status: the symbol suffices, words are only for screen readers
        words = tag("span", words, class_="spoken")
    status = tag("span", tag("span", sign, aria_hidden="true"), words, class_=f"status {mood}")
    cells = [row_head(point.label, point.outline), tag("td", status, _full_residual(point))]
    cells += [_error(view, point, metric) for metric in view.metrics]
    cells += [cell(view.format_measurement(point, metric)) for metric in view.measurements]
    cells += [cell(group_digits(point.dofs) if point.dofs else DASH), *(_times(view, point) if view.timed else ())]
    return row(*cells, _solver_with_iterations(point), tag("td", _timing_remarks(point), class_="quality"))


def _full_residual(point: ComparedPoint) -> str:
    """Return the residual of the full model as text, if only the equations of a reduced model were solved."""
    left = point.reduced.full_residual if point.reduced else None
    return "" if left is None else tag("small", text(f"full model: residual {left:.2g} of the load"))


def _solver_with_iterations(point: ComparedPoint) -> str:
    """Return the linear solver and its number of iterations as text."""
    below = "" if point.iterations is None else tag("small", text(count(point.iterations, "iteration")))
    return tag("td", text(point.linear_solver or DASH), below, class_="solver")


def _error(view: SceneView, point: ComparedPoint, metric: str) -> str:
    error, known = point.error(metric), view.metrics[metric]
    if error is None:
        return cell(DASH, point.metric(metric).reason or "not measured" if point.solved else "")
    starred = point.key in known.front
    within = point.within(metric, known.uncertainty)
    said = view.amount(error, metric) + (" †" if within else "") + (" ★" if starred else "")
    own = point.uncertainty(metric)
    return cell(said, f"± {view.amount(own, metric)}" if own else "", starred)


def _times(view: SceneView, point: ComparedPoint) -> list[str]:
    spread, setup = view.effort(point), point.cost.setup_s
    most = "≤ " if point.cost.is_upper_bound else ""
    time = cell(most + format_quantity(spread.median, "s", 3), spread_range(spread)) if spread else cell(DASH)
    return [
        time,
        cell(format_quantity(setup.median, "s", 3) if setup else DASH),
        cell(format_bytes(point.cost.memory_bytes)),
    ]


def format_bytes(number: float | None) -> str:
    """Return a number of bytes as text, such as `12.3 MB`; a dash if it is zero or unknown."""
    if not number:
        return DASH
    power = next((p for p in (9, 6, 3) if number >= 10**p), 0)
    return f"{number / 10**power:.3g}\u00a0{ {9: 'GB', 6: 'MB', 3: 'kB', 0: 'B'}[power] }"


def _timing_remarks(point: ComparedPoint) -> str:
    """Return the number of timing runs and of excluded runs as text, followed by remarks on the timing."""
    cost = point.cost
    said = [count(cost.runs, "run")] if cost.runs else []
    said += [f"{cost.excluded_runs} excluded"] if cost.excluded_runs else []
    said += ["disturbed"] if cost.contaminated else []
    return text(", ".join([*said, *cost.flags])) or DASH


def _points_csv(view: SceneView) -> str:
    clocks = ("cpu_s", "wall_s", "step_s", "setup_s")
    header = ["configuration", "model", "study", "status", "message", "nodes", "elements", "dofs"]
    header += [f"{name} [{own.unit}]" for m, own in view.metrics.items() for name in (m, f"uncertainty of {m}")]
    header += [f"{m} [{unit}]" for m, unit in view.measurements.items()]
    parts = ("median [s]", "q1 [s]", "q3 [s]", "runs")
    header += [f"{clock.removesuffix('_s')} {part}" for clock in clocks for part in parts]
    header += ["memory [B]", "iterations", "linear solver", "disturbed", "flags"]
    rows: list[list[Cell]] = []
    for p in view.points:
        own: list[Cell] = [p.label, p.model, p.study, p.status, p.message, p.nodes, p.elements, p.dofs]
        own += [value for m in view.metrics for value in (p.error(m), p.uncertainty(m))]
        own += [p.metric(m).value for m in view.measurements]
        own += [value for clock in clocks for value in _spread_cells(p.cost.spread(clock))]
        own += [p.cost.memory_bytes, p.iterations, p.linear_solver]
        rows.append([*own, "yes" if p.cost.contaminated else "no", "; ".join(p.cost.flags)])
    return csv_link(f"{view.scene}-points", header, rows, "Save all configurations as CSV")


def _spread_cells(spread: Spread | None) -> tuple[Cell, ...]:
    """Return median, quartiles and number of runs as CSV cells; time steps have no quartiles."""
    if spread is None:
        return (None,) * 4
    q1, q3 = (spread.q1, spread.q3) if spread.quartiles else (None, None)
    return spread.median, q1, q3, spread.runs


# ------------------------------------------------------------------ effort to an error


def effort_to_error(view: SceneView) -> str:
    """Return for each error metric a table of the effort that refinement lines need to reach each error level.

    A refinement line has the configurations of one model that differ in one number, such as the cell size.
    """
    return "".join(_effort_table(view, metric) for metric, own in view.metrics.items() if own.levels)


def _effort_table(view: SceneView, metric: str) -> str:
    known = view.metrics[metric]
    head = [heading("Line"), *(heading(f"{view.amount(v.level, metric)} or less", True) for v in known.levels)]
    rows = [
        row(row_head(line.name), *(_effort_cell(view, v.lines[i], v.best == line.name, metric) for v in known.levels))
        for i, line in enumerate(view.lines)
    ]
    words = (
        f"{view.effort_name} needed for a given error `{metric}` against `{known.against}`. Interpolated: log-linear "
        f"between two neighbouring configurations of one line; all others were computed. The smallest value of a "
        f"column is in bold."
    )
    return table(words, head, rows)


def _effort_cell(view: SceneView, entry: EffortAtLevel, best: bool, metric: str) -> str:
    found, least = entry.reached, entry.least_error
    if found is None:
        above = entry.reason == "not reached" and least
        return cell(DASH, f"smallest error {view.amount(least, metric)}" if above and least else str(entry.reason))
    name = view.by_key[found.between[0]].label
    below = "interpolated" if found.interpolated else f"`{name}`" if name != entry.line else ""
    spread = spread_range(found.effort) if view.timed else ""
    return cell(view.format_effort(found.effort), ", ".join(part for part in (spread, below) if part), best)


# ------------------------------------------------------------------ best within a frame


def best_at_rates(view: SceneView) -> str:
    """Return a table of the most accurate fast enough configuration for each error metric and frame rate.

    It also names the next most accurate model.
    """
    if not view.metrics:
        return ""
    if not view.timed or not any(p.cost.frame for p in view.points):
        return tag("p", "No times were measured, so frame rates are unknown.", class_="quiet")
    words = (
        "Metric",
        "Frame",
        "Most accurate within the frame",
        "Error",
        "Takes",
        "Left",
        "Next model",
        "Uncertain",
    )
    head = [heading(w, w in ("Error", "Takes", "Left")) for w in words]
    rows = [_rate(view, metric, rate) for metric, own in view.metrics.items() for rate in own.rates]
    caption = (
        "Configuration with the smallest error whose solution fits into the time of a frame. It fits if the third "
        "quartile of its solution times, or 95 % of its time steps, is shorter than the frame. Uncertain: only the "
        "median fits."
    )
    return table(caption, head, rows)


def _rate(view: SceneView, metric: str, rate: BestInFrame) -> str:
    frame = tag("td", text(f"{rate.hz:g} Hz"), tag("small", text(format_quantity(1.0 / rate.hz, "s", 3))))
    unsure = tag("td", prose(", ".join(f"`{label}`" for label in rate.unsure) or DASH))
    begin = [tag("td", tag("code", wrappable_name(metric))), frame]
    best, other, takes = rate.best, rate.runner_up, rate.takes
    if best is None or takes is None:
        return row(*begin, tag("td", DASH, tag("small", prose(str(rate.reason))), colspan=5), unsure)
    second = f"`{other.label}`" if other else DASH
    below = view.amount(other.measured, metric) if other else ""
    return row(
        *begin, tag("td", tag("code", wrappable_name(best.label))),
        cell(view.amount(best.measured, metric) + (" †" if best.within else "")),
        cell(format_quantity(takes.median, "s", 3), spread_range(takes)),
        cell(f"{100 * (rate.margin or 0.0):.0f}\u00a0%"),
        tag("td", prose(second), tag("small", text(below))), unsure,
    )  # fmt: skip


# ------------------------------------------------------------------ orders


def orders(view: SceneView) -> str:
    """Return a table of observed orders of convergence and extrapolated limits; empty if there is none.

    It has rows for every refinement line, that is for the configurations of one model that differ in one number.
    """
    entries = view.analysis.orders
    if not entries:
        return ""
    head = [
        heading("Line"),
        heading("Probe or metric"),
        *(heading(w, True) for w in ("Finest", "Order", "Limit", "± (GCI)")),
    ]
    head += [heading("Asymptotic"), *(heading(f"order of `{m}`", True) for m in view.metrics)]
    rows = [r for entry in entries for r in _order_rows(view, entry)]
    caption = (
        "Mesh refinement. Finest: largest displacement of the probe on the finest mesh, or the value of a metric if "
        "no probe is shared; limit: by Richardson extrapolation; ±: grid convergence index, the half-width of a band "
        "about the finest value. Orders of errors: between the two finest meshes, and by least squares over all. ‡: "
        "outside the asymptotic range, unreliable."
    )
    return table(caption, head, rows)


def _order_rows(view: SceneView, entry: LineOrders) -> list[str]:
    """Return the table rows of one refinement line, one for each probe or metric.

    The first row also has the orders of the errors.
    """
    errors = [_error_order(entry, m) for m in view.metrics]
    limits = entry.limits or [Limit(DASH, "metric", "", None, None, ConvergenceEstimate("unusable", entry.doubt))]
    (first, *others) = ([_name(o.of), *limit_cells(o.finest, o.refined, o.unit or "1")] for o in limits)
    blank = [tag("td")] * len(errors)
    return [row(row_head(entry.line.name), *first, *errors), *(row(tag("td"), *o, *blank) for o in others)]


def _name(name: str) -> str:
    return tag("td", tag("code", wrappable_name(name)))


def limit_cells(finest: float | None, found: ConvergenceEstimate, unit: str) -> list[str]:
    """Return five table cells on the convergence of a value with mesh refinement.

    They are the value `finest` on the finest mesh, the order of convergence, the extrapolated limit, the grid
    convergence index, and whether the meshes are in the asymptotic range.
    """
    mark = "" if found.asymptotic else " ‡"
    order = DASH if found.order is None else typeset_number(f"{found.order:.2f}") + mark
    below = "" if found.relative is None else typeset_number(f"{100 * found.relative:.2g} %")
    sign, mood, doubt = ("✓ yes", "good", "") if found.asymptotic else ("✗ no", "warn", found.doubt or found.reason)
    return [
        cell(amount(finest, unit)), cell(order), cell(amount(found.value, unit, mark=mark)),
        cell(amount(found.gci, unit, 3, mark), below),
        tag("td", tag("span", sign, class_=f"status {mood}"), tag("small", text(doubt)) if doubt else "", class_="why"),
    ]  # fmt: skip


def amount(value: float | None, unit: str, digits: int = 6, mark: str = "") -> str:
    """Return a value with its unit as text, followed by `mark`; a dash if there is no value."""
    return DASH if value is None else format_quantity(value, unit, digits, percent=True) + mark


def _error_order(entry: LineOrders, metric: str) -> str:
    own = entry.errors[metric]
    if own.order.last is None:
        return cell(DASH, own.order.reason or "")
    mark = "" if entry.asymptotic else " ‡"
    below = "all: " + typeset_number(f"{own.order.fitted:.2f}")
    beyond = ", only errors above the uncertainty" if own.cut else ""
    return cell(typeset_number(f"{own.order.last:.2f}") + mark, below + beyond)


# ------------------------------------------------------------------ distances


def distances(view: SceneView) -> str:
    """Return a table of the differences between the deformed shapes of all models and references.

    A difference is the relative l2 norm of the displacement difference at shared points. The table is empty if there
    are fewer than two results.
    """
    known = view.analysis.distances
    names = known.names
    if len(names) < 2:
        return ""
    head = [heading("row minus column"), *(heading(f"`{n}`", True) for n in names)]
    reasons = {(r.row, r.column): r.reason for r in known.reasons}
    rows = []
    for i, name in enumerate(names):
        kind = "reference" if known.kinds[i] == "reference" else _label_suffix(known.labels[i], name)
        values = list(zip(known.matrix[i], names, strict=True))
        cells = [_distance(v, reasons.get((name, other)), i == j) for j, (v, other) in enumerate(values)]
        rows.append(row(row_head(name, kind), *cells))
    caption = (
        "Difference between deformed shapes: relative l2 norm of the displacement difference at shared points, "
        "relative to the model of the column. Each model is in its finest configuration."
    )
    lines: list[list[Cell]] = [[n, *known.matrix[i]] for i, n in enumerate(names)]
    return table(caption, head, rows, "matrix") + csv_link(f"{view.scene}-distances", ["row", *names], lines)


def _label_suffix(label: str, name: str) -> str:
    """Return the part of a label after the name of its model."""
    return label.removeprefix(name).removeprefix(", ")


def _distance(value: float | None, reason: str | None, own: bool) -> str:
    if own:
        return cell("·")
    return cell(DASH, reason or "") if value is None else cell(format_quantity(value, "1", 3, percent=True))


# ------------------------------------------------------------------ levers


def change_effects(view: SceneView) -> str:
    """Return a table of the effects of single changes; empty if no two configurations differ by only one value."""
    entries = view.analysis.levers
    if not entries:
        return ""
    head = [heading(w) for w in ("Model", "Change", "With")]
    head += [heading(view.effort_name, True), *(heading(f"`{m}`", True) for m in view.metrics)]
    rows = [_change_effect_row(lever, [lever.errors[m] for m in view.metrics]) for lever in entries]
    return table("Effect of a single change: ratio of the new value to the old one.", head, rows)


def _change_effect_row(lever: ChangeEffect, errors: Sequence[ErrorChange]) -> str:
    change = tag("td", tag("code", wrappable_name(lever.what)), " ", text(f"{lever.from_} → {lever.to}"))
    others = ", ".join(f"{k} = {v}" for k, v in lever.others.items())
    cells = [_ratio(e.ratio, "within the uncertainty" if e.within_uncertainty else "") for e in errors]
    effort = _ratio(lever.effort_ratio, "within the noise" if lever.noise else "")
    return row(row_head(lever.model), change, tag("td", text(others or DASH)), effort, *cells)


def _ratio(value: float | None, below: str) -> str:
    return cell(DASH if value is None else f"×\u00a0{value:.3g}", below)
