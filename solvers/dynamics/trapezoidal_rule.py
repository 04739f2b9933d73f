"""Trapezoidal rule, an implicit integrator."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from softmark.records import dataclass
from softmark.solvers.dynamics.integrator import ImplicitStepFormula, Motion, StepStart

if TYPE_CHECKING:
    from softmark.solvers.dynamics.dynamic_system import DynamicSystem


@dataclass(frozen=True)
class Trapezoidal:
    """Trapezoidal rule: second order, no numerical damping; Newmark with beta = 1/4 and gamma = 1/2.

    x1 = x0 + h (v0 + v1) / 2, v1 = v0 + h (a0 + a1) / 2. Periods are lengthened by a fraction (w h)^2 / 12. Vibrations
    too fast for the step (w h >> 2) neither decay nor grow, but change sign in each step; for impacts on stiff bodies
    use generalized_alpha or bdf2. Linear momentum and the energy of linear problems are conserved. Angular momentum,
    and the energy under finite rotations, oscillate by O(h^2) and need not stay bounded for long steps.

    Source: Hughes (1987), section 9.1.
    """

    explicit: ClassVar[bool] = False

    def begin(self, system: DynamicSystem, start: Motion, step: float) -> None:
        """Do nothing: every problem is accepted."""

    def advance(self, system: DynamicSystem, past: StepStart, step: float) -> Motion:
        """Return the motion after one step of average acceleration."""
        return system.solve(trapezoidal_step_formula(system, past.now, step))


def trapezoidal_step_formula(system: DynamicSystem, now: Motion, h: float) -> ImplicitStepFormula:
    """Return the stage equations M (v1 - v0) / h + C (v0 + v1) / 2 + (f0 + f1) / 2 = 0.

    They are Newmark's formulas for beta = 1/4 and gamma = 1/2 with the acceleration of the start inserted. The energy
    lost to damping, h times its power at the mean velocity, is never negative.
    """
    load = system.forces.step_load(now.time, now.time + h)
    coast = now.x + h * now.v
    return ImplicitStepFormula(now, h, load, 2.0 / h**2, 2.0 / h, coast, now.v, alpha_f=0.5)
