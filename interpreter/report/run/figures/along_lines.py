"""What a metric comes to along a line, as contact pressure: a chart of all models and what they are held to."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

import numpy as np

from softmark.interpreter.language.amounts import decimals_of, quantity, scale_of
from softmark.interpreter.report.charts.axes import Axis, linear
from softmark.interpreter.report.charts.chart import Chart
from softmark.interpreter.report.charts.chart import Curve as Drawn
from softmark.interpreter.report.page.markup import prose, section
from softmark.interpreter.report.page.plate import PlateColumn, plate
from softmark.interpreter.report.page.sheet import Cell, csv_link, short
from softmark.interpreter.report.run.findings import Findings, MetricColumn
from softmark.interpreter.report.run.tables.probes import drawn_first, looks
from softmark.interpreter.results.report import SeenCurve
from softmark.records import dataclass

WIDTH, HEIGHT = 640.0, 300.0
ROWS = 60  # of the table of numbers


def section_of(findings: Findings) -> str:
    """A chart for each metric that has a curve along its probe; empty where there are none."""
    charts: dict[tuple[object, ...], _Along] = {}
    for metric in findings.metrics:
        found = {n: m.curve for n, r in findings.everyone.items() if (m := r.metrics.get(metric.name)) and m.curve}
        along = {n: c for n, c in found.items() if metric.probe is not None and c.units[0] == "m"}
        models = {n: c for n, c in along.items() if n in findings.report.models}
        own = _Along(findings, len(charts), metric, along)
        same = (metric.probe, *((n, tuple(c.y.tolist())) for n, c in models.items()))
        if models and (same not in charts or own.right is not None):
            charts[same] = own
    return section("along", "Along lines", *(own.plate() for own in charts.values())) if charts else ""


@dataclass(frozen=True)
class _Along:
    """One metric of all who have it, by the distance from where its line begins."""

    findings: Findings
    number: int
    metric: MetricColumn
    seen: Mapping[str, SeenCurve]

    @property
    def right(self) -> str | None:
        """What they are held against."""
        named = self.findings.declared.get(self.metric.name)
        return named.against if named else None

    @property
    def title(self) -> str:
        """What is drawn: `pressure`."""
        named = self.findings.declared.get(self.metric.name)
        return named.word.removesuffix("_along").replace("_", " ") if named else self.metric.name

    @cached_property
    def curves(self) -> dict[str, SeenCurve]:
        """Those of all, and of what they are held against, which is the same for all."""
        first = self._first
        if self.right is None or first.known is None:
            return dict(self.seen)
        return {self.right: SeenCurve(first.x, first.known, first.units), **self.seen}

    def plate(self) -> str:
        """The chart."""
        open_ = [*drawn_first(self.findings, self.curves), *self.findings.report.references]
        known = looks(self.findings.report)
        drawn = tuple(
            Drawn(n, known[n], tuple(zip(c.x.tolist(), c.y.tolist(), strict=True)), 1 + i, 1, 1, n in open_)
            for i, (n, c) in enumerate(self.curves.items())
        )
        title = f"{self.title} along {self.metric.probe}"
        chart = Chart(f"along-{self.number}", title, self._desc(), *self._axes(), WIDTH, HEIGHT, drawn,
                      left=78.0, right=110.0)  # fmt: skip
        return plate(chart, prose(self._caption()), self._columns(), self._save(), open_=open_)

    def _axes(self) -> tuple[Axis, Axis]:
        every = np.concatenate([c.y for c in self.curves.values()])
        low, high = min(0.0, float(every.min())), max(0.0, float(every.max()))
        far = max(float(c.x[-1]) for c in self.curves.values())
        up = self._first.units[1]
        top = high + 0.06 * (high - low or 1.0)
        return linear(0.0, far, f"along {self.metric.probe}", "m", 8), linear(low, top, self.title, up, 6)

    @property
    def _first(self) -> SeenCurve:
        return next(iter(self.seen.values()))

    def _desc(self) -> str:
        up = self._first.units[1]
        return "; ".join(f"{n}: at most {quantity(float(c.y.max()), up, 3)}" for n, c in self.curves.items()) + "."

    def _caption(self) -> str:
        last = self.findings.of_last
        return f"`{self.metric.name}` along `{self.metric.probe}`, by its points before deformation{last}."

    def _columns(self) -> list[PlateColumn]:
        first = self._first
        every = -(-len(first.x) // ROWS)
        across, up = (
            scale_of([float(first.x[-1])], "m"),
            scale_of([float(np.abs(c.y).max()) for c in self.curves.values()], first.units[1]),
        )
        x = first.x[::every].tolist()
        found = [PlateColumn("x", (across.heading("x"),), [(across.fixed(v, decimals_of(x, across, 6)),) for v in x])]
        for name, curve in self.curves.items():
            y = curve.y[::every].tolist()
            found.append(PlateColumn(name, (up.heading("y"),), [(up.fixed(v, decimals_of(y, up, 6)),) for v in y]))
        return found

    def _save(self) -> str:
        header = ["name", "x [m]", f"y [{self._first.units[1]}]"]
        rows: list[list[Cell]] = [
            [name, short(x), short(y)]
            for name, c in self.curves.items()
            for x, y in zip(c.x.tolist(), c.y.tolist(), strict=True)
        ]
        return csv_link(f"{self.metric.name}-along", header, rows)
