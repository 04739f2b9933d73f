"""Units of measure: a table, a parser of unit expressions, and dimensions with their common names.

To add a unit, add one line to UNITS. All values are SI after reading. The table replaces the usual library of units,
whose import takes 0.4 s at start-up. Angles have their own dimension, so that `30` is never read as degrees or as
radians.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import lru_cache

from softmark.grammar.name_suggestions import nearest
from softmark.records import dataclass

Dimension = tuple[int, int, int, int, int]  # exponents of length, mass, time, temperature, angle

NONE: Dimension = (0, 0, 0, 0, 0)
LENGTH: Dimension = (1, 0, 0, 0, 0)
MASS: Dimension = (0, 1, 0, 0, 0)
TIME: Dimension = (0, 0, 1, 0, 0)
TEMPERATURE: Dimension = (0, 0, 0, 1, 0)
ANGLE: Dimension = (0, 0, 0, 0, 1)
AREA: Dimension = (2, 0, 0, 0, 0)
FORCE: Dimension = (1, 1, -2, 0, 0)
PRESSURE: Dimension = (-1, 1, -2, 0, 0)
ENERGY: Dimension = (2, 1, -2, 0, 0)
LITTLE = 1e-4  # volume fraction below which no percentage is shown

# name: (factor to SI, dimension, takes prefixes)
UNITS: dict[str, tuple[float, Dimension, bool]] = {
    "m": (1.0, LENGTH, True),
    "inch": (0.0254, LENGTH, False),
    "ft": (0.3048, LENGTH, False),
    "g": (1e-3, MASS, True),
    "lb": (0.45359237, MASS, False),
    "s": (1.0, TIME, True),
    "min": (60.0, TIME, False),
    "hour": (3600.0, TIME, False),
    "Hz": (1.0, (0, 0, -1, 0, 0), True),
    "K": (1.0, TEMPERATURE, True),
    "rad": (1.0, ANGLE, True),
    "deg": (0.017453292519943295, ANGLE, False),
    "N": (1.0, FORCE, True),
    "dyn": (1e-5, FORCE, False),
    "kgf": (9.80665, FORCE, False),
    "lbf": (4.4482216152605, FORCE, False),
    "Pa": (1.0, PRESSURE, True),
    "bar": (1e5, PRESSURE, True),
    "atm": (101325.0, PRESSURE, False),
    "psi": (6894.757293168361, PRESSURE, False),
    "mmHg": (133.322387415, PRESSURE, False),
    "J": (1.0, ENERGY, True),
    "W": (1.0, (2, 1, -3, 0, 0), True),
    "%": (0.01, NONE, False),
    "1": (1.0, NONE, False),
}

PREFIXES: dict[str, float] = {
    "p": 1e-12,
    "n": 1e-9,
    "u": 1e-6,
    "µ": 1e-6,  # U+00B5
    "μ": 1e-6,  # U+03BC
    "m": 1e-3,
    "c": 1e-2,
    "d": 1e-1,
    "k": 1e3,
    "M": 1e6,
    "G": 1e9,
    "T": 1e12,
}

# names of dimensions, and their usual units
NAMES: dict[Dimension, tuple[str, str]] = {
    NONE: ("a plain number", "% or no unit"),
    LENGTH: ("a length", "m, cm, mm or µm"),
    MASS: ("a mass", "kg or g"),
    TIME: ("a time", "s or ms"),
    TEMPERATURE: ("a temperature", "K"),
    ANGLE: ("an angle", "deg or rad"),
    AREA: ("an area", "m^2 or mm^2"),
    (3, 0, 0, 0, 0): ("a volume", "m^3 or mm^3"),
    (1, 0, -1, 0, 0): ("a velocity", "m/s or mm/s"),
    (1, 0, -2, 0, 0): ("an acceleration", "m/s^2"),
    (0, 0, -1, 0, 0): ("a frequency", "Hz or kHz"),
    FORCE: ("a force", "N or mN"),
    PRESSURE: ("a pressure", "Pa, kPa, MPa or GPa"),
    ENERGY: ("an energy or a moment", "J or N*m"),
    (2, 1, -3, 0, 0): ("a power", "W"),
    (-3, 1, 0, 0, 0): ("a density", "kg/m^3 or g/cm^3"),
    (0, 1, -2, 0, 0): ("a force per length", "N/m"),
    (-2, 1, -2, 0, 0): ("a force per volume", "N/m^3"),
    (3, -1, 1, 0, 0): ("a hydraulic permeability", "m^4/(N*s) or mm^4/(N*s)"),
}


class UnitError(Exception):
    """Exception for a unit that cannot be read; `problem` is the reason, `remedy` what to write instead.

    `wrong` and `meant` are the part to replace and its replacement, where these are known.
    """

    def __init__(self, problem: str, remedy: str, wrong: str = "", meant: str = "") -> None:
        super().__init__(problem)
        self.problem, self.remedy, self.wrong, self.meant = problem, remedy, wrong, meant

    def mended(self, text: str) -> str:
        """Return the corrected text of the unit; empty if no correction is known."""
        if not self.meant:
            return ""
        return re.sub(rf"(?<![^\W\d_]){re.escape(self.wrong)}(?![^\W\d_])", self.meant, text)


@dataclass(frozen=True)
class Measure:
    """Factor that converts a unit to SI by multiplication, and the dimension of the unit."""

    factor: float
    dimension: Dimension


def dimension_name(dimension: Dimension) -> str:
    """Return the name of a dimension with its article, as `a pressure`, or else `a quantity in kg^2/m`."""
    known = NAMES.get(dimension)
    return known[0] if known else f"a quantity in {si_unit(dimension)}"


def usual_units(dimension: Dimension) -> str:
    """List the usual units of a dimension: `Pa, kPa, MPa or GPa`."""
    known = NAMES.get(dimension)
    return known[1] if known else si_unit(dimension)


def si_unit(dimension: Dimension) -> str:
    """Return the coherent SI unit as text that `parse_unit` reads: `kg/m^3`, `Pa`, `1`."""
    for name, (factor, own, _) in UNITS.items():
        if own == dimension and factor == 1.0:
            return name
    parts = [(s, n) for s, n in zip(("kg", "m", "s", "K", "rad"), _in_base_order(dimension), strict=True) if n]
    top = "*".join(_format_power(s, n) for s, n in parts if n > 0)
    bottom = [_format_power(s, -n) for s, n in parts if n < 0]
    if len(bottom) == 1 and top:
        return f"{top}/{bottom[0]}"
    return "*".join(_format_power(s, n) for s, n in parts)


def vector_unit(dimension: Dimension) -> str:
    """Return the SI unit of a vector's components: `N*m` instead of `J`, because a vector in J is a moment."""
    return {(2, 1, -2, 0, 0): "N*m", (0, 1, -2, 0, 0): "N/m"}.get(dimension) or si_unit(dimension)


