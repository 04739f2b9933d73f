"""Units of the numbers in a file, given on the command line or declared by the file (as FEBio decks may do).

All other units follow from length, stress and time: a force is a stress times an area, a density a stress times time
squared by length squared. To add a system: a line in SYSTEMS.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from softmark.interpreter.language.units import LENGTH, PRESSURE, TIME, Dimension, UnitError, dimension_name, parse_unit

DENSITY: Dimension = (-3, 1, 0, 0, 0)
SYSTEMS: dict[str, tuple[str, str, str]] = {  # name (length, mass, time): units of length, stress, time
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
SAME = 1e-9  # relative difference below which two units are the same
GIVE = (
    "give its length unit, `--unit 1mm`, and its stress unit, `--stress 1MPa`; or a consistent system: `--units` "
    f"{', '.join(SYSTEMS)}"
)
_QUANTITY = re.compile(r"\s*([0-9.]+(?:[eE][-+]?[0-9]+)?)?\s*(\S+)\s*")


class MissingUnit(Exception):
    """Exception for a required unit that is missing or invalid; it has the reason and the remedy."""

    def __init__(self, reason: str, remedy: str) -> None:
        super().__init__(reason)
        self.reason, self.remedy = reason, remedy


class ContradictoryUnits(Exception):
    """Exception for given units that contradict those in the file; it has the reason and the remedy."""

    def __init__(self, reason: str, remedy: str) -> None:
        super().__init__(reason)
        self.reason, self.remedy = reason, remedy


@dataclass(frozen=True)
class DeclaredUnits:
    """Unit system that a file declares: its text there, and its name in SYSTEMS (None if unknown)."""

    text: str
    system: str | None


@dataclass(frozen=True)
class FileUnit:
    """Unit of a file: its text in a scene, and its value in SI units."""

    text: str
    factor: float


@dataclass(frozen=True)
class FileUnits:
    """Units of length and stress in a file, and of time if given."""

    length: FileUnit
    stress: FileUnit | None = None
    time: FileUnit | None = None
    system: str = ""

    def format_length(self, value: float) -> str:
        """Format a length of the file with its unit, as a scene writes it."""
        return _format_with_unit(value, self.length)

    def format_stress(self, value: float) -> str:
        """Format a stress for a scene. Raises MissingUnit."""
        return _format_with_unit(value, self._require_stress_unit("stresses"))

    def force_in_newtons(self, value: float) -> float:
        """Return a force in N. Raises MissingUnit."""
        return _require_finite(value * self._require_stress_unit("forces").factor * self.length.factor**2)

    def format_density(self, value: float) -> str:
        """Format a density for a scene. Raises MissingUnit."""
        whole = (
            self._require_stress_unit("densities").factor
            * (self._require_time_factor("densities") / self.length.factor) ** 2
        )
        return f"{_require_finite(value * whole)!r} kg/m^3"

    def acceleration_in_si(self, value: float) -> float:
        """Return an acceleration in m/s^2. Raises MissingUnit."""
        return _require_finite(value * self.length.factor / self._require_time_factor("accelerations") ** 2)

    def _require_stress_unit(self, of: str) -> FileUnit:
        if self.stress is None:
            raise MissingUnit(f"the file has {of}, but no stress unit",
                          "give the stress unit, `--stress 1MPa`, or `--units mm-t-s`")  # fmt: skip
        return self.stress

    def _require_time_factor(self, of: str) -> float:
        if self.time is None:
            raise MissingUnit(f"the file has {of}, but no time unit",
                          "give the time unit, `--time 1s`, or `--units mm-t-s`")  # fmt: skip
        return self.time.factor


def _require_finite(value: float) -> float:
    if not math.isfinite(value):
        raise MissingUnit("a number of the file is out of range in these units", "give the units of the file")
    return value


def _format_with_unit(value: float, one: FileUnit) -> str:
    _require_finite(value * one.factor)
    number, unit = one.text.split(" ")
    return f"{value!r} {unit}" if number == "1" else f"{value!r} * {one.text}"


def agree_on_units(told: FileUnits | None, declared: DeclaredUnits | None) -> FileUnits:
    """Return the given units, or else those that the file declares, after checking that they agree.

    Raises MissingUnit, ContradictoryUnits.
    """
    known = None if declared is None or declared.system is None else units_of_system(declared.system)
    if told is None and known is None:
        if declared is not None:
            raise MissingUnit(f"the file declares the unknown unit system `{declared.text[:40]}`", GIVE)
        raise MissingUnit("the units of the file are not given, and are not guessed", GIVE)
    if told is None or known is None or declared is None:
        return told or known  # type: ignore[return-value]  # one of them is there
    for what, own, theirs in (("length", told.length, known.length), ("stress", told.stress, known.stress),
                              ("time", told.time, known.time)):  # fmt: skip
        if own is not None and theirs is not None and not math.isclose(own.factor, theirs.factor, rel_tol=SAME):
            raise ContradictoryUnits(
                f"the file declares the units `{declared.text[:40]}`, whose unit of {what} is {theirs.text}, but the "
                f"command line has {own.text}",
                "remove the units from the command line, or correct `<units>` in the file",
            )
    return known


def units_of_system(system: str) -> FileUnits:
    """Return the units of a system in SYSTEMS."""
    m, pa, s = (FileUnit(f"1 {text}", parse_unit(text).factor) for text in SYSTEMS[system])
    return FileUnits(m, pa, s, system)


def read_unit_options(system: str | None, length: str | None, stress: str | None, time: str | None) -> FileUnits:
    """Return the units given on the command line. Raises MissingUnit."""
    if system is not None:
        if length or stress or time:
            raise MissingUnit(f"`--units {system}` cannot be combined with other units", "give one or the other")
        if system not in SYSTEMS:
            raise MissingUnit(f"`{system}` is not a known system of units", "use " + ", ".join(SYSTEMS))
        return units_of_system(system)
    if length is None:
        raise MissingUnit("the units of the file are not given, and are not guessed", GIVE)
    return FileUnits(
        parse_file_unit("--unit", length, LENGTH),
        parse_file_unit("--stress", stress, PRESSURE) if stress else None,
        parse_file_unit("--time", time, TIME) if time else None,
    )


def parse_file_unit(option: str, text: str, dimension: Dimension) -> FileUnit:
    """Parse a quantity such as `1mm` or `2.5 kPa` as a unit. Raises MissingUnit."""
    remedy = {LENGTH: "1mm", PRESSURE: "1MPa", TIME: "1s", DENSITY: "1000kg/m^3"}[dimension]
    found = _QUANTITY.fullmatch(text)
    if found is None:
        raise MissingUnit(f"`{option} {text}` is not a quantity", f"write `{option} {remedy}`")
    try:
        number = float(found[1] or 1)
        measure = parse_unit(found[2])
    except (UnitError, ValueError) as error:
        raise MissingUnit(f"`{option} {text}` is not a quantity: {error}", f"write `{option} {remedy}`") from None
    if measure.dimension != dimension or not 0.0 < number * measure.factor < 1e300:
        raise MissingUnit(f"`{option} {text}` is not {dimension_name(dimension)}", f"write `{option} {remedy}`")
    return FileUnit(f"{found[1] or 1} {found[2]}", number * measure.factor)
