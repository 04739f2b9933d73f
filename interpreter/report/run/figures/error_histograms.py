"""Histograms of pointwise errors, one for each model, all with the same axes."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

import numpy as np

from softmark.interpreter.language.number_formatting import format_quantity, typeset_number
from softmark.interpreter.report.charts.chart_axes import Axis, linear
from softmark.interpreter.report.charts.curve_styles import CurveStyle
from softmark.interpreter.report.charts.line_chart import Chart, Curve
from softmark.interpreter.report.page.embedded_csv import Cell, csv_link, round_for_drawing
from softmark.interpreter.report.page.figure_frame import ColumnGroup, figure_block
from softmark.interpreter.report.page.html_markup import prose, section, tag
from softmark.interpreter.report.run.report_summary import MetricColumn, ReportSummary
from softmark.interpreter.report.run.tables.line_probes import Floats, curve_styles
from softmark.interpreter.results.even_thinning import pick_evenly
from softmark.records import dataclass

BINS = 40
LEFT, TOP, WIDTH, HEIGHT = 46.0, 30.0, 300.0, 130.0
SAVED = 20_000  # samples in the CSV of one metric
TINY = 30  # least number of samples for a histogram
FAR = 4.0  # the common axis ends at this multiple of the median of the 99th percentiles of all models
LEAD = (
    "Number of points by error, with the same axes for all models. Vertical lines: median (dotted), mean (solid) and "
    "95th percentile (dashed)."
)


def section_of(findings: ReportSummary) -> str:
    """Return small histograms for each error metric that has samples; empty if there is none."""
    metrics = [m for m in findings.metrics if m.is_error and _finite_samples(findings, m)]
    blocks: list[str] = []
    seen: set[tuple[tuple[str, float, int], ...]] = set()
    for metric in metrics:
        key = tuple((n, float(s.sum()), len(s)) for n, s in _finite_samples(findings, metric).items())
        if key not in seen:  # several statistics of the same distances have one histogram
            blocks.append(_Distribution(findings, len(seen), metric).html())
        seen.add(key)
    if not blocks:
        return ""
    return section("distribution", "Distribution of errors", tag("p", LEAD, class_="lead"), *blocks)


def _finite_samples(findings: ReportSummary, metric: MetricColumn) -> dict[str, Floats]:
    """Return the finite samples of a metric, shape (n,), by model."""
    found = {}
    for name, model in findings.report.models.items():
        metric_result = model.metrics.get(metric.name)
        if metric_result is not None and len(metric_result.samples) >= TINY:
            values = np.asarray(metric_result.samples, dtype=float)
            found[name] = values[np.isfinite(values)]
    return found


@dataclass(frozen=True)
class _Distribution:
    """Histograms of the samples of one metric for all models."""

    findings: ReportSummary
    number: int
    metric: MetricColumn

    @cached_property
    def samples(self) -> Mapping[str, Floats]:
        return _finite_samples(self.findings, self.metric)

    @cached_property
    def unit(self) -> str:
        """Unit of the samples, which are lengths if the metric is relative."""
        return self.metric.unit if self.metric.unit not in ("1", "") else "m"

    @cached_property
    def error_axis_end(self) -> float:
        """Upper end of the error axis; larger errors are counted in the last bin."""
        usual = [float(np.percentile(s, 99.0)) for s in self.samples.values()]
        most = max(float(s.max()) for s in self.samples.values())
        return min(most, FAR * float(np.median(usual))) or most or 1e-9

    @cached_property
    def counts(self) -> dict[str, Floats]:
        """Fraction of samples in each bin, by model."""
        edges = np.linspace(0.0, self.error_axis_end, BINS + 1)
        return {n: np.histogram(np.minimum(s, self.error_axis_end), edges)[0] / len(s) for n, s in self.samples.items()}

    @cached_property
    def axes(self) -> tuple[Axis, Axis]:
        """Axes of the error and of the fraction of points."""
        most = max(float(c.max()) for c in self.counts.values())
        high = min(most, 3.0 * float(np.median([c.max() for c in self.counts.values()])))
        x = linear(0.0, self.error_axis_end, f"distance from {self.metric.against}", self.unit, 5)
        y = linear(0.0, 105.0 * high, "% of the points", "1", 4)
        return x, y

    def html(self) -> str:
        """Return the HTML of a heading and the charts."""
        known = curve_styles(self.findings.report)
        charts = [self._histogram_figure(i, n, known[n]) for i, n in enumerate(self.samples)]
        name = tag("h3", prose(f"`{self.metric.name}`, from `{self.metric.against}`"))
        return name + tag("div", *charts, class_="small-plates") + self._samples_csv_link()

    def _histogram_figure(self, index: int, name: str, look: CurveStyle) -> str:
        x, y = self.axes
        chart = Chart(
            f"distribution-{self.number}-{index}", f"Errors of {name}, {self.metric.name}",
            f"{name}: {self._statistics_phrase(name)}",
            x, y, WIDTH, HEIGHT, (self._curve(name, look),), under=self._histogram_svg(name, look, x, y), labels=False,
            left=LEFT, top=TOP, right=14.0,
        )  # fmt: skip
        return figure_block(
            chart,
            prose(f"`{name}`: {self._statistics_phrase(name)}"),
            self._columns(name),
            self._bins_csv_link(name),
            legend=False,
        )

    def _curve(self, name: str, look: CurveStyle) -> Curve:
        width = self.error_axis_end / BINS
        points = tuple((width * (i + 0.5), 100.0 * float(c)) for i, c in enumerate(self.counts[name]))
        return Curve(name, CurveStyle("bins", look.colour), points, 1, 1)

    def _statistics_phrase(self, name: str) -> str:
        s = self.samples[name]
        median, high, most = (format_quantity(float(np.percentile(s, q)), self.unit, 3) for q in (50, 95, 100))
        beyond = float((s > self.error_axis_end).mean())
        cut = (
            f"; {typeset_number(f'{100 * beyond:.0f} %')} are beyond the axis and counted in the last bar"
            if beyond > 0
            else ""
        )
        tall = float(self.counts[name].max()) > self.axes[1].high / 100.0
        tip = f"; its highest bar, {100 * float(self.counts[name].max()):.0f} %, is cut off" if tall else ""
        mean = format_quantity(float(s.mean()), self.unit, 3)
        return f"mean {mean}, median {median}, 95 % below {high}, largest {most}{cut}{tip}."

    def _histogram_svg(self, name: str, look: CurveStyle, x: Axis, y: Axis) -> str:
        """Return the SVG of one histogram, with lines for the statistics and a band for the uncertainty."""
        s, base = self.samples[name], TOP + HEIGHT
        steps, width = [f"M{LEFT:.1f} {base:.1f}"], WIDTH / BINS
        for i, share in enumerate(self.counts[name]):
            level = base - HEIGHT * min(1.0, y.at(100.0 * float(share)))
            steps.append(f"V{level:.1f}H{LEFT + width * (i + 1):.1f}")
        bars = tag("path", d="".join(steps) + f"V{base:.1f}Z", class_="bars")
        strokes = [
            ("mean", float(s.mean())),
            ("median", float(np.median(s))),
            ("high", float(np.percentile(s, 95))),
        ]
        lines = [_statistic_line(kind, x.at(value)) for kind, value in strokes if value <= self.error_axis_end]
        return tag("g", self._uncertainty_band(x), bars, *lines, class_=f"histogram c{look.colour}")

    def _uncertainty_band(self, x: Axis) -> str:
        known = self.findings.uncertainty(self.metric)
        if not known:
            return ""
        width = WIDTH * min(1.0, x.at(min(known, self.error_axis_end)))
        return tag("rect", x=LEFT, y=TOP, width=f"{width:.1f}", height=HEIGHT, class_="uncertain")

    def _columns(self, name: str) -> list[ColumnGroup]:
        x, _ = self.axes
        factor = self.error_axis_end / BINS
        heading = x.label.replace(f"distance from {self.metric.against}", "error")
        middles = [
            (typeset_number(f"{_convert_to_heading_unit(factor * (i + 0.5), heading, self.unit):.4g}"),)
            for i in range(BINS)
        ]
        shares = [(typeset_number(f"{100 * float(c):.3g}"),) for c in self.counts[name]]
        return [ColumnGroup(heading, (heading,), middles), ColumnGroup(name, ("points / %",), shares)]

    def _bins_csv_link(self, name: str) -> str:
        width = self.error_axis_end / BINS
        rows: list[list[Cell]] = [
            [round_for_drawing(width * i), round_for_drawing(width * (i + 1)), round_for_drawing(float(c))]
            for i, c in enumerate(self.counts[name])
        ]
        header = [f"from [{self.unit}]", f"to [{self.unit}]", "share of points"]
        return csv_link(f"{name}-{self.metric.name}-histogram", header, rows)

    def _samples_csv_link(self) -> str:
        """Return the link to a CSV file of the samples in ascending order, evenly thinned if there are too many."""
        most = SAVED // len(self.samples)
        columns = [_thin_values(np.sort(s), most) for s in self.samples.values()]
        rows: list[list[Cell]] = [
            [float(f"{c[i]:.5g}") if i < len(c) else None for c in columns] for i in range(max(map(len, columns)))
        ]
        header = [f"{n} [{self.unit}]" for n in self.samples]
        every = all(len(s) <= most for s in self.samples.values())
        label = "All errors as CSV" if every else f"{most} evenly chosen errors of each model as CSV"
        return tag("p", csv_link(f"{self.metric.name}-samples", header, rows, label), class_="save-line")


def _thin_values(ordered: Floats, most: int) -> Floats:
    """Return at most `most` of the ascending values, including the smallest and the largest."""
    chosen: Floats = ordered[pick_evenly(len(ordered), most)]
    return chosen


def _convert_to_heading_unit(value: float, heading: str, unit: str) -> float:
    """Return a value in SI converted to the unit named in a heading such as `error / mm`."""
    from softmark.interpreter.language import units

    shown = heading.partition(" / ")[2] or unit
    return value / units.parse_unit(shown).factor


def _statistic_line(kind: str, at: float) -> str:
    x = LEFT + WIDTH * at
    return tag("path", d=f"M{x:.1f} {TOP:.1f}v{HEIGHT:.1f}", class_=f"stat {kind}")
