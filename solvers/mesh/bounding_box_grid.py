"""Which boxes hold a point: by a grid whose cubes list the boxes that meet them."""

from __future__ import annotations

import numpy as np

from softmark.solvers.mesh.mesh import Floats, Ints

MOST = 64  # entries of the lists for each box, on average: beyond, cubes are larger
CHUNK = 20_000  # points whose candidates are held at once


def holding(low: Floats, high: Floats, X: Floats) -> tuple[Ints, Ints]:
    """Pairs of a point X (n, 3) and a box that holds it (p,) each, by points; boxes from `low` to `high` (m, 3).

    Cubes are about as large as the boxes, so that time and memory grow with n + m + p, not with n m.
    """
    start, edge, size = _grid(low, high)
    boxes, cubes = _lists(_cube(low - start, edge, size), _cube(high - start, edge, size), size)
    own = np.ravel_multi_index(tuple(_cube(X - start, edge, size).T), tuple(size))
    first, end = np.searchsorted(cubes, own), np.searchsorted(cubes, own, side="right")
    which, box = [np.zeros(0, dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
    for begin in range(0, len(X), CHUNK):
        some = slice(begin, begin + CHUNK)
        point, entry = _runs(first[some], end[some] - first[some])
        point, near = point + begin, boxes[entry]
        held = ((X[point] >= low[near]) & (X[point] <= high[near])).all(axis=1)
        which.append(point[held])
        box.append(near[held])
    return np.concatenate(which), np.concatenate(box)


def _grid(low: Floats, high: Floats) -> tuple[Floats, Floats, Ints]:
    """Where a grid over all boxes begins (3,), the edges of its cubes (3,) and how many there are along each (3,)."""
    start, whole = low.min(axis=0), np.ptp(np.concatenate([low, high]), axis=0)
    edge = np.maximum((high - low).mean(axis=0), np.maximum(1e-3 * whole, np.finfo(float).tiny))
    while float(np.prod((high - low) / edge + 1.0, axis=1).sum()) > MOST * len(low):
        edge = 2.0 * edge
    return start, edge, (whole / edge).astype(np.int64) + 1


def _cube(X: Floats, edge: Floats, size: Ints) -> Ints:
    """The cube of each point (n, 3), of those outside the grid the nearest."""
    return np.clip(X / edge, 0, size - 1).astype(np.int64)


def _lists(low: Ints, high: Ints, size: Ints) -> tuple[Ints, Ints]:
    """Boxes and the cubes that they meet (l,) each, by cubes: those from `low` to `high` (m, 3)."""
    count = high - low + 1
    box, entry = _runs(np.zeros(len(low), dtype=np.int64), count.prod(axis=1))
    across, along = count[box, 1] * count[box, 2], count[box, 2]
    step = np.stack([entry // across, entry // along % count[box, 1], entry % along])
    cube = np.ravel_multi_index(tuple(low[box].T + step), tuple(size))
    order = np.argsort(cube, kind="stable")
    return box[order], cube[order]


def _runs(first: Ints, length: Ints) -> tuple[Ints, Ints]:
    """For each i the numbers first[i], first[i] + 1, ... of which there are length[i]: i and the number (sum,)."""
    which = np.repeat(np.arange(len(first)), length)
    return which, np.arange(len(which)) - np.repeat(length.cumsum() - length - first, length)
