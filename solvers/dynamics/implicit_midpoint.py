"""Implicit midpoint rule, a time integrator."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from softmark.records import dataclass
from softmark.solvers.dynamics.integrator import ImplicitStepFormula, Motion, StepStart
from softmark.solvers.dynamics.load_amplitudes import constant_step_load

if TYPE_CHECKING:
    from softmark.solvers.dynamics.dynamic_system import DynamicSystem


@dataclass(frozen=True)
class Midpoint:
    """Implicit midpoint rule: second order, no numerical damping, conserves linear and angular momentum.

    x1 = x0 + h (v0 + v1) / 2, M (v1 - v0) / h + C (v0 + v1) / 2 + f((x0 + x1) / 2) = 0. Angular momentum is conserved
    because the internal forces of a free body have no moment, also in the state in the middle of a step. In linear
    problems the rule equals the trapezoidal rule. Under finite rotations the energy oscillates by O(h^2) and need not
    stay bounded for long steps.

    Source: Simo, Tarnow and Wong (1992), Comput. Methods Appl. Mech. Eng. 100, section 3.
    """

    explicit: ClassVar[bool] = False

    def begin(self, system: DynamicSystem, start: Motion, step: float) -> None:
        """Do nothing: every problem is accepted."""

    def advance(self, system: DynamicSystem, past: StepStart, step: float) -> Motion:
        """Return the motion after one step balanced at its middle; its `a` is the mean acceleration of the step."""
        now = past.now
        coast = now.x + step * now.v
        load = constant_step_load(system.forces.mean(now.time, now.time + step))
        stage = ImplicitStepFormula(now, step, load, 2.0 / step**2, 2.0 / step, coast, now.v, alpha_f=0.5, between=True)
        return system.solve(stage)
