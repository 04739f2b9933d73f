"""Second backward difference formula (BDF2), an implicit integrator."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar

from softmark.records import dataclass
from softmark.solvers.dynamics.implicit_euler import ImplicitEuler
from softmark.solvers.dynamics.integrator import ImplicitStepFormula, Motion, StepStart
from softmark.solvers.dynamics.load_amplitudes import constant_step_load
from softmark.solvers.dynamics.trapezoidal_rule import trapezoidal_step_formula

if TYPE_CHECKING:
    from softmark.solvers.dynamics.dynamic_system import DynamicSystem


@dataclass(frozen=True)
class BDF2:
    """Second backward difference formula: second order, damps fast vibrations strongly and slow ones little.

    With D x = (c0 x1 + c1 x0 + c2 x_before), v1 = D x and a1 = D v; forces balance at the end of the step. Steps may
    have different lengths: the coefficients are those of the parabola through three unequal times, and the formula is
    stable while a step is below 1 + sqrt(2) times the one before. The first step is trapezoidal. Its error of O(h^3)
    occurs only once, so the order remains two, and the following steps damp the fast vibrations that it leaves. Linear
    momentum is conserved.

    Source: Hairer, Norsett and Wanner (1993), sections III.1 and III.5 (equation 5.12 for unequal steps).
    """

    explicit: ClassVar[bool] = False

    def begin(self, system: DynamicSystem, start: Motion, step: float) -> None:
        """Do nothing: every problem is accepted."""

    def advance(self, system: DynamicSystem, past: StepStart, step: float) -> Motion:
        """Return the motion after one step: trapezoidal at the start, by the two-step formula afterwards."""
        now, before = past.now, past.before
        impact = system.forces.impact
        if before is None:
            return system.solve(trapezoidal_step_formula(system, now, step))
        if impact is not None and impact.contact_changed(before, now):
            return ImplicitEuler().advance(system, past, step)
        ratio = step / (now.time - before.time)
        c0 = (1.0 + 2.0 * ratio) / (1.0 + ratio) / step
        c2 = ratio**2 / (1.0 + ratio) / step
        # c1 = -(c0 + c2): written with differences, so that nothing cancels
        drift = c2 / c0 * (now.x - before.x)  # where D x = 0: x1 = x0 + drift
        surge = c2 / c0 * (now.v - before.v)  # where D v = 0: v1 = v0 + surge
        speed = now.v + surge
        coast = now.x + drift + speed / c0
        # difference formula of the impulse since the start: a free body gets the right velocity for any amplitude
        mean, last = system.forces.mean(now.time, now.time + step), system.forces.mean(before.time, now.time)
        load = constant_step_load(mean + ratio / (1.0 + ratio) * (mean - last))
        end = system.solve(ImplicitStepFormula(now, step, load, c0**2, c0, coast, speed))
        return replace(end, given=(c2 / c0, 1.0 / (c0 * step)))
