"""Implicit steps with one factorisation each: a tangent whose stresses are taken from earlier states.

The end of a step is extrapolated, and one tangent is factorised there in single precision. It serves all iterations
(the chord method, Ortega and Rheinboldt 1970, section 7.1), accelerated by Anderson's method (1965; Walker and Ni
2011). The convergence criterion is that of Newton's method, so results agree to the tolerance. Steps that do not
converge are solved by Newton's method.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, TypeGuard

import numpy as np

from softmark.solvers.dynamics.dynamic_forces import DynamicForces, EnergyGradients
from softmark.solvers.dynamics.implicit_newton import ImplicitStepEquations, StepOutcome, TrialStepEnd
from softmark.solvers.dynamics.integrator import ImplicitStepFormula, Motion
from softmark.solvers.energies.energy import Energy, Floats, LaggedTangentEnergy

if TYPE_CHECKING:
    from softmark.solvers.dynamics.dynamic_system import DynamicSystem

ORDER = 5  # highest order of extrapolation
MOST = 14  # iterations
POOR = 0.6  # mean residual reduction per iteration above which Newton's method is faster
PAUSE = 64  # largest number of steps left to Newton's method after failures


def have_lagged_tangents(energies: Sequence[Energy]) -> TypeGuard[tuple[LaggedTangentEnergy, ...]]:
    """Return whether all of these energies have a lagged tangent."""
    return all(isinstance(e, LaggedTangentEnergy) for e in energies)


def allows_lagged_tangent(forces: DynamicForces) -> bool:
    """Return whether these forces allow lagged tangents: a potential, lagged internal energies, dead loads."""
    dead = all(not load.stencils.size for load in forces.loads)
    return (
        forces.conservative
        and dead
        and forces.impact is None
        and bool(forces.internal)
        and have_lagged_tangents(forces.internal)
    )


class LaggedTangentSolver:
    """Solver of implicit steps by lagged tangents; it stores the preceding states."""

    def __init__(self, system: DynamicSystem) -> None:
        from softmark.solvers.linear.symbolic_cache import cached_plan
        from softmark.solvers.sparse.sparse_cholesky import Cholesky

        self.system, self.forces = system, system.forces
        pattern = self.forces.pattern
        self.data = np.zeros(len(pattern.indices))
        self.cholesky = Cholesky(cached_plan(pattern.matrix(self.data)), "single")
        self.states = BackwardDifferences(ORDER, self.forces.dofs)
        self.failures = 0  # number of failed attempts
        self._traces: list[Floats] = []  # lagged values of the last two accepted states, latest first
        self._pending: tuple[Floats, Floats] | None = None  # the last solution and its traces
        self._rest = self._pause = 0

    @property
    def energies(self) -> tuple[LaggedTangentEnergy, ...]:
        """Internal energies."""
        internal = self.forces.internal
        assert have_lagged_tangents(internal)
        return internal

    def solve(self, stage: ImplicitStepFormula) -> tuple[Motion, StepOutcome] | None:
        """Return the end of the step; None if Newton's method must solve it."""
        self._record_accepted_state(stage)
        if self._rest:
            self._rest -= 1
            return None
        balance = LaggedStepEquations(self, stage, self._extrapolate_traces())
        found = self._solve_by_chord_iteration(balance, self._predict_end(stage, balance.end))
        if found is None or not self.system.problem.sound(found[0].x):
            self._count_failure()
            return None
        trial, outcome = found
        self._pause = 0
        self._pending = trial.x, balance.now
        self.system.newton.scale = trial.scale
        return balance.motion(trial), outcome

    def _count_failure(self) -> None:
        """Count a failure, and leave more and more of the following steps to Newton's method."""
        self.failures += 1
        self._pending = None
        self._rest, self._pause = self._pause, min(PAUSE, 2 * self._pause + 1)

    # ------------------------------------------------------------------ preceding states

    def _record_accepted_state(self, stage: ImplicitStepFormula) -> None:
        """Record the start of a step as the last accepted state."""
        start = stage.start
        if self.states.latest is start.x:
            return
        known = self._pending is not None and self._pending[0] is start.x
        self.states.add(start.x, start.time)
        if known and self._pending is not None:
            self._traces = [self._pending[1], *self._traces[:1]]
        else:
            traces = np.empty(sum(e.lagged_size for e in self.energies))
            self.add_forces_and_traces(start.x, np.zeros(self.forces.dofs), traces)
            self._traces = [traces]
        self._pending = None

    def add_forces_and_traces(self, x: Floats, g: Floats, traces: Floats) -> None:
        """Add the internal forces to g and write the lagged values to `traces`."""
        begin = 0
        for energy in self.energies:
            energy.add_gradient_and_lagged(x, g, traces[begin : begin + energy.lagged_size])
            begin += energy.lagged_size

    def _extrapolate_traces(self) -> Floats:
        """Return the lagged values extrapolated to the end of the step."""
        last = self._traces[0]
        return 2.0 * last - self._traces[1] if len(self._traces) > 1 else last

    def _predict_end(self, stage: ImplicitStepFormula, end: float) -> Floats:
        """Return the extrapolated end of the step; with too few equal steps before it, for constant velocity."""
        now = stage.start
        x = self.states.next(stage.step)
        if x is None:
            x = now.x + stage.step * now.v
        fixed = self.forces.fixed
        if len(fixed):
            x[fixed] = self.system.with_supports_at_time(now.x, end)[fixed]
        return x

    # ------------------------------------------------------------------ iteration

    def _solve_by_chord_iteration(
        self, balance: LaggedStepEquations, x: Floats
    ) -> tuple[TrialStepEnd, StepOutcome] | None:
        """Return the solution of a step by accelerated chord iterations from x; None if they do not converge."""
        from softmark.solvers.sparse.sparse_cholesky import Indefinite

        problem, free = self.system.problem, self.forces.free
        trial, before, first, mixer = balance.trial(x), np.inf, 0.0, AndersonAcceleration()
        for number in range(MOST + 1 if problem.cap is None else problem.cap + 1):
            scale = max(trial.scale, self.system.newton.scale)
            residual = trial.size / scale if scale else trial.size
            if not math.isfinite(residual):
                return None
            solved = balance.has_converged(trial, scale, before)
            if solved or number == problem.cap:
                return trial, StepOutcome(number, residual, solved, True)
            first = first or residual
            if number == MOST or (number >= 4 and residual > POOR**number * first):
                return None
            if number == 0:
                try:
                    self.cholesky.factorise(balance.jacobian())
                except Indefinite:
                    return None
            before = trial.size
            x = trial.x.copy()
            x[free] += mixer.step(self.cholesky.solve(trial.r))
            trial = balance.trial(x)
        return None


