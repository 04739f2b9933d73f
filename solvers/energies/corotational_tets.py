"""Corotational four-node tetrahedra: `Elastic` with the law `Corotational`, but faster, in one pass per cell.

The stiffness block of nodes a and b of a cell is w (2 mu g_a.g_b I + lam r_a r_b^T + [r_a] Y [r_b]^T). Here g = dN/dX,
r = R g, [r] is the cross-product matrix of r, Y = c R (tr S I - S)^-1 R^T and c = lam tr(S - I) - 2 mu. These are the
terms of dP/dF of `Corotational`; a rotation increment e acts on g as R (e x g). The rows and columns of the matrix of a
cell sum to zero. So the blocks of three nodes are computed, and those of the fourth follow.
"""

from __future__ import annotations

import math
from dataclasses import field
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from softmark.records import dataclass
from softmark.solvers.energies import displacement_gradient_scaling
from softmark.solvers.energies.energy import Floats, Ints, LaggedTangentEnergy
from softmark.solvers.energies.matrix_decompositions import Nine, nearest_rotation, orthogonalise, set_above_identity
from softmark.solvers.runtime.kernel_cache import kernel, kernel_part

Rows = NDArray[np.int32]
VALUE, FORCE, TANGENT, PROJECTED, LAGGED, KEEP = 1, 2, 4, 8, 16, 32  # flags: results of one pass over the cells
_NONE = np.zeros(0)
_NO_SLOTS = np.zeros((0, 4, 4, 3, 1), dtype=np.int32)
Six = tuple[float, float, float, float, float, float]
BATCH = 64  # cells whose stretches are computed together, in vector registers
FLOOR = GAP = 1e-6  # thresholds of the law `Corotational`: smallest denominator, and switch to SVD


class CorotationalLaw(Protocol):
    """Interface of the constitutive law: its two Lame constants and its tangent."""

    @property
    def mu(self) -> float:
        """Shear modulus mu (second Lame constant), Pa."""

    @property
    def lam(self) -> float:
        """First Lame constant lambda, Pa."""

    def dPdF(self, F: Floats) -> Floats:
        """Return dP_iJ/dF_kL (n, 3, 3, 3, 3), Pa."""


