"""Centre lines of bodies for every line probe, drawn in the plane in which they bend.

Source: Marchal et al. (2008), figure 3.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property

import numpy as np

from softmark.interpreter.language.number_formatting import choose_decimals, choose_scale, format_quantity
from softmark.interpreter.report.charts.chart_axes import linear
from softmark.interpreter.report.charts.curve_labels import Point
from softmark.interpreter.report.charts.curve_styles import REST
from softmark.interpreter.report.charts.line_chart import Chart, Curve
from softmark.interpreter.report.page.embedded_csv import Cell, csv_link, round_for_drawing
from softmark.interpreter.report.page.figure_frame import ColumnGroup, figure_block, hidden_models_note
from softmark.interpreter.report.page.html_markup import join_names, prose, section, strip_backticks, tag
from softmark.interpreter.report.run.report_summary import ReportSummary
from softmark.interpreter.report.run.tables.line_probes import (
    AXES,
    Floats,
    arc,
    curve_styles,
    initially_shown,
    lines_of,
    points_of,
)
from softmark.interpreter.report.run.tables.point_table import point_table
from softmark.interpreter.report.view3d.view_camera import upward
from softmark.records import dataclass

WIDEST, NARROWEST = 640.0, 520.0  # width of the plot, pixels
TALLEST, LOWEST = 470.0, 150.0
NAMES = 90.0  # pixels kept free to the right of the lines, for their names
FAR = 4.0  # a model is left out if it reaches more than this many times farther than the references
REST_NAME = "undeformed"
EMPTY = "No probe has a result."


def section_of(findings: ReportSummary) -> str:
    """Return the HTML section with a figure for each line probe, and tables of point probes."""
    figures = [
        CentreLineFigure(findings, number, probe).render_figure() for number, probe in enumerate(lines_of(findings))
    ]
    tables = [point_table(probe, seen) for probe, seen in points_of(findings).items()]
    if not figures and not tables:
        seen = any(len(p.points) for who in findings.probes.values() for p in who.values())
        return "" if seen else section("figure", "Centre lines", tag("p", EMPTY, class_="quiet"))
    return section("figure", "Centre lines" if figures else "Points", *figures, *tables)


@dataclass(frozen=True)
class CentreLineFigure:
    """Figure of the centre lines at one line probe."""

    findings: ReportSummary
    number: int
    probe: str

    @cached_property
    def undeformed(self) -> Floats:
        """Points of the undeformed line, shape (n, 3), m."""
        return max((p.points for p in self.findings.probes[self.probe].values()), key=len)

    @cached_property
    def lines(self) -> dict[str, Floats]:
        """Lines, shape (n, 3), m, by name, from back to front: the undeformed one, references, models."""
        seen, report = self.findings.probes[self.probe], self.findings.report
        names = [n for n in (*report.references, *report.models) if n in seen]
        return {REST_NAME: self.undeformed} | {n: seen[n].position for n in names}

    @cached_property
    def all_points(self) -> Floats:
        """Points of all lines that the figure shows, shape (m, 3), m."""
        return np.concatenate([X for n, X in self.lines.items() if n not in self.omitted_models])

    @cached_property
    def plane(self) -> tuple[int, int]:
        """Indices of the two coordinates with the largest spread, which are the plane of the figure.

        The second one is that of gravity, if gravity is one of them. If spreads are equal, z is preferred to y.
        """
        spread = np.ptp(self.all_points, axis=0)
        first, second = sorted((0, 2, 1), key=lambda i: -float(spread[i]))[:2]
        up = int(np.abs(upward(self.findings)).argmax())
        if up in (first, second):
            return (first if second == up else second), up
        return min(first, second), max(first, second)

    @cached_property
    def omitted_models(self) -> list[str]:
        """Models left out of the figure, because their displacements would make other lines too small."""
        models, start = self.findings.report.models, self.undeformed[0]
        reach = {n: float(np.abs(X - start).max()) for n, X in self.lines.items()}
        usual = max((r for n, r in reach.items() if n not in models), default=0.0)
        return [n for n, r in reach.items() if n in models and r > FAR * usual]

    @property
    def axes(self) -> tuple[str, str]:
        """Names of the two coordinates of the plane."""
        return AXES[self.plane[0]], AXES[self.plane[1]]

    @property
    def size(self) -> float:
        """Largest extent of all lines, m."""
        return float(np.ptp(self.all_points, axis=0).max()) or 1.0

    def render_figure(self) -> str:
        """Return the HTML of the figure: chart, legend, caption, table and CSV."""
        open_ = initially_shown(self.findings)
        return figure_block(
            self._chart(open_), prose(self._caption(open_)), self._columns(), self._csv_link(), open_=open_
        )

    def _chart(self, open_: Sequence[str]) -> Chart:
        across, up, width, height = _axis_ranges_with_plot_size(self.all_points[:, self.plane])
        x = linear(*across, self.axes[0], "m", round(width / 75))
        y = linear(*up, self.axes[1], "m", max(3, round(height / 60)))
        title = f"Centre lines at probe {self.probe} in the {'–'.join(self.axes)} plane"
        return Chart(
            f"lines-{self.number}", title, self._description(), x, y, width, height, tuple(self._curves(open_))
        )

    def _curves(self, open_: Sequence[str]) -> Iterator[Curve]:
        known, models = curve_styles(self.findings.report), self.findings.report.models
        for i, (name, X) in enumerate(self.lines.items()):
            points = tuple((float(a), float(b)) for a, b in X[:, self.plane])
            named = name in open_ or name not in models
            yield Curve(name, known.get(name, REST), points, 1 + 2 * i, 2, named=named)

    def _description(self) -> str:
        """Return a description of the figure in words: the conclusion, and the end of each line."""
        ends = "; ".join(f"{name} at {self._format_point(X[-1])}" for name, X in self.lines.items())
        return f"{strip_backticks(self._closest_models_sentence())} The lines end as follows: {ends}."

    def _format_point(self, point: Floats) -> str:
        pairs = zip(self.axes, self.plane, strict=True)
        return ", ".join(f"{axis} {format_quantity(float(point[i]), 'm', 4)}" for axis, i in pairs)

    def _closest_models_sentence(self) -> str:
        said = "; ".join(self.findings.closest(self.probe))
        if not said:
            return (
                "No model has an error."
                if any(m.probe == self.probe for m in self.findings.errors)
                else "No metric compares these lines."
            )
        return f"{said[0].upper()}{said[1:]}."

    def _caption(self, open_: Sequence[str]) -> str:
        plane = f"Probe `{self.probe}` in the {'–'.join(self.axes)} plane, to the same scale along both axes."
        models = [n for n in self.lines if n in self.findings.report.models]
        shown = hidden_models_note(len(models), len([n for n in models if n in open_]))
        gone = (
            f" Outside the drawing: {join_names([f'`{n}`' for n in self.omitted_models])}."
            if self.omitted_models
            else ""
        )
        return f"{plane} {self._closest_models_sentence()}{gone}{self._out_of_plane_sentence()}{shown}"

    def _out_of_plane_sentence(self) -> str:
        """Return a sentence if the lines leave the plane of the figure."""
        third = ({0, 1, 2} - set(self.plane)).pop()
        depth = float(np.ptp(self.all_points[:, third]))
        within = format_quantity(depth, "m", 2)
        return f" Normal to this plane the lines extend over {within}." if depth > 1e-6 * self.size else ""

    def _columns(self) -> list[ColumnGroup]:
        """Return the columns of the data table: arc length, and both coordinates of every line in the plane."""
        scale = choose_scale((self.size,), "m")
        decimals = choose_decimals((self.size,), scale, 6)
        heading = scale.heading("s")
        found = [ColumnGroup(heading, (heading,), [(scale.fixed(float(s), decimals),) for s in arc(self.undeformed)])]
        symbols = tuple(scale.heading(axis) for axis in self.axes)
        for name, X in self.lines.items():
            cells = [tuple(scale.fixed(float(v), decimals) for v in row) for row in X[:, self.plane]]
            found.append(ColumnGroup(name, symbols, cells))
        return found

    def _csv_link(self) -> str:
        """Return the link to a CSV file with all three coordinates, m."""
        header = ["s [m]", *(f"{name} {axis} [m]" for name in self.lines for axis in AXES)]
        rows = [[round_for_drawing(float(s)), *self._csv_row(i)] for i, s in enumerate(arc(self.undeformed))]
        return csv_link(f"{self.probe}-positions", header, rows)

    def _csv_row(self, index: int) -> Iterator[Cell]:
        for X in self.lines.values():
            yield from (round_for_drawing(float(v)) for v in X[index]) if index < len(X) else (None,) * 3


def _axis_ranges_with_plot_size(X: Floats) -> tuple[Point, Point, float, float]:
    """Return the ranges of both axes, m, and the plot size, pixels.

    Both axes have the same scale, and there is space for names on the right.
    """
    low, high = X.min(axis=0), X.max(axis=0)
    margin = 0.05 * float((high - low).max()) or 0.5
    low, high = low - margin, high + margin
    across, up = (float(v) for v in high - low)
    per_metre = min((WIDEST - NAMES) / across, TALLEST / up)
    width, height = max(NARROWEST, across * per_metre + NAMES), max(LOWEST, up * per_metre)
    middle, half = float(low[1] + high[1]) / 2, height / per_metre / 2
    return (float(low[0]), float(low[0]) + width / per_metre), (middle - half, middle + half), width, height
