"""Error of a reduced model, from the residual of its states in the equations of the full model.

In statics the displacement error is estimated by one Newton step of the full equations from the reduced state. In
dynamics the error solves the equation M e'' + C e' + K e = -R(t), which is the full equation linearised about the
reduced motion; in linear problems this is exact. The error equation is integrated with the trapezoidal rule over the
output times.
Source: Ainsworth and Oden (2000), "A Posteriori Error Estimation in Finite Element Analysis", chapter 9; for reduced
models Hesthaven, Rozza and Stamm (2016), "Certified Reduced Basis Methods", section 4.2.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from scipy import linalg as dense

from softmark.records import dataclass
from softmark.solvers.dynamics.dynamic_forces import DynamicForces
from softmark.solvers.dynamics.dynamic_problem import Dynamics
from softmark.solvers.energies.energy import Floats
from softmark.solvers.linear.factorisations import Factor, Singular, factor

if TYPE_CHECKING:
    from softmark.solvers.statics.static_problem import Statics

LARGEST = 300_000  # unknowns up to which a tangent is factorised
TANGENTS = 60  # factorisations in the course of a motion
NUDGE = 1e-7  # relative to the body's displacement or size: difference step for stiffness times velocity


@dataclass(frozen=True)
class ReductionError:
    """Residual of the full equations in the states of a reduced model, and the estimated displacement error.

    `residual` is relative to the largest of the balancing forces. `distance` is the largest estimated displacement
    error of a node, m, and `relative` is `distance` over the largest displacement. Both are None if they are unknown.
    """

    residual: float
    relative: float | None = None
    distance: float | None = None

    @property
    def facts(self) -> dict[str, float | None]:
        """Entries of the report, by name."""
        return {
            "full_residual": self.residual, "estimated_error": self.relative, "estimated_error_m": self.distance
        }  # fmt: skip


def _largest_displacement(u: Floats) -> float:
    """Return the largest displacement of a node, m, from displacements u (3 n,)."""
    return float(np.linalg.norm(u.reshape(-1, 3), axis=1).max(initial=0.0))


def _relative_error(distance: float, size: float) -> float:
    if size > 0.0:
        return min(distance / size, 1e9)
    return 0.0 if distance == 0.0 else 1e9


# ------------------------------------------------------------------ at rest


def static_error(problem: Statics, x: Floats) -> ReductionError:
    """Return the error of a reduced model's state x (dofs,), m, in the full static `problem`."""
    assembly = problem.assembly
    g, loads = assembly.gradient(x, 1.0), np.zeros_like(x)
    for load in assembly.loads:
        load.add_gradient(x, loads)
    free = assembly.free
    scale = max(float(np.linalg.norm(loads)), float(np.linalg.norm(g[problem.fixed])))
    left = float(np.linalg.norm(g[free]))
    residual = left / scale if scale else left
    if len(free) > LARGEST or not math.isfinite(residual):
        return ReductionError(residual)
    step = np.zeros_like(x)
    try:
        step[free] = factor(assembly.tangent(x, 1.0), symmetric=assembly.conservative).solve(-g[free])
    except Singular:
        return ReductionError(residual)
    distance = _largest_displacement(step)
    if not math.isfinite(distance):
        return ReductionError(residual)
    return ReductionError(residual, _relative_error(distance, _largest_displacement(x)), distance)


# ------------------------------------------------------------------ in motion


@dataclass(frozen=True)
class ReducedMotion:
    """States of a reduced model at t times, s: unknowns, velocities and accelerations (t, r).

    `fields` (dofs, r) are the displacement fields that the unknowns multiply.
    """

    fields: Floats
    times: Floats
    q: Floats
    v: Floats
    a: Floats


def dynamic_error(full: Dynamics, reduced: Dynamics, motion: ReducedMotion) -> ReductionError:
    """Return the error of a motion of the reduced model in the full dynamic problem, over all output times.

    `full` and `reduced` are the equations of motion of the two models.
    """
    return _ErrorEquation(full, reduced, motion).integrate()


