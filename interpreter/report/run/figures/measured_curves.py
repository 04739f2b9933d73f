"""Charts of computed curves together with the measured curve and its uncertainty."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING

from softmark.interpreter.language.number_formatting import format_quantity
from softmark.interpreter.report.charts.chart_axes import Axis, linear
from softmark.interpreter.report.charts.line_chart import Chart, Curve
from softmark.interpreter.report.page.figure_frame import figure_block
from softmark.interpreter.report.page.html_markup import join_names, prose, section
from softmark.interpreter.report.run.report_summary import MetricColumn, ReportSummary, kind_of_reference
from softmark.interpreter.report.run.tables.curve_points import columns, curves_csv_link
from softmark.interpreter.report.run.tables.line_probes import curve_styles, initially_shown
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from softmark.interpreter.results.run_report import PlottedCurve

    Floats = NDArray[np.float64]

WIDTH, HEIGHT = 640.0, 300.0
WHOLE = 0.999  # fraction of the measured range; a smaller covered range is mentioned


def section_of(findings: ReportSummary) -> str:
    """Return a chart for each measured curve and each metric that is compared with it; empty if there are none."""
    plates: dict[tuple[object, ...], str] = {}
    for metric in findings.metrics:
        named = findings.declared.get(metric.name)
        reference = findings.report.references.get((named.against if named else None) or "")
        if reference is None or reference.drawn is None:
            continue
        seen = {n: m.curve for n, r in findings.all_results.items() if (m := r.metrics.get(metric.name)) and m.curve}
        same = (
            reference.name,
            *((n, tuple(c.y.tolist())) for n, c in seen.items()),
        )  # metrics with equal curves differ only in their statistic
        plates.setdefault(same, "")
        if seen and not plates[same]:
            plates[same] = _MeasuredCurve(
                findings, len(plates), metric, reference.name, reference.drawn, seen
            ).render_figure()
    found = [made for made in plates.values() if made]
    kinds = {r.kind for r in findings.report.references.values() if r.drawn is not None}
    return section("curves", "Measured curves" if kinds == {"measurement"} else "Curves", *found) if found else ""


@dataclass(frozen=True)
class _MeasuredCurve:
    """Measured curve and the curves of models that are compared with it."""

    findings: ReportSummary
    number: int
    metric: MetricColumn
    reference: str
    drawn: PlottedCurve
    seen: Mapping[str, PlottedCurve]

    @cached_property
    def abscissa_range(self) -> tuple[float, float]:
        """Range of x that the models cover; the chart shows only this range."""
        ends = [(float(c.x.min()), float(c.x.max())) for c in self.seen.values()]
        low, high = min(a for a, _ in ends), max(b for _, b in ends)
        margin = 0.05 * (high - low) or 0.05 * abs(high) or 1e-9
        return max(low - margin, float(self.drawn.x[0])), min(high + margin, float(self.drawn.x[-1]))

    @cached_property
    def bands(self) -> dict[str, tuple[tuple[float, float], ...]]:
        """Measured curve with its upper and lower bounds as points (x, y), within the range of the models, by name."""
        d, (low, high) = self.drawn, self.abscissa_range
        near = [i for i, x in enumerate(d.x.tolist()) if low <= x <= high]
        near = sorted({*near, *(min(max(i, 0), len(d.x) - 1) for i in (near[0] - 1, near[-1] + 1))}) if near else []
        u: Floats = d.uncertainty if d.uncertainty is not None else 0.0 * d.y
        each = {"": d.y, " + uncertainty": d.y + u, " − uncertainty": d.y - u}
        if self.is_consensus:
            least, largest = d.band or (d.y - u, d.y + u)
            each = {"": d.y, ", largest": largest, ", least": least}
        return {
            f"{self.reference}{name}": tuple((float(d.x[i]), float(y[i])) for i in near) for name, y in each.items()
        }

    @property
    def is_consensus(self) -> bool:
        """True if the curve is a consensus of several codes and not a measurement."""
        return self.findings.report.references[self.reference].kind == "consensus"

    def render_figure(self) -> str:
        """Return the HTML of the chart."""
        open_ = [*initially_shown(self.findings, self.seen), *self.findings.report.references]
        chart = Chart(
            f"curve-{self.number}", f"{self.metric.name}: against {self.reference}", self._description(), *self._axes(),
            WIDTH, HEIGHT, tuple(self._curves(open_)), left=78.0, right=110.0,
        )  # fmt: skip
        found = columns(self.seen, self.drawn.units)
        return figure_block(chart, prose(self._caption()), found, self._csv_link(), open_=open_)

    def _axes(self) -> tuple[Axis, Axis]:
        across, up = self.drawn.units
        every = [v for band in self.bands.values() for _, v in band]
        every += [float(v) for c in self.seen.values() for v in c.y]
        low, high = min(every), max(every)
        margin = 0.06 * (high - low) or 0.06 * abs(high) or 1e-9
        start, end = self.abscissa_range
        along = linear(start, max(end, start + 1e-12), "time" if across == "s" else "x", across, 8)
        return along, linear(low - margin, high + margin, "y", up, 6)

    def _curves(self, open_: Sequence[str]) -> Iterator[Curve]:
        known = curve_styles(self.findings.report)
        for i, (name, band) in enumerate(self.bands.items()):
            yield Curve(name, known[self.reference], band, 0, 1, named=i == 0 and self.reference in open_)
        for i, (name, curve) in enumerate(self.seen.items()):
            points = tuple(zip(curve.x.tolist(), curve.y.tolist(), strict=True))
            yield Curve(name, known[name], points, 1 + i, 1, named=name in open_)

    def _format_value(self, value: float) -> str:
        return format_quantity(value, self.drawn.units[1], 3)

    def _description(self) -> str:
        ends = (
            f"{n} from {self._format_value(float(c.y[0]))} to {self._format_value(float(c.y[-1]))}"
            for n, c in self.seen.items()
        )
        return "; ".join(ends) + "."

    def _caption(self) -> str:
        """Return the caption: the curves, the source of the measurement, and the range of x that is judged."""
        reference = self.findings.report.references[self.reference]
        beside = "with the band of the codes" if self.is_consensus else "with its uncertainty as a band"
        said = [
            f"`{self.metric.name}`: curves of models and of `{self.reference}`"
            f" ({kind_of_reference(reference)}), {beside}."
        ]
        said += [self._inside_band_sentence()] if self.is_consensus else []
        facts = reference.facts
        if facts.get("repeats", 1) > 1:
            said.append(
                f"The reference is the mean of {facts['repeats']} repeats; their standard deviation is at most "
                f"{self._format_value(float(facts['spread']))}."
            )
        if facts.get("lost") is not None:
            said.append(f"{100.0 * float(facts['lost']):.3g} % of the work of loading was dissipated.")
        said += [f"{note}." for note in facts.get("notes") or ()]
        models = (r.metrics.get(self.metric.name) for r in self.findings.all_results.values())
        shares = [float(m.details["covered_share"]) for m in models if m is not None and "covered_share" in m.details]
        if shares and min(shares) < WHOLE:
            least, most = (f"{100.0 * share:.3g}" for share in (min(shares), max(shares)))
            said.append(f"{least if least == most else f'{least} to {most}'} % of its range is compared.")
        return " ".join(said)

    def _inside_band_sentence(self) -> str:
        """Return a sentence on the curves that lie inside the uncertainty band, with the fraction inside."""
        found = ((n, r.metrics.get(self.metric.name)) for n, r in self.findings.all_results.items())
        shares = [(n, m.details["inside_share"]) for n, m in found if m is not None and "inside_share" in m.details]
        each = [f"`{n}` by {100.0 * float(share):.3g} %" for n, share in shares]
        return f"Inside the band: {join_names(each)} of the compared range." if each else ""

    def _csv_link(self) -> str:
        known = {self.reference: self.drawn, **self.seen}
        if (band := self.drawn.band) is not None:
            for name, y in zip(("least", "largest"), band, strict=True):
                known[f"{self.reference}, {name}"] = replace(self.drawn, y=y)
        return curves_csv_link(f"{self.metric.name}-curve", known, self.drawn.units)
