"""Interval arithmetic on arrays that also bounds derivatives, over many pieces of a domain at once.

It combines forward differentiation with intervals. A `Bounds` passes through the terms of a condition as a number
would.
Source: Moore 1966; Rall 1981.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softmark.interpreter.language.coordinate_conditions import Enclosure

Floats = NDArray[np.float64]
Pair = tuple[Floats, Floats]  # low and high


class Bounds(Enclosure):
    """Lower and upper bounds of a quantity and of its derivatives.

    The quantity lies between `low` and `high` (n,), its derivatives in d directions between `steep[0]` and
    `steep[1]` (d, n).
    """

    low: Any
    high: Any
    steep: Pair

    def __init__(self, value: Pair, steep: Pair) -> None:
        for name, found in zip(("low", "high", "steep"), (*_widen_nan(value), _widen_nan(steep)), strict=True):
            object.__setattr__(self, name, found)

    @staticmethod
    def of(value: Any, like: Bounds) -> Bounds:
        """Return a number as Bounds of the same shape as `like`; Bounds are returned unchanged."""
        if isinstance(value, Bounds):
            return value
        low, high = (value.low, value.high) if isinstance(value, Enclosure) else (value, value)
        zero = np.zeros_like(like.steep[0])
        return Bounds((np.full_like(like.low, low), np.full_like(like.low, high)), (zero, zero))

    def __add__(self, other: Any) -> Bounds:
        if isinstance(other, float):
            return Bounds((self.low + other, self.high + other), self.steep)
        o = Bounds.of(other, self)
        steep = self.steep[0] + o.steep[0], self.steep[1] + o.steep[1]
        return Bounds((self.low + o.low, self.high + o.high), steep)

    __radd__ = __add__

    def __neg__(self) -> Bounds:
        return Bounds((-self.high, -self.low), (-self.steep[1], -self.steep[0]))

    def __sub__(self, other: Any) -> Bounds:
        return self + (-Bounds.of(other, self))

    def __rsub__(self, other: Any) -> Bounds:
        return (-self).__add__(other)

    def __mul__(self, other: Any) -> Bounds:
        if isinstance(other, float) and other != 0.0 and math.isfinite(other):
            ends = (self.low, self.high), self.steep
            value, steep = (_swap_if((other * low, other * high), other < 0.0) for low, high in ends)
            return Bounds(value, steep)
        o = Bounds.of(other, self)
        a, b = (self.low, self.high), (o.low, o.high)
        left, right = _interval_product(self.steep, b), _interval_product(a, o.steep)
        return Bounds(_interval_product(a, b), (left[0] + right[0], left[1] + right[1]))

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Bounds:
        product: Bounds = self * Bounds.of(other, self)._inverse()
        return product

    def __rtruediv__(self, other: Any) -> Bounds:
        return Bounds.of(other, self) * self._inverse()

    def _inverse(self) -> Bounds:
        """Return bounds of the inverse of the bounded quantity."""
        with np.errstate(all="ignore"):
            through = (self.low <= 0.0) & (self.high >= 0.0)
            low, high = (np.where(through, e, 1.0 / v) for e, v in ((-np.inf, self.high), (np.inf, self.low)))
            slope = _interval_product((-np.ones_like(low), -np.ones_like(low)), _even_interval_power((low, high), 2))
        return self._apply_chain_rule((low, high), slope)

    def __pow__(self, n: float) -> Bounds:
        if n == -0.5:
            return self.root()._inverse()
        a = (self.low, self.high)
        lower = _power(a, n - 1)
        return self._apply_chain_rule(_power(a, n), (n * lower[0], n * lower[1]))

    def root(self) -> Bounds:
        """Return bounds of the square root of the bounded quantity; negative values count as zero."""
        low, high = np.sqrt(np.maximum(self.low, 0.0)), np.sqrt(np.maximum(self.high, 0.0))
        with np.errstate(divide="ignore"):
            slope = np.where(self.low > 0.0, 0.5 / high, 0.0), 0.5 / low
        return self._apply_chain_rule((low, high), slope)

    def magnitude(self) -> Bounds:
        """Return bounds of the absolute value of the bounded quantity."""
        ends = np.abs(self.low), np.abs(self.high)
        low = np.where((self.low < 0.0) & (self.high > 0.0), 0.0, np.minimum(*ends))
        slope = np.where(self.low < 0.0, -1.0, 1.0), np.where(self.high > 0.0, 1.0, -1.0)
        return self._apply_chain_rule((low, np.maximum(*ends)), slope)

    def _apply_chain_rule(self, value: Pair, slope: Pair) -> Bounds:
        """Return bounds of a function of this interval, from bounds of its values and of its derivative."""
        return Bounds(value, _interval_product(slope, self.steep))


def _widen_nan(pair: Pair) -> Pair:
    """Return the pair with infinite bounds where a bound is nan, as for infinity times zero."""
    low, high = pair
    if not (np.isnan(low).any() or np.isnan(high).any()):
        return pair
    return np.where(np.isnan(low), -np.inf, low), np.where(np.isnan(high), np.inf, high)


def _swap_if(pair: Pair, turned: bool) -> Pair:
    return pair[::-1] if turned else pair


def _interval_product(a: Pair, b: Pair) -> Pair:
    with np.errstate(invalid="ignore", over="ignore"):
        products = [p * q for p in a for q in b]
    products = [np.where(np.isnan(p), 0.0, p) for p in products]  # zero times infinity is zero
    low, high = np.minimum(products[0], products[1]), np.maximum(products[0], products[1])
    for p in products[2:]:
        low, high = np.minimum(low, p), np.maximum(high, p)
    return low, high


def _power(a: Pair, n: float) -> Pair:
    return _even_interval_power(a, n) if n % 2 == 0 else (_integer_power(a[0], n), _integer_power(a[1], n))


def _even_interval_power(a: Pair, n: float) -> Pair:
    ends = _integer_power(a[0], n), _integer_power(a[1], n)
    low = np.where((a[0] < 0.0) & (a[1] > 0.0), 0.0, np.minimum(*ends))
    return (np.ones_like(low), np.ones_like(low)) if n == 0 else (low, np.maximum(*ends))


def _integer_power(a: Floats, n: float) -> Floats:
    with np.errstate(over="ignore"):
        found: Floats = a ** int(n)
    return found
