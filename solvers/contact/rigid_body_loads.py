"""Loads of free rigid bodies: forces at points of the body, and moments, both with constant directions in space."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from softmark.records import dataclass
from softmark.solvers.contact.free_rigid_bodies import FreeRigidBody, right_jacobian
from softmark.solvers.energies.energy import Energy, Floats, Ints
from softmark.solvers.energies.local_blocks import add_blocks, cross_matrix


@dataclass(frozen=True)
class RigidBodyLoad(Energy):
    """Load of a free rigid body: a `force` (3,), N, at the point `at` (3,), m, and a `moment` (3,), N m.

    The point is fixed to the body and given in its declared position. The body is number `which` of the `chart`. Like
    the equations of rotation, the load is expressed about the body axes P: y x P^T force + P^T moment, with the arm y
    of the point in the body frame. A moment of constant direction has no energy under rotations about several axes
    (Argyris, Dunne and Scharpf 1978).
    """

    chart: Any  # FreeBodyChart
    which: int
    force: Floats
    at: Floats
    moment: Floats

    @property
    def free(self) -> FreeRigidBody:
        """Rigid body that carries the load."""
        found: FreeRigidBody = self.chart.bodies[self.which]
        return found

    @property
    def conservative(self) -> bool:
        """True if the load has no moment, and so has a potential."""
        return not self.moment.any()

    @cached_property
    def arm(self) -> Floats:
        """Vector (3,), m, from the centre of mass to the loaded point, in the body frame."""
        found: Floats = (self.at - self.free.middle) @ self.free.axes
        return found

    @property
    def _rotation_dofs(self) -> Ints:
        """Rotational degrees of freedom (3,) of the body."""
        return self.free.first + np.arange(3, 6)

    @property
    def stencils(self) -> Ints:
        """Degrees of freedom (1, 3) that the tangent depends on: the rotation of the body."""
        return self._rotation_dofs[None]

    def value(self, x: Floats) -> float:
        """Return the potential of the force, J."""
        P, first = self.chart.axes(self.which, x), self.free.first
        return -float(self.force @ (x[first : first + 3] + P @ self.arm))

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Add to g the negative force, N, and the negative moment about the body axes, N m."""
        P, first = self.chart.axes(self.which, x), self.free.first
        g[first : first + 3] -= scale * self.force
        g[self._rotation_dofs] -= scale * (np.cross(self.arm, self.force @ P) + self.moment @ P)

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Add the tangent -([y] [P^T force] + [P^T moment]) for rotations about the body axes.

        Nothing is added if `projected`.
        """
        if projected:
            return
        P, theta = self.chart.axes(self.which, x), x[self._rotation_dofs]
        K = cross_matrix(self.arm) @ cross_matrix(self.force @ P) + cross_matrix(self.moment @ P)
        add_blocks(-scale * (K @ right_jacobian(theta))[None], slots, data)

    def rounding(self, x: Floats) -> float:
        """Return 0: the forces are constant."""
        return 0.0
