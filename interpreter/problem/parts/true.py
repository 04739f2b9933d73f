"""The surface of a shape itself, no mesh: how much of it a condition selects, and which way that looks."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from softmark.interpreter.language.conditions import Condition, Term
from softmark.interpreter.problem.parts.patches import ConditionOnPatches, Floats, Patches
from softmark.interpreter.problem.parts.round import curved, planes
from softmark.interpreter.problem.parts.taken import Part, part
from softmark.solvers.mesh.shape import Shape, transverse
from softmark.solvers.mesh.shapes import Box, Cylinder
from softmark.solvers.mesh.sides import Around
from softmark.solvers.mesh.spheres import Round
from softmark.solvers.mesh.tube import Tube

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
        flat, within = _ends(shape), _section(shape)
        found = [_side(side, condition, extent) for side in shape.sides]
    else:
        return None
    found = [(area, sense * vector) for (area, vector), sense in zip(found, (1.0, -1.0), strict=False)]
    if len(flat):
        found.append(_flat(flat, Condition.junction("and", condition, within), extent))
    return sum(area for area, _ in found), np.sum([vector for _, vector in found], axis=0)


def _flat(corners: Floats, condition: Condition, extent: float) -> tuple[float, Floats]:
    """Of flat quadrilaterals (f, 4, 3)."""
    patches = Patches(corners, extent)
    found = part(ConditionOnPatches.of(condition, patches))
    vectors = np.concatenate([
        4.0 * patches.area(found.whole, np.zeros((len(found.whole), 2))),
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


def _section(prism: Cylinder | Tube) -> Condition:
    """Nearer to the axis than the radius, and no nearer than that of a hollow."""
    square = Term.constant(0.0)
    for e in transverse(prism.axis):
        along = Term.constant(-sum(o * c for o, c in zip(prism.origin, e, strict=True)))
        for axis in range(3):
            if e[axis]:
                along = along.combine("+", Term.coordinate(axis).combine("*", Term.constant(e[axis])))
        square = square.combine("+", along.combine("*", along))
    within = Condition.comparison("<=", square, Term.constant(prism.radius**2), 2)
    if isinstance(prism, Cylinder):
        return within
    return Condition.junction("and", within, Condition.comparison(">=", square, Term.constant(prism.inner**2), 2))


def _side(side: Around, condition: Condition, extent: float) -> tuple[float, Floats]:
    """Of a curved side, its normal away from the axis.

    Strips lie between the axis and it, of which every point stands for one right outside.
    """
    R, root, a = side.radius, np.array(side.origin), np.array(side.axis)
    u, v = (np.array(e) for e in transverse(side.axis))
    turns = 2.0 * math.pi * np.arange(SIDES + 1) / SIDES
    rim = R * (np.cos(turns)[:, None] * u + np.sin(turns)[:, None] * v)
    top = side.length * a
    corners = root + np.stack([rim[:-1], rim[1:], rim[1:] + top, rim[:-1] + top], axis=1)
    patches = Patches(corners, extent, side.onto)
    found: Part = part(ConditionOnPatches.of(condition, patches))
    half = math.pi / SIDES
    middle = rim[:-1] + rim[1:]
    middle /= np.linalg.norm(middle, axis=1, keepdims=True)
    area = len(found.whole) * 2.0 * half * R * side.length
    vector = 2.0 * math.sin(half) * R * side.length * middle[found.whole].sum(axis=0)
    X = patches.at(found.f, found.xi[:, None])[:, 0] - root
    away = X - (X @ a)[:, None] * a
    r = np.linalg.norm(away, axis=1)
    flat = np.linalg.norm(patches.area(found.f, found.xi), axis=1)
    w = found.w * flat * R * (R * math.cos(half)) / r**2  # of the angle that a chord is seen under
    return area + float(w.sum()), vector + (w / r) @ away
