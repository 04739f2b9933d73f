"""Two curves of straight lines over one another: exact integrals and extremes, nothing sampled.

On the range that both have, each is straight between the points at which one of them bends, and so is their difference.
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
    """Values y (n,) at x (n,), straight between them, and how far y may be from the true one, u (n,), all SI.

    `lost`, of a curve with a way there and one back: between two x, the share of the work of loading that unloading did
    not give back, and its uncertainty; None where it does not go over these on both ways. `band` (n,) each: from where
    to where y may be, where that is not as far on both sides.
    """

    x: Floats
    y: Floats
    u: Floats
    lost: Callable[[float, float], tuple[float, float] | None] | None = None
    band: tuple[Floats, Floats] | None = None


@dataclass(frozen=True)
class Course:
    """What a metric comes to along another, over time or along a line: y (n,) at x (n,) in their order, SI.

    `units` of the two, as keys of details end in them; `known` (n,) is what it is held against there.
    """

    x: Floats
    y: Floats
    units: tuple[str, str]
    known: Floats | None = None


@dataclass(frozen=True)
class Overlay:
    """A curve y and a reference r with its uncertainty u, (k,), at every x (k,) at which one of them bends.

    `covered` is the share of the reference's range that the curve goes over.
    """

    x: Floats
    y: Floats
    r: Floats
    u: Floats
    covered: float
    band: tuple[Floats, Floats] | None = None  # (k,) each, where it is not r - u to r + u

    @property
    def inside(self) -> float:
        """The share of the range on which the curve lies in the band of the reference."""
        if self.band is None:
            return within(self.x, self.d, self.u)
        low, high = self.band
        return within(self.x, self.y - 0.5 * (low + high), 0.5 * (high - low))

    @property
    def d(self) -> Floats:
        """The difference (k,)."""
        return self.y - self.r


def overlay(x: Floats, y: Floats, reference: Curve, unit: str = "(SI)") -> Overlay:
    """A curve over a reference, on the range that both have. Raises Undefined where there is none."""
    x, y = _grown(x, y)
    low, high = max(x[0], reference.x[0]), min(x[-1], reference.x[-1])
    if not low < high:
        raise Undefined(
            f"it goes from {x[0]:.4g} to {x[-1]:.4g} {unit}, and the reference from {reference.x[0]:.4g} to"
            f" {reference.x[-1]:.4g} {unit}: they have no range in common"
        )
    every = np.unique(np.concatenate([[low], x, reference.x, [high]]))
    at = every[(every >= low) & (every <= high)]
    r, u = np.interp(at, reference.x, reference.y), np.interp(at, reference.x, reference.u)
    own = reference.band
    band = None if own is None else (np.interp(at, reference.x, own[0]), np.interp(at, reference.x, own[1]))
    return Overlay(at, np.interp(at, x, y), r, u, float((high - low) / (reference.x[-1] - reference.x[0])), band)


def _grown(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """The curve by growing x. Raises Undefined where it turns back."""
    if len(x) < 2:
        raise Undefined("one state is a point, and no curve")
    steps = np.diff(x)
    if (steps > 0.0).all():
        return x, y
    if (steps < 0.0).all():
        return x[::-1], y[::-1]
    how = "turns back" if (steps < 0.0).any() and (steps > 0.0).any() else "stands still"
    raise Undefined(f"it {how} on the way, and a curve has one value for each x")


@dataclass(frozen=True)
class Loop:
    """A curve that goes there and back: x (n,) growing and y (n,) of both ways, on the range that both have.

    `turn` is the number of the point at which it turns, `ends` of the range.
    """

    there: tuple[Floats, Floats]
    back: tuple[Floats, Floats]
    turn: int
    ends: tuple[float, float]

    @property
    def works(self) -> tuple[float, float]:
        """The integrals of y over the two, of loading and of unloading."""
        return integral(*self.there), integral(*self.back)

    @property
    def lost(self) -> float:
        """1 - work of unloading / work of loading: the area of the loop over that of loading. Raises Undefined."""
        loading, unloading = self.works
        if loading == 0.0:
            raise Undefined("loading takes no work, so nothing is relative to it")
        return 1.0 - unloading / loading

    def within(self, low: float, high: float) -> Loop:
        """Its part between two x that it goes over."""
        return replace(self, there=_cut(*self.there, low, high), back=_cut(*self.back, low, high), ends=(low, high))


def loop(x: Floats, y: Floats, unit: str = "(SI)") -> Loop:
    """A curve that turns back once, where it is farthest from its beginning. Raises Undefined of any other."""
    turn = int(np.abs(x - x[0]).argmax())
    if turn == len(x) - 1:
        raise Undefined("it has not turned back yet, and a loop has a way there and one back")
    ways = [(x[part], y[part]) for part in (slice(0, turn + 1), slice(turn, None))]
    for way, _ in ways:
        steps = np.diff(way)
        if len(way) < 2 or not ((steps > 0.0).all() or (steps < 0.0).all()):
            raise Undefined("it stands still or turns back more than once, and a loop has one way there and one back")
    there, back = (_grown(*way) for way in ways)
    low, high = max(there[0][0], back[0][0]), min(there[0][-1], back[0][-1])
    if not low < high:
        raise Undefined(f"its two ways have no range in common: they meet at {high:.4g} {unit} alone")
    return Loop(_cut(*there, low, high), _cut(*back, low, high), turn, (float(low), float(high)))


def _cut(x: Floats, y: Floats, low: float, high: float) -> tuple[Floats, Floats]:
    """A curve of growing x from `low` to `high`, which lie on it."""
    at = np.concatenate([[low], x[(x > low) & (x < high)], [high]])
    return at, np.interp(at, x, y)


def squared(x: Floats, d: Floats) -> float:
    """The integral of d^2 over x."""
    p, q = d[:-1], d[1:]
    return float((np.diff(x) * (p * p + p * q + q * q)).sum() / 3.0)


def integral(x: Floats, d: Floats) -> float:
    """The integral of d over x."""
    return float((np.diff(x) * (d[:-1] + d[1:])).sum() / 2.0)


def between(x: Floats, d: Floats) -> float:
    """The integral of |d| over x: where d changes its sign, two triangles."""
    p, q = np.abs(d[:-1]), np.abs(d[1:])
    crosses = d[:-1] * d[1:] < 0.0
    total = np.where(crosses, p + q, 1.0)
    mean = np.where(crosses, (p * p + q * q) / (2.0 * total), 0.5 * (p + q))
    return float((np.diff(x) * mean).sum())


def rms(x: Floats, d: Floats) -> float:
    """The root of the mean square of d over x."""
    return float(np.sqrt(squared(x, d) / (x[-1] - x[0])))


def slope(x: Floats, y: Floats, share: float) -> float:
    """The slope of the straight line that is nearest to y, in the least squares, over the first part of the range.

    int (x - m) y dx / int (x - m)^2 dx about the middle m, by Simpson's rule, which is exact for these.
    """
    x, y = first(x, y, share)
    return _turn(x, x - 0.5 * (x[0] + x[-1]), y)


def tilt(x: Floats, u: Floats, share: float) -> float:
    """The most that values which are off by up to u may change that slope: int |x - m| u dx / int (x - m)^2 dx."""
    x, u = first(x, u, share)
    middle = 0.5 * (x[0] + x[-1])
    u = np.interp(at := np.unique(np.append(x, middle)), x, u)
    return _turn(at, np.abs(at - middle), u)


def _turn(x: Floats, arm: Floats, y: Floats) -> float:
    """int arm y dx / int (x - m)^2 dx, of what is straight between the x."""
    a, b, p, q = arm[:-1], arm[1:], y[:-1], y[1:]
    above = (np.diff(x) * (a * p + (a + b) * (p + q) + b * q)).sum() / 6.0
    return float(above / ((x[-1] - x[0]) ** 3 / 12.0))


def first(x: Floats, y: Floats, share: float) -> tuple[Floats, Floats]:
    """The first part of a curve, from where it begins."""
    end = x[0] + share * (x[-1] - x[0])
    at = np.append(x[x < end], end)
    return at, np.interp(at, x, y)


def within(x: Floats, d: Floats, u: Floats) -> float:
    """The share of the range on which |d| <= u, both straight between the x."""
    at, d = _refined(x, d)
    gap = np.abs(d) - np.interp(at, x, u)  # straight between these
    at, gap = _refined(at, gap)
    inside = 0.5 * (gap[:-1] + gap[1:]) <= 0.0
    return float(np.diff(at)[inside].sum() / (x[-1] - x[0]))


def _refined(x: Floats, d: Floats) -> tuple[Floats, Floats]:
    at = np.unique(np.concatenate([x, _zeros(x, d)]))
    return at, np.interp(at, x, d)


def _zeros(x: Floats, d: Floats) -> Floats:
    """Where d crosses zero between the x."""
    after = np.flatnonzero(d[:-1] * d[1:] < 0.0) + 1
    share = d[after - 1] / (d[after - 1] - d[after])
    zeros: Floats = x[after - 1] + share * (x[after] - x[after - 1])
    return zeros


def slopes(reference: Curve, x: Floats) -> Floats:
    """The steepest that a reference is beside each x (n,)."""
    steep = np.abs(np.diff(reference.y) / np.diff(reference.x))
    after = np.clip(np.searchsorted(reference.x, x), 1, len(steep))
    before = np.clip(np.searchsorted(reference.x, x, side="right"), 1, len(steep))
    found: Floats = np.maximum(steep[after - 1], steep[before - 1])
    return found
