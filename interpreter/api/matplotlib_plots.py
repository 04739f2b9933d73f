"""Plots of a report with matplotlib: deformed lines, time histories, curves, and metrics from state to state.

`KINDS` maps each kind of plot to the function that lists its plots by name. To add a kind: write such a function and
the functions that make its drawings.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.interpreter.api import api_arguments
from softmark.interpreter.api.optional_packages import import_extra
from softmark.interpreter.language.number_formatting import choose_scale
from softmark.interpreter.report.charts.curve_styles import CurveStyle
from softmark.interpreter.report.page.html_markup import join_names
from softmark.interpreter.report.run.figures import centre_lines, state_charts, time_histories
from softmark.interpreter.report.run.report_summary import MetricColumn, ReportSummary
from softmark.interpreter.report.run.tables.line_probes import curve_styles, lines_of
from softmark.interpreter.results.run_report import PlottedCurve, Report
from softmark.interpreter.results.state_results import TimeState
from softmark.records import dataclass

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    Values = Sequence[float] | NDArray[np.float64]

# colours of Okabe and Ito (2008) and three more, as in the light theme of the report (`report.css`)
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#c2689a", "#b57b00", "#2f8fcb", "#7a52b3", "#8a5a35", "#a02552")
NEUTRAL = "#59636e"  # colour of references
MARKERS = {"circle": "o", "square": "s", "triangle": "^", "diamond": "D", "wedge": "v", "plus": "P", "cross": "X"}
MARKED = 8  # marks along a curve


@dataclass(frozen=True)
class Trace:
    """One line of a plot: x and y in SI, and the bounds `low` and `high` of its uncertainty band."""

    name: str
    x: Values
    y: Values
    low: Values | None = None
    high: Values | None = None


@dataclass(frozen=True)
class Drawing:
    """Content of a plot: symbols and units of both axes, and its lines.

    `equal` is true if both axes have the same scale.
    """

    title: str
    x: tuple[str, str]
    y: tuple[str, str]
    traces: Sequence[Trace]
    equal: bool = False


Found = Mapping[str, Callable[[], Drawing]]  # drawings by name


def plot(report: Report, name: str | None, kind: str | None, ax: Axes | None) -> Axes:
    """Draw a probe or a metric, by default the first available one. Raises BadArgument and MissingExtra."""
    findings = ReportSummary(report)
    drawing = _requested_drawing(findings, name, kind)
    pyplot = import_extra("matplotlib.pyplot", "report.plot()", "plot")
    own = ax if ax is not None else pyplot.subplots(layout="constrained")[1]
    _draw(drawing, curve_styles(report), own)
    return own


def _requested_drawing(findings: ReportSummary, name: str | None, kind: str | None) -> Drawing:
    """Return the requested drawing; by default the first available one. Raises BadArgument."""
    if name is not None:
        api_arguments.check_text("name", name, "the name of a probe or a metric, or None")
    if kind is not None and kind not in KINDS:
        api_arguments.raise_bad_argument("kind", kind, f"one of {join_names([f'`{k}`' for k in KINDS])}, or None")
    known = {k: find(findings) for k, find in KINDS.items()}
    for k, found in known.items():
        if kind in (None, k) and (name in found or (name is None and found)):
            return found[name if name is not None else next(iter(found))]()
    raise api_arguments.BadArgument(_unavailable_plot_message(findings, name, kind, known))


def _unavailable_plot_message(
    findings: ReportSummary, name: str | None, kind: str | None, known: Mapping[str, Found]
) -> str:
    """Return the error message for a plot that cannot be drawn: the reason, and the names that can be drawn."""
    drawn = [f"`{n}` ({k})" for k, found in known.items() for n in found]
    can = (
        f"available: {join_names(drawn)}"
        if drawn
        else "this report has no data to draw; `report.frame()` has its numbers"
    )
    asked = f"`{name}`" if name is not None else "This report"
    how = f" as `{kind}`" if kind else ""
    if name is None:
        why = "it has no data"
    elif any(name in found for found in known.values()):
        why = "it has data of another kind"
    elif name in [m.name for m in findings.metrics]:
        why = "it has one number for each model"
    elif name in findings.probes:
        why = "it is not a line, and there is no motion"
    else:
        why = "the report has no probe or metric of this name"
    return f"{asked} cannot be drawn{how}: {why}; {can}"


# ------------------------------------------------------------------ available drawings


def _deformed_line_drawings(findings: ReportSummary) -> Found:
    """Return the drawings of deformed lines by probe, each in the plane in which the line bends."""

    def made(number: int, probe: str) -> Drawing:
        own = centre_lines.CentreLineFigure(findings, number, probe)
        i, j = own.plane
        traces = [Trace(n, X[:, i], X[:, j]) for n, X in own.lines.items() if n not in own.omitted_models]
        left = f", without {join_names(own.omitted_models)} (outside the drawing)" if own.omitted_models else ""
        return Drawing(f"{probe}{left}", (own.axes[0], "m"), (own.axes[1], "m"), traces, equal=True)

    return {probe: lambda n=n, p=probe: made(n, p) for n, probe in enumerate(lines_of(findings))}  # type: ignore[misc]


def _histories(findings: ReportSummary) -> Found:
    """Return the drawings of displacements over time, by name."""

    def made(course: time_histories.PointHistory) -> Drawing:
        traces = [Trace(n, course.moments, u) for n, u in course.values.items()]
        return Drawing(course.probe, ("t", "s"), (course.symbol, "m"), traces)

    return {c.probe: lambda c=c: made(c) for c in time_histories.point_histories(findings)}  # type: ignore[misc]


def _curves(findings: ReportSummary) -> Found:
    """Return the drawings of metrics that are curves, by name, with the reference curves."""
    found: dict[str, Callable[[], Drawing]] = {}
    for metric in findings.metrics:
        seen = {n: m.curve for n, r in findings.all_results.items() if (m := r.metrics.get(metric.name)) and m.curve}
        if seen:
            against = findings.report.references.get(metric.against or "")
            known = None if against is None else against.drawn
            found[metric.name] = lambda m=metric, c=seen, k=known: _curve(m, c, k)  # type: ignore[misc]
    return found


def _curve(metric: MetricColumn, seen: Mapping[str, PlottedCurve], known: PlottedCurve | None) -> Drawing:
    """Return the drawing of a metric: the curves of models, and the reference curve over the same range."""
    across, up = next(iter(seen.values())).units
    traces = [Trace(name, curve.x, curve.y) for name, curve in seen.items()]
    if known is not None:
        low, high = (end(float(end(c.x)) for c in seen.values()) for end in (min, max))
        traces.insert(0, _clip_curve(str(metric.against), known, low, high))
    return Drawing(metric.name, ("t" if across == "s" else "x", across), ("y", up), traces)


def _clip_curve(name: str, curve: PlottedCurve, low: float, high: float) -> Trace:
    """Return the part of a curve between `low` and `high` of x, with its uncertainty band."""
    near = np.flatnonzero((curve.x >= low) & (curve.x <= high))
    first, last = (near[0], near[-1]) if len(near) else (np.searchsorted(curve.x, low),) * 2
    own = slice(max(int(first) - 1, 0), int(last) + 2)
    band: tuple[Any, ...] = () if curve.band is None else curve.band
    if curve.band is None and curve.uncertainty is not None:
        band = (curve.y - curve.uncertainty, curve.y + curve.uncertainty)
    return Trace(name, curve.x[own], curve.y[own], *(edge[own] for edge in band))


def _metric_by_state_drawings(findings: ReportSummary) -> Found:
    """Return the drawings of metrics from state to state, by name."""

    def made(metric: Any, curves: Mapping[str, Any]) -> Drawing:
        traces = [Trace(n, *zip(*curve.known, strict=True)) for n, curve in curves.items()]
        timed = any(isinstance(s, TimeState) for curve in curves.values() for s in curve.states)
        return Drawing(metric.name, ("t", "s") if timed else ("state", "1"), (metric.name, metric.unit), traces)

    known = ((m, state_charts.curves_of(findings, m.name)) for m in findings.metrics)
    return {m.name: lambda m=m, c=curves: made(m, c) for m, curves in known if curves}  # type: ignore[misc]


KINDS: Mapping[str, Callable[[ReportSummary], Found]] = {
    "line": _deformed_line_drawings, "history": _histories, "curve": _curves, "states": _metric_by_state_drawings,
}  # fmt: skip


# ------------------------------------------------------------------ drawing


def _draw(drawing: Drawing, known: Mapping[str, CurveStyle], ax: Any) -> None:
    """Draw the lines of a drawing into `ax`, with a legend and units on both axes."""
    x = choose_scale(_flatten_values(t.x for t in drawing.traces), drawing.x[1], percent=True)
    y = choose_scale(_flatten_values(t.y for t in drawing.traces), drawing.y[1], percent=True)
    for trace in drawing.traces:
        style = _style(known.get(trace.name), len(trace.x))
        ax.plot(_divide_values(trace.x, x.factor), _divide_values(trace.y, y.factor), label=trace.name, **style)
        if trace.low is not None and trace.high is not None:
            band = (_divide_values(trace.low, y.factor), _divide_values(trace.high, y.factor))
            ax.fill_between(_divide_values(trace.x, x.factor), *band, color=style["color"], alpha=0.18, linewidth=0)
    ax.set(xlabel=x.heading(drawing.x[0]), ylabel=y.heading(drawing.y[0]), title=drawing.title)
    if drawing.equal:
        ax.set_aspect("equal", adjustable="datalim")
    ax.grid(alpha=0.3)
    ax.legend(fontsize="small")


def _flatten_values(values: Iterable[Values]) -> list[float]:
    return [float(v) for own in values for v in own]


def _divide_values(values: Values, factor: float) -> list[float]:
    return [float(v) / factor for v in values]


def _style(look: CurveStyle | None, count: int) -> dict[str, Any]:
    """Return colour, dash and markers of a line as in the report; undeformed lines are dotted."""
    if look is None:
        return {"color": NEUTRAL, "linestyle": ":", "linewidth": 1.2}
    dash = [float(d) for d in look.dash.split()]
    style: dict[str, Any] = {"color": NEUTRAL, "linewidth": 2.6, "zorder": 1.5}
    if look.role == "model":
        marks = {"marker": MARKERS[look.marker], "markersize": 4.5, "markevery": max(1, count // MARKED)}
        style = {"color": COLOURS[look.colour % len(COLOURS)], "linewidth": 1.5, **marks}
    return style | ({"linestyle": (0, tuple(dash))} if dash else {})