class LaggedStepEquations(ImplicitStepEquations):
    """Equations of a step whose first force evaluation also computes the lagged tangent."""

    def __init__(self, lagged: LaggedTangentSolver, stage: ImplicitStepFormula, traces: Floats) -> None:
        super().__init__(lagged.system, stage)
        self.lagged, self.traces, self.now = lagged, traces, np.empty_like(traces)
        self._fresh = True
        self._external = self.forces.load_gradient(stage.start.x, self.factors)

    def force(self, x: Floats) -> EnergyGradients:
        """Return the weighted forces of the step for the end x."""
        internal, y = np.zeros(self.forces.dofs), self.weighted_state(x)
        if self._fresh:
            self._add_forces_and_tangent(y, internal)
        else:
            self.lagged.add_forces_and_traces(y, internal, self.now)
        return EnergyGradients(internal, self._external)

    def _add_forces_and_tangent(self, y: Floats, internal: Floats) -> None:
        """Add internal forces in the state y to `internal`, and compute the lagged tangent."""
        self._fresh, data, begin = False, self.lagged.data, 0
        data[:] = 0.0
        for energy, slots in zip(self.lagged.energies, self.forces.pattern.slots, strict=False):
            energy.add_both_lagged(y, internal, data, slots, self.traces[begin : begin + energy.lagged_size])
            begin += energy.lagged_size

    def jacobian(self) -> Floats:
        """Return dr/dx at the first force evaluation, in the shared pattern (nnz,)."""
        data, stage, damping = self.lagged.data, self.stage, self.system.damping
        if self.share != 1.0:
            data *= self.share
        self.forces.add_mass(data, (1.0 - stage.alpha_m) * stage.A)
        if damping.active:
            data += self.share * stage.B * damping.data
        return data


class BackwardDifferences:
    """Backward differences of states at equal steps; extrapolation with the order that fits the last state best."""

    def __init__(self, order: int, size: int) -> None:
        self.table, self._old = np.zeros((2, order + 2, size))
        self.count = 0  # rows in use
        self.step = self.time = 0.0
        self.latest: Floats | None = None

    def add(self, x: Floats, time: float) -> None:
        """Add the next accepted state; a step of another length restarts the table with the last state."""
        step = time - self.time
        if not _are_equal_steps(step, self.step):
            self.count = min(self.count, 1)
        self.table, self._old = self._old, self.table
        self.table[0] = x
        count = min(self.count + 1, len(self.table))
        for k in range(1, count):
            np.subtract(self.table[k - 1], self._old[k - 1], out=self.table[k])
        self.count, self.step, self.time, self.latest = count, step, time, x

    def next(self, step: float) -> Floats | None:
        """Return the state extrapolated over one more step, or None.

        It is None if fewer than three states at this step length are known. Newton's formula is used: the sum of the
        differences up to an order. The next difference is the error of that order at the last state.
        """
        if self.count < 3 or not _are_equal_steps(step, self.step):
            return None
        missed = np.einsum("kn,kn->k", self.table[1 : self.count], self.table[1 : self.count])
        x: Floats = self.table[: int(np.argmin(missed)) + 1].sum(axis=0)
        return x


def _are_equal_steps(step: float, other: float) -> bool:
    """Return whether two step lengths are equal up to rounding of times."""
    return abs(step - other) <= 1e-6 * step


class AndersonAcceleration:
    """Anderson acceleration (1965; Walker and Ni 2011) of x <- x - z(x), of depth two."""

    def __init__(self) -> None:
        self.steps: list[Floats] = []
        self.changes: list[Floats] = []  # of z
        self.z = np.zeros(0)

    def step(self, z: Floats) -> Floats:
        """Return the accelerated increment of x, from the present z(x)."""
        d = -z
        if self.steps:
            self.changes = [z - self.z, *self.changes[:1]]
            for factor, change, step in zip(self._combination_coefficients(z), self.changes, self.steps, strict=False):
                d -= factor * (step - change)
        self.z, self.steps = z, [d, *self.steps[:1]]
        return d

    def _combination_coefficients(self, z: Floats) -> list[float]:
        """Return the coefficients of the combination of changes nearest to z, by normal equations."""
        p = self.changes[0]
        pp, pz = float(p @ p), float(p @ z)
        if pp == 0.0:
            return []
        if len(self.changes) > 1:
            q = self.changes[1]
            qq, pq, qz = float(q @ q), float(p @ q), float(q @ z)
            det = pp * qq - pq * pq
            if det > 1e-12 * pp * qq:
                return [(qq * pz - pq * qz) / det, (pp * qz - pq * pz) / det]
        return [pz / pp]
