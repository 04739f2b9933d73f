"""Tables of a comparison: all points, effort to an error, best within a frame, orders, distances, single changes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from softmark.interpreter.language.amounts import grouped, quantity, signed
from softmark.interpreter.report.compare.view import View, error_of, point_label, spread_range, status_of
from softmark.interpreter.report.page.markup import broken, prose, tag, text
from softmark.interpreter.report.page.sheet import Cell, csv_link
from softmark.interpreter.study.analysis.point import SOLVED, UNKNOWNS, Point, frame_of, reduced_of, spread_of

MOODS = {"converged": ("✓", "good"), "capped": ("~", "quiet"), "skipped": ("–", "quiet")}
DASH = "–"


def table(caption: str, head: Sequence[str], rows: Sequence[str], kind: str = "") -> str:
    """A table in its scrolling box; `head` and `rows` are markup."""
    label = tag("caption", tag("span", prose(caption)))
    own = tag("table", label, tag("thead", tag("tr", *head)), tag("tbody", *rows), class_=f"compared {kind}".strip())
    return tag("div", own, class_="scroll", tabindex=0, role="region", aria_label=caption.replace("`", ""))


def heading(words: str, number: bool = False) -> str:
    """The head of a column."""
    return tag("th", prose(words), scope="col", class_="n" if number else None)


def row_head(name: str, below: str = "") -> str:
    """The head of a row."""
    return tag("th", tag("code", broken(name)), tag("small", text(below)) if below else "", scope="row")


def cell(words: str, below: str = "", best: bool = False) -> str:
    """A number and what stands below it; words are text."""
    shown = tag("strong", text(words)) if best else text(words)
    return tag("td", shown, tag("small", prose(below)) if below else "", class_="n")


def row(*cells: str) -> str:
    """A row of a table."""
    return tag("tr", *cells)


# ------------------------------------------------------------------ all points


def all_points(view: View) -> str:
    """Every configuration with its status, size, errors, times and solver, and a CSV of it."""
    seen: set[tuple[str, str]] = set()
    rows = []
    for point in view.points:
        if (identity := (str(point["key"]), point_label(point))) not in seen:
            rows.append(_point(view, point))
        seen.add(identity)
    head = [heading(w) for w in ("Configuration", "Status")]
    named = (f"`{m}`" for m in (*view.metrics, *view.measurements))
    head += [heading(w, True) for w in (*named, "Unknowns", *_clocks(view))]
    head += [heading("Solver"), heading("Timing")]
    star = " ★: on the front of this error." if any(own["front"] for own in view.metrics.values()) else ""
    dagger = " †: within the uncertainty of the reference." if any(
        own["uncertainty"] for own in view.metrics.values()
    ) else ""  # fmt: skip
    return table(f"All configurations.{star}{dagger}", head, rows, "points-table") + _points_csv(view)


def _clocks(view: View) -> tuple[str, ...]:
    return (view.effort_name, "Set-up", "Memory") if view.timed else ()


def _point(view: View, point: Point) -> str:
    sign, mood = MOODS.get(str(point["status"]), ("✗", "bad"))
    words = " " + text(status_of(point))
    if point["status"] == "converged":  # the usual: the sign is enough for those who see it
        words = tag("span", words, class_="spoken")
    status = tag("span", tag("span", sign, aria_hidden="true"), words, class_=f"status {mood}")
    size, solve = point.get("size") or {}, point.get("solve") or {}
    unknowns = grouped(size["dofs"]) if size.get("dofs") else DASH
    cells = [row_head(point_label(point), str(point.get("outline") or "")), tag("td", status, _unbalanced(point))]
    cells += [_error(view, point, metric) for metric in view.metrics]
    cells += [cell(view.measured(point, metric)[1]) for metric in view.measurements]
    cells += [cell(unknowns), *(_times(view, point) if view.timed else ()), _solver(solve)]
    return row(*cells, tag("td", _quality(point), class_="quality"))


def _unbalanced(point: Point) -> str:
    """What is left of the full model's equations, where only reduced ones were solved."""
    left = reduced_of(point).get("full_residual")
    return "" if left is None else tag("small", text(f"full equations: {left:.2g} of the load is not balanced"))


def _solver(solve: Mapping[str, Any]) -> str:
    """Which linear solver, after how many iterations."""
    rounds = solve.get("iterations")
    below = "" if rounds is None else tag("small", text(f"{rounds} iteration" + ("" if rounds == 1 else "s")))
    return tag("td", text(solve.get("linear_solver") or DASH), below, class_="solver")


