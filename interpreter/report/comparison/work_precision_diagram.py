"""Work-precision diagram: error against effort, with one line per refined model and the Pareto front."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import cached_property

from softmark.interpreter.language.number_formatting import (
    Scale,
    choose_scale,
    format_quantity,
    group_digits,
    typeset_number,
)
from softmark.interpreter.report.charts.chart_axes import Axis, logarithmic
from softmark.interpreter.report.charts.curve_labels import Point as Place
from softmark.interpreter.report.charts.line_chart import Chart, Curve
from softmark.interpreter.report.comparison.comparison_view import CLOCKS, SceneView, status_of
from softmark.interpreter.report.page.embedded_csv import Cell, csv_link
from softmark.interpreter.report.page.figure_frame import SHOWN, ColumnGroup, figure_block
from softmark.interpreter.report.page.html_markup import count, prose, strip_backticks, tag, text
from softmark.interpreter.study.analysis.comparison_analysis import ErrorAnalysis
from softmark.interpreter.study.analysis.comparison_point import UNKNOWNS, ComparedPoint, Spread
from softmark.records import dataclass

WIDTH, HEIGHT, LEFT, TOP = 620.0, 400.0, 84.0, 44.0
NAMED = 9  # with more lines than this, only the legend names them
RATES = ((25.0, "25 Hz"), (300.0, "300 Hz"), (1000.0, "1 kHz"))
BELOW = 20.0  # the error axis ends at the uncertainty divided by this: smaller differences have no meaning
TOLD = 0.1  # fraction of the least error; a smaller uncertainty is not drawn
END = 0.97  # fraction of the axis beyond which a long label would stick out
RING = 7.0


@dataclass(frozen=True)
class _Row:
    """Row of the data table: a configuration of a refinement line, with its effort and error if they are known."""

    line: int
    point: ComparedPoint
    effort: Spread | None
    error: float | None

    @property
    def is_drawable(self) -> bool:
        """True if the configuration has an effort and an error, so that it can be drawn."""
        return self.effort is not None and self.error is not None


@dataclass(frozen=True)
class Diagram:
    """Diagram of one error metric of one scene against the effort, a time or the number of unknowns.

    With `frames`, the horizontal axis is the computing time that must fit into one frame for real time.
    """

    view: SceneView
    number: int
    metric: str
    frames: bool = False

    @property
    def known(self) -> ErrorAnalysis:
        """Analysis of the metric, with its Pareto front and uncertainty."""
        return self.view.metrics[self.metric]

    @property
    def uncertainty(self) -> float:
        """Uncertainty of the reference, in the unit of the error."""
        return self.known.uncertainty

    @cached_property
    def rows(self) -> list[_Row]:
        """Rows of the configurations of all refinement lines, in the order of each line."""
        found = []
        for i, line in enumerate(self.view.lines):
            for point in (self.view.by_key[key] for key in line.keys):
                effort = point.cost.frame if self.frames else self.view.effort(point)
                place = (effort, point.error(self.metric)) if point.solved else (None, None)
                found.append(_Row(i, point, *place))
        return found

    @cached_property
    def drawable_rows(self) -> list[_Row]:
        """Rows of the configurations that can be drawn."""
        return [row for row in self.rows if row.is_drawable]

    @property
    def clock(self) -> str:
        """Kind of effort on the horizontal axis, such as CPU time."""
        return "wall_s" if self.frames else self.view.clock

    def figure(self) -> str:
        """Return the figure with its data as HTML; if nothing can be drawn, a sentence about the missing data."""
        if not self.drawable_rows:
            why = _group_names_by_reason(self.known.judged.left_out.values())
            said = f"No diagram of `{self.metric}`: {why or 'there is nothing to draw'}."
            return tag("p", prose(said), class_="quiet")
        frame = "-frame" if self.frames else ""
        chart = Chart(
            f"work-{self.view.number}-{self.number}{frame}",
            self.title,
            self._description(),
            self.across,
            self.error_axis,
            WIDTH,
            HEIGHT,
            tuple(self._curves()),
            left=LEFT,
            top=TOP,
            right=24.0,
            bottom=60.0,
        )
        chart = replace(chart, under=Overlay(self, chart).markup())
        shown = [line.name for line in self.view.lines][:SHOWN] if len(self.view.lines) > SHOWN else None
        return figure_block(chart, prose(self._caption(shown)), self._columns(), self._csv_link(), open_=shown)

    @property
    def title(self) -> str:
        """Title of the diagram, such as `eta against CPU time`."""
        return f"{self.metric} against {self.effort_name}"

    @property
    def effort_name(self) -> str:
        """Name of the effort on the abscissa, such as `CPU time of a solution`."""
        if self.frames:
            return "time of a step"
        return CLOCKS[self.view.clock] if self.view.timed else "number of unknowns"

    # -------------------------------------------------------------- axes

    @cached_property
    def across(self) -> Axis:
        """Axis of the effort, from the smallest first quartile to the largest third quartile."""
        efforts = [row.effort for row in self.drawable_rows if row.effort is not None]
        low, high = min(s.q1 or s.median for s in efforts), max(s.q3 for s in efforts)
        if self.clock == UNKNOWNS:
            return _without_overhanging_label(
                _decade_axis(low / 1.15, high * 1.15, self.effort_name, lambda v: group_digits(round(v)))
            )
        return _without_overhanging_label(
            _decade_axis(low / 1.15, high * 1.15, self.effort_name, lambda v: format_quantity(v, "s", 3))
        )

    @cached_property
    def error_axis(self) -> Axis:
        """Axis of the error; its lower end is far below the uncertainty but above zero."""
        positive = [e for row in self.drawable_rows if (e := row.error) is not None and e > 0]
        near = self.uncertainty >= TOLD * min(positive, default=0.0)
        high = max([*positive, self.uncertainty if near else 0.0]) or 1e-12
        low = min([*positive, self.uncertainty or high] if near else positive, default=high)
        low = max(low, self.uncertainty / BELOW, high * 1e-12)
        name = f"{self.metric}, from {self.known.against}"
        return _decade_axis(low / 1.3, high * 1.3, name, lambda v: self.view.amount(v, self.metric))

    def place(self, row: _Row) -> Place | None:
        """Return the position of a configuration in the plot; an error below the axis is drawn at its lower edge."""
        if row.effort is None or row.error is None:
            return None
        return row.effort.median, max(row.error, self.error_axis.low)

    def _curves(self) -> Iterator[Curve]:
        named = len(self.view.lines) <= NAMED
        for i, line in enumerate(self.view.lines):
            points = tuple(self.place(row) if row.line == i else None for row in self.rows)
            yield Curve(line.name, self.view.line_styles[i], points, 1, len(self._symbols), every=1, named=named)

    # -------------------------------------------------------------- words

    def _front(self) -> list[str]:
        return [f"`{self.view.by_key[key].label}`" for key in self.known.front]

    def _description(self) -> str:
        front = ", ".join(strip_backticks(name) for name in self._front()) or "empty"
        configurations = count(len(self.drawable_rows), "configuration")
        return f"Error and cost of {configurations}; Pareto front, fastest first: {front}."

    def _caption(self, shown: Sequence[str] | None) -> str:
        front = self._front()
        said = f"`{self.metric}` against `{self.known.against}`. "
        if front and not self.frames:
            more = f" and {len(front) - SHOWN} more" if len(front) > SHOWN else ""
            order = "smallest" if self.clock == UNKNOWNS else "fastest"
            said += f"On the Pareto front, {order} first: {', '.join(front[:SHOWN])}{more}."
        if self.uncertainty:
            said += f" Uncertainty of the reference: ± {self.view.amount(self.uncertainty, self.metric)}."
        low = [row for row in self.drawable_rows if row.error is not None and row.error < self.error_axis.low]
        said += f" {count(len(low), 'point')} with smaller errors are drawn at the lower edge." if low else ""
        said += (
            f" {SHOWN} of {len(self.view.lines)} lines are shown at first: select others in the legend."
            if shown
            else ""
        )
        lost = self.known.judged.left_out.values()
        return said + (f" Not shown: {_group_names_by_reason(lost)}." if lost else "")

    # -------------------------------------------------------------- numbers

    @property
    def _error_and_effort_scales(self) -> tuple[Scale, Scale]:
        efforts = [row.effort.median for row in self.drawable_rows if row.effort is not None]
        unit = "1" if self.clock == UNKNOWNS else "s"
        return choose_scale([row.error for row in self.drawable_rows], self.known.unit, True), choose_scale(
            efforts, unit
        )

    @property
    def _symbols(self) -> tuple[str, ...]:
        error, effort = self._error_and_effort_scales
        name = "effort" if self.clock == UNKNOWNS else "time"
        times = (effort.heading(name), effort.heading("first quartile"), effort.heading("third quartile"))
        return ("unknowns", error.heading("error"), *(times if self.clock != UNKNOWNS else ()),
                "iterations", "solver", "status")  # fmt: skip

    def _columns(self) -> list[ColumnGroup]:
        names = [(row.point.label,) for row in self.rows]
        cells = [self._cells(row) for row in self.rows]
        return [ColumnGroup("configuration", ("configuration",), names), ColumnGroup(self.metric, self._symbols, cells)]

    def _cells(self, row: _Row) -> tuple[str, ...]:
        (error, effort), point, spread = self._error_and_effort_scales, row.point, row.effort
        seconds = (spread.median, spread.q1, spread.q3) if spread else (None,) * 3
        times = tuple("–" if s is None else typeset_number(f"{s / effort.factor:.4g}") for s in seconds)
        return (
            group_digits(point.dofs) if point.dofs else "–",
            "–" if row.error is None else typeset_number(f"{row.error / error.factor:.4g}"),
            *(times if self.clock != UNKNOWNS else ()),
            "–" if point.iterations is None else str(point.iterations), point.linear_solver or "–",
            status_of(point.status) + (", disturbed" if self.view.disturbed(point) else ""),
        )  # fmt: skip

    def _csv_link(self) -> str:
        unit = self.known.unit
        effort = "unknowns" if self.clock == UNKNOWNS else "time [s]"
        header = ["line", "configuration", "status", f"{self.metric} [{unit}]", effort, "q1", "q3", "on the front"]
        rows: list[list[Cell]] = [
            [
                self.view.lines[r.line].name, r.point.label, r.point.status, r.error,
                *((r.effort.median, r.effort.q1, r.effort.q3) if r.effort else (None, None, None)),
                "yes" if r.point.key in self.known.front else "no",
            ]
            for r in self.rows
        ]  # fmt: skip
        return csv_link(f"{self.metric}-against-{'step' if self.frames else self.view.clock}", header, rows)


def _group_names_by_reason(pairs: Iterable[tuple[str, str]]) -> str:
    """Return names grouped by reason, such as `a, b (it diverged); c (it was not timed)`.

    If there are many names for a reason, only their number is given.
    """
    reasons: dict[str, list[str]] = {}
    for label, reason in pairs:
        reasons.setdefault(reason, []).append(f"`{label}`")
    parts = []
    for reason, labels in reasons.items():
        names = ", ".join(labels) if len(labels) <= 6 else f"{', '.join(labels[:5])} and {len(labels) - 5} more"
        parts.append(f"{names} ({reason})")
    return "; ".join(parts)


def _decade_axis(low: float, high: float, name: str, said: Callable[[float], str]) -> Axis:
    """Return a logarithmic axis with ticks at powers of ten; with few powers also at 2 and 5 in between."""
    axis = logarithmic(low, high, name, "1")
    decades = math.log10(axis.high / axis.low)
    bottom, top = (math.floor(math.log10(v)) for v in (axis.low, axis.high))
    every = max(1, math.ceil((top - bottom) / 7))
    between = (1, 2, 5) if decades <= 2.01 else (1,)
    values = [m * 10.0**k for k in range(bottom, top + 1, every) for m in between]
    within = [v for v in values if axis.low * 0.999 <= v <= axis.high * 1.001]
    return replace(axis, ticks=tuple((v, said(v)) for v in within))


def _without_overhanging_label(axis: Axis) -> Axis:
    """Return the axis without a tick label that would extend beyond its end."""
    return replace(axis, ticks=tuple((v, said) for v, said in axis.ticks if axis.at(v) < END or len(said) <= 4))


# ------------------------------------------------------------------ background of the lines


@dataclass(frozen=True)
class Overlay:
    """Marks drawn over the diagram: uncertainty band, frame limits, Pareto front, quartiles and marks of points."""

    diagram: Diagram
    chart: Chart

    def markup(self) -> str:
        """Return the SVG of all marks drawn over the diagram, from back to front."""
        parts = [self._uncertainty_band(), self._rates(), "" if self.diagram.frames else self._front()]
        rows = [(i, row) for i, row in enumerate(self.diagram.rows) if row.is_drawable]
        return "".join(
            [*parts, *(self._quartile_bar(row) for _, row in rows), *(self._point_marks(row) for _, row in rows)]
        )

    @property
    def _plot_edges(self) -> tuple[float, float, float, float]:
        """Left, top, right and bottom edge of the plot, pixels."""
        c = self.chart
        return c.left, c.top, c.left + c.width, c.top + c.height

    def _uncertainty_band(self) -> str:
        left, _, right, bottom = self._plot_edges
        top = self._y(self.diagram.uncertainty) if self.diagram.uncertainty else bottom
        if top >= bottom - 1:
            return ""
        band = tag("rect", x=f"{left:.1f}", y=f"{top:.1f}", width=f"{right - left:.1f}", height=f"{bottom - top:.1f}",
                   class_="uncertain")  # fmt: skip
        edge = tag("path", d=f"M{left:.1f} {top:.1f}H{right:.1f}", class_="uncertain-edge")
        words = tag("text", "uncertainty of the reference", x=f"{left + 7:.1f}", y=f"{top + 15:.1f}", class_="aside")
        return band + edge + (words if bottom - top > 16 else "")

    def _y(self, error: float) -> float:
        return self.chart.pixel((self.chart.x.low, max(error, self.chart.y.low)))[1]

    def _rates(self) -> str:
        """Return the SVG of vertical lines at the frame times of the frame rates in RATES."""
        stepped = any(row.point.cost.step_s for row in self.diagram.drawable_rows)
        if self.diagram.clock == UNKNOWNS or (stepped and not self.diagram.frames):
            return ""
        return "".join(self._rate(1.0 / hz, said) for hz, said in RATES)

    def _rate(self, period: float, said: str) -> str:
        if not self.chart.x.low < period < self.chart.x.high:
            return ""
        _, top, _, bottom = self._plot_edges
        x = self.chart.pixel((period, self.chart.y.high))[0]
        line = tag("path", d=f"M{x:.1f} {top:.1f}V{bottom:.1f}", class_="rate")
        turn = f"translate({x - 5:.1f} {top + 5:.1f}) rotate(-90)"
        return line + tag("text", text(said), transform=turn, text_anchor="end", class_="aside")

    def _front(self) -> str:
        """Return the SVG of the Pareto front as a step line; points above it or to its right are dominated."""
        front = [row for row in self.diagram.drawable_rows if row.point.key in self.diagram.known.front]
        corners = sorted({(row.effort.median, max(row.error, self.diagram.uncertainty))
                          for row in front if row.effort is not None and row.error is not None})  # fmt: skip
        if not corners:
            return ""
        _, top, right, _ = self._plot_edges
        pixels = [self.chart.pixel((t, max(e, self.chart.y.low))) for t, e in corners]
        path = f"M{pixels[0][0]:.1f} {top:.1f}" + "".join(f"H{x:.1f}V{y:.1f}" for x, y in pixels) + f"H{right:.1f}"
        return tag("path", d=path, class_="front")

    def _quartile_bar(self, row: _Row) -> str:
        """Return the SVG of a bar between the quartiles of the effort."""
        place = self.diagram.place(row)
        if place is None or row.effort is None or row.effort.q1 == row.effort.q3:
            return ""
        ends = (max(row.effort.q1, self.chart.x.low), row.effort.q3)
        (a, y), (b, _) = (self.chart.pixel((t, place[1])) for t in ends)
        path = f"M{a:.1f} {y:.1f}H{b:.1f}M{a:.1f} {y - 4:.1f}v8M{b:.1f} {y - 4:.1f}v8"
        return tag("path", d=path, class_=f"spread k{row.line} c{self.diagram.view.line_styles[row.line].colour}")

    def _point_marks(self, row: _Row) -> str:
        """Return the SVG of the marks of a point.

        A ring is a point on the Pareto front, a cross one stopped at `max_iterations`, a dotted square a disturbed
        timing.
        """
        place = self.diagram.place(row)
        if place is None:
            return ""
        x, y = self.chart.pixel(place)
        own, found = f"k{row.line}", ""
        if row.point.key in self.diagram.known.front and not self.diagram.frames:
            found += tag("circle", cx=f"{x:.1f}", cy=f"{y:.1f}", r=RING, class_=f"on-front {own}")
        if row.point.status == "capped":
            found += tag("path", d=f"M{x - 8:.1f} {y - 8:.1f}l16 16m-16 0l16-16", class_=f"capped {own}")
        if self.diagram.view.disturbed(row.point):
            found += tag("path", d=f"M{x - 8:.1f} {y - 8:.1f}h16v16h-16z", class_=f"disturbed {own}")
        return found


KEY = (
    ("M1 5H17V11H37", "front", "Pareto front: no other configuration is better in both error and cost", "front"),
    ("", "on-front", "on the front", "front"),
    ("M11 2l14 12m-14 0l14-12", "capped", "stopped by the iteration limit", "capped"),
    ("M12 1h14v14h-14z", "disturbed", "timing disturbed", "disturbed"),
    ("M4 8H34M4 4v8M34 4v8", "spread", "median and quartiles of the runs", "spread"),
)


def diagram_legend(view: SceneView) -> str:
    """Return the HTML legend of the marks that occur in the diagrams of a scene."""
    fronts = any(own.front for own in view.metrics.values())
    there = {
        "front": fronts,
        "capped": any(p.status == "capped" for p in view.points),
        "disturbed": any(view.disturbed(p) for p in view.points),
        "spread": any((s := view.effort(p)) is not None and s.q1 != s.q3 for p in view.points),
    }
    items = [_legend_sample(d, name) + tag("span", text(words)) for d, name, words, when in KEY if there[when]]
    if not view.timed:
        items = [item.replace("none is faster", "none is smaller") for item in items]
    if any(_is_uncertainty_visible(view, metric) for metric in view.metrics):
        band = tag("rect", x=1, y=2, width=36, height=12, class_="uncertain")
        items.append(_legend_svg(band) + tag("span", "within the uncertainty of the reference"))
    return tag("ul", *(tag("li", item) for item in items), class_="key") if items else ""


def _is_uncertainty_visible(view: SceneView, metric: str) -> bool:
    """Return whether the uncertainty is large enough to be visible next to the errors."""
    errors = [e for p in view.points if (e := p.error(metric))]
    uncertainty = view.metrics[metric].uncertainty
    return uncertainty > 0 and uncertainty >= TOLD * min(errors, default=0.0)


def _legend_sample(d: str, name: str) -> str:
    ring = tag("circle", cx=19, cy=8, r=6.5, class_=name)
    return _legend_svg(tag("path", d=d, class_=name) if d else ring)


def _legend_svg(content: str) -> str:
    return tag("svg", content, viewBox="0 0 38 16", width=38, height=16, aria_hidden="true")


def has_step_times(view: SceneView) -> bool:
    """Return whether the time of a step was measured separately for any configuration."""
    return view.timed and any(p.cost.step_s for p in view.points)
