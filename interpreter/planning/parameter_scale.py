"""Scale of a varied parameter: a coordinate t that grows from 0, the rungs to visit, and the value at each t.

A rung is a value of t at which the scene is solved. Parameter values are rounded to six digits, so that the command
that repeats a point is readable. The last rung is the limit of the scale.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Literal

from softmark.records import dataclass

Direction = Literal["up", "down"]
RATIO = 1.2  # ratio of the two sides of a bisected edge
SMALLEST_GAP = 1e-9  # least distance of Poisson's ratio from one half; then only one half itself
DECADES = 6  # number of decades from zero to the end of a range
INCOMPRESSIBLE = 0.5


@dataclass(frozen=True)
class ParameterScale:
    """Scale of a parameter: values from that of the scene, at coordinate t = 0, to a limit in one direction.

    If the limit is `abrupt`, the interval before the last rung is not bisected.
    """

    direction: Direction
    rungs: tuple[float, ...]  # t, increasing, above 0
    finest: float  # distance in t at which bisection ends
    value: Callable[[float], float]
    abrupt: bool = False

    def at(self, t: float) -> float:
        """Return the parameter value at coordinate t."""
        return self.value(t)

    def between(self, a: float, b: float) -> float | None:
        """Return the coordinate halfway from a to b, or None if further bisection is useless."""
        if b - a <= self.finest * 1.001 or (self.abrupt and b == self.rungs[-1]):
            return None
        t = 0.5 * (a + b)
        return None if self.at(t) in (self.at(a), self.at(b)) else t


def round_to_six_digits(value: float) -> float:
    """Return a number rounded to six significant digits."""
    return float(f"{value:.6g}")


# ------------------------------------------------------------------ logarithmic scales


def logarithmic_ladder(nominal: float, limit: float, direction: Direction) -> ParameterScale | None:
    """Return a logarithmic scale from the nominal value to a limit of the same sign, with at least three rungs.

    The result is None if the two are equal.
    """
    span = abs(math.log10(limit / nominal))
    if span < 1e-6:
        return None
    count = max(3, math.ceil(span - 1e-9))
    whole = [float(i) for i in range(1, count)] if span >= 3 else [span * i / count for i in range(1, count)]
    sign = 1.0 if abs(limit) > abs(nominal) else -1.0
    return ParameterScale(
        direction, (*whole, span), math.log10(RATIO), partial(_logarithmic_value, nominal, limit, sign, span)
    )


def _logarithmic_value(nominal: float, limit: float, sign: float, span: float, t: float) -> float:
    """Return the parameter value at coordinate t of a logarithmic scale."""
    return limit if t >= span else round_to_six_digits(nominal * 10 ** (sign * t)) if t > 0 else nominal


# ------------------------------------------------------------------ Poisson's ratio


def poisson_ladder(nominal: float, limit: float = INCOMPRESSIBLE) -> ParameterScale | None:
    """Return a scale of Poisson's ratio nu by decades of 0.5 - nu, from its nominal value up to a limit.

    It includes 0.5 itself if the limit allows it. The result is None if the nominal value is at the limit.
    """
    gap, least = INCOMPRESSIBLE - nominal, INCOMPRESSIBLE - limit
    floor = max(least, SMALLEST_GAP)
    if gap <= floor * 1.001:
        return None
    span = math.log10(gap / floor)
    powers = [-k for k in range(1, 10) if floor * 1.001 < 10.0**-k < gap * 0.999]
    rungs = [math.log10(gap / 10.0**p) for p in powers] + [span]
    exact = least <= 0
    if exact:
        rungs.append(span + 1)
    value = partial(_poisson_ratio_at, gap, limit, exact, span)
    return ParameterScale("up", tuple(rungs), math.log10(RATIO), value, abrupt=exact)


def _poisson_ratio_at(gap: float, limit: float, exact: bool, span: float, t: float) -> float:
    """Return Poisson's ratio at coordinate t of a scale from `poisson_ladder`."""
    if t > span or (t == span and not exact):
        return limit
    return round(INCOMPRESSIBLE - float(f"{gap * 10**-t:.3g}"), 13) if t > 0 else INCOMPRESSIBLE - gap


# ------------------------------------------------------------------ linear scales


def linear_ladder(
    nominal: float, limit: float, direction: Direction, stops: tuple[float, ...] = ()
) -> ParameterScale | None:
    """Return a linear scale from the nominal value to the end of a range, or through the given `stops`.

    The result is None if the two are equal.
    """
    if limit == nominal:
        return None
    inner = [s for s in stops if min(nominal, limit) < s < max(nominal, limit)]
    parts = [(s - nominal) / (limit - nominal) for s in inner] if stops else [0.25, 0.5, 0.75]
    return ParameterScale(direction, (*sorted(parts), 1.0), 0.02, partial(_linear_value, nominal, limit))


def _linear_value(nominal: float, limit: float, t: float) -> float:
    """Return the parameter value at coordinate t of a linear scale."""
    return limit if t >= 1 else round_to_six_digits(nominal + t * (limit - nominal)) if t > 0 else nominal


def decades_from_zero(limit: float, direction: Direction) -> ParameterScale:
    """Return a scale that begins at zero and grows by factors of ten from 1e-6 times `limit` to `limit`."""
    rungs = tuple(float(i) for i in range(1, DECADES + 2))
    return ParameterScale(direction, rungs, math.log10(RATIO), partial(_decade_value, limit))


def _decade_value(limit: float, t: float) -> float:
    """Return the parameter value at coordinate t of a scale from `decades_from_zero`."""
    return limit if t > DECADES else round_to_six_digits(limit * 10 ** (t - DECADES - 1)) if t > 0 else 0.0


# ------------------------------------------------------------------ whole numbers


def doubling_ladder(nominal: int, limit: int, direction: Direction) -> ParameterScale | None:
    """Return a scale of a whole number by doubling or halving up to its limit; None if the two are equal."""
    if limit == nominal:
        return None
    span = abs(math.log2(limit / nominal))
    rungs = [float(i) for i in range(1, math.ceil(span - 1e-9))]
    value = partial(_doubled_value, nominal, limit, 1.0 if limit > nominal else -1.0, span)
    kept = dict.fromkeys(value(t) for t in rungs)
    whole = tuple(t for t in rungs if kept.pop(value(t), 0) is None and value(t) not in (nominal, limit))
    return ParameterScale(direction, (*whole, span), math.log2(RATIO), value)


def _doubled_value(nominal: int, limit: int, sign: float, span: float, t: float) -> float:
    """Return the whole number at coordinate t of a scale from `doubling_ladder`."""
    return float(limit) if t >= span else float(round(nominal * 2 ** (sign * t)))
