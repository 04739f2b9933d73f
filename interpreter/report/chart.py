"""A chart as inline SVG: grid, axes, curves with markers, and names at the ends of curves where there is room."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

from softmark.interpreter.report.axes import Axis
from softmark.interpreter.report.looks import MARKERS, Look
from softmark.interpreter.report.markup import plain, tag, text

Point = tuple[float, float]
Box = tuple[float, float, float, float]  # left, top, right, bottom


@dataclass(frozen=True)
class Curve:
    """A line of SI points, None where it has no value; `column` is its first cell in the rows of the data table."""

    name: str
    look: Look
    points: tuple[Point | None, ...]
    column: int = 1
    columns: int = 1
    every: int = 0  # a marker at every so many points; 0: about seven in all


@dataclass(frozen=True)
class Chart:
    """What is drawn: `width` and `height` of the plot itself, in CSS pixels; `desc` says what it shows in words."""

    identity: str
    title: str
    desc: str
    x: Axis
    y: Axis
    width: float
    height: float
    curves: tuple[Curve, ...]
    under: str = ""  # markup beneath the curves
    over: str = ""  # markup above them
    labels: bool = True
    left: float = 66.0
    top: float = 14.0
    right: float = 18.0
    bottom: float = 46.0

    def pixel(self, point: Point) -> Point:
        """Where a point lies in the picture."""
        return self.left + self.x.at(point[0]) * self.width, self.top + (
            1.0 - self.y.at(point[1])
        ) * self.height

    @cached_property
    def paths(self) -> tuple[tuple[Point | None, ...], ...]:
        """Pixels of every curve."""
        return tuple(tuple(p and self.pixel(p) for p in curve.points) for curve in self.curves)

    def svg(self) -> str:
        """The picture."""
        w, h = self.left + self.width + self.right, self.top + self.height + self.bottom
        drawn = [
            _curve(c, path, i, self._label(i))
            for i, (c, path) in enumerate(zip(self.curves, self.paths, strict=True))
        ]
        return tag(
            "svg", tag("title", text(plain(self.title)), id=f"{self.identity}-t"),
            tag("desc", text(plain(self.desc)), id=f"{self.identity}-d"),
            _axes(self), self.under, *drawn, self.over,
            role="img", aria_labelledby=f"{self.identity}-t {self.identity}-d", viewBox=f"0 0 {w:.0f} {h:.0f}",
            style=f"max-width:{w / 13:.1f}rem",
        )  # fmt: skip

    def _label(self, index: int) -> str:
        place = self._places.get(index) if self.labels else None
        if place is None:
            return ""
        x, y, anchor = place
        return tag(
            "text",
            text(self.curves[index].name),
            x=f"{x:.1f}",
            y=f"{y:.1f}",
            text_anchor=anchor,
            class_="name",
        )

    @cached_property
    def _places(self) -> dict[int, tuple[float, float, str]]:
        """Where names fit: inside the plot, on no curve's point and on no other name."""
        taken: list[Box] = []
        places = {}
        points = [p for path in self.paths for p in _dense(path)]
        for index, path in enumerate(self.paths):
            ends = [p for p in path if p]
            for x, y, anchor in _candidates(ends[-1]) if ends else ():
                box = _box(x, y, anchor, self.curves[index].name)
                if self._holds(box) and not _hit(box, taken, points):
                    taken.append(box)
                    places[index] = (x, y, anchor)
                    break
        return places

    def _holds(self, box: Box) -> bool:
        right, bottom = self.left + self.width + self.right, self.top + self.height
        return box[0] >= self.left and box[1] >= self.top and box[2] <= right and box[3] <= bottom


def _curve(curve: Curve, path: Sequence[Point | None], index: int, label: str) -> str:
    lines = [tag("polyline", points=" ".join(f"{x:.1f},{y:.1f}" for x, y in run)) for run in _runs(path)]
    skipped = " ".join(str(i) for i, p in enumerate(path) if p is None)
    line = tag("g", *lines, stroke_dasharray=curve.look.dash or None)
    return tag(
        "g", line, _markers(curve, path, index), label, class_=f"curve k{index} {curve.look.classes}",
        data_name=curve.name, data_c=curve.column, data_w=curve.columns, data_skip=skipped or None,
    )  # fmt: skip


