"""Central differences (leapfrog), an explicit integrator."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar

from softmark.records import dataclass
from softmark.solvers.dynamics.integrator import Motion, StepFailed, StepStart, StepTooLong

if TYPE_CHECKING:
    from softmark.solvers.dynamics.dynamic_system import DynamicSystem


@dataclass(frozen=True)
class CentralDifferences:
    """Central differences (leapfrog, velocity Verlet): explicit, second order, stable below a critical step.

    v = v0 + h/2 a0, x1 = x0 + h v, a1 = -M^-1 f(x1), v1 = v + h/2 a1, with a lumped mass. The method is stable for h <
    2/w, with w the largest angular frequency of the mesh. This is far below the steps of implicit integrators, but a
    step solves no equations. A step longer than `safety` times the critical one is refused before the start; the
    critical step at rest is found by Lanczos iteration. If the body stiffens during the motion, the critical step is
    computed again, and steps are halved. Mass-proportional damping is treated exactly as in the trapezoidal rule.
    Stiffness-proportional damping acts on the velocity of the half step, which shortens the critical step to 2/w
    (sqrt(1 + z^2) - z), z = beta w / 2. Linear and angular momentum are conserved to rounding.

    Source: Belytschko, Liu, Moran and Elkhodary (2014), sections 6.2 and 6.3.
    """

    safety: Annotated[float, "1 in (0, 1]", "fraction of the critical step that is used"] = 0.96

    explicit: ClassVar[bool] = True

    def begin(self, system: DynamicSystem, start: Motion, step: float) -> None:
        """Compute the longest stable step of the initial state. Raises StepTooLong if the step is longer."""
        critical = system.frequencies.critical_step(start.x, start.time)
        system.longest = self.safety * critical
        if step > system.longest:
            raise StepTooLong(step, system.longest)
        system.swing = _energy_oscillation(step, critical)

    def advance(self, system: DynamicSystem, past: StepStart, step: float) -> Motion:
        """Return the motion after one kick-drift-kick step. Raises StepFailed if the body is too stiff for the step."""
        if step > system.longest:
            raise StepFailed(_format_too_stiff(system.longest))
        end = past.now.time + step
        load = system.forces.step_load(past.now.time, end)
        now = system.with_load_factors(past.now, load.first)
        half = now.v + 0.5 * step * now.a
        x = system.with_supports_at_time(now.x + step * half, end)
        if system.problem.damping.beta:
            system.damping.compute_matrix(0.5 * (now.x + x))  # the velocity of the half step is that of its middle
        a, v = system.final_acceleration_and_velocity(now, x, half, end, load.last)
        system.longest = self.safety * system.frequencies.after(now, x, a, end)
        if step > system.longest:
            raise StepFailed(_format_too_stiff(system.longest))
        return Motion(end, x, v, a, load.last)


def _energy_oscillation(step: float, critical: float) -> float:
    """Return the relative amplitude by which the energy of the fastest mode oscillates in a stable step.

    A leapfrog conserves v^2 + w^2 (1 - (w h)^2 / 4) x^2 (Hairer, Lubich and Wanner 2003, Acta Numer. 12, p. 399).
    """
    share = (step / critical) ** 2 if critical else 0.0
    return share / (1.0 - share) if share < 1.0 else 0.0


def _format_too_stiff(critical: float) -> str:
    """Return the reason of a failed step that exceeds the critical step, s, as text."""
    return f"the critical step is now {critical:.4g} s"
