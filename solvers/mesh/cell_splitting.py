"""Hexahedra into tetrahedra, and cells of corners alone into cells with nodes between them.

The choice of diagonals is a choice of model: it moves the tip of a bent beam of linear tetrahedra by several per cent.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from softmark.solvers.elements import element_of
from softmark.solvers.elements.element import Element
from softmark.solvers.elements.reference_cells import Hexahedron, Tetrahedron
from softmark.solvers.mesh.mesh import Floats, Ints, Mesh


class NotTwoColourable(Exception):
    """The points of a mesh cannot be coloured so that every edge joins two colours."""


# Six around the diagonal from corner 0 to corner 6, one for each path along three edges between them.
_KUHN = np.array([[0, 1, 2, 6], [0, 1, 5, 6], [0, 3, 2, 6], [0, 3, 7, 6], [0, 4, 5, 6], [0, 4, 7, 6]])
# The same diagonal with other faces: 1-3 below, 5-7 above, as SOFA has it.
_SIX = np.array([[0, 5, 1, 6], [0, 1, 3, 6], [1, 3, 6, 2], [6, 3, 0, 7], [6, 7, 0, 5], [7, 5, 4, 0]])
_MIRROR_X, _MIRROR_Z = np.array([1, 0, 3, 2, 5, 4, 7, 6]), np.array([4, 5, 6, 7, 0, 1, 2, 3])


def meshed(points: Floats, hexahedra: Ints, colour: Ints, element: type[Element], same: Ints | None = None) -> Mesh:
    """Cells of an element made of hexahedra (m, 8); diagonals are between points of one colour (n,), 0 or 1.

    `same` (n,) is the point that each point really is, where hexahedra are wedges: cells with one twice are none.
    """
    even = colour[hexahedra[:, 0]] == 0
    own, other = (hexahedra[:, np.array(part)] for part in element.split)
    cells = np.where(even[:, None, None], own, other).reshape(-1, element.corners)
    if same is not None:
        used, cells = np.unique(same[cells], return_inverse=True)
        cells = cells.reshape(-1, element.corners).astype(np.int64)
        order = np.sort(cells, axis=1)
        points, cells = points[used], cells[(order[:, 1:] != order[:, :-1]).all(axis=1)]
    return with_nodes(Mesh(points, positive(points, cells, element), element.linear), element)


def five(mesh: Mesh) -> Mesh:
    """Five tetrahedra for each hexahedron; neighbours agree on their diagonals. Raises NotTwoColourable."""
    return meshed(mesh.points, mesh.cells, chessboard(mesh), element_of(Tetrahedron.linear))


def repeated(mesh: Mesh) -> Mesh:
    """Five for each hexahedron, cut alike in all by the order of their nodes, whatever the neighbours do."""
    return _loose(mesh, mesh.cells[:, np.array(Tetrahedron.split[0])].reshape(-1, 4))


def kuhn(mesh: Mesh) -> Mesh:
    """Six around the diagonal from corner 0 to corner 6 of each hexahedron (Kuhn 1960), whatever the neighbours do."""
    return _loose(mesh, mesh.cells[:, _KUHN].reshape(-1, 4))


def alternating(mesh: Mesh) -> Mesh:
    """Six for each hexahedron, mirrored by the parity of its number, as SOFA did in 2008 on a mesh that is no grid.

    Cell i is mirrored along its first edge where i is even, and along its last where i/2 is odd, as if the mesh were
    a grid of two by one cells. Faces of neighbours need not match.
    Source: TetrahedronFEMForceField.inl of SOFA, July 2008.
    """
    hexahedra, number = mesh.cells.copy(), np.arange(len(mesh.cells))
    even, upper = number % 2 == 0, number // 2 % 2 == 1
    hexahedra[even] = hexahedra[even][:, _MIRROR_X]
    hexahedra[upper] = hexahedra[upper][:, _MIRROR_Z]
    return _loose(mesh, hexahedra[:, _SIX].reshape(-1, 4))


SPLITS: dict[str, Callable[[Mesh], Mesh]] = {
    "five": five,
    "repeated": repeated,
    "alternating": alternating,
    "kuhn": kuhn,
}


def _loose(mesh: Mesh, cells: Ints) -> Mesh:
    """Tetrahedra of hexahedra; where they do not match, the boundary is that of the hexahedra."""
    cells = positive(mesh.points, cells, element_of(Tetrahedron.linear))
    whole = Mesh(mesh.points, cells)
    if len(whole.facets) == 2 * len(mesh.facets):
        return whole
    quads = {frozenset(q) for q in mesh.facets.tolist()}
    of = np.repeat(np.arange(len(mesh.cells)), len(cells) // len(mesh.cells))
    own = mesh.cells[:, np.array(mesh.element.facets)]  # (m, 6, 4)
    outer = [[f for f in map(frozenset, six) if f in quads] for six in own.tolist()]
    triangles = cells[:, np.array(whole.element.facets)]  # (6 m, 4, 3)
    skin = [t for i, four in zip(of.tolist(), triangles.tolist(), strict=True) if outer[i]
            for t in four if any(q.issuperset(t) for q in outer[i])]  # fmt: skip
    return Mesh(mesh.points, cells, skin=np.array(skin, dtype=np.int64))


def positive(points: Floats, cells: Ints, element: type[Element]) -> Ints:
    """Cells of corners alone, turned where the volume is negative."""
    flipped = np.where(Mesh(points, cells, element.linear).volumes < 0)[0]
    cells = cells.copy()
    cells[flipped] = cells[flipped][:, np.array(element_of(element.linear).turned)]
    return cells


def chessboard(mesh: Mesh) -> Ints:
    """A colour 0 or 1 for every point (n,), different at the two ends of every edge. Raises NotTwoColourable."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import breadth_first_order, connected_components

    ends = mesh.cells[:, np.array(Hexahedron.edges)].reshape(-1, 2)
    count = len(mesh.points)
    graph = coo_matrix((np.ones(len(ends)), ends.T), shape=(count, count)).tocsr()
    graph = graph + graph.T
    colour = np.zeros(count, dtype=np.int64)
    _, part = connected_components(graph, directed=False)
    for start in np.unique(part, return_index=True)[1]:
        order, before = breadth_first_order(graph, start, directed=False)
        for point in order[1:].tolist():
            colour[point] = 1 - colour[before[point]]
    if np.any(colour[ends[:, 0]] == colour[ends[:, 1]]):
        raise NotTwoColourable
    return colour


