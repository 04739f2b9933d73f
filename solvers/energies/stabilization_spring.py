"""Stabilisation spring of a free body: it holds the body until contact does, and has no force at convergence."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np

from softmark.records import dataclass
from softmark.solvers.energies.energy import Energy, Floats, Ints
from softmark.solvers.energies.local_blocks import add_blocks

STABILIZATION = "stabilization"  # name of the spring among the numbered energies of an assembly


@dataclass(frozen=True)
class StabilizationSpring(Energy):
    """Stabilisation spring of a body: E = k/2 sum_i w_i |u_i - a_i|^2 over nodes.

    `spring` is the stiffness k in N/m, and `shares` w (n,) are the fractions of it at each node, with the sum 1.
    `place` a (dofs,), m, are the displacements at which the spring is free of force. An equilibrium with u = a is also
    an equilibrium without the spring. The proximal point method (Martinet 1970; Rockafellar 1976) moves a there.
    """

    resists_rigid_motion = True

    shares: Floats
    spring: float
    place: Floats
    conservative: bool = True

    @cached_property
    def stencils(self) -> Ints:
        """Three degrees of freedom of each node (n, 3)."""
        return np.arange(3 * len(self.shares)).reshape(-1, 3)

    @property
    def without_stiffness(self) -> StabilizationSpring:
        """Spring of zero stiffness over the same nodes, which carries no force."""
        return replace(self, spring=0.0)

    def forces(self, x: Floats) -> Floats:
        """Return the forces that deform the spring (n, 3), N."""
        found: Floats = self.spring * self.shares[:, None] * (x - self.place)[self.stencils]
        return found

    def value(self, x: Floats) -> float:
        """Return the energy stored in the spring, J."""
        return 0.5 * float(np.vdot((x - self.place)[self.stencils], self.forces(x)))

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Add the forces that deform the spring, N."""
        g[: self.stencils.size] += scale * self.forces(x).ravel()

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Add the stiffness of the spring, N/m, which is constant."""
        add_blocks(scale * self.spring * self.shares[:, None, None] * np.eye(3), slots, data)

    def rounding(self, x: Floats) -> float:
        """Return the norm of the rounding error of the forces, N, due to the last digits of displacements."""
        return float(np.finfo(np.float64).eps * np.linalg.norm(self.spring * self.shares)) * float(np.abs(x).max())
