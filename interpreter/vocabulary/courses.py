"""Courses: how a load or an imposed motion grows and falls in the time of a dynamic analysis.

A static analysis applies loads in full. To add one: a class with `at(t)`, a line in COURSES.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated


@dataclass(frozen=True)
class Ramp:
    """Grows from nothing to the whole along a straight line, and stays."""

    over: Annotated[float, "s in (0, inf)", "how long it grows"]
    start: Annotated[float, "s in [0, inf)", "when it begins"] = 0.0

    def at(self, t: float) -> float:
        """The share at time t, s."""
        return min(1.0, max(0.0, (t - self.start) / self.over))


@dataclass(frozen=True)
class Smooth:
    """Grows from nothing to the whole without a kink: half a cosine, (1 - cos(pi t / over)) / 2."""

    over: Annotated[float, "s in (0, inf)", "how long it grows"]
    start: Annotated[float, "s in [0, inf)", "when it begins"] = 0.0

    def at(self, t: float) -> float:
        """The share at time t, s."""
        return 0.5 - 0.5 * math.cos(math.pi * min(1.0, max(0.0, (t - self.start) / self.over)))


@dataclass(frozen=True)
class Pulse:
    """The whole from one time to another, and nothing before and after."""

    until: Annotated[float, "s in (0, inf)", "when it ends"]
    start: Annotated[float, "s in [0, inf)", "when it begins"] = 0.0

    def at(self, t: float) -> float:
        """The share at time t, s."""
        return 1.0 if self.start <= t < self.until else 0.0


@dataclass(frozen=True)
class Sine:
    """Swings between plus and minus the whole: sin(2 pi f t)."""

    frequency: Annotated[float, "Hz in (0, inf)", "swings per second"]

    def at(self, t: float) -> float:
        """The share at time t, s."""
        return math.sin(2 * math.pi * self.frequency * t)
