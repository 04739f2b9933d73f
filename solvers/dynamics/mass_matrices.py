"""Mass matrices of solids, and the momenta that they carry."""

from __future__ import annotations

from typing import ClassVar, Protocol

import numpy as np
from scipy import sparse

from softmark.solvers.energies.energy import Floats, Ints


class MassShape(Protocol):
    """What of an element a mass needs."""

    constant: ClassVar[bool]

    @staticmethod
    def mass_quadrature() -> tuple[Floats, Floats]:
        """Points (q, 3) and weights (q,) that integrate products of shape functions."""

    @staticmethod
    def shape(xi: Floats) -> Floats:
        """Shape functions (q, a)."""

    @staticmethod
    def gradient(xi: Floats) -> Floats:
        """dN/dxi (q, a, 3)."""


def mass_points(points: Floats, cells: Ints, element: type[MassShape]) -> tuple[Floats, Floats]:
    """Shape functions N (q, a) and volumes w (m, q), m^3, at points that integrate products of shape functions.

    Stiffness needs fewer points than mass: one is exact for the linear tetrahedron, whose mass it makes singular.
    Tetrahedra get the conical product rule of degree 5 (Stroud 1971), exact up to quadratic shape functions;
    other cells their own rule.
    """
    xi, weights = element.mass_quadrature()
    gradient = element.gradient(xi)
    if element.constant:  # the same everywhere in a cell
        gradient = gradient[:1]
    dXdxi = np.einsum("mai,qaj->mqij", points[cells], gradient)
    return element.shape(xi), weights * np.linalg.det(dXdxi)


def consistent_mass(cells: Ints, N: Floats, w: Floats, density: float, nodes: int | None = None) -> sparse.csr_matrix:
    """M_ab = density * sum over points of w N_a N_b, for each of three directions (3 nodes, 3 nodes), kg.

    Source: Archer 1963; `N`, `w` as from `mass_points`; N are (m, q, a) where each cell has points of its own.
    """
    count = int(cells.max()) + 1 if nodes is None else nodes
    if N.ndim == 3:
        local = density * (N.swapaxes(1, 2) @ (w[:, :, None] * N))
    else:
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
    diagonal = np.einsum("mq,qa->ma", w, N**2) if N.ndim == 2 else np.einsum("mq,mqa->ma", w, N**2)
    share = density * w.sum(axis=1, keepdims=True) * diagonal / diagonal.sum(axis=1, keepdims=True)
    lumped = np.zeros(count)
    np.add.at(lumped, cells, share)
    return np.repeat(lumped, 3)


def times(mass: sparse.csr_matrix | Floats, v: Floats) -> Floats:
    """M v for a matrix or its diagonal."""
    product: Floats = mass @ v if mass.ndim == 2 else mass * v
    return product
