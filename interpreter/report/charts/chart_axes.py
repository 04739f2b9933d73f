"""Chart axes: ticks with labels for a range of SI values, linear or logarithmic."""

from __future__ import annotations

import math

from softmark.interpreter.language.number_formatting import (
    choose_scale,
    format_quantity,
    is_ratio,
    power_of_ten,
    typeset_number,
)
from softmark.records import dataclass


@dataclass(frozen=True)
class Axis:
    """Chart axis: a range of values in SI with its ticks; `log` for a logarithmic scale."""

    low: float
    high: float
    label: str
    ticks: tuple[tuple[float, str], ...]
    log: bool = False

    def at(self, value: float) -> float:
        """Return the position of a value on the axis: 0 at the low end, 1 at the high end."""
        if self.log:
            return math.log(value / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)


def nice_step(span: float, about: int) -> float:
    """Return a step that divides a span into about `about` parts: 1, 2, 2.5 or 5 times a power of ten."""
    raw = span / max(about, 1)
    decade = 10.0 ** math.floor(math.log10(raw))
    return next(m * decade for m in (1.0, 2.0, 2.5, 5.0, 10.0) if m * decade >= raw * 0.999)


def linear(low: float, high: float, name: str, unit: str, about: int = 6) -> Axis:
    """Return a linear axis from low to high (SI) with about `about` round ticks.

    The tick labels are in a suitable multiple of the SI unit `unit`. The axis label is `name` with that multiple.
    """
    scale = choose_scale((low, high), unit)
    step = nice_step((high - low) / scale.factor, about)
    decimals = max(0, (1 if _mantissa(step) == 2.5 else 0) - math.floor(math.log10(step) + 1e-9))
    first, last = math.ceil(low / scale.factor / step - 1e-9), math.floor(high / scale.factor / step + 1e-9)
    ticks = tuple((i * step * scale.factor, typeset_number(f"{i * step:.{decimals}f}")) for i in range(first, last + 1))
    return Axis(low, high, scale.heading(name), ticks)


def _mantissa(step: float) -> float:
    return round(step / 10.0 ** math.floor(math.log10(step) + 1e-9), 6)


def integer_axis(low: int, high: int, name: str, about: int = 6) -> Axis:
    """Return an axis of whole numbers."""
    high = max(high, low + 1)
    step = max(1, round(nice_step(high - low, about)))
    first = -(-low // step) * step
    ticks = tuple((float(i), str(i)) for i in range(first, high + 1, step))
    return Axis(float(low), float(high), name, ticks)


def logarithmic(low: float, high: float, name: str, unit: str, about: int = 7) -> Axis:
    """Return a logarithmic axis that includes low and high (SI), with about `about` ticks at powers of ten.

    Labels of lengths look like `10 µm`, those of plain numbers like `10⁻³`. The ends are 1, 2 or 5 times a power of
    ten.
    The axis spans at least a factor of ten, so that there are two ticks.
    """
    bottom, top = _round_number_below(low), _round_number_above(high)
    if top < 10 * bottom:
        bottom = 10.0 ** math.floor(math.log10(bottom) + 1e-9)
        top = max(top, 10 * bottom)
    first, last = math.ceil(math.log10(bottom) - 1e-9), math.floor(math.log10(top) + 1e-9)
    every = max(1, math.ceil((last - first) / about))
    ticks = tuple((10.0**k, _power_of_ten_label(k, unit)) for k in range(first, last + 1, every))
    return Axis(bottom, top, name, ticks, log=True)


def _round_number_below(value: float) -> float:
    decade = 10.0 ** math.floor(math.log10(value) + 1e-9)
    return max(m * decade for m in (1.0, 2.0, 5.0) if m == 1.0 or m * decade <= value)


def _round_number_above(value: float) -> float:
    decade = 10.0 ** math.floor(math.log10(value) - 1e-9)
    return next(m * decade for m in (1.0, 2.0, 5.0, 10.0) if m * decade >= value * (1 - 1e-9))


def _power_of_ten_label(exponent: int, unit: str) -> str:
    if is_ratio(unit):
        return "1" if exponent == 0 else power_of_ten(exponent)
    return format_quantity(10.0**exponent, unit) if exponent >= -9 else f"{power_of_ten(exponent)}\u00a0{unit}"
