"""Numbers as people read them; values are SI, and one column of a table has one unit."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from softmark.interpreter.language import units
from softmark.records import dataclass

SMALL = 1e-4  # plain numbers below that are read as multiples of a power of ten
_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def rounded(value: float, digits: int) -> float:
    """The value with so many significant digits."""
    return float(f"{value:.{digits}g}")


def quantity(value: float, unit: str, digits: int = 6, percent: bool = False) -> str:
    """A value in SI with the unit that fits it, as `units.show` has it; a plain number as `%` if asked."""
    near = rounded(value, digits)
    if percent and is_ratio(unit):
        return signed(f"{near * 100:.6g} %")
    try:
        shown = units.show(near, units.parse(unit).dimension)
    except units.UnitError:
        shown = f"{near:.6g} {unit}".strip()
    if "e-" in shown:  # smaller than the smallest unit that people use
        shown = f"{near:.6g} {unit}"
    return signed(as_asked(shown, unit))


def as_asked(shown: str, unit: str) -> str:
    """`mN*m` for `mJ` where the unit is that of a moment, which no energy is."""
    return f"{shown[:-1]}N*m" if unit == "N*m" and shown.endswith("J") else shown


def is_ratio(unit: str) -> bool:
    """Whether a unit is that of a plain number."""
    return unit in ("1", "")


def signed(number: str) -> str:
    """The minus sign for the hyphen, and powers of ten as such: `−2.3·10⁻⁸ mm`; spaces do not break."""
    head, _, rest = number.partition(" ")
    mantissa, _, exponent = head.partition("e")
    if exponent:
        head = f"{mantissa}·{power_of_ten(int(exponent))}"
    sign = "−" if head.startswith("-") else ""
    return sign + head.removeprefix("-") + ("\u00a0" + rest if rest else "")


def power_of_ten(exponent: int) -> str:
    """`10⁻³`."""
    return "10" + str(exponent).translate(_SUPERSCRIPT)


@dataclass(frozen=True)
class Scale:
    """The unit of a column or of an axis: divide an SI value by `factor`."""

    factor: float
    unit: str  # "" for a plain number

    def text(self, value: float, decimals: int) -> str:
        """The value with the column's decimals, or with three digits where these would leave fewer."""
        own = value / self.factor
        if own == 0:
            return "0"
        few = abs(own) < 10.0 ** (2 - decimals)
        return signed(f"{own:.3g}" if few and abs(own) < 10 else f"{own:.{decimals}f}")

    def fixed(self, value: float, decimals: int) -> str:
        """The value with so many decimals and no more: for coordinates, where less than that is nothing."""
        shown = f"{value / self.factor:.{decimals}f}"
        return signed(shown if float(shown) else shown.removeprefix("-"))

    def heading(self, name: str) -> str:
        """`drop / mm`, the way an axis or a column is labelled."""
        return f"{name} / {self.unit}" if self.unit else name


def scale_of(values: Iterable[float | None], unit: str, percent: bool = False) -> Scale:
    """The scale in which the largest of the values reads well."""
    largest = max((abs(v) for v in values if v is not None), default=0.0)
    if is_ratio(unit):
        power = math.floor(math.log10(largest)) if 0.0 < largest < SMALL and not percent else 0
        plain = Scale(10.0**power, power_of_ten(power)) if power else Scale(1.0, "")
        return Scale(0.01, "%") if percent else plain
    try:
        symbol = units.show(rounded(largest, 4), units.parse(unit).dimension).partition(" ")[2]
        return Scale(units.parse(symbol).factor, as_asked(symbol, unit)) if symbol else Scale(1.0, unit)
    except units.UnitError:
        return Scale(1.0, unit)


def decimals_of(values: Sequence[float | None], scale: Scale, digits: int) -> int:
    """How many decimals give the largest value so many significant digits."""
    largest = max((abs(v) for v in values if v is not None), default=0.0) / scale.factor
    if largest == 0:
        return 0
    return max(0, digits - 1 - math.floor(math.log10(largest)))


def negligible(value: float, largest: float, unit: str, moved: float | None = None) -> bool:
    """Return whether a value is only rounding.

    A value is rounding below 1e-9 of the largest of its column, and a length also below 1e-9 of the largest
    displacement `moved`, m. If `moved` is not known, a length is rounding below 1e-11 m, a tenth of an atom. A plain
    number is rounding below 1e-13, 500 times the rounding error of one, unless displacements are below 1e-11 m:
    strains are then as small.
    """
    if moved is None:
        return abs(value) < 1e-9 * largest or abs(value) < {"m": 1e-11, "1": 1e-13}.get(unit, 0.0)
    floor = {"m": 1e-9 * moved, "1": 1e-13 if moved >= 1e-11 else 0.0}.get(unit, 0.0)
    return abs(value) < max(1e-9 * largest, floor)


def own_error(error: float) -> str:
    """The estimated error of a reference in m, in words; below 1 nm nobody needs to know by how much."""
    return "below 1\u00a0nm" if error < 1e-9 else f"estimated at {quantity(error, 'm', 2)}"


def grouped(n: int) -> str:
    """`4 320` with thin spaces that do not break."""
    return f"{n:,}".replace(",", "\u202f")
