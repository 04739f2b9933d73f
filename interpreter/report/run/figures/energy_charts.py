"""Charts of energies over time, a small one for each model, which show how well the total energy is conserved."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from softmark.interpreter.language.number_formatting import choose_scale, format_quantity, typeset_number
from softmark.interpreter.report.charts.chart_axes import linear
from softmark.interpreter.report.charts.curve_styles import CurveStyle, model_look, phase_look
from softmark.interpreter.report.charts.line_chart import Chart, Curve, legend_sample_svg
from softmark.interpreter.report.page.embedded_csv import Cell, csv_link, round_for_drawing
from softmark.interpreter.report.page.figure_frame import ColumnGroup, figure_block
from softmark.interpreter.report.page.html_markup import prose, tag, text
from softmark.interpreter.report.run.report_summary import ReportSummary
from softmark.interpreter.report.run.tables.line_probes import Floats
from softmark.interpreter.results.even_thinning import pick_evenly
from softmark.interpreter.results.run_report import ModelResult
from softmark.records import dataclass

DRAWN = 201
LEFT, TOP, WIDTH, HEIGHT = 58.0, 30.0, 300.0, 150.0
SUM = "total"  # energy whose drift is reported


def energy_charts_html(findings: ReportSummary) -> str:
    """Return the HTML of the charts with a legend; empty if no model has energies."""
    known = [(n, m, model_look(i)) for i, (n, m) in enumerate(findings.report.models.items())]
    found = [e for n, m, look in known if (e := _energies_of_model(n, m, look)) is not None]
    if not found:
        return ""
    names = list(dict.fromkeys(name for e in found for name in e.values))
    phases = {name: phase_look(i) for i, name in enumerate(names)}
    key = tag(
        "ul", *(tag("li", legend_sample_svg(look), tag("span", text(n))) for n, look in phases.items()), class_="key"
    )
    charts = tag("div", *(e.render_figure(i, phases) for i, e in enumerate(found)), class_="small-plates")
    return tag("h3", "Energies") + key + charts


def _energies_of_model(name: str, model: ModelResult, look: CurveStyle) -> _Energies | None:
    """Return the energies of a model; None if it has none that match its times."""
    times = np.asarray(model.solve.get("times") or (), dtype=float)
    given = model.solve.get("energies") or {}
    values = {n: np.asarray(v, dtype=float) for n, v in given.items() if len(v) == len(times)}
    values = {n: v for n, v in values.items() if np.isfinite(v).all()}
    return _Energies(name, look, times, values) if values and len(times) > 1 else None


@dataclass(frozen=True)
class _Energies:
    """Energies of one model, J, shape (t,) each, at times (t,), s."""

    name: str
    look: CurveStyle
    times: Floats
    values: dict[str, Floats]

    @cached_property
    def drawn_time_indices(self) -> NDArray[np.int64]:
        """Indices of the times that are drawn."""
        return pick_evenly(len(self.times), DRAWN)

    @property
    def words(self) -> str:
        """Change of the total energy as a phrase."""
        if SUM not in self.values:
            return f"{len(self.times)} moments"
        total = self.values[SUM]
        drift = float(np.abs(total - total[0]).max())
        largest = max(float(np.ptp(v)) for v in self.values.values())
        share = f", {typeset_number(f'{100 * drift / largest:.2g} %')} of the largest exchange" if largest > 0 else ""
        return f"the total changes by up to {format_quantity(drift, 'J', 2)}{share}"

    def render_figure(self, index: int, phases: dict[str, CurveStyle]) -> str:
        """Return the HTML of the chart of this model."""
        every = np.concatenate(list(self.values.values()))
        low, high = float(every.min()), float(every.max())
        margin = 0.05 * (high - low) or 1e-12
        x = linear(float(self.times[0]), float(self.times[-1]), "time", "s", 5)
        y = linear(low - margin, high + margin, "energy", "J", 5)
        chart = Chart(
            f"energy-{index}", f"Energies of {self.name}", f"{self.name}: {self.words}.", x, y, WIDTH, HEIGHT,
            tuple(self._curve(i, n, phases[n]) for i, n in enumerate(self.values)), labels=False,
            left=LEFT, top=TOP, right=14.0,
        )  # fmt: skip
        return figure_block(
            chart, prose(f"`{self.name}`: {self.words}."), self._columns(), self._csv_link(), legend=False
        )

    def _curve(self, index: int, name: str, phase: CurveStyle) -> Curve:
        points = tuple((float(self.times[i]), float(self.values[name][i])) for i in self.drawn_time_indices)
        return Curve(name, replace(phase, role="model", colour=self.look.colour), points, 1 + index, 1)

    def _columns(self) -> list[ColumnGroup]:
        scale = choose_scale([float(np.abs(v).max()) for v in self.values.values()], "J")
        found = [
            ColumnGroup(
                "t / s", ("t / s",), [(typeset_number(f"{self.times[i]:.5g}"),) for i in self.drawn_time_indices]
            )
        ]
        for name, v in self.values.items():
            cells = [(typeset_number(f"{v[i] / scale.factor:.5g}"),) for i in self.drawn_time_indices]
            found.append(ColumnGroup(name, (scale.heading("E"),), cells))
        return found

    def _csv_link(self) -> str:
        header = ["t [s]", *(f"{n} [J]" for n in self.values)]
        rows: list[list[Cell]] = [
            [round_for_drawing(float(t)), *(round_for_drawing(float(v[i])) for v in self.values.values())]
            for i, t in enumerate(self.times)
        ]
        return csv_link(f"{self.name}-energies", header, rows)
