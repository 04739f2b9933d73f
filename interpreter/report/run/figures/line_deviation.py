"""Deviation of models from a reference along a line probe.

There is a figure for each pair of probe and reference that an error metric uses.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property

import numpy as np

from softmark.interpreter.language.number_formatting import (
    choose_decimals,
    choose_scale,
    format_quantity,
    format_reference_error,
    typeset_number,
)
from softmark.interpreter.report.charts.chart_axes import linear, logarithmic
from softmark.interpreter.report.charts.curve_labels import LETTER, Point
from softmark.interpreter.report.charts.line_chart import Chart, Curve
from softmark.interpreter.report.page.embedded_csv import csv_link, round_for_drawing
from softmark.interpreter.report.page.figure_frame import ColumnGroup, figure_block, hidden_models_note
from softmark.interpreter.report.page.html_markup import prose, section, tag
from softmark.interpreter.report.run.report_summary import ReportSummary
from softmark.interpreter.report.run.tables.line_probes import Floats, arc, curve_styles, initially_shown, lines_of
from softmark.interpreter.results.run_report import ProbeResult
from softmark.records import dataclass

LEAD = "Distance between corresponding points of model and reference: |u − u<sub>ref</sub>|."
DEPTH = 1e-10  # errors below this part of the largest are not drawn: they are rounding


def pairs(findings: ReportSummary) -> list[tuple[str, str]]:
    """Return the pairs (probe, reference) of error metrics at line probes."""
    lines = lines_of(findings)
    found = ((m.probe, m.against) for m in findings.errors)
    return list(dict.fromkeys((p, r) for p, r in found if p in lines and r in lines[p]))


def section_of(findings: ReportSummary) -> str:
    """Return one figure for each pair of line probe and reference; empty if there is none."""
    figures = [_ProbeReferencePair(findings, n, *pair).render_figure() for n, pair in enumerate(pairs(findings))]
    figures = [figure for figure in figures if figure]
    if not figures:
        return ""
    return section("error", "Error along the line", tag("p", LEAD, class_="lead"), *figures)


@dataclass(frozen=True)
class _ProbeReferencePair:
    """Line probe and reference, with the models that are compared there."""

    findings: ReportSummary
    number: int
    probe: str
    reference: str

    @cached_property
    def known(self) -> ProbeResult:
        """Result of the reference at the probe."""
        return self.findings.probes[self.probe][self.reference]

    @cached_property
    def distances(self) -> Mapping[str, Floats]:
        """Distances |u - u_ref| from the reference, shape (n,), m, by model."""
        seen, models = self.findings.probes[self.probe], self.findings.report.models
        u = self.known.displacement
        same = {n: p.displacement for n, p in seen.items() if n in models and p.displacement.shape == u.shape}
        return {n: np.sqrt(((d - u) ** 2).sum(axis=1)) for n, d in same.items()}

    @cached_property
    def largest_distance(self) -> float:
        return max((float(d.max()) for d in self.distances.values()), default=0.0)

    def render_figure(self) -> str:
        """Return the HTML of the figure; a sentence if every distance is zero, or an empty text without models."""
        if not self.distances:
            return ""
        if self.largest_distance == 0.0:
            return tag("p", prose(f"At `{self.probe}` every model agrees with `{self.reference}` exactly."))
        open_ = initially_shown(self.findings)
        return figure_block(self._chart(open_), self._caption(open_), self._columns(), self._csv_link(), open_=open_)

    @cached_property
    def _axis_lower_end(self) -> float:
        least = DEPTH * self.largest_distance
        return min(float(d[d >= least].min(initial=np.inf)) for d in self.distances.values())

    def _chart(self, open_: Sequence[str]) -> Chart:
        s = arc(self.known.points)
        return Chart(
            f"error-{self.number}", f"Distance from {self.reference} along {self.probe}", self._description(),
            linear(0.0, float(s[-1]) or 1.0, "arc position s", "m", 7),
            logarithmic(self._axis_lower_end, self.largest_distance, f"distance from {self.reference}", "m"),
            600.0, 320.0, tuple(self._curves(s, open_)), left=84.0, right=self._margin,
        )  # fmt: skip

    @property
    def _margin(self) -> float:
        """Return the space, pixels, for the longest name to the right of the plot."""
        return min(180.0, 34.0 + LETTER * max(len(name) for name in self.distances))

    def _curves(self, s: Floats, open_: Sequence[str]) -> Iterator[Curve]:
        look, floor = curve_styles(self.findings.report), self._axis_lower_end
        for column, (name, distance) in enumerate(self.distances.items(), start=1):
            points: tuple[Point | None, ...] = tuple(
                (float(a), float(d)) if d >= floor else None for a, d in zip(s, distance, strict=True)
            )
            yield Curve(name, look[name], points, column, named=name in open_)

    def _description(self) -> str:
        worst = "; ".join(f"{n} up to {format_quantity(float(d.max()), 'm', 3)}" for n, d in self.distances.items())
        return f"{self._ranking()} Largest distances: {worst}."

    def _ranking(self) -> str:
        largest = {n: float(d.max()) for n, d in self.distances.items()}
        least, most = min(largest, key=lambda n: largest[n]), max(largest, key=lambda n: largest[n])
        said = f"`{least}` stays within {format_quantity(largest[least], 'm', 3)} of `{self.reference}`"
        rest = f", `{most}` deviates by up to {format_quantity(largest[most], 'm', 3)}." if most != least else "."
        return said + rest

    def _caption(self, open_: Sequence[str]) -> str:
        own = self.findings.report.references[self.reference].estimated_error
        error = "" if own is None else f" Error of the reference: {format_reference_error(own)}."
        hidden = any(bool(((d[1:] > 0.0) & (d[1:] < self._axis_lower_end)).any()) for d in self.distances.values())
        cut = " Distances at rounding level are not drawn." if hidden else ""
        shown = hidden_models_note(len(self.distances), len([n for n in open_ if n in self.distances]))
        lead = f"Against `{self.reference}`, at probe `{self.probe}`.{error}"
        return prose(f"{lead} {self._ranking()}{cut}{shown}")

    def _columns(self) -> list[ColumnGroup]:
        s = arc(self.known.points)
        along, across = choose_scale((float(s[-1]),), "m"), choose_scale((self.largest_distance,), "m")
        decimals, heading = choose_decimals((float(s[-1]),), along, 6), across.heading("distance")
        found = [
            ColumnGroup(along.heading("s"), (along.heading("s"),), [(along.fixed(float(v), decimals),) for v in s])
        ]
        for name, distance in self.distances.items():
            cells = [(typeset_number(f"{float(d) / across.factor:.4g}"),) for d in distance]
            found.append(ColumnGroup(name, (heading,), cells))
        return found

    def _csv_link(self) -> str:
        columns = [arc(self.known.points), *self.distances.values()]
        rows = [[round_for_drawing(float(v)) for v in row] for row in zip(*columns, strict=True)]
        header = ["s [m]", *(f"{name} [m]" for name in self.distances)]
        return csv_link(f"{self.probe}-error-against-{self.reference}", header, rows)
