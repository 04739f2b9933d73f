"""Rotational inertia of bodies with rotation vectors among their unknowns.

Rotation vectors are measured from the orientation at the start of each step.

A section with moments of inertia J about its own axes and angular velocity w about these has J dw/dt + w x J w = moment
(Euler 1765). Within a step rotations are vectors theta from its start, q = q0 exp(theta), and integrators treat them
like displacements: x = theta, v = w, a = dw/dt. That is the method of Simo and Vu-Quoc (1988, Comput. Methods Appl.
Mech. Eng. 66) for Newmark's formulas and of Brüls and Cardona (2010, J. Comput. Nonlinear Dyn. 5) for
generalised-alpha, of the same order as in a vector space (Arnold, Brüls and Cardona 2015, Numer. Math. 129). Backward
differences of the unknowns take the last step as -theta, which is exact (Wieloch and Arnold 2021). The midpoint rule
balances the angular momentum in space,

    (q1 J w1 - q0 J w0) / h = moment in the middle of the step, theta = h (w0 + w1) / 2,

and so conserves it, and the energy of a free section too: theta . (J w1 - J w0) = 0 (Simo and Wong 1991, Int. J. Numer.
Methods Eng. 31). This file adds the terms beyond J dw/dt to the equations, `RotationalInertia.inertia`.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Protocol

import numpy as np

from softmark.solvers.dynamics.integrator import ImplicitStepFormula, StepStart
from softmark.solvers.energies.energy import Floats, Ints
from softmark.solvers.energies.incremental_rotation import moving_rod_kernels

NONE = np.zeros((0, 3, 3))  # no derivative is required
ROUNDS = 8  # largest number of iterations for the final velocity of an explicit step


class RotationChart(Protocol):
    """Interface of the reference orientations from which rotation vectors are measured."""

    def reset(self) -> None:
        """Set the reference to the undeformed state."""

    def state(self, x: Floats) -> Floats:
        """Return the state of unknowns x in a form that does not depend on the reference."""

    def rebase(self, x: Floats) -> Floats:
        """Make the state x the reference, and return its unknowns, whose rotation vectors are then zero."""


class RotationalInertia:
    """Rotational inertia of n nodes whose unknowns include rotation vectors.

    `where` (n, 3) are the numbers of these unknowns, and `J` (n, 3), kg m^2, the principal moments of inertia of each
    node.
    """

    def __init__(self, chart: RotationChart, where: Ints, J: Floats) -> None:
        self.chart, self.where, self.J = chart, where, J
        self.since: float | None = None  # reference time of rotations, s; None: the undeformed state

    def reset(self) -> None:
        """Set the reference to the undeformed state."""
        self.chart.reset()
        self.since = None

    def gyroscopic(self, v: Floats) -> Floats:
        """Return the gyroscopic moments w x J w at the unknowns (dofs,), N m."""
        found = np.zeros(len(v))
        moving_rod_kernels.add_gyroscopic_moments(self.where, v, self.J, 1.0, found)
        return found

    def inertia(self, stage: ImplicitStepFormula, x: Floats, v: Floats) -> Floats:
        """Return the inertia terms (dofs,), N m, of a step in addition to M a, for an end x with velocity v."""
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

    def tangent(self, stage: ImplicitStepFormula, x: Floats, v: Floats) -> Floats:
        """Return the derivative (n, 3, 3) of `inertia` by the unknowns at the end of the step."""
        found = np.empty((len(self.J), 3, 3))
        if stage.between:
            start, left = stage.start.v, np.zeros(len(x))
            moving_rod_kernels.add_angular_momentum_change(
                self.where, x, start, v, self.J, stage.step, stage.B, left, found
            )
        else:
            moving_rod_kernels.gyroscopic_derivatives(self.where, v, self.J, (1.0 - stage.alpha_f) * stage.B, found)
        return found

    def final_acceleration(self, half: Floats, a: Floats, lumped: Floats, h: float, alpha: float) -> Floats:
        """Return the acceleration (dofs,) at the end of an explicit step, with the gyroscopic moments w x J w there.

        The velocity v = (half + h/2 a) / (1 + h/2 alpha) depends on it, so it is found by iteration; each round reduces
        the error by a factor of about |w| h.
        """
        found = a
        for _ in range(ROUNDS):
            v = (half + 0.5 * h * found) / (1.0 + 0.5 * h * alpha)
            before, found = found, a - self.gyroscopic(v) / lumped
            if np.array_equal(before, found):
                break
        return found

    def rebase_step_start(self, past: StepStart) -> StepStart:
        """Return the start of the next step, with rotation vectors measured from the end of the last step.

        `past` holds the motion at the end of the last step and, for multistep integrators, the motion before it.
        """
        now, before = past.now, past.before
        theta = now.x[self.where]
        if before is not None:
            x = before.x.copy()
            x[self.where] = -theta  # the previous state, counted from the new reference
            before = replace(before, x=x)
        self.since = now.time
        return StepStart(replace(now, x=self.chart.rebase(now.x)), before)
