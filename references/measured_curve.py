"""Measured curves with uncertainty, such as force against displacement or displacement against time."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from softmark.records import dataclass
from softmark.references.csv_tables import Columns, read_columns
from softmark.references.data_download import find_file, source_of
from softmark.references.measured_data import Unreadable
from softmark.references.reference_base import How, Reference

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
else:
    from softmark.references.lazy_imports import np

Row = tuple[float, float, float]  # x, y and the uncertainty of y, SI
NAMED = 3  # files that a source lists


@dataclass(frozen=True)
class CurveFromFile(Reference):
    """Curve from a table, one column against another, with its uncertainty."""

    path: Annotated[tuple[str, ...], "files", "path of the table, or a list of tables of repeated experiments"]
    x: Annotated[str, "name of the column on the horizontal axis, such as `travel` or `t`"]
    y: Annotated[tuple[str, ...], "texts", "name of the column of values, or a list of columns of repeated experiments"]
    x_unit: Annotated[Any, "amount in (0, inf)", "unit of column x, such as `1 mm`"]
    y_unit: Annotated[Any, "amount in (0, inf)", "unit of column y, such as `1 N`"]
    uncertainty: Annotated[Any | None, "amount in [0, inf)",
                           "uncertainty of every value: a fraction of it, or an amount"] = None  # fmt: skip
    deviation: Annotated[str, "name of a column with the uncertainty of each value, in the unit of y"] = ""
    x_origin: Annotated[Any | None, "amount", "position of the zero of column x in the scene"] = None
    y_origin: Annotated[Any | None, "amount", "position of the zero of column y in the scene"] = None
    branch: Annotated[Literal["loading", "unloading"], "part of a curve that turns back"] = "loading"
    citation: Annotated[str, "authors of the measurement"] = ""
    body: Annotated[str | None, "body", "body; needed if the scene has several"] = None

    how: ClassVar[How] = "measured"
    table: ClassVar[str] = "not a valid curve"
    source: ClassVar[str] = "the files named in the scene"
    error_meaning: ClassVar[str] = "uncertainty of a measured value, in its unit, as stated in the scene"

    @property
    def files(self) -> tuple[str, ...]:
        """Files from which the curve is read."""
        return self.path

    @property
    def repeats(self) -> int:
        """Number of experiments whose mean is the curve."""
        return len(self.path) * len(self.y)

    @property
    def uncertainty_columns(self) -> tuple[str, ...]:
        """Names of the table columns that give the uncertainty of y."""
        return (self.deviation,) if self.deviation else ()

    @property
    def span(self) -> tuple[float, float]:
        """Lowest and highest x of the curve, SI. Raises Unreadable."""
        return _common_x_range(self.read()[0])

    def unfit(self) -> tuple[str, str] | None:
        """Return the reason why the table does not contain a curve, and the remedy; None if it does."""
        try:
            self.read()
        except Unreadable as error:
            several = f"{error.name}: " if len(self.path) > 1 else ""
            return several + error.reason, error.remedy
        return None

    def read(self, beside: Path | None = None) -> tuple[list[Repeat], tuple[str, ...]]:
        """Return every experiment (repeat) in SI, and notes about the reading. Raises Unreadable."""
        found: list[Repeat] = []
        notes: list[str] = []
        asked = [self.x, *self.y, *self.uncertainty_columns]
        for path in self.path:
            table = read_columns(find_file(path, beside), asked)
            notes += table.notes
            for y in self.y:
                one, left_out = self._repeat(table, y)
                found.append(one)
                if left_out:
                    notes.append(f"{table.name}: {left_out}")
        low, high = _common_x_range(found)
        if not low < high:
            raise Unreadable(
                self.path[0], "the repeats have no common range of x", "remove the one that does not overlap"
            )
        return found, tuple(dict.fromkeys(notes))

    def load(self, beside: Path | None = None) -> MeasuredCurve:
        """Return the curve, the mean of all repeats, in SI, with its uncertainty. Raises Unreadable."""
        repeats, notes = self.read(beside)
        x = _joint_x_values(repeats)
        values, own = (np.array([np.interp(x, one.sorted[0], one.sorted[i]) for one in repeats]) for i in (1, 2))
        y = values.mean(axis=0)
        spread = values.std(axis=0, ddof=1) if len(repeats) > 1 else np.zeros_like(x)
        u = np.sqrt(spread**2 + (own**2).mean(axis=0) + self._stated(y) ** 2)
        said = [source_of(self.citation, path, Path(path).name) for path in self.path]
        sources = list(dict.fromkeys(said))
        more = f" and {len(sources) - NAMED} others" if len(sources) > NAMED else ""
        source = ", ".join(sources[:NAMED]) + more
        loops = tuple(one.loop.within(self._stated) for one in repeats if one.loop is not None)
        return MeasuredCurve(x, y, u, source, len(repeats), float(spread.max()), notes, loops)

    def _stated(self, y: Array) -> Array:
        """Return the uncertainty of the values y (n,) from the scene's field `uncertainty`, SI."""
        if self.uncertainty is None:
            return np.zeros_like(y)
        share = self.uncertainty.dimension != self.y_unit.dimension
        return self.uncertainty.value * np.abs(y) if share else np.full_like(y, self.uncertainty.value)

    def _value_uncertainties(self, table: Columns, name: str) -> list[float]:
        """Return the uncertainties in the table for the values of column `name`, SI. Raises Unreadable."""
        if not self.deviation:
            return [0.0] * len(table.lines)
        own = table.numbers[self.deviation]
        at = next((i for i, v in enumerate(own) if v < 0.0), None)
        if at is not None:
            raise Unreadable(table.name, f"line {table.lines[at]}, column `{self.deviation}`: an uncertainty is"
                             " negative", "give the uncertainty as a positive number")  # fmt: skip
        return [abs(self.y_unit.value) * v for v in own]

    def _repeat(self, table: Columns, name: str) -> tuple[Repeat, str]:
        """Return one experiment on the requested branch, and a note on the omitted rows. Raises Unreadable."""
        x = [self.x_unit.value * v + _value_or_zero(self.x_origin) for v in table.numbers[self.x]]
        y = [self.y_unit.value * v + _value_or_zero(self.y_origin) for v in table.numbers[name]]
        u = self._value_uncertainties(table, name)
        turn = max(range(len(x)), key=lambda i: abs(x[i] - x[0]))
        parts = {"loading": slice(0, turn + 1), "unloading": slice(turn, None)}
        rows, lines = list(zip(x, y, u, strict=True)), list(table.lines)
        chosen = parts[self.branch]
        _require_monotone(table.name, self.x, rows[chosen], lines[chosen], table.numbers[self.x][chosen])
        gone = len(rows) - len(rows[chosen])
        loop = None
        if 1 < turn < len(rows) - 2 and all(map(_is_monotone, both := [rows[part] for part in parts.values()])):
            loop = HysteresisLoop(sorted(both[0]), sorted(both[1]))
        left = f"{gone} of {len(rows)} rows do not belong to the {self.branch} branch and are omitted" if gone else ""
        return Repeat(tuple(rows[chosen]), loop), left


