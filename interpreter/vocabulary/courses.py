"""Courses: how a load or an imposed motion grows and falls, in the time of a dynamic analysis or from state to state.

A static analysis without states applies loads in full. To add one: a class with `at(t)`, the exact `mean(begin, end)`
over a time and `narrowest`, a line in COURSES.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Annotated

from softmark.records import dataclass


def _over(begin: float, end: float, breaks: tuple[float, ...], mean: Callable[[float, float], float]) -> float:
    """The mean from `begin` to `end` of what `mean` tells between the times at which it breaks."""
    at = (begin, *(t for t in breaks if begin < t < end), end)
    return sum((b - a) * mean(a, b) for a, b in pairwise(at)) / (end - begin) if len(at) > 2 else mean(begin, end)


def _swing(x: float) -> float:
    """sin(x) / x."""
    return math.sin(x) / x if x else 1.0


@dataclass(frozen=True)
class Ramp:
    """Grows from nothing to the whole along a straight line, and stays."""

    over: Annotated[float, "s in (0, inf)", "how long it grows"]
    start: Annotated[float, "s in [0, inf)", "when it begins"] = 0.0

    def at(self, t: float) -> float:
        """The share at time t, s."""
        return min(1.0, max(0.0, (t - self.start) / self.over))

    def mean(self, begin: float, end: float) -> float:
        """The mean share from `begin` to `end`, s."""
        breaks = (self.start, self.start + self.over)
        return _over(begin, end, breaks, lambda a, b: 0.5 * (self.at(a) + self.at(b)))


@dataclass(frozen=True)
class Smooth:
    """Grows from nothing to the whole without a kink: half a cosine, (1 - cos(pi t / over)) / 2."""

    over: Annotated[float, "s in (0, inf)", "how long it grows"]
    start: Annotated[float, "s in [0, inf)", "when it begins"] = 0.0

    def _turn(self, t: float) -> float:
        """The angle at time t, from 0 to pi."""
        return math.pi * min(1.0, max(0.0, (t - self.start) / self.over))

    def at(self, t: float) -> float:
        """The share at time t, s."""
        return 0.5 - 0.5 * math.cos(self._turn(t))

    def mean(self, begin: float, end: float) -> float:
        """The mean share from `begin` to `end`, s."""

        def mean(a: float, b: float) -> float:
            first, last = self._turn(a), self._turn(b)
            return 0.5 - 0.5 * math.cos(0.5 * (first + last)) * _swing(0.5 * (last - first))

        return _over(begin, end, (self.start, self.start + self.over), mean)


@dataclass(frozen=True)
class Pulse:
    """The whole from one time to another, and nothing before and after."""

    until: Annotated[float, "s in (0, inf)", "when it ends"]
    start: Annotated[float, "s in [0, inf)", "when it begins"] = 0.0

    def at(self, t: float) -> float:
        """The share at time t, s."""
        return 1.0 if self.start <= t < self.until else 0.0

    def mean(self, begin: float, end: float) -> float:
        """The mean share from `begin` to `end`, s."""
        return max(0.0, min(end, self.until) - max(begin, self.start)) / (end - begin)


@dataclass(frozen=True)
class Sine:
    """Swings between plus and minus the whole: sin(2 pi f t)."""

    frequency: Annotated[float, "Hz in (0, inf)", "swings per second"]

    def at(self, t: float) -> float:
        """The share at time t, s."""
        return math.sin(2 * math.pi * self.frequency * t)

    def mean(self, begin: float, end: float) -> float:
        """The mean share from `begin` to `end`, s."""
        return self.at(0.5 * (begin + end)) * _swing(math.pi * self.frequency * (end - begin))


@dataclass(frozen=True)
class State:
    """The value of each state of a static analysis, as a part of the whole: `course = state`.

    In the state `12.5 %` of `static(states = [5, 12.5, 18.25] %)` a load acts with an eighth of its size, and a support
    moves by an eighth of its displacement. Without this course they act in full in every state.
    """
