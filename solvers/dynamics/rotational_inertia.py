"""Bodies whose unknowns turn: the inertia of rotations, and unknowns that are counted anew from every step.

A section with moments of inertia J about its own axes, turning at w about these, has J dw/dt + w x J w = moment
(Euler 1765). Within a step rotations are vectors theta from where it began, q = q0 exp(theta), and integrators treat
them as they treat displacements: x = theta, v = w, a = dw/dt. That is the method of Simo and Vu-Quoc (1988, Comput.
Methods Appl. Mech. Eng. 66) for Newmark's formulas and of Brüls and Cardona (2010, J. Comput. Nonlinear Dyn. 5) for
generalised-alpha, of the same order as in a vector space (Arnold, Brüls and Cardona 2015, Numer. Math. 129); backward
differences of the unknowns take the last step as -theta, which is exact (Wieloch and Arnold 2021). The midpoint rule
balances the angular momentum in space,

    (q1 J w1 - q0 J w0) / h = moment in the middle of the step, theta = h (w0 + w1) / 2,

and so keeps it, and the energy of a free section too: theta . (J w1 - J w0) = 0 (Simo and Wong 1991, Int. J. Numer.
Methods Eng. 31). What this file adds to the equations is the part beyond J dw/dt, `Turning.inertia`.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Protocol

import numpy as np

from softmark.solvers.dynamics.integrator import Past, Stage
from softmark.solvers.energies.energy import Floats, Ints
from softmark.solvers.energies.incremental_rotation import moving_rod_kernels

NONE = np.zeros((0, 3, 3))  # no derivative is asked for
ROUNDS = 8  # at most, of the velocity that an explicit step ends with


class Chart(Protocol):
    """What rotations are counted from."""

    def reset(self) -> None:
        """Count from the undeformed state."""

    def state(self, x: Floats) -> Floats:
        """The state of unknowns x, whatever they are counted from."""

    def rebase(self, x: Floats) -> Floats:
        """Count from x from now on; the unknowns of that state, whose rotation vectors are zero."""


class Turning:
    """Rotation vectors among the unknowns, at `where` (n, 3), and moments of inertia `J` (n, 3), kg m^2."""

    def __init__(self, chart: Chart, where: Ints, J: Floats) -> None:
        self.chart, self.where, self.J = chart, where, J
        self.since: float | None = None  # s, the time that rotations are counted from; None: from the undeformed state

    def reset(self) -> None:
        """Count from the undeformed state."""
        self.chart.reset()
        self.since = None

    def gyroscopic(self, v: Floats) -> Floats:
        """w x J w at the unknowns (dofs,), N m."""
        found = np.zeros(len(v))
        moving_rod_kernels.add_gyroscopic_moments(self.where, v, self.J, 1.0, found)
        return found

    def inertia(self, stage: Stage, x: Floats, v: Floats) -> Floats:
        """What the equations of a step have beyond M a (dofs,), N m, for an end x with the velocity v."""
        found = np.zeros(len(x))
        if stage.between:
            moving_rod_kernels.add_angular_momentum_change(
                self.where, x, stage.start.v, v, self.J, stage.step, stage.B, found, NONE
            )
            return found
        moving_rod_kernels.add_gyroscopic_moments(self.where, v, self.J, 1.0 - stage.alpha_f, found)
        if stage.alpha_f:
            moving_rod_kernels.add_gyroscopic_moments(self.where, stage.start.v, self.J, stage.alpha_f, found)
        return found

    def tangent(self, stage: Stage, x: Floats, v: Floats) -> Floats:
        """Its derivative by the end of the step (n, 3, 3)."""
        found = np.empty((len(self.J), 3, 3))
        if stage.between:
            start, left = stage.start.v, np.zeros(len(x))
            moving_rod_kernels.add_angular_momentum_change(
                self.where, x, start, v, self.J, stage.step, stage.B, left, found
            )
        else:
            moving_rod_kernels.gyroscopic_derivatives(self.where, v, self.J, (1.0 - stage.alpha_f) * stage.B, found)
        return found

    def settled(self, half: Floats, a: Floats, lumped: Floats, h: float, alpha: float) -> Floats:
        """The acceleration at the end of an explicit step, from that without w x J w, which is of its own end.

        v = (half + h/2 a) / (1 + h/2 alpha), found by iteration: each round is closer by about |w| h.
        """
        found = a
        for _ in range(ROUNDS):
            v = (half + 0.5 * h * found) / (1.0 + 0.5 * h * alpha)
            before, found = found, a - self.gyroscopic(v) / lumped
            if np.array_equal(before, found):
                break
        return found

    def accepted(self, past: Past) -> Past:
        """The same motions, with unknowns that are counted from the last one."""
        now, before = past.now, past.before
        theta = now.x[self.where]
        if before is not None:
            x = before.x.copy()
            x[self.where] = -theta  # it was counted from itself
            before = replace(before, x=x)
        self.since = now.time
        return Past(replace(now, x=self.chart.rebase(now.x)), before)
