"""Newton's method for the end of an implicit time step.

Under conservative forces the equations of a step are those of a minimum of the incremental potential (Ortiz and
Stainier 1999): inertia and damping are a quadratic function of the end of the step, and forces have a potential. Full
Newton steps that reduce the residual strongly are accepted. Other steps must reduce the potential, or under follower
loads the residual. If the tangent gives no descent direction, the positive definite one is used.

With pressures and normals of an earlier iterate friction has an energy, so the step is again a minimum (Kaufman et al.
2008; Li et al. 2020, section 5.4). Its solution gives new pressures, which change little between iterates, because
inertia keeps nodes in place. If the pressures do not converge, the step fails and is halved.
"""

from __future__ import annotations

import math
from copy import copy
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse

from softmark.records import dataclass
from softmark.solvers.dynamics.dynamic_forces import EnergyGradients
from softmark.solvers.dynamics.integrator import ImplicitStepFormula, Motion, StepFailed
from softmark.solvers.energies.energy import Floats
from softmark.solvers.linear.factorisations import Singular

if TYPE_CHECKING:
    from softmark.solvers.dynamics.dynamic_contact import ContactsAtTime
    from softmark.solvers.dynamics.dynamic_system import DynamicSystem

EPS = float(np.finfo(np.float64).eps)
MUCH = 0.25  # of the residual: a full step that reduces it below this is accepted without computing the potential
WORSE = 1.25  # times the residual of the best prediction when all were tried: above it all are tried again
LESS = 0.97  # factor of that limit per step, so that all predictions are tried again from time to time
CYCLE = 6  # iterations without a smaller residual: Newton's method cycles between states
FLAT = 1e-6  # relative residual below which energy differences, its square, are rounding errors
SHORTEST = 1e-5  # shortest fraction of a Newton step that is tried
LAGS = 40  # largest number of friction iterations
ROUGH, FINER = 1e-2, 0.05  # tolerance of a friction iterate: upper limit, and relative to the last residual


@dataclass(frozen=True)
class StepIteration:
    """Newton iteration of the step that ends at `time`, s: the relative residual after a step of relative `length`."""

    time: float
    step: float
    number: int
    residual: float
    length: float


@dataclass(frozen=True)
class StepOutcome:
    """Result of solving a step: number of linear systems, relative residual, whether it meets the tolerance."""

    iterations: int = 0
    residual: float = 0.0
    solved: bool = True
    lagged: bool = False  # solved with one lagged tangent, not by Newton's method


class ImplicitStepNewton:
    """Newton solver of implicit steps; it stores all iterations and the force scale of the last accepted step."""

    def __init__(self, system: DynamicSystem) -> None:
        self.system = system
        self.history: list[StepIteration] = []
        self.scale = 0.0
        self.way = 2, 0.0  # index of the best prediction when all were tried, and its relative residual

    def solve(self, stage: ImplicitStepFormula) -> tuple[Motion, StepOutcome]:
        """Return the motion at the end of the step. Raises StepFailed."""
        balance = ImplicitStepEquations(self.system, stage)
        trial, outcome = self._solve_friction(balance) if balance.has_friction else self._solve_by_newton(balance)
        self.scale = trial.scale
        return balance.motion(trial), outcome

    def _solve_friction(self, balance: ImplicitStepEquations) -> tuple[TrialStepEnd, StepOutcome]:
        """Return the solution of a step with friction at its own pressures.

        Raises StepFailed if the pressures do not converge.
        """
        touches, impact, start = balance.touches, self.system.forces.impact, balance.stage.start
        assert touches is not None and impact is not None  # noqa: PT018
        known, x, residual, count = touches.lagged(start.x, impact.at(start.time)), None, 1.0, 0
        for _ in range(LAGS):
            goal = max(balance.tolerance, min(ROUGH, FINER * residual))
            trial, outcome = self._solve_by_newton(balance.with_friction_of(known, goal), x)
            own, x = balance.trial(trial.x), trial.x
            scale, count = max(own.scale, self.scale), count + outcome.iterations
            residual = own.size / scale if scale else own.size
            if balance.has_converged(own, scale, own.size):
                return own, StepOutcome(count, residual, True)
            known = touches.lagged(x)
        raise StepFailed(f"the friction iteration does not converge; its residual is {residual:.1e}")

    def _solve_by_newton(
        self, balance: ImplicitStepEquations, x: Floats | None = None
    ) -> tuple[TrialStepEnd, StepOutcome]:
        """Return the solution of the equations of a step by Newton's method from x. Raises StepFailed."""
        most, cap = self.system.problem.max_iterations, self.system.problem.cap
        trial, before, length = balance.start() if x is None else balance.trial(x), np.inf, 0.0
        least, best, cycles = np.inf, 0, False
        for number in range((most if cap is None else cap) + 1):
            scale = max(trial.scale, self.scale)
            residual = trial.size / scale if scale else trial.size
            self.history.append(StepIteration(balance.end, balance.stage.step, number, residual, length))
            if not math.isfinite(residual):
                raise StepFailed("the forces are not finite")
            solved = balance.has_converged(trial, scale, before)
            if solved or number == cap:
                return trial, StepOutcome(number, residual, solved)
            if residual < least:
                least, best = residual, number
            cycles = cycles or (number - best >= CYCLE and least < FLAT)
            if number < most or cap is not None:
                before = trial.size
                try:
                    trial, length = balance.next_trial(trial, scale, cycles)
                except StepFailed:
                    if not balance.is_rounding_error(trial):
                        raise
                    return trial, StepOutcome(number, residual, True)
        raise StepFailed(f"the residual is {residual:.1e} after {most} Newton iterations")