def _in_base_order(d: Dimension) -> Dimension:
    return (d[1], d[0], d[2], d[3], d[4])


def _format_power(symbol: str, exponent: int) -> str:
    return symbol if exponent == 1 else f"{symbol}^{exponent}"


def multiply_dimensions(a: Dimension, b: Dimension, sign: int = 1) -> Dimension:
    """Return the dimension of a product (sign 1) or of a quotient (sign -1)."""
    return (a[0] + sign * b[0], a[1] + sign * b[1], a[2] + sign * b[2], a[3] + sign * b[3], a[4] + sign * b[4])


def raise_dimension(a: Dimension, n: int) -> Dimension:
    """Return the dimension of the n-th power of a quantity."""
    return (a[0] * n, a[1] * n, a[2] * n, a[3] * n, a[4] * n)


SMALLEST, LARGEST = 1e-300, 1e300  # range of unit factors: beyond it, products would underflow or overflow
_PART = re.compile(r"([*/]?)(\([^()]*\)|[^*/()]+)")
_FACTOR = re.compile(r"(°?[A-Za-zµμ%]+|1)(?:\^([+-]?\d+))?")


@lru_cache(maxsize=1024)
def parse_unit(text: str) -> Measure:
    """Parse a unit: `kg/m^3`, `N*m`, `J/(kg*K)`, `mm`, `%`. Raises UnitError."""
    parts = _PART.findall(text.replace("·", "*"))
    if not parts or "".join(operator + part for operator, part in parts) != text.replace("·", "*"):
        raise _unreadable_unit_error(text)
    _refuse_declared_names(parts, text)
    if any(operator == "/" for operator, _ in parts[:-1]):
        remedy = "put the divisor in brackets, as in `J/(kg*K)`, or use negative powers: `J*kg^-1*K^-1`"
        raise UnitError(f"`{text}` can be read in two ways", remedy)
    factor, dimension = 1.0, NONE
    for operator, part in parts:
        sign = -1 if operator == "/" else 1
        one = parse_unit(part[1:-1]) if part.startswith("(") else _parse_unit_symbol(part, text)
        factor *= one.factor**sign
        dimension = multiply_dimensions(dimension, one.dimension, sign)
        if not SMALLEST <= factor <= LARGEST:
            remedy = f"use a unit between {SMALLEST:g} and {LARGEST:g} times the SI unit"
            raise UnitError(f"the unit `{text}` is too large or too small", remedy)
    return Measure(factor, dimension)