@dataclass(frozen=True)
class CurveInTable(CurveFromFile):
    """A measured curve: one column of a table against another, such as force against travel or over time.

    The table is a CSV file whose header names the columns; lines before it are titles. `x_unit` and `y_unit` are the
    size of one unit of a column: `1 mm`, `1 N`, or `18 mm^2 * 1 MPa` to convert a stress to a force. `x_origin` and
    `y_origin` are the position of the file's zero in the scene. Between its rows the curve is linear. x must increase,
    or decrease, from row to row; if it turns once, as in unloading, `branch` selects a part, and the report gives the
    number of omitted rows and the fraction of the work of loading that was lost.

    Every curve has an uncertainty, below which differences are not significant. `uncertainty` is that of every value: a
    fraction of it, or an amount in the unit of y (for a plain number y, the amount). `deviation` names a column with
    that of each row. Several files, or several columns `y`, are repeats of one experiment: the curve is their mean on
    the common range, and the standard deviation between them (over n - 1), linear between rows, is included in the
    uncertainty; it is that of one experiment, not of the mean. Several uncertainties are added in quadrature.

    `kind` states the kind of truth, if it was not measured: digitised from a figure, computed by one code, a theory.
    Results of several codes are a `consensus_curve`.

    A path that begins with `data:` names a public data set, which is downloaded once.
    Source: the authors of the measurement, given by `citation` or the data set.
    """

    kind_: Annotated[Literal["measurement", "theory", "one_code", "digitised"], "kind of truth"] = "measurement"


@dataclass(frozen=True)
class HysteresisLoop:
    """Loading and unloading branches of a curve: rows of x, y and the uncertainty of y, SI, by increasing x."""

    there: list[Row]
    back: list[Row]

    @property
    def ends(self) -> tuple[float, float]:
        """Smallest and largest x that both branches cover."""
        return max(self.there[0][0], self.back[0][0]), min(self.there[-1][0], self.back[-1][0])

    def within(self, stated: Callable[[Array], Array]) -> HysteresisLoop:
        """Return the loop with an additional uncertainty, added in quadrature to that of each row.

        `stated` is a function that computes the additional uncertainty from values y (n,).
        """
        ways = []
        for way in (self.there, self.back):
            more = stated(np.array([y for _, y, _ in way]))
            ways.append([(x, y, math.hypot(u, float(v))) for (x, y, u), v in zip(way, more, strict=True)])
        return HysteresisLoop(ways[0], ways[1])

    def lost(self, low: float, high: float) -> tuple[float, float] | None:
        """Return the lost fraction of work between two x, and its uncertainty; None if loading takes no work.

        The fraction is 1 - work of unloading / work of loading.
        """
        there, back = (_area_below_rows(way, low, high, 1) for way in (self.there, self.back))
        if not math.isfinite(there) or there == 0.0:
            return None
        off = [_area_below_rows(way, low, high, 2) for way in (self.there, self.back)]
        return 1.0 - back / there, (off[1] + abs(back / there) * off[0]) / abs(there)


