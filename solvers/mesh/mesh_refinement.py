"""Finer finite element spaces on a mesh: one order higher (tet4 -> tet10), or each cell split in eight (tet10, hex8).

The fine space contains all coarse displacements; the matrix `P` maps coarse to fine ones. New nodes are placed by the
cells' shape functions, also on the curved facets of ten-node cells. Where facets are inscribed in a curved side of the
shape, their new nodes are placed on that side.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import sparse

from softmark.records import dataclass
from softmark.solvers.elements import element_of, finer_element
from softmark.solvers.elements.element import Element
from softmark.solvers.mesh.mesh import Floats, Ints, Mesh
from softmark.solvers.mesh.shape import CurvedSide, Shape

if TYPE_CHECKING:
    from softmark.solvers.mesh.mesh_group import Group

WHOLE = 64  # shape functions at new nodes are integer multiples of 1 / WHOLE, or of half of it, and so on
HELD = 20.0  # bytes per entry of each cell's stiffness: 8 for the value, the rest for indices and assembly
QUARTERS = 4  # steps along an edge, at which new nodes lie


class UnmatchedFaces(Exception):
    """Raised if the cells of the mesh do not match across their faces, so that no finer space exists."""


@dataclass(frozen=True)
class FinerSpace:
    """A finer mesh with n nodes, and the matrix `P` (n, c) that interpolates values at the c coarse nodes."""

    mesh: Mesh
    P: sparse.csr_matrix

    def interpolate_displacements(self, u: Floats) -> Floats:
        """Return the displacements of the fine nodes (n, 3) from those of the coarse nodes u (c, 3), m."""
        moved: Floats = self.P @ u
        return moved


def build_finer_space(mesh: Mesh, shape: Shape | None = None) -> FinerSpace:
    """Return the finer mesh of a mesh and its interpolation matrix. Raises UnmatchedFaces.

    Four-node tetrahedra become ten-node tetrahedra; other cells are split into eight. If a `shape` is given, new nodes
    of inscribed facets are moved onto its curved sides.
    """
    if mesh.skin is not None:
        raise UnmatchedFaces
    element = finer_element(mesh.element)
    places, children = _refinement_pattern(mesh.element, element)
    labels = np.random.default_rng(0).integers(1, 2**63, len(mesh.points), dtype=np.uint64)
    N = mesh.element.shape(places)
    keys, first, inverse = np.unique(
        _new_node_keys(N, _integer_factor(N), labels[mesh.cells]), return_index=True, return_inverse=True
    )
    P = _interpolation_matrix(mesh, places, first)
    local = inverse.reshape(len(mesh.cells), len(places))
    cells = local[:, children].reshape(-1, children.shape[1]).astype(np.int64)
    points = P @ mesh.points
    for side in () if shape is None else shape.sides:
        _project_onto_side(
            mesh, _new_nodes_on_facet(mesh.element, places), side, points, (labels, keys, _integer_factor(N))
        )
    return FinerSpace(
        Mesh(points, cells, element.name, groups=_refine_named_groups(mesh, element, places[children])), P
    )


def estimate_memory(mesh: Mesh) -> float:
    """Return the approximate peak memory for forces and stiffness on the finer mesh, bytes."""
    own, new = mesh.element, finer_element(mesh.element)
    cells = len(mesh.cells) * (len(own.child_corners()) if own is new else 1)
    return HELD * cells * (3.0 * new.nodes) ** 2


def _refine_named_groups(mesh: Mesh, element: type[Element], corners: Floats) -> Mapping[str, Group] | None:
    """Return the named groups of the refined mesh; None without groups.

    `corners` (c, a, 3) are the local points of the a nodes of each of the c cells that replace a cell.
    """
    if not mesh.groups:
        return None
    from softmark.solvers.mesh.mesh_groups import refine_groups

    return refine_groups(mesh, element, corners)


def _integer_factor(N: Floats) -> int:
    """Return the factor by which shape function values N (l, a) must be multiplied to become integers."""
    whole = WHOLE
    while np.abs(whole * N - np.round(whole * N)).max() > 1e-9:
        whole *= 2
    return whole


def _new_node_keys(N: Floats, whole: int, labels: Any) -> Any:
    """Return an integer key for each of the l new nodes in each of m cells, shape (m l,).

    `N` (l, a) are the shape functions at the new nodes, `whole` the factor that makes them integers, and `labels` (m,
    a) random integers of the cells' nodes. Keys are equal for equal combinations of nodes, so that cells find their
    common new nodes.
    """
    parts = np.round(whole * N).astype(np.int64).astype(np.uint64)  # (l, a), modulo 2^64
    with np.errstate(over="ignore"):
        return (labels[:, None, :] * parts[None]).sum(axis=2, dtype=np.uint64).ravel()


def _interpolation_matrix(mesh: Mesh, places: Floats, first: Ints) -> sparse.csr_matrix:
    """Return the matrix (n, coarse nodes) of the coarse shape functions at all n new nodes.

    `places` (l, 3) are the local positions of the new nodes in a cell. `first` (n,) gives for each new node its cell
    times l plus its number in that cell.
    """
    cell, place = np.divmod(first, len(places))
    N = mesh.element.shape(places)[place]  # (n, a)
    columns = mesh.cells[cell]
    rows = np.repeat(np.arange(len(first)), N.shape[1])
    P = sparse.csr_matrix((N.ravel(), (rows, columns.ravel())), shape=(len(first), len(mesh.points)))
    P.eliminate_zeros()
    return P


def _refinement_pattern(own: type[Element], new: type[Element]) -> tuple[Floats, Ints]:
    """Return the local positions (l, 3) of new nodes in a cell, and the nodes (c, a) of the c cells that replace it."""
    if own is not new:
        return new.places(), np.arange(new.nodes)[None]
    corners = element_of(own.linear).shape(own.places())
    children = np.einsum("ac,pci->pai", corners, own.child_corners())  # (8, a, 3)
    lattice, number = np.unique(children.reshape(-1, 3), axis=0, return_inverse=True)
    return lattice, number.reshape(children.shape[:2])


def _project_onto_side(
    mesh: Mesh, places: Floats, side: CurvedSide, points: Floats, known: tuple[Any, Any, int]
) -> None:
    """Move new nodes on facets that are inscribed in a curved side onto this side; `points` are changed in place.

    `places` (s, 2) are the local positions of new nodes on a facet. `known` holds the node labels, the keys and the
    integer factor by which new nodes are numbered.
    """
    labels, keys, whole = known
    facet, facets = mesh.element.facet, mesh.facets[side.of(mesh.points[mesh.facets])]
    N = facet.shape(places)
    there = np.einsum("sa,fai->sfi", N, mesh.points[facets])
    moved = np.stack(side.project_points(tuple(np.moveaxis(there, 2, 0))), axis=2).swapaxes(0, 1).reshape(-1, 3)
    numbers = np.searchsorted(keys, _new_node_keys(N, whole, labels[facets]))
    away = np.linalg.norm(moved - points[numbers], axis=1) > 1e-12 * mesh.extent
    points[numbers[away]] = moved[away]


def _new_nodes_on_facet(element: type[Element], places: Floats) -> Floats:
    """Return the local facet positions (s, 2) of the new nodes of a cell, `places` (l, 3), that lie on the facet."""
    lattice = element.facet.lattice(QUARTERS)
    there = element.facet.shape(lattice) @ element.places()[list(element.facets[0])]
    known: Floats = lattice[(np.abs(there[:, None] - places).max(axis=2) < 1e-9).any(axis=1)]
    return known


__all__ = ["FinerSpace", "UnmatchedFaces", "build_finer_space"]