def with_nodes(mesh: Mesh, element: type[Element]) -> Mesh:
    """The same cells as an element of more nodes, which lie where the cells' own map has them.

    Nodes that both have stand first in both.
    """
    cells, points, skin = [mesh.cells], [mesh.points], [] if mesh.skin is None else [mesh.skin]
    count, more = len(mesh.points), element.between[mesh.element.nodes - element.corners :]
    N = mesh.element.shape(element.places()[mesh.element.nodes :])
    for size in sorted({len(ends) for ends in more}):
        some = [k for k, ends in enumerate(more) if len(ends) == size]
        ends = np.sort(mesh.cells[:, np.array([more[k] for k in some])], axis=2)  # (m, k, size)
        groups, first, which = np.unique(ends.reshape(-1, size), axis=0, return_index=True, return_inverse=True)
        cell, place = np.divmod(first, len(some))
        points.append(np.einsum("na,nai->ni", N[some][place], mesh.points[mesh.cells[cell]]))
        cells.append(count + which.reshape(len(mesh.cells), -1))
        skin += [] if mesh.skin is None else [count + _of_skin(mesh.skin, element, groups)]
        count += len(groups)
    whole = np.concatenate(cells, axis=1).astype(np.int64)
    outer = None if mesh.skin is None else np.concatenate(skin, axis=1)
    return Mesh(np.concatenate(points), whole, element.name, outer, mesh.groups)


def _of_skin(skin: Ints, element: type[Element], groups: Ints) -> Ints:
    """Which of the groups of corners (g, size), in order, lie between the corners of facets (f, k)."""
    size = groups.shape[1]
    local = np.array([ends for ends in element.facet.between if len(ends) == size], dtype=np.int64).reshape(-1, size)
    sides = np.sort(skin[:, local], axis=2).reshape(-1, size)
    known, number = np.unique(np.concatenate([groups, sides]), axis=0, return_inverse=True)
    place = np.empty(len(known), dtype=np.int64)
    place[number[: len(groups)]] = np.arange(len(groups))
    found: Ints = place[number[len(groups) :]].reshape(len(skin), -1)
    return found