def _error(view: View, point: Point, metric: str) -> str:
    error = error_of(point, metric)
    if error is None:
        own = (point.get("errors") or {}).get(metric) or {}
        solved = point["status"] in SOLVED
        return cell(DASH, str(own.get("reason") or "not measured") if solved else "")
    uncertainty = view.metrics[metric]["uncertainty"] or 0.0
    starred = point["key"] in view.metrics[metric]["front"]
    said = view.amount(error, metric) + (" †" if error < uncertainty else "") + (" ★" if starred else "")
    return cell(said, best=starred)


def _times(view: View, point: Point) -> list[str]:
    cost = point.get("cost") or {}
    spread, setup = view.effort(point), spread_of(cost.get("setup_s"))
    memory = cost.get("memory_bytes")
    time = cell(quantity(spread.median, "s", 3), spread_range(spread.to_json())) if spread else cell(DASH)
    return [time, cell(quantity(setup.median, "s", 3) if setup else DASH), cell(said_bytes(memory))]


def said_bytes(number: float | None) -> str:
    """`12.3 MB`."""
    if not number:
        return DASH
    power = next((p for p in (9, 6, 3) if number >= 10**p), 0)
    return f"{number / 10**power:.3g}\u00a0{ {9: 'GB', 6: 'MB', 3: 'kB', 0: 'B'}[power] }"


def _quality(point: Point) -> str:
    """Runs, runs left out, and what was flagged."""
    cost = point.get("cost")
    if not cost:
        return DASH
    runs = (cost.get("cpu_s") or cost.get("wall_s") or {}).get("runs")
    said = [f"{runs} run" + ("" if runs == 1 else "s")] if runs else []
    said += [f"{cost['excluded_runs']} left out"] if cost.get("excluded_runs") else []
    said += ["disturbed"] if cost.get("contaminated") else []
    return text(", ".join([*said, *(str(flag) for flag in cost.get("flags") or ())])) or DASH


def _points_csv(view: View) -> str:
    clocks = ("cpu_s", "wall_s", "step_s", "setup_s")
    parts = ("median", "q1", "q3", "runs")
    header = ["configuration", "model", "study", "status", "message", "nodes", "elements", "dofs"]
    header += [f"{m} [{own['unit']}]" for m, own in view.metrics.items()]
    header += [f"{m} [{unit}]" for m, unit in view.measurements.items()]
    times = [f"{clock.removesuffix('_s')} {part}" for clock in clocks for part in parts]
    header += [time if time.endswith("runs") else f"{time} [s]" for time in times]
    header += ["memory [B]", "iterations", "linear solver", "disturbed", "flags"]
    rows: list[list[Cell]] = []
    for p in view.points:
        cost, size, solve = p.get("cost") or {}, p.get("size") or {}, p.get("solve") or {}
        own: list[Cell] = [
            point_label(p),
            str(p["model"]),
            p.get("study"),
            str(p["status"]),
            p.get("message"),
        ]
        own += [size.get(k) for k in ("nodes", "elements", "dofs")] + [error_of(p, m) for m in view.metrics]
        own += [view.measured(p, m)[0] for m in view.measurements]
        own += [(cost.get(clock) or {}).get(part) for clock in clocks for part in parts]
        own += [cost.get("memory_bytes"), solve.get("iterations"), solve.get("linear_solver")]
        rows.append([*own, "yes" if cost.get("contaminated") else "no", "; ".join(cost.get("flags") or ())])
    return csv_link(f"{view.scene}-points", header, rows, "Save all configurations as CSV")


# ------------------------------------------------------------------ effort to an error


def effort_to_error(view: View) -> str:
    """For every error: what each line needs to get to each level."""
    return "".join(_levels(view, metric) for metric, own in view.metrics.items() if own["levels"])


def _levels(view: View, metric: str) -> str:
    levels = view.metrics[metric]["levels"]
    head = [heading("Line"), *(heading(f"{view.amount(v['level'], metric)} or less", True) for v in levels)]
    rows = []
    for i, line in enumerate(view.lines):
        entries = [v["lines"][i] for v in levels]
        cells = [_level(view, e, e["line"] == v["best"], metric) for v, e in zip(levels, entries, strict=True)]
        rows.append(row(row_head(str(line["label"])), *cells))
    words = (
        f"{view.effort_name} to an error of `{metric}`, against `{view.metrics[metric]['against']}`. Interpolated: "
        "between two neighbouring configurations of the line, straight in the logarithms; all else was computed. "
        "The least of a column is in bold."
    )
    return table(words, head, rows)


