"""Splitting of hexahedra into tetrahedra, and insertion of midside nodes into cells of corner nodes.

The choice of diagonals matters: it changes the tip deflection of a beam of linear tetrahedra by several per cent.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from softmark.solvers.elements import element_of
from softmark.solvers.elements.element import Element
from softmark.solvers.elements.reference_cells import Hexahedron, Tetrahedron
from softmark.solvers.mesh.mesh import Floats, Ints, Mesh


class NotTwoColourable(Exception):
    """Raised if the points of a mesh cannot have two colours such that every edge joins different colours."""


# Six around the diagonal from corner 0 to corner 6, one for each path along three edges between them.
_KUHN = np.array([[0, 1, 2, 6], [0, 1, 5, 6], [0, 3, 2, 6], [0, 3, 7, 6], [0, 4, 5, 6], [0, 4, 7, 6]])
# The same diagonal with other faces: 1-3 below, 5-7 above, as SOFA has it.
_SIX = np.array([[0, 5, 1, 6], [0, 1, 3, 6], [1, 3, 6, 2], [6, 3, 0, 7], [6, 7, 0, 5], [7, 5, 4, 0]])
_MIRROR_X, _MIRROR_Z = np.array([1, 0, 3, 2, 5, 4, 7, 6]), np.array([4, 5, 6, 7, 0, 1, 2, 3])


def mesh_hexahedra(
    points: Floats, hexahedra: Ints, colour: Ints, element: type[Element], same: Ints | None = None
) -> Mesh:
    """Return a mesh of an element from hexahedra (m, 8) over points (n, 3); hexahedra may be split into tetrahedra.

    In tetrahedral meshes, face diagonals join points of equal `colour` (n,), 0 or 1. If hexahedra are degenerate
    (wedges), `same` (n,) gives for each point the point with which it coincides; tetrahedra that contain a point twice
    are dropped.
    """
    even = colour[hexahedra[:, 0]] == 0
    own, other = (hexahedra[:, np.array(part)] for part in element.split)
    cells = np.where(even[:, None, None], own, other).reshape(-1, element.corners)
    if same is not None:
        used, cells = np.unique(same[cells], return_inverse=True)
        cells = cells.reshape(-1, element.corners).astype(np.int64)
        order = np.sort(cells, axis=1)
        points, cells = points[used], cells[(order[:, 1:] != order[:, :-1]).all(axis=1)]
    return add_midside_nodes(Mesh(points, orient_positively(points, cells, element), element.linear), element)


def split_into_five(mesh: Mesh) -> Mesh:
    """Split each hexahedron into five tetrahedra with diagonals that match between neighbours.

    Raises NotTwoColourable.
    """
    return mesh_hexahedra(mesh.points, mesh.cells, two_colour_points(mesh), element_of(Tetrahedron.linear))


def split_into_five_alike(mesh: Mesh) -> Mesh:
    """Split each hexahedron into five tetrahedra by the same diagonals; faces of neighbours need not match."""
    return _mesh_without_matching(mesh, mesh.cells[:, np.array(Tetrahedron.split[0])].reshape(-1, 4))


def split_into_six_kuhn(mesh: Mesh) -> Mesh:
    """Split each hexahedron into six tetrahedra around the diagonal from corner 0 to corner 6.

    Faces of neighbours need not match.
    Source: Kuhn (1960).
    """
    return _mesh_without_matching(mesh, mesh.cells[:, _KUHN].reshape(-1, 4))


def split_into_six_alternating(mesh: Mesh) -> Mesh:
    """Split each hexahedron into six tetrahedra, mirrored by the parity of its number, as SOFA did in 2008.

    Cell i is mirrored along its first edge if i is even, and along its last edge if i/2 is odd, as if the mesh were a
    grid of two by one cells; SOFA did so on unstructured meshes too. Faces of neighbours need not match.
    Source: TetrahedronFEMForceField.inl of SOFA, July 2008.
    """
    hexahedra, number = mesh.cells.copy(), np.arange(len(mesh.cells))
    even, upper = number % 2 == 0, number // 2 % 2 == 1
    hexahedra[even] = hexahedra[even][:, _MIRROR_X]
    hexahedra[upper] = hexahedra[upper][:, _MIRROR_Z]
    return _mesh_without_matching(mesh, hexahedra[:, _SIX].reshape(-1, 4))


SPLITS: dict[str, Callable[[Mesh], Mesh]] = {
    "five": split_into_five,
    "repeated": split_into_five_alike,
    "alternating": split_into_six_alternating,
    "kuhn": split_into_six_kuhn,
}


def _mesh_without_matching(mesh: Mesh, cells: Ints) -> Mesh:
    """Return a mesh of tetrahedra whose faces need not match; its boundary facets are those of the hexahedra."""
    cells = orient_positively(mesh.points, cells, element_of(Tetrahedron.linear))
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


def orient_positively(points: Floats, cells: Ints, element: type[Element]) -> Ints:
    """Return cells (m, a) of corner nodes, with the nodes of cells of negative volume reordered."""
    flipped = np.where(Mesh(points, cells, element.linear).volumes < 0)[0]
    cells = cells.copy()
    cells[flipped] = cells[flipped][:, np.array(element_of(element.linear).mirrored_nodes)]
    return cells


def two_colour_points(mesh: Mesh) -> Ints:
    """Return a colour 0 or 1 for every point (n,), different at both ends of every edge. Raises NotTwoColourable."""
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


def add_midside_nodes(mesh: Mesh, element: type[Element]) -> Mesh:
    """Return the mesh with the same cells as an element with more nodes, such as tet10 for tet4.

    New nodes are placed by the shape functions of the cells. The nodes that both elements have are the first nodes of
    each cell.
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
        skin += [] if mesh.skin is None else [count + _corner_groups_of_facets(mesh.skin, element, groups)]
        count += len(groups)
    whole = np.concatenate(cells, axis=1).astype(np.int64)
    outer = None if mesh.skin is None else np.concatenate(skin, axis=1)
    return Mesh(np.concatenate(points), whole, element.name, outer, mesh.groups)


def _corner_groups_of_facets(skin: Ints, element: type[Element], groups: Ints) -> Ints:
    """Return for each facet of `skin` (f, k) the numbers (f, s) of the corner groups that it contains.

    `groups` (g, size) lists groups of corners, such as the two ends of an edge. A midside node lies between the corners
    of a group.
    """
    size = groups.shape[1]
    local = np.array([ends for ends in element.facet.between if len(ends) == size], dtype=np.int64).reshape(-1, size)
    sides = np.sort(skin[:, local], axis=2).reshape(-1, size)
    known, number = np.unique(np.concatenate([groups, sides]), axis=0, return_inverse=True)
    place = np.empty(len(known), dtype=np.int64)
    place[number[: len(groups)]] = np.arange(len(groups))
    found: Ints = place[number[len(groups) :]].reshape(len(skin), -1)
    return found