@dataclass(frozen=True)
class CorotationalTets(LaggedTangentEnergy):
    """Corotational energy of four-node tetrahedra: sum over cells of w (mu |S - I|^2 + lam/2 tr(S - I)^2).

    F = R S = I + sum_a u_a (x) dN_a/dX is the deformation gradient, with R a rotation and S symmetric. `cells` (m, 4),
    `dNdX` (m, 1, 4, 3) in 1/m and `w` (m, 1) in m^3 are those of `Elastic`; x is the displacement (3 nodes,).
    """

    integrates_cells = True

    cells: Ints
    dNdX: Floats
    w: Floats
    law: CorotationalLaw
    conservative: bool = True
    _placed: list[tuple[Ints, Rows]] = field(default_factory=list, init=False, repr=False, compare=False)

    @cached_property
    def stencils(self) -> Ints:
        """Three degrees of freedom per node of each cell (m, 12)."""
        return (3 * self.cells[:, :, None] + np.arange(3)).reshape(len(self.cells), -1)

    @property
    def lagged_size(self) -> int:
        """Number of values that a lagged tangent stores per state: one for each cell, tr(S - I)."""
        return len(self.cells)

    def rounding(self, x: Floats) -> float:
        """Return the norm of the rounding error in the gradient, N, as in `Elastic`."""
        return self._unit_strain_rounding_error / self.magnification(x)

    def magnification(self, x: Floats) -> float:
        """Return the power of two, 1 or more, by which displacements are magnified, as in `Elastic`."""
        reach = float(np.abs(x).max(initial=0.0)) * self._gradient_per_displacement
        if not 0.0 < reach < displacement_gradient_scaling.SMALL:
            return 1.0
        H = np.einsum("mai,maJ->miJ", x.reshape(-1, 3)[self.cells], self.dNdX[:, 0]) / reach
        return displacement_gradient_scaling.find_scale(reach, False, lambda up: up * reach * float(np.abs(H).max()))

    @cached_property
    def _gradient_per_displacement(self) -> float:
        """Sum of the shape-function gradients, 1/m: a bound of |H| per largest |u|."""
        return float(np.linalg.norm(self.dNdX, axis=3).sum(axis=2).max(initial=0.0))

    @cached_property
    def _unit_strain_rounding_error(self) -> float:
        stiffest = np.linalg.norm(self.law.dPdF(np.eye(3)[None]))
        forces = np.zeros(int(self.cells.max()) + 1)
        np.add.at(forces, self.cells, stiffest * self.w * np.linalg.norm(self.dNdX[:, 0], axis=2))
        return float(np.finfo(np.float64).eps * np.linalg.norm(forces))

    def has_no_inverted_cells(self, x: Floats) -> bool:
        """Return whether no cell is inverted: det F > 0 in every cell."""
        return bool(has_no_inverted_cell(np.ascontiguousarray(x).reshape(-1, 3), self.cells, self._G, np.empty((3, 3))))

    def value(self, x: Floats) -> float:
        """Return the strain energy, J."""
        up = self.magnification(x)
        return self._assemble_cells(VALUE, x if up == 1.0 else up * x, _NONE, _NONE, _NO_SLOTS, 1.0) / up / up

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Add the nodal elastic forces, N."""
        up = self.magnification(x)
        self._assemble_cells(FORCE, x if up == 1.0 else up * x, g, _NONE, _NO_SLOTS, scale / up)

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Add the tangent stiffness, N/m."""
        self._assemble_cells(TANGENT + PROJECTED * projected, x, _NONE, data, self._block_positions(slots), scale)

    def add_gradient_and_lagged(self, x: Floats, g: Floats, traces: Floats) -> None:
        """Add the nodal forces as `add_gradient` does, and write tr(S - I) of each cell into `traces` (m,)."""
        self._assemble_cells(FORCE + KEEP, x, g, _NONE, _NO_SLOTS, 1.0, traces)

    def add_both_lagged(self, x: Floats, g: Floats, data: Floats, slots: Ints, traces: Floats) -> None:
        """Add the forces, and a tangent that takes tr(S - I) of each cell from `traces` (m,) instead of from x.

        In an extrapolated state, the pressures of nearly incompressible cells are wrong. With those of the last state
        the tangent stays definite. Source: Magisano, Leonetti and Garcea (2017), "How to improve efficiency and
        robustness of the Newton method in geometrically non-linear structural problems".
        """
        self._assemble_cells(FORCE + TANGENT + LAGGED, x, g, data, self._block_positions(slots), 1.0, traces)

    def _assemble_cells(
        self, what: int, x: Floats, g: Floats, data: Floats, rows: Rows, scale: float, traces: Floats = _NONE
    ) -> float:
        forces, law = g.reshape(-1, 3), self.law
        u = np.ascontiguousarray(x).reshape(-1, 3)
        body = (u, self.cells, self._G, self._cell_volumes, law.mu, law.lam)
        memory = (np.empty((BATCH, 9)), np.empty((5, BATCH)), np.empty((4, 4, 3, 3)), np.empty((6, 3)))
        return float(assemble_cells(what, *body, scale, rows, forces, data, traces, *memory))

    @cached_property
    def _G(self) -> Floats:
        """Gradients dN/dX of nodes 1 to 3 (m, 3, 3), 1/m."""
        return np.ascontiguousarray(self.dNdX[:, 0, 1:])

    @cached_property
    def _cell_volumes(self) -> Floats:
        return np.ascontiguousarray(self.w[:, 0])

    def _block_positions(self, slots: Ints) -> Rows:
        """Return the positions in the matrix values of each block row (m, 4, 4, 3, 1), or entry (m, 4, 4, 3, 3).

        Columns of a block are adjacent unless a node is partly fixed. The result is computed once per array of slots.
        """
        for known, rows in self._placed:
            if known is slots:
                return rows
        blocks = slots.reshape(-1, 4, 3, 4, 3).transpose(0, 1, 3, 2, 4)
        whole = (np.diff(blocks, axis=-1) == 1).all(axis=-1) | (blocks < 0).all(axis=-1)
        rows = np.ascontiguousarray(blocks[..., :1] if whole.all() else blocks, dtype=np.int32)
        self._placed[:] = [(slots, rows)]
        return rows


