"""Nearest-point search: by all distances for few points, else by scipy's k-d tree, whose import takes 0.1 s.

The points that are found are called points, and the positions from which they are searched are called places.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from softmark.solvers.mesh.mesh import Floats, Ints

FEW = 2_000_000  # point pairs whose distances take less time than importing scipy.spatial
CHUNK = 32  # places processed at once


class PointSearch(Protocol):
    """Interface of a search structure for the points near given places."""

    def distance(self, X: Floats) -> Floats:
        """Return the distance between each place X (n, 3) and the nearest point, shape (n,)."""

    def within(self, X: Floats, radius: Floats) -> tuple[Ints, Ints]:
        """Return pairs of a place X (n, 3) and a point within its `radius` (n,), as two arrays (p,) sorted by place."""


def build_point_search(points: Floats, places: int) -> PointSearch:
    """Return a search structure for `points` (m, 3) that is fastest for `places` positions, an integer."""
    return AllDistances(points) if len(points) * places < FEW else PointTree(points)


class AllDistances:
    """Search by all pairwise distances."""

    def __init__(self, points: Floats) -> None:
        self.points = points

    def _squared_distances(self, X: Floats) -> Floats:
        """Return the squared distances (n, m), coordinate by coordinate: a sum over an axis of three is slower."""
        found = np.zeros((len(X), len(self.points)))
        for start in range(0, len(X), CHUNK):
            part = found[start : start + CHUNK]
            for x, axis in zip(X[start : start + CHUNK].T, self.points.T, strict=True):
                gap = x[:, None] - axis
                part += np.multiply(gap, gap, out=gap)
        return found

    def distance(self, X: Floats) -> Floats:
        nearest: Floats = np.sqrt(self._squared_distances(X).min(axis=1))
        return nearest

    def within(self, X: Floats, radius: Floats) -> tuple[Ints, Ints]:
        which, point = np.nonzero(self._squared_distances(X) <= radius[:, None] ** 2)
        return which, point


class PointTree:
    """Search by a k-d tree."""

    def __init__(self, points: Floats) -> None:
        from scipy.spatial import cKDTree

        self.tree: Any = cKDTree(points)

    def distance(self, X: Floats) -> Floats:
        nearest: Floats = self.tree.query(X)[0]
        return nearest

    def within(self, X: Floats, radius: Floats) -> tuple[Ints, Ints]:
        near = self.tree.query_ball_point(X, radius)
        which = np.repeat(np.arange(len(near)), [len(n) for n in near])
        return which, np.concatenate([np.asarray(n, dtype=np.int64) for n in near])
