"""Exact integrals and extremes of piecewise linear curves and of their differences; curves are not sampled.

Two curves are compared on the range of x that both cover. At the points where one of them bends, both are evaluated;
between these points both curves and their difference are straight.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]
else:
    from softmark.solvers.runtime.lazy_modules import np


@dataclass(frozen=True)
class Curve:
    """Piecewise linear reference curve: values y (n,) at x (n,), and their uncertainty u (n,), all in SI.

    `lost` belongs to a curve with loading and unloading. For two values of x it returns the fraction of the work of
    loading that unloading does not return, and its uncertainty; None if the curve does not cover this range both ways.
    `band` holds the lower and the upper limits of y (n,), if they are not symmetric about y.
    """

    x: Floats
    y: Floats
    u: Floats
    lost: Callable[[float, float], tuple[float, float] | None] | None = None
    band: tuple[Floats, Floats] | None = None


@dataclass(frozen=True)
class MetricCurve:
    """Curve of a metric over another metric, over time or along a line: y (n,) at x (n,) in their order, SI.

    `units` are the units of x and y as they appear in keys of details. `known` (n,) are the reference values at the
    same x.
    """

    x: Floats
    y: Floats
    units: tuple[str, str]
    known: Floats | None = None


@dataclass(frozen=True)
class Overlay:
    """A curve and its reference at the same x (k,), all points at which one of them bends.

    It holds the values y (k,) of the curve, and the values r (k,) and uncertainties u (k,) of the reference. `covered`
    is the fraction of the reference's range that the curve covers.
    """

    x: Floats
    y: Floats
    r: Floats
    u: Floats
    covered: float
    band: tuple[Floats, Floats] | None = None  # limits (k,) each; default: r - u and r + u

    @property
    def inside(self) -> float:
        """Fraction of the range on which the curve lies in the uncertainty band of the reference."""
        if self.band is None:
            return share_within(self.x, self.d, self.u)
        low, high = self.band
        return share_within(self.x, self.y - 0.5 * (low + high), 0.5 * (high - low))

    @property
    def d(self) -> Floats:
        """Difference of curve and reference, y - r (k,)."""
        return self.y - self.r


def overlay(x: Floats, y: Floats, reference: Curve, unit: str = "(SI)") -> Overlay:
    """Return a curve and its reference on the range that both cover. Raises Undefined if there is no such range."""
    x, y = _sort_by_x(x, y)
    low, high = max(x[0], reference.x[0]), min(x[-1], reference.x[-1])
    if not low < high:
        raise Undefined(
            f"it covers {x[0]:.4g} to {x[-1]:.4g} {unit} and the reference {reference.x[0]:.4g} to "
            f"{reference.x[-1]:.4g} {unit}: the ranges do not overlap"
        )
    every = np.unique(np.concatenate([[low], x, reference.x, [high]]))
    at = every[(every >= low) & (every <= high)]
    r, u = np.interp(at, reference.x, reference.y), np.interp(at, reference.x, reference.u)
    own = reference.band
    band = None if own is None else (np.interp(at, reference.x, own[0]), np.interp(at, reference.x, own[1]))
    return Overlay(at, np.interp(at, x, y), r, u, float((high - low) / (reference.x[-1] - reference.x[0])), band)


def _sort_by_x(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Return the curve in the order of increasing x. Raises Undefined if x does not change monotonically."""
    if len(x) < 2:
        raise Undefined("a curve needs two or more states, and there is one")
    steps = np.diff(x)
    if (steps > 0.0).all():
        return x, y
    if (steps < 0.0).all():
        return x[::-1], y[::-1]
    how = "turns back" if (steps < 0.0).any() and (steps > 0.0).any() else "stands still"
    raise Undefined(f"x {how} between states, but a curve must have one value for each x")


@dataclass(frozen=True)
class HysteresisLoop:
    """Loading and unloading curves y (n,) over the same increasing x (n,), on the range that both cover.

    `turn` is the index of the point at which the original curve turns back. `ends` are the ends of the range.
    """

    there: tuple[Floats, Floats]
    back: tuple[Floats, Floats]
    turn: int
    ends: tuple[float, float]

    @property
    def works(self) -> tuple[float, float]:
        """Integrals of y over x for loading and for unloading."""
        return integrate(*self.there), integrate(*self.back)

    @property
    def lost(self) -> float:
        """Lost fraction of work, 1 - work of unloading / work of loading. Raises Undefined."""
        loading, unloading = self.works
        if loading == 0.0:
            raise Undefined("the work of loading is zero, so its lost fraction is not defined")
        return 1.0 - unloading / loading

    def within(self, low: float, high: float) -> HysteresisLoop:
        """Return the part of the loop between two values of x."""
        return replace(
            self,
            there=_cut_to_range(*self.there, low, high),
            back=_cut_to_range(*self.back, low, high),
            ends=(low, high),
        )


