"""Bounding-box tree of triangles, to find the closest one to a point."""

from __future__ import annotations

import numpy as np

from softmark.solvers.mesh.mesh import Floats, Ints

LEAF = 4  # triangles in a box that is not divided


class TriangleTree:
    """Tree of triangles (t, 3, 3), m: boxes are split across their longest side, with half of the triangles each."""

    def __init__(self, corners: Floats) -> None:
        """Build the tree of triangles with these corners."""
        self.order, self.child, self.first = _build_tree(corners.mean(axis=1))
        self.corners = np.ascontiguousarray(corners[self.order])
        begins, ends = self.corners.min(axis=1), self.corners.max(axis=1)
        self.low, self.high = np.empty((len(self.child), 3)), np.empty((len(self.child), 3))
        for node in range(len(self.child) - 1, -1, -1):  # children come after their parents
            one = self.child[node]
            if one:
                parts = slice(one, one + 2)
                self.low[node], self.high[node] = self.low[parts].min(axis=0), self.high[parts].max(axis=0)
            else:
                own = slice(self.first[node, 0], self.first[node, 1])
                self.low[node], self.high[node] = begins[own].min(axis=0), ends[own].max(axis=0)
        self.stack = np.zeros(2 * (int(np.log2(len(corners))) + 4), dtype=np.int64)

    def closest(self, X: Floats) -> tuple[Ints, Floats]:
        """Return for points X (n, 3), m: the closest triangle (n,), and barycentric coordinates of the closest point
        (n, 3).
        """
        from softmark.solvers.contact.signed_distance.closest_triangle_kernels import find_closest_triangles

        best, share = np.zeros(len(X), dtype=np.int64), np.zeros((len(X), 3))
        places = np.ascontiguousarray(X, dtype=np.float64)
        find_closest_triangles(
            places, self.low, self.high, self.child, self.first, self.corners, best, share, self.stack, np.zeros(3)
        )
        return self.order[best], share


def _build_tree(middles: Floats) -> tuple[Ints, Ints, Ints]:
    """Return triangles in leaf order (t,), first children of boxes (b,), or 0, and their triangle ranges (b, 2)."""
    order, child, first = np.arange(len(middles)), [0], [(0, len(middles))]
    node = 0
    while node < len(child):
        begin, end = first[node]
        if end - begin > LEAF:
            own = order[begin:end]
            spread = np.ptp(middles[own], axis=0)
            half = (end - begin) // 2
            order[begin:end] = own[np.argpartition(middles[own, int(np.argmax(spread))], half)]
            child[node] = len(child)
            child += [0, 0]
            first += [(begin, begin + half), (begin + half, end)]
        node += 1
    return order, np.array(child), np.array(first)
