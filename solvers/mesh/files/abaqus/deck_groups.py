"""Sets and surfaces of an Abaqus or CalculiX deck as named groups of its mesh.

Groups have the names of the assembly (in a flat deck: all names), and `INSTANCE.NAME` for sets of instances. If all
nodes of a node set belong to boundary faces whose corners are all in the set, the group consists of these faces; else
it is a group of nodes. Nodes that belong to no solid cell are counted as foreign.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import Any

import numpy as np

from softmark.records import dataclass
from softmark.solvers.elements.element import Element
from softmark.solvers.mesh.files.abaqus.deck_mesh import DeckMesh
from softmark.solvers.mesh.mesh import Ints, Mesh
from softmark.solvers.mesh.mesh_groups import find_faces_by_corners, nodes_as_members

# corners of the faces S1, S2, ... by the corners of a cell: Abaqus Analysis User's Guide, 28.1.4
SIDES = {
    4: ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)),
    6: ((0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0)),
    8: ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)),
}
SHELLS = {"triangle": 3, "triangle6": 3, "quad": 4, "quad8": 4, "quad9": 4}


@dataclass(frozen=True)
class Members:
    """Members of a set or surface of a deck, as parts of its mesh.

    They are `cells` (k,), `faces` (f, 2) as cell and side number, and `nodes` (k, 2) as cell and node number in the
    cell. A node set has `nodes` if it does not consist of whole faces. `corners` are the corners of facets that
    elements outside the mesh, such as shells, define. `foreign` counts members that belong to no cell.
    """

    cells: Ints
    faces: Ints
    corners: tuple[Ints, ...] = ()
    foreign: int = 0
    nodes: Ints | None = None

    def with_faces(self, other: Members) -> Members:
        """Return these members together with the faces of `other`."""
        faces = np.unique(np.concatenate([self.faces, other.faces]), axis=0)
        return Members(self.cells, faces, self.corners, self.foreign + other.foreign)


def facets_of_labels(element: type[Element]) -> list[int]:
    """Return, for each Abaqus label S1, S2, ... of an element's sides, the number of its facet."""
    own = [frozenset(side[: element.facet.corners]) for side in element.facets]
    return [own.index(frozenset(side)) for side in SIDES[element.corners]]


@dataclass(frozen=True)
class DeckGroups:
    """Sets and surfaces of a deck, expressed by its cells (m, a) of one cell type."""

    deck: DeckMesh
    kind: str
    cells: Ints
    element: type[Element]

    def members_by_name(self) -> dict[str, Members]:
        """Return the members of all sets and surfaces by name.

        An element set or surface takes precedence over a node set of the same name.
        """
        found = {name: self._element_set_members(own) for name, _, own in self.deck.named_sets("elements")}
        for name, _, rows in self.deck.named_surfaces():
            surface = self._surface_members(rows)
            found[name] = found[name].with_faces(surface) if name in found else surface
        for name, _, own in self.deck.named_sets("nodes"):
            if name not in found:
                found[name] = self._node_set_members(own)
        return found

    def _element_set_members(self, elements: Ints) -> Members:
        cells = self.deck.cells[self.kind].rows_of(elements)
        facets, known = [], len(cells)
        for cell, corners in SHELLS.items():
            if cell in self.deck.cells and len(rows := self.deck.cells[cell].rows_of(elements)):
                facets.append(self.deck.cells[cell].nodes[rows][:, :corners])
                known += len(rows)
        return Members(cells, np.zeros((0, 2), dtype=np.int64), tuple(facets), len(elements) - known)

    def _surface_members(self, rows: Any) -> Members:
        table = {f"S{k}": side for k, side in enumerate(facets_of_labels(self.element), start=1)}
        faces, foreign = [np.zeros((0, 2), dtype=np.int64)], 0
        for elements, label, _ in rows:
            cells = self.deck.cells[self.kind].rows_of(elements)
            if label in table:
                faces.append(np.stack([cells, np.full(len(cells), table[label])], axis=1))
                foreign += len(elements) - len(cells)
            else:
                foreign += len(elements)
        return Members(np.zeros(0, dtype=np.int64), np.unique(np.concatenate(faces), axis=0), foreign=foreign)

    @cached_property
    def _boundary_facets(self) -> Ints:
        """Boundary facets (f, q) of the cells."""
        return Mesh(self.deck.points, self.cells, self.element.name).facets

    def _node_set_members(self, nodes: Ints) -> Members:
        """Return the members of a set of nodes: boundary faces if they contain all of the nodes, else the nodes."""
        chosen = np.zeros(len(self.deck.points), dtype=np.bool_)
        chosen[nodes] = True
        corners = self._boundary_facets[:, : self.element.facet.corners]
        rows = self._boundary_facets[chosen[corners].all(axis=1)]
        chosen[rows] = False
        faces, _ = find_faces_by_corners(self.cells, self.element, rows[:, : self.element.facet.corners])
        none = np.zeros(0, dtype=np.int64)
        if chosen.any() and len(own := nodes_as_members(self.cells, nodes)):
            return Members(none, np.zeros((0, 2), dtype=np.int64), foreign=len(nodes) - len(own), nodes=own)
        return Members(none, faces, foreign=int(chosen.sum()))


@dataclass(frozen=True)
class CellBlock:
    """Cells of one type, in meshio's data layout, which the readers of all formats share."""

    type: str
    data: Ints

    @property
    def dim(self) -> int:
        """Dimension of the cells: 3 for solids, 2 for surfaces, 1 for lines."""
        return 1 if self.type.startswith("line") else 2 if self.type in SHELLS else 3


@dataclass(frozen=True)
class DeckData:
    """A deck in meshio's data layout: points (n, 3), blocks of cells, and the deck itself."""

    deck: DeckMesh

    @property
    def points(self) -> Any:
        """Points (n, 3) in the length unit of the deck."""
        return self.deck.points

    @property
    def cells(self) -> list[CellBlock]:
        """Blocks of cells, one for each type."""
        return list(self._cell_blocks())

    def _cell_blocks(self) -> Iterator[CellBlock]:
        for cells in self.deck.cells.values():
            yield CellBlock(cells.type, cells.nodes)
