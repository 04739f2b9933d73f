"""How far the curve of a metric is from one that was measured."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Literal

from softmark.interpreter.metrics import curve_geometry
from softmark.interpreter.metrics.curve_geometry import Course
from softmark.interpreter.metrics.curve_metrics import OfCurves
from softmark.interpreter.metrics.measurement import Measurement
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np

    from softmark.interpreter.metrics.curve_geometry import Curve, Overlay
    from softmark.interpreter.metrics.measurement import Floats, Seen
else:
    from softmark.solvers.runtime.lazy_modules import np

Statistic = Literal["rms", "max", "area", "unexplained", "slope"]


@dataclass(frozen=True)
class CurveError(OfCurves):
    """How far the curve of a metric is from a measured one, relative, on the range that both have.

    In a dynamic analysis the curve is that of a `displacement`, or of what a contact does, over time. At rest it
    goes from state to state: what the metric `of` comes to, where the metric `over` says that it lies, as force
    over travel; in each state the number is that of the curve up to there, in the last one that of all. What
    straight lines between states leave out is a part of the stated error: take enough of them.

    `rms`: the root of the mean square of the difference, over that of the reference. `max`: the largest difference,
    over the largest value of the reference. `area`: the area between the two, over that below |reference|.
    `unexplained`: int (y - r)^2 / int (r - mean of r)^2, which is 1 - R^2. `slope`: of the straight lines that are
    nearest in the least squares to the first part, `initial`, of the range, relative to that of the reference. All are
    exact integrals and extremes of curves that are straight between their points; nothing is sampled. Of a single state
    `rms`, `max` and `area` are the difference over the value of the reference, and the others have no value.

    The uncertainty of a value is the same statistic of the reference's uncertainty; of `max` it is that where
    the difference is largest, of `slope` the most that it could tilt the line. Beside its value a report has covered,
    the share of the reference's range that is judged, and where it begins and ends; rms and largest of the difference
    in the unit of the metric, and where it is largest; r_squared; and inside, the share of the range on which the
    difference is below the uncertainty, or the curve inside the band of codes.
    """

    of: Annotated[str, "metric", "the metric whose curve is looked at"]
    against: Annotated[str, "reference", "the measured curve, a reference `curve`, or a `consensus_curve`"]
    over: Annotated[str | None, "metric", "at rest: the metric along which the curve goes, such as the travel"] = None
    statistic: Annotated[Statistic, "what the differences are summed up by"] = "rms"
    initial: Annotated[float, "1 in (0, 1]", "of `slope`: which part of the range counts as its beginning"] = 0.1

    @property
    def summed_by(self) -> str:
        """The statistic."""
        return self.statistic

    def measure(self, seen: Seen) -> Measurement:
        """The statistic of the difference. Raises Undefined."""
        if seen.curve is None or seen.known is None or seen.known.curve is None:
            raise Undefined(f"`{self.against}` is no curve, or there is none to compare it with")
        x, y, (along, own), reference = seen.curve.x, seen.curve.y, seen.curve.units, seen.known.curve
        if len(x) == 1:
            return self._point(float(x[0]), float(y[0]), reference, (along, own))
        over = curve_geometry.overlay(x, y, reference, along)
        value, uncertainty = _STATISTICS[self.statistic](over, self.initial)
        at = int(np.abs(over.d).argmax())
        details = {
            "covered_share": over.covered, f"from_{along}": float(over.x[0]), f"to_{along}": float(over.x[-1]),
            f"rms_{own}": curve_geometry.rms(over.x, over.d), f"largest_{own}": float(np.abs(over.d[at])),
            f"largest_at_{along}": float(over.x[at]), "r_squared": _explained(over),
            "inside_share": over.inside,
        }  # fmt: skip
        return Measurement(value, details, uncertainty=uncertainty, curve=seen.curve)

    def _point(self, x: float, y: float, reference: Curve, units: tuple[str, str]) -> Measurement:
        """One state against the reference there."""
        if self.statistic in ("unexplained", "slope"):
            raise Undefined(f"one state is a point, which has no `{self.statistic}`")
        if not reference.x[0] <= x <= reference.x[-1]:
            raise Undefined(
                f"it is at {x:.4g} {units[0]}, and the reference goes from {reference.x[0]:.4g} to"
                f" {reference.x[-1]:.4g} {units[0]}"
            )
        r, u = (float(np.interp(x, reference.x, values)) for values in (reference.y, reference.u))
        size = _size(abs(r))
        along, own = units
        details = {f"at_{along}": x, f"found_{own}": y, f"measured_{own}": r, f"uncertain_{own}": u}
        point = Course(np.array([x]), np.array([y]), units)
        return Measurement(abs(y - r) / size, details, uncertainty=u / size, curve=point)

    def stated(self, course: Course, off: Floats, along: Floats, reference: Curve | None) -> dict[str, float]:
        """What chords between states leave out, and what values and their places are off by. Raises Undefined."""
        if reference is None:
            raise Undefined(f"`{self.against}` is no curve")
        x, y = course.x, course.y
        return {
            "states": self.chords(x, y, reference),
            self.of: self.moved(x, y, off, reference),
            self.over or "time": self.moved(x, y, along * curve_geometry.slopes(reference, x), reference),
        }

    def apart(self, x: Floats, y: Floats, other: Floats, reference: Curve) -> float:
        """How much the value may change where a curve y (n,) becomes another over the same x (n,). Raises Undefined."""
        return self.moved(x, y, other - y, reference)

    def moved(self, x: Floats, y: Floats, off: Floats, reference: Curve) -> float:
        """How much it may change where a curve y (n,) moves by `off` (n,), straight between its points.

        By the triangle inequality no more than the same statistic of what it moves by, relative to the reference; of
        int e^2 with e = y - r no more than int (2 |e d| + d^2), where |e d| is no more than the norms of both. Raises
        Undefined.
        """
        if len(x) == 1:
            return float(np.abs(off[0])) / _size(abs(float(np.interp(x[0], reference.x, reference.y))))
        o, e = curve_geometry.overlay(x, off, reference), curve_geometry.overlay(x, y, reference)
        if self.statistic == "unexplained":
            size, own, more = _variance(o), curve_geometry.squared(e.x, e.d), curve_geometry.squared(o.x, o.y)
            return (2.0 * math.sqrt(own * more) + more) / size
        return _STATISTICS[self.statistic](replace(o, y=o.r + o.y), self.initial)[0]

    def chords(self, x: Floats, y: Floats, reference: Curve) -> float:
        """How much it may change by what straight lines between states leave out, a third of what those between every
        second state do, for it falls with the square of their distance. Raises Undefined of fewer than three states."""
        if len(x) < 3:
            raise Undefined("what a curve does between fewer than three states is not known")
        some = np.unique(np.append(np.arange(0, len(x), 2), len(x) - 1))
        grown = np.argsort(x[some])
        coarse = np.interp(x, x[some][grown], y[some][grown])
        return self.moved(x, y, coarse - y, reference) / 3.0


def _size(value: float) -> float:
    if value == 0.0:
        raise Undefined("the reference is zero there, so nothing is relative to it")
    return value


def _rms(o: Overlay, initial: float) -> tuple[float, float | None]:
    size = _size(curve_geometry.rms(o.x, o.r))
    return curve_geometry.rms(o.x, o.d) / size, curve_geometry.rms(o.x, o.u) / size


def _max(o: Overlay, initial: float) -> tuple[float, float | None]:
    size, at = _size(float(np.abs(o.r).max())), int(np.abs(o.d).argmax())
    return float(np.abs(o.d[at])) / size, float(o.u[at]) / size


def _area(o: Overlay, initial: float) -> tuple[float, float | None]:
    size = _size(curve_geometry.between(o.x, o.r))
    return curve_geometry.between(o.x, o.d) / size, curve_geometry.integral(o.x, o.u) / size


def _unexplained(o: Overlay, initial: float) -> tuple[float, float | None]:
    size = _variance(o)
    return curve_geometry.squared(o.x, o.d) / size, curve_geometry.squared(o.x, o.u) / size


def _variance(o: Overlay) -> float:
    """int (r - mean of r)^2."""
    mean = curve_geometry.integral(o.x, o.r) / (o.x[-1] - o.x[0])
    if (size := curve_geometry.squared(o.x, o.r - mean)) == 0.0:
        raise Undefined("the reference is the same everywhere, so there is nothing to explain")
    return size


def _explained(o: Overlay) -> float | None:
    """R^2; None of a reference that is the same everywhere."""
    try:
        return 1.0 - _unexplained(o, 0.0)[0]
    except Undefined:
        return None


def _slope(o: Overlay, initial: float) -> tuple[float, float | None]:
    size = _size(abs(curve_geometry.slope(o.x, o.r, initial)))
    return abs(curve_geometry.slope(o.x, o.d, initial)) / size, curve_geometry.tilt(o.x, o.u, initial) / size


_STATISTICS = {"rms": _rms, "max": _max, "area": _area, "unexplained": _unexplained, "slope": _slope}
