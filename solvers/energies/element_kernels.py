"""Compiled loops over elements, in which most of the computing time is spent.

They take plain arrays for m cells, q integration points and a nodes per cell.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softmark.solvers.energies.corotational_tets import cofactor
from softmark.solvers.runtime.kernel_cache import allocating_kernel, kernel, kernel_part

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@kernel
def deformation_gradient(u: Floats, cells: Ints, dNdX: Floats, F: Floats) -> None:
    """Compute F (m, q, 3, 3) = I + sum_a u_a (x) dN_a/dX for displacements u (nodes, 3), m."""
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
    """Add nodal forces, N: g (nodes, 3) += scale * sum over points of w P dN_a/dX."""
    for e in range(cells.shape[0]):
        for p in range(dNdX.shape[1]):
            factor = scale * w[e, p]
            for a in range(cells.shape[1]):
                for i in range(3):
                    value = 0.0
                    for J in range(3):
                        value += P[e, p, i, J] * dNdX[e, p, a, J]
                    g[cells[e, a], i] += factor * value


@allocating_kernel
def add_stiffness(A: Floats, dNdX: Floats, w: Floats, scale: float, slots: Ints, data: Floats) -> None:
    """Add the stiffness of tensors A = dP/dF (m, q, 3, 3, 3, 3), Pa, to the matrix values `data`, N/m.

    data[slots[e, 3a+i, 3b+k]] += scale * sum_p w dN_a/dX_J A_iJkL dN_b/dX_L. A negative slot is a constrained degree of
    freedom. The block of a cell is symmetric, so half of it is computed.
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
        _scatter_block(e, block, slots, data)


@kernel_part
def _scatter_block(e: int, block: Floats, slots: Ints, data: Floats) -> None:
    """Add the block (3a, 3a) of cell e, given by its 3x3 blocks on and above the diagonal, to the matrix values.

    The three columns of a node are adjacent in the matrix unless the node is fixed in only some directions. Positions
    of unsigned type are not tested for being negative.
    """
    nodes = block.shape[0] // 3
    for b in range(nodes):
        for a in range(b):
            for i in range(3):
                for k in range(3):
                    block[3 * b + k, 3 * a + i] = block[3 * a + i, 3 * b + k]
    for row in range(3 * nodes):
        for b in range(nodes):
            first, last = slots[e, row, 3 * b], slots[e, row, 3 * b + 2]
            if first >= 0 and last == first + 2:
                at = np.uint64(first)
                data[at] += block[row, 3 * b]
                data[at + np.uint64(1)] += block[row, 3 * b + 1]
                data[at + np.uint64(2)] += block[row, 3 * b + 2]
            else:
                for k in range(3):
                    if slots[e, row, 3 * b + k] >= 0:
                        data[slots[e, row, 3 * b + k]] += block[row, 3 * b + k]


# ------------------------------------------------------------------ laws of invariants (materials/two_invariant_law.py)


@kernel
def compute_invariants(
    u: Floats, cells: Ints, dNdX: Floats, begin: int, h: Floats, stretch: Floats, j: Floats
) -> None:  # fmt: skip
    """Compute h = du/dX (c, q, 9), I1 - 3 and J - 1 (c, q) of c cells, from the cell `begin` on.

    I1 - 3 = 2 tr h + h:h and J - 1 = tr h + tr cof h + det h.
    """
    for e in range(h.shape[0]):
        for p in range(h.shape[1]):
            h00 = h01 = h02 = h10 = h11 = h12 = h20 = h21 = h22 = 0.0
            for a in range(cells.shape[1]):
                node = cells[begin + e, a]
                x, y, z = u[node, 0], u[node, 1], u[node, 2]
                g0, g1, g2 = dNdX[begin + e, p, a, 0], dNdX[begin + e, p, a, 1], dNdX[begin + e, p, a, 2]
                h00, h01, h02 = h00 + x * g0, h01 + x * g1, h02 + x * g2
                h10, h11, h12 = h10 + y * g0, h11 + y * g1, h12 + y * g2
                h20, h21, h22 = h20 + z * g0, h21 + z * g1, h22 + z * g2
            h[e, p, 0], h[e, p, 1], h[e, p, 2] = h00, h01, h02
            h[e, p, 3], h[e, p, 4], h[e, p, 5] = h10, h11, h12
            h[e, p, 6], h[e, p, 7], h[e, p, 8] = h20, h21, h22
            trace = h00 + h11 + h22
            square = h00 * h00 + h01 * h01 + h02 * h02 + h10 * h10 + h11 * h11 + h12 * h12
            square += h20 * h20 + h21 * h21 + h22 * h22
            c00, c11, c22 = h11 * h22 - h12 * h21, h00 * h22 - h02 * h20, h00 * h11 - h01 * h10
            det = h00 * c00 + h01 * (h12 * h20 - h10 * h22) + h02 * (h10 * h21 - h11 * h20)
            stretch[e, p] = 2.0 * trace + square
            j[e, p] = trace + (c00 + c11 + c22) + det


