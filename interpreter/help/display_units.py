"""Units in which a quantity of a physical dimension is suggested and shown, the most common first."""

from __future__ import annotations

import re
from functools import cache

from softmark.interpreter.language import units
from softmark.interpreter.language.units import Dimension

PREFIXES = {  # the commonly used prefixes of each unit
    "m": "nµmck", "g": "µmk", "s": "nµm", "Hz": "kM", "K": "m", "rad": "m", "N": "µmkM", "Pa": "mkMG", "bar": "m",
    "J": "µmkM", "W": "mk",
}  # fmt: skip


@cache
def units_of(dimension: Dimension) -> tuple[str, ...]:
    """Return the common units of a dimension, then its other named units: `Pa`, `kPa`, ..., `bar`, `mmHg`.

    For dimensionless numbers the list contains `%`.
    """
    usual = [word for word in re.split(r",? or |, ", units.usual_units(dimension)) if word not in ("no unit", "1")]
    alone = [
        prefix + unit
        for unit, (_, own, _) in units.UNITS.items()
        if own == dimension and unit != "1"
        for prefix in ("", *PREFIXES.get(unit, ""))
    ]
    return tuple(dict.fromkeys((*usual, *alone)))


@cache
def common_units() -> tuple[tuple[str, Dimension], ...]:
    """Return pairs of unit and dimension: the common units of all dimensions that have a name."""
    return tuple((unit, dimension) for dimension in units.NAMES for unit in units_of(dimension)[:4])


def describe_unit(unit: str) -> str:
    """Return the quantity that a unit measures and its size in SI: `a pressure, 1000 Pa`."""
    measure = units.parse_unit(unit)
    size = f"{measure.factor:.12g} {units.si_unit(measure.dimension)}"
    return f"{units.dimension_name(measure.dimension)}, {size}".removesuffix(" 1")
