"""Sides of cells: found again from corners of facets, and from sets of nodes."""

from __future__ import annotations

import numpy as np

from softmark.interpreter.exchange.record import Ints

# corners of the sides S1, S2, ... by the corners of a cell: Abaqus Analysis User's Guide, 28.1.4
SIDES = {
    4: ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)),
    8: ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)),
}
# nodes between the corners of an edge, by the nodes of a cell
EDGES = {
    10: ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)),
    20: ((0, 1), (1, 2), (2, 3), (0, 3), (4, 5), (5, 6), (6, 7), (4, 7), (0, 4), (1, 5), (2, 6), (3, 7)),
}
CORNERS = {"tet4": 4, "tet10": 4, "hex8": 8, "hex20": 8}


def side_nodes(many: int) -> Ints:
    """Nodes (s, q) of each side of a cell of so many nodes: its corners, and those between them."""
    corners = 4 if many in (4, 10) else 8
    rows = []
    for side in SIDES[corners]:
        between = [corners + i for i, edge in enumerate(EDGES.get(many, ())) if set(edge) <= set(side)]
        rows.append([*side, *between])
    return np.array(rows, dtype=np.int64)


class Sides:
    """The sides of cells (m, a) by their corners."""

    def __init__(self, cells: Ints) -> None:
        many = cells.shape[1]
        self.cells, self.nodes = cells, side_nodes(many)
        corners = len(SIDES[4 if many in (4, 10) else 8][0])
        own = np.sort(cells[:, self.nodes[:, :corners]], axis=2)  # (m, s, c)
        self.corners: Ints = own.reshape(-1, corners)
        _, inverse, counts = np.unique(self.corners, axis=0, return_inverse=True, return_counts=True)
        self.border = (counts == 1)[inverse.reshape(-1)]  # of each side, whether it is the body's surface

    def _pair(self, flat: Ints) -> Ints:
        each = len(self.nodes)
        return np.stack([flat // each, flat % each], axis=1).astype(np.int64)

    def of(self, facets: Ints) -> tuple[Ints, int]:
        """The sides (f, 2) on the surface that facets of corners (k, c) are, and how many are none."""
        if not len(facets) or facets.shape[1] != self.corners.shape[1]:
            return np.zeros((0, 2), dtype=np.int64), len(facets)
        asked = {tuple(row) for row in np.sort(facets, axis=1).tolist()}
        border = np.flatnonzero(self.border)
        chosen = [
            f for f, row in zip(border.tolist(), self.corners[border].tolist(), strict=True) if tuple(row) in asked
        ]
        return self._pair(np.array(chosen, dtype=np.int64)), len(asked) - len(chosen)

    def within(self, nodes: Ints) -> tuple[Ints, Ints]:
        """Sides (f, 2) of the surface all of whose nodes are among these, and those nodes (k,) that are of none."""
        inside = np.zeros(int(self.cells.max()) + 1, dtype=np.bool_)
        known = nodes[nodes < len(inside)]
        inside[known] = True
        each = self.cells[:, self.nodes].reshape(-1, self.nodes.shape[1])  # (m * s, q)
        whole = np.flatnonzero(self.border & inside[each].all(axis=1))
        inside[each[whole]] = False
        alone = known[inside[known]]
        return self._pair(whole), np.union1d(alone, nodes[nodes >= len(inside)])
