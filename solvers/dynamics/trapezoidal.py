"""The trapezoidal rule."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from softmark.solvers.dynamics.newmark import newmark_stage
from softmark.solvers.dynamics.scheme import Motion, Past

if TYPE_CHECKING:
    from softmark.solvers.dynamics.system import System


@dataclass(frozen=True)
class Trapezoidal:
    """The trapezoidal rule: second order, no numerical damping; Newmark with beta = 1/4 and gamma = 1/2.

    x1 = x0 + h (v0 + v1) / 2, v1 = v0 + h (a0 + a1) / 2. Periods lengthen by (w h)^2 / 12. Vibrations too fast for
    the step (w h >> 2) neither fade nor blow up but flip their sign at each step; where a stiff body is hit, take
    generalized_alpha or bdf2. Conserves linear momentum, and the energy of linear problems; angular
    momentum and the energy of finite rotations oscillate by O(h^2) and need not stay bounded at long steps.
    Source: Hughes (1987), section 9.1.
    """

    explicit: ClassVar[bool] = False

    def begin(self, system: System, start: Motion, step: float) -> None:
        """Nothing to refuse."""

    def advance(self, system: System, past: Past, step: float) -> Motion:
        """The step of average acceleration."""
        load = system.forces.graded(past.now.time, past.now.time + step)
        return system.solve(newmark_stage(system, past.now, step, load, 0.25, 0.5))
