"""What the loads of a step are: courses enter as their exact means over it, so that every step has the right impulse.

A free body gets the right velocity at the end of every step from every integrator, whatever happens within the step: a
kink, a jump, a pulse. Where a course is smooth in the step, loads at its two ends are those of the course but for
O(h^2), so that what is too stiff for the step follows its load, and integrators keep their order. Where a step begins
with another load than the last one ended with, the acceleration takes up the difference at once.
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

INSIDE = 1e-9  # of a step: how far within it its ends are looked at, where a course may jump and times are rounded


class Course(Protocol):
    """The factor of a load, or of the motion of supports, over time."""

    def at(self, t: float) -> float:
        """At time t, s; where it jumps, what comes after."""

    def mean(self, begin: float, end: float) -> float:
        """Over the time from `begin` to `end`, s: its integral over their distance."""


@dataclass(frozen=True)
class Constant:
    """The course of what has its full size from the start: 1."""

    def at(self, t: float) -> float:
        """1."""
        return 1.0

    def mean(self, begin: float, end: float) -> float:
        """1."""
        return 1.0


@dataclass(frozen=True)
class StepLoad:
    """Factors (l,) of the loads of a step: at its start and end, and their mean over it.

    `first` and `last` are those that the accelerations which the step starts from and ends with are to balance.
    """

    start: Floats
    end: Floats
    mean: Floats
    first: Floats
    last: Floats


def steady(factors: Floats) -> StepLoad:
    """The same all over the step."""
    return StepLoad(factors, factors, factors, factors, factors)


def mean_of(courses: Sequence[Course], begin: float, end: float) -> Floats:
    """Means (l,) of courses."""
    return np.array([course.mean(begin, end) for course in courses])


def graded(courses: Sequence[Course], begin: float, end: float, weight: float = 0.5, ahead: float = 0.0) -> StepLoad:
    """A straight line from end to end, lifted so that an integrator gives it the impulse of the courses.

    `weight` is the one that the integrator gives to the end of the step in the change of velocity, so much that

        (1 - weight) start + weight end = mean;

    `ahead` (as a part of the step) by how much later than states its accelerations are meant, as in generalised-alpha.
    """
    inside = INSIDE * (end - begin)
    first = np.array([course.at(begin + inside) for course in courses])
    last = np.array([course.at(end - inside) for course in courses])
    mean = mean_of(courses, begin, end)
    lift, slope = mean - (first + weight * (last - first)), ahead * (last - first)
    start, stop = first + lift, last + lift
    return StepLoad(start, stop, mean, start + slope, stop + slope)
