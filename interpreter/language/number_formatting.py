"""Formatting of numbers for readers; values are in SI units, and a column of a table has one unit."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from softmark.interpreter.language import units
from softmark.records import dataclass

SMALL = 1e-4  # plain numbers below this are shown with a power of ten
_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def round_significant(value: float, digits: int) -> float:
    """Round a value to a number of significant digits."""
    return float(f"{value:.{digits}g}")


def format_quantity(value: float, unit: str, digits: int = 6, percent: bool = False) -> str:
    """Format a value in SI with a suitable unit, as `units.format_value` does; plain numbers as `%` with `percent`."""
    near = round_significant(value, digits)
    if percent and is_ratio(unit):
        return typeset_number(f"{near * 100:.6g} %")
    try:
        shown = units.format_value(near, units.parse_unit(unit).dimension)
    except units.UnitError:
        shown = f"{near:.6g} {unit}".strip()
    if "e-" in shown:  # smaller than the smallest unit that people use
        shown = f"{near:.6g} {unit}"
    return typeset_number(format_moment_unit(shown, unit))


def format_moment_unit(shown: str, unit: str) -> str:
    """Replace `mJ` by `mN*m` if the unit is that of a moment, not of an energy."""
    return f"{shown[:-1]}N*m" if unit == "N*m" and shown.endswith("J") else shown


def is_ratio(unit: str) -> bool:
    """Return whether a unit is that of a plain number."""
    return unit in ("1", "")


def typeset_number(number: str) -> str:
    """Write a number with a true minus sign and power of ten, `−2.3·10⁻⁸ mm`, and with spaces that do not break."""
    head, _, rest = number.partition(" ")
    mantissa, _, exponent = head.partition("e")
    if exponent:
        head = f"{mantissa}·{power_of_ten(int(exponent))}"
    sign = "−" if head.startswith("-") else ""
    return sign + head.removeprefix("-") + ("\u00a0" + rest if rest else "")


def power_of_ten(exponent: int) -> str:
    """Format a power of ten: `10⁻³`."""
    return "10" + str(exponent).translate(_SUPERSCRIPT)


@dataclass(frozen=True)
class Scale:
    """Unit of a table column or an axis; SI values are divided by `factor`."""

    factor: float
    unit: str  # "" for a plain number

    def text(self, value: float, decimals: int) -> str:
        """Format a value with the column's decimals, or with three significant digits if these would leave fewer."""
        own = value / self.factor
        if own == 0:
            return "0"
        few = abs(own) < 10.0 ** (2 - decimals)
        return typeset_number(f"{own:.3g}" if few and abs(own) < 10 else f"{own:.{decimals}f}")

    def fixed(self, value: float, decimals: int) -> str:
        """Format a value, for coordinates, with exactly the given number of decimals."""
        shown = f"{value / self.factor:.{decimals}f}"
        return typeset_number(shown if float(shown) else shown.removeprefix("-"))

    def heading(self, name: str) -> str:
        """Return the label of an axis or column: `drop / mm`."""
        return f"{name} / {self.unit}" if self.unit else name


def choose_scale(values: Iterable[float | None], unit: str, percent: bool = False) -> Scale:
    """Choose the unit in which the largest of the values reads well."""
    largest = max((abs(v) for v in values if v is not None), default=0.0)
    if is_ratio(unit):
        power = math.floor(math.log10(largest)) if 0.0 < largest < SMALL and not percent else 0
        plain = Scale(10.0**power, power_of_ten(power)) if power else Scale(1.0, "")
        return Scale(0.01, "%") if percent else plain
    try:
        symbol = units.format_value(round_significant(largest, 4), units.parse_unit(unit).dimension).partition(" ")[2]
        return Scale(units.parse_unit(symbol).factor, format_moment_unit(symbol, unit)) if symbol else Scale(1.0, unit)
    except units.UnitError:
        return Scale(1.0, unit)


def choose_decimals(values: Sequence[float | None], scale: Scale, digits: int) -> int:
    """Return the number of decimals with which the largest value has the given number of significant `digits`."""
    largest = max((abs(v) for v in values if v is not None), default=0.0) / scale.factor
    if largest == 0:
        return 0
    return max(0, digits - 1 - math.floor(math.log10(largest)))


def is_negligible(value: float, largest: float, unit: str, moved: float | None = None) -> bool:
    """Return whether a value is only rounding error.

    A value is rounding below 1e-9 of the largest of its column, and a length also below 1e-9 of the largest
    displacement `moved`, m. If `moved` is not known, a length is rounding below 1e-11 m, a tenth of an atom. A plain
    number is rounding below 1e-13, 500 times the rounding error of one. That limit does not hold if displacements are
    below 1e-11 m, because strains are then as small.
    """
    if moved is None:
        return abs(value) < 1e-9 * largest or abs(value) < {"m": 1e-11, "1": 1e-13}.get(unit, 0.0)
    floor = {"m": 1e-9 * moved, "1": 1e-13 if moved >= 1e-11 else 0.0}.get(unit, 0.0)
    return abs(value) < max(1e-9 * largest, floor)


def format_reference_error(error: float) -> str:
    """Format the estimated error of a reference, m; below 1 nm the number is not given."""
    return "below 1\u00a0nm" if error < 1e-9 else f"estimated at {format_quantity(error, 'm', 2)}"


def group_digits(n: int) -> str:
    """Format an integer with thin spaces that do not break: `4 320`."""
    return f"{n:,}".replace(",", "\u202f")
