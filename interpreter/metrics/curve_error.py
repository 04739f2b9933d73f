"""Error of a metric's curve compared with a measured curve."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Literal

from softmark.interpreter.metrics import curve_geometry
from softmark.interpreter.metrics.curve_geometry import MetricCurve
from softmark.interpreter.metrics.curve_metrics import CurveMetric
from softmark.interpreter.metrics.measurement import Measurement
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np

    from softmark.interpreter.metrics.curve_geometry import Curve, Overlay
    from softmark.interpreter.metrics.measurement import Floats, MetricInput
else:
    from softmark.solvers.runtime.lazy_modules import np

Statistic = Literal["rms", "max", "area", "unexplained", "slope"]


@dataclass(frozen=True)
class CurveError(CurveMetric):
    """Relative error of a metric's curve compared with a measured curve, on the range that both cover.

    In a dynamic analysis the curve is a `displacement` or a contact result over time. In a static analysis it runs from
    state to state: the value of the metric `of` against the value of the metric `over`, such as force over travel. In
    each state the number is for the curve up to that state, in the last state for the whole curve. The error of
    straight lines between states is part of the stated error: use enough states.

    `rms`: root mean square of the difference, divided by that of the reference. `max`: largest difference, divided by
    the largest value of the reference. `area`: area between the two curves, divided by the area below |reference|.
    `unexplained`: int (y - r)^2 / int (r - mean of r)^2, which is 1 - R^2. `slope`: difference of the slopes of the
    least squares lines through the first part, `initial`, of the range, relative to that of the reference. All are
    exact integrals and extremes of piecewise linear curves; nothing is sampled. For a single state `rms`, `max` and
    `area` are the difference divided by the value of the reference, and the other statistics have no value.

    The uncertainty of a value is the same statistic of the reference's uncertainty. For `max` it is the uncertainty
    where the difference is largest, for `slope` the largest change of slope that it allows. The report also gives
    covered (the share of the reference's range that is compared) and where that range begins and ends; rms and largest
    difference in the unit of the metric, and where the difference is largest; r_squared; and inside, the share of the
    range on which the difference is below the uncertainty, or the curve lies inside the band of codes.
    """

    of: Annotated[str, "metric", "metric whose curve is compared"]
    against: Annotated[str, "reference", "measured curve: a reference `curve` or `consensus_curve`"]
    over: Annotated[
        str | None, "metric", "in statics: metric on the horizontal axis of the curve, such as the travel"
    ] = None
    statistic: Annotated[Statistic, "statistic of the differences"] = "rms"
    initial: Annotated[float, "1 in (0, 1]", "for `slope`: initial part of the range"] = 0.1

    @property
    def statistic_name(self) -> str:
        """Name of the statistic."""
        return self.statistic

    def measure(self, seen: MetricInput) -> Measurement:
        """Return the requested statistic of the difference between the two curves. Raises Undefined."""
        if seen.curve is None or seen.known is None or seen.known.curve is None:
            raise Undefined(f"`{self.against}` is not a curve, or there is no curve to compare it with")
        x, y, (along, own), reference = seen.curve.x, seen.curve.y, seen.curve.units, seen.known.curve
        if len(x) == 1:
            return self._compare_single_point(float(x[0]), float(y[0]), reference, (along, own))
        over = curve_geometry.overlay(x, y, reference, along)
        value, uncertainty = _STATISTICS[self.statistic](over, self.initial)
        at = int(np.abs(over.d).argmax())
        details = {
            "covered_share": over.covered, f"from_{along}": float(over.x[0]), f"to_{along}": float(over.x[-1]),
            f"rms_{own}": curve_geometry.rms(over.x, over.d), f"largest_{own}": float(np.abs(over.d[at])),
            f"largest_at_{along}": float(over.x[at]), "r_squared": _explained_variance(over),
            "inside_share": over.inside,
        }  # fmt: skip
        return Measurement(value, details, uncertainty=uncertainty, curve=seen.curve)

    def _compare_single_point(self, x: float, y: float, reference: Curve, units: tuple[str, str]) -> Measurement:
        """Return the comparison of a curve of a single point (x, y) with the reference at the same x."""
        if self.statistic in ("unexplained", "slope"):
            raise Undefined(f"`{self.statistic}` needs a curve of two or more states, and there is one")
        if not reference.x[0] <= x <= reference.x[-1]:
            raise Undefined(
                f"its single state is at {x:.4g} {units[0]}, outside the range of the reference, "
                f"{reference.x[0]:.4g} to {reference.x[-1]:.4g} {units[0]}"
            )
        r, u = (float(np.interp(x, reference.x, values)) for values in (reference.y, reference.u))
        size = _nonzero_divisor(abs(r))
        along, own = units
        details = {f"at_{along}": x, f"found_{own}": y, f"measured_{own}": r, f"uncertain_{own}": u}
        point = MetricCurve(np.array([x]), np.array([y]), units)
        return Measurement(abs(y - r) / size, details, uncertainty=u / size, curve=point)

    def stated(self, course: MetricCurve, off: Floats, along: Floats, reference: Curve | None) -> dict[str, float]:
        """Return bounds of the error of the statistic, by cause.

        The causes are straight lines between states, errors `off` (n,) of the values y, and errors `along` (n,) of
        their positions x. Raises Undefined.
        """
        if reference is None:
            raise Undefined(f"`{self.against}` is not a curve")
        x, y = course.x, course.y
        return {
            "states": self.chord_error(x, y, reference),
            self.of: self.moved(x, y, off, reference),
            self.over or "time": self.moved(x, y, along * curve_geometry.steepest_slopes(reference, x), reference),
        }

    def bound_replacement_change(self, x: Floats, y: Floats, other: Floats, reference: Curve) -> float:
        """Return a bound of the change of the statistic if `other` (n,) replaces the curve y (n,) over the same x.

        Raises Undefined.
        """
        return self.moved(x, y, other - y, reference)

    def moved(self, x: Floats, y: Floats, off: Floats, reference: Curve) -> float:
        """Return a bound of the change of the statistic if the curve y (n,) over x (n,) changes by `off` (n,).

        `off` is linear between the points. By the triangle inequality, the bound is the statistic of `off`, relative to
        the
        reference r. The statistic `unexplained` integrates the square of e = y - r: its integral changes by at most
        2 |e| |off| + |off|^2, where |f| is the root of the integral of f^2. Raises Undefined.
        """
        if len(x) == 1:
            return float(np.abs(off[0])) / _nonzero_divisor(abs(float(np.interp(x[0], reference.x, reference.y))))
        o, e = curve_geometry.overlay(x, off, reference), curve_geometry.overlay(x, y, reference)
        if self.statistic == "unexplained":
            size, own, more = (
                _integrated_variance(o),
                curve_geometry.integrate_square(e.x, e.d),
                curve_geometry.integrate_square(o.x, o.y),
            )
            return (2.0 * math.sqrt(own * more) + more) / size
        return _STATISTICS[self.statistic](replace(o, y=o.r + o.y), self.initial)[0]

    def chord_error(self, x: Floats, y: Floats, reference: Curve) -> float:
        """Return an estimate of the change of the statistic due to straight lines between states.

        It is a third of the change when every second state is left out, because the error falls with the square of the
        distance between states. Raises Undefined for fewer than three states.
        """
        if len(x) < 3:
            raise Undefined("the error of a curve with fewer than three states is not known")
        some = np.unique(np.append(np.arange(0, len(x), 2), len(x) - 1))
        grown = np.argsort(x[some])
        coarse = np.interp(x, x[some][grown], y[some][grown])
        return self.moved(x, y, coarse - y, reference) / 3.0


def _nonzero_divisor(value: float) -> float:
    """Return the value as divisor. Raises Undefined if it is zero."""
    if value == 0.0:
        raise Undefined("the reference is zero there, so there is no relative error")
    return value


def _relative_rms_error(o: Overlay, initial: float) -> tuple[float, float | None]:
    """Return the root mean square difference relative to the reference, and its uncertainty."""
    size = _nonzero_divisor(curve_geometry.rms(o.x, o.r))
    return curve_geometry.rms(o.x, o.d) / size, curve_geometry.rms(o.x, o.u) / size


def _relative_max_error(o: Overlay, initial: float) -> tuple[float, float | None]:
    """Return the largest difference relative to the largest reference value, and its uncertainty."""
    size, at = _nonzero_divisor(float(np.abs(o.r).max())), int(np.abs(o.d).argmax())
    return float(np.abs(o.d[at])) / size, float(o.u[at]) / size


def _relative_area_error(o: Overlay, initial: float) -> tuple[float, float | None]:
    """Return the area between the curves relative to the area below the reference, and its uncertainty."""
    size = _nonzero_divisor(curve_geometry.integrate_absolute(o.x, o.r))
    return curve_geometry.integrate_absolute(o.x, o.d) / size, curve_geometry.integrate(o.x, o.u) / size


def _unexplained_variance(o: Overlay, initial: float) -> tuple[float, float | None]:
    """Return the unexplained fraction of the variance, 1 - R^2, and its uncertainty."""
    size = _integrated_variance(o)
    return curve_geometry.integrate_square(o.x, o.d) / size, curve_geometry.integrate_square(o.x, o.u) / size


def _integrated_variance(o: Overlay) -> float:
    """Return int (r - mean of r)^2 dx of the reference r. Raises Undefined for a constant reference."""
    mean = curve_geometry.integrate(o.x, o.r) / (o.x[-1] - o.x[0])
    if (size := curve_geometry.integrate_square(o.x, o.r - mean)) == 0.0:
        raise Undefined("the reference is constant, so there is no variance to explain")
    return size


def _explained_variance(o: Overlay) -> float | None:
    """Return the coefficient of determination R^2; None for a constant reference."""
    try:
        return 1.0 - _unexplained_variance(o, 0.0)[0]
    except Undefined:
        return None


def _relative_slope_error(o: Overlay, initial: float) -> tuple[float, float | None]:
    """Return the difference of the initial slopes relative to that of the reference, and its uncertainty."""
    size = _nonzero_divisor(abs(curve_geometry.fit_initial_slope(o.x, o.r, initial)))
    return abs(curve_geometry.fit_initial_slope(o.x, o.d, initial)) / size, curve_geometry.bound_slope_change(
        o.x, o.u, initial
    ) / size


_STATISTICS = {
    "rms": _relative_rms_error,
    "max": _relative_max_error,
    "area": _relative_area_error,
    "unexplained": _unexplained_variance,
    "slope": _relative_slope_error,
}
