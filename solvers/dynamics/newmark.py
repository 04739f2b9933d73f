"""Newmark's family of implicit integrators."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar

from softmark.records import dataclass
from softmark.solvers.dynamics.integrator import ImplicitStepFormula, Motion, StepStart
from softmark.solvers.dynamics.trapezoidal_rule import trapezoidal_step_formula

if TYPE_CHECKING:
    from softmark.solvers.dynamics.dynamic_system import DynamicSystem
    from softmark.solvers.dynamics.load_amplitudes import StepLoad


@dataclass(frozen=True)
class Newmark:
    """Newmark's method; by default average acceleration, second order and without numerical damping.

    x1 = x0 + h v0 + h^2 ((1/2 - beta) a0 + beta a1), v1 = v0 + h ((1 - gamma) a0 + gamma a1), with forces balanced at
    the end of the step. The method is of second order only for gamma = 1/2. In linear problems it is never unstable for
    2 beta >= gamma >= 1/2. Linear momentum is conserved; with the defaults also the energy of linear problems, while
    under finite rotations energy and angular momentum oscillate by O(h^2). beta = 0 would be explicit: use
    central_differences instead.

    Source: Newmark (1959), J. Eng. Mech. 85(3).
    """

    beta: Annotated[float, "1 in (0, 1]", "weight of the new acceleration in the displacement"] = 0.25
    gamma: Annotated[float, "1 in (0, 1]", "weight of the new acceleration in the velocity"] = 0.5

    explicit: ClassVar[bool] = False

    def begin(self, system: DynamicSystem, start: Motion, step: float) -> None:
        """Do nothing: every problem is accepted."""

    def advance(self, system: DynamicSystem, past: StepStart, step: float) -> Motion:
        """Return the motion after one Newmark step.

        Average acceleration uses the trapezoidal rule, whose damping never adds energy.
        """
        if (self.beta, self.gamma) == (0.25, 0.5):
            return system.solve(trapezoidal_step_formula(system, past.now, step))
        load = system.forces.step_load(past.now.time, past.now.time + step, self.gamma)
        return system.solve(newmark_step_formula(system, past.now, step, load, self.beta, self.gamma))


def newmark_step_formula(
    system: DynamicSystem,
    before: Motion,
    h: float,
    load: StepLoad,
    beta: float,
    gamma: float,
    alpha_m: float = 0.0,
    alpha_f: float = 0.0,
) -> ImplicitStepFormula:
    """Return the formula of a Newmark step: a1 = (x1 - coast) / (beta h^2), and v1 as in `ImplicitStepFormula`."""
    now = system.with_load_factors(before, load.first)
    coast = now.x + h * now.v + h**2 * (0.5 - beta) * now.a
    speed = now.v + h * (1.0 - gamma) * now.a
    # contact acceleration enters x by h^2/2 and v by h, but not `a`, from which the next step starts;
    # velocities of nodes in contact alternate in sign, and damping by their weighted mean would add energy
    half, rest = 0.5 / beta, h * (1.0 - 0.5 * gamma / beta)
    return ImplicitStepFormula(
        now,
        h,
        load,
        1.0 / (beta * h**2),
        gamma / (beta * h),
        coast,
        speed,
        alpha_m,
        alpha_f,
        touch=(1.0 - alpha_m) * half,
        mean=system.forces.impact is not None,
        beyond=(-half, rest),
    )
