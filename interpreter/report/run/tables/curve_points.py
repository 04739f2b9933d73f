"""Data of the points of curves: a thinned table next to the chart, and a CSV file with all points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from softmark.interpreter.language.number_formatting import choose_decimals, choose_scale
from softmark.interpreter.report.page.embedded_csv import Cell, csv_link, round_for_drawing
from softmark.interpreter.report.page.figure_frame import ColumnGroup
from softmark.interpreter.results.run_report import PlottedCurve

ROWS = 60  # largest number of rows of the table


def columns(curves: Mapping[str, PlottedCurve], units: tuple[str, str]) -> list[ColumnGroup]:
    """Return the columns of the table: the x values of the curve with most points, and y of every curve at these x."""
    first = max(curves.values(), key=lambda c: len(c.x))
    every = -(-len(first.x) // ROWS)
    across = choose_scale([float(first.x.max())], units[0])
    up = choose_scale([float(abs(c.y).max()) for c in curves.values()], units[1])
    x = first.x[::every].tolist()
    places = choose_decimals(x, across, 6)
    found = [ColumnGroup(across.heading("x"), (across.heading("x"),), [(across.fixed(v, places),) for v in x])]
    for name, curve in curves.items():
        y = _values_at(curve, first.x.tolist())[::every]
        places = choose_decimals([v for v in y if v is not None], up, 6)
        shown = [("–" if v is None else up.fixed(v, places),) for v in y]
        found.append(ColumnGroup(name, (up.heading("y"),), shown))
    return found


def curves_csv_link(file: str, curves: Mapping[str, PlottedCurve], units: tuple[str, str]) -> str:
    """Return an HTML link to a CSV file with every point of the curves."""
    header = ["name", f"x [{units[0]}]", f"y [{units[1]}]"]
    rows: list[list[Cell]] = [
        [name, round_for_drawing(x), round_for_drawing(y)]
        for name, curve in curves.items()
        for x, y in zip(curve.x.tolist(), curve.y.tolist(), strict=True)
    ]
    return csv_link(file, header, rows)


def _values_at(curve: PlottedCurve, places: Sequence[float]) -> list[float | None]:
    """Return y of a curve at the x values `places`; None if the curve has no point there.

    If an x value occurs twice, as on a return path, its second occurrence gets the second y.
    """
    known: dict[float, list[float]] = {}
    for x, y in zip(curve.x.tolist(), curve.y.tolist(), strict=True):
        known.setdefault(x, []).append(float(y))
    passed: dict[float, int] = {}
    found: list[float | None] = []
    for x in places:
        values, times = known.get(x, []), passed.get(x, 0)
        found.append(values[min(times, len(values) - 1)] if values else None)
        passed[x] = times + 1
    return found