def _level(view: View, entry: Mapping[str, Any], best: bool, metric: str) -> str:
    if entry["effort"] is None:
        least = entry.get("least_error")
        why = str(entry["reason"])
        return cell(DASH, f"not below {view.amount(least, metric)}" if why == "it stays above" and least else why)
    names = [point_label(view.by_key[key]) for key in entry["keys"]]
    below = "interpolated" if entry["interpolated"] else f"`{names[0]}`" if names[0] != entry["line"] else ""
    spread = "" if view.clock == UNKNOWNS else spread_range(entry["effort"])
    said = view.said_effort(entry["effort"]) if not spread else quantity(entry["effort"]["median"], "s", 3)
    return cell(said, ", ".join(part for part in (spread, below) if part), best)


# ------------------------------------------------------------------ best within a frame


def best_at_rates(view: View) -> str:
    """For every error and rate: the most accurate configuration that fits, and the next model."""
    if not view.timed or not any(frame_of(p) for p in view.points):
        return tag("p", "Nothing was timed, so nothing is known of frames.", class_="quiet")
    words = (
        "Error",
        "Frame",
        "Most accurate that fits",
        "Error there",
        "Takes",
        "Left",
        "Next model",
        "Not sure",
    )
    head = [heading(w, w in ("Error there", "Takes", "Left")) for w in words]
    rows = [_rate(view, metric, rate) for metric, own in view.metrics.items() for rate in own["rates"]]
    caption = (
        "The least error within a frame. A configuration fits if the third quartile of its times does, or 95 % of its "
        "steps; a whole solution must fit where there are no steps. Not sure: the median fits, but not that."
    )
    return table(caption, head, rows)


def _rate(view: View, metric: str, rate: Mapping[str, Any]) -> str:
    frame = tag("td", text(f"{rate['hz']:g} Hz"), tag("small", text(quantity(rate["frame_s"], "s", 3))))
    unsure = tag("td", prose(", ".join(f"`{label}`" for label in rate["unsure"]) or DASH))
    begin = [tag("td", tag("code", broken(metric))), frame]
    if rate["key"] is None:
        return row(*begin, tag("td", DASH, tag("small", prose(str(rate["reason"]))), colspan=5), unsure)
    other = rate.get("runner_up")
    second = f"`{other['label']}`" if other else DASH
    below = view.amount(other["error"], metric) if other else ""
    within = " †" if rate["within_uncertainty"] else ""
    return row(
        *begin, tag("td", tag("code", broken(str(rate["label"])))), cell(view.amount(rate["error"], metric) + within),
        cell(quantity(rate["takes"]["median"], "s", 3), spread_range(rate["takes"])),
        cell(f"{100 * rate['margin']:.0f}\u00a0%"), tag("td", prose(second), tag("small", text(below))), unsure,
    )  # fmt: skip


# ------------------------------------------------------------------ orders


def orders(view: View) -> str:
    """Observed orders and limits of every line that refines something; empty where none does."""
    entries = view.analysis["orders"]
    if not entries:
        return ""
    head = [
        heading("Line"),
        heading("Probe"),
        *(heading(w, True) for w in ("Finest", "Order", "Limit", "± (GCI)")),
    ]
    head += [heading("Asymptotic"), *(heading(f"order of `{m}`", True) for m in view.metrics)]
    rows = [r for entry in entries for r in _order(view, entry)]
    caption = (
        "Refinement. Finest: the largest displacement of the probe on the finest mesh; limit: where Richardson's "
        "extrapolation puts it; ±: the grid convergence index, half a width about the finest value. Orders of errors: "
        "between the finest two, and by least squares over all. ‡: outside the asymptotic range, not to be relied upon."
    )
    return table(caption, head, rows)


def _order(view: View, entry: Mapping[str, Any]) -> list[str]:
    """A row for each probe; the errors stand in the first."""
    limits = entry["limits"] or [{"probe": DASH, "reason": entry["doubt"]}]
    found = []
    for i, limit in enumerate(limits):
        errors = [_error_order(entry, m) if i == 0 else tag("td") for m in view.metrics]
        found.append(row(row_head(str(entry["line"])) if i == 0 else tag("td"), *_limit(limit), *errors))
    return found


