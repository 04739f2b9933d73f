"""The element loops that a profile showed to be hot, over plain arrays: m cells, q integration points, a nodes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softmark.solvers.jit import kernel

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@kernel
def deformation_gradient(u: Floats, cells: Ints, dNdX: Floats, F: Floats) -> None:
    """F (m, q, 3, 3) = I + sum_a u_a (x) dN_a/dX, for displacements u (nodes, 3)."""
    for e in range(cells.shape[0]):
        for p in range(dNdX.shape[1]):
            for i in range(3):
                for J in range(3):
                    value = 1.0 if i == J else 0.0
                    for a in range(cells.shape[1]):
                        value += u[cells[e, a], i] * dNdX[e, p, a, J]
                    F[e, p, i, J] = value


@kernel
def add_forces(P: Floats, cells: Ints, dNdX: Floats, w: Floats, scale: float, g: Floats) -> None:
    """g (nodes, 3) += scale * sum over points of w P dN_a/dX."""
    for e in range(cells.shape[0]):
        for p in range(dNdX.shape[1]):
            factor = scale * w[e, p]
            for a in range(cells.shape[1]):
                for i in range(3):
                    value = 0.0
                    for J in range(3):
                        value += P[e, p, i, J] * dNdX[e, p, a, J]
                    g[cells[e, a], i] += factor * value


@kernel
def add_stiffness(A: Floats, dNdX: Floats, w: Floats, scale: float, slots: Ints, data: Floats) -> None:
    """data[slots[e, 3a+i, 3b+k]] += scale * sum_p w dN_a/dX_J A_iJkL dN_b/dX_L, for A = dP/dF (m, q, 3, 3, 3, 3).

    A negative slot is a constrained degree of freedom. The block is symmetric, so half of it is computed.
    """
    nodes = dNdX.shape[2]
    half = np.empty((3, 3, 3))  # A_iJkL dN_b/dX_L
    block = np.zeros((3 * nodes, 3 * nodes))
    for e in range(dNdX.shape[0]):
        block[:] = 0.0
        for p in range(dNdX.shape[1]):
            factor = scale * w[e, p]
            for b in range(nodes):
                for i in range(3):
                    for J in range(3):
                        for k in range(3):
                            value = 0.0
                            for L in range(3):
                                value += A[e, p, i, J, k, L] * dNdX[e, p, b, L]
                            half[i, J, k] = factor * value
                for a in range(b + 1):
                    for i in range(3):
                        for k in range(3):
                            value = 0.0
                            for J in range(3):
                                value += dNdX[e, p, a, J] * half[i, J, k]
                            block[3 * a + i, 3 * b + k] += value
        for row in range(3 * nodes):
            for column in range(3 * nodes):
                slot = slots[e, row, column]
                if slot >= 0:
                    swapped = row // 3 > column // 3
                    data[slot] += block[column, row] if swapped else block[row, column]
