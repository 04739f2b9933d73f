"""Clipping of segments, triangles and tetrahedra by surfaces, so that every piece lies on one side of each surface.

Clipping by planes is exact. A curved surface is intersected with the edges of pieces that are small compared with its
radius; the error is of third order in their size.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from softmark.records import dataclass
from softmark.solvers.mesh.mesh import Floats, Ints

BISECTIONS = 50  # bisections of an edge crossed by a curved surface
ROUNDS = 64  # largest number of cutting rounds: each cuts one edge of every piece


@dataclass(frozen=True)
class Pieces:
    """Pieces of simplices: `corners` (p, k, 3), m, and the number `of` (p,) of the original simplex of each.

    Pieces with k = 2 corners are segments, with 3 triangles, with 4 tetrahedra.
    """

    corners: Floats
    of: Ints

    @property
    def sizes(self) -> Floats:
        """Lengths, areas or volumes of the pieces (p,), in m, m^2 or m^3.

        They are sqrt(det(E E^T)) / (k - 1)! with the edge vectors E from the first corner of a piece.
        """
        E = self.corners[:, 1:] - self.corners[:, :1]
        gram = np.einsum("pik,pjk->pij", E, E)
        sizes: Floats = np.sqrt(np.maximum(np.linalg.det(gram), 0.0)) / math.factorial(E.shape[1])
        return sizes

    @property
    def middles(self) -> Floats:
        """Centroids of the pieces (p, 3), m."""
        middles: Floats = self.corners.mean(axis=1)
        return middles

    def chosen(self, which: Ints) -> Pieces:
        """Return the pieces with the numbers `which`."""
        return Pieces(self.corners[which], self.of[which])

    def cut(self, level: Callable[[Floats], Floats], slack: float, curved: bool) -> Pieces:
        """Return the pieces, cut at the surface where the function `level`, (n, 3) -> (n,), changes sign.

        Values within `slack` of zero count as zero. `curved` is True if the surface is not a plane.
        """
        corners, of, done = self.corners, self.of, []
        k = corners.shape[1]
        v = _snap_to_zero(level(corners.reshape(-1, 3)).reshape(-1, k), slack)
        i, j = np.triu_indices(k, 1)
        for _ in range(ROUNDS):
            crossed = v[:, i] * v[:, j] < 0.0  # (p, edges)
            any_ = crossed.any(axis=1)
            done.append((corners[~any_], of[~any_]))
            if not any_.any():
                break
            corners, of, v, edge = corners[any_], of[any_], v[any_], crossed[any_].argmax(axis=1)
            corners, v = _split_simplices(corners, v, i[edge], j[edge], level if curved else None)
            of = np.concatenate([of, of])
        else:
            done.append((corners, of))
        return Pieces(np.concatenate([c for c, _ in done]), np.concatenate([o for _, o in done]))

    def bisect_longest_edges(self) -> Pieces:
        """Return both halves of each piece, cut across its longest edge."""
        k = self.corners.shape[1]
        i, j = np.triu_indices(k, 1)
        edge = np.linalg.norm(self.corners[:, i] - self.corners[:, j], axis=2).argmax(axis=1)
        n = np.arange(len(edge))
        a, b = self.corners.copy(), self.corners.copy()
        middle = 0.5 * (self.corners[n, i[edge]] + self.corners[n, j[edge]])
        a[n, i[edge]], b[n, j[edge]] = middle, middle
        return Pieces(np.concatenate([a, b]), np.concatenate([self.of, self.of]))


def join_pieces(one: Pieces, other: Pieces) -> Pieces:
    """Return two sets of pieces as one set."""
    return Pieces(np.concatenate([one.corners, other.corners]), np.concatenate([one.of, other.of]))


def _snap_to_zero(v: Floats, slack: float) -> Floats:
    return np.where(np.abs(v) <= slack, 0.0, v)


def _split_simplices(
    corners: Floats, v: Floats, i: Ints, j: Ints, level: Callable[[Floats], Floats] | None
) -> tuple[Floats, Floats]:
    """Split every simplex (n, k, 3) where the surface crosses its edge from corner i (n,) to corner j (n,).

    `v` (n, k) are the values of the level function at the corners. For a curved surface, `level` is the function
    itself. Return the corners and the values of both halves.
    """
    n = np.arange(len(corners))
    a, b = corners[n, i], corners[n, j]
    t = v[n, i] / (v[n, i] - v[n, j])
    if level is not None:
        t = _crossing_fraction(a, b, v[n, i] > 0.0, level)
    point = a + t[:, None] * (b - a)
    one, other, v_one, v_other = corners.copy(), corners.copy(), v.copy(), v.copy()
    one[n, j], other[n, i], v_one[n, j], v_other[n, i] = point, point, 0.0, 0.0
    return np.concatenate([one, other]), np.concatenate([v_one, v_other])


def _crossing_fraction(a: Floats, b: Floats, above: Any, level: Callable[[Floats], Floats]) -> Floats:
    """Return where on the segments from a to b, both (n, 3), the level function changes sign, as fractions (n,).

    `above` (n,) is True where the function is positive at a.
    """
    low, high = np.zeros(len(a)), np.ones(len(a))
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        same = (level(a + middle[:, None] * (b - a)) > 0.0) == above
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return 0.5 * (low + high)
