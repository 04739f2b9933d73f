"""Mass matrices of solids, and the momenta that they carry."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from scipy import sparse

from softmark.solvers.base.gauss_jacobi import gauss_jacobi
from softmark.solvers.energies.energy import Floats, Ints


class Shape(Protocol):
    """What of an element a mass needs."""

    @staticmethod
    def quadrature() -> tuple[Floats, Floats]:
        """Points (q, 3) and weights (q,)."""

    @staticmethod
    def shape(xi: Floats) -> Floats:
        """Shape functions (q, a)."""

    @staticmethod
    def gradient(xi: Floats) -> Floats:
        """dN/dxi (q, a, 3)."""


def mass_points(points: Floats, cells: Ints, element: type[Shape]) -> tuple[Floats, Floats]:
    """Shape functions N (q, a) and volumes w (m, q), m^3, at points that integrate products of shape functions.

    Stiffness needs fewer points than mass: one is exact for the linear tetrahedron, whose mass it makes singular.
    Tetrahedra get the conical product rule of degree 5 (Stroud 1971), exact up to quadratic shape functions;
    other cells their own rule.
    """
    xi, weights = _conical(3) if cells.shape[1] in (4, 10) else element.quadrature()
    gradient = element.gradient(xi)
    if cells.shape[1] == 4:  # the same everywhere in a cell
        gradient = gradient[:1]
    dXdxi = np.einsum("mai,qaj->mqij", points[cells], gradient)
    return element.shape(xi), weights * np.linalg.det(dXdxi)


def _conical(n: int) -> tuple[Floats, Floats]:
    """n^3 points on the unit tetrahedron, degree 2n - 1: Gauss-Jacobi along three edges of a collapsed cube."""
    rules = [gauss_jacobi(n, power) for power in (2, 1, 0)]
    (a, wa), (b, wb), (c, wc) = (((1 + s) / 2, w / 2 ** (3 - i)) for i, (s, w) in enumerate(rules))
    a, b, c = (t.ravel() for t in np.meshgrid(a, b, c, indexing="ij"))
    xi = np.stack([a, (1 - a) * b, (1 - a) * (1 - b) * c], axis=1)
    return xi, np.einsum("i,j,k->ijk", wa, wb, wc).ravel()


def consistent_mass(
    cells: Ints, N: Floats, w: Floats, density: float, nodes: int | None = None
) -> sparse.csr_matrix:
    """M_ab = density * sum over points of w N_a N_b, for each of three directions (3 nodes, 3 nodes), kg.

    Source: Archer 1963; `N`, `w` as from `mass_points`.
    """
    count = int(cells.max()) + 1 if nodes is None else nodes
    local = density * np.einsum("mq,qa,qb->mab", w, N, N)
    rows, columns = np.broadcast_arrays(cells[:, :, None], cells[:, None, :])
    scalar = sparse.csr_matrix((local.ravel(), (rows.ravel(), columns.ravel())), shape=(count, count))
    return sparse.kron(scalar, np.eye(3), format="csr")


def lumped_mass(cells: Ints, N: Floats, w: Floats, density: float, nodes: int | None = None) -> Floats:
    """The diagonal (3 nodes,), kg: each cell's mass in proportion to the diagonal of its consistent mass.

    Equal shares in linear tetrahedra; positive in quadratic cells, where sums of rows are not (Hinton, Rock and
    Zienkiewicz 1976).
    """
    count = int(cells.max()) + 1 if nodes is None else nodes
    diagonal = np.einsum("mq,qa->ma", w, N**2)
    share = density * w.sum(axis=1, keepdims=True) * diagonal / diagonal.sum(axis=1, keepdims=True)
    lumped = np.zeros(count)
    np.add.at(lumped, cells, share)
    return np.repeat(lumped, 3)


def times(mass: sparse.csr_matrix | Floats, v: Floats) -> Floats:
    """M v for a matrix or its diagonal."""
    product: Floats = mass @ v if mass.ndim == 2 else mass * v
    return product
