"""Finer spaces over the cells of a mesh: an order more (tet4 -> tet10), or every cell in eight (tet10, hex8).

The coarse displacements are among the fine ones: `P` takes them there. New nodes lie where the cells' own map puts
them, on the curved facets of ten-node cells, and on the side of a shape where a facet is inscribed in it.
"""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
from scipy import sparse

from softmark.records import dataclass
from softmark.solvers.elements import ELEMENTS
from softmark.solvers.elements.tet10 import EDGES
from softmark.solvers.mesh.mesh import Floats, Ints, Mesh

WHOLE = 64  # shape functions at the places of new nodes are whole multiples of 1 / WHOLE
INNER = ((4, 6, 7, 8), (4, 5, 6, 8), (6, 7, 8, 9), (5, 6, 8, 9))  # the octahedron around the edge 6-8, as four


class Unmatched(Exception):
    """The cells of the mesh do not match across their faces, so that nothing can be said of what lies between."""


@dataclass(frozen=True)
class Finer:
    """A finer mesh (n fine nodes), and `P` (n, coarse nodes), which takes values at coarse nodes to fine ones."""

    mesh: Mesh
    P: sparse.csr_matrix

    def displaced(self, u: Floats) -> Floats:
        """Displacements of the fine nodes (n, 3) from those of the coarse ones (c, 3), m."""
        moved: Floats = self.P @ u
        return moved


def finer(mesh: Mesh, shape: Any = None) -> Finer:
    """An order more of four-node tetrahedra, and else eight cells for each. Raises Unmatched."""
    if mesh.skin is not None:
        raise Unmatched
    places, children = _pattern(mesh.kind)
    labels = np.random.default_rng(0).integers(1, 2**63, len(mesh.points), dtype=np.uint64)
    keys, first, inverse = np.unique(
        _keys(mesh.element.shape(places), labels[mesh.cells]), return_index=True, return_inverse=True
    )
    P = _interpolation(mesh, places, first)
    local = inverse.reshape(len(mesh.cells), len(places))
    cells = local[:, children].reshape(-1, children.shape[1]).astype(np.int64)
    points = P @ mesh.points
    kind = "tet10" if mesh.kind == "tet4" else mesh.kind
    if hasattr(shape, "on_side") or hasattr(shape, "onto_side"):
        _onto(mesh, shape, points, labels, keys)
    return Finer(Mesh(points, cells, kind), P)


def _keys(N: Floats, labels: Any) -> Any:
    """One whole number for each place of each cell (m * l,): the same where it is the same mix of the same nodes."""
    parts = np.round(WHOLE * N).astype(np.int64).astype(np.uint64)  # (l, a), modulo 2^64
    with np.errstate(over="ignore"):
        return (labels[:, None, :] * parts[None]).sum(axis=2, dtype=np.uint64).ravel()


def _interpolation(mesh: Mesh, places: Floats, first: Ints) -> sparse.csr_matrix:
    """The shape functions of one cell at every new node, as a matrix (n, coarse nodes)."""
    cell, place = np.divmod(first, len(places))
    N = mesh.element.shape(places)[place]  # (n, a)
    columns = mesh.cells[cell]
    rows = np.repeat(np.arange(len(first)), N.shape[1])
    P = sparse.csr_matrix((N.ravel(), (rows, columns.ravel())), shape=(len(first), len(mesh.points)))
    P.eliminate_zeros()
    return P


def _pattern(kind: str) -> tuple[Floats, Ints]:
    """Local places of the new nodes (l, 3) in a cell, and the nodes of its children (c, a)."""
    if kind == "tet4":
        return ELEMENTS["tet10"].places(), np.arange(10)[None]
    return _of_hexahedra() if kind == "hex8" else _of_tetrahedra()


def _of_hexahedra() -> tuple[Floats, Ints]:
    corners = ELEMENTS["hex8"].places()
    grid = np.array(list(product((-1.0, 0.0, 1.0), repeat=3)))
    number = {tuple(p): i for i, p in enumerate(grid.tolist())}
    centres = 0.5 * corners
    children = [[number[tuple(p)] for p in (c + 0.5 * corners).tolist()] for c in centres]
    return grid, np.array(children)


def _of_tetrahedra() -> tuple[Floats, Ints]:
    """The 35 points at quarters, and eight tetrahedra: at each corner one, four in the octahedron left (Bey 1995)."""
    nodes = ELEMENTS["tet10"].places()  # corners, middles
    tetrahedra = [*((i, *_near(i)) for i in range(4)), *INNER]
    lattice = np.array([p for p in product(range(5), repeat=3) if sum(p) <= 4]) / 4.0
    number = {tuple(p): i for i, p in enumerate(lattice.tolist())}
    children = []
    for corners in tetrahedra:
        X = nodes[list(corners)]
        if np.linalg.det(X[1:] - X[0]) < 0:
            X = X[[0, 2, 1, 3]]
        ten = np.concatenate([X, X[np.array(EDGES)].mean(axis=1)])
        children.append([number[tuple(p)] for p in ten.tolist()])
    return lattice, np.array(children)


def _near(corner: int) -> list[int]:
    """The middles of the edges at a corner, as nodes."""
    return [4 + e for e, ends in enumerate(EDGES) if corner in ends]


def _onto(mesh: Mesh, shape: Any, points: Floats, labels: Any, keys: Any) -> None:
    """Move what lies on facets that are inscribed in a curved side out onto it: `points` are changed."""
    facet, facets = mesh.element.facet, mesh.facets
    places = _facet_places(mesh.kind)
    N = facet.shape(places)
    there = np.einsum("sa,fai->sfi", N, mesh.points[facets])
    moved = _moved(shape, mesh.points[facets], there).swapaxes(0, 1).reshape(-1, 3)
    numbers = np.searchsorted(keys, _keys(N, labels[facets]))
    away = np.linalg.norm(moved - points[numbers], axis=1) > 1e-12 * mesh.extent
    points[numbers[away]] = moved[away]


def _moved(shape: Any, corners: Floats, points: Floats) -> Floats:
    """Points (s, f, 3) of facets with nodes (f, k, 3), on the side where all nodes of a facet lie on it."""
    if hasattr(shape, "on_side"):
        moved: Floats = shape.on_side(corners, points)
        return moved
    moved, side = points.copy(), shape.side(corners)
    moved[:, side] = np.stack(shape.onto_side(np.moveaxis(points[:, side], 2, 0)), axis=2)
    return moved


def _facet_places(kind: str) -> Floats:
    """Local places of the new nodes on a facet."""
    if kind == "hex8":
        return np.array(list(product((-1.0, 0.0, 1.0), repeat=2)))
    steps = 2 if kind == "tet4" else 4
    return np.array([p for p in product(range(steps + 1), repeat=2) if sum(p) <= steps]) / steps


__all__ = ["Finer", "Unmatched", "finer"]
