"""Generalised-alpha method, an implicit integrator."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar

from softmark.records import dataclass
from softmark.solvers.dynamics.integrator import Motion, StepStart
from softmark.solvers.dynamics.newmark import newmark_step_formula

if TYPE_CHECKING:
    from softmark.solvers.dynamics.dynamic_system import DynamicSystem


@dataclass(frozen=True)
class GeneralizedAlpha:
    """Generalised-alpha method: second order, damps only vibrations that are too fast for the step.

    The `spectral_radius` r is the factor per step of infinitely fast vibrations: r = 1 damps nothing, r = 0 removes
    fast vibrations in one step. The weights are alpha_m = (2 r - 1)/(r + 1), alpha_f = r/(r + 1), gamma = 1/2 - alpha_m
    + alpha_f, beta = (1 - alpha_m + alpha_f)^2 / 4, in Newmark's formulas with inertia and forces weighted between the
    ends of the step (see `Stage`). Linear momentum is conserved.

    Source: Chung and Hulbert (1993), J. Appl. Mech. 60, section 4.
    """

    spectral_radius: Annotated[float, "1 in [0, 1]", "factor per step of infinitely fast vibrations"] = 0.8

    explicit: ClassVar[bool] = False

    def begin(self, system: DynamicSystem, start: Motion, step: float) -> None:
        """Do nothing: every problem is accepted."""

    def advance(self, system: DynamicSystem, past: StepStart, step: float) -> Motion:
        """Return the motion after one step with the optimal weights for the spectral radius."""
        r = self.spectral_radius
        alpha_m, alpha_f = (2.0 * r - 1.0) / (r + 1.0), r / (r + 1.0)
        beta, gamma = 0.25 * (1.0 - alpha_m + alpha_f) ** 2, 0.5 - alpha_m + alpha_f
        now = past.now
        # accelerations refer to a time (alpha_m - alpha_f) h later than states
        load = system.forces.step_load(now.time, now.time + step, ahead=alpha_m - alpha_f)
        return system.solve(newmark_step_formula(system, now, step, load, beta, gamma, alpha_m, alpha_f))
