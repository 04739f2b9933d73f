"""Conversion of pint quantities to text of the scene language; pint itself is never imported."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from softmark.interpreter.language import units

# dimensions and units of pint, in the order of units.Dimension; pint has no dimension of angles
BASE = {"[length]": "meter", "[mass]": "kilogram", "[time]": "second", "[temperature]": "kelvin"}
CLOSE = 1e-9  # relative tolerance of two conversions of one quantity to SI


def is_quantity(value: object) -> bool:
    """Return whether a value is a pint quantity, judged by the name of its class."""
    pint = any(base.__module__.partition(".")[0] == "pint" for base in type(value).__mro__)
    return pint and hasattr(value, "magnitude") and hasattr(value, "dimensionality")


def quantity_text(value: Any) -> str | None:
    """Return a quantity as text, such as `60.0 kPa`; None if that is impossible.

    Its own unit is kept if the language has it; otherwise the quantity is converted to SI.
    """
    try:
        exponents = _exponents(value.dimensionality)
        number = float(value.magnitude)
        coherent = float(value.to("*".join(f"{u}**{n}" for u, n in exponents.items() if n) or "").magnitude)
    except (TypeError, ValueError, LookupError, AttributeError):  # an array, amperes, a scale with an offset
        return None
    if not (math.isfinite(number) and math.isfinite(coherent)):
        return None
    dimension = (*exponents.values(), 0)
    own = format(value.units, "~C").replace("**", "^")
    known = _measure(own or "1")
    if known is not None and known.dimension[:4] == dimension[:4] and _is_close(known.factor * number, coherent):
        return f"{number!r} {own}".strip()
    return f"{coherent!r} {units.si_unit(dimension)}".removesuffix(" 1")  # type: ignore[arg-type]


def _exponents(dimensionality: Mapping[str, float]) -> dict[str, int]:
    """Return the exponent of each unit in BASE. Raises LookupError if the language has no such dimension."""
    found = dict.fromkeys(BASE.values(), 0)
    for name, power in dimensionality.items():
        if power != int(power):
            raise LookupError(name)
        found[BASE[name]] = int(power)
    return found


def _measure(text: str) -> units.Measure | None:
    try:
        return units.parse_unit(text)
    except units.UnitError:
        return None


def _is_close(a: float, b: float) -> bool:
    return abs(a - b) <= CLOSE * max(abs(a), abs(b))