@dataclass(frozen=True)
class TrialStepEnd:
    """Trial state at the end of a step, whose residual and energies are computed on request."""

    balance: ImplicitStepEquations
    x: Floats
    v: Floats
    a: Floats
    inertia: Floats
    drag: Floats

    @property
    def inertia_damping_and_past_forces(self) -> Floats:
        """Forces that are linear in x (dofs,), N: inertia, damping, and weighted forces at the start of the step."""
        return self.inertia + self.drag + self.balance.past

    @cached_property
    def force(self) -> EnergyGradients:
        """Energy gradients (dofs,), N, at the end of the step, which `steady` must balance."""
        return self.balance.force(self.x)

    @cached_property
    def potential(self) -> float:
        """Potential energy of the forces, J; only that of internal forces if the loads have none."""
        forces, x = self.balance.forces, self.balance.weighted_state(self.x)
        return forces.value(x, self.balance.factors) if forces.conservative else forces.strain(x)

    @cached_property
    def stored(self) -> float:
        """Energy of the contact barriers, J; infinite if a point has passed through a rigid body."""
        return self.balance.stored(self.x)

    @cached_property
    def contact_gradient(self) -> Floats | float:
        """Negative contact forces (dofs,), N."""
        touches = self.balance.touches
        return 0.0 if touches is None else self.balance.stage.touch * touches.gradient(self.x)

    @property
    def possible(self) -> bool:
        """True if the state is in the domain of the law, and no point has passed through a rigid body."""
        if not math.isfinite(self.stored):
            return False
        return math.isfinite(self.size if self.balance.forces.rotates_without_contact else self.potential)

    @cached_property
    def r(self) -> Floats:
        """Residual force (free,), N."""
        r: Floats = (
            self.inertia_damping_and_past_forces + self.balance.weight * self.force.total + self.contact_gradient
        )[self.balance.forces.free]
        return r

    @cached_property
    def size(self) -> float:
        """Norm of the residual, N."""
        return norm(self.r)

    @cached_property
    def scale(self) -> float:
        """Largest norm of the forces that balance each other, N; internal forces include those on supports."""
        free = self.balance.forces.free
        forces = (self.inertia[free], self.drag[free], self.force.internal, self.force.external[free])
        most = max(norm(f) for f in forces)
        return most if self.balance.touches is None else max(most, norm(np.asarray(self.contact_gradient)[free]))


def norm(f: Floats) -> float:
    """Return |f|, faster than numpy's general norm for short vectors."""
    return math.sqrt(f @ f)


