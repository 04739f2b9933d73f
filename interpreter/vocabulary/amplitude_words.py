"""Amplitudes (`amplitude = ...`): change of a load or an imposed motion in time, or from state to state.

A static analysis without states applies loads in full. To add an amplitude: a class with `at(t)` and `mean(begin,
end)`, the exact mean over a time interval; a line in AMPLITUDES; and a check in validation/amplitude_resolution.py
whether time steps resolve the amplitude.
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

NEAR = 1e-6  # fraction of a step: a row this close to the end of a step counts as being at the end
TableRows = tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]  # times in s, shares, integrals up to each


def piecewise_mean(begin: float, end: float, breaks: tuple[float, ...], mean: Callable[[float, float], float]) -> float:
    """Return the mean of a piecewise smooth function of time from `begin` to `end`, s.

    `mean(a, b)` is its exact mean between two times a and b without one of `breaks` (times, s) between them.
    """
    at = (begin, *(t for t in breaks if begin < t < end), end)
    return sum((b - a) * mean(a, b) for a, b in pairwise(at)) / (end - begin) if len(at) > 2 else mean(begin, end)


def _sinc(x: float) -> float:
    """Return sin(x) / x."""
    return math.sin(x) / x if x else 1.0


@dataclass(frozen=True)
class Ramp:
    """Grows linearly from zero to the full value and then stays there."""

    over: Annotated[float, "s in (0, inf)", "duration of the rise"]
    start: Annotated[float, "s in [0, inf)", "start time"] = 0.0

    def at(self, t: float) -> float:
        """Return the amplitude at time t, s."""
        return min(1.0, max(0.0, (t - self.start) / self.over))

    def mean(self, begin: float, end: float) -> float:
        """Return the mean amplitude from time `begin` to `end`, s."""
        breaks = (self.start, self.start + self.over)
        return piecewise_mean(begin, end, breaks, lambda a, b: 0.5 * (self.at(a) + self.at(b)))


@dataclass(frozen=True)
class Smooth:
    """Grows smoothly from zero to the full value, along half a cosine: (1 - cos(pi t / over)) / 2."""

    over: Annotated[float, "s in (0, inf)", "duration of the rise"]
    start: Annotated[float, "s in [0, inf)", "start time"] = 0.0

    def _turn(self, t: float) -> float:
        """Return the argument of the cosine at time t, s: an angle from 0 to pi."""
        return math.pi * min(1.0, max(0.0, (t - self.start) / self.over))

    def at(self, t: float) -> float:
        """Return the amplitude at time t, s."""
        return 0.5 - 0.5 * math.cos(self._turn(t))

    def mean(self, begin: float, end: float) -> float:
        """Return the mean amplitude from time `begin` to `end`, s."""

        def mean(a: float, b: float) -> float:
            first, last = self._turn(a), self._turn(b)
            return 0.5 - 0.5 * math.cos(0.5 * (first + last)) * _sinc(0.5 * (last - first))

        return piecewise_mean(begin, end, (self.start, self.start + self.over), mean)


@dataclass(frozen=True)
class Pulse:
    """Applies the full value between two times, and zero before and after."""

    until: Annotated[float, "s in (0, inf)", "end time"]
    start: Annotated[float, "s in [0, inf)", "start time"] = 0.0

    def at(self, t: float) -> float:
        """Return the amplitude at time t, s."""
        return 1.0 if self.start <= t < self.until else 0.0

    def mean(self, begin: float, end: float) -> float:
        """Return the mean amplitude from time `begin` to `end`, s."""
        return max(0.0, min(end, self.until) - max(begin, self.start)) / (end - begin)


@dataclass(frozen=True)
class Sine:
    """Oscillates between plus and minus the full value: sin(2 pi f t)."""

    frequency: Annotated[float, "Hz in (0, inf)", "oscillations per second"]

    def at(self, t: float) -> float:
        """Return the amplitude at time t, s."""
        return math.sin(2 * math.pi * self.frequency * t)

    def mean(self, begin: float, end: float) -> float:
        """Return the mean amplitude from time `begin` to `end`, s."""
        return self.at(0.5 * (begin + end)) * _sinc(math.pi * self.frequency * (end - begin))


@dataclass(frozen=True)
class Table:
    """Follows a table of values over time, with linear interpolation between its rows.

    The table is a CSV file with a header that names the columns; lines above the header are ignored as titles. Each
    value is divided by `whole` to give the fraction of the load or motion: `whole = 100` for percent, or the largest
    angle for a rotation. Times must increase from row to row and cover the whole analysis, because nothing is
    extrapolated.
    """

    path: Annotated[str, "file", "CSV file, relative to the scene, or a data set such as `data:...`"]
    at_: Annotated[str, "name of the column of times"]
    value: Annotated[str, "name of the column of values"]
    time_unit: Annotated[float, "s in (0, inf)", "unit of the column of times, such as `1 ms`"] = 1.0
    whole: Annotated[float, "1 in (0, inf)", "value in the table that means the full load or motion"] = 1.0

    def at(self, t: float) -> float:
        """Return the amplitude at time t, s."""
        return table_amplitude(self.rows, t)

    def mean(self, begin: float, end: float) -> float:
        """Return the mean amplitude from time `begin` to `end`, s."""
        rows = self.rows
        return (_integral_until(rows, end) - _integral_until(rows, begin)) / (end - begin)

    @property
    def rows(self) -> TableRows:
        """Rows of the file as it is now. Raises Unreadable."""
        file = Path(self.path)
        changed = file.stat().st_mtime_ns if file.is_file() else 0
        return _read_table(self.path, changed, self.at_, self.value, self.time_unit, self.whole)


def table_amplitude(rows: TableRows, t: float) -> float:
    """Return the linearly interpolated amplitude of a table at time t, s."""
    times, shares, _ = rows
    i = min(max(bisect_right(times, t), 1), len(times) - 1)
    share = (t - times[i - 1]) / (times[i] - times[i - 1])
    return shares[i - 1] + min(max(share, 0.0), 1.0) * (shares[i] - shares[i - 1])


def deviations_between_steps(rows: TableRows, step: float, duration: float) -> Iterator[tuple[float, float]]:
    """Yield each row time, s, that lies between two time steps, with the error of linear interpolation there.

    The error is the difference between the table and the linear interpolation between its values at the time steps,
    relative to the largest amplitude. Both are piecewise linear, so the largest error is at one of the rows.
    """
    times, shares, _ = rows
    largest = max(map(abs, shares)) or 1.0
    for t, share in zip(times, shares, strict=True):
        if not 0.0 <= t <= duration:
            continue
        begin = math.floor(t / step * (1.0 + NEAR * NEAR)) * step
        part = (t - begin) / step
        if NEAR < part < 1.0 - NEAR:
            line = (1.0 - part) * table_amplitude(rows, begin) + part * table_amplitude(rows, begin + step)
            yield t, abs(share - line) / largest


def _integral_until(rows: TableRows, t: float) -> float:
    """Return the integral of a table's amplitude from the first row to time t, s.

    Beyond the rows the first or last value applies.
    """
    times, shares, areas = rows
    i = min(max(bisect_right(times, t), 1), len(times))
    return areas[i - 1] + 0.5 * (t - times[i - 1]) * (shares[i - 1] + table_amplitude(rows, t))


@lru_cache(maxsize=32)
def _read_table(path: str, changed: int, at: str, value: str, unit: float, whole: float) -> TableRows:
    """Return the rows of a table file, which is read again only when it has changed. Raises Unreadable."""
    from softmark.references.csv_tables import read_columns
    from softmark.references.data_download import find_file
    from softmark.references.measured_data import Unreadable

    table = read_columns(find_file(path), (at, value))
    times = tuple(unit * t for t in table.numbers[at])
    shares = tuple(v / whole for v in table.numbers[value])
    if len(times) < 2:
        raise Unreadable(table.name, "an amplitude needs two rows", "give the value at the start and at the end")
    wrong = next((i for i, (a, b) in enumerate(pairwise(times), 1) if not b > a), None)
    if wrong is not None:
        raise Unreadable(table.name, f"line {table.lines[wrong]}, column `{at}`: times must increase, "
                         f"but here they go from {table.numbers[at][wrong - 1]:.6g} to {table.numbers[at][wrong]:.6g}",
                         "correct the times; for a jump, write two rows with nearly equal times")  # fmt: skip
    areas = [0.0]
    for (t, p), (later, q) in pairwise(zip(times, shares, strict=True)):
        areas.append(areas[-1] + 0.5 * (later - t) * (p + q))
    return times, shares, tuple(areas)


@dataclass(frozen=True)
class PerState:
    """Scales with the value of each state of a static analysis: `amplitude = per_state`.

    In the state `12.5 %` of `static(states = [5, 12.5, 18.25] %)` a load acts with an eighth of its size, and a support
    moves by an eighth of its displacement. Loads and supports without this amplitude act in full in every state.
    """


@dataclass(frozen=True)
class AtOneTime:
    """Amplitude of a load or support that was evaluated at one time; `of` is the load or support at full size.

    Not a word of the language: a quasistatic analysis sets this amplitude on loads and supports at each of its times.
    """

    of: Any

    def at(self, t: float) -> float:
        """Return the fraction of the full size at time t, s."""
        share: float = self.of.amplitude.at(t)
        return share


def at_full_size(thing: Any) -> Any:
    """Return a load, support or material at full size with its amplitude.

    If it was already evaluated at one time, the original is returned.
    """
    return thing.amplitude.of if isinstance(getattr(thing, "amplitude", None), AtOneTime) else thing


def with_full_material(declared: Any) -> Any:
    """Return a body or region with its material at full size."""
    whole = at_full_size(declared.thing.material)
    return (
        declared
        if whole is declared.thing.material
        else replace(declared, thing=replace(declared.thing, material=whole))
    )
