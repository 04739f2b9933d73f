"""The elastic energy of a solid: any law over any element, and sums of such energies over the same cells."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from softmark.solvers.energies import kernels
from softmark.solvers.energies.energy import Energy, Floats, Ints

POINTS = 4096  # at which dP/dF is kept at a time: 648 bytes each, which stay in the cache


class Law(Protocol):
    """Energy density and its derivatives over a batch of deformation gradients F (n, 3, 3)."""

    def psi(self, F: Floats) -> Floats:
        """Energy per undeformed volume (n,), J/m^3."""

    def P(self, F: Floats) -> Floats:
        """First Piola-Kirchhoff stress (n, 3, 3), Pa."""

    def dPdF(self, F: Floats) -> Floats:
        """dP_iJ/dF_kL (n, 3, 3, 3, 3), Pa."""

    def dPdF_projected(self, F: Floats) -> Floats:
        """dPdF with its negative eigenvalues set to zero."""


@dataclass(frozen=True)
class Elastic:
    """sum over integration points of w psi(F), with F = I + sum_a u_a (x) dN_a/dX (Bonet and Wood 2008, ch. 9).

    `cells` (m, a), `dNdX` (m, q, a, 3) in 1/m, `w` (m, q) in m^3; the state x is the displacement (3 nodes,).
    """

    cells: Ints
    dNdX: Floats
    w: Floats
    law: Law
    conservative: bool = True

    @cached_property
    def stencils(self) -> Ints:
        """Three degrees of freedom per node of each cell (m, 3 a)."""
        return (3 * self.cells[:, :, None] + np.arange(3)).reshape(len(self.cells), -1)

    def F(self, x: Floats) -> Floats:
        """Deformation gradients (m q, 3, 3)."""
        F = np.empty((*self.w.shape, 3, 3))
        kernels.deformation_gradient(x.reshape(-1, 3), self.cells, self.dNdX, F)
        return F.reshape(-1, 3, 3)

    @cached_property
    def _noise(self) -> float:
        """eps times the force that a strain of one would cause: F is near one, so its last digit is that strain."""
        stiffest = np.linalg.norm(self.law.dPdF(np.eye(3)[None]))  # of 81 entries: an upper bound
        forces = np.zeros(int(self.cells.max()) + 1)
        share = np.einsum("mq,mqa->ma", self.w, np.linalg.norm(self.dNdX, axis=3))
        np.add.at(forces, self.cells, stiffest * share)
        return float(np.finfo(np.float64).eps * np.linalg.norm(forces))

    def rounding(self, x: Floats) -> float:
        """Norm of what rounding leaves in the gradient, N."""
        return self._noise

    def value(self, x: Floats) -> float:
        """Strain energy, J."""
        return float(self.law.psi(self.F(x)) @ self.w.ravel())

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Nodal elastic forces, N."""
        P = np.ascontiguousarray(self.law.P(self.F(x))).reshape(*self.w.shape, 3, 3)
        kernels.add_forces(P, self.cells, self.dNdX, self.w, scale, g.reshape(-1, 3))

    def add_hessian(
        self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False
    ) -> None:
        """Tangent stiffness, N/m; its geometric part is within dP/dF."""
        tangent = self.law.dPdF_projected if projected else self.law.dPdF
        F = self.F(x).reshape(*self.w.shape, 3, 3)
        cells = max(1, POINTS // self.w.shape[1])
        for begin in range(0, len(F), cells):
            some = slice(begin, begin + cells)
            A = np.ascontiguousarray(tangent(F[some].reshape(-1, 3, 3))).reshape(*F[some].shape, 3, 3)
            kernels.add_stiffness(A, self.dNdX[some], self.w[some], scale, slots[some], data)


@dataclass(frozen=True)
class Together:
    """The sum of energies that share their stencils, as one: shear at eight points and volume at one, for example."""

    parts: tuple[Energy, ...]

    @property
    def conservative(self) -> bool:
        """Whether all are."""
        return all(part.conservative for part in self.parts)

    @property
    def stencils(self) -> Ints:
        """Those of every part."""
        return self.parts[0].stencils

    def rounding(self, x: Floats) -> float:
        """Norm of what rounding leaves in the gradient, N."""
        return sum(part.rounding(x) for part in self.parts)

    def value(self, x: Floats) -> float:
        """Energy, J."""
        return sum(part.value(x) for part in self.parts)

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Nodal forces, N."""
        for part in self.parts:
            part.add_gradient(x, g, scale)

    def add_hessian(
        self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False
    ) -> None:
        """Tangent stiffness, N/m."""
        for part in self.parts:
            part.add_hessian(x, data, slots, scale, projected)
