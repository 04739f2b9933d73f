"""Units that a dimension is given in, the usual ones first."""

from __future__ import annotations

import re
from functools import cache

from softmark.interpreter.language import units
from softmark.interpreter.language.units import Dimension

PREFIXES = {  # of those that a unit takes, the ones that people use
    "m": "nµmck", "g": "µmk", "s": "nµm", "Hz": "kM", "K": "m", "rad": "m", "N": "µmkM", "Pa": "mkMG", "bar": "m",
    "J": "µmkM", "W": "mk",
}  # fmt: skip


@cache
def measures(dimension: Dimension) -> tuple[str, ...]:
    """The usual ones, and what else has a word of its own: `Pa`, `kPa`, ..., `bar`, `mmHg`; `%` of plain numbers."""
    usual = [word for word in re.split(r",? or |, ", units.usual_units(dimension)) if word not in ("no unit", "1")]
    alone = [
        prefix + unit
        for unit, (_, own, _) in units.UNITS.items()
        if own == dimension and unit != "1"
        for prefix in ("", *PREFIXES.get(unit, ""))
    ]
    return tuple(dict.fromkeys((*usual, *alone)))


@cache
def common() -> tuple[tuple[str, Dimension], ...]:
    """The usual units of all dimensions that have a name."""
    return tuple((unit, dimension) for dimension in units.NAMES for unit in measures(dimension)[:4])


def meaning(unit: str) -> str:
    """What a unit measures and its size in SI: `a pressure, 1000 Pa`."""
    measure = units.parse_unit(unit)
    return f"{units.dimension_name(measure.dimension)}, {measure.factor:.12g} {units.si_unit(measure.dimension)}".removesuffix(
        " 1"
    )
