"""Sides of cells, found from the corners of facets or from sets of nodes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softmark.solvers.elements import ELEMENTS
from softmark.solvers.mesh.files.abaqus.deck_groups import facets_of_labels
from softmark.solvers.mesh.mesh_groups import known_row_mask

Ints = NDArray[np.int64]

BY_NODES = {element.nodes: element for element in ELEMENTS.values()}


def side_nodes(many: int) -> Ints:
    """Return the nodes (s, q) of the sides S1, S2, ... of a cell with `many` nodes: corners, then mid-side nodes."""
    element = BY_NODES[many]
    return np.array(element.facets, dtype=np.int64)[facets_of_labels(element)]


class CellSides:
    """Sides of cells (m, a), identified by their corners."""

    def __init__(self, cells: Ints) -> None:
        self.cells, self.nodes = cells, side_nodes(cells.shape[1])
        corners = BY_NODES[cells.shape[1]].facet.corners
        own = np.sort(cells[:, self.nodes[:, :corners]], axis=2)  # (m, s, c)
        self.corners: Ints = own.reshape(-1, corners)
        _, inverse, counts = np.unique(self.corners, axis=0, return_inverse=True, return_counts=True)
        self.border = (counts == 1)[inverse.reshape(-1)]  # for each side, whether it is on the body's surface

    def _cell_and_side_indices(self, flat: Ints) -> Ints:
        each = len(self.nodes)
        return np.stack([flat // each, flat % each], axis=1).astype(np.int64)

    def of(self, facets: Ints) -> tuple[Ints, int]:
        """Return the surface sides (f, 2) that match facets with corners (k, c), and the number of unmatched facets."""
        if not len(facets) or facets.shape[1] != self.corners.shape[1]:
            return np.zeros((0, 2), dtype=np.int64), len(facets)
        asked = np.unique(np.sort(facets, axis=1), axis=0)
        known = asked[asked[:, 0] >= 0]  # a node outside all cells is -1
        border = np.flatnonzero(self.border)
        chosen = border[known_row_mask(known, self.corners[border])]
        return self._cell_and_side_indices(chosen), len(asked) - len(chosen)

    def within(self, nodes: Ints) -> tuple[Ints, Ints]:
        """Return the surface sides (f, 2) whose nodes all belong to `nodes`, and the remaining nodes (k,)."""
        inside = np.zeros(int(self.cells.max()) + 1, dtype=np.bool_)
        known = nodes[nodes < len(inside)]
        inside[known] = True
        each = self.cells[:, self.nodes].reshape(-1, self.nodes.shape[1])  # (m * s, q)
        whole = np.flatnonzero(self.border & inside[each].all(axis=1))
        inside[each[whole]] = False
        alone = known[inside[known]]
        return self._cell_and_side_indices(whole), np.union1d(alone, nodes[nodes >= len(inside)])