@kernel
def add_invariant_forces(
    h: Floats, a: Floats, s: Floats, cells: Ints, dNdX: Floats, w: Floats, begin: int, scale: float, g: Floats
) -> None:
    """Add the nodal forces of an `InvariantLaw`, N, of the cells from `begin` on.

    g (nodes, 3) += scale * sum over points of w (a F + s cof F) dN_a/dX, with F = I + h.
    """
    for e in range(h.shape[0]):
        for p in range(h.shape[1]):
            f00, f01, f02 = 1.0 + h[e, p, 0], h[e, p, 1], h[e, p, 2]
            f10, f11, f12 = h[e, p, 3], 1.0 + h[e, p, 4], h[e, p, 5]
            f20, f21, f22 = h[e, p, 6], h[e, p, 7], 1.0 + h[e, p, 8]
            c00, c01, c02, c10, c11, c12, c20, c21, c22 = cofactor(f00, f01, f02, f10, f11, f12, f20, f21, f22)
            along, across = scale * w[begin + e, p] * a[e, p], scale * w[begin + e, p] * s[e, p]
            p00, p01, p02 = along * f00 + across * c00, along * f01 + across * c01, along * f02 + across * c02
            p10, p11, p12 = along * f10 + across * c10, along * f11 + across * c11, along * f12 + across * c12
            p20, p21, p22 = along * f20 + across * c20, along * f21 + across * c21, along * f22 + across * c22
            for b in range(cells.shape[1]):
                node = cells[begin + e, b]
                g0, g1, g2 = dNdX[begin + e, p, b, 0], dNdX[begin + e, p, b, 1], dNdX[begin + e, p, b, 2]
                g[node, 0] += p00 * g0 + p01 * g1 + p02 * g2
                g[node, 1] += p10 * g0 + p11 * g1 + p12 * g2
                g[node, 2] += p20 * g0 + p21 * g1 + p22 * g2


@allocating_kernel
def add_invariant_stiffness(
    h: Floats, j: Floats, a: Floats, s: Floats, c: Floats, d: Floats, dNdX: Floats, w: Floats, begin: int,
    scale: float, slots: Ints, data: Floats,
) -> None:  # fmt: skip
    """Add the stiffness of an `InvariantLaw`, N/m, of the cells from `begin` on.

    With C = cof F and F = I + h, dP/dF = a 1 + s dC/dF + c (F (x) C + C (x) F) + d C (x) C. With t = C dN/dX and p = F
    dN/dX, the block of two nodes is a (dN.dN) I + s/J (t (x) t - its transpose) + c (p (x) t + t (x) p) + d t (x) t. An
    array `c` of shape (0, q) means zeros. `slots` are as in `add_stiffness`.
    """
    points, nodes = dNdX.shape[1], dNdX.shape[2]
    vectors, block = np.empty((6, nodes, points, 3)), np.empty((3 * nodes, 3 * nodes))
    for e in range(h.shape[0]):
        for p in range(points):
            factor = scale * w[begin + e, p]
            swap = factor * s[e, p] / (1.0 + j[e, p])
            mixed = factor * c[e, p] if c.shape[0] > 0 else 0.0
            _compute_node_vectors(
                h[e, p], dNdX[begin + e, p], p, swap, factor * d[e, p], factor * a[e, p], mixed, vectors
            )
        _fill_node_blocks(vectors, dNdX[begin + e], c.shape[0] > 0, block)
        _scatter_block(e, block, slots, data)


