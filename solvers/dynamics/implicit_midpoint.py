"""The implicit midpoint rule."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from softmark.records import dataclass
from softmark.solvers.dynamics.integrator import Motion, Stage, StepStart
from softmark.solvers.dynamics.load_amplitudes import constant_step_load

if TYPE_CHECKING:
    from softmark.solvers.dynamics.dynamic_system import DynamicSystem


@dataclass(frozen=True)
class Midpoint:
    """The implicit midpoint rule: second order, no numerical damping, conserves linear and angular momentum.

    x1 = x0 + h (v0 + v1) / 2, M (v1 - v0) / h + C (v0 + v1) / 2 + f((x0 + x1) / 2) = 0. The forces within a
    free body have no moment, in the middle of a step either: hence the angular momentum. In linear problems it is
    the trapezoidal rule. Energy under finite rotations oscillates by O(h^2) and need not stay bounded at long
    steps. Source: Simo, Tarnow and Wong (1992), Comput. Methods Appl. Mech. Eng. 100, section 3.
    """

    explicit: ClassVar[bool] = False

    def begin(self, system: DynamicSystem, start: Motion, step: float) -> None:
        """Do nothing: every problem is accepted."""

    def advance(self, system: DynamicSystem, past: StepStart, step: float) -> Motion:
        """Make one step, balanced at its middle; `a` of the result is the mean acceleration of the step."""
        now = past.now
        coast = now.x + step * now.v
        load = constant_step_load(system.forces.mean(now.time, now.time + step))
        stage = Stage(now, step, load, 2.0 / step**2, 2.0 / step, coast, now.v, alpha_f=0.5, between=True)
        return system.solve(stage)
