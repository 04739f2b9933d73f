"""The pictures of the gallery: shapes of a few models, or a curve, without words and over a transparent ground.

What they show is in the record beside them. `gallery.py` calls `picture_of`.
"""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_rgb
from numpy.typing import NDArray
from PIL import Image

from softmark import Report
from softmark.interpreter.report.charts.viridis import viridis
from softmark.interpreter.report.run.report_summary import ReportSummary
from softmark.interpreter.report.view3d.shapes_section import _is_drawable
from softmark.interpreter.report.view3d.still_picture import axes_of
from softmark.interpreter.report.view3d.view_camera import view_of
from softmark.interpreter.results.run_report import DrawnSurface
from softmark.records import dataclass

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Json = dict[str, Any]

PANELS = 3  # shapes of one picture
ALIKE = 0.02  # of the extent: shapes that differ by less are shown once
WIDE, HIGH, DOTS = 6.4, 4.0, 150  # inches, dots per inch
COLOURS = 96  # of a picture's palette
FACETS = 1200  # triangles up to which their edges are drawn
GREY = "#8a8a8a"  # readable on white and on black
PLAIN, REST = "#8fb0cc", "#a0a0a0"


def picture_of(report: Report, file: Path) -> Json | None:
    """Shapes, or else a metric over the states; what is shown, or None where there is nothing to show."""
    if shapes := _chosen(report):
        return _shapes(report, shapes, file)
    everyone = {**report.references, **report.models}
    curves = [(n, of) for n, r in everyone.items() for of, m in r.metrics.items() if len(m.states) > 2]
    return _curves(report, curves, file) if curves else None


def _chosen(report: Report) -> dict[str, DrawnSurface]:
    """A reference and the first models, or of those that look alike and have no error one."""
    known = {**dict(list(report.references.items())[:1]), **report.models}
    given = {n: r.shape for n, r in known.items() if r.shape is not None and _is_drawable(r.shape)}
    kept: dict[str, DrawnSurface] = {}
    for name, shape in given.items():
        if shape.error is not None or not any(_alike(shape, other) for other in kept.values()):
            kept[name] = shape
    return dict(list(kept.items())[:PANELS])


def _alike(one: DrawnSurface, other: DrawnSurface) -> bool:
    first, second = (np.array([s.position.min(axis=0), s.position.max(axis=0)]) for s in (one, other))
    return bool(np.abs(first - second).max() < ALIKE * np.ptp(first, axis=0).max())


@dataclass(frozen=True)
class _Colours:
    """What colour says: the error of shapes, or the first number that they carry; nothing without a unit."""

    words: str = ""
    unit: str = ""
    low: float = 0.0
    high: float = 0.0

    def values(self, shape: DrawnSurface) -> Floats | None:
        """At the points (n,) of a shape; None of one that does not have it."""
        if self.unit and self.words.startswith("distance"):
            return shape.error
        return next((c.values for c in shape.carried if self.unit and c.words == self.words), None)

    def of(self, shape: DrawnSurface) -> list[str]:
        """A colour for each triangle."""
        found, span = self.values(shape), self.high - self.low or 1.0
        if found is None:
            return [PLAIN] * len(shape.triangles)
        return [viridis((float(v) - self.low) / span) for v in found[shape.triangles].mean(axis=1)]


def _colours(shapes: dict[str, DrawnSurface]) -> _Colours:
    """Errors first; their scale, and that of numbers, leaves out the most extreme points."""
    errors = [s.error for s in shapes.values() if s.error is not None and len(s.error)]
    measured = next((s.measured_from for s in shapes.values() if s.measured_from), None)
    if errors and measured and (most := max(float(np.percentile(e, 95)) for e in errors)) > 0.0:
        return _Colours(f"distance to `{measured}`", "m", 0.0, most)
    carried = [c for s in shapes.values() for c in s.carried if c.values is not None and np.isfinite(c.values).all()]
    if not carried:
        return _Colours()
    own = np.concatenate([c.values for c in carried if c.words == carried[0].words and c.values is not None])
    low, high = (float(v) for v in np.percentile(own, [2, 98]))
    return _Colours(carried[0].words, carried[0].unit, low, high) if high > low else _Colours()


def _shapes(report: Report, shapes: dict[str, DrawnSurface], file: Path) -> Json:
    axes, colours = axes_of(view_of(ReportSummary(report), shapes.values())), _colours(shapes)
    low, high = _box(shapes, axes[:2].T)
    across, up = np.maximum(high - low, 1e-12)
    grid = (1, len(shapes)) if across < 1.6 * up else (len(shapes), 1)
    figure, panels = plt.subplots(*grid, figsize=(WIDE, HIGH), squeeze=False)
    for panel, shape in zip(panels.flat, shapes.values(), strict=True):
        _panel(panel, shape, axes, colours)
        panel.set_xlim(low[0] - 0.03 * across, high[0] + 0.03 * across)
        panel.set_ylim(low[1] - 0.03 * up, high[1] + 0.03 * up)
        panel.set_aspect("equal")
        panel.axis("off")
    figure.subplots_adjust(0, 0, 1, 1, 0.02, 0.02)
    _save(figure, file)
    shown = {"words": colours.words, "unit": colours.unit, "low": _short(colours.low), "high": _short(colours.high)}
    return {"shapes": list(shapes), "colour": shown if colours.unit else None}


