"""Bounds of an expression of the coordinates over many boxes at once, by interval arithmetic on arrays.

Each bound holds everywhere in its box, but it may be wider than the true range.
Source: Moore 1966.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softmark.interpreter.language.spatial_profiles import Node, constant_node
from softmark.records import dataclass

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True)
class ValueBounds:
    """Bounds (n,) of the values of an expression over n boxes.

    `may` (n,) is true where the value may be undefined somewhere in the box, `none` (n,) where it is undefined
    everywhere.
    """

    low: Floats
    high: Floats
    may: Bools
    none: Bools

    def binary_function_bounds(self, other: ValueBounds, low: Floats, high: Floats) -> ValueBounds:
        """Return bounds `low` and `high` (n,) of a function of two values; it is undefined where one of them is."""
        return _make_bounds(low, high, self.may | other.may, self.none | other.none)

    def partial_function_bounds(self, may: Bools, none: Bools, low: Floats, high: Floats) -> ValueBounds:
        """Return bounds of a function that is defined only on a part of the real line, such as a square root.

        `low` and `high` (n,) bound its values where it is defined. The mask `may` (n,) is true if the argument, bounded
        by
        this object, may lie outside the domain in a part of the box, and `none` (n,) if it does so in the whole box.
        """
        return _make_bounds(low, high, self.may | may | none, self.none | none)

    @property
    def zero(self) -> Bools:
        """Mask (n,) of the boxes in which the value is zero everywhere or undefined everywhere."""
        found: Bools = self.none | ((self.low == 0.0) & (self.high == 0.0) & ~self.may)
        return found

    @property
    def sound(self) -> Bools:
        """Mask (n,) of the boxes in which the value is defined and nonzero everywhere."""
        found: Bools = ~self.may & ((self.low > 0.0) | (self.high < 0.0))
        return found


FieldBounds = Callable[[Any, Floats, Floats], tuple[Floats, Floats]]  # (field, low, high) -> bounds (n,)


def bound_expression(node: Node, low: Floats, high: Floats, fields: FieldBounds | None = None) -> ValueBounds:
    """Return bounds of an expression over boxes from `low` to `high` (n, 3), m.

    `fields` returns bounds of data fields; if it is None, they are unbounded.
    """
    with np.errstate(all="ignore"):
        return _bound_node(node, low, high, fields)


def _make_bounds(low: Floats, high: Floats, may: Bools, none: Bools) -> ValueBounds:
    """Return the bounds as `ValueBounds`, with infinite bounds where a bound is nan."""
    odd = np.isnan(low) | np.isnan(high)
    return ValueBounds(np.where(odd, -np.inf, low), np.where(odd, np.inf, high), may, none)


def _bound_node(node: Node, low: Floats, high: Floats, fields: FieldBounds | None) -> ValueBounds:
    nowhere = np.zeros(len(low), dtype=np.bool_)
    match node.do:
        case "number":
            value = np.full(len(low), float(node.value))
            return ValueBounds(value, value, nowhere, nowhere)
        case "axis":
            return ValueBounds(low[:, node.value], high[:, node.value], nowhere, nowhere)
        case "field" if fields is not None:
            return ValueBounds(*fields(node.value, low, high), nowhere, nowhere)
        case "field":
            return ValueBounds(np.full(len(low), -np.inf), np.full(len(low), np.inf), ~nowhere, nowhere)
    parts = [_bound_node(part, low, high, fields) for part in node.parts]
    a, b = parts[0], parts[-1]
    match node.do:
        case "+":
            return a.binary_function_bounds(b, a.low + b.low, a.high + b.high)
        case "-":
            return a.binary_function_bounds(b, a.low - b.high, a.high - b.low)
        case "negated":
            return ValueBounds(-a.high, -a.low, a.may, a.none)
        case "*":
            return _bound_monotonic(a, b, np.multiply)
        case "/":
            return _bound_monotonic(a, _bound_inverse(b), np.multiply)
        case "^":
            return _bound_power(a, b, node.parts[1])
        case "min" | "max":
            f = np.minimum if node.do == "min" else np.maximum
            found = a
            for part in parts[1:]:
                found = found.binary_function_bounds(part, f(found.low, part.low), f(found.high, part.high))
            return found
    return _bound_function(node.do, a)


def _bound_monotonic(a: ValueBounds, b: ValueBounds, f: np.ufunc) -> ValueBounds:
    """Return bounds of a function f that is monotonic in each of its two arguments."""
    each = np.array([f(x, y) for x in (a.low, a.high) for y in (b.low, b.high)])
    return a.binary_function_bounds(b, each.min(axis=0), each.max(axis=0))


def _bound_inverse(a: ValueBounds) -> ValueBounds:
    through = (a.low <= 0.0) & (a.high >= 0.0)
    low, high = (np.where(through, s * np.inf, 1.0 / x) for s, x in ((-1.0, a.high), (1.0, a.low)))
    return a.partial_function_bounds(through, (a.low == 0.0) & (a.high == 0.0), low, high)


def _bound_power(a: ValueBounds, b: ValueBounds, exponent: Node) -> ValueBounds:
    """Return bounds of a power, for whole exponents of any base and for other exponents of a nonnegative base."""
    n = exponent.value if exponent.do == "number" else None
    if n is not None and n == int(n):
        if n < 0:
            return _bound_power(_bound_inverse(a), b, constant_node(-n))
        each = np.array([a.low**n, a.high**n])
        low, high = each.min(axis=0), each.max(axis=0)
        through = (a.low < 0.0) & (a.high > 0.0)
        return ValueBounds(np.where(through & (n % 2 == 0), 0.0, low), high, a.may, a.none)
    base = a.partial_function_bounds(a.low < 0.0, a.high < 0.0, np.maximum(a.low, 0.0), np.maximum(a.high, 0.0))
    return _bound_monotonic(base, b, np.power)


def _bound_function(name: str, a: ValueBounds) -> ValueBounds:
    if name == "sqrt":
        return a.partial_function_bounds(
            a.low < 0.0, a.high < 0.0, np.sqrt(np.maximum(a.low, 0.0)), np.sqrt(np.maximum(a.high, 0.0))
        )
    if name == "log":
        return a.partial_function_bounds(
            a.low <= 0.0, a.high <= 0.0, np.log(np.maximum(a.low, 0.0)), np.log(np.maximum(a.high, 0.0))
        )
    if name == "exp":
        return ValueBounds(np.exp(a.low), np.exp(a.high), a.may, a.none)
    if name == "abs":
        ends = np.array([np.abs(a.low), np.abs(a.high)])
        low = np.where((a.low < 0.0) & (a.high > 0.0), 0.0, ends.min(axis=0))
        return ValueBounds(low, ends.max(axis=0), a.may, a.none)
    if name in ("sin", "cos"):
        return _bound_cosine(a, 0.5 * np.pi if name == "sin" else 0.0)
    pole = np.floor(a.high / np.pi - 0.5) > np.floor(a.low / np.pi - 0.5)  # tan
    low, high = np.where(pole, -np.inf, np.tan(a.low)), np.where(pole, np.inf, np.tan(a.high))
    return a.partial_function_bounds(pole, np.zeros_like(pole), low, high)


def _bound_cosine(a: ValueBounds, late: float) -> ValueBounds:
    """Return bounds of cos(a - late), which reach 1 or -1 if the interval contains an extremum."""
    low, high = (a.low - late) / (2.0 * np.pi), (a.high - late) / (2.0 * np.pi)
    ends = np.array([np.cos(2.0 * np.pi * low), np.cos(2.0 * np.pi * high)])
    top = np.floor(high) >= np.ceil(low)
    bottom = np.floor(high - 0.5) >= np.ceil(low - 0.5)
    return _make_bounds(np.where(bottom, -1.0, ends.min(axis=0)), np.where(top, 1.0, ends.max(axis=0)), a.may, a.none)
