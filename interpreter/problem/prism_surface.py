"""The surface of a straight prism for pictures, without a mesh: rings along its axis, and a cap at each end."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from softmark.solvers.mesh.shape import Prism

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

AROUND, ALONG = 32, 48


def skin_of(shape: Prism, around: int = AROUND, along: int = ALONG) -> tuple[Floats, Ints]:
    """Points (n, 3) in m and triangles (t, 3), outward."""
    from softmark.solvers.mesh.shape import transverse

    ring = shape.section.outline(around)  # (k, 2), counter-clockwise
    k = len(ring)
    frame = np.array(transverse(shape.axis))  # (2, 3)
    stations = np.linspace(0.0, shape.length, along + 1)
    axis = np.array(shape.root) + stations[:, None] * np.array(shape.axis)
    sides = (axis[:, None, :] + ring @ frame).reshape(-1, 3)
    points = np.concatenate([sides, axis[:1], axis[-1:]])
    first, last = len(sides), len(sides) + 1
    i = np.arange(k)
    j = (i + 1) % k
    rows = [_between(k * s, i, j, k) for s in range(along)]
    caps = [_fan(first, j, i), _fan(last, i + k * along, j + k * along)]
    return points, np.concatenate([*rows, *caps]).astype(np.int64)


def _between(start: int, i: Ints, j: Ints, k: int) -> Ints:
    """Two triangles for each quadrilateral between a ring and the next."""
    a, b, c, d = start + i, start + j, start + j + k, start + i + k
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def _fan(centre: int, i: Ints, j: Ints) -> Ints:
    return np.stack([np.full(len(i), centre), i, j], axis=1)
