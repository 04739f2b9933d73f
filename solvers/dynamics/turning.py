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

from softmark.solvers.dynamics.scheme import Past, Stage
from softmark.solvers.energies.energy import Floats, Ints

ROUNDS = 8  # at most, of the velocity that an explicit step ends with


class Chart(Protocol):
    """What rotations are counted from."""

    def reset(self) -> None:
        """Count from the undeformed state."""

    def rebase(self, x: Floats) -> Floats:
        """Count from x from now on; the unknowns of that state, whose rotation vectors are zero."""


class Turning:
    """Rotation vectors among the unknowns, at `where` (n, 3), and moments of inertia `J` (n, 3), kg m^2."""

    def __init__(self, chart: Chart, where: Ints, J: Floats) -> None:
        self.chart, self.where, self.J = chart, where, J

    def gyroscopic(self, v: Floats) -> Floats:
        """w x J w at the unknowns (dofs,), N m."""
        w = v[self.where]
        found = np.zeros(len(v))
        found[self.where] = _cross(w, self.J * w)
        return found

    def slopes(self, v: Floats) -> Floats:
        """Its derivative by w (n, 3, 3)."""
        w = v[self.where]
        found: Floats = _hat(w) * self.J[:, None, :] - _hat(self.J * w)
        return found

    def inertia(self, stage: Stage, x: Floats, v: Floats) -> Floats:
        """What the equations of a step have beyond M a (dofs,), N m, for an end x with the velocity v."""
        if not stage.between:
            f = (1.0 - stage.alpha_f) * self.gyroscopic(v)
            return f + stage.alpha_f * self.gyroscopic(stage.start.v) if stage.alpha_f else f
        half, w0, w1 = 0.5 * x[self.where], stage.start.v[self.where], v[self.where]
        found = np.zeros(len(x))
        change = _turned(half, self.J * w1) - _turned(-half, self.J * w0) - self.J * (w1 - w0)
        found[self.where] = change / stage.step
        return found

    def tangent(self, stage: Stage, x: Floats, v: Floats) -> Floats:
        """Its derivative by the end of the step (n, 3, 3)."""
        if not stage.between:
            return (1.0 - stage.alpha_f) * stage.B * self.slopes(v)
        half, w0, w1 = 0.5 * x[self.where], stage.start.v[self.where], v[self.where]
        rotated = stage.B * (_exponential(half) - np.eye(3)) * self.J[:, None, :]
        ahead = _exponential(half) @ _hat(self.J * w1) @ _jacobian(half)
        behind = _exponential(-half) @ _hat(self.J * w0) @ _jacobian(-half)
        found: Floats = (rotated - 0.5 * (ahead + behind)) / stage.step
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
        return Past(replace(now, x=self.chart.rebase(now.x)), before)


def _cross(a: Floats, b: Floats) -> Floats:
    """a x b (n, 3)."""
    found = np.empty_like(a)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        found[:, i] = a[:, j] * b[:, k] - a[:, k] * b[:, j]
    return found


def _hat(v: Floats) -> Floats:
    """Matrices (n, 3, 3) of v x."""
    found = np.zeros((len(v), 3, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        found[:, k, j], found[:, j, k] = v[:, i], -v[:, i]
    return found


def _series(theta: Floats) -> tuple[Floats, Floats, Floats]:
    """sin t / t, (1 - cos t) / t^2 and (t - sin t) / t^3 for t = |theta|, each (n, 1, 1)."""
    m = np.einsum("ni,ni->n", theta, theta)[:, None, None]
    t = np.sqrt(np.maximum(m, 1e-2))  # below, what is left out of each series is below rounding
    near = m < 1e-2
    s = np.where(near, 1 - m / 6 * (1 - m / 20 * (1 - m / 42 * (1 - m / 72))), np.sin(t) / t)
    p = np.where(near, 0.5 * (1 - m / 12 * (1 - m / 30 * (1 - m / 56 * (1 - m / 90)))), (1 - np.cos(t)) / t**2)
    r = np.where(near, (1 - m / 20 * (1 - m / 42 * (1 - m / 72 * (1 - m / 110)))) / 6, (t - np.sin(t)) / t**3)
    return s, p, r


def _exponential(theta: Floats) -> Floats:
    """Rotation matrices (n, 3, 3) of rotation vectors (n, 3)."""
    s, p, _ = _series(theta)
    T = _hat(theta)
    found: Floats = np.eye(3) + s * T + p * (T @ T)
    return found


def _jacobian(theta: Floats) -> Floats:
    """The right Jacobian (n, 3, 3): exp(theta + d) = exp(theta) exp(J d)."""
    _, p, r = _series(theta)
    T = _hat(theta)
    found: Floats = np.eye(3) - p * T + r * (T @ T)
    return found


def _turned(theta: Floats, v: Floats) -> Floats:
    """exp(theta) v (n, 3)."""
    found: Floats = np.einsum("nij,nj->ni", _exponential(theta), v)
    return found