def _limit(limit: Mapping[str, Any]) -> list[str]:
    good, doubt = bool(limit.get("asymptotic")), limit.get("doubt") or limit.get("reason")
    mark = "" if good else " ‡"
    numbers = [("finest", "m"), ("order", ""), ("value", "m"), ("gci", "m")]
    shown = [_marked(limit.get(name), unit, mark if name != "finest" else "") for name, unit in numbers]
    if limit.get("relative") is not None:
        shown[3] = cell(quantity(limit["gci"], "m", 3) + mark, signed(f"{100 * limit['relative']:.2g} %"))
    sign = tag("span", "✓ yes" if good else "✗ no", class_="status good" if good else "status warn")
    said = tag("td", sign, tag("small", text(doubt)) if doubt and not good else "", class_="why")
    return [tag("td", tag("code", broken(str(limit["probe"])))), *shown, said]


def _marked(value: float | None, unit: str, mark: str) -> str:
    return cell(DASH if value is None else (quantity(value, unit, 6) if unit else signed(f"{value:.2f}")) + mark)


def _error_order(entry: Mapping[str, Any], metric: str) -> str:
    own = entry["errors"].get(metric) or {}
    if own.get("last") is None:
        return cell(DASH, str(own.get("reason") or ""))
    mark = "" if entry["asymptotic"] else " ‡"
    below = "all: " + signed(f"{own['fitted']:.2f}")
    beyond = ", those above the uncertainty" if own.get("cut") else ""
    return cell(signed(f"{own['last']:.2f}") + mark, below + beyond)


# ------------------------------------------------------------------ distances


def distances(view: View) -> str:
    """How far everyone is from everyone; empty where there is nobody to be far from."""
    known = view.analysis["distances"]
    names = known["names"]
    if len(names) < 2:
        return ""
    head = [heading("from row to column"), *(heading(f"`{n}`", True) for n in names)]
    reasons = {(r["row"], r["column"]): r["reason"] for r in known["reasons"]}
    rows = []
    for i, name in enumerate(names):
        kind = "reference" if known["kinds"][i] == "reference" else _beyond(known["labels"][i], name)
        values = list(zip(known["matrix"][i], names, strict=True))
        cells = [_distance(v, reasons.get((name, other)), i == j) for j, (v, other) in enumerate(values)]
        rows.append(row(row_head(name, kind), *cells))
    caption = (
        "Distance of shapes: the root of the summed squares of the differences of displacements at the points that two "
        "share, relative to the displacements of the column. Models at their finest configuration."
    )
    lines: list[list[Cell]] = [[n, *known["matrix"][i]] for i, n in enumerate(names)]
    return table(caption, head, rows, "matrix") + csv_link(f"{view.scene}-distances", ["row", *names], lines)


def _beyond(label: str, name: str) -> str:
    """What a label says beyond the name of its model."""
    return label.removeprefix(name).removeprefix(", ")


def _distance(value: float | None, reason: str | None, own: bool) -> str:
    if own:
        return cell("·")
    return cell(DASH, reason or "") if value is None else cell(quantity(value, "1", 3, percent=True))


# ------------------------------------------------------------------ levers


def levers(view: View) -> str:
    """What one changed thing does; empty where no two configurations differ by one."""
    entries = view.analysis["levers"]
    if not entries:
        return ""
    head = [heading(w) for w in ("Model", "Change", "With")]
    head += [heading(view.effort_name, True), *(heading(f"`{m}`", True) for m in view.metrics)]
    rows = []
    for e in entries:
        change = tag("td", tag("code", broken(e["what"])), " ", text(f"{e['from']} → {e['to']}"))
        others = ", ".join(f"{k} = {v}" for k, v in e["others"].items())
        cells = [_ratio(e["effort_ratio"], "within the noise" if e["noise"] else "")]
        for m in view.metrics:
            own = e["errors"].get(m) or {}
            cells.append(_ratio(own.get("ratio"), "within the uncertainty" if own.get("within_uncertainty") else ""))
        rows.append(row(row_head(str(e["model"])), change, tag("td", text(others or DASH)), *cells))
    return table("What a single change does: each number is the new value over the old one.", head, rows)


def _ratio(value: float | None, below: str) -> str:
    return cell(DASH if value is None else f"×\u00a0{value:.3g}", below)