@kernel_part
def cofactor(
    a00: float, a01: float, a02: float, a10: float, a11: float, a12: float, a20: float, a21: float, a22: float
) -> Nine:
    """Return the nine entries of cof A, row by row, from those of the matrix A."""
    return (
        a11 * a22 - a12 * a21, a12 * a20 - a10 * a22, a10 * a21 - a11 * a20,
        a21 * a02 - a22 * a01, a22 * a00 - a20 * a02, a20 * a01 - a21 * a00,
        a01 * a12 - a02 * a11, a02 * a10 - a00 * a12, a00 * a11 - a01 * a10,
    )  # fmt: skip


@kernel_part
def invariants(
    f00: float, f01: float, f02: float, f10: float, f11: float, f12: float, f20: float, f21: float, f22: float
) -> tuple[float, float, float]:
    """Return three invariants of F, given row by row: |F| and, for g = F/|F|, det g and 4 |cof g|^2."""
    norm = math.sqrt(
        f00 * f00 + f01 * f01 + f02 * f02 + f10 * f10 + f11 * f11 + f12 * f12 + f20 * f20 + f21 * f21 + f22 * f22
    )  # fmt: skip
    c00, c01, c02, c10, c11, c12, c20, c21, c22 = cofactor(f00, f01, f02, f10, f11, f12, f20, f21, f22)
    s = 1.0 / norm
    det = (f00 * c00 + f01 * c01 + f02 * c02) * s * s * s
    square = (
        c00 * c00 + c01 * c01 + c02 * c02 + c10 * c10 + c11 * c11 + c12 * c12 + c20 * c20 + c21 * c21 + c22 * c22
    )  # fmt: skip
    return norm, det, 4.0 * square * (s * s) * (s * s)


@kernel_part
def stretch_sums(count: int, det: Floats, q: Floats, x: Floats, step: Floats) -> None:
    """Compute the sums x (count,) of principal stretches of F/|F|: the largest roots of (x^2 - 1)^2 = 8 det x + q.

    `step` gets the last Newton steps; `det` and q are results of `invariants`.
    """
    for j in range(count):
        x[j] = math.sqrt(1.0 + math.sqrt(q[j] + 8.0 * math.sqrt(3.0) * max(det[j], 0.0)))
    for _ in range(12):
        pending = 0
        for j in range(count):
            y = x[j] * x[j] - 1.0
            d = (y * y - 8.0 * det[j] * x[j] - q[j]) / (4.0 * x[j] * y - 8.0 * det[j])
            x[j] -= d
            step[j] = abs(d)
            pending += abs(d) > 1e-7
        if pending == 0:
            break


