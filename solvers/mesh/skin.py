"""The surface of a body along an axis, without a mesh: rings along its axis, and a cap at each end."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from softmark.solvers.mesh.shape import Swept

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

AROUND, ALONG = 32, 48


def skin_of(shape: Swept, around: int = AROUND, along: int = ALONG) -> tuple[Floats, Ints]:
    """Points (n, 3) in m and triangles (t, 3), outward."""
    stations = np.linspace(0.0, shape.length, along + 1).tolist()
    sections = [shape.section_at(s) for s in stations]
    rings = np.array([section.outline(around) for section in sections])  # (along + 1, k, 2), counter-clockwise
    k = rings.shape[1]
    axis = np.array([shape.centre(s) for s in stations])
    frames = np.array([shape.frame(s)[1:] for s in stations])  # (along + 1, 2, 3)
    sides = (axis[:, None, :] + rings @ frames).reshape(-1, 3)
    holes = [hole for hole in (section.hole(around) for section in sections) if hole is not None]
    if holes:
        return _hollow(sides, (axis[:, None, :] + np.array(holes) @ frames).reshape(-1, 3), k, along)
    points = np.concatenate([sides, axis[:1], axis[-1:]])
    first, last = len(sides), len(sides) + 1
    i = np.arange(k)
    j = (i + 1) % k
    rows = [_between(k * s, i, j, k) for s in range(along)]
    caps = [_fan(first, j, i), _fan(last, i + k * along, j + k * along)]
    return points, np.concatenate([*rows, *caps]).astype(np.int64)


def _hollow(outer: Floats, inner: Floats, k: int, along: int) -> tuple[Floats, Ints]:
    """Two sides of rings of k points, and a ring between them at each end."""
    i = np.arange(k)
    j = (i + 1) % k
    rows = [_between(k * s, i, j, k) for s in range(along)]
    within = [r[:, ::-1] + len(outer) for r in rows]
    a, b, c, d = i, j, j + len(outer), i + len(outer)  # of the first end, which looks back along the axis
    first = np.concatenate([np.stack([a, c, b], axis=1), np.stack([a, d, c], axis=1)])
    caps = [first, first[:, ::-1] + k * along]
    return np.concatenate([outer, inner]), np.concatenate([*rows, *within, *caps]).astype(np.int64)


def _between(start: int, i: Ints, j: Ints, k: int) -> Ints:
    """Two triangles for each quadrilateral between a ring and the next."""
    a, b, c, d = start + i, start + j, start + j + k, start + i + k
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def _fan(centre: int, i: Ints, j: Ints) -> Ints:
    return np.stack([np.full(len(i), centre), i, j], axis=1)