@dataclass(frozen=True)
class Repeat:
    """One of several repeated experiments: rows of x, y and the uncertainty of y, SI, with monotonic x.

    `loop` has both branches of a curve that turns back.
    """

    rows: tuple[tuple[float, float, float], ...]
    loop: HysteresisLoop | None = None

    @cached_property
    def sorted(self) -> tuple[tuple[float, ...], ...]:
        """Columns x, y and uncertainty, by increasing x."""
        return tuple(zip(*sorted(self.rows), strict=True))

    @property
    def ends(self) -> tuple[float, float]:
        """Smallest and largest x."""
        x = self.sorted[0]
        return x[0], x[-1]


@dataclass(frozen=True)
class MeasuredCurve:
    """Piecewise linear measured curve with its uncertainty, SI, by increasing x."""

    x: Array  # (n,)
    y: Array  # (n,)
    u: Array  # (n,), of y
    source: str
    repeats: int
    spread: float  # the largest standard deviation between repeats, in the unit of y
    notes: tuple[str, ...] = ()
    loops: tuple[HysteresisLoop, ...] = ()  # of repeats with a way there and one back
    band: tuple[Array, Array] | None = None  # (n,) each: where it is not y - u to y + u

    @property
    def lost(self) -> float | None:
        """Fraction of the work of loading that unloading does not return, on the range that all repeats cover."""
        ends = [loop.ends for loop in self.loops]
        found = self.lost_between(max(a for a, _ in ends), min(b for _, b in ends)) if ends else None
        return None if found is None else found[0]

    def lost_between(self, low: float, high: float) -> tuple[float, float] | None:
        """Return the lost fraction of work between two x, the mean of all repeats, and its uncertainty.

        The uncertainty is the effect of errors of the values, upward on one branch and downward on the other, combined
        in quadrature with the standard deviation between repeats. None if a loop does not cover this range, or takes no
        work.
        """
        if not self.loops or not low < high or any(low < a or high > b for a, b in (one.ends for one in self.loops)):
            return None
        found = [one.lost(low, high) for one in self.loops]
        shares, off = zip(*(one for one in found if one is not None), strict=True) if None not in found else ((), ())
        if not shares:
            return None
        mean = sum(shares) / len(shares)
        spread = sum((share - mean) ** 2 for share in shares) / max(len(shares) - 1, 1)
        return mean, math.sqrt(spread + sum(u * u for u in off) / len(off))

    @property
    def resolution(self) -> float:
        """Largest uncertainty of a value, in the unit of y."""
        return float(self.u.max())


def _common_x_range(repeats: list[Repeat]) -> tuple[float, float]:
    """Return the lower and upper end of the range of x that all repeats cover.

    The range is empty if the lower end is not below the upper one.
    """
    return max(one.ends[0] for one in repeats), min(one.ends[1] for one in repeats)


def _value_or_zero(amount: Any) -> float:
    return 0.0 if amount is None else float(amount.value)


def _require_monotone(name: str, column: str, rows: list[Any], lines: list[int], told: tuple[float, ...]) -> None:
    """Raise Unreadable unless there are two rows and x increases, or decreases, from each row to the next."""
    if len(rows) < 2:
        raise Unreadable(name, "a curve needs at least two rows", "add rows, or choose the other `branch`")
    if _is_monotone(rows):
        return
    up = rows[-1][0] > rows[0][0]
    for i, ((a, *_), (b, *_)) in enumerate(pairwise(rows)):
        if not (b > a if up else b < a):
            what = "stays at" if a == b else "turns back from"
            value = f"{told[i]:.6g}" if a == b else f"{told[i]:.6g} to {told[i + 1]:.6g}"
            raise Unreadable(
                name,
                f"line {lines[i + 1]}, column `{column}`: it {what} {value}",
                "x must increase, or decrease, from row to row: remove repeated rows, or choose another column",
            )


def _is_monotone(rows: list[Any]) -> bool:
    """Return whether x increases, or decreases, from each row to the next."""
    steps = [b[0] - a[0] for a, b in pairwise(rows)]
    return bool(steps) and (min(steps) > 0.0 or max(steps) < 0.0)


def _area_below_rows(rows: list[Row], low: float, high: float, column: int) -> float:
    """Return the area below the piecewise linear column 1 (y) or 2 (its uncertainty), for x from `low` to `high`."""
    area = 0.0
    for one, other in pairwise(rows):
        (a, p), (b, q) = (one[0], one[column]), (other[0], other[column])
        begin, end = max(a, low), min(b, high)
        if end > begin:
            middle = 0.5 * (begin + end)
            area += (end - begin) * (p + (q - p) * (middle - a) / (b - a))
    return area


def _joint_x_values(repeats: list[Repeat]) -> Array:
    """Return every x of the rows of all repeats, sorted, within the range that all repeats cover."""
    low, high = _common_x_range(repeats)
    every = np.unique(np.concatenate([np.asarray(one.sorted[0]) for one in repeats]))
    return every[(every >= low) & (every <= high)]