@kernel_part
def rotation(
    f00: float, f01: float, f02: float, f10: float, f11: float, f12: float, f20: float, f21: float, f22: float,
    norm: float, det: float, x: float, step: float, memory: Floats,
) -> Nine:  # fmt: skip
    """Return the rotation nearest to F, row by row, from |F|, det F/|F| and `stretch_sums`; NaN if F is not finite."""
    s = 1.0 / norm if norm > 0.0 else 0.0
    g00, g01, g02 = s * f00, s * f01, s * f02
    g10, g11, g12 = s * f10, s * f11, s * f12
    g20, g21, g22 = s * f20, s * f21, s * f22
    c00, c01, c02, c10, c11, c12, c20, c21, c22 = cofactor(g00, g01, g02, g10, g11, g12, g20, g21, g22)
    gap = 0.5 * x * (x * x - 1.0) - det
    if gap > GAP and step < 1e-6:
        b = 0.5 * (x * x + 1.0)
        # m = b I - g^T g, symmetric; R gap = I cof g + g m
        m00 = b - (g00 * g00 + g10 * g10 + g20 * g20)
        m11 = b - (g01 * g01 + g11 * g11 + g21 * g21)
        m22 = b - (g02 * g02 + g12 * g12 + g22 * g22)
        m01 = -(g00 * g01 + g10 * g11 + g20 * g21)
        m02 = -(g00 * g02 + g10 * g12 + g20 * g22)
        m12 = -(g01 * g02 + g11 * g12 + g21 * g22)
        t = 1.0 / gap
        r00 = t * (x * c00 + g00 * m00 + g01 * m01 + g02 * m02)
        r01 = t * (x * c01 + g00 * m01 + g01 * m11 + g02 * m12)
        r02 = t * (x * c02 + g00 * m02 + g01 * m12 + g02 * m22)
        r10 = t * (x * c10 + g10 * m00 + g11 * m01 + g12 * m02)
        r11 = t * (x * c11 + g10 * m01 + g11 * m11 + g12 * m12)
        r12 = t * (x * c12 + g10 * m02 + g11 * m12 + g12 * m22)
        r20 = t * (x * c20 + g20 * m00 + g21 * m01 + g22 * m02)
        r21 = t * (x * c21 + g20 * m01 + g21 * m11 + g22 * m12)
        r22 = t * (x * c22 + g20 * m02 + g21 * m12 + g22 * m22)
        defect = 1.0
        for _ in range(3):  # Newton and Schulz: R <- R (3 I - R^T R) / 2
            e00 = 0.5 * (r00 * r00 + r10 * r10 + r20 * r20 - 1.0)
            e11 = 0.5 * (r01 * r01 + r11 * r11 + r21 * r21 - 1.0)
            e22 = 0.5 * (r02 * r02 + r12 * r12 + r22 * r22 - 1.0)
            e01 = 0.5 * (r00 * r01 + r10 * r11 + r20 * r21)
            e02 = 0.5 * (r00 * r02 + r10 * r12 + r20 * r22)
            e12 = 0.5 * (r01 * r02 + r11 * r12 + r21 * r22)
            r00, r01, r02 = (
                r00 - (r00 * e00 + r01 * e01 + r02 * e02),
                r01 - (r00 * e01 + r01 * e11 + r02 * e12),
                r02 - (r00 * e02 + r01 * e12 + r02 * e22),
            )
            r10, r11, r12 = (
                r10 - (r10 * e00 + r11 * e01 + r12 * e02),
                r11 - (r10 * e01 + r11 * e11 + r12 * e12),
                r12 - (r10 * e02 + r11 * e12 + r12 * e22),
            )
            r20, r21, r22 = (
                r20 - (r20 * e00 + r21 * e01 + r22 * e02),
                r21 - (r20 * e01 + r21 * e11 + r22 * e12),
                r22 - (r20 * e02 + r21 * e12 + r22 * e22),
            )
            defect = 2.0 * max(max(max(abs(e00), abs(e11)), abs(e22)), max(max(abs(e01), abs(e02)), abs(e12)))
            if defect <= 1e-8:
                break
        if defect < 1e-7:
            return r00, r01, r02, r10, r11, r12, r20, r21, r22
    if not norm < np.inf:
        return np.nan, np.nan, np.nan, np.nan, np.nan, np.nan, np.nan, np.nan, np.nan
    set_above_identity(memory, g00, g01, g02, g10, g11, g12, g20, g21, g22)
    orthogonalise(memory)
    return nearest_rotation(memory)


@kernel_part
def _scaled_symmetric_inverse(
    a00: float, a11: float, a22: float, a01: float, a02: float, a12: float, c: float, lowest: float, memory: Floats
) -> Six:  # fmt: skip
    """Return the six entries of Y = c A^-1, A symmetric; eigenvalues of A are at least FLOOR, those of Y `lowest`."""
    k00, k11, k22 = a11 * a22 - a12 * a12, a00 * a22 - a02 * a02, a00 * a11 - a01 * a01
    k01, k02, k12 = a02 * a12 - a01 * a22, a01 * a12 - a02 * a11, a01 * a02 - a00 * a12
    det = a00 * k00 + a01 * k01 + a02 * k02
    half = 0.5 * (a00 + a11 + a22)
    if lowest == -np.inf and det > FLOOR * half * half:
        t = c / det
        return t * k00, t * k11, t * k22, t * k01, t * k02, t * k12
    if not half * half < np.inf:
        return np.nan, np.nan, np.nan, np.nan, np.nan, np.nan
    # A + shift I is positive: its singular values are its eigenvalues
    shift = math.sqrt(a00 * a00 + a11 * a11 + a22 * a22 + 2.0 * (a01 * a01 + a02 * a02 + a12 * a12))
    set_above_identity(memory, a00 + shift, a01, a02, a01, a11 + shift, a12, a02, a12, a22 + shift)
    orthogonalise(memory)
    y00, y11, y22, y01, y02, y12 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(3):
        w = math.sqrt(memory[0, k] * memory[0, k] + memory[1, k] * memory[1, k] + memory[2, k] * memory[2, k])
        factor = max(c / max(w - shift, FLOOR), lowest)
        v0, v1, v2 = memory[3, k], memory[4, k], memory[5, k]
        y00, y11, y22 = y00 + factor * v0 * v0, y11 + factor * v1 * v1, y22 + factor * v2 * v2
        y01, y02, y12 = y01 + factor * v0 * v1, y02 + factor * v0 * v2, y12 + factor * v1 * v2
    return y00, y11, y22, y01, y02, y12