def _short(value: float) -> float:
    return float(f"{value:.3g}")


def _box(shapes: dict[str, DrawnSurface], across: Floats) -> tuple[Floats, Floats]:
    """The corners (2,) of all that is drawn, m."""
    drawn = [
        X for s in shapes.values() for X in (s.position, *_rest(s), *(i.at(-1) for i in s.instruments if _near(i.X, s)))
    ]
    flat = np.concatenate([X @ across for X in drawn])
    return flat.min(axis=0), flat.max(axis=0)


def _rest(shape: DrawnSurface) -> list[Floats]:
    """Where what moves or has several states began."""
    return [] if shape.frames is None else [shape.frames[0]]


def _near(X: Floats, shape: DrawnSurface) -> bool:
    """Whether a rigid body is no larger than a few of the body: planes without end are not drawn."""
    return float(np.ptp(X, axis=0).max()) < 4.0 * float(np.ptp(shape.position, axis=0).max())


def _panel(panel: Axes, shape: DrawnSurface, axes: Floats, colours: _Colours) -> None:
    for X in _rest(shape):
        _draw(panel, X, shape.triangles, axes, [REST] * len(shape.triangles), 0.25)
    _draw(panel, shape.position, shape.triangles, axes, colours.of(shape), 1.0)
    for rigid in shape.instruments:
        if _near(rigid.X, shape):
            _draw(panel, rigid.at(-1), rigid.triangles, axes, [REST] * len(rigid.triangles), 0.5)


def _draw(panel: Axes, X: Floats, triangles: Ints, axes: Floats, colours: list[str], alpha: float) -> None:
    """Triangles that face the reader, the furthest first, with light from above the left shoulder; borders as lines."""
    corners = (X @ axes.T)[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    order = np.argsort(corners[:, :, 2].mean(axis=1))
    order = order[normal[order, 2] > -1e-9]
    light = 0.6 + 0.4 * np.clip(normal @ [-0.32, 0.5, 0.8], 0.0, 1.0)
    shown = np.array([to_rgb(c) for c in colours]).reshape(-1, 3)[order] * light[order, None]
    solid = alpha == 1.0
    edges: Any = (0.1, 0.1, 0.1, 0.3) if solid and len(triangles) <= FACETS else "face" if solid else "none"
    faces = PolyCollection(
        list(corners[order][:, :, :2]), facecolors=shown, edgecolors=edges, linewidths=0.3, alpha=alpha
    )
    panel.add_collection(faces)
    panel.add_collection(
        LineCollection(list((X @ axes.T)[_borders(triangles)][:, :, :2]), colors=GREY, linewidths=0.8, zorder=0.5)
    )


def _borders(triangles: Ints) -> Ints:
    """Edges (n, 2) of one triangle alone: of closed surfaces none, of plane bodies their outline."""
    edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    found, count = np.unique(edges, axis=0, return_counts=True)
    return found[count == 1]


def _curves(report: Report, curves: list[tuple[str, str]], file: Path) -> Json:
    """The first metric that has a value in several states, of everybody who has it."""
    metric = curves[0][1]
    shown = [name for name, of in curves if of == metric]
    figure, panel = plt.subplots(figsize=(WIDE, HIGH))
    for i, name in enumerate(shown):
        own: Any = {**report.references, **report.models}[name]
        pairs = [(s, v) for s, v in zip(own.states, own.metrics[metric].states, strict=False) if v is not None]
        panel.plot(*zip(*pairs, strict=True), marker="osv^D"[i % 5], markersize=4, linewidth=1.5)
    panel.tick_params(colors=GREY)
    for spine in panel.spines.values():
        spine.set_color(GREY)
    figure.tight_layout()
    _save(figure, file)
    return {"curve": metric, "of": shown}


def _save(figure: Any, file: Path) -> None:
    """As a palette of few colours over a transparent ground, cut to what is drawn."""
    kept = BytesIO()
    figure.savefig(kept, dpi=DOTS, transparent=True)
    plt.close(figure)
    kept.seek(0)
    image = Image.open(kept).convert("RGBA")
    box = image.getchannel("A").getbbox()
    image = image.crop(box) if box else image
    image.quantize(COLOURS, method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE).save(file, optimize=True)