class _ErrorEquation:
    """Linearised equation of motion of the displacement error, integrated in time."""

    def __init__(self, full: Dynamics, reduced: Dynamics, motion: ReducedMotion) -> None:
        self.full, self.reduced, self.motion = full, reduced, motion
        self.forces, self.own = DynamicForces(full), DynamicForces(reduced)
        self.free = self.forces.free
        self.every = max(1, math.ceil(len(motion.times) / TANGENTS))
        self.M = self.K = self.C = self.forces.M_free
        self.solver: Factor | None = None
        self.step = 0.0
        self.scale = 0.0

    def integrate(self) -> ReductionError:
        """Return the largest error over all times."""
        motion, V = self.motion, self.motion.fields
        residual, distance, size = 0.0, 0.0, 0.0
        e = np.zeros(len(self.free))
        w = (self.full.velocity - V @ motion.v[0])[self.free] if len(motion.v) else e
        before, known = np.zeros_like(e), len(self.free) <= LARGEST
        for i, time in enumerate(motion.times):
            x = V @ motion.q[i]
            R = self._out_of_balance_forces(i, x)
            residual, size = max(residual, float(np.linalg.norm(R))), max(size, _largest_displacement(x))
            if i and known:
                try:
                    e, w = self._advance_error(i, float(time - motion.times[i - 1]), x, e, w, before + R)
                except Singular:
                    known = False
                whole = np.zeros_like(x)
                whole[self.free] = e
                distance = max(distance, _largest_displacement(whole))
                known = known and math.isfinite(distance)
            before = R
        relative = residual / self.scale if self.scale else residual
        if not known:
            return ReductionError(relative)
        return ReductionError(relative, _relative_error(distance, size), distance)

    def _advance_error(self, i: int, h: float, x: Floats, e: Floats, w: Floats, R: Floats) -> tuple[Floats, Floats]:
        """Return the error and its velocity after a trapezoidal step of h, s.

        e and w are their values before the step. R is the sum of the residuals at both ends of the step, N.
        """
        if self.solver is None or (i - 1) % self.every == 0 or abs(h - self.step) > 1e-9 * h:
            factors = self.forces.factors(float(self.motion.times[i]))
            self.K = self.forces.tangent(x, factors, projected=True)
            damping = self.full.damping
            self.C = damping.alpha * self.M + damping.beta * self.K
            S = (4.0 / h**2 * self.M + 2.0 / h * self.C + self.K).tocsr()
            self.solver, self.step = factor(S, symmetric=self.forces.conservative), h
        M, C, K = self.M, self.C, self.K
        right = 4.0 / h**2 * (M @ e) + 2.0 / h * (C @ e) - K @ e + 4.0 / h * (M @ w) - R
        found = self.solver.solve(right)
        return found, 2.0 / h * (found - e) - w

    def _out_of_balance_forces(self, i: int, x: Floats) -> Floats:
        """Return the out-of-balance forces of the full equations at output time i, N, shape (free,).

        The acceleration is computed from the reduced equations in that state, because integrators may store the
        acceleration of another time.
        """
        motion, V, time = self.motion, self.motion.fields, float(self.motion.times[i])
        q, v, a = motion.q[i], motion.v[i], motion.a[i].copy()
        own = self.own
        held = np.zeros_like(a)
        held[own.fixed] = a[own.fixed]
        pull = own.at(q, own.factors(time)).total + self._damping_forces(own, q, v) + own.inertia(held)
        a[own.free] = dense.solve(own.M_free.toarray(), -pull[own.free], assume_a="pos")
        forces = self.forces
        force, inertia = forces.at(x, forces.factors(time)), forces.inertia(V @ a)
        whole = inertia + self._damping_forces(forces, x, V @ v) + force.total
        each = (inertia[self.free], force.internal, force.external[self.free])
        self.scale = max(self.scale, *(float(np.linalg.norm(f)) for f in each))
        return np.asarray(whole[self.free])

    def _damping_forces(self, forces: DynamicForces, x: Floats, v: Floats) -> Floats:
        """Return the damping forces alpha M v + beta K v, N, shape (dofs,); K v is a difference of internal forces."""
        damping = self.full.damping
        drag = damping.alpha * forces.inertia(v)
        speed = float(np.abs(v).max(initial=0.0))
        if damping.beta and speed > 0.0:
            t = NUDGE * max(float(np.abs(x).max(initial=0.0)), NUDGE) / speed
            drag = drag + damping.beta / (2.0 * t) * (forces.within(x + t * v) - forces.within(x - t * v))
        return np.asarray(drag)