@kernel_part
def _gather_deformation_gradients(
    u: Floats, cells: Ints, G: Floats, begin: int, count: int, F: Floats, norms: Floats, dets: Floats, q: Floats
) -> None:  # fmt: skip
    """Compute F (count, 9) of `count` cells from the cell `begin` on, and the three `invariants` of each."""
    for j in range(count):
        e = begin + j
        n0 = cells[e, 0]
        for i in range(3):
            d1 = u[cells[e, 1], i] - u[n0, i]
            d2 = u[cells[e, 2], i] - u[n0, i]
            d3 = u[cells[e, 3], i] - u[n0, i]
            for J in range(3):
                one = 1.0 if i == J else 0.0
                F[j, 3 * i + J] = one + d1 * G[e, 0, J] + d2 * G[e, 1, J] + d3 * G[e, 2, J]
        norms[j], dets[j], q[j] = invariants(
            F[j, 0], F[j, 1], F[j, 2], F[j, 3], F[j, 4], F[j, 5], F[j, 6], F[j, 7], F[j, 8]
        )


@kernel
def has_no_inverted_cell(u: Floats, cells: Ints, G: Floats, F: Floats) -> bool:
    """Return whether det F > 0 in every cell; F (3, 3) is work space."""
    for e in range(cells.shape[0]):
        n0 = cells[e, 0]
        for i in range(3):
            for J in range(3):
                F[i, J] = 1.0 if i == J else 0.0
                for a in range(3):
                    F[i, J] += (u[cells[e, a + 1], i] - u[n0, i]) * G[e, a, J]
        det = F[0, 0] * (F[1, 1] * F[2, 2] - F[1, 2] * F[2, 1])
        det += F[0, 1] * (F[1, 2] * F[2, 0] - F[1, 0] * F[2, 2])
        det += F[0, 2] * (F[1, 0] * F[2, 1] - F[1, 1] * F[2, 0])
        if not det > 0.0:
            return False
    return True


@kernel_part
def _add_cell_forces(e: int, cells: Ints, G: Floats, P: Nine, forces: Floats) -> None:
    """Add the nodal forces P dN/dX of one cell; the stress P is already multiplied by the cell volume."""
    p00, p01, p02, p10, p11, p12, p20, p21, p22 = P
    x, y, z = 0.0, 0.0, 0.0
    for a in range(3):
        g0, g1, g2 = G[e, a, 0], G[e, a, 1], G[e, a, 2]
        fx = p00 * g0 + p01 * g1 + p02 * g2
        fy = p10 * g0 + p11 * g1 + p12 * g2
        fz = p20 * g0 + p21 * g1 + p22 * g2
        node = cells[e, a + 1]
        forces[node, 0] += fx
        forces[node, 1] += fy
        forces[node, 2] += fz
        x, y, z = x + fx, y + fy, z + fz
    node = cells[e, 0]
    forces[node, 0] -= x
    forces[node, 1] -= y
    forces[node, 2] -= z