def _refuse_declared_names(parts: list[tuple[str, str]], whole: str) -> None:
    """Refuse a unit such as `GPa*b^4` where `b` may be a declared name, since without blanks it reads as a unit."""
    for operator, part in parts:
        symbol = part.partition("^")[0]
        named = operator == "*" and re.fullmatch(r"[A-Za-z_]\w*", symbol)
        if named and symbol not in _MEANT and not _is_known_unit(symbol):
            first, _, rest = whole.partition(f"*{part}")
            meant = f"{first} * {part}{rest}"
            wrong, remedy = whole, f"if `{symbol}` is a name, put blanks around `*`: `{meant}`"
            if nearest(symbol, _all_prefixed_units()):
                hint, meant = _unknown_symbol_advice(symbol)
                wrong, remedy = symbol, f"{hint}; {remedy}"
            raise UnitError(f"`{symbol}` in `{whole}` is not a known unit", remedy, wrong, meant)


def _parse_unit_symbol(part: str, whole: str) -> Measure:
    """Parse one unit symbol with its power. Raises UnitError."""
    match = _FACTOR.fullmatch(part)
    if match is None:
        raise _unreadable_unit_error(whole, part)
    base, exponent = _look_up_symbol(match[1], whole), int(match[2] or 1)
    if abs(exponent) > 12:
        raise UnitError(f"the power in `{whole}` is too large", "powers of units go up to 12")
    return Measure(base.factor**exponent, raise_dimension(base.dimension, exponent))


_RAISED = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")


def _unreadable_unit_error(whole: str, part: str = "") -> UnitError:
    """Return the error for an unreadable unit, such as `m3` for `m^3` or a fractional power."""
    if re.search(r"\^[+-]?\d+\.", part):
        return UnitError(
            f"the power in `{whole}` is not a whole number", "units have whole powers: take a root with `sqrt(...)`"
        )
    meant = re.sub(r"([^\W\d_])(-?\d+)(?=$|[*/)])", r"\1^\2", whole.translate(_RAISED))
    if meant != whole and _is_known_unit(meant):
        return UnitError(f"`{whole}` is not a unit", f"write `{meant}`", whole, meant)
    return UnitError(f"`{whole}` is not a unit", "units look like `kPa`, `kg/m^3` or `N*m`, without spaces")


SAME = 1e-9  # relative difference below which two factors are the same unit
_BRACKETS = re.compile(r"[(\[]([^()\[\]]+)[)\]]\s*$")


def unit_in_column_name(column: str) -> Measure | None:
    """Return the unit at the end of a column's name, as in `Load (N)` or `t [ms]`; None if there is none."""
    found = _BRACKETS.search(column)
    return parse_unit(inner) if found and _is_known_unit(inner := found[1].strip()) else None


def has_conflicting_unit(column: str, factor: float, dimension: Dimension) -> bool:
    """Return whether a column's name ends in a different unit of the same dimension: `Load (N)` for values in kN."""
    said = unit_in_column_name(column)
    return said is not None and said.dimension == dimension and abs(said.factor / factor - 1.0) >= SAME


def _is_known_unit(text: str) -> bool:
    try:
        parse_unit(text)
    except UnitError:
        return False
    return True


def _look_up_symbol(symbol: str, whole: str) -> Measure:
    if symbol in UNITS:
        factor, dimension, _ = UNITS[symbol]
        return Measure(factor, dimension)
    prefix, rest = symbol[:1], symbol[1:]
    if prefix in PREFIXES and rest in UNITS and UNITS[rest][2]:
        factor, dimension, _ = UNITS[rest]
        return Measure(PREFIXES[prefix] * factor, dimension)
    place = f"`{symbol}`" if symbol == whole else f"`{symbol}` in `{whole}`"
    hint, meant = _unknown_symbol_advice(symbol)
    raise UnitError(f"{place} is not a known unit", hint, symbol, meant)


