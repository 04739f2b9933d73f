"""Tree of bounding boxes of triangles, to find the closest triangle to a point."""

from __future__ import annotations

import numpy as np

from softmark.solvers.mesh.mesh import Floats, Ints

LEAF = 4  # triangles in a box that is not divided


class TriangleTree:
    """Tree of bounding boxes of triangles with corners (t, 3, 3), m.

    Each box is split across its longest side into two boxes with half of the triangles each.
    """

    def __init__(self, corners: Floats) -> None:
        """Build the tree of triangles with corners (t, 3, 3), m."""
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
        """Return the closest triangle (n,) to points X (n, 3), m, and the closest points on them.

        The closest points are given by barycentric coordinates (n, 3).
        """
        from softmark.solvers.contact.signed_distance.closest_triangle_kernels import find_closest_triangles

        best, share = np.zeros(len(X), dtype=np.int64), np.zeros((len(X), 3))
        places = np.ascontiguousarray(X, dtype=np.float64)
        find_closest_triangles(
            places, self.low, self.high, self.child, self.first, self.corners, best, share, self.stack, np.zeros(3)
        )
        return self.order[best], share


def _build_tree(middles: Floats) -> tuple[Ints, Ints, Ints]:
    """Return the tree of triangles with centres `middles` (t, 3), m.

    The result is: the triangles (t,) in the order of the leaves, the first child (b,) of each box, or 0 for a leaf, and
    the range (b, 2) of the triangles of each box in this order.
    """
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