@kernel_part
def _fill_stiffness_blocks(
    e: int, G: Floats, R: Nine, Y: Six, mu: float, lam: float, factor: float, r: Floats, block: Floats
) -> None:
    """Fill the blocks 1 <= a <= b <= 3 of a cell: factor (2 mu r_a.r_b I + lam r_a r_b^T + [r_a] Y [r_b]^T)."""
    r00, r01, r02, r10, r11, r12, r20, r21, r22 = R
    k00, k11, k22, k01, k02, k12 = Y
    for a in range(3):
        g0, g1, g2 = G[e, a, 0], G[e, a, 1], G[e, a, 2]
        r[a, 0] = r00 * g0 + r01 * g1 + r02 * g2
        r[a, 1] = r10 * g0 + r11 * g1 + r12 * g2
        r[a, 2] = r20 * g0 + r21 * g1 + r22 * g2
    for b in range(3):
        q0, q1, q2 = factor * r[b, 0], factor * r[b, 1], factor * r[b, 2]
        # m = Y [q]^T: each row is q crossed with a row of Y
        m00, m01, m02 = k02 * q1 - k01 * q2, k00 * q2 - k02 * q0, k01 * q0 - k00 * q1
        m10, m11, m12 = k12 * q1 - k11 * q2, k01 * q2 - k12 * q0, k11 * q0 - k01 * q1
        m20, m21, m22 = k22 * q1 - k12 * q2, k02 * q2 - k22 * q0, k12 * q0 - k02 * q1
        for a in range(b + 1):
            s0, s1, s2 = r[a, 0], r[a, 1], r[a, 2]
            along = 2.0 * mu * (s0 * q0 + s1 * q1 + s2 * q2)
            l0, l1, l2 = lam * s0, lam * s1, lam * s2
            block[a + 1, b + 1, 0, 0] = along + l0 * q0 + s1 * m20 - s2 * m10
            block[a + 1, b + 1, 0, 1] = l0 * q1 + s1 * m21 - s2 * m11
            block[a + 1, b + 1, 0, 2] = l0 * q2 + s1 * m22 - s2 * m12
            block[a + 1, b + 1, 1, 0] = l1 * q0 + s2 * m00 - s0 * m20
            block[a + 1, b + 1, 1, 1] = along + l1 * q1 + s2 * m01 - s0 * m21
            block[a + 1, b + 1, 1, 2] = l1 * q2 + s2 * m02 - s0 * m22
            block[a + 1, b + 1, 2, 0] = l2 * q0 + s0 * m10 - s1 * m00
            block[a + 1, b + 1, 2, 1] = l2 * q1 + s0 * m11 - s1 * m01
            block[a + 1, b + 1, 2, 2] = along + l2 * q2 + s0 * m12 - s1 * m02


@kernel_part
def _complete_stiffness_blocks(block: Floats) -> None:
    """Fill the remaining blocks of a cell, by symmetry and because its rows and columns sum to zero (node 0)."""
    for i in range(3):
        for k in range(3):
            block[2, 1, i, k] = block[1, 2, k, i]
            block[3, 1, i, k] = block[1, 3, k, i]
            block[3, 2, i, k] = block[2, 3, k, i]
    for b in range(1, 4):
        for i in range(3):
            for k in range(3):
                total = -(block[1, b, i, k] + block[2, b, i, k] + block[3, b, i, k])
                block[0, b, i, k] = total
                block[b, 0, k, i] = total
    for i in range(3):
        for k in range(3):
            block[0, 0, i, k] = -(block[1, 0, i, k] + block[2, 0, i, k] + block[3, 0, i, k])


@kernel_part
def _scatter_rows(e: int, rows: Rows, block: Floats, data: Floats) -> None:
    """Add the blocks of one cell to the matrix values, three adjacent entries at a time (unsigned: no sign test)."""
    for a in range(4):
        for b in range(4):
            for i in range(3):
                if rows[e, a, b, i, 0] >= 0:
                    at = np.uint64(rows[e, a, b, i, 0])
                    data[at] += block[a, b, i, 0]
                    data[at + np.uint64(1)] += block[a, b, i, 1]
                    data[at + np.uint64(2)] += block[a, b, i, 2]


@kernel_part
def _scatter_entries(e: int, places: Rows, block: Floats, data: Floats) -> None:
    """Add the blocks of one cell to the matrix values, one entry at a time."""
    for a in range(4):
        for b in range(4):
            for i in range(3):
                for k in range(3):
                    if places[e, a, b, i, k] >= 0:
                        data[places[e, a, b, i, k]] += block[a, b, i, k]