class ImplicitStepEquations:
    """Equations of one implicit step: residual, incremental potential, Newton steps."""

    def __init__(self, system: DynamicSystem, stage: ImplicitStepFormula) -> None:
        self.system, self.stage, self.forces = system, stage, system.forces
        start = stage.start
        self.share = 1.0 - stage.alpha_f
        self.weight = 1.0 if stage.between else self.share  # of the forces in the residual
        self.end = start.time + stage.step
        self.time = self.end + (stage.alpha_m - stage.alpha_f) * stage.step  # of accelerations
        self.factors = stage.load.mean if stage.between else stage.load.end
        impact = self.forces.impact
        self.touches = None if impact is None else impact.at(self.end)
        self.since = [] if impact is None else impact.at(start.time).places(start.x)
        self.tolerance = system.problem.tolerance
        self.past: Floats | float = 0.0
        if stage.alpha_f and not stage.between:
            self.past = stage.alpha_f * self.forces.gradients_at_step_start(start.x, stage.load.start).total

    @property
    def has_friction(self) -> bool:
        """True if some contact has friction whose pressures are unknown."""
        return self.touches is not None and self.touches.has_friction

    def with_friction_of(self, touches: ContactsAtTime, tolerance: float) -> ImplicitStepEquations:
        """Return the equations with the friction of the contacts `touches`, solved to a relative `tolerance`."""
        other = copy(self)
        other.touches, other.tolerance = touches, tolerance
        return other

    def trial(self, x: Floats) -> TrialStepEnd:
        """Return the trial with the end state x, and its velocity and acceleration."""
        stage, system, fixed = self.stage, self.system, self.forces.fixed
        way = x - stage.coast
        a, v = stage.A * way, stage.speed + stage.B * way
        a[fixed], v[fixed] = system.support_acceleration(self.time), system.support_velocity(self.end)
        mean = (1.0 - stage.alpha_m) * a + stage.alpha_m * stage.start.a if stage.alpha_m else a
        inertia = self.forces.inertia(mean)
        if (turning := system.problem.turning) is not None:
            inertia += turning.inertia(stage, x, v)
        drag = system.damping.force(stage.damping_velocity(x, v))
        return TrialStepEnd(self, x, v, a, inertia, drag)

    def motion(self, trial: TrialStepEnd) -> Motion:
        """Return the motion at the end of the step."""
        a, v, (more_a, more_v) = trial.a, trial.v, self.stage.beyond
        if self.touches is not None and (more_a or more_v):
            c = self.system.accelerations_of_forces(-self.touches.gradient(trial.x))
            a, v = a + more_a * c, v + more_v * c
        return Motion(self.end, trial.x, v, a, self.stage.load.last)

    def stored(self, x: Floats) -> float:
        """Return the energy of the contact barriers in the end state x, J.

        It is infinite if a point has passed through a rigid body.
        """
        if self.touches is None:
            return 0.0
        return math.inf if self.touches.passed(x, self.since) else self.touches.value(x)

    def force(self, x: Floats) -> EnergyGradients:
        """Return the energy gradients (dofs,), N, for the end state x, evaluated in the weighted state."""
        return self.forces.at(self.weighted_state(x), self.factors)

    def weighted_state(self, x: Floats) -> Floats:
        """Return the state in which forces are evaluated, for the end state x."""
        return self.share * x + self.stage.alpha_f * self.stage.start.x if self.stage.between else x

    def has_converged(self, trial: TrialStepEnd, scale: float, before: float) -> bool:
        """Return whether a trial meets the tolerance, or its residual is rounding error and no longer decreases.

        `scale`, N, is the force scale, and `before`, N, the residual of the last iteration.
        """
        if trial.size <= self.tolerance * scale:
            return True
        return 0.3 * before < trial.size <= 4.0 * (self._rounding(trial.x) + self._inertia_rounding_error(trial))

    def is_rounding_error(self, trial: TrialStepEnd) -> bool:
        """Return whether the residual is only the rounding error of states, as in a body without forces."""
        free = self.forces.free
        known = np.abs(trial.x) + np.abs(self.stage.coast)
        lost = abs(self._jacobian(trial.x, False)) @ known[free]
        return trial.size <= 4.0 * EPS * norm(lost)

    def _rounding(self, x: Floats) -> float:
        """Return the norm of the rounding error in the forces, N."""
        known = self.forces.rounding(x)
        return known if self.touches is None else known + self.stage.touch * self.touches.rounding(x)

    def _inertia_rounding_error(self, trial: TrialStepEnd) -> float:
        """Return the norm of the inertia error due to rounding of x, N."""
        lost = self.forces.M @ (np.abs(trial.x) + np.abs(self.stage.coast))
        return EPS * abs(1.0 - self.stage.alpha_m) * self.stage.A * float(np.linalg.norm(lost))

    # ------------------------------------------------------------------ start

    def start(self) -> TrialStepEnd:
        """Return the best of three predictions: unchanged position, constant velocity, constant acceleration.

        The prediction follows moving supports. With a cap on iterations it is the unchanged position, as in codes that
        iterate so rarely.
        """
        now, h, fixed = self.stage.start, self.stage.step, self.forces.fixed
        stay = self.system.with_supports_at_time(now.x, self.end)
        if np.any(stay[fixed] != now.x[fixed]):
            return self._response_to_supports(stay)
        if self.system.problem.cap is not None:
            return self.trial(stay)
        coasting = now.x + h * now.v
        speeding = coasting + 0.5 * h**2 * now.a
        coasting[fixed] = speeding[fixed] = stay[fixed]
        ways = [stay, *(self._limit_before_collision(stay, x) for x in (coasting, speeding))]
        trials: list[TrialStepEnd | None] = [None] * len(ways)
        if self.touches is None:  # trials are slow for a small body: try the last best prediction first
            way, left = self.system.newton.way
            trials[way] = known = self.trial(ways[way])
            if known.size <= max(MUCH, WORSE * left if self.forces.rotates_without_contact else 0.0) * known.scale:
                self.system.newton.way = way, LESS * left
                return known
        every = [self.trial(x) if known is None else known for x, known in zip(ways, trials, strict=True)]
        inside = [t for t in every if t.possible]
        if not inside:
            through = any(t is not None and not math.isfinite(t.stored) for t in every)
            where = "passes through a rigid body" if through else "is outside the domain of the law"
            raise StepFailed(f"the state {where}")
        if self.forces.conservative:
            best = min(inside, key=lambda t: self.potential_increase(inside[0], t))
            self.system.newton.way = next(i for i, t in enumerate(every) if t is best), 0.0
            return best
        way = min((i for i, t in enumerate(every) if t.possible), key=lambda i: every[i].size)
        best = every[way]
        self.system.newton.way = way, best.size / best.scale if best.scale else 0.0
        return best

    def _limit_before_collision(self, stay: Floats, x: Floats) -> Floats:
        """Return a state between `stay` and x before deformable surfaces collide; x if none do."""
        length = self.reach(stay, x - stay)
        return x if length == 1.0 else stay + length * (x - stay)

    def _response_to_supports(self, moved: Floats) -> TrialStepEnd:
        """Return the trial of the linear response to the support motion in the step.

        `moved` (dofs,) is the state at the start of the step with the supports at their final positions. Raises
        StepFailed.
        """
        now = self.stage.start
        here, d = self.trial(now.x), moved - now.x
        eps = 1e-6 / max(1.0, 1e3 * float(np.abs(d).max()))
        there = self.trial(now.x + eps * d)
        # inertia and damping already contain the support motion at the end; only their displacement is missing
        coupling = self.weight * (there.force.total - here.force.total) / eps
        d[self.forces.free] = self._direction(here, here.r + coupling[self.forces.free], 1e-6, True)
        if self.reach(now.x, d) < 1.0:
            raise StepFailed("the motion of the supports makes surfaces intersect")
        towed = self.trial(now.x + d)
        if not np.isfinite(towed.potential) or not towed.possible:
            raise StepFailed("the motion of the supports inverts cells")
        return towed

    # ------------------------------------------------------------------ iteration

    def next_trial(self, trial: TrialStepEnd, scale: float, cycles: bool) -> tuple[TrialStepEnd, float]:
        """Return the next trial and the accepted fraction of the Newton step. Raises StepFailed.

        If Newton's method `cycles`, a step has to decrease the residual; the energy differences are rounding errors.
        """
        goal = 0.1 * self.tolerance * scale / trial.size  # of the linear system: no more than needed
        reason = "no Newton step decreases the energy"
        for projected in (False, True):
            try:
                d = self._direction(trial, trial.r, float(np.clip(goal, 1e-12, 1e-3)), projected)
            except StepFailed as failure:
                reason = failure.reason
                continue
            if projected or not self.forces.conservative or trial.r @ d < 0.0:
                found = self._line_search(trial, d, cycles)
                if found is not None:
                    return found
        raise StepFailed(reason)

    def _direction(self, trial: TrialStepEnd, r: Floats, tolerance: float, projected: bool) -> Floats:
        """Return the direction -J^-1 r (free,) for residual forces r (free,) with Jacobian J. Raises StepFailed."""
        J = self._jacobian(trial.x, projected)
        try:
            d = -self.system.linear.solve(J, r, tolerance)
        except (Singular, np.linalg.LinAlgError) as error:
            raise StepFailed(f"the tangent is singular ({error})") from error
        if not np.all(np.isfinite(d)):
            raise StepFailed("the tangent is singular")
        return d

    def _jacobian(self, x: Floats, projected: bool) -> sparse.csr_matrix:
        """Return dr/dx = (1 - alpha_m) A M + (1 - alpha_f) (B C + K) plus rotational inertia, in the shared pattern."""
        stage, turning = self.stage, self.system.problem.turning
        J = self.forces.tangent(self.weighted_state(x), self.factors, projected)
        J.data *= self.share
        self.forces.add_mass(J.data, (1.0 - stage.alpha_m) * stage.A)
        if self.system.damping.active:
            J.data += stage.damping_velocity_derivative * self.system.damping.data
        if self.touches is not None:
            self.touches.add_hessian(x, J.data, stage.touch, projected)
        if turning is not None:
            v = stage.speed + stage.B * (x - stage.coast)
            self.forces.add_rotational_blocks(J.data, turning.tangent(stage, x, v))
        return (
            J
            if self.touches is None
            else self.touches.with_deformable_stiffness(x, J, self.forces.free, stage.touch, projected)
        )

    def _line_search(self, trial: TrialStepEnd, d: Floats, cycles: bool) -> tuple[TrialStepEnd, float] | None:
        """Return the trial after a fraction of a step d that lowers the potential enough, and the fraction.

        The full step is tried first, then fractions (Armijo 1966). Returns None if no fraction lowers it enough.
        """
        way, slope = np.zeros_like(trial.x), float(trial.r @ d)
        way[self.forces.free] = d
        length = self.reach(trial.x, way)
        while length > SHORTEST:
            there = self.trial(trial.x + length * way)
            if there.size <= MUCH * trial.size and length == 1.0 and math.isfinite(there.stored):
                return there, length
            if there.possible and self._is_enough_lower(trial, there, length * slope, cycles):
                return there, length
            length *= 0.5
        return None

    def _is_enough_lower(self, trial: TrialStepEnd, there: TrialStepEnd, slope: float, cycles: bool) -> bool:
        """Return whether the trial `there` is enough lower than `trial`, for a directional derivative `slope`."""
        if self.forces.conservative and not cycles:
            noise = 1e-13 * (abs(trial.potential) + abs(there.potential) + abs(trial.stored) + abs(there.stored))
            return self.potential_increase(trial, there) <= 1e-4 * slope + noise
        return there.size <= (1.0 - 1e-4) * trial.size

    def reach(self, x: Floats, d: Floats) -> float:
        """Return the fraction of an increment d (dofs,), at most 1, up to which deformable surfaces do not collide."""
        return 1.0 if self.touches is None else self.touches.limit(x, d)

    def potential_increase(self, here: TrialStepEnd, there: TrialStepEnd) -> float:
        """Return the increase of the incremental potential from `here` to `there`, J."""
        free = self.forces.free
        step = (there.x - here.x)[free]
        quadratic = 0.5 * float(
            step @ (here.inertia_damping_and_past_forces + there.inertia_damping_and_past_forces)[free]
        )  # exact: its gradient is linear
        weight = 1.0 / self.share if self.stage.between else self.share
        rise = quadratic + weight * (there.potential - here.potential)
        return rise if self.touches is None else rise + self.stage.touch * (there.stored - here.stored)
