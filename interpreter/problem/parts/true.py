"""The surface of a shape itself, no mesh: how much of it a condition selects, and which way that looks."""

from __future__ import annotations

import math
from functools import lru_cache
from itertools import pairwise

import numpy as np

from softmark.interpreter.language.conditions import Condition, Term
from softmark.interpreter.problem.parts.patches import ConditionOnPatches, Floats, Patches
from softmark.interpreter.problem.parts.round import curved, planes
from softmark.interpreter.problem.parts.taken import Part, part
from softmark.solvers.mesh.extruded import Extruded
from softmark.solvers.mesh.polygons import edges
from softmark.solvers.mesh.revolved import Revolution
from softmark.solvers.mesh.shape import Shape, Vector3, moved, transverse
from softmark.solvers.mesh.shapes import Box, Cylinder
from softmark.solvers.mesh.sides import Around, Conical
from softmark.solvers.mesh.spheres import Round
from softmark.solvers.mesh.tube import Tube

TIPS = (1 / 4096, 1 / 256, 1 / 32, 1 / 8, 1 / 4, 1 / 2, 1.0)  # of a cone: bands towards its tip; the first is flat
SIDES = 48  # flat strips that the side of a cylinder is unrolled on


@lru_cache(maxsize=64)
def selected(shape: Shape, condition: Condition) -> tuple[float, Floats] | None:
    """Area, m^2, and the integral of the outward normal (3,), m^2, of what is selected; None of shapes from files.

    Found once for all models of a body.
    """
    if condition.groups:
        return None
    extent = shape.diagonal
    if isinstance(shape, Box):
        return _flat(_faces(shape), condition, extent)
    if isinstance(shape, Round):
        flat, within = planes(shape)
        found = [curved(shape, side, condition, extent) for side in shape.sides]
    elif isinstance(shape, Cylinder | Tube):
        flat, within = _ends(shape), _around(shape.origin, shape.axis, shape.radius, shape.section.hollow)
        found = [_side(side, condition, extent) for side in shape.sides]
    elif isinstance(shape, Revolution):
        return _turned(shape, condition)
    elif isinstance(shape, Extruded):
        return _added([_flat(corners, condition, extent) for corners in _polygonal(shape)])
    else:
        return None
    found = [(area, sense * vector) for (area, vector), sense in zip(found, (1.0, -1.0), strict=False)]
    if len(flat):
        found.append(_flat(flat, Condition.junction("and", condition, within), extent))
    return _added(found)


def _added(found: list[tuple[float, Floats]]) -> tuple[float, Floats]:
    return sum(area for area, _ in found), np.sum([vector for _, vector in found], axis=0)


def _flat(corners: Floats, condition: Condition, extent: float) -> tuple[float, Floats]:
    """Of flat parallelograms (f, 4, 3) or triangles (f, 3, 3)."""
    patches = Patches(corners, extent)
    found = part(ConditionOnPatches.of(condition, patches))
    vectors = np.concatenate([
        (4.0 if patches.nodes == 4 else 0.5) * patches.area(found.whole, np.zeros((len(found.whole), 2))),
        found.w[:, None] * patches.area(found.f, found.xi),
    ])  # fmt: skip
    return float(np.linalg.norm(vectors, axis=1).sum()), vectors.sum(axis=0)


def _faces(box: Box) -> Floats:
    """The six faces (6, 4, 3), counter-clockwise from outside."""
    low, size, faces = np.array(box.origin), np.diag(box.size), []
    for axis in range(3):
        a, b, c = size[axis], size[(axis + 1) % 3], size[(axis + 2) % 3]
        faces += [[low, low + c, low + c + b, low + b], [low + a, low + a + b, low + a + b + c, low + a + c]]
    return np.array(faces)


def _ends(prism: Cylinder | Tube) -> Floats:
    """Squares (2, 4, 3) around both ends, counter-clockwise from outside."""
    root, a = np.array(prism.origin), np.array(prism.axis)
    u, v = (prism.radius * np.array(e) for e in transverse(prism.axis))
    turning = [-u - v, u - v, u + v, v - u]
    top = root + prism.length * a
    return np.array([[root + c for c in reversed(turning)], [top + c for c in turning]])


def _around(origin: Vector3, axis: Vector3, radius: float, hollow: float | None) -> Condition:
    """Nearer to an axis than the radius, and no nearer than that of a hollow."""
    square = Term.constant(0.0)
    for e in transverse(axis):
        along = Term.constant(-sum(o * c for o, c in zip(origin, e, strict=True)))
        for i in range(3):
            if e[i]:
                along = along.combine("+", Term.coordinate(i).combine("*", Term.constant(e[i])))
        square = square.combine("+", along.combine("*", along))
    within = Condition.comparison("<=", square, Term.constant(radius**2), 2)
    if not hollow:
        return within
    return Condition.junction("and", within, Condition.comparison(">=", square, Term.constant(hollow**2), 2))


