"""Load amplitudes of a time step: they act as exact means over the step, so that its impulse is exact.

So a free body gets the right velocity at the end of every step from every integrator, even if there is a kink, a jump
or a pulse within the step. If an amplitude is smooth in the step, the loads at its two ends agree with it to O(h^2). So
modes too stiff for the step follow their load, and integrators keep their order. If a step begins with another load
than the last one ended with, the acceleration takes up the difference at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Protocol

from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np

    from softmark.solvers.energies.energy import Floats
else:
    from softmark.solvers.runtime.lazy_modules import np

INSIDE = 1e-9  # of a step: amplitudes are evaluated this far inside its ends, where they may jump and times are rounded


class Amplitude(Protocol):
    """Interface of an amplitude: the factor of a load, or of support motion, over time."""

    def at(self, t: float) -> float:
        """Return the factor at time t, s; at a jump, the value after it."""

    def mean(self, begin: float, end: float) -> float:
        """Return the mean factor from `begin` to `end`, s: the integral divided by the duration."""


@dataclass(frozen=True)
class Constant:
    """Amplitude that is 1 from the start."""

    def at(self, t: float) -> float:
        """Return 1."""
        return 1.0

    def mean(self, begin: float, end: float) -> float:
        """Return 1."""
        return 1.0


@dataclass(frozen=True)
class StepLoad:
    """Load factors (l,) of a step: at its start and end, and their mean over it.

    `first` and `last` are the factors that the initial and final accelerations of the step must balance.
    """

    start: Floats
    end: Floats
    mean: Floats
    first: Floats
    last: Floats


def constant_step_load(factors: Floats) -> StepLoad:
    """Return constant load factors over the step."""
    return StepLoad(factors, factors, factors, factors, factors)


def mean_factors(amplitudes: Sequence[Amplitude], begin: float, end: float) -> Floats:
    """Return the means (l,) of amplitudes from `begin` to `end`, s."""
    return np.array([amplitude.mean(begin, end) for amplitude in amplitudes])


def linear_step_load(
    amplitudes: Sequence[Amplitude], begin: float, end: float, weight: float = 0.5, ahead: float = 0.0
) -> StepLoad:
    """Return load factors that vary linearly over a step, shifted so that the integrator gets the exact impulse.

    The integrator's velocity update weights the end of the step with `weight`, so that

        (1 - weight) start + weight end = mean;

    `ahead` is the time by which accelerations refer to a later time than states, as in generalised-alpha. It is given
    as a fraction of the step.
    """
    inside = INSIDE * (end - begin)
    first = np.array([amplitude.at(begin + inside) for amplitude in amplitudes])
    last = np.array([amplitude.at(end - inside) for amplitude in amplitudes])
    mean = mean_factors(amplitudes, begin, end)
    lift, slope = mean - (first + weight * (last - first)), ahead * (last - first)
    start, stop = first + lift, last + lift
    return StepLoad(start, stop, mean, start + slope, stop + slope)
