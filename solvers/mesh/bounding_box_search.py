"""Search for the bounding boxes that contain points.

A uniform grid is laid over the boxes, and each grid cube lists the boxes that it overlaps.
"""

from __future__ import annotations

import numpy as np

from softmark.solvers.mesh.mesh import Floats, Ints

MOST = 64  # average number of list entries per box; if more, cubes are made larger
CHUNK = 20_000  # points processed at once


def find_boxes_of_points(low: Floats, high: Floats, X: Floats) -> tuple[Ints, Ints]:
    """Return pairs of a point and a box that contains it, as two arrays (p,) sorted by point.

    Points are X (n, 3). Boxes reach from `low` to `high`, both (m, 3). Grid cubes are about as large as the boxes, so
    that time and memory grow with n + m + p instead of n m.
    """
    start, edge, size = _grid_over_boxes(low, high)
    boxes, cubes = _list_boxes_by_cube(
        _cubes_of_points(low - start, edge, size), _cubes_of_points(high - start, edge, size), size
    )
    own = np.ravel_multi_index(tuple(_cubes_of_points(X - start, edge, size).T), tuple(size))
    first, end = np.searchsorted(cubes, own), np.searchsorted(cubes, own, side="right")
    which, box = [np.zeros(0, dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
    for begin in range(0, len(X), CHUNK):
        some = slice(begin, begin + CHUNK)
        point, entry = _expand_ranges(first[some], end[some] - first[some])
        point, near = point + begin, boxes[entry]
        held = ((X[point] >= low[near]) & (X[point] <= high[near])).all(axis=1)
        which.append(point[held])
        box.append(near[held])
    return np.concatenate(which), np.concatenate(box)


def _grid_over_boxes(low: Floats, high: Floats) -> tuple[Floats, Floats, Ints]:
    """Return the grid over all boxes: its origin (3,), cube edges (3,) and numbers of cubes along the axes (3,)."""
    start, whole = low.min(axis=0), np.ptp(np.concatenate([low, high]), axis=0)
    edge = np.maximum((high - low).mean(axis=0), np.maximum(1e-3 * whole, np.finfo(float).tiny))
    while float(np.prod((high - low) / edge + 1.0, axis=1).sum()) > MOST * len(low):
        edge = 2.0 * edge
    return start, edge, (whole / edge).astype(np.int64) + 1


def _cubes_of_points(X: Floats, edge: Floats, size: Ints) -> Ints:
    """Return the grid cube of each point X (n, 3), shape (n,); points outside the grid get the nearest cube."""
    return np.clip(X / edge, 0, size - 1).astype(np.int64)


def _list_boxes_by_cube(low: Ints, high: Ints, size: Ints) -> tuple[Ints, Ints]:
    """Return pairs of a box and a grid cube that it overlaps, as two arrays (l,) sorted by cube.

    Box i spans the cubes from `low[i]` to `high[i]`, both (m, 3). `size` (3,) is the number of cubes along each axis.
    """
    count = high - low + 1
    box, entry = _expand_ranges(np.zeros(len(low), dtype=np.int64), count.prod(axis=1))
    across, along = count[box, 1] * count[box, 2], count[box, 2]
    step = np.stack([entry // across, entry // along % count[box, 1], entry % along])
    cube = np.ravel_multi_index(tuple(low[box].T + step), tuple(size))
    order = np.argsort(cube, kind="stable")
    return box[order], cube[order]


def _expand_ranges(first: Ints, length: Ints) -> tuple[Ints, Ints]:
    """Return the integer ranges that start at `first` and have `length` elements, concatenated.

    The result is two arrays: the number i of the range of each element, and the element itself.
    """
    which = np.repeat(np.arange(len(first)), length)
    return which, np.arange(len(which)) - np.repeat(length.cumsum() - length - first, length)
