"""Time integration: steps of constant length, halved when they fail, and the record of all steps."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.solvers.dynamics.dynamic_problem import Dynamics
from softmark.solvers.dynamics.dynamic_system import DynamicSystem
from softmark.solvers.dynamics.energy_balance import EnergyAccount
from softmark.solvers.dynamics.energy_ledger import NAMES, EnergyEntry, is_finite, next_entry, open_entry
from softmark.solvers.dynamics.implicit_newton import StepOutcome
from softmark.solvers.dynamics.integrator import BarrierTooSoft, Motion, StepFailed, StepStart
from softmark.solvers.dynamics.trajectory import ContactHistory, Diverged, Event, MotionNotConverged, Trajectory

if TYPE_CHECKING:
    from softmark.solvers.dynamics.dynamic_contact import FrictionResult, ImpactEvent

NOISE = 1e4  # times the work of rounding errors of forces: smaller energy gains are ignored

Observer = Callable[[Motion], Any]


def whole_motion(motion: Motion) -> Motion:
    """Return the motion unchanged: an observer that stores everything."""
    return motion


def march(problem: Dynamics, duration: float, step: float, observe: Observer = whole_motion) -> Trajectory:
    """Return the motion from time 0 to `duration` in steps of `step`, s; the last step is shortened to end there.

    `observe` is called at time 0 and after every accepted step, outside the timed part; its return value is stored. A
    step that fails is halved, and later steps grow back. Raises NotConverged, with the trajectory so far, if a step
    fails at `problem.shortest` of its length; Diverged if the motion has gained spurious energy (energy_balance.py);
    StepTooLong if the step exceeds the critical one of an explicit integrator; ValueError for a duration or step that
    is not positive.
    """
    if not (0.0 < step < math.inf and 0.0 < duration < math.inf):
        raise ValueError("duration and step must be positive")
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        return _TimeIntegration(problem, duration, step, observe).run()


class _TimeIntegration:
    """A time integration in progress, with its growing record."""

    def __init__(self, problem: Dynamics, duration: float, step: float, observe: Observer) -> None:
        self.problem, self.duration, self.step, self.observe = problem, duration, step, observe
        self.system = DynamicSystem(problem, step)
        self.entries: list[tuple[float, ...]] = []
        self.impulses: Any = None
        self.names: tuple[str, ...] = NAMES
        self.times: list[float] = []
        self.observed: list[Any] = []
        self.costs: list[tuple[float, float]] = []  # wall, cpu
        self.outcomes: list[StepOutcome] = []
        self.events: list[Event] = []
        self.account = EnergyAccount()
        self.ticks = 2 ** max(0, round(-math.log2(problem.shortest)))  # shortest parts in a whole step

    def run(self) -> Trajectory:
        """Return the trajectory after all steps. Raises NotConverged."""
        try:
            start = self.system.start()
            entry = open_entry(self.system, start)
        except StepFailed as failure:
            raise self._make_failure(f"the initial acceleration could not be computed: {failure.reason}") from failure
        if not (is_finite(entry) and self.problem.sound(start.x)):
            raise self._make_failure("the initial state is outside the domain of the law or has inverted cells")
        self.problem.integrator.begin(self.system, start, self.step)
        self._record_energies(entry)
        self._record_contacts(start)
        past, ticks = StepStart(start), self.ticks
        for number in range(math.ceil(self.duration / self.step - 1e-9)):
            past, entry, ticks = self._advance_whole_step(number, past, entry, ticks)
        if self.account.over and not self.account.settles:
            raise self._make_divergence_error(past.now.time)
        return self._make_trajectory(complete=True)

    def _advance_whole_step(
        self, number: int, past: StepStart, entry: EnergyEntry, ticks: int
    ) -> tuple[StepStart, EnergyEntry, int]:
        """Make one step of constant length, in several parts if parts fail.

        Return its end with the energies, and the size of the next part in units. The first part has `ticks` units; the
        shortest part has one.
        """
        start = number * self.step
        length = min(self.step, self.duration - start)
        done, wall, cpu = 0, time.perf_counter(), time.process_time()
        while done < self.ticks:
            end = start + length * ((done + ticks) / self.ticks)
            try:
                motion = self._attempt_step(past, end)
                spent = (time.perf_counter() - wall, time.process_time() - cpu)
                entry = self._require_finite(next_entry(self.system, entry, motion))
            except BarrierTooSoft:
                entry = entry.after_barrier_stiffening(self.system)
                continue
            except StepFailed as failure:
                ticks = self._halve_step(past.now.time, length, ticks, failure)
                continue
            self.costs.append(spent)
            self.outcomes.append(self.system.outcome)
            self._record_energies(entry)
            if self.account.diverged:
                raise self._make_divergence_error(motion.time)
            past, entry, done = *self._accept_step(StepStart(motion, past.now), entry), done + ticks
            if ticks < self.ticks and done % (2 * ticks) == 0 and self._can_double_step(length, ticks):
                ticks *= 2
            wall, cpu = time.perf_counter(), time.process_time()
        return past, entry, ticks

    def _accept_step(self, past: StepStart, entry: EnergyEntry) -> tuple[StepStart, EnergyEntry]:
        """Return start and energies for the next step: rotations count from it, viscoelastic histories are updated."""
        if self.problem.remembering is not None:
            self.problem.remembering.accept_history()
        self._record_contacts(past.now)
        if (turning := self.problem.turning) is None:
            return past, entry
        past = turning.rebase_step_start(past)
        return past, replace(entry, motion=past.now)

    def _record_contacts(self, motion: Motion) -> None:
        """Record the contacts after a step."""
        forces = self.system.forces
        if forces.impact is not None:
            own = slice(None, forces.impact.free)  # without free rigid bodies
            forces.impact.record_step(motion, forces.resultant(forces.M @ motion.v), float(forces.M[own].sum()) / 3.0)

    def _can_double_step(self, length: float, ticks: int) -> bool:
        """Return whether a part of twice `ticks` units is short enough for the integrator."""
        return bool(length * (2 * ticks / self.ticks) <= self.system.longest)

    def _attempt_step(self, past: StepStart, end: float) -> Motion:
        """Return the motion at the time `end`, s, after one step. Raises StepFailed."""
        self.system.damping.compute_matrix(past.now.x)
        known, h = self.problem.remembering, end - past.now.time
        if known is not None:
            known.begin(self.system.forces, h)
        motion = self.problem.integrator.advance(self.system, past, h)
        if known is not None:
            known.compute_provisional_history(self.system.forces, motion.x, h)
        if not self.system.outcome.lagged and not self.problem.sound(motion.x):  # else it has been asked
            raise StepFailed("cells are inverted")
        if (impact := self.system.forces.impact) is not None:
            impact.check_step_end(past.now, motion, end)
        return replace(motion, time=end)

    def _require_finite(self, entry: EnergyEntry) -> EnergyEntry:
        """Return the entry if its motion is finite. Raises StepFailed otherwise."""
        if not is_finite(entry):
            raise StepFailed("the state is outside the domain of the law")
        return entry

    def _halve_step(self, now: float, length: float, ticks: int, failure: StepFailed) -> int:
        """Return half of the size of a part, and record this event. Raises NotConverged for the shortest part."""
        if ticks == 1:
            shortest = length / self.ticks
            raise self._make_failure(
                f"no convergence at {now:.6g} s even with steps of {shortest:.3g} s: {failure.reason}"
            ) from failure
        size = length * (ticks // 2) / self.ticks
        self.events.append(Event(now, f"step halved to {size:.4g} s: {failure.reason}"))
        return ticks // 2

    def _record_energies(self, entry: EnergyEntry) -> None:
        """Add the energies of a time to the record, and call the observer."""
        self.times.append(entry.motion.time)
        self.names, self.impulses = entry.names, entry.impulses
        energies = dict(zip(entry.names, entry.values, strict=True))
        self.account.add(entry.motion.time, energies, self._ignored_gain(entry.motion), self.system.swing)
        self.entries.append(entry.values)
        self.observed.append(self.observe(entry.motion))

    def _ignored_gain(self, motion: Motion) -> float:
        """Return a bound of the spurious work of rounding errors in forces, J; smaller energy gains are ignored.

        The bound is 10 000 times the estimate.
        """
        way = max(float(np.abs(motion.x).max(initial=0.0)), self.step * float(np.abs(motion.v).max(initial=0.0)))
        return NOISE * self.system.forces.rounding(motion.x) * way

    def _make_divergence_error(self, now: float) -> Diverged:
        """Return the error for a motion with too much energy at a time `now`, s."""
        gain = self.account.balance.gain
        return Diverged(
            f"at {now:.6g} s the energy has grown by {_format_ratio(gain)} the energy supplied by the "
            "initial state, loads and supports",
            self._make_trajectory(complete=False),
            tuple(self.system.newton.history),
        )

    def _make_failure(self, reason: str) -> MotionNotConverged:
        """Return the error for a motion that does not converge, with the trajectory so far."""
        return MotionNotConverged(reason, self._make_trajectory(complete=False), tuple(self.system.newton.history))

    def _make_trajectory(self, complete: bool) -> Trajectory:
        """Return the recorded motion; `complete` is whether it reaches the end."""
        times = np.array(self.times)
        names = self.names
        table = np.array(self.entries).reshape(-1, len(names)).T
        wall, cpu = np.array(self.costs).reshape(-1, 2).T
        outcomes, lagged = self.outcomes, self.system.lagged
        return Trajectory(
            times,
            np.diff(times),
            tuple(self.observed),
            dict(zip(names, table, strict=True)),
            np.array([o.iterations for o in outcomes], dtype=np.int64),
            wall,
            cpu,
            tuple(self.events),
            complete,
            np.array([o.residual for o in outcomes]),
            np.array([o.solved for o in outcomes], dtype=bool),
            np.array([o.lagged for o in outcomes], dtype=bool),
            lagged.failures if lagged else 0,
            self.account.balance,
            self._find_impacts(),
            self._friction_results(),
            self._contact_history(),
        )

    def _find_impacts(self) -> tuple[ImpactEvent, ...] | None:
        """Return the impacts on rigid bodies; None without rigid contacts."""
        impact = self.system.forces.impact
        if impact is None:
            return None
        from softmark.solvers.dynamics.dynamic_contact import find_impacts

        return tuple(find_impacts(impact.log))

    def _contact_history(self) -> ContactHistory | None:
        """Return the contact history of the motion; None without contacts."""
        impact = self.system.forces.impact
        if impact is None or not impact.log:
            return None
        change = impact.mass * (impact.log[-1].velocity - impact.log[0].velocity)
        acts = tuple(seen.acts for seen in impact.log)
        rigid = len(impact.contacts)  # later contacts, between pieces of the body, have no resultant
        given = sum((act.step * act.force for seen in acts for act in seen[:rigid]), np.zeros(3))
        impulses = np.vstack([given, self.impulses])
        return ContactHistory(acts, tuple(impact.surfaces.states), tuple(impact.surfaces.nodes), impulses, change)

    def _friction_results(self) -> tuple[tuple[FrictionResult, ...], ...]:
        """Return the friction results of all contacts at every time."""
        impact = self.system.forces.impact
        return () if impact is None or not impact.has_friction else tuple(seen.rubbed for seen in impact.log)


def _format_ratio(share: float) -> str:
    """Return a ratio as text before a noun, such as `60 % of` or `3.2 times`."""
    return f"{100 * share:.0f} % of" if share < 1.0 else f"{share:.3g} times"
