"""Mesh of points and cells as plain arrays, with the quantities derived from them."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from softmark.records import dataclass
from softmark.solvers.elements import element_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from softmark.solvers.elements.element import Element
    from softmark.solvers.mesh.mesh_group import Group

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Mesh:
    """A mesh: `points` (n, 3), m, and positively oriented `cells` (m, a) of one element `kind`.

    Arrays are immutable. Nodes of a cell are ordered as in VTK and meshio. If cells do not match across their faces,
    the boundary cannot be derived from them, and `skin` (f, k) gives the boundary facets. `groups` are the named groups
    of a mesh file, if they were requested (mesh_groups.py).
    """

    points: Floats  # (n, 3)
    cells: Ints  # (m, a)
    kind: str = "tet4"  # a key of CELLS
    skin: Ints | None = None
    groups: Mapping[str, Group] | None = None

    @property
    def element(self) -> type[Element]:
        """Element of the cells. Raises UnknownElement."""
        return element_of(self.kind)

    @cached_property
    def volumes(self) -> Floats:
        """Signed volume of each cell, m^3, shape (m,), by the quadrature rule of the element."""
        if self.element.constant:
            a, b, c, d = (self.points[self.cells[:, i]] for i in range(4))
            volumes: Floats = np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) / 6.0
            return volumes
        xi, weights = self.element.quadrature()
        return jacobians(self, xi) @ weights

    @cached_property
    def facets(self) -> Ints:
        """Boundary facets (f, k), which belong to one cell only; nodes are counter-clockwise seen from outside."""
        if self.skin is not None:
            return self.skin
        facets = self.cells[:, np.array(self.element.facets)].reshape(-1, self.element.facet.nodes)
        corners = np.sort(facets[:, : self.element.facet.corners], axis=1)
        _, first, count = np.unique(_row_keys(corners), return_index=True, return_counts=True)
        boundary: Ints = facets[np.sort(first[count == 1])]
        return boundary

    @cached_property
    def facet_cells(self) -> Ints:
        """Cell of each boundary facet (f,)."""
        corners, sides = self.element.facet.corners, np.array(self.element.facets)
        outer = np.zeros(len(self.points), dtype=np.bool_)
        outer[self.facets] = True
        cells = np.flatnonzero(outer[self.cells].sum(axis=1) >= corners)
        candidates = self.cells[cells[:, None, None], sides].reshape(-1, self.element.facet.nodes)
        rows = np.concatenate([self.facets, candidates])[:, :corners]
        keys = _row_keys(np.sort(rows, axis=1))
        own, others = keys[: len(self.facets)], keys[len(self.facets) :]
        order = np.argsort(others, kind="stable")
        found: Ints = cells[order[np.searchsorted(others[order], own)] // len(sides)]
        return found

    @cached_property
    def faces(self) -> Ints:
        """Boundary triangles (t, 3) over the nodes, counter-clockwise seen from outside, for display and distances."""
        faces: Ints = self.facets[:, np.array(self.element.facet.triangles)].reshape(-1, 3)
        if any(len({*facet}) < len(facet) for facet in self.element.facets):  # triangles among facets of four sides
            faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
        return faces

    @cached_property
    def selections(self) -> dict[Any, Any]:
        """Cache of data computed for the mesh: selected parts of the boundary by condition, and locations of points."""
        return {}

    def __getstate__(self) -> dict[str, Any]:
        """Return the state to be pickled, without cached selections, because their conditions are functions."""
        return {name: value for name, value in vars(self).items() if name != "selections"}

    @cached_property
    def extent(self) -> float:
        """Diagonal of the bounding box, m."""
        return float(np.linalg.norm(np.ptp(self.points, axis=0)))


def _row_keys(rows: Ints) -> Ints:
    """Return an integer key for each row of integers >= 0 (n, k), shape (n,).

    Keys are equal for equal rows, and they sort faster than rows.
    """
    keys = rows[:, 0]
    for column in rows.T[1:]:
        base = int(column.max(initial=0)) + 1
        if int(keys.max(initial=0)) >= np.iinfo(np.int64).max // base - 1:  # renumbered, since some are unused
            keys = np.unique(keys, return_inverse=True)[1]
        keys = keys * base + column
    return keys


def jacobians(mesh: Mesh, xi: Floats) -> Floats:
    """Return det dX/dxi (m, q), m^3, of all cells at local points xi (q, 3); negative where a cell is inverted."""
    dXdxi = np.einsum("mai,qaj->mqij", mesh.points[mesh.cells], mesh.element.gradient(xi))
    det: Floats = np.linalg.det(dXdxi)
    return det


def facet_areas(mesh: Mesh, xi: Floats, weights: Floats) -> Floats:
    """Return the area of each boundary facet, m^2, shape (f,).

    `xi` (q, 2) and `weights` (q,) are a quadrature rule of the facet.
    """
    t = np.einsum("qkj,fki->jfqi", mesh.element.facet.gradient(xi), mesh.points[mesh.facets])
    found: Floats = np.linalg.norm(np.cross(t[0], t[1]), axis=2) @ weights
    return found


def boundary_surface(mesh: Mesh) -> tuple[Floats, Ints]:
    """Return the points (n, 3), m, and triangles (t, 3) of the boundary only, facing outward."""
    used, triangles = np.unique(mesh.faces, return_inverse=True)
    return mesh.points[used], triangles.reshape(-1, 3).astype(np.int64)
