"""Mechanical system as integrators use it: support motion, accelerations, and solution of implicit steps."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np

from softmark.solvers.dynamics.critical_time_step import CriticalStepTracker
from softmark.solvers.dynamics.damping import Damping
from softmark.solvers.dynamics.dynamic_forces import DynamicForces
from softmark.solvers.dynamics.dynamic_problem import DirectStepSolver, Dynamics, StepLinearSolver
from softmark.solvers.dynamics.implicit_newton import ImplicitStepNewton, StepOutcome
from softmark.solvers.dynamics.integrator import ImplicitStepFormula, Motion, StepFailed
from softmark.solvers.dynamics.lagged_tangent import LaggedTangentSolver, allows_lagged_tangent
from softmark.solvers.energies.energy import Floats, Ints
from softmark.solvers.linear.factorisations import Factor, Singular, factor

SMALL = 500  # unknowns below which SuperLU is as quick
REPEATS = 8  # largest number of solutions of a step, each with the damping matrix of the state found before
DRAG = 10.0  # times the tolerance: accepted error of the damping force, relative to the largest force
UNSETTLED = 1e-4  # of the largest force: a step whose damping force still changes by more than this fails
BLUR = 16.0  # times the rounding error of the damping force: smaller changes are ignored
SAME = 1e-8  # relative: loads that differ by less count as equal


def _make_linear_solver(forces: DynamicForces) -> StepLinearSolver:
    """Return a linear solver: Cholesky with conjugate gradients for large conservative problems, else a general one."""
    meets = forces.impact is not None and bool(forces.impact.meets)  # their sparsity pattern changes
    if meets or not forces.conservative or len(forces.free) < SMALL:
        return DirectStepSolver(forces.conservative)
    from softmark.solvers.linear.recycled_solves import LinearSolver as Repeated

    return Repeated()


class DynamicSystem:
    """Dynamic problem prepared for time integration with steps of at most `step`, s."""

    def __init__(self, problem: Dynamics, step: float) -> None:
        self.problem, self.step = problem, step
        self.forces = DynamicForces(problem)
        self.damping = Damping(self.forces, problem.damping, problem.direction)
        self.linear: StepLinearSolver = problem.linear or _make_linear_solver(self.forces)
        self.newton = ImplicitStepNewton(self)
        self.lagged = self._make_lagged_solver() if problem.lagged and not problem.integrator.explicit else None
        self.outcome = StepOutcome()  # of the last step; an explicit one has nothing to solve
        self.longest = np.inf  # s, longest stable step of an explicit integrator in the present state
        self.swing = 0.0  # for explicit integrators: relative energy oscillation of the fastest mode

    def _make_lagged_solver(self) -> LaggedTangentSolver | None:
        """Solver with lagged tangents; None if the forces do not allow it."""
        try:
            return LaggedTangentSolver(self) if allows_lagged_tangent(self.forces) else None
        except ValueError:  # a degree of freedom without stiffness or mass
            return None

    @cached_property
    def frequencies(self) -> CriticalStepTracker:
        """Tracker of the largest frequency of the body, for explicit integrators."""
        return CriticalStepTracker(self.forces, self.problem.damping)

    def start(self) -> Motion:
        """Return the motion at time 0, with the acceleration that balances its forces. Raises StepFailed."""
        problem = self.problem
        if problem.turning is not None:
            problem.turning.reset()
        x = self.with_supports_at_time(problem.rest.astype(np.float64), 0.0)
        if problem.remembering is not None:
            problem.remembering.reset(self.forces, x)
        v = problem.velocity.astype(np.float64)
        v[self.forces.fixed] = self.support_velocity(0.0)
        self.damping.compute_matrix(x)
        factors = self.forces.factors(0.0)
        g = self.forces.at(x, factors).total + self.damping.force(v)
        if problem.turning is not None:
            g += problem.turning.gyroscopic(v)
        return Motion(0.0, x, v, self.acceleration(g, 0.0), factors)

    # ------------------------------------------------------------------ supports

    @cached_property
    def _has_moving_supports(self) -> bool:
        """True if supports move."""
        return self.problem.has_moving_supports

    def with_supports_at_time(self, x: Floats, time: float) -> Floats:
        """Return the state x with the supports at their positions at a time, s."""
        if self._has_moving_supports:
            fixed = self.forces.fixed
            x = x.copy()
            x[fixed] = self.problem.rest[fixed] + self._support_increments(time)
            if len(self._rotating_support_rows) and (since := self._rotation_reference_time) is not None:
                x[fixed[self._rotating_support_rows]] -= self._support_increments(since)[self._rotating_support_rows]
        return x

    @property
    def _rotation_reference_time(self) -> float | None:
        """Time, s, since which the rotation unknowns count rotations.

        None if rotations simply add, as about a fixed axis.
        """
        return None if self.problem.turning is None else self.problem.turning.since

    @cached_property
    def _rotating_support_rows(self) -> Ints:
        """Indices (k,) of the fixed degrees of freedom that are rotations, if supports rotate."""
        turning, moved = self.problem.turning, np.flatnonzero(self.problem.target)
        found: Ints = np.flatnonzero(np.isin(self.forces.fixed, [] if turning is None else turning.where))
        return found[np.isin(found, moved)]

    def support_velocity(self, time: float) -> Floats | float:
        """Return the velocity (c,) of the supports, m/s."""
        if not self._has_moving_supports:
            return 0.0
        if self.problem.way is not None:
            return (self._support_increments(time + self.step) - self._support_increments(time - self.step)) / (
                2.0 * self.step
            )
        amplitude, h = self.problem.support_amplitude.at, self.step
        return (amplitude(time + h) - amplitude(time - h)) / (2.0 * h) * self.problem.target

    def support_acceleration(self, time: float) -> Floats | float:
        """Return the acceleration (c,) of the supports, m/s^2; a kink of their amplitude is spread over a step."""
        if not self._has_moving_supports:
            return 0.0
        if self.problem.way is not None:
            at, h = self._support_increments, self.step
            return (at(time + h) - 2.0 * at(time) + at(time - h)) / h**2
        amplitude, h = self.problem.support_amplitude.at, self.step
        return (amplitude(time + h) - 2.0 * amplitude(time) + amplitude(time - h)) / h**2 * self.problem.target

    def _support_increments(self, time: float) -> Floats:
        """Return the prescribed support increments (c,) at a time."""
        return self.problem.imposed(self.problem.support_amplitude.at(time))

    # ------------------------------------------------------------------ accelerations

    def acceleration(self, g: Floats, time: float) -> Floats:
        """Return the accelerations a (dofs,), with M a = -g on free degrees of freedom, and those of the supports.

        g (dofs,), N, is the energy gradient plus damping forces. Raises StepFailed.
        """
        forces, a = self.forces, np.zeros_like(g)
        a[forces.fixed] = self.support_acceleration(time)
        if forces.lumped is not None:
            a[forces.free] = -g[forces.free] / forces.lumped[forces.free]
        else:
            a[forces.free] = -self._factorised_mass.solve((g + forces.M @ a)[forces.free])
        if not np.all(np.isfinite(a)):
            raise StepFailed("forces or accelerations are not finite")
        return a

    @cached_property
    def _factorised_mass(self) -> Factor:
        """Factorised mass matrix. Raises ValueError if it is singular."""
        try:
            return factor(self.forces.M_free)
        except Singular as error:
            raise ValueError("the mass matrix is singular") from error

    def accelerations_of_forces(self, f: Floats) -> Floats:
        """Return the accelerations (dofs,), m/s^2, of free degrees of freedom under forces f (dofs,), N."""
        free, a = self.forces.free, np.zeros_like(f)
        a[free] = (
            f[free] / self.forces.lumped[free]
            if self.forces.lumped is not None
            else self._factorised_mass.solve(f[free])
        )
        return a

    def with_load_factors(self, motion: Motion, factors: Floats) -> Motion:
        """Return the same motion with the accelerations that it has under loads with `factors` (l,)."""
        change = factors - motion.factors
        if not np.any(np.abs(change) > SAME * np.maximum(np.abs(factors), np.abs(motion.factors))):
            return motion
        a, free = motion.a.copy(), self.forces.free
        f = self.forces.load_gradient(motion.x, -change)[free]
        a[free] += f / self.forces.lumped[free] if self.forces.lumped is not None else self._factorised_mass.solve(f)
        return replace(motion, a=a, factors=factors)

    def final_acceleration_and_velocity(
        self, now: Motion, x: Floats, half: Floats, time: float, factors: Floats
    ) -> tuple[Floats, Floats]:
        """Return acceleration and velocity at the end of an explicit step, at `time`, s, in the state x.

        `half` is the velocity in the middle of the step, and `factors` (l,) are the load factors at its end.
        """
        h, alpha, fixed = time - now.time, self.problem.damping.alpha, self.forces.fixed
        g = self.forces.at(x, factors).total
        if self.problem.damping.beta:
            g = g + self.damping.force(half) - alpha * (self.forces.M @ half)
        a = self.acceleration(g, time)
        if (turning := self.problem.turning) is not None and self.forces.lumped is not None:
            a = turning.final_acceleration(half, a, self.forces.lumped, h, alpha)
        v = (half + 0.5 * h * a) / (1.0 + 0.5 * alpha * h)
        a = a - alpha * v
        a[fixed], v[fixed] = self.support_acceleration(time), self.support_velocity(time)
        return a, v

    # ------------------------------------------------------------------ implicit steps

    def solve(self, stage: ImplicitStepFormula) -> Motion:
        """Return the motion at the end of an implicit step. Raises StepFailed.

        The damping matrix is that of the state to which the damping velocity belongs.
        """
        if not self.problem.damping.beta or self.problem.cap is not None:
            return self._solve_with_present_damping(stage)
        motion = self._solve_with_updated_damping(stage)
        if not (
            stage.alpha_f or stage.secant or stage.mean
        ):  # the energy ledger computes the dissipated energy from the mean velocity
            self.damping.compute_matrix(0.5 * (stage.start.x + motion.x))
        return motion

    def _solve_with_updated_damping(self, stage: ImplicitStepFormula) -> Motion:
        """Return the end of a step with the damping matrix of its own end state. Raises StepFailed."""
        self.damping.predict_matrix(stage)
        enough = DRAG * self.problem.tolerance
        for _ in range(REPEATS):
            motion = self._solve_with_present_damping(stage)
            off = self.damping.update(stage, motion)
            noise = BLUR * self.damping.rounding(stage.damping_velocity(motion.x, motion.v))
            if off <= max(enough * self.newton.scale, noise):
                return motion
        if off > max(enough, UNSETTLED) * self.newton.scale:
            raise StepFailed("the iteration between the damping matrix and the state does not converge")
        return motion

    def _solve_with_present_damping(self, stage: ImplicitStepFormula) -> Motion:
        """Return the end of an implicit step with the present damping matrix. Raises StepFailed."""
        found = self.lagged.solve(stage) if self.lagged else None
        motion, self.outcome = found or self.newton.solve(stage)
        return motion
