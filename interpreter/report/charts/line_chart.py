"""Line chart as inline SVG: grid, axes, curves with markers, and curve names at the ends of curves."""

from __future__ import annotations

from functools import cached_property

from softmark.interpreter.report.charts.chart_axes import Axis
from softmark.interpreter.report.charts.curve_labels import LabelPlace, Path, Point, connected_pieces, place_labels
from softmark.interpreter.report.charts.curve_styles import MARKERS, CurveStyle
from softmark.interpreter.report.page.html_markup import strip_backticks, tag, text
from softmark.records import dataclass


@dataclass(frozen=True)
class Curve:
    """Curve through points in SI, with None at gaps; `column` is the index of its first column in the data table."""

    name: str
    look: CurveStyle
    points: tuple[Point | None, ...]
    column: int = 1
    columns: int = 1
    every: int = 0  # number of points from one marker to the next; 0: about seven markers in all
    named: bool = True  # whether the name is drawn at the end of the curve, if there is space


@dataclass(frozen=True)
class Chart:
    """Content of a line chart; `width` and `height` of the plot are in pixels, `desc` describes it in words."""

    identity: str
    title: str
    desc: str
    x: Axis
    y: Axis
    width: float
    height: float
    curves: tuple[Curve, ...]
    under: str = ""  # markup beneath the curves
    labels: bool = True
    left: float = 58.0
    top: float = 34.0
    right: float = 18.0
    bottom: float = 52.0

    def pixel(self, point: Point) -> Point:
        """Return the position of a point in the picture, in pixels."""
        x, y = self.x.at(point[0]), self.y.at(point[1])
        return self.left + x * self.width, self.top + (1.0 - y) * self.height

    @cached_property
    def paths(self) -> tuple[Path, ...]:
        """Points of every curve, in pixels."""
        return tuple(tuple(p and self.pixel(p) for p in curve.points) for curve in self.curves)

    @cached_property
    def label_places(self) -> dict[int, LabelPlace]:
        """Positions of curve names, by index of the curve."""
        wanted = [curve.name if curve.named and self.labels else None for curve in self.curves]
        right, bottom = self.left + self.width + self.right, self.top + self.height
        return place_labels(self.paths, wanted, (self.left, self.top, right, bottom))

    def svg(self) -> str:
        """Return the chart as SVG."""
        w, h = self.left + self.width + self.right, self.top + self.height + self.bottom
        title = tag("title", text(strip_backticks(self.title)), id=f"{self.identity}-t")
        clip = f'<clipPath id="{self.identity}-c">{self._plot_area_svg()}</clipPath>'
        desc = tag("desc", text(strip_backticks(self.desc)), id=f"{self.identity}-d")
        drawn = [_curve(c, path, i) for i, (c, path) in enumerate(zip(self.curves, self.paths, strict=True))]
        curves = tag("g", *drawn, clip_path=f"url(#{self.identity}-c)")
        named = [_label_svg(self.curves[i], i, self.paths[i], place) for i, place in self.label_places.items()]
        return tag(
            "svg", title, desc, clip, _axes(self), self.under, curves, *named, role="img",
            aria_labelledby=f"{self.identity}-t {self.identity}-d", viewBox=f"0 0 {w:.0f} {h:.0f}",
            style=f"max-width:{w / 14.5:.1f}rem;--whole:{w / (w - self.right + 18):.3f}",
        )  # fmt: skip

    def _plot_area_svg(self) -> str:
        """Return the SVG of the plot area with a margin for markers; curves are clipped at its edges."""
        return tag("rect", x=self.left - 6, y=self.top - 6, width=self.width + 12, height=self.height + 12)


def _curve(curve: Curve, path: Path, index: int) -> str:
    lines = [tag("polyline", points=" ".join(f"{x:.1f},{y:.1f}" for x, y in run)) for run in connected_pieces(path)]
    skipped = " ".join(str(i) for i, p in enumerate(path) if p is None)
    line = tag("g", *lines, stroke_dasharray=curve.look.dash or None)
    return tag(
        "g", line, _markers(curve, path, index), class_=f"curve k{index} {curve.look.classes}",
        data_name=curve.name, data_c=curve.column, data_w=curve.columns, data_skip=skipped or None,
    )  # fmt: skip


def _markers(curve: Curve, path: Path, index: int) -> str:
    if curve.look.marker not in MARKERS:
        return ""
    every = curve.every or max(1, round((len(path) - 1) / 7))
    start = 0 if every == 1 else (1 + 2 * index) % every
    last = max((i for i, p in enumerate(path) if p), default=-1)
    chosen = [p for i, p in enumerate(path) if p and (i == last or (i % every == start and i + 2 < last) or every == 1)]
    return tag("path", class_="mark", d="".join(MARKERS[curve.look.marker](*p) for p in chosen))


def _label_svg(curve: Curve, index: int, path: Path, place: LabelPlace) -> str:
    name = tag("text", text(curve.name), x=f"{place.x:.1f}", y=f"{place.y:.1f}", text_anchor=place.anchor)
    line = ""
    if place.line:
        (ax, ay), (bx, by) = place.line
        line = tag("path", d=f"M{ax:.1f} {ay:.1f}L{bx:.1f} {by:.1f}")
    return tag("g", line, name, class_=f"name k{index} {curve.look.classes}")


def _axes(chart: Chart) -> str:
    """Return the SVG of grid lines, tick labels and the names of both axes."""
    left, top, right, bottom = chart.left, chart.top, chart.left + chart.width, chart.top + chart.height
    across = [(left + chart.x.at(value) * chart.width, label) for value, label in chart.x.ticks]
    up = [(bottom - chart.y.at(value) * chart.height, label) for value, label in chart.y.ticks]
    grid = [f"M{x:.1f} {top:.1f}V{bottom:.1f}" for x, _ in across] + [f"M{left:.1f} {y:.1f}H{right:.1f}" for y, _ in up]
    ticks = [_text(label, x, bottom + 19, "middle") for x, label in across]
    ticks += [_text(label, left - 8, y + 4, "end") for y, label in up]
    frame = tag("path", class_="frame", d=f"M{left:.1f} {top:.1f}V{bottom:.1f}H{right:.1f}")
    names = _text(chart.x.label, (left + right) / 2, bottom + 43, "middle", class_="axis")
    names += _text(chart.y.label, 2, top - 17, "start", class_="axis")
    return tag("path", class_="grid", d="".join(grid)) + frame + tag("g", *ticks, class_="ticks") + names


def _text(words: str, x: float, y: float, anchor: str, **attributes: object) -> str:
    return tag("text", text(words), x=f"{x:.1f}", y=f"{y:.1f}", text_anchor=anchor, **attributes)


def legend_sample_svg(look: CurveStyle) -> str:
    """Return the SVG of a short piece of a curve for a legend; it is hidden from screen readers."""
    line = tag("g", tag("path", d="M1 7H37"), stroke_dasharray=look.dash or None)
    mark = tag("path", class_="mark", d=MARKERS[look.marker](19, 7)) if look.marker in MARKERS else ""
    drawn = tag("g", line, mark, class_=f"curve {look.classes}")
    return tag("svg", drawn, viewBox="0 0 38 14", width=38, height=14, aria_hidden="true")
