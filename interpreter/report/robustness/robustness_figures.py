"""Figures of `dsl robustness`: strips along each quantity with one row per model, and heat maps over pairs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any

from softmark.interpreter.planning.varied_quantities import Value, WalkedQuantity
from softmark.interpreter.report.page.html_markup import strip_backticks, tag, text
from softmark.interpreter.report.robustness.robustness_view import (
    Ruler,
    format_value,
    percent,
    point_tooltip,
    points_along,
    ruler,
    verdict_display,
)
from softmark.interpreter.study.robustness.robustness_record import PairMap, RobustnessPoint, RobustnessStudyRecord

WIDTH, LEFT, RIGHT, ROW, TOP = 900.0, 190.0, 24.0, 26.0, 10.0
TICKS = 9  # largest number, so that labels do not overlap
CELL, EDGE = 46.0, 74.0  # cell and margin of a heat map, pixels


def verdict_legend(study: RobustnessStudyRecord) -> str:
    """Return the HTML legend of the verdicts that occur in a study, such as `right`, with their meaning."""
    found = dict.fromkeys(p.found.word for p in study.points)
    items = [
        tag("li", _verdict_disc(12, 10, name, 5.0, alone=True), tag("b", text(verdict_display(name).words)), ": ",
            text(verdict_display(name).meaning))
        for name in found
    ]  # fmt: skip
    return tag("ul", *items, class_="stress-key")


def _verdict_disc(x: float, y: float, name: str, size: float, alone: bool = False, title: str = "") -> str:
    """Return the SVG of a coloured disc with the symbol of the verdict `name`, such as `right`.

    Its centre is at x and y, pixels. With `alone` the disc is a picture of its own, for a legend.
    """
    said = tag("title", text(strip_backticks(title))) if title else ""
    disc = tag("circle", cx=f"{x:.1f}", cy=f"{y:.1f}", r=size + 2.5)
    glyph = tag("text", text(verdict_display(name).sign), x=f"{x:.1f}", y=f"{y + 3.6:.1f}", text_anchor="middle")
    group = tag("g", said, disc, glyph, class_=f"stress-mark {name}")
    if not alone:
        return group
    return tag("svg", group, viewBox="0 0 24 20", width=24, height=20, aria_hidden="true")


def strip(study: RobustnessStudyRecord, asked: WalkedQuantity) -> str:
    """Return the chart of all models along one quantity; empty without points.

    Points of equal class are connected by bands.
    """
    rows = {m: points_along(study, m, asked) for m in study.models}
    rows = {m: points for m, points in rows.items() if len(points) > 1}
    if not rows:
        return ""
    scale = ruler(asked, [v for points in rows.values() for v, _ in points])
    height = TOP + ROW * len(rows) + 34
    drawn = [_model_strip(model, points, scale, i) for i, (model, points) in enumerate(rows.items())]
    said = f"Classes of {len(rows)} models along {asked.name}"
    pieces = (_nominal_line(asked, scale, len(rows)), *drawn, _value_labels(scale, TOP + ROW * len(rows)))
    reach = f" from {scale.value_text(scale.marks[0])} to {scale.value_text(scale.marks[-1])}"
    caption = tag("code", text(asked.name)) + text(reach) + _nominal_value_phrase(asked)
    return _figure(said, (WIDTH, height), pieces, caption)


def _figure(said: str, size: tuple[float, float], pieces: Sequence[str], caption: str) -> str:
    box = f"0 0 {size[0]:.0f} {size[1]:.0f}"
    picture = tag("svg", tag("title", text(said)), *pieces, viewBox=box, role="img")
    return tag("figure", tag("div", picture, class_="drawing"), tag("figcaption", tag("p", caption)), class_="plate")


def _nominal_value_phrase(asked: WalkedQuantity) -> str:
    return text(f"; value of the scene: {asked.text}") if asked.text else ""


def _pixel_x(scale: Ruler, value: Any) -> float:
    return LEFT + scale.at(value) * (WIDTH - LEFT - RIGHT)


def _model_strip(model: str, points: Sequence[tuple[Value, RobustnessPoint]], scale: Ruler, index: int) -> str:
    y = TOP + ROW * (index + 0.5)
    ordered = sorted(points, key=lambda entry: scale.at(entry[0]))
    bands = [
        tag(
            "rect",
            x=f"{_pixel_x(scale, a):.1f}",
            y=f"{y - 7:.1f}",
            width=f"{_pixel_x(scale, b) - _pixel_x(scale, a):.1f}",
            height=14,
            class_=f"band {p.found.word}",
        )
        for (a, p), (b, q) in pairwise(ordered)
        if p.found.word == q.found.word
    ]
    marks = [
        _verdict_disc(_pixel_x(scale, v), y, p.found.word, 3.5, title=f"{model}, {point_tooltip(p)}")
        for v, p in ordered
    ]
    name = tag("text", text(model), x=LEFT - 16, y=f"{y + 4:.1f}", text_anchor="end", class_="model-name")
    return tag("g", name, *bands, *marks)


def _nominal_line(asked: WalkedQuantity, scale: Ruler, rows: int) -> str:
    """Return the SVG of a line at the value of the quantity in the scene."""
    if isinstance(asked.nominal, str) or asked.nominal not in scale.marks:
        return ""
    x = f"{_pixel_x(scale, asked.nominal):.1f}"
    return tag("line", x1=x, x2=x, y1=TOP - 4, y2=TOP + ROW * rows + 4, class_="nominal")


def _value_labels(scale: Ruler, y: float) -> str:
    """Return the SVG of as many value labels as fit without overlap."""
    pieces, end = [], -1e9
    for value in _thin_marks(scale.marks):
        x, said = _pixel_x(scale, value), scale.value_text(value)
        if x - 3.6 * len(said) > end:
            pieces.append(tag("text", text(said), x=f"{x:.1f}", y=y + 20, text_anchor="middle", class_="tick"))
            end = x + 3.6 * len(said) + 6
    return "".join(pieces)


def _thin_marks(marks: Sequence[Any]) -> Iterator[Any]:
    step = max(1, -(-len(marks) // TICKS))
    yield from (v for i, v in enumerate(marks) if i % step == 0)


# ------------------------------------------------------------------ pairs


def maps(study: RobustnessStudyRecord) -> str:
    """Return a heat map for each model and pair of quantities.

    Each cell shows the verdict as tint and symbol, and the error as a number.
    """
    units = {q.name: q.unit for q in study.quantities}
    plates = [_heat_map(own, units) for own in study.maps]
    return tag("div", *plates, class_="small-plates") if plates else ""


def _heat_map(own: PairMap, units: Mapping[str, str]) -> str:
    width, height = EDGE + CELL * len(own.xs) + 8, CELL * len(own.ys) + 62
    cells = [
        _heat_map_cell(own, i, j, EDGE + CELL * i, 6 + CELL * (len(own.ys) - 1 - j))
        for j in range(len(own.ys)) for i in range(len(own.xs))
    ]  # fmt: skip
    said, pieces = f"{own.model}: {own.x} and {own.y}", _axis_labels(own, units, CELL * len(own.ys) + 6)
    over = tag("code", text(own.y)) + " over " + tag("code", text(own.x))
    return _figure(said, (width, height), [*cells, *pieces], tag("b", text(own.model)) + ": " + over)


def _heat_map_cell(own: PairMap, i: int, j: int, x: float, y: float) -> str:
    name, error = own.classes[j][i], own.errors[j][i]
    if name is None:
        return ""
    box = tag("rect", x=f"{x:.1f}", y=f"{y:.1f}", width=CELL - 2, height=CELL - 2, rx=3, class_=f"cell {name}")
    glyph = tag("text", text(verdict_display(name).sign), x=f"{x + CELL / 2 - 1:.1f}", y=f"{y + 19:.1f}",
                text_anchor="middle")  # fmt: skip
    figure = "" if error is None else tag("text", text(percent(error)), x=f"{x + CELL / 2 - 1:.1f}",
                                          y=f"{y + 35:.1f}", text_anchor="middle", class_="error")  # fmt: skip
    return tag("g", box, glyph, figure, class_=f"stress-cell {name}")


def _axis_labels(own: PairMap, units: Mapping[str, str], bottom: float) -> list[str]:
    below = [
        tag("text", text(format_value(v, units[own.x])), x=f"{EDGE + CELL * (i + 0.5) - 1:.1f}",
            y=f"{bottom + 14 + 13 * (i % 2):.1f}", text_anchor="middle", class_="tick")
        for i, v in enumerate(own.xs)
    ]  # fmt: skip
    beside = [
        tag("text", text(format_value(v, units[own.y])), x=EDGE - 8, text_anchor="end", class_="tick",
            y=f"{6 + CELL * (len(own.ys) - 1 - j) + CELL / 2 + 3:.1f}")
        for j, v in enumerate(own.ys)
    ]  # fmt: skip
    return below + beside
