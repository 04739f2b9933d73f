"""Hexahedra into tetrahedra, and four-node tetrahedra into ten-node ones.

The choice of diagonals is a choice of model: it moves the tip of a bent beam of linear tetrahedra by several per cent.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from softmark.solvers.elements.tet10 import EDGES
from softmark.solvers.mesh.mesh import Floats, Ints, Mesh


class NotTwoColourable(Exception):
    """The points of a mesh cannot be coloured so that every edge joins two colours."""


# The five tetrahedra of a hexahedron whose corner 0 is even: four corners cut off at the odd points
# 1, 3, 4, 6 and one in the middle on the even points 0, 2, 5, 7.
_EVEN = np.array([[1, 2, 0, 5], [3, 0, 2, 7], [4, 5, 7, 0], [6, 7, 5, 2], [0, 2, 7, 5]])
_ODD = np.array([[0, 1, 3, 4], [2, 3, 1, 6], [5, 4, 6, 1], [7, 6, 4, 3], [1, 3, 4, 6]])
# Six around the diagonal from corner 0 to corner 6, one for each path along three edges between them.
_KUHN = np.array([[0, 1, 2, 6], [0, 1, 5, 6], [0, 3, 2, 6], [0, 3, 7, 6], [0, 4, 5, 6], [0, 4, 7, 6]])
# The same diagonal with other faces: 1-3 below, 5-7 above, as SOFA has it.
_SIX = np.array([[0, 5, 1, 6], [0, 1, 3, 6], [1, 3, 6, 2], [6, 3, 0, 7], [6, 7, 0, 5], [7, 5, 4, 0]])
_HEX_EDGES = np.array(
    [[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]]
)
_MIRROR_X, _MIRROR_Z = np.array([1, 0, 3, 2, 5, 4, 7, 6]), np.array([4, 5, 6, 7, 0, 1, 2, 3])


def split(points: Floats, hexahedra: Ints, colour: Ints) -> Mesh:
    """Five tetrahedra for each hexahedron, with diagonals between points of one colour (n,), 0 or 1."""
    even = colour[hexahedra[:, 0]] == 0
    cells = np.where(even[:, None, None], hexahedra[:, _EVEN], hexahedra[:, _ODD]).reshape(-1, 4)
    return Mesh(points, positive(points, cells))


def five(mesh: Mesh) -> Mesh:
    """Five tetrahedra for each hexahedron; neighbours agree on their diagonals. Raises NotTwoColourable."""
    return split(mesh.points, mesh.cells, chessboard(mesh))


def repeated(mesh: Mesh) -> Mesh:
    """Five for each hexahedron, cut alike in all by the order of their nodes, whatever the neighbours do."""
    return _loose(mesh, mesh.cells[:, _EVEN].reshape(-1, 4))


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
    cells = positive(mesh.points, cells)
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


def positive(points: Floats, cells: Ints) -> Ints:
    """Four-node cells with two corners swapped where the volume is negative."""
    flipped = np.where(Mesh(points, cells).volumes < 0)[0]
    cells = cells.copy()
    cells[flipped, 2:] = cells[flipped, :1:-1]
    return cells


def chessboard(mesh: Mesh) -> Ints:
    """A colour 0 or 1 for every point (n,), different at the two ends of every edge. Raises NotTwoColourable."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import breadth_first_order, connected_components

    ends = mesh.cells[:, _HEX_EDGES].reshape(-1, 2)
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


def quadratic(mesh: Mesh) -> Mesh:
    """Ten-node tetrahedra with straight edges: a point in the middle of every edge."""
    ends = np.sort(mesh.cells[:, np.array(EDGES)], axis=2)  # (m, 6, 2)
    pairs, which = np.unique(ends.reshape(-1, 2), axis=0, return_inverse=True)
    middles = mesh.points[pairs].mean(axis=1)
    cells = np.concatenate([mesh.cells, len(mesh.points) + which.reshape(-1, 6)], axis=1)
    skin = None if mesh.skin is None else _quadratic_skin(mesh, pairs)
    return Mesh(np.concatenate([mesh.points, middles]), cells.astype(np.int64), "tet10", skin)


def _quadratic_skin(mesh: Mesh, pairs: Ints) -> Ints:
    """Six-node facets of the skin: mid-points found by the ends of their edges, which are in order."""
    skin = mesh.facets
    count = len(mesh.points)
    keys = pairs @ [count, 1]
    sides = np.sort(skin[:, [[0, 1], [1, 2], [2, 0]]], axis=2) @ [count, 1]
    six: Ints = np.concatenate([skin, count + np.searchsorted(keys, sides)], axis=1)
    return six