def _turned(shape: Revolution, condition: Condition) -> tuple[float, Floats]:
    """Of a body of revolution: its curved sides, and the flat rings around its axis."""
    extent, axis = shape.diagonal, np.array(shape.axis)
    found = []
    for side, outward in shape.slanted:
        area, vector = _added([_side(band, condition, extent) for band in _bands(side)])
        found.append((area, vector if outward else -vector))
    u, v = (np.array(e) for e in transverse(shape.axis))
    for ring in shape.rings:
        turning = [ring.outer * c for c in (-u - v, u - v, u + v, v - u)]
        middle = np.array(shape.origin) + ring.at * axis
        corners = np.array([[middle + c for c in (turning if ring.up else reversed(turning))]])
        within = _around(shape.origin, shape.axis, ring.outer, ring.inner)
        found.append(_flat(corners, Condition.junction("and", condition, within), extent))
    return _added(found)


def _bands(side: Conical) -> list[Conical]:
    """Frustums of a cone, the smaller the nearer to a tip, where points of its side have no direction away from it."""
    if min(side.radii) > 0.0:
        return [side]
    ends = [0.0, *TIPS] if side.first == 0.0 else [1.0 - t for t in (*reversed(TIPS), 0.0)]
    way = (side.last - side.first, side.length)
    return [
        Conical(side.axis, moved(side.origin, (a * way[1], side.axis)), (b - a) * way[1],
                side.first + a * way[0], side.last if b == 1.0 else side.first + b * way[0])
        for a, b in pairwise(ends)
    ]  # fmt: skip


def _polygonal(shape: Extruded) -> tuple[Floats, Floats]:
    """The sides of an extruded polygon (s, 4, 3), and triangles of its ends (t, 3, 3), seen from outside."""
    from softmark.solvers.mesh.plane_quads import triangles

    section = shape.section
    low, high = shape.base, shape.base + shape.height
    sides = [[(*a, low), (*b, low), (*b, high), (*a, high)] for a, b in edges(section)]
    points, cells = triangles(section, shape.diagonal)
    flat = points[cells]
    ends = [np.concatenate([own, np.full((*own.shape[:2], 1), z)], axis=2)
            for own, z in ((flat[:, ::-1], low), (flat, high))]  # fmt: skip
    return shape.placed(np.array(sides)), shape.placed(np.concatenate(ends))


def _side(side: Around | Conical, condition: Condition, extent: float) -> tuple[float, Floats]:
    """Of the side of a cylinder or a cone, its normal away from the axis.

    Strips lie between the axis and it, of which every point stands for one right outside: there an angle and a length
    along the axis have the area r (e - r' a), with the direction e from the axis a and the radius r there.
    """
    r, q = side.radii
    slope, root, a = (q - r) / side.length, np.array(side.origin), np.array(side.axis)
    u, v = (np.array(e) for e in transverse(side.axis))
    turns = 2.0 * math.pi * np.arange(SIDES + 1) / SIDES
    rim = np.cos(turns)[:, None] * u + np.sin(turns)[:, None] * v
    low, high = r * rim, q * rim + side.length * a
    corners = root + np.stack([low[:-1], low[1:], high[1:], high[:-1]], axis=1)
    patches = Patches(corners, extent, side.onto if min(r, q) > 0.0 else None)
    found: Part = part(ConditionOnPatches.of(condition, patches))
    half, mean = math.pi / SIDES, 0.5 * (r + q) * side.length
    middle = rim[:-1] + rim[1:]
    middle /= np.linalg.norm(middle, axis=1, keepdims=True)
    whole = 2.0 * mean * (math.sin(half) * middle[found.whole] - half * slope * a)
    X = patches.at(found.f, found.xi[:, None])[:, 0] - root
    along = X @ a
    away = X - along[:, None] * a
    off = np.linalg.norm(away, axis=1)
    e = away / off[:, None]
    turned = found.w * (patches.area(found.f, found.xi) * e).sum(axis=1) / off  # of the angle, times the length
    parts = (turned * (r + slope * along))[:, None] * (e - slope * a)
    area = 2.0 * mean * half * math.hypot(1.0, slope) * len(found.whole) + float(np.linalg.norm(parts, axis=1).sum())
    return area, whole.sum(axis=0) + parts.sum(axis=0)
