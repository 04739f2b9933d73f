"""Patch recovery: nodal values from polynomials fitted to values at sampling points of the surrounding cells.

Around every corner of the mesh a polynomial of the element's order is fitted, by weighted least squares, to the values
at the sampling points of the cells around this corner (its patch). Values at midside nodes are means of the adjacent
corners' values. At the surface all cells around a corner lie on one side of it, so the patch also includes the cells
around the corners of these cells.

Source: Zienkiewicz and Zhu (1992), "The superconvergent patch recovery and a posteriori error estimates", part 1,
International Journal for Numerical Methods in Engineering 33:1331.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np

from softmark.solvers.elements.element import Element
from softmark.solvers.mesh.element_interpolation import Rule, locate_points
from softmark.solvers.mesh.mesh import Floats, Ints, Mesh
from softmark.solvers.stress_recovery.sampling_point_stress import superconvergent_points

PAIRS = 20_000  # pairs of a corner and a cell processed at once
ENOUGH = 3.5  # sampling points per coefficient: with fewer, the patch of a corner on the surface is widened
NEAR = 2.0  # weight of sampling points: exp(-NEAR r^2), with r their distance relative to the patch
SPECK = 1e-16  # relative to the trace: shift that makes matrices regular
FLAT = (
    1e-8  # relative to the largest eigenvalue of a patch: smaller ones mean that its points lie in a plane or a surface
)

Sample = Callable[[Rule], tuple[Floats, Floats]]  # points (m, q, 3) and values there (m, q, k)


class PatchRecovery:
    """Recovered nodal values of k quantities, computed from values at sampling points on request.

    `sample` returns positions (m, q, 3), m, and values (m, q, k) at the points of a quadrature rule. It is called with
    the superconvergent points of the element. If those points do not determine a polynomial, as in a body that is one
    linear hexahedron thick, it is called with the element's integration points. In a `plane` model nothing varies along
    z, and polynomials are functions of x and y, for any thickness.
    """

    def __init__(self, mesh: Mesh, sample: Sample, plane: bool = False) -> None:
        self.mesh, self._sample, self._plane = mesh, sample, plane
        self._exponents = _monomial_exponents(mesh.element)
        if plane:
            self._exponents = self._exponents[self._exponents[:, 2] == 0]
        self._fits: dict[
            int, tuple[Floats, Floats, float]
        ] = {}  # by corner: coefficients (c, k), middle (3,), m, and scale, m
        self._left: dict[int, Floats] = {}  # by corner: mean-square residual of the fit (k,)
        self._nodal: dict[int, Floats] = {}

    def at(self, X: Floats) -> Floats:
        """Return values (n, k) at points X (n, 3), m, of the undeformed body, interpolated by shape functions."""
        where = locate_points(self.mesh, X)
        return self._interpolate_nodal_values(where.nodes, where.N, self.at_nodes)

    def fit_residuals(self, X: Floats) -> Floats:
        """Return root mean square differences (n, k) between sampled and fitted values around points X (n, 3), m.

        The mean squares of patches are interpolated between corners by the shape functions of the corners.
        """
        where, corners = locate_points(self.mesh, X), self.mesh.element.corners
        nodes, N = where.nodes[:, :corners], np.clip(where.N[:, :corners], 0.0, None)
        total = N.sum(axis=1, keepdims=True)
        N = np.where(total > 0.0, N / np.where(total > 0.0, total, 1.0), 1.0 / corners)
        return np.sqrt(self._interpolate_nodal_values(nodes, N, self._squared_residuals))

    def _interpolate_nodal_values(self, nodes: Ints, N: Floats, of: Callable[[Ints], Floats]) -> Floats:
        """Return values (n, k) at n points, interpolated from nodal values.

        `nodes` (n, a) and shape functions `N` (n, a) locate the points, and `of` returns the values of nodes by their
        numbers.
        """
        used, place = np.unique(nodes, return_inverse=True)
        values: Floats = np.einsum("na,nak->nk", N, of(used)[place.reshape(nodes.shape)])
        return values

    def _squared_residuals(self, corners: Ints) -> Floats:
        """Return mean square differences (c, k) between sampled and fitted values in patches of corners (c,)."""
        self._fit_corners(corners)
        return np.array([self._left[c] for c in corners.tolist()])

    def at_nodes(self, nodes: Ints) -> Floats:
        """Return the recovered values (n, k) at nodes with the numbers `nodes` (n,)."""
        new = [n for n in nodes.tolist() if n not in self._nodal]
        if new:
            self._recover_nodes(np.array(new))
        return np.array([self._nodal[n] for n in nodes.tolist()])

    def values_at_all_nodes(self) -> Floats:
        """Return the recovered values (nodes, k) at all nodes."""
        return self.at_nodes(np.arange(len(self.mesh.points)))

    # ------------------------------------------------------------------ nodes from corners

    def _recover_nodes(self, nodes: Ints) -> None:
        """Compute and store the values at nodes; nodes without cells get NaN."""
        parents = {n: self._parent_corners[n] for n in nodes.tolist() if n in self._parent_corners}
        if parents:
            self._fit_corners(np.unique(np.concatenate([*parents.values()])))
        for n, corners in parents.items():
            self._nodal[n] = np.mean(
                [self._evaluate_polynomial(c, self.mesh.points[n]) for c in corners.tolist()], axis=0
            )
        if len(parents) < len(nodes):  # a file may have nodes of no cell
            nothing = np.full(self._superconvergent_values[1].shape[2], np.nan)
            self._nodal |= {n: nothing for n in nodes.tolist() if n not in parents}

    def _evaluate_polynomial(self, corner: int, X: Floats) -> Floats:
        """Return the value (k,) of the polynomial of a corner at a point X (3,), m."""
        fit, middle, scale = self._fits[corner]
        basis = np.prod(((self._polynomial_positions(X) - middle) / scale) ** self._exponents, axis=1)
        value: Floats = basis @ fit
        return value

    @cached_property
    def _parent_corners(self) -> dict[int, Ints]:
        """Corners whose polynomials determine the value at each node, by node; for a corner only the corner itself."""
        mesh, element = self.mesh, self.mesh.element
        found = {int(c): np.array([c]) for c in np.unique(mesh.cells[:, : element.corners])}
        for k, ends in enumerate(element.between):
            numbers, first = np.unique(mesh.cells[:, element.corners + k], return_index=True)
            rows = mesh.cells[first][:, list(ends)]
            found |= dict(zip(numbers.tolist(), rows, strict=True))
        return found

    # ------------------------------------------------------------------ fits

    def _fit_corners(self, corners: Ints) -> None:
        """Fit and store the polynomials of corners that have none yet."""
        new = np.array([c for c in corners.tolist() if c not in self._fits], dtype=np.int64)
        if not len(new):
            return
        flat = self._fit_polynomials(new, self._superconvergent_values)
        if len(flat):
            self._fit_polynomials(flat, self._integration_point_values)

    @cached_property
    def _superconvergent_values(self) -> tuple[Floats, Floats]:
        """Positions (m, q, 3), m, and values (m, q, k) at the superconvergent points of all cells."""
        X, values = self._sample(superconvergent_points(self.mesh.element))
        return self._polynomial_positions(X), values

    @cached_property
    def _integration_point_values(self) -> tuple[Floats, Floats]:
        """Positions (m, q, 3), m, and values (m, q, k) at the integration points of all cells."""
        X, values = self._sample(self.mesh.element.quadrature())
        return self._polynomial_positions(X), values

    def _polynomial_positions(self, X: Floats) -> Floats:
        """Return the positions (..., 3), m, used in polynomials: with z = 0 in a plane model."""
        return X * np.array([1.0, 1.0, 0.0]) if self._plane else X

    def _fit_polynomials(self, corners: Ints, known: tuple[Floats, Floats]) -> Ints:
        """Fit the polynomials of corners; return the corners whose points do not determine a polynomial.

        These corners get the fit of minimum norm. `known` are positions and values at the sampling points.
        """
        starts, cells = self._patch_cells(corners)
        flat = [np.zeros(0, dtype=np.int64)]
        first = 0
        while first < len(corners):
            last = max(first + 1, int(np.searchsorted(starts, starts[first] + PAIRS, side="right")) - 1)
            some = slice(first, min(last, len(corners)))
            bounds = starts[some.start : some.stop + 1]
            flat.append(self._fit_batch(corners[some], cells[bounds[0] : bounds[-1]], bounds - bounds[0], known))
            first = some.stop
        return np.concatenate(flat)

    def _fit_batch(self, corners: Ints, cells: Ints, bounds: Ints, known: tuple[Floats, Floats]) -> Ints:
        """Fit the polynomials of a batch of corners; return the corners whose points do not determine one.

        `cells` are the cells of all patches, one after the other, and `bounds` the index at which each patch begins.
        `known` are positions and values at the sampling points.
        """
        X, values = known[0][cells], known[1][cells]  # (p, q, 3), (p, q, k)
        owner = np.repeat(np.arange(len(corners)), np.diff(bounds))
        middle = np.add.reduceat(X.mean(axis=1), bounds[:-1]) / np.diff(bounds)[:, None]
        away = X - self._polynomial_positions(self.mesh.points[corners])[owner][:, None]
        scale = np.sqrt(np.maximum.reduceat((away**2).sum(axis=2).max(axis=1), bounds[:-1]))
        near = np.exp(-NEAR * ((away / scale[owner, None, None]) ** 2).sum(axis=2))
        away = X - middle[owner][:, None]  # monomials about the middle are best conditioned
        basis = np.prod((away / scale[owner, None, None])[:, :, None] ** self._exponents, axis=3)  # (p, q, c)
        turned = (basis * near[:, :, None]).swapaxes(1, 2)
        M = np.add.reduceat(turned @ basis, bounds[:-1], axis=0)
        b = np.add.reduceat(turned @ values, bounds[:-1], axis=0)
        inverse, flat = _invert(M)
        fits = inverse @ b  # (n, c, k)
        apart = ((basis @ fits[owner] - values) ** 2).sum(axis=1)
        left = np.add.reduceat(apart, bounds[:-1], axis=0) / (np.diff(bounds) * X.shape[1])[:, None]
        for i, c in enumerate(corners.tolist()):
            self._fits[c], self._left[c] = (fits[i], middle[i], float(scale[i])), left[i]
        undetermined: Ints = corners[flat]
        return undetermined

    # ------------------------------------------------------------------ patches

    def _is_widened_at_surface(self, cells: Ints) -> Any:
        """Return a mask (n,) of the patches that are widened if their corner lies on the surface.

        `cells` (n,) are the counts of cells in each patch. Patches of linear cells and of hexahedra are always widened,
        because their points lie in too few layers for the polynomial.
        """
        if self.mesh.element.family != "tetrahedra" or self.mesh.element.order == 1:
            return np.ones(len(cells), dtype=np.bool_)
        return cells * self._superconvergent_values[0].shape[1] < ENOUGH * len(self._exponents)

    def _patch_cells(self, corners: Ints) -> tuple[Ints, Ints]:
        """Return the cells of all patches of corners, as one array, and the index (n + 1,) where each begins."""
        around = self._corner_cell_incidence
        patches = around[corners].astype(np.int64)
        outer = np.flatnonzero(self._boundary_node_mask[corners] & self._is_widened_at_surface(np.diff(patches.indptr)))
        if len(outer):
            wide = (patches[outer] @ around.T) @ around
            picked = np.ones(len(corners))
            picked[outer] = 0.0
            patches = self._diagonal_matrix(picked) @ patches + self._placement_matrix(outer, len(corners)) @ wide
            patches.eliminate_zeros()
        patches.sort_indices()
        return patches.indptr.astype(np.int64), patches.indices.astype(np.int64)

    @staticmethod
    def _diagonal_matrix(values: Floats) -> Any:
        """Return a sparse diagonal matrix of values (n,)."""
        from scipy import sparse

        return sparse.diags_array(values, format="csr")

    @staticmethod
    def _placement_matrix(rows: Ints, count: int) -> Any:
        """Return the sparse matrix (count, len(rows)) that puts the entries of a vector at the positions `rows`."""
        from scipy import sparse

        return sparse.csr_array((np.ones(len(rows)), (rows, np.arange(len(rows)))), shape=(count, len(rows)))

    @cached_property
    def _corner_cell_incidence(self) -> Any:
        """Sparse matrix (nodes, cells) with ones where a node is a corner of a cell."""
        from scipy import sparse

        corners = self.mesh.cells[:, : self.mesh.element.corners]
        cells = np.repeat(np.arange(len(corners)), corners.shape[1])
        shape = (len(self.mesh.points), len(corners))
        return sparse.csr_array((np.ones(corners.size), (corners.ravel(), cells)), shape=shape)

    @cached_property
    def _boundary_node_mask(self) -> Any:
        """Mask (nodes,) of the nodes on the boundary; in a plane model, on its outline."""
        outer, facets = np.zeros(len(self.mesh.points), dtype=np.bool_), self.mesh.facets
        if self._plane:
            z = self.mesh.points[:, 2][facets]
            facets = facets[np.ptp(z, axis=1) > 1e-6 * np.ptp(z)]
        outer[facets] = True
        return outer


def _invert(M: Floats) -> tuple[Floats, Any]:
    """Return the inverses (n, c, c) of positive semidefinite matrices M, and a mask (n,) of the singular ones.

    Singular matrices get their pseudo-inverse.
    """
    size = M.shape[1]
    trace = np.trace(M, axis1=1, axis2=2)
    inverse: Floats = np.linalg.inv(M + (SPECK * trace)[:, None, None] * np.eye(size))
    condition = np.linalg.norm(M, axis=(1, 2)) * np.linalg.norm(inverse, axis=(1, 2))
    flat = ~(condition < 1.0 / FLAT)
    if flat.any():  # the pseudo-inverse takes a hundred times as long
        inverse[flat] = np.linalg.pinv(M[flat], rcond=FLAT, hermitian=True)
    return inverse, flat


def _monomial_exponents(element: type[Element]) -> Ints:
    """Return the exponents (c, 3) of the monomials of the fitted polynomial.

    The polynomial has the element's order as total degree, or as degree along each axis for quadratic hexahedra.
    """
    each = element.family == "hexahedra" and element.order > 1
    powers = [p for p in np.ndindex(*[element.order + 1] * 3) if each or sum(p) <= element.order]
    return np.array(sorted(powers, key=sum))