@kernel
def assemble_cells(
    what: int, u: Floats, cells: Ints, G: Floats, w: Floats, mu: float, lam: float, scale: float,
    rows: Rows, forces: Floats, data: Floats, traces: Floats, F: Floats, lists: Floats, block: Floats, memory: Floats,
) -> float:  # fmt: skip
    """Make one pass over the cells, and return the energy, J.

    The flags in `what` select whether `scale` times the forces and the tangent are added to `forces` and `data`. F
    (BATCH, 9), `lists` (5, BATCH), `block` (4, 4, 3, 3) and `memory` (6, 3) are work arrays supplied by the caller.
    """
    energy = 0.0
    lowest = -mu if what & PROJECTED else -np.inf
    single = rows.shape[4] == 1
    norms, dets, squares, sums, steps = lists[0], lists[1], lists[2], lists[3], lists[4]
    for begin in range(0, cells.shape[0], BATCH):
        count = min(BATCH, cells.shape[0] - begin)
        _gather_deformation_gradients(u, cells, G, begin, count, F, norms, dets, squares)
        stretch_sums(count, dets, squares, sums, steps)
        for j in range(count):
            e = begin + j
            f00, f01, f02, f10, f11, f12 = F[j, 0], F[j, 1], F[j, 2], F[j, 3], F[j, 4], F[j, 5]
            f20, f21, f22 = F[j, 6], F[j, 7], F[j, 8]
            R = rotation(f00, f01, f02, f10, f11, f12, f20, f21, f22, norms[j], dets[j], sums[j], steps[j], memory)
            r00, r01, r02, r10, r11, r12, r20, r21, r22 = R
            d00, d01, d02, d10, d11, d12 = f00 - r00, f01 - r01, f02 - r02, f10 - r10, f11 - r11, f12 - r12
            d20, d21, d22 = f20 - r20, f21 - r21, f22 - r22
            t = r00 * d00 + r01 * d01 + r02 * d02 + r10 * d10 + r11 * d11 + r12 * d12
            t += r20 * d20 + r21 * d21 + r22 * d22
            if what & KEEP:
                traces[e] = t
            if what & VALUE:
                size = d00 * d00 + d01 * d01 + d02 * d02 + d10 * d10 + d11 * d11 + d12 * d12
                size += d20 * d20 + d21 * d21 + d22 * d22
                energy += w[e] * (mu * size + 0.5 * lam * t * t)
            if what & FORCE:
                a, b = scale * w[e] * 2.0 * mu, scale * w[e] * lam * t
                P = (
                    a * d00 + b * r00, a * d01 + b * r01, a * d02 + b * r02,
                    a * d10 + b * r10, a * d11 + b * r11, a * d12 + b * r12,
                    a * d20 + b * r20, a * d21 + b * r21, a * d22 + b * r22,
                )  # fmt: skip
                _add_cell_forces(e, cells, G, P, forces)
            if what & TANGENT:
                # V = F R^T = R S R^T, the stretch in the turned frame; Y = c (tr V I - V)^-1
                v00 = f00 * r00 + f01 * r01 + f02 * r02
                v11 = f10 * r10 + f11 * r11 + f12 * r12
                v22 = f20 * r20 + f21 * r21 + f22 * r22
                v01 = 0.5 * (f00 * r10 + f01 * r11 + f02 * r12 + f10 * r00 + f11 * r01 + f12 * r02)
                v02 = 0.5 * (f00 * r20 + f01 * r21 + f02 * r22 + f20 * r00 + f21 * r01 + f22 * r02)
                v12 = 0.5 * (f10 * r20 + f11 * r21 + f12 * r22 + f20 * r10 + f21 * r11 + f22 * r12)
                c = lam * (traces[e] if what & LAGGED else t) - 2.0 * mu
                Y = _scaled_symmetric_inverse(v11 + v22, v00 + v22, v00 + v11, -v01, -v02, -v12, c, lowest, memory)
                _fill_stiffness_blocks(e, G, R, Y, mu, lam, scale * w[e], memory, block)
                _complete_stiffness_blocks(block)
                if single:
                    _scatter_rows(e, rows, block, data)
                else:
                    _scatter_entries(e, rows, block, data)
    return energy
