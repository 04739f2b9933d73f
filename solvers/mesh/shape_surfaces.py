"""Triangulated surfaces made without a mesh: bodies along an axis, bodies of revolution, and rounded boxes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from softmark.solvers.mesh.shape import Vector3, transverse

if TYPE_CHECKING:
    from softmark.solvers.mesh.shape import Swept

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

AROUND, ALONG = 32, 48
QUARTER = 4  # facets of half of a rounded edge


def triangulate_swept(shape: Swept, around: int = AROUND, along: int = ALONG) -> tuple[Floats, Ints]:
    """Return points (n, 3), m, and triangles (t, 3), facing outward, of the surface of a body along an axis."""
    stations = np.linspace(0.0, shape.length, along + 1).tolist()
    sections = [shape.section_at(s) for s in stations]
    rings = np.array([section.outline(around) for section in sections])  # (along + 1, k, 2), counter-clockwise
    k = rings.shape[1]
    axis = np.array([shape.centre(s) for s in stations])
    frames = np.array([shape.frame(s)[1:] for s in stations])  # (along + 1, 2, 3)
    sides = (axis[:, None, :] + rings @ frames).reshape(-1, 3)
    holes = [hole for hole in (section.hole(around) for section in sections) if hole is not None]
    if holes:
        return _hollow_tube_triangles(sides, (axis[:, None, :] + np.array(holes) @ frames).reshape(-1, 3), k, along)
    points = np.concatenate([sides, axis[:1], axis[-1:]])
    first, last = len(sides), len(sides) + 1
    i = np.arange(k)
    j = (i + 1) % k
    rows = [_triangles_between_rings(k * s, i, j, k) for s in range(along)]
    caps = [_fan_triangles(first, j, i), _fan_triangles(last, i + k * along, j + k * along)]
    return points, np.concatenate([*rows, *caps]).astype(np.int64)


def _hollow_tube_triangles(outer: Floats, inner: Floats, k: int, along: int) -> tuple[Floats, Ints]:
    """Return the surface of a hollow body: its outer and inner side, from rings of k points, and both end faces."""
    i = np.arange(k)
    j = (i + 1) % k
    rows = [_triangles_between_rings(k * s, i, j, k) for s in range(along)]
    within = [r[:, ::-1] + len(outer) for r in rows]
    a, b, c, d = i, j, j + len(outer), i + len(outer)  # first end, whose normal points back along the axis
    first = np.concatenate([np.stack([a, c, b], axis=1), np.stack([a, d, c], axis=1)])
    caps = [first, first[:, ::-1] + k * along]
    return np.concatenate([outer, inner]), np.concatenate([*rows, *within, *caps]).astype(np.int64)


def _triangles_between_rings(start: int, i: Ints, j: Ints, k: int) -> Ints:
    """Return two triangles for each quadrilateral between successive rings of k points."""
    a, b, c, d = start + i, start + j, start + j + k, start + i + k
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def _fan_triangles(centre: int, i: Ints, j: Ints) -> Ints:
    return np.stack([np.full(len(i), centre), i, j], axis=1)


def triangulate_revolved(outline: Floats, axis: Vector3, origin: Vector3, around: int = AROUND) -> tuple[Floats, Ints]:
    """Return points (n, 3), m, and triangles (t, 3), facing outward, of a revolved outline.

    `outline` (m, 2) are radii r and axial positions z, m, from one end on the axis to the other.
    """
    a = 2.0 * np.pi * np.arange(around) / around
    ends, sides = outline[[0, -1], 1], outline[1:-1]
    rings = np.stack([sides[:, :1] * np.cos(a), sides[:, :1] * np.sin(a), np.repeat(sides[:, 1:], around, 1)], axis=2)
    local = np.concatenate([rings.reshape(-1, 3), np.outer(ends, [0.0, 0.0, 1.0])])
    i = np.arange(around)
    j, last = (i + 1) % around, len(local) - 1
    rows = [_triangles_between_rings(around * s, i, j, around) for s in range(len(sides) - 1)]
    caps = [_fan_triangles(last - 1, j, i), _fan_triangles(last, i + last - 1 - around, j + last - 1 - around)]
    points = local @ np.array([*transverse(axis), axis]) + np.array(origin)
    return points, np.concatenate([*rows, *caps]).astype(np.int64)


def triangulate_rounded_box(size: Vector3, rounding: float, origin: Vector3) -> tuple[Floats, Ints]:
    """Return points (n, 3), m, and triangles (t, 3), facing outward, of a box with rounded edges."""
    half, edge = 0.5 * np.array(size), rounding * np.tan(np.linspace(0.0, 0.25 * np.pi, QUARTER + 1))
    core, points, triangles = half - rounding, list[Floats](), list[Ints]()
    ends = [np.concatenate([-(c + edge[::-1]), c + edge]) for c in core]
    for k in range(3):
        first, second = (k + 1) % 3, (k + 2) % 3
        for sign in (1.0, -1.0):
            face = np.empty((len(ends[first]), len(ends[second]), 3))
            face[..., first], face[..., second] = np.meshgrid(ends[first], ends[second], indexing="ij")
            face[..., k] = sign * half[k]
            points.append(face.reshape(-1, 3))  # every face has equally many points
            triangles.append(_lattice_triangles(*face.shape[:2], flipped=sign < 0.0) + len(triangles) * len(points[0]))
    X = np.concatenate(points)
    _, kept, numbers = np.unique((X / rounding).round(6), axis=0, return_index=True, return_inverse=True)
    X, within = X[kept], np.clip(X[kept], -core, core)
    away = X - within
    round_off = within + rounding * away / np.linalg.norm(away, axis=1, keepdims=True)
    return round_off + half + np.array(origin), numbers.ravel()[np.concatenate(triangles)].astype(np.int64)


def _lattice_triangles(n: int, m: int, flipped: bool) -> Ints:
    """Return two triangles for each cell of a lattice of n x m points; `flipped` reverses their orientation."""
    p = np.arange(n * m).reshape(n, m)
    a, b, c, d = p[:-1, :-1].ravel(), p[1:, :-1].ravel(), p[1:, 1:].ravel(), p[:-1, 1:].ravel()
    found = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return found[:, ::-1] if flipped else found
