"""What pulls at free rigid bodies and turns them: forces at points of them, and moments, that keep direction."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from softmark.records import dataclass
from softmark.solvers.contact.free_rigid_bodies import Free, right_jacobian
from softmark.solvers.energies.energy import Energy, Floats, Ints
from softmark.solvers.energies.local_blocks import add_blocks, cross_matrix


@dataclass(frozen=True)
class Pulled(Energy):
    """A `force` (3,), N, at the point `at` (3,), m, of a free body as it is declared, and a `moment` (3,), N m.

    Moments are about the body's own axes P, as its equations take them: y x P^T force + P^T moment, y the arm of the
    point about these. A moment that keeps its direction has no energy under turns about several axes (Argyris, Dunne
    and Scharpf 1978).
    """

    chart: Any  # Bodies
    which: int
    force: Floats
    at: Floats
    moment: Floats

    @property
    def free(self) -> Free:
        """The body."""
        found: Free = self.chart.bodies[self.which]
        return found

    @property
    def conservative(self) -> bool:
        """Without a moment."""
        return not self.moment.any()

    @cached_property
    def arm(self) -> Floats:
        """From the middle to the point, about the body's own axes (3,), m."""
        found: Floats = (self.at - self.free.middle) @ self.free.axes
        return found

    @property
    def _turn(self) -> Ints:
        """The unknowns of the turn (3,)."""
        return self.free.first + np.arange(3, 6)

    @property
    def stencils(self) -> Ints:
        """These: its tangent is that of the arm, and of the axes that a moment is seen from (1, 3)."""
        return self._turn[None]

    def value(self, x: Floats) -> float:
        """Potential of the force, J."""
        P, first = self.chart.axes(self.which, x), self.free.first
        return -float(self.force @ (x[first : first + 3] + P @ self.arm))

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Minus the force, N, and the moment about the body's own axes, N m."""
        P, first = self.chart.axes(self.which, x), self.free.first
        g[first : first + 3] -= scale * self.force
        g[self._turn] -= scale * (np.cross(self.arm, self.force @ P) + self.moment @ P)

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """-([y] [P^T force] + [P^T moment]) of turns about its own axes; nothing of it is definite."""
        if projected:
            return
        P, theta = self.chart.axes(self.which, x), x[self._turn]
        K = cross_matrix(self.arm) @ cross_matrix(self.force @ P) + cross_matrix(self.moment @ P)
        add_blocks(-scale * (K @ right_jacobian(theta))[None], slots, data)

    def rounding(self, x: Floats) -> float:
        """None: the forces are constant."""
        return 0.0
