"""Mass matrices of solids: consistent and lumped."""

from __future__ import annotations

from typing import ClassVar, Protocol

import numpy as np
from scipy import sparse

from softmark.solvers.energies.energy import Floats, Ints


class MassShape(Protocol):
    """Interface of an element with the members that the mass matrix needs."""

    constant: ClassVar[bool]

    @staticmethod
    def mass_quadrature() -> tuple[Floats, Floats]:
        """Return points (q, 3) and weights (q,) of a quadrature for products of shape functions."""

    @staticmethod
    def shape(xi: Floats) -> Floats:
        """Return the shape functions (q, a) at local points xi (q, 3)."""

    @staticmethod
    def gradient(xi: Floats) -> Floats:
        """Return the derivatives dN/dxi (q, a, 3) at local points xi (q, 3)."""


def mass_shapes_and_volumes(points: Floats, cells: Ints, element: type[MassShape]) -> tuple[Floats, Floats]:
    """Return shape functions N (q, a) and volumes w (m, q), m^3, at the quadrature points of the mass matrix.

    They integrate products of shape functions, which needs more points than the stiffness: one point is exact for the
    stiffness of the linear tetrahedron, but would make its mass singular. Tetrahedra get the conical product rule of
    degree 5 (Stroud 1971), exact up to quadratic shape functions; other cells use their own rule.
    """
    xi, weights = element.mass_quadrature()
    gradient = element.gradient(xi)
    if element.constant:  # constant gradients in a cell
        gradient = gradient[:1]
    dXdxi = np.einsum("mai,qaj->mqij", points[cells], gradient)
    return element.shape(xi), weights * np.linalg.det(dXdxi)


def cell_mass_matrices(N: Floats, w: Floats, density: float) -> Floats:
    """Return density * sum over points of w N_a N_b for each cell (m, a, a), kg; arguments as of `consistent_mass`."""
    if N.ndim == 3:
        found: Floats = density * (N.swapaxes(1, 2) @ (w[:, :, None] * N))
    else:
        found = density * np.einsum("mq,qa,qb->mab", w, N, N)
    return found


def consistent_mass(cells: Ints, N: Floats, w: Floats, density: float, nodes: int | None = None) -> sparse.csr_matrix:
    """Return M_ab = density * sum over points of w N_a N_b, for each of three directions (3 nodes, 3 nodes), kg.

    Source: Archer 1963; `N`, `w` as from `mass_shapes_and_volumes`; N are (m, q, a) if each cell has its own points.
    """
    count = int(cells.max()) + 1 if nodes is None else nodes
    local = cell_mass_matrices(N, w, density)
    rows, columns = np.broadcast_arrays(cells[:, :, None], cells[:, None, :])
    scalar = sparse.csr_matrix((local.ravel(), (rows.ravel(), columns.ravel())), shape=(count, count))
    return sparse.kron(scalar, np.eye(3), format="csr")


def lumped_mass(cells: Ints, N: Floats, w: Floats, density: float, nodes: int | None = None) -> Floats:
    """Return the diagonal (3 nodes,), kg: each cell's mass in proportion to the diagonal of its consistent mass.

    Linear tetrahedra get equal shares. Masses of quadratic cells are positive, where row sums are not (Hinton, Rock and
    Zienkiewicz 1976).
    """
    count = int(cells.max()) + 1 if nodes is None else nodes
    diagonal = np.einsum("mq,qa->ma", w, N**2) if N.ndim == 2 else np.einsum("mq,mqa->ma", w, N**2)
    share = density * w.sum(axis=1, keepdims=True) * diagonal / diagonal.sum(axis=1, keepdims=True)
    lumped = np.zeros(count)
    np.add.at(lumped, cells, share)
    return np.repeat(lumped, 3)


def multiply_mass(mass: sparse.csr_matrix | Floats, v: Floats) -> Floats:
    """Return M v for a matrix or its diagonal."""
    product: Floats = mass @ v if mass.ndim == 2 else mass * v
    return product
