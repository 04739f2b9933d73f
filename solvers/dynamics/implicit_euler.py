"""Implicit (backward) Euler method."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from softmark.records import dataclass
from softmark.solvers.dynamics.integrator import ImplicitStepFormula, Motion, StepStart
from softmark.solvers.dynamics.load_amplitudes import constant_step_load

if TYPE_CHECKING:
    from softmark.solvers.dynamics.dynamic_system import DynamicSystem


@dataclass(frozen=True)
class ImplicitEuler:
    """Implicit (backward) Euler method: first order, damps every motion, never unstable.

    x1 = x0 + h v1, v1 = v0 + h a1, with forces balanced at the end of the step. A vibration of angular frequency w
    shrinks by 1/sqrt(1 + (w h)^2) per step, as with a damping ratio of about w h / 2. A body that spins freely at w
    loses a part (w h)^2 of its angular momentum per step. Linear momentum is conserved. Baraff and Witkin (1998)
    introduced it in graphics.

    Source: Hairer, Norsett and Wanner (1993), section II.7.
    """

    explicit: ClassVar[bool] = False

    def begin(self, system: DynamicSystem, start: Motion, step: float) -> None:
        """Do nothing: every problem is accepted."""

    def advance(self, system: DynamicSystem, past: StepStart, step: float) -> Motion:
        """Return the motion after one step: a1 = (x1 - x0 - h v0) / h^2, v1 = (x1 - x0) / h."""
        now = past.now
        load = constant_step_load(system.forces.mean(now.time, now.time + step))
        return system.solve(
            ImplicitStepFormula(now, step, load, 1.0 / step**2, 1.0 / step, now.x + step * now.v, now.v, secant=True)
        )
