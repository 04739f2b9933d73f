"""What contacts do over time: a chart of all models for each metric that is followed in a motion."""

from __future__ import annotations

from softmark.interpreter.language.number_formatting import format_quantity
from softmark.interpreter.report.charts.chart_axes import Axis, linear
from softmark.interpreter.report.page.html_markup import section
from softmark.interpreter.report.run.figures.contact_line_chart import Along, curves_of
from softmark.interpreter.report.run.report_summary import Findings
from softmark.records import dataclass


def section_of(findings: Findings) -> str:
    """A chart for each metric that has values over time and is held against nothing; empty where there is none."""
    charts: dict[tuple[object, ...], str] = {}
    for metric in findings.metrics:
        timed = curves_of(findings, metric, "s") if metric.against is None and metric.model is None else {}
        same = tuple((n, c.units, tuple(c.y.tolist())) for n, c in timed.items())
        if timed and same not in charts:
            charts[same] = _Followed(findings, len(charts), metric, timed).plate()
    return section("contacts-in-time", "Contacts over time", *charts.values()) if charts else ""


@dataclass(frozen=True)
class _Followed(Along):
    """Values of a metric of all models over time."""

    @property
    def key(self) -> str:
        """Of the chart in the page."""
        return f"contact-{self.number}"

    @property
    def named(self) -> str:
        """What the file of its points is called."""
        return f"{self.metric.name}-over-time"

    @property
    def heading(self) -> str:
        """What is drawn."""
        return f"{self.metric.name}, {self.title} over time"

    def axes(self) -> tuple[Axis, Axis]:
        """Time, and the values with nothing among them."""
        end, low, high, margin = self.extent
        up = linear(low - margin * (low < 0.0), high + margin, self.title, self.units[1], 6)
        return linear(0.0, end, "time", "s", 8), up

    def desc(self) -> str:
        """From where to where each goes."""
        unit = self.units[1]
        ends = (f"{n} from {format_quantity(float(c.y.min()), unit, 3)} to {format_quantity(float(c.y.max()), unit, 3)}"
                for n, c in self.curves.items())  # fmt: skip
        return "; ".join(ends) + "."

    def caption(self) -> str:
        """What its values are."""
        means = " Each is the mean over the two steps that meet there." if self.units[1] in ("N", "Nm") else ""
        return f"`{self.metric.name}` at the times of its steps.{means}"
