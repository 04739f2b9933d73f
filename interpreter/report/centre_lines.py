"""Figure 3 of Marchal et al. (2008) for every line probe: centre lines in the plane in which they bend.

Point probes have a small table of where the points went.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from softmark.interpreter.report.axes import linear
from softmark.interpreter.report.chart import Chart, Curve, Point
from softmark.interpreter.report.findings import Findings
from softmark.interpreter.report.looks import REST, Look, model_look, reference_look
from softmark.interpreter.report.markup import listed, plain, prose, section, tag, text
from softmark.interpreter.report.plate import SHOWN, Column, crowded, plate
from softmark.interpreter.report.quantities import decimals_of, quantity, scale_of
from softmark.interpreter.report.sheet import Cell, csv_link, short
from softmark.interpreter.results import ProbeResult, Report

Floats = NDArray[np.float64]
AXES = ("x", "y", "z")
WIDEST, TALLEST = 640.0, 470.0  # pixels of the plot


def lines_of(findings: Findings) -> dict[str, dict[str, ProbeResult]]:
    """Line probes: those with at least two points."""
    return {n: seen for n, seen in findings.probes.items() if any(len(p.points) > 1 for p in seen.values())}


def points_of(findings: Findings) -> dict[str, dict[str, ProbeResult]]:
    """Point probes."""
    lines = lines_of(findings)
    return {n: seen for n, seen in findings.probes.items() if n not in lines and seen}


def looks(report: Report) -> dict[str, Look]:
    """One look for each model and reference, the same in every figure of the page."""
    found = {name: model_look(i) for i, name in enumerate(report.models)}
    return found | {name: reference_look(i) for i, name in enumerate(report.references)}


def drawn_first(findings: Findings) -> list[str]:
    """The models that are drawn at first: those with the least first error, where there are many."""
    names = [n for n, m in findings.report.models.items() if m.probes]
    if len(names) <= SHOWN or not findings.errors:
        return names[:SHOWN]
    metric = findings.errors[0].name
    errors = {n: found.value for n in names if (found := findings.report.models[n].metrics.get(metric))}
    return sorted(names, key=lambda n: (errors.get(n) is None, errors.get(n) or 0.0))[:SHOWN]


def arc(X: Floats) -> Floats:
    """Arc position (n,) along undeformed points (n, 3), m."""
    steps = np.sqrt((np.diff(X, axis=0) ** 2).sum(axis=1))
    return np.concatenate(([0.0], np.cumsum(steps)))


def section_of(findings: Findings) -> str:
    """The figures, and the table of point probes."""
    figures = [_Lines(findings, probe, seen).plate() for probe, seen in lines_of(findings).items()]
    tables = [_point_table(probe, seen) for probe, seen in points_of(findings).items()]
    if not figures and not tables:
        return section(
            "figure",
            "Centre lines",
            tag("p", "No probe has a result, so there is nothing to draw.", class_="quiet"),
        )
    heading = "Centre lines" if figures else "Points"
    return section("figure", heading, *figures, *tables)


@dataclass(frozen=True)
class _Lines:
    """The figure of one line probe."""

    findings: Findings
    probe: str
    seen: Mapping[str, ProbeResult]

    @cached_property
    def undeformed(self) -> Floats:
        return max((p.points for p in self.seen.values()), key=len)

    @cached_property
    def all_points(self) -> Floats:
        """Every point that is drawn (n, 3), m."""
        return np.concatenate([self.undeformed, *(p.position for p in self.seen.values())])

    @cached_property
    def plane(self) -> tuple[int, int]:
        """The two coordinates with the largest spread, in the order x, y, z; z before y where they are equal."""
        spread = np.ptp(self.all_points, axis=0)
        order = sorted((0, 2, 1), key=lambda i: -float(spread[i]))
        a, b = sorted(order[:2])
        return a, b

    def plate(self) -> str:
        """Chart, legend, caption, table, CSV."""
        open_ = drawn_first(self.findings)
        columns = self._columns()
        return plate(self._chart(columns), self._caption(open_), columns, self._save(), open_=open_)

    def _chart(self, columns: Sequence[Column]) -> Chart:
        a, b = self.plane
        (left, right), (low, high), width, height = _frame(self.all_points[:, [a, b]])
        symbol, about = AXES[a], max(3, round(width / 90))
        return Chart(
            f"lines-{list(self.findings.probes).index(self.probe)}", self._title(), self._desc(),
            linear(left, right, symbol, "m", about), linear(low, high, AXES[b], "m", max(3, round(height / 60))),
            width, height, tuple(self._curves(columns)),
        )  # fmt: skip

    def _curves(self, columns: Sequence[Column]) -> Iterator[Curve]:
        look, first = looks(self.findings.report), 1
        known = {"": self.undeformed} | {n: p.position for n, p in self.seen.items()}
        for column, (name, X) in zip(
            columns[1:], _heavy_first(known, self.findings.report).items(), strict=True
        ):
            yield Curve(column.name, look.get(name, REST), tuple(self._flat(X)), first, 2)
            first += 2

    def _flat(self, X: Floats) -> list[Point]:
        a, b = self.plane
        return [(float(p[a]), float(p[b])) for p in X]

    def _title(self) -> str:
        a, b = self.plane
        return f"Centre lines at probe {self.probe} in the {AXES[a]}\u2013{AXES[b]} plane"

    def _desc(self) -> str:
        """The conclusion, and where each line ends."""
        a, b = self.plane
        ends = [
            f"{name} at {AXES[a]} {quantity(float(p.position[-1][a]), 'm', 4)}, {AXES[b]} {quantity(float(p.position[-1][b]), 'm', 4)}"
            for name, p in self.seen.items()
        ]
        return f"{plain(self._conclusion())} The lines end as follows: {'; '.join(ends)}."

    def _conclusion(self) -> str:
        said = self.findings.closest()
        if not said:
            return "No metric compares these lines."
        whole = "; ".join(said)
        return whole[0].upper() + whole[1:] + "."

    def _caption(self, open_: Sequence[str]) -> str:
        a, b = self.plane
        third = ({0, 1, 2} - {a, b}).pop()
        flat = float(np.ptp(self.all_points[:, third]))
        depth = (
            f" Out of this plane the lines stay within {quantity(flat, 'm', 2)}."
            if flat > 1e-12 * self._size
            else ""
        )
        lead = f"Probe `{self.probe}` in the {AXES[a]}–{AXES[b]} plane, to the same scale along both axes. {self._conclusion()}"
        models = [n for n in self.seen if n in self.findings.report.models]
        return prose(lead + depth + crowded(len(models), len([n for n in open_ if n in self.seen])))

    @property
    def _size(self) -> float:
        return float(np.ptp(self.all_points, axis=0).max()) or 1.0

    def _columns(self) -> list[Column]:
        """The arc position, the undeformed line, and every curve, in the plane of the figure."""
        a, b = self.plane
        s, scale = arc(self.undeformed), scale_of((self._size,), "m")
        decimals = decimals_of((self._size,), scale, 6)
        symbols = (scale.heading(AXES[a]), scale.heading(AXES[b]))
        found = [
            Column(scale.heading("s"), (scale.heading("s"),), [(scale.text(float(v), decimals),) for v in s])
        ]
        known = {"": self.undeformed} | {n: p.position for n, p in self.seen.items()}
        for name, X in _heavy_first(known, self.findings.report).items():
            cells = [tuple(scale.text(float(p[i]), decimals) for i in (a, b)) for p in X]
            found.append(Column(name or "undeformed", symbols, cells))
        return found

    def _save(self) -> str:
        header = ["s [m]", *(f"{n} {axis} [m]" for n in ("undeformed", *self.seen) for axis in AXES)]
        columns = [self.undeformed, *(p.position for p in self.seen.values())]
        rows = [_row(i, float(s), columns) for i, s in enumerate(arc(self.undeformed))]
        return csv_link(f"{self.probe}-positions", header, rows)


def _row(index: int, s: float, columns: Sequence[Floats]) -> list[Cell]:
    row: list[Cell] = [short(s)]
    for X in columns:
        row += [short(float(v)) for v in X[index]] if index < len(X) else [None] * 3
    return row


def _heavy_first(known: Mapping[str, Floats], report: Report) -> dict[str, Floats]:
    """The undeformed line, then references, then models on top of them."""
    order = {"": 0} | dict.fromkeys(report.references, 1) | dict.fromkeys(report.models, 2)
    return {n: known[n] for n in sorted(known, key=lambda n: order.get(n, 2))}


def _frame(X: Floats) -> tuple[Point, Point, float, float]:
    """Ranges of both axes and the size of the plot in pixels, to one scale; room to the right for names."""
    low, high = X.min(axis=0), X.max(axis=0)
    span = high - low
    margin = 0.05 * float(span.max()) or 0.5
    low, high = low - margin, high + margin
    across, up = (float(v) for v in high - low)
    per_metre = min((WIDEST - 90) / across, TALLEST / up)
    width, height = max(380.0, across * per_metre + 90), max(150.0, up * per_metre)
    middle, half = float(low[1] + high[1]) / 2, height / per_metre / 2
    return (float(low[0]), float(low[0]) + width / per_metre), (middle - half, middle + half), width, height


def _point_table(probe: str, seen: Mapping[str, ProbeResult]) -> str:
    """Where one point went, by model and reference."""
    values = {n: (p.points[0], p.displacement[0], p.position[0]) for n, p in seen.items()}
    scale = scale_of([float(v) for _, u, x in values.values() for v in (*u, *x)], "m")
    decimals = decimals_of([float(v) for _, u, x in values.values() for v in (*u, *x)], scale, 6)
    heads = [*(scale.heading(f"u{a}") for a in AXES), scale.heading("|u|"), *(scale.heading(a) for a in AXES)]
    head = tag("tr", *(tag("th", text(h), scope="col") for h in ("", *heads)))
    rows = []
    for name, (_, u, x) in values.items():
        numbers = [*(float(v) for v in u), float(np.sqrt(u @ u)), *(float(v) for v in x)]
        rows.append(
            tag(
                "tr",
                tag("th", tag("code", text(name)), scope="row"),
                *(tag("td", text(scale.text(v, decimals))) for v in numbers),
            )
        )
    where = listed([quantity(float(v), "m", 4) for v in next(iter(values.values()))[0]])
    caption = tag(
        "caption",
        prose(f"Probe `{probe}`: the point that was at {where}; u its displacement, x y z where it is now"),
    )
    table = tag("table", caption, tag("thead", head), tag("tbody", *rows))
    header = ["name", *(f"{k} [m]" for k in ("X", "Y", "Z", "ux", "uy", "uz"))]
    save = csv_link(
        f"{probe}-point", header, [[n, *(float(v) for v in (*X, *u))] for n, (X, u, _) in values.items()]
    )
    return tag(
        "div",
        tag("div", table, class_="scroll", tabindex=0, role="region", aria_label=f"Probe {probe}"),
        save,
        class_="points",
    )