def split_loop(x: Floats, y: Floats, unit: str = "(SI)") -> HysteresisLoop:
    """Return the loading and unloading branches of a curve, split at the point farthest from its start.

    Raises Undefined for a curve that does not turn back exactly once.
    """
    turn = int(np.abs(x - x[0]).argmax())
    if turn == len(x) - 1:
        raise Undefined("the curve has no unloading: x never turns back")
    ways = [(x[part], y[part]) for part in (slice(0, turn + 1), slice(turn, None))]
    for way, _ in ways:
        steps = np.diff(way)
        if len(way) < 2 or not ((steps > 0.0).all() or (steps < 0.0).all()):
            raise Undefined(
                "the curve is not one loading path and one unloading path: x stands still, or turns back more than once"
            )
    there, back = (_sort_by_x(*way) for way in ways)
    low, high = max(there[0][0], back[0][0]), min(there[0][-1], back[0][-1])
    if not low < high:
        raise Undefined(f"the loading and unloading paths do not overlap: they meet only at {high:.4g} {unit}")
    return HysteresisLoop(
        _cut_to_range(*there, low, high), _cut_to_range(*back, low, high), turn, (float(low), float(high))
    )


def _cut_to_range(x: Floats, y: Floats, low: float, high: float) -> tuple[Floats, Floats]:
    """Return the part of a curve of increasing x between `low` and `high`, which must lie in its range."""
    at = np.concatenate([[low], x[(x > low) & (x < high)], [high]])
    return at, np.interp(at, x, y)


def integrate_square(x: Floats, d: Floats) -> float:
    """Return the integral of d^2 over x; d is piecewise linear."""
    p, q = d[:-1], d[1:]
    return float((np.diff(x) * (p * p + p * q + q * q)).sum() / 3.0)


def integrate(x: Floats, d: Floats) -> float:
    """Return the integral of d over x; d is piecewise linear."""
    return float((np.diff(x) * (d[:-1] + d[1:])).sum() / 2.0)


def integrate_absolute(x: Floats, d: Floats) -> float:
    """Return the integral of |d| over x; d is piecewise linear, and a change of its sign gives two triangles."""
    p, q = np.abs(d[:-1]), np.abs(d[1:])
    crosses = d[:-1] * d[1:] < 0.0
    total = np.where(crosses, p + q, 1.0)
    mean = np.where(crosses, (p * p + q * q) / (2.0 * total), 0.5 * (p + q))
    return float((np.diff(x) * mean).sum())


def rms(x: Floats, d: Floats) -> float:
    """Return the root mean square over x of the piecewise linear function d."""
    return float(np.sqrt(integrate_square(x, d) / (x[-1] - x[0])))


def fit_initial_slope(x: Floats, y: Floats, share: float) -> float:
    """Return the slope of the least squares line through the first fraction `share` of the range.

    It is int (x - m) y dx / int (x - m)^2 dx, with m the middle of that part, by Simpson's rule, which is exact here.
    """
    x, y = initial_part(x, y, share)
    return _slope_integral(x, x - 0.5 * (x[0] + x[-1]), y)


def bound_slope_change(x: Floats, u: Floats, share: float) -> float:
    """Return a bound of the change of the initial slope if values change by up to u.

    It is int |x - m| u dx / int (x - m)^2 dx, as in `fit_initial_slope`.
    """
    x, u = initial_part(x, u, share)
    middle = 0.5 * (x[0] + x[-1])
    u = np.interp(at := np.unique(np.append(x, middle)), x, u)
    return _slope_integral(at, np.abs(at - middle), u)


def _slope_integral(x: Floats, arm: Floats, y: Floats) -> float:
    """Return int a y dx / int (x - m)^2 dx for piecewise linear y and a (argument `arm`)."""
    a, b, p, q = arm[:-1], arm[1:], y[:-1], y[1:]
    above = (np.diff(x) * (a * p + (a + b) * (p + q) + b * q)).sum() / 6.0
    return float(above / ((x[-1] - x[0]) ** 3 / 12.0))


def initial_part(x: Floats, y: Floats, share: float) -> tuple[Floats, Floats]:
    """Return the first fraction `share` of a curve's range."""
    end = x[0] + share * (x[-1] - x[0])
    at = np.append(x[x < end], end)
    return at, np.interp(at, x, y)


def share_within(x: Floats, d: Floats, u: Floats) -> float:
    """Return the fraction of the range on which |d| <= u, both piecewise linear."""
    at, d = _insert_zeros(x, d)
    gap = np.abs(d) - np.interp(at, x, u)  # straight between these
    at, gap = _insert_zeros(at, gap)
    inside = 0.5 * (gap[:-1] + gap[1:]) <= 0.0
    return float(np.diff(at)[inside].sum() / (x[-1] - x[0]))


def _insert_zeros(x: Floats, d: Floats) -> tuple[Floats, Floats]:
    """Return x and d with the zero crossings of d inserted as points."""
    at = np.unique(np.concatenate([x, _zero_crossings(x, d)]))
    return at, np.interp(at, x, d)


def _zero_crossings(x: Floats, d: Floats) -> Floats:
    """Return the positions at which the piecewise linear d crosses zero between two x."""
    after = np.flatnonzero(d[:-1] * d[1:] < 0.0) + 1
    share = d[after - 1] / (d[after - 1] - d[after])
    zeros: Floats = x[after - 1] + share * (x[after] - x[after - 1])
    return zeros


def steepest_slopes(reference: Curve, x: Floats) -> Floats:
    """Return the steeper of the two slopes of the reference next to each x (n,)."""
    steep = np.abs(np.diff(reference.y) / np.diff(reference.x))
    after = np.clip(np.searchsorted(reference.x, x), 1, len(steep))
    before = np.clip(np.searchsorted(reference.x, x, side="right"), 1, len(steep))
    found: Floats = np.maximum(steep[after - 1], steep[before - 1])
    return found
