"""Units of the numbers in a file: told on the command line, or declared by the file (decks of FEBio may do so).

Length, stress and time give all others: a force is a stress times an area, a density a stress times time squared by
length squared. To add a system: a line in SYSTEMS.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from softmark.interpreter.language.units import LENGTH, PRESSURE, TIME, Dimension, UnitError, dimension_name, parse_unit

DENSITY: Dimension = (-3, 1, 0, 0, 0)
SYSTEMS: dict[str, tuple[str, str, str]] = {  # its name in the order length, mass, time: length, stress, time
    "m-kg-s": ("m", "Pa", "s"),
    "mm-t-s": ("mm", "MPa", "s"),
    "mm-kg-s": ("mm", "kPa", "s"),
    "mm-g-s": ("mm", "Pa", "s"),
    "mm-kg-ms": ("mm", "GPa", "ms"),
    "mm-g-ms": ("mm", "MPa", "ms"),
    "mm-mg-s": ("mm", "mPa", "s"),
    "um-g-s": ("um", "kPa", "s"),
    "cm-g-s": ("cm", "dPa", "s"),
}
SAME = 1e-9  # relative difference of two units that are the same one: rounding of their factors
GIVE = (
    "say what one unit of its lengths is, `--unit 1mm`, and of its stresses, `--stress 1MPa`; or name a "
    f"consistent system: `--units` {', '.join(SYSTEMS)}"
)
_QUANTITY = re.compile(r"\s*([0-9.]+(?:[eE][-+]?[0-9]+)?)?\s*(\S+)\s*")


class Unasked(Exception):
    """A unit that is needed and was not told, or cannot be one: why, and what to give."""

    def __init__(self, reason: str, remedy: str) -> None:
        super().__init__(reason)
        self.reason, self.remedy = reason, remedy


class Contradicted(Exception):
    """Units that were told and that the file contradicts: the reason, and what to do."""

    def __init__(self, reason: str, remedy: str) -> None:
        super().__init__(reason)
        self.reason, self.remedy = reason, remedy


@dataclass(frozen=True)
class Declared:
    """Units that a file declares: its own words, and the same system in SYSTEMS (None if it is not known)."""

    text: str
    system: str | None


@dataclass(frozen=True)
class One:
    """One unit of a file: how a scene writes it, and what it is in SI."""

    text: str
    factor: float


@dataclass(frozen=True)
class Units:
    """One unit of lengths and of stresses, and of times where they were told."""

    length: One
    stress: One | None = None
    time: One | None = None
    system: str = ""

    def of_length(self, value: float) -> str:
        """As a scene has it."""
        return _written(value, self.length)

    def of_stress(self, value: float) -> str:
        """As a scene has it. Raises Unasked."""
        return _written(value, self._stress("stresses"))

    def of_force(self, value: float) -> float:
        """In N. Raises Unasked."""
        return _sized(value * self._stress("forces").factor * self.length.factor**2)

    def of_density(self, value: float) -> str:
        """As a scene has it. Raises Unasked."""
        whole = self._stress("densities").factor * (self._time("densities") / self.length.factor) ** 2
        return f"{_sized(value * whole)!r} kg/m^3"

    def of_acceleration(self, value: float) -> float:
        """In m/s^2. Raises Unasked."""
        return _sized(value * self.length.factor / self._time("accelerations") ** 2)

    def _stress(self, of: str) -> One:
        if self.stress is None:
            raise Unasked(f"the file has {of}, and not their unit",
                          "say what one unit of its stresses is: `--stress 1MPa`, or `--units mm-t-s`")  # fmt: skip
        return self.stress

    def _time(self, of: str) -> float:
        if self.time is None:
            raise Unasked(f"the file has {of}, and not the unit of its times",
                          "say what one unit of its times is: `--time 1s`, or `--units mm-t-s`")  # fmt: skip
        return self.time.factor


def _sized(value: float) -> float:
    if not math.isfinite(value):
        raise Unasked("a number of the file is beyond all sizes in these units", "say the units that the file has")
    return value


def _written(value: float, one: One) -> str:
    _sized(value * one.factor)
    number, unit = one.text.split(" ")
    return f"{value!r} {unit}" if number == "1" else f"{value!r} * {one.text}"


def agreed(told: Units | None, declared: Declared | None) -> Units:
    """Units that were told, those that the file declares, or both if they agree. Raises Unasked, Contradicted."""
    known = None if declared is None or declared.system is None else of_system(declared.system)
    if told is None and known is None:
        if declared is not None:
            raise Unasked(
                f"the file declares its units as `{declared.text[:40]}`, which is no system that is known", GIVE
            )
        raise Unasked("a file does not say in which units its numbers are, and none are guessed", GIVE)
    if told is None or known is None or declared is None:
        return told or known  # type: ignore[return-value]  # one of them is there
    for what, own, theirs in (("length", told.length, known.length), ("stress", told.stress, known.stress),
                              ("time", told.time, known.time)):  # fmt: skip
        if own is not None and theirs is not None and not math.isclose(own.factor, theirs.factor, rel_tol=SAME):
            raise Contradicted(
                f"the file declares the units `{declared.text[:40]}`, whose unit of {what} is {theirs.text}, and the "
                f"command line says {own.text}",
                "leave the units out of the command line, or correct `<units>` in the file if it is wrong there",
            )
    return known


def of_system(system: str) -> Units:
    """The units of a system in SYSTEMS."""
    m, pa, s = (One(f"1 {text}", parse_unit(text).factor) for text in SYSTEMS[system])
    return Units(m, pa, s, system)


def told(system: str | None, length: str | None, stress: str | None, time: str | None) -> Units:
    """What was told on a command line. Raises Unasked."""
    if system is not None:
        if length or stress or time:
            raise Unasked(f"`--units {system}` says all units, and others are given beside it", "give one or the other")
        if system not in SYSTEMS:
            raise Unasked(f"`{system}` is no system of units that is known", "known are " + ", ".join(SYSTEMS))
        return of_system(system)
    if length is None:
        raise Unasked("a file does not say in which units its numbers are, and none are guessed", GIVE)
    return Units(
        one("--unit", length, LENGTH),
        one("--stress", stress, PRESSURE) if stress else None,
        one("--time", time, TIME) if time else None,
    )


def one(option: str, text: str, dimension: Dimension) -> One:
    """A quantity such as `1mm` or `2.5 kPa`. Raises Unasked."""
    remedy = {LENGTH: "1mm", PRESSURE: "1MPa", TIME: "1s", DENSITY: "1000kg/m^3"}[dimension]
    found = _QUANTITY.fullmatch(text)
    if found is None:
        raise Unasked(f"`{option} {text}` is no quantity", f"write `{option} {remedy}`")
    try:
        number = float(found[1] or 1)
        measure = parse_unit(found[2])
    except (UnitError, ValueError) as error:
        raise Unasked(f"`{option} {text}` is no quantity: {error}", f"write `{option} {remedy}`") from None
    if measure.dimension != dimension or not 0.0 < number * measure.factor < 1e300:
        raise Unasked(f"`{option} {text}` is not {dimension_name(dimension)}", f"write `{option} {remedy}`")
    return One(f"{found[1] or 1} {found[2]}", number * measure.factor)