def _runs(path: Sequence[Point | None]) -> Iterator[list[Point]]:
    """The stretches between gaps."""
    run: list[Point] = []
    for point in (*path, None):
        if point is not None:
            run.append(point)
        elif run:
            yield run
            run = []


def _markers(curve: Curve, path: Sequence[Point | None], index: int) -> str:
    if curve.look.marker not in MARKERS:
        return ""
    every = curve.every or max(1, round((len(path) - 1) / 7))
    start = 0 if every == 1 else (1 + 2 * index) % every
    last = max((i for i, p in enumerate(path) if p), default=-1)
    chosen = [p for i, p in enumerate(path) if p and (i % every == start or i == last)]
    return tag("path", class_="mark", d="".join(MARKERS[curve.look.marker](*p) for p in chosen))


def _axes(chart: Chart) -> str:
    """Grid lines, tick labels and the names of both axes."""
    left, top, right, bottom = chart.left, chart.top, chart.left + chart.width, chart.top + chart.height
    grid, labels = [], []
    for value, label in chart.x.ticks:
        x = left + chart.x.at(value) * chart.width
        grid.append(f"M{x:.1f} {top:.1f}V{bottom:.1f}")
        labels.append(tag("text", text(label), x=f"{x:.1f}", y=f"{bottom + 17:.1f}", text_anchor="middle"))
    for value, label in chart.y.ticks:
        y = bottom - chart.y.at(value) * chart.height
        grid.append(f"M{left:.1f} {y:.1f}H{right:.1f}")
        labels.append(tag("text", text(label), x=f"{left - 8:.1f}", y=f"{y + 4:.1f}", text_anchor="end"))
    names = [
        tag("text", text(chart.x.label), class_="axis", x=f"{(left + right) / 2:.1f}", y=f"{bottom + 37:.1f}", text_anchor="middle"),
        tag("text", text(chart.y.label), class_="axis", transform=f"translate(14 {(top + bottom) / 2:.1f}) rotate(-90)", text_anchor="middle"),
    ]  # fmt: skip
    frame = tag("path", class_="frame", d=f"M{left:.1f} {top:.1f}V{bottom:.1f}H{right:.1f}")
    return (
        tag("path", class_="grid", d="".join(grid))
        + frame
        + tag("g", *labels, class_="ticks")
        + "".join(names)
    )


# ------------------------------------------------------------------ room for names


def _candidates(end: Point) -> Iterator[tuple[float, float, str]]:
    """Right of the end, then above and below it, then left."""
    x, y = end
    for dy in (4.0, -8.0, 16.0):
        yield x + 9, y + dy, "start"
    yield x, y + 20, "middle"
    yield x, y - 12, "middle"
    for dy in (4.0, 16.0, -8.0):
        yield x - 9, y + dy, "end"


def _box(x: float, y: float, anchor: str, name: str) -> Box:
    width = 7.2 * len(name)
    left = x - {"start": 0.0, "middle": 0.5, "end": 1.0}[anchor] * width
    return left - 2, y - 11, left + width + 2, y + 4


def _hit(box: Box, taken: Sequence[Box], points: Sequence[Point]) -> bool:
    if any(box[0] < o[2] and o[0] < box[2] and box[1] < o[3] and o[1] < box[3] for o in taken):
        return True
    return any(box[0] < x < box[2] and box[1] < y < box[3] for x, y in points)


def _dense(path: Sequence[Point | None]) -> Iterator[Point]:
    """The points of a path and points between them, about 5 pixels apart."""
    for run in _runs(path):
        yield run[0]
        for (ax, ay), (bx, by) in zip(run, run[1:], strict=False):
            n = max(1, min(200, round(max(abs(bx - ax), abs(by - ay)) / 5)))
            yield from ((ax + (bx - ax) * i / n, ay + (by - ay) * i / n) for i in range(1, n + 1))


def sample(look: Look) -> str:
    """A short piece of the curve for a legend; hidden from screen readers, whose legend is the name."""
    line = tag("path", d="M1 7H37", stroke_dasharray=look.dash or None)
    mark = tag("path", class_="mark", d=MARKERS[look.marker](19, 7)) if look.marker in MARKERS else ""
    return tag(
        "svg",
        tag("g", line, mark, class_=f"curve {look.classes}"),
        viewBox="0 0 38 14",
        width=38,
        height=14,
        aria_hidden="true",
    )
