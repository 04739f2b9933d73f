"""Corotational elasticity with one rotation per cell, as in real-time simulators."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np

from softmark.records import dataclass
from softmark.solvers.energies.energy import Energy, Floats, Ints
from softmark.solvers.energies.local_blocks import cross_matrix

Polar = Callable[[Floats], Floats]  # F (m, 3, 3) -> the rotations nearest to them (m, 3, 3)


@dataclass(frozen=True)
class ElementCorotational(Energy):
    """Corotational element energy with nodal forces R K (R^T x - X), where R is one rotation per cell.

    R is the rotation nearest to the mean F of the cell, and x are the deformed positions. `X` (n, 3) are the undeformed
    positions in m, `cells` (m, a) the nodes of each cell, `G` (m, a, 3) the mean shape-function gradients in 1/m, and
    `K` (m, 3a, 3a) the element stiffness at rest in N/m. The function `polar` returns the rotations nearest to F (m, 3,
    3). In the frame of R, the forces are those of linear elasticity. In a cell of more than four nodes they are not the
    derivative of any energy, because R depends on the nodes too. The tangent here is exact and not symmetric. In a
    four-node tetrahedron the forces equal those of the law `Corotational`.
    Source: Mueller and Gross (2004), "Interactive virtual materials"; Felippa (2000).
    """

    X: Floats
    cells: Ints
    G: Floats
    K: Floats
    polar: Polar
    conservative: bool = False

    @cached_property
    def stencils(self) -> Ints:
        """Three degrees of freedom per node of each cell (m, 3 a)."""
        return (3 * self.cells[:, :, None] + np.arange(3)).reshape(len(self.cells), -1)

    @cached_property
    def _unit_strain_rounding_error(self) -> float:
        """Machine epsilon times the norm of the nodal forces caused by a unit strain, N."""
        forces = np.zeros(len(self.X))
        sizes = np.ptp(self.X[self.cells], axis=1).max(axis=1)
        row = np.linalg.norm(self.K.reshape(*self.cells.shape, 3, -1), axis=(2, 3))
        np.add.at(forces, self.cells, row * sizes[:, None])
        return float(np.finfo(np.float64).eps * np.linalg.norm(forces))

    def rounding(self, x: Floats) -> float:
        """Return the norm of the rounding error in the gradient, N."""
        return self._unit_strain_rounding_error

    def _corotated_positions_and_forces(self, x: Floats) -> tuple[Floats, Floats, Floats]:
        """Return rotations R (m, 3, 3), rotated positions R^T x (m, a, 3), and forces K (R^T x - X) (m, a, 3).

        The forces are in the rotated frame of each cell.
        """
        y = (self.X + x.reshape(-1, 3))[self.cells]
        R = self.rotations(x)
        z = y @ R  # rows R^T x
        p = (z - self.X[self.cells]).reshape(len(R), -1, 1)
        return R, z, (self.K @ p).reshape(z.shape)

    def mean_gradient(self, x: Floats) -> Floats:
        """Return the mean deformation gradient of each cell (m, 3, 3)."""
        F: Floats = np.eye(3) + x.reshape(-1, 3)[self.cells].transpose(0, 2, 1) @ self.G
        return F

    def rotations(self, x: Floats) -> Floats:
        """Return the rotation of each cell (m, 3, 3)."""
        return self.polar(self.mean_gradient(x))

    def value(self, x: Floats) -> float:
        """Return the strain energy in the rotated frames, J; the forces are its derivative only at fixed R."""
        _, z, q = self._corotated_positions_and_forces(x)
        return 0.5 * float(np.sum((z - self.X[self.cells]) * q))

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Add the nodal elastic forces, N."""
        R, _, q = self._corotated_positions_and_forces(x)
        np.add.at(g.reshape(-1, 3), self.cells, scale * (q @ R.transpose(0, 2, 1)))

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Add the tangent R (K + (K [z] - [q]) W) R^T, N/m.

        z = R^T x are the rotated positions, q the forces in the rotated frame, and W the derivative of R by the node
        positions (`_rotation_derivative`). If `projected`, add only R K R^T, the stiffness at fixed R.
        """
        R, z, q = self._corotated_positions_and_forces(x)
        T = self.K
        if not projected:
            spin = self.K @ _stacked_cross(z) - _stacked_cross(q)  # (m, 3a, 3)
            T = T + spin @ self._rotation_derivative(x, R)
        m, a = self.cells.shape
        T = T.reshape(m, a, 3, 3 * a).transpose(0, 1, 3, 2) @ R.transpose(0, 2, 1)[:, None]  # (m, a, 3a, i)
        T = T.reshape(m, a, a, 3, 3).transpose(0, 1, 2, 4, 3) @ R.transpose(0, 2, 1)[:, None, None]
        entries, keep = T.transpose(0, 1, 3, 2, 4).reshape(slots.shape), slots >= 0
        data += scale * np.bincount(slots[keep], entries[keep], minlength=len(data))

    def _rotation_derivative(self, x: Floats, R: Floats) -> Floats:
        """Return W (m, 3, 3a), the derivative of the rotation by node positions: R^T dR = [w] with w = W R^T dx.

        w = (tr S I - S)^-1 sum_b g_b x (R^T dx_b) with S = R^T F. It follows from R^T dF - dF^T R = [w] S + S [w].
        """
        S = R.transpose(0, 2, 1) @ self.mean_gradient(x)
        S = 0.5 * (S + S.transpose(0, 2, 1))
        Y = np.trace(S, axis1=1, axis2=2)[:, None, None] * np.eye(3) - S
        turns: Floats = np.linalg.solve(Y, -_stacked_cross(self.G).transpose(0, 2, 1))
        return turns


def _stacked_cross(v: Floats) -> Floats:
    """Return the cross-product matrices [v_a]x of v (m, a, 3), stacked vertically for each cell (m, 3a, 3)."""
    return cross_matrix(v).reshape(len(v), -1, 3)


def element_stiffness(dNdX: Floats, w: Floats, A: Floats) -> Floats:
    """Return the stiffness of each cell (m, 3a, 3a), N/m, for one tensor A = dP/dF (3, 3, 3, 3), Pa.

    The entries are sum_q w dN_a/dX_J A_iJkL dN_b/dX_L.
    """
    m, _, a, _ = dNdX.shape
    B = np.einsum("iJkL,mqbL->mqiJbk", A, dNdX, optimize=True)
    K = np.einsum("mqaJ,mqiJbk->maibk", dNdX * w[:, :, None, None], B, optimize=True)
    return np.ascontiguousarray(K.reshape(m, 3 * a, 3 * a))


def mean_gradients(dNdX: Floats, w: Floats) -> Floats:
    """Return the mean shape-function gradients of each cell (m, a, 3), 1/m, weighted by the volumes w (m, q)."""
    G: Floats = np.einsum("mq,mqaJ->maJ", w, dNdX) / w.sum(axis=1)[:, None, None]
    return G