@kernel_part
def _compute_node_vectors(
    h: Floats, g: Floats, p: int, swap: float, grow: float, along: float, mixed: float, vectors: Floats
) -> None:
    """Compute six vectors for every node at one point p, with g = dN/dX, C = cof F and t = C g.

    They are t, (grow + swap) t + mixed F g, swap t, along g, F g and mixed t.
    """
    f00, f01, f02 = 1.0 + h[0], h[1], h[2]
    f10, f11, f12 = h[3], 1.0 + h[4], h[5]
    f20, f21, f22 = h[6], h[7], 1.0 + h[8]
    c00, c01, c02, c10, c11, c12, c20, c21, c22 = cofactor(f00, f01, f02, f10, f11, f12, f20, f21, f22)
    both = grow + swap
    for n in range(g.shape[0]):
        g0, g1, g2 = g[n, 0], g[n, 1], g[n, 2]
        t0 = c00 * g0 + c01 * g1 + c02 * g2
        t1 = c10 * g0 + c11 * g1 + c12 * g2
        t2 = c20 * g0 + c21 * g1 + c22 * g2
        x0 = f00 * g0 + f01 * g1 + f02 * g2
        x1 = f10 * g0 + f11 * g1 + f12 * g2
        x2 = f20 * g0 + f21 * g1 + f22 * g2
        v = vectors[:, n, p]
        v[0, 0], v[0, 1], v[0, 2] = t0, t1, t2
        v[1, 0], v[1, 1], v[1, 2] = both * t0 + mixed * x0, both * t1 + mixed * x1, both * t2 + mixed * x2
        v[2, 0], v[2, 1], v[2, 2] = swap * t0, swap * t1, swap * t2
        v[3, 0], v[3, 1], v[3, 2] = along * g0, along * g1, along * g2
        v[4, 0], v[4, 1], v[4, 2] = x0, x1, x2
        v[5, 0], v[5, 1], v[5, 2] = mixed * t0, mixed * t1, mixed * t2


@kernel_part
def _fill_node_blocks(vectors: Floats, g: Floats, mixed: bool, block: Floats) -> None:
    """Fill the 3x3 blocks of a cell on and above the diagonal from the vectors of `_compute_node_vectors`.

    g (q, a, 3) are the shape-function gradients dN/dX of the cell.
    """
    t, r, turned = vectors[0], vectors[1], vectors[2]
    grown, stretched, pulled = vectors[3], vectors[4], vectors[5]
    for m in range(t.shape[0]):
        for n in range(m, t.shape[0]):
            b00 = b01 = b02 = b10 = b11 = b12 = b20 = b21 = b22 = 0.0
            for p in range(t.shape[1]):
                x0, x1, x2 = r[m, p, 0], r[m, p, 1], r[m, p, 2]
                y0, y1, y2 = t[n, p, 0], t[n, p, 1], t[n, p, 2]
                z0, z1, z2 = turned[m, p, 0], turned[m, p, 1], turned[m, p, 2]
                same = grown[m, p, 0] * g[p, n, 0] + grown[m, p, 1] * g[p, n, 1] + grown[m, p, 2] * g[p, n, 2]
                b00, b01, b02 = (
                    b00 + x0 * y0 - z0 * y0 + same,
                    b01 + x0 * y1 - z1 * y0,
                    b02 + x0 * y2 - z2 * y0,
                )
                b10, b11, b12 = (
                    b10 + x1 * y0 - z0 * y1,
                    b11 + x1 * y1 - z1 * y1 + same,
                    b12 + x1 * y2 - z2 * y1,
                )
                b20, b21, b22 = (
                    b20 + x2 * y0 - z0 * y2,
                    b21 + x2 * y1 - z1 * y2,
                    b22 + x2 * y2 - z2 * y2 + same,
                )
                if mixed:
                    x0, x1, x2 = pulled[m, p, 0], pulled[m, p, 1], pulled[m, p, 2]
                    y0, y1, y2 = stretched[n, p, 0], stretched[n, p, 1], stretched[n, p, 2]
                    b00, b01, b02 = b00 + x0 * y0, b01 + x0 * y1, b02 + x0 * y2
                    b10, b11, b12 = b10 + x1 * y0, b11 + x1 * y1, b12 + x1 * y2
                    b20, b21, b22 = b20 + x2 * y0, b21 + x2 * y1, b22 + x2 * y2
            row = 3 * m
            block[row, 3 * n], block[row, 3 * n + 1], block[row, 3 * n + 2] = b00, b01, b02
            block[row + 1, 3 * n], block[row + 1, 3 * n + 1], block[row + 1, 3 * n + 2] = b10, b11, b12
            block[row + 2, 3 * n], block[row + 2, 3 * n + 1], block[row + 2, 3 * n + 2] = b20, b21, b22
