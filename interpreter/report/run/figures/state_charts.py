"""Metrics over the states of a static analysis: a chart on the page, and a block of lines in the terminal."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cached_property

from softmark.interpreter.language.number_formatting import (
    choose_decimals,
    choose_scale,
    format_quantity,
    is_negligible,
)
from softmark.interpreter.report.charts.chart_axes import Axis, linear
from softmark.interpreter.report.charts.line_chart import Chart
from softmark.interpreter.report.charts.line_chart import Curve as Drawn
from softmark.interpreter.report.page.embedded_csv import Cell, csv_link
from softmark.interpreter.report.page.figure_frame import ColumnGroup, figure_block
from softmark.interpreter.report.page.html_markup import count, prose, section
from softmark.interpreter.report.run.report_summary import MetricColumn, ReportSummary
from softmark.interpreter.report.run.tables.line_probes import curve_styles, initially_shown
from softmark.interpreter.results.even_thinning import pick_evenly
from softmark.interpreter.results.state_results import ANSWERED, Curve, TimeState, format_state
from softmark.records import dataclass

WIDTH, HEIGHT = 560.0, 260.0
ROUNDING = 1e-6  # relative to the largest value; smaller differences are not drawn
SEVERAL = 6  # largest number of states in a terminal line


def section_of(findings: ReportSummary) -> str:
    """Return a chart for each metric with a curve for each model; empty if the analysis has no states."""
    known = [(m, curves) for m in findings.metrics if (curves := curves_of(findings, m.name))]
    plates = [
        _MetricStateChart(findings, i, metric, curves).render_figure() for i, (metric, curves) in enumerate(known)
    ]
    return section("states", "States", *plates) if plates else ""


def curves_of(findings: ReportSummary, metric: str) -> dict[str, Curve]:
    """Return the curves of a metric over the states, by model or reference."""
    everyone = {n: r for n, r in findings.all_results.items() if any(metric in own.metrics for own in r.each)}
    found = {n: r.curve(metric) for n, r in everyone.items()}
    return {n: curve for n, curve in found.items() if curve.known}


@dataclass(frozen=True)
class _MetricStateChart:
    """Chart of one metric of all models over the states."""

    findings: ReportSummary
    number: int
    metric: MetricColumn
    curves: Mapping[str, Curve]

    @cached_property
    def states(self) -> tuple[float, ...]:
        """Values of the states, in the order of the analysis."""
        return next(iter(self.curves.values())).states

    @cached_property
    def values(self) -> list[float]:
        """Values of the metric in all states and of all models."""
        return [v for curve in self.curves.values() for _, v in curve.known]

    def render_figure(self) -> str:
        """Return the HTML of the chart."""
        open_ = [*initially_shown(self.findings, self.curves), *self.findings.report.references]
        known = curve_styles(self.findings.report)
        drawn = [
            Drawn(n, known[n], tuple(None if v is None else (s, v) for s, v in self._pairs(c)), 1 + i, 1, 1, n in open_)
            for i, (n, c) in enumerate(self.curves.items())
        ]
        chart = Chart(
            f"states-{self.number}",
            f"{self.metric.name} from state to state",
            self._description(),
            *self._axes(),
            WIDTH,
            HEIGHT,
            tuple(drawn),
            left=78.0,
            right=90.0,
        )
        return figure_block(chart, prose(self._caption()), self._columns(), self._csv_link(), open_=open_)

    @staticmethod
    def _pairs(curve: Curve) -> Iterator[tuple[float, float | None]]:
        return iter(zip(curve.states, curve.values, strict=True))

    def _axes(self) -> tuple[Axis, Axis]:
        low, high = min(self.values), max(self.values)
        largest = max(abs(low), abs(high))
        low = min(0.0, low) if low <= 0.25 * high or low < 0.0 else low
        margin = 0.06 * (high - low if high - low > ROUNDING * largest else largest) or 1e-9
        if is_negligible(largest, 0.0, self.metric.unit, self.findings.moved):  # only rounding errors
            low, high, margin = 0.0, 0.0, 1.0
        first, last = min(self.states), max(self.states)
        wide = last - first or 1.0
        timed = isinstance(self.states[-1], TimeState)
        label, unit = ("time / s", 1.0) if timed else ("state / %", 100.0)
        across = linear(unit * (first - 0.02 * wide), unit * (last + 0.02 * wide), label, "1", 6)
        ticks = tuple((value / unit, words) for value, words in across.ticks)
        x = Axis(first - 0.02 * wide, last + 0.02 * wide, label, ticks)
        return x, linear(low - (margin if low else 0.0), high + margin, self.metric.name, self.metric.unit, 6)

    def _format_value(self, value: float) -> str:
        return format_quantity(value, self.metric.unit, 3, percent=self.metric.percent)

    def _description(self) -> str:
        ends = (
            f"{n} from {self._format_value(c.known[0][1])} to {self._format_value(c.known[-1][1])}"
            for n, c in self.curves.items()
        )
        return "; ".join(ends) + "."

    def _caption(self) -> str:
        summary = f": {self.metric.summary[0].lower()}{self.metric.summary[1:]}" if self.metric.summary else "."
        lost = [n for n, c in self.curves.items() if len(c.known) < len(c.states)]
        names = ", ".join(f"`{n}`" for n in lost)
        gaps = f" {names} have no value in some states; the table above gives the reason." if lost else ""
        return f"`{self.metric.name}` in {count(len(self.states), 'state')}{summary}{gaps}"

    def _columns(self) -> list[ColumnGroup]:
        values = [0.0 if is_negligible(v, 0.0, self.metric.unit, self.findings.moved) else v for v in self.values]
        scale = choose_scale(values, self.metric.unit, self.metric.percent)
        decimals = choose_decimals(values, scale, 6)
        found = [ColumnGroup("state", ("state",), [(format_state(s),) for s in self.states])]
        for name, curve in self.curves.items():
            cells = [("–" if v is None else scale.fixed(v, decimals),) for v in curve.values]
            found.append(ColumnGroup(name, (scale.heading(self.metric.name),), cells))
        return found

    def _csv_link(self) -> str:
        header = ["state", *(f"{n} [{self.metric.unit}]" for n in self.curves)]
        rows: list[list[Cell]] = [[s, *(c.values[i] for c in self.curves.values())] for i, s in enumerate(self.states)]
        return csv_link(f"{self.metric.name}-states", header, rows)


def lines(findings: ReportSummary) -> Iterator[str]:
    """Yield lines of text with the metrics of each model in some states; nothing if the analysis has no states."""
    report = findings.report
    first = next((r for r in report.outcomes if r.states), None)
    if first is None:
        return
    some = [int(i) for i in pick_evenly(len(first.states), SEVERAL)]
    left = f"{len(some)} of {len(first.states)} states" if len(some) < len(first.states) else "states"
    rows = [["", left, *(format_state(first.states[i]) for i in some)]]
    for metric in findings.metrics:
        for n, (name, curve) in enumerate(curves_of(findings, metric.name).items()):
            values = [curve.values[i] for i in some]
            shown = ["-" if v is None else _format_metric_value(v, metric, findings.moved) for v in values]
            rows.append([metric.name if n == 0 else "", name, *shown])
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    for row in rows:
        cells = (f"{c:<{w}}" if i < 2 else f"{c:>{w}}" for i, (c, w) in enumerate(zip(row, widths, strict=True)))
        yield "  ".join(cells).rstrip()
    if any(r.status in ANSWERED for r in report.models.values()):
        yield f"all other results belong to the last state, {format_state(first.states[-1])}"


def _format_metric_value(value: float, metric: MetricColumn, moved: float) -> str:
    return (
        "0" if is_negligible(value, 0.0, metric.unit, moved) else format_quantity(value, metric.unit, 4, percent=True)
    )
