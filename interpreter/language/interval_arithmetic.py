"""All values of an expression of the coordinates over boxes: interval arithmetic (Moore 1966), on arrays of boxes.

What it tells holds at every place of a box, and not at some of them alone; it may hold a few values too many.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softmark.interpreter.language.spatial_profiles import Node, constant
from softmark.records import dataclass

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True)
class Values:
    """Between two bounds (n,) over n boxes; where it `may` have no value, and where it has `none` all over (n,)."""

    low: Floats
    high: Floats
    may: Bools
    none: Bools

    def combined(self, other: Values, low: Floats, high: Floats) -> Values:
        """Bounds of what is made of this and another."""
        return _made(low, high, self.may | other.may, self.none | other.none)

    def without(self, may: Bools, none: Bools, low: Floats, high: Floats) -> Values:
        """Bounds of what is made of this, which has no value at more places."""
        return _made(low, high, self.may | may | none, self.none | none)

    @property
    def zero(self) -> Bools:
        """Where it is zero, or nothing, all over a box."""
        found: Bools = self.none | ((self.low == 0.0) & (self.high == 0.0) & ~self.may)
        return found

    @property
    def sound(self) -> Bools:
        """Where it has a value all over a box that is not zero."""
        found: Bools = ~self.may & ((self.low > 0.0) | (self.high < 0.0))
        return found


FieldBounds = Callable[[Any, Floats, Floats], tuple[Floats, Floats]]  # of a field and boxes: least, largest values (n,)


def over(node: Node, low: Floats, high: Floats, fields: FieldBounds | None = None) -> Values:
    """Bounds of an expression over boxes from `low` to `high` (n, 3), m; a field has none without `fields`."""
    with np.errstate(all="ignore"):
        return _over(node, low, high, fields)


def _made(low: Floats, high: Floats, may: Bools, none: Bools) -> Values:
    """Bounds, without any where they are not numbers."""
    odd = np.isnan(low) | np.isnan(high)
    return Values(np.where(odd, -np.inf, low), np.where(odd, np.inf, high), may, none)


def _over(node: Node, low: Floats, high: Floats, fields: FieldBounds | None) -> Values:
    nowhere = np.zeros(len(low), dtype=np.bool_)
    match node.do:
        case "number":
            value = np.full(len(low), float(node.value))
            return Values(value, value, nowhere, nowhere)
        case "axis":
            return Values(low[:, node.value], high[:, node.value], nowhere, nowhere)
        case "field" if fields is not None:
            return Values(*fields(node.value, low, high), nowhere, nowhere)
        case "field":
            return Values(np.full(len(low), -np.inf), np.full(len(low), np.inf), ~nowhere, nowhere)
    parts = [_over(part, low, high, fields) for part in node.parts]
    a, b = parts[0], parts[-1]
    match node.do:
        case "+":
            return a.combined(b, a.low + b.low, a.high + b.high)
        case "-":
            return a.combined(b, a.low - b.high, a.high - b.low)
        case "negated":
            return Values(-a.high, -a.low, a.may, a.none)
        case "*":
            return _corners(a, b, np.multiply)
        case "/":
            return _corners(a, _inverse(b), np.multiply)
        case "^":
            return _raised(a, b, node.parts[1])
        case "min" | "max":
            f = np.minimum if node.do == "min" else np.maximum
            found = a
            for part in parts[1:]:
                found = found.combined(part, f(found.low, part.low), f(found.high, part.high))
            return found
    return _function(node.do, a)


def _corners(a: Values, b: Values, f: np.ufunc) -> Values:
    """Of a function that is monotonous in each of two."""
    each = np.array([f(x, y) for x in (a.low, a.high) for y in (b.low, b.high)])
    return a.combined(b, each.min(axis=0), each.max(axis=0))


def _inverse(a: Values) -> Values:
    through = (a.low <= 0.0) & (a.high >= 0.0)
    low, high = (np.where(through, s * np.inf, 1.0 / x) for s, x in ((-1.0, a.high), (1.0, a.low)))
    return a.without(through, (a.low == 0.0) & (a.high == 0.0), low, high)


def _raised(a: Values, b: Values, exponent: Node) -> Values:
    """A power: whole ones of any number, others of what is not negative."""
    n = exponent.value if exponent.do == "number" else None
    if n is not None and n == int(n):
        if n < 0:
            return _raised(_inverse(a), b, constant(-n))
        each = np.array([a.low**n, a.high**n])
        low, high = each.min(axis=0), each.max(axis=0)
        through = (a.low < 0.0) & (a.high > 0.0)
        return Values(np.where(through & (n % 2 == 0), 0.0, low), high, a.may, a.none)
    base = a.without(a.low < 0.0, a.high < 0.0, np.maximum(a.low, 0.0), np.maximum(a.high, 0.0))
    return _corners(base, b, np.power)


def _function(name: str, a: Values) -> Values:
    if name == "sqrt":
        return a.without(a.low < 0.0, a.high < 0.0, np.sqrt(np.maximum(a.low, 0.0)), np.sqrt(np.maximum(a.high, 0.0)))
    if name == "log":
        return a.without(a.low <= 0.0, a.high <= 0.0, np.log(np.maximum(a.low, 0.0)), np.log(np.maximum(a.high, 0.0)))
    if name == "exp":
        return Values(np.exp(a.low), np.exp(a.high), a.may, a.none)
    if name == "abs":
        ends = np.array([np.abs(a.low), np.abs(a.high)])
        low = np.where((a.low < 0.0) & (a.high > 0.0), 0.0, ends.min(axis=0))
        return Values(low, ends.max(axis=0), a.may, a.none)
    if name in ("sin", "cos"):
        return _wave(a, 0.5 * np.pi if name == "sin" else 0.0)
    pole = np.floor(a.high / np.pi - 0.5) > np.floor(a.low / np.pi - 0.5)  # tan
    low, high = np.where(pole, -np.inf, np.tan(a.low)), np.where(pole, np.inf, np.tan(a.high))
    return a.without(pole, np.zeros_like(pole), low, high)


def _wave(a: Values, late: float) -> Values:
    """cos(a - late): 1 where a whole number of turns lies within, -1 where one and a half."""
    low, high = (a.low - late) / (2.0 * np.pi), (a.high - late) / (2.0 * np.pi)
    ends = np.array([np.cos(2.0 * np.pi * low), np.cos(2.0 * np.pi * high)])
    top = np.floor(high) >= np.ceil(low)
    bottom = np.floor(high - 0.5) >= np.ceil(low - 0.5)
    return _made(np.where(bottom, -1.0, ends.min(axis=0)), np.where(top, 1.0, ends.max(axis=0)), a.may, a.none)
