"""Observed orders of convergence, extrapolated limits and their uncertainty, for families of pairs (h, value).

A family is one quantity on several meshes or with several time steps, from coarse to fine, with any ratios. h is a
representative cell size or step. No result is NaN: for every missing number there is a reason.

Sources: Richardson 1911; Roache 1994 (grid convergence index); Celik, Ghia, Roache, Freitas, Coleman and Raad 2008, J.
Fluids Eng. 130:078001 (three grids, any ratios; as in ASME V&V 20-2009); Eca and Hoekstra 2014, J. Comput. Phys.
262:104 (least squares over more than three).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from itertools import pairwise
from typing import Any, Literal

from softmark.records import dataclass

Pair = tuple[float, float]  # h, value
State = Literal["monotone", "oscillatory", "divergent", "assumed", "rounding", "too_few", "unusable"]

SAFETY_THREE, SAFETY_TWO = 1.25, 3.0  # Roache 1994: with an order that was observed, and with one that is assumed
LARGEST = 20.0  # an observed order beyond this is no order: the finest two values agree by chance
NEAR = 0.1  # tolerance of the ratio that is one in the asymptotic range
# Parts of the formal order between which an observed one counts. Below: edges where a support ends leave displacements
# an order of 1 to 2 whatever the element (Szabo and Babuska 1991, chapter 10), and Eca and Hoekstra (2014) trust a
# quarter at least; half of it is the stricter. Above: nothing smooth converges faster than theory, and they stop at
# 1.05; orders of 2.3 for 2 are common while small terms of the next power are left.
BAND = (0.5, 1.25)
SLOWEST = 0.5  # order that a doubtful one is put up to for its index (Oberkampf and Roy 2010, section 8.8)
SIMILAR = 0.1  # how far ratios of cell sizes of two meshes may be apart: 1.5^1.5 - 1 is then off by a fifth, below 1.25
HUGE = 1e150  # squares of larger values are no numbers
CLOSEST, FARTHEST = 1e-3, 1e12  # ratios of h less one: closer ones tell nothing but rounding
ROUNDING = 64 * 2.0**-52  # relative: differences of values below it are rounding


@dataclass(frozen=True)
class ConvergenceEstimate:
    """Limit of a refinement family and its uncertainty.

    `value` is the extrapolated limit. `gci` is the grid convergence index: the half width about the *finest* value
    within which the limit is expected (with three grids and more in about 95 % of regular families). Both are in the
    unit of the values; `relative` is `gci` as a fraction of the finest value. `ratio` is GCI_coarse / (r^p GCI_fine) of
    the finest three values; it is one in the asymptotic range. With only three grids it is one by construction, except
    for the change of the value itself. `scatter` is the standard deviation of a least-squares fit. If `order` is None,
    `reason` explains why.
    """

    state: State
    reason: str | None = None
    order: float | None = None
    value: float | None = None
    gci: float | None = None
    relative: float | None = None
    extrapolated_change: float | None = None  # |value - finest| / |value|
    ratio: float | None = None
    scatter: float | None = None
    asymptotic: bool = False  # whether order, value and gci can be relied upon
    doubt: str | None = None  # why they cannot

    def to_json(self) -> dict[str, Any]:
        """Return the entries that are not None, by name."""
        return {name: value for name, value in asdict(self).items() if value is not None}


@dataclass(frozen=True)
class ErrorOrder:
    """Order of convergence of errors against a known truth: from the last two errors, and by least squares over all."""

    last: float | None = None
    fitted: float | None = None
    reason: str | None = None

    def to_json(self) -> dict[str, Any]:
        """Return the entries that are not None, by name."""
        return {name: value for name, value in asdict(self).items() if value is not None}


# ------------------------------------------------------------------ the limit of values


def estimate_convergence(
    family: Sequence[Pair], formal: float | None = None, *, floor: float | None = None
) -> ConvergenceEstimate:
    """Return order, limit and grid convergence index of a family, from coarse to fine.

    `formal` is the theoretical order, if known; a family of two values needs it. With more values, an observed order
    outside of BAND puts the asymptotic range in doubt, and the index is then that of Oberkampf and Roy (2010, section
    8.8): a factor of 3 with the observed order, limited to the range from 0.5 to the formal order. Differences below
    `floor` (by default a few roundings of the largest value) are ignored.
    """
    unusable = _reason_unusable(family)
    if unusable is not None:
        return ConvergenceEstimate("unusable", unusable)
    if len(family) < 2:
        return ConvergenceEstimate(
            "too_few", "an observed order needs three meshes; two are enough if the order is assumed"
        )
    if len(family) == 2:
        return _estimate_from_two(family, formal, _rounding_floor(family, floor))
    finest = _estimate_from_three(family[-3:], _rounding_floor(family, floor))
    if finest.order is None or finest.state != "monotone" or len(family) == 3:
        return _check_asymptotic_range(finest, family, formal)
    return _check_asymptotic_range(_estimate_from_fit(family, finest), family, formal)


def observed_order(family: Sequence[Pair]) -> float | None:
    """Return the observed order p of a family of three values, None if there is none.

    It solves |ln |e32 / e21| + q(p)| = p ln r21 with q(p) = ln((r21^p - s) / (r32^p - s)), r21 = h2 / h1 and e21 =
    value2 - value1, where 1 is the finest; s is the sign of e32 / e21. None if no p in (0, LARGEST] satisfies the
    equation.
    Source: Celik et al. 2008, equation (3).
    """
    (h3, f3), (h2, f2), (h1, f1) = family
    coarse, fine = f3 - f2, f2 - f1
    if coarse == 0 or fine == 0:
        return None
    r21, r32, sign = h2 / h1, h3 / h2, math.copysign(1.0, coarse / fine)
    grown = math.log(abs(coarse / fine))

    def left(p: float) -> float:
        return grown - p * math.log(r21) - _log_power_difference(r32, p, sign) + _log_power_difference(r21, p, sign)

    return _bisect_root(left, 1e-6, LARGEST)


def _log_power_difference(r: float, p: float, sign: float) -> float:
    """Return ln(r^p - s), s being `sign`, without cancellation if r^p is near one."""
    return math.log(math.expm1(p * math.log(r)) if sign > 0 else r**p + 1.0)


def _bisect_root(f: Callable[[float], float], low: float, high: float) -> float | None:
    """Return the root of a decreasing function between `low` and `high` by bisection, None if there is none."""
    if f(low) < 0 or f(high) > 0:
        return None
    while high - low > 1e-13 * high:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if f(middle) > 0 else (low, middle)
    return 0.5 * (low + high)


def _reason_unusable(family: Sequence[Pair]) -> str | None:
    if not all(math.isfinite(h) and math.isfinite(f) for h, f in family):
        return "a value is not a finite number"
    if any(abs(f) > HUGE for _, f in family):
        return f"a value exceeds {HUGE:g}"
    sizes = [h for h, _ in family]
    if any(h <= 0 for h in sizes) or any(b >= a for a, b in pairwise(sizes)):
        return "the meshes are not ordered from coarse to fine"
    close = any(not CLOSEST <= a / b - 1 <= FARTHEST for a, b in pairwise(sizes))
    return f"consecutive meshes must differ in h by factors of {1 + CLOSEST:g} to {FARTHEST:g}" if close else None


def _rounding_floor(family: Sequence[Pair], floor: float | None) -> float:
    return ROUNDING * max(abs(f) for _, f in family) if floor is None else floor


def _estimate_from_two(family: Sequence[Pair], formal: float | None, floor: float) -> ConvergenceEstimate:
    """Return the estimate from a family of two values and the formal order."""
    (h2, f2), (h1, f1) = family
    if formal is None:
        return ConvergenceEstimate("too_few", "two meshes give no order, and none is known")
    if abs(f2 - f1) <= floor:
        return ConvergenceEstimate("rounding", "the two values differ only by rounding")
    away = (f1 - f2) / math.expm1(formal * math.log(h2 / h1))
    return _with_doubt(_make_estimate("assumed", formal, f1, away, SAFETY_TWO), "the order is assumed")


def _estimate_from_three(family: Sequence[Pair], floor: float) -> ConvergenceEstimate:
    """Return the estimate from the finest three values of a family, by the formulas of Celik et al."""
    (h3, f3), (h2, f2), (h1, f1) = family
    coarse, fine = f3 - f2, f2 - f1
    if abs(coarse) <= floor or abs(fine) <= floor:
        return ConvergenceEstimate("rounding", "the differences of the finest values are only rounding")
    p = observed_order(family)
    if coarse * fine < 0:
        if p is None:
            return ConvergenceEstimate("oscillatory", "the values oscillate, with growing amplitude on finer meshes")
        found = _make_estimate("oscillatory", p, f1, -fine / (math.expm1(p * math.log(h2 / h1))), SAFETY_THREE)
        return _with_doubt(found, "the values oscillate about their limit")
    if p is None:
        grows = abs(coarse) < abs(fine) * math.log(h3 / h2) / math.log(h2 / h1)
        words = (
            "the differences do not decrease with the cell size" if grows else "the finest two values agree by chance"
        )
        return ConvergenceEstimate("divergent" if grows else "rounding", words)
    found = _make_estimate("monotone", p, f1, -fine / math.expm1(p * math.log(h2 / h1)), SAFETY_THREE)
    return replace(found, ratio=_asymptotic_ratio(family, p))


def _asymptotic_ratio(family: Sequence[Pair], p: float) -> float | None:
    """Return GCI_coarse / (r^p GCI_fine) of three values, from their relative changes.

    The ratio is one in the asymptotic range.
    """
    (h3, f3), (h2, f2), (h1, f1) = family
    coarse = (f3 - f2) * f1 / math.expm1(p * math.log(h3 / h2))
    fine = (f2 - f1) * f2 / math.expm1(p * math.log(h2 / h1))
    return _finite_ratio(coarse, (h2 / h1) ** p * fine)


def _make_estimate(
    state: State, p: float, finest: float, away: float, safety: float, scatter: float = 0.0
) -> ConvergenceEstimate:
    """Return the estimate from the order p and the finest value.

    `away` is the distance of the limit from the finest value, `safety` the safety factor of the index.
    """
    limit, gci = finest + away, safety * abs(away) + scatter
    return ConvergenceEstimate(state, None, p, limit, gci, _finite_ratio(gci, finest), _finite_ratio(away, limit))


def _with_doubt(found: ConvergenceEstimate, doubt: str | None) -> ConvergenceEstimate:
    """Return the estimate with a reason to doubt the asymptotic range, or with None if there is no doubt."""
    return replace(found, doubt=doubt, asymptotic=doubt is None)


def _finite_ratio(a: float, b: float) -> float | None:
    """Return |a / b|, or None if it is not finite."""
    part = abs(a / b) if b else math.inf
    return part if math.isfinite(part) else None


def _check_asymptotic_range(
    found: ConvergenceEstimate, family: Sequence[Pair], formal: float | None
) -> ConvergenceEstimate:
    """Return the estimate with a reason to doubt the asymptotic range, if there is one."""
    if found.order is None or found.doubt is not None:
        return found
    if formal is not None and not BAND[0] * formal <= found.order <= BAND[1] * formal:
        doubt = f"not asymptotic: observed order {found.order:.2f}, theoretical order {formal:g}"
        return _with_doubt(_with_larger_index(found, family, formal), doubt)
    if found.ratio is not None and abs(found.ratio - 1) > NEAR:
        return _with_doubt(found, f"the scaled indices of the finest meshes have a ratio of {found.ratio:.2f}, not 1")
    return _with_doubt(found, None)


def _with_larger_index(found: ConvergenceEstimate, family: Sequence[Pair], formal: float) -> ConvergenceEstimate:
    """Return the estimate with a larger index, for an observed order that contradicts the formal one.

    The extrapolated limit is not changed.
    """
    (h2, f2), (h1, f1) = family[-2:]
    p = min(max(found.order or SLOWEST, SLOWEST), formal)
    away = abs(f1 - f2) / math.expm1(p * math.log(h2 / h1))
    gci = max(found.gci or 0.0, SAFETY_TWO * away)
    return replace(found, gci=gci, relative=_finite_ratio(gci, f1))


def find_dissimilarity(counts: Sequence[Sequence[int]]) -> str | None:
    """Return the reason why meshes are not similar, None if they are.

    `counts` are the numbers of cells of each mesh along each direction, from coarse to fine. Richardson's extrapolation
    requires all numbers to change by one ratio (Roache 1998, section 5.9). Cell numbers are integers, so the ratio may
    differ from the requested one. The finest three meshes are compared, within SIMILAR.
    """
    for coarse, fine in pairwise(counts[-3:]):
        ratios = [b / a for a, b in zip(coarse, fine, strict=True)]
        if max(ratios) > (1 + SIMILAR) * min(ratios):
            least, most = f"{min(ratios):.3g} times in one direction", f"{max(ratios):.3g} times in another"
            row = " and ".join(" x ".join(f"{n:d}" for n in own) for own in (coarse, fine))
            return f"the sizes do not divide the body evenly, into {row} cells: cells shrink {least} and {most}"
    return None


# ------------------------------------------------------------------ least squares


def _estimate_from_fit(family: Sequence[Pair], finest: ConvergenceEstimate) -> ConvergenceEstimate:
    """Return the estimate from a fit of value = limit + a h^p to more than three values, equally weighted.

    The uncertainty is U = Fs |value_1 - limit| + scatter + |value_1 - fit_1|, where 1 is the finest. Fs is 1.25, or 3
    if the fit scatters by more than the mean difference of the values.
    Source: Eca and Hoekstra 2014, equations (7) to (14).
    """
    p = _minimize(lambda q: _fit_with_order(family, q)[2], 0.05, 2 * LARGEST / 5)
    limit, slope, square = _fit_with_order(family, p)
    values = [f for _, f in family]
    h, f = family[-1]
    scatter = math.sqrt(square / (len(family) - 3))
    range_ = (max(values) - min(values)) / (len(values) - 1)
    safety = SAFETY_THREE if scatter < range_ else SAFETY_TWO
    beside = abs(f - limit - slope * h**p)
    found = _make_estimate("monotone", p, f, limit - f, safety, scatter + beside)
    edge = p < 0.051 or p > 2 * LARGEST / 5 - 0.01
    ratio = _asymptotic_ratio(family[-3:], p)
    found = replace(found, scatter=scatter, ratio=ratio)
    return _with_doubt(found, "no power of h fits the values") if edge or scatter >= range_ else found


def _fit_with_order(family: Sequence[Pair], p: float) -> tuple[float, float, float]:
    """Return limit, a and the sum of squared residuals of a least squares fit of value = limit + a h^p."""
    t = [(h / family[0][0]) ** p for h, _ in family]
    t_mean, f_mean = sum(t) / len(t), sum(f for _, f in family) / len(t)
    across = sum((x - t_mean) * (f - f_mean) for x, (_, f) in zip(t, family, strict=True))
    slope = across / sum((x - t_mean) ** 2 for x in t)
    limit = f_mean - slope * t_mean
    square = sum((f - limit - slope * x) ** 2 for x, (_, f) in zip(t, family, strict=True))
    return limit, slope / family[0][0] ** p, square


def _minimize(f: Callable[[float], float], low: float, high: float) -> float:
    """Return the minimiser of a function between `low` and `high`.

    The best of a row of points is refined by golden section search.
    """
    points = [low * math.pow(high / low, i / 60) for i in range(61)]
    best = min(range(61), key=lambda i: f(points[i]))
    a, b = points[max(best - 1, 0)], points[min(best + 1, 60)]
    golden = (math.sqrt(5) - 1) / 2
    while b - a > 1e-9 * b:
        c, d = b - golden * (b - a), a + golden * (b - a)
        a, b = (a, d) if f(c) < f(d) else (c, b)
    return 0.5 * (a + b)


# ------------------------------------------------------------------ errors against a known truth


def order_of_errors(errors: Sequence[Pair], floor: float = 0.0) -> ErrorOrder:
    """Return the slopes of log error over log h, from coarse to fine.

    Errors up to `floor` are rounding errors and end the series.
    """
    unusable = _reason_unusable(errors)
    if unusable is not None:
        return ErrorOrder(reason=unusable)
    if any(e < 0 for _, e in errors):
        return ErrorOrder(reason="an error is negative")
    kept = [(math.log(h), math.log(e)) for h, e in errors if e > floor]
    if len(kept) < len(errors):
        return ErrorOrder(reason="an error is only rounding")
    if len(kept) < 2:
        return ErrorOrder(reason="an order needs two meshes")
    (x2, y2), (x1, y1) = kept[-2:]
    x_mean, y_mean = (sum(c) / len(kept) for c in zip(*kept, strict=True))
    fitted = sum((x - x_mean) * (y - y_mean) for x, y in kept) / sum((x - x_mean) ** 2 for x, _ in kept)
    return ErrorOrder((y2 - y1) / (x2 - x1), fitted)
