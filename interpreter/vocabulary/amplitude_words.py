"""Courses: how a load or an imposed motion grows and falls, in the time of a dynamic analysis or from state to state.

A static analysis without states applies loads in full. To add one: a class with `at(t)` and the exact `mean(begin,
end)` over a time, a line in COURSES, and whether steps show it in validation/amplitude_resolution.py.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

from softmark.records import dataclass

NEAR = 1e-6  # of a step: what is there is at its end
TableRows = tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]  # times in s, shares, integrals up to each


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
class Table:
    """Follows a table of values, along straight lines between its rows.

    The table is a CSV file whose header names the columns; lines before it are titles. A value is the share of the load
    or of the motion: `whole` is the number that stands for all of it, such as 100 for percent, or the largest angle.
    Times grow from row to row, and go from the start of the analysis to its end: nothing is made up beyond them.
    """

    path: Annotated[str, "file", "the table, relative to the scene, or a data set such as `data:...`"]
    at_: Annotated[str, "the name of the column of times"]
    value: Annotated[str, "the name of the column of values"]
    time_unit: Annotated[float, "s in (0, inf)", "what one unit of the column of times is, such as `1 ms`"] = 1.0
    whole: Annotated[float, "1 in (0, inf)", "which value stands for the whole of what it drives"] = 1.0

    def at(self, t: float) -> float:
        """The share at time t, s."""
        return share_at(self.rows, t)

    def mean(self, begin: float, end: float) -> float:
        """The mean share from `begin` to `end`, s."""
        rows = self.rows
        return (_until(rows, end) - _until(rows, begin)) / (end - begin)

    @property
    def rows(self) -> TableRows:
        """The rows of the file as it is now. Raises Unreadable."""
        file = Path(self.path)
        changed = file.stat().st_mtime_ns if file.is_file() else 0
        return _read(self.path, changed, self.at_, self.value, self.time_unit, self.whole)


def share_at(rows: TableRows, t: float) -> float:
    """The share of a table at time t, s."""
    times, shares, _ = rows
    i = min(max(bisect_right(times, t), 1), len(times) - 1)
    share = (t - times[i - 1]) / (times[i] - times[i - 1])
    return shares[i - 1] + min(max(share, 0.0), 1.0) * (shares[i] - shares[i - 1])


def off_the_steps(rows: TableRows, step: float, duration: float) -> Iterator[tuple[float, float]]:
    """Of every row between the ends of steps its time, s, and how far it is from the straight line between these.

    Relative to the largest share. Tables and these lines are straight between rows and ends of steps, so that they are
    farthest apart at one of the rows.
    """
    times, shares, _ = rows
    largest = max(map(abs, shares)) or 1.0
    for t, share in zip(times, shares, strict=True):
        if not 0.0 <= t <= duration:
            continue
        begin = math.floor(t / step * (1.0 + NEAR * NEAR)) * step
        part = (t - begin) / step
        if NEAR < part < 1.0 - NEAR:
            line = (1.0 - part) * share_at(rows, begin) + part * share_at(rows, begin + step)
            yield t, abs(share - line) / largest


def _until(rows: TableRows, t: float) -> float:
    """The integral from the first row to time t, s; before and after the rows their ends hold."""
    times, shares, areas = rows
    i = min(max(bisect_right(times, t), 1), len(times))
    return areas[i - 1] + 0.5 * (t - times[i - 1]) * (shares[i - 1] + share_at(rows, t))


@lru_cache(maxsize=32)
def _read(path: str, changed: int, at: str, value: str, unit: float, whole: float) -> TableRows:
    """The rows of a table, read once for as long as it does not change. Raises Unreadable."""
    from softmark.references.csv_tables import columns
    from softmark.references.data_download import find
    from softmark.references.measured_data import Unreadable

    table = columns(find(path), (at, value))
    times = tuple(unit * t for t in table.numbers[at])
    shares = tuple(v / whole for v in table.numbers[value])
    if len(times) < 2:
        raise Unreadable(table.name, "a course needs two rows", "give the value at the start and at the end")
    wrong = next((i for i, (a, b) in enumerate(pairwise(times), 1) if not b > a), None)
    if wrong is not None:
        raise Unreadable(table.name, f"line {table.lines[wrong]}, column `{at}`: time does not go on,"
                         f" {table.numbers[at][wrong - 1]:.6g} to {table.numbers[at][wrong]:.6g}",
                         "times grow from row to row; a jump takes two rows that are close")  # fmt: skip
    areas = [0.0]
    for (t, p), (later, q) in pairwise(zip(times, shares, strict=True)):
        areas.append(areas[-1] + 0.5 * (later - t) * (p + q))
    return times, shares, tuple(areas)


@dataclass(frozen=True)
class State:
    """The value of each state of a static analysis, as a part of the whole: `course = state`.

    In the state `12.5 %` of `static(states = [5, 12.5, 18.25] %)` a load acts with an eighth of its size, and a support
    moves by an eighth of its displacement. Without this course they act in full in every state.
    """


@dataclass(frozen=True)
class Passed:
    """The course of what is seen at one time: `of` is the same at full size, with the course that it follows.

    No word of the language: a quasistatic analysis leaves it on loads and supports at each of its times.
    """

    of: Any

    def at(self, t: float) -> float:
        """The share of the full size at time t, s."""
        share: float = self.of.course.at(t)
        return share


def in_full(thing: Any) -> Any:
    """What follows a course at its full size, with that course, also where it is seen at one time."""
    return thing.course.of if isinstance(getattr(thing, "course", None), Passed) else thing


def in_whole(declared: Any) -> Any:
    """What is declared of a material, with that in full."""
    whole = in_full(declared.thing.material)
    return (
        declared
        if whole is declared.thing.material
        else replace(declared, thing=replace(declared.thing, material=whole))
    )
