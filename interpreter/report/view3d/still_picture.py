"""Still pictures of deformed shapes for readers without JavaScript: coarse polygons, drawn back to front."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from softmark.interpreter.report.charts.viridis import viridis
from softmark.interpreter.report.page.html_markup import strip_backticks, tag, text
from softmark.interpreter.report.view3d.compact_surfaces import Floats, thin_surface
from softmark.interpreter.report.view3d.rigid_bodies_view import picture_box
from softmark.interpreter.results.run_report import DrawnSurface
from softmark.records import dataclass

POLYGONS = 400  # largest number for one shape
CELL, GAP, NAME = 230.0, 14.0, 24.0  # pixels
COLUMNS = 4
SEEN_THROUGH = 0.5  # opacity of rigid bodies


@dataclass(frozen=True)
class CameraView:
    """Camera view: azimuth and elevation, degrees, in a frame (3, 3) whose last row points upwards, against gravity."""

    turn: float
    tilt: float
    frame: Floats


def frame_of(up: Floats) -> Floats:
    """Return a right-handed frame (3, 3): two horizontal directions, near coordinate axes, and the direction `up`."""
    k = int(np.abs(up).argmax())
    sign = 1.0 if up[k] > 0 else -1.0
    unit = np.eye(3)
    first, second = unit[(k + 1) % 3], unit[(k + 2) % 3]
    return np.stack([first, second, unit[k]]) if sign > 0 else np.stack([second, first, -unit[k]])


def axes_of(view: CameraView) -> Floats:
    """Return the directions to the right, upwards and towards the viewer, shape (3, 3)."""
    yaw, pitch = math.radians(view.turn), math.radians(view.tilt)
    s, c, u, v = math.sin(yaw), math.cos(yaw), math.sin(pitch), math.cos(pitch)
    level: Floats = np.array([[c, s, 0.0], [-s * u, c * u, v], [s * v, -c * v, u]]) @ view.frame
    return level


def seen_box(shapes: Mapping[str, DrawnSurface], view: CameraView) -> tuple[Floats, Floats]:
    """Return both corners (2,) of the box around the projection of all shapes at all times, m."""
    axes, flat, room = axes_of(view)[:2].T, [], picture_box(shapes.values())
    for shape in shapes.values():
        flat += [X @ axes for X in (shape.position, *(() if shape.frames is None else shape.frames))]
        flat += [
            X @ axes for X in room.positions(shape) if len(X)
        ]  # a rigid body that the plane does not cut has no outline
    return np.min([X.min(axis=0) for X in flat], axis=0), np.max([X.max(axis=0) for X in flat], axis=0)


def render_still(
    shapes: Mapping[str, DrawnSurface], view: CameraView, most: float, words: tuple[str, str], key: str = "shapes"
) -> str:
    """Return an SVG with a panel for each shape.

    `most`, m, is the error at the top of the colour scale. `words` are title and description. `key` is the prefix of
    element ids.
    """
    low, high = seen_box(shapes, view)
    scale = CELL / max(float((high - low).max()), 1e-12)
    height = float(high[1] - low[1]) * scale + NAME + GAP
    columns = min(COLUMNS, len(shapes))
    rows = -(-len(shapes) // columns)
    panels, room = [], picture_box(shapes.values())
    for i, (name, shape) in enumerate(shapes.items()):
        x, y = (i % columns) * (CELL + GAP), (i // columns) * height
        inside = _visible_triangles_svg(thin_surface(shape, POLYGONS, triangles=True), view, low, high, scale, most)
        for own in shape.instruments:
            beside = thin_surface(DrawnSurface(room.within(own.at(-1)), own.triangles), POLYGONS, triangles=True)
            inside += tag("g", _visible_triangles_svg(beside, view, low, high, scale, most), opacity=SEEN_THROUGH)
        label = tag("text", text(name), x=f"{CELL / 2:.0f}", y=f"{height - GAP:.0f}", text_anchor="middle")
        panels.append(tag("g", inside, label, transform=f"translate({x:.0f} {y:.0f})"))
    title = tag("title", text(strip_backticks(words[0])), id=f"{key}-t")
    desc = tag("desc", text(strip_backticks(words[1])), id=f"{key}-d")
    box = f"0 0 {columns * (CELL + GAP):.0f} {rows * height:.0f}"
    return tag("svg", title, desc, *panels, role="img", aria_labelledby=f"{key}-t {key}-d", viewBox=box)


def _visible_triangles_svg(
    shape: DrawnSurface, view: CameraView, low: Floats, high: Floats, scale: float, most: float
) -> str:
    """Return the SVG of the triangles that face the viewer, the farthest first."""
    axes = axes_of(view)
    X = shape.position @ axes.T  # (n, 3) right, up, near
    corners = X[shape.triangles]  # (t, 3, 3)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    front = np.flatnonzero(normal[:, 2] > 0)
    order = front[np.argsort(corners[front, :, 2].mean(axis=1))]
    flat = (corners[:, :, :2] - [low[0], high[1]]) * [scale, -scale]
    shade = np.abs(normal @ [-0.32, 0.5, 0.8]) / np.maximum(np.linalg.norm(normal, axis=1), 1e-300)
    return "".join(_triangle_svg(flat[i], float(shade[i]), _facet_error(shape, i), most) for i in order)


def _facet_error(shape: DrawnSurface, facet: int) -> float | None:
    return None if shape.error is None else float(shape.error[shape.triangles[facet]].mean())


def _triangle_svg(corners: Floats, shade: float, error: float | None, most: float) -> str:
    points = " ".join(f"{x:.0f},{y:.0f}" for x, y in corners)
    fill = viridis(error / most if most else 0.0) if error is not None else _grey(shade)
    return f'<polygon points="{points}" fill="{fill}" stroke="{fill}"/>'


def _grey(shade: float) -> str:
    level = round(105 + 95 * shade)
    return f"#{level:02x}{level:02x}{level:02x}"
