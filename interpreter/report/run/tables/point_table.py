"""Table of displacements at a point probe."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from softmark.interpreter.language.number_formatting import Scale, choose_decimals, choose_scale, format_quantity
from softmark.interpreter.report.page.embedded_csv import Cell, csv_link
from softmark.interpreter.report.page.html_markup import join_names, prose, tag, text
from softmark.interpreter.report.run.tables.line_probes import AXES
from softmark.interpreter.results.run_report import ProbeResult


def point_table(probe: str, seen: Mapping[str, ProbeResult]) -> str:
    """Return an HTML table of displacement and position of the point, by model and reference."""
    numbers = {name: _displacement_and_position(p) for name, p in seen.items()}
    every = [v for row in numbers.values() for v in row]
    scale = choose_scale(every, "m")
    decimals = choose_decimals(every, scale, 6)
    rows = [_row(name, [scale.fixed(v, decimals) for v in row]) for name, row in numbers.items()]
    at = join_names([format_quantity(float(v), "m", 4) for v in next(iter(seen.values())).points[0]])
    words = f"Probe `{probe}`: the point initially at {at}; u is its displacement, x y z its deformed position."
    caption = tag("caption", tag("span", prose(words)))
    table = tag("table", caption, tag("thead", _head(scale)), tag("tbody", *rows))
    box = tag("div", table, class_="scroll", tabindex=0, role="region", aria_label=f"Probe {probe}")
    return tag("div", box, _csv_link(probe, seen), class_="points")


def _displacement_and_position(p: ProbeResult) -> list[float]:
    """Return displacement u, its magnitude |u| and position x of the point, m."""
    u, x = p.displacement[0], p.position[0]
    return [*(float(v) for v in u), float(np.sqrt(u @ u)), *(float(v) for v in x)]


def _head(scale: Scale) -> str:
    symbols = [*(f"u{axis}" for axis in AXES), "|u|", *AXES]
    columns = [tag("th", text(scale.heading(s)), scope="col", class_="n") for s in symbols]
    return tag("tr", tag("th", "Name", scope="col"), *columns)


def _row(name: str, cells: list[str]) -> str:
    head = tag("th", tag("code", text(name)), scope="row")
    return tag("tr", head, *(tag("td", text(cell), class_="n") for cell in cells))


def _csv_link(probe: str, seen: Mapping[str, ProbeResult]) -> str:
    header = ["name", *(f"{symbol} [m]" for symbol in ("X", "Y", "Z", "ux", "uy", "uz"))]
    rows: list[list[Cell]] = [[n, *(float(v) for v in (*p.points[0], *p.displacement[0]))] for n, p in seen.items()]
    return csv_link(f"{probe}-point", header, rows)