# common misspellings, and the unit meant
_MEANT = {
    "kpa": "kPa", "mpa": "MPa", "gpa": "GPa", "pa": "Pa", "PA": "Pa", "KPa": "kPa", "Mpa": "MPa",
    "kPA": "kPa",
    "MM": "mm", "CM": "cm", "meter": "m", "metre": "m", "meters": "m", "metres": "m", "in": "inch",
    "inches": "inch", "feet": "ft", "foot": "ft", "lbs": "lb", "pound": "lb", "pounds": "lb",
    "KG": "kg", "Kg": "kg", "gram": "g", "grams": "g", "kilogram": "kg", "kilograms": "kg",
    "sec": "s", "second": "s", "seconds": "s", "msec": "ms", "minute": "min", "minutes": "min",
    "h": "hour", "hr": "hour", "hours": "hour", "hz": "Hz", "HZ": "Hz", "hertz": "Hz",
    "n": "N", "Newton": "N", "newton": "N", "newtons": "N", "joule": "J", "watt": "W",
    "degree": "deg", "degrees": "deg", "radian": "rad", "radians": "rad", "percent": "%", "pct": "%",
    "kelvin": "K", "micron": "um", "microns": "um", "millimeter": "mm",
    "millimeters": "mm", "millimetre": "mm", "millimetres": "mm", "centimeter": "cm", "centimetre": "cm",
    "pascal": "Pa", "pascals": "Pa", "Pascal": "Pa", "kilopascal": "kPa", "kilopascals": "kPa",
    "megapascal": "MPa",
    "torr": "mmHg", "Torr": "mmHg", "mmhg": "mmHg",
}  # fmt: skip


def _unknown_symbol_advice(symbol: str) -> tuple[str, str]:
    """Return advice about an unknown unit symbol, and the unit probably meant or an empty text."""
    if symbol in ("C", "degC", "°C", "F", "degF", "°F"):
        return "temperatures are in `K`: 20 °C are 293.15 K", ""
    if symbol in _MEANT:
        return f"write `{_MEANT[symbol]}`", _MEANT[symbol]
    folded = [u for u in _all_prefixed_units() if u.lower() == symbol.lower()]
    if folded:
        least = min(folded, key=lambda u: sum(a != b for a, b in zip(u, symbol, strict=True)))
        return f"write `{least}`: upper and lower case differ in units", least
    if close := nearest(symbol, (*_all_prefixed_units(), *_MEANT)):
        return f"did you mean `{_MEANT.get(close, close)}`?", _MEANT.get(close, close)
    return "units look like `kPa`, `kg/m^3` or `N*m`; `dsl list units` shows them all", ""


@lru_cache(maxsize=1)
def _all_prefixed_units() -> tuple[str, ...]:
    """Return all units with all their prefixes."""
    return tuple(p + u for u, (_, _, prefixed) in UNITS.items() for p in ("", *(PREFIXES if prefixed else ())))


def format_value(value: float, dimension: Dimension) -> str:
    """Format a value in SI with a suitable unit and six significant digits: `128.449 mm`, `60 kPa`, `30 deg`."""
    factor, unit = _choose_unit(value, dimension)
    return f"{value / factor:.6g} {unit}".removesuffix(" 1")


def format_vector(values: Sequence[float], dimension: Dimension) -> str:
    """Format the components of a vector in one unit: `(178, 0, 0) mm`."""
    largest = max(values, key=abs)
    factor, unit = _choose_unit(largest, dimension)
    return f"({', '.join(f'{v / factor:.6g}' for v in values)}) {unit}".removesuffix(" 1")


def format_range(low: float, high: float, dimension: Dimension) -> str:
    """Format a range in one unit: `0 to 178 mm`."""
    factor, unit = _choose_unit(max(low, high, key=abs), dimension)
    return f"{low / factor:.6g} to {high / factor:.6g} {unit}".removesuffix(" 1")


def format_volume_fraction(share: float) -> str:
    """Format a volume fraction in per cent; a negligible one is described in words."""
    return "less than 0.01 %" if share < LITTLE else f"{100.0 * share:.3g} %"


def _choose_unit(value: float, dimension: Dimension) -> tuple[float, str]:
    """Return factor and name of the unit that suits the size of a value.

    It is the SI unit for zero, or if no listed unit is close.
    """
    choices = _SHOWN.get(dimension, ((1.0, si_unit(dimension)),))
    if not choices[-1][0] * 1e-3 <= abs(value) < choices[0][0] * 1e6:
        return 1.0, si_unit(dimension)
    return next((c for c in choices if abs(value) >= c[0]), choices[-1])


_SHOWN: dict[Dimension, tuple[tuple[float, str], ...]] = {
    LENGTH: ((1e3, "km"), (1.0, "m"), (1e-3, "mm"), (1e-6, "µm"), (1e-9, "nm"), (1e-12, "pm")),
    AREA: ((1.0, "m^2"), (1e-6, "mm^2")),
    PRESSURE: ((1e12, "TPa"), (1e9, "GPa"), (1e6, "MPa"), (1e3, "kPa"), (1.0, "Pa")),
    TIME: ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs")),
    FORCE: ((1e3, "kN"), (1.0, "N"), (1e-3, "mN"), (1e-6, "µN")),
    ENERGY: ((1e3, "kJ"), (1.0, "J"), (1e-3, "mJ"), (1e-6, "µJ")),
    ANGLE: ((0.017453292519943295, "deg"),),
}
