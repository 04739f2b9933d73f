"""Charts of metrics along a line, such as contact pressure, of all models with their reference."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from softmark.interpreter.language.number_formatting import format_quantity
from softmark.interpreter.report.charts.chart_axes import Axis, linear
from softmark.interpreter.report.charts.line_chart import Chart
from softmark.interpreter.report.charts.line_chart import Curve as Drawn
from softmark.interpreter.report.page.figure_frame import figure_block
from softmark.interpreter.report.page.html_markup import prose, section
from softmark.interpreter.report.run.report_summary import MetricColumn, ReportSummary
from softmark.interpreter.report.run.tables.curve_points import columns, curves_csv_link
from softmark.interpreter.report.run.tables.line_probes import curve_styles, initially_shown
from softmark.interpreter.results.run_report import PlottedCurve
from softmark.records import dataclass

WIDTH, HEIGHT = 640.0, 300.0


def section_of(findings: ReportSummary) -> str:
    """Return a chart for each metric with a curve along its probe; empty if there is none.

    Metrics with equal curves share a chart.
    """
    charts: dict[tuple[object, ...], LineCurves] = {}
    for metric in findings.metrics:
        along = {} if metric.probe is None else curves_of(findings, metric, "m")
        models = {n: c for n, c in along.items() if n in findings.report.models}
        if models:
            same = (metric.probe, *((n, tuple(c.y.tolist())) for n, c in models.items()))
            before = charts.get(same) or LineCurves(findings, len(charts), metric, {})
            charts[same] = replace(before, curves={**_reference_curves(metric, along), **before.curves, **along})
    return section("along", "Along lines", *(own.render_figure() for own in charts.values())) if charts else ""


def curves_of(findings: ReportSummary, metric: MetricColumn, unit: str) -> dict[str, PlottedCurve]:
    """Return the curves of a metric whose abscissa has the given unit, by the name of the model or reference."""
    every = ((name, outcome.metrics.get(metric.name)) for name, outcome in findings.all_results.items())
    return {name: m.curve for name, m in every if m is not None and m.curve and m.curve.units[0] == unit}


def _reference_curves(metric: MetricColumn, along: Mapping[str, PlottedCurve]) -> dict[str, PlottedCurve]:
    """Return the curves of the reference of a metric, taken from the first model that has them."""
    right = metric.against or metric.model
    each = [PlottedCurve(c.x, c.known, c.units) for c in along.values() if c.known is not None]
    return {right: each[0]} if right is not None and each else {}


@dataclass(frozen=True)
class LineCurves:
    """Curves of a metric for all models and references, over the distance from the start of the line."""

    findings: ReportSummary
    number: int
    metric: MetricColumn
    curves: Mapping[str, PlottedCurve]

    @property
    def title(self) -> str:
        """Title of the chart, such as `pressure`."""
        named = self.findings.declared.get(self.metric.name)
        return named.word.removesuffix("_along").replace("_", " ") if named else self.metric.name

    @property
    def chart_id(self) -> str:
        """Identifier of the chart on the page."""
        return f"along-{self.number}"

    @property
    def csv_name(self) -> str:
        """Name of the CSV file with the points of the curves."""
        return f"{self.metric.name}-along"

    @property
    def heading(self) -> str:
        """Heading of the chart."""
        return f"{self.title} along {self.metric.probe}"

    def render_figure(self) -> str:
        """Return the HTML of the chart."""
        open_ = [*initially_shown(self.findings, self.curves), *self.findings.report.references]
        known = curve_styles(self.findings.report)
        drawn = tuple(
            Drawn(n, known[n], tuple(zip(c.x.tolist(), c.y.tolist(), strict=True)), 1 + i, 1, 1, n in open_)
            for i, (n, c) in enumerate(self.curves.items())
        )
        chart = Chart(self.chart_id, self.heading, self.desc(), *self.axes(), WIDTH, HEIGHT, drawn,
                      left=78.0, right=110.0)  # fmt: skip
        found, file = columns(self.curves, self.units), curves_csv_link(self.csv_name, self.curves, self.units)
        return figure_block(chart, prose(self.caption()), found, file, open_=open_)

    def axes(self) -> tuple[Axis, Axis]:
        """Axes of distance and value; the value axis includes zero."""
        far, low, high, margin = self.extent
        across = linear(0.0, far, f"along {self.metric.probe}", "m", 8)
        return across, linear(low, high + margin, self.title, self.units[1], 6)

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """Largest x, smallest y, largest y (including zero), and the margin beyond the y values."""
        every = np.concatenate([c.y for c in self.curves.values()])
        low, high = min(0.0, float(every.min())), max(0.0, float(every.max()))
        return max(float(c.x[-1]) for c in self.curves.values()), low, high, 0.06 * (high - low or 1.0)

    @property
    def units(self) -> tuple[str, str]:
        """Units of both axes."""
        return next(iter(self.curves.values())).units

    def desc(self) -> str:
        """Description of the chart in words, with the largest value of each curve."""
        up = self.units[1]
        return (
            "; ".join(f"{n}: at most {format_quantity(float(c.y.max()), up, 3)}" for n, c in self.curves.items()) + "."
        )

    def caption(self) -> str:
        """Caption of the chart, with the location of the line."""
        last = self.findings.last_state_phrase
        return f"`{self.metric.name}` along `{self.metric.probe}`, over undeformed positions{last}."
