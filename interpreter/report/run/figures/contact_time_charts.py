"""Charts of contact metrics over time in a dynamic analysis, one for each metric with all models."""

from __future__ import annotations

from softmark.interpreter.language.number_formatting import format_quantity
from softmark.interpreter.report.charts.chart_axes import Axis, linear
from softmark.interpreter.report.page.html_markup import section
from softmark.interpreter.report.run.figures.contact_line_chart import LineCurves, curves_of
from softmark.interpreter.report.run.report_summary import ReportSummary
from softmark.records import dataclass


def section_of(findings: ReportSummary) -> str:
    """Return a chart for each metric that has values over time and no reference; empty if there is none."""
    charts: dict[tuple[object, ...], str] = {}
    for metric in findings.metrics:
        timed = curves_of(findings, metric, "s") if metric.against is None and metric.model is None else {}
        same = tuple((n, c.units, tuple(c.y.tolist())) for n, c in timed.items())
        if timed and same not in charts:
            charts[same] = _TimeCurves(findings, len(charts), metric, timed).render_figure()
    return section("contacts-in-time", "Contacts over time", *charts.values()) if charts else ""


@dataclass(frozen=True)
class _TimeCurves(LineCurves):
    """Curves of a metric over time for all models."""

    @property
    def chart_id(self) -> str:
        """Identifier of the chart on the page."""
        return f"contact-{self.number}"

    @property
    def csv_name(self) -> str:
        """Name of the CSV file with the points of the curves."""
        return f"{self.metric.name}-over-time"

    @property
    def heading(self) -> str:
        """Heading of the chart."""
        return f"{self.metric.name}, {self.title} over time"

    def axes(self) -> tuple[Axis, Axis]:
        """Axes of time and value; the value axis includes zero."""
        end, low, high, margin = self.extent
        up = linear(low - margin * (low < 0.0), high + margin, self.title, self.units[1], 6)
        return linear(0.0, end, "time", "s", 8), up

    def desc(self) -> str:
        """Description of the chart in words, with the range of each curve."""
        unit = self.units[1]
        ends = (f"{n} from {format_quantity(float(c.y.min()), unit, 3)} to {format_quantity(float(c.y.max()), unit, 3)}"
                for n, c in self.curves.items())  # fmt: skip
        return "; ".join(ends) + "."

    def caption(self) -> str:
        """Caption of the chart, with the meaning of the values."""
        means = " Each value is the mean over the two adjacent steps." if self.units[1] in ("N", "Nm") else ""
        return f"`{self.metric.name}` at the times of its steps.{means}"
