"""Hysteresis: the fraction of the work of loading that a body does not return when it is unloaded."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar

from softmark.interpreter.metrics import curve_geometry
from softmark.interpreter.metrics.curve_geometry import MetricCurve
from softmark.interpreter.metrics.curve_metrics import CurveMetric
from softmark.interpreter.metrics.measurement import Measurement
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np

    from softmark.interpreter.metrics.curve_geometry import Curve, HysteresisLoop
    from softmark.interpreter.metrics.measurement import Floats, MetricInput
else:
    from softmark.solvers.runtime.lazy_modules import np

SAME = 1e-9  # relative to the largest: closer values count as equal


@dataclass(frozen=True)
class Hysteresis(CurveMetric):
    """Area of the loop between loading and unloading, relative to the work of loading.

    The states of the analysis go up and down again: `static(states = [25, 50, 75, 100, 75, 50, 25] %)`. The curve is
    the value of the metric `of` against that of the metric `over`, such as force over travel; it turns where it is
    farthest from its start. The value is 1 - (int y dx of unloading) / (int y dx of loading), on the range that both
    ways cover, exact for straight lines between states. It is 0 for an elastic body that returns along the same path, 1
    if no work is returned, and negative if more is returned than was put in. It has no value before the states turn
    back; `expect` refers to the value of the last state.

    `against` a measured curve that also unloads, it is the difference of the two shares, both on the part of the
    model's range that was measured. Its uncertainty is the change of the share when all measured values are off by
    their uncertainty, up on one way and down on the other, combined in quadrature with the deviation between repeats.

    The stated error contains a part for the straight lines between states. If loading and unloading pass through the
    same states with the same values, mesh errors are the same on both ways and scale all work by one factor.

    The report also gives the two works, where the loop begins and ends, and where it turns; for a difference also both
    shares and covered, the share of the loop's range that was measured.
    """

    of: Annotated[str, "metric", "metric on the vertical axis of the curve, such as a force"]
    over: Annotated[str, "metric", "metric on the horizontal axis of the curve, such as the travel"]
    against: Annotated[str | None, "reference", "measured reference `curve` that also unloads"] = None
    of_all_states: ClassVar[bool] = True

    def measure(self, seen: MetricInput) -> Measurement:
        """Return the lost fraction of work, or its difference from that of a measured curve. Raises Undefined."""
        if seen.curve is None:
            raise Undefined("there is no curve over several states")
        along, own = seen.curve.units
        loop = curve_geometry.split_loop(seen.curve.x, seen.curve.y, along)
        (loading, unloading), (low, high) = loop.works, loop.ends
        details = {
            f"loading_{own}{along}": loading, f"unloading_{own}{along}": unloading,
            f"from_{along}": low, f"to_{along}": high, f"turns_at_{along}": float(seen.curve.x[loop.turn]),
        }  # fmt: skip
        if self.against is None:
            return Measurement(loop.lost, details, curve=seen.curve)
        if seen.known is None or seen.known.curve is None:
            raise Undefined(f"`{self.against}` is not a curve, or there is no curve to compare it with")
        return self._compare_with_measured_loop(loop, seen.known.curve, details, seen.curve)

    def _compare_with_measured_loop(
        self, loop: HysteresisLoop, reference: Curve, details: dict[str, float], course: MetricCurve
    ) -> Measurement:
        """Return the difference of the lost fraction from that of a measured loop, on the measured range.

        Raises Undefined.
        """
        (low, high), along = loop.ends, course.units[0]
        begin, end = max(low, float(reference.x[0])), min(high, float(reference.x[-1]))
        measured = reference.lost(begin, end) if reference.lost is not None and begin < end else None
        if measured is None:
            raise Undefined(
                f"`{self.against}` was not measured both loading and unloading from {low:.4g} to "
                f"{high:.4g} {along}, so it has no loop there"
            )
        own = loop.within(begin, end).lost
        share, uncertainty = measured
        details |= {"lost_share": own, "measured_share": share, "covered_share": (end - begin) / (high - low)}
        return Measurement(abs(own - share), details, uncertainty=uncertainty, curve=course)

    def stated(self, course: MetricCurve, off: Floats, along: Floats, reference: Curve | None) -> dict[str, float]:
        """Return bounds of the error of the lost fraction, by cause.

        The causes are straight lines between states, errors `off` (n,) of the values y, and errors `along` (n,) of
        their positions x. Raises Undefined.
        """
        loop = curve_geometry.split_loop(course.x, course.y)
        shared = _is_unloading_on_loading_points(course, loop.turn, off, along)
        return {
            "states": _estimate_chord_error(course, loop),
            self.of: _bound_fraction_change(course, loop, off, shared),
            self.over: _bound_fraction_change(course, loop, along * _steepest_slopes(course), shared),
        }


def _estimate_chord_error(course: MetricCurve, loop: HysteresisLoop) -> float:
    """Return an estimate of the error due to straight lines between states.

    It is a third of the change of the lost fraction when every second state is left out, because the error falls with
    the square of the distance between states.
    """
    last = len(course.x) - 1
    some = np.unique(
        [0, *range(loop.turn, 0, -2), *range(loop.turn, last, 2), last]
    )  # same positions for loading and unloading
    if len(some) == last + 1:
        raise Undefined("there are too few states to estimate the error of the loop between them")
    return abs(curve_geometry.split_loop(course.x[some], course.y[some]).lost - loop.lost) / 3.0


def _steepest_slopes(course: MetricCurve) -> Floats:
    """Return the steepest slope next to each point of the curve (n,), on the loading and the unloading branch."""
    rises = np.abs(np.diff(course.y) / np.diff(course.x))
    before, after = np.append(rises[:1], rises), np.append(rises, rises[-1:])
    return np.asarray(np.maximum(before, after))


def _bound_fraction_change(course: MetricCurve, loop: HysteresisLoop, off: Floats, shared: bool) -> float:
    """Return a bound of the change of the lost fraction of work if values have errors up to `off` (n,).

    If the works of loading W and of unloading U have errors up to w and u, the bound is (u + |U / W| w) / (|W| - w). If
    both branches pass through the same states (`shared`), an error belongs to a state and not to a branch. Then both
    works have the same error, and the bound is the lost fraction times w / (|W| - w).
    """
    w, u = curve_geometry.split_loop(course.x, off).works
    loading, unloading = loop.works
    if w >= abs(loading):
        raise Undefined("the stated errors of the values are as large as the values")
    return (abs(loop.lost) * w if shared else u + abs(unloading / loading) * w) / (abs(loading) - w)


def _is_unloading_on_loading_points(course: MetricCurve, turn: int, off: Floats, along: Floats) -> bool:
    """Return whether every unloading point coincides with a loading point, within their errors."""
    back = np.arange(turn + 1, len(course.x))
    same = 2 * turn - back
    if same[-1] < 0:
        return False
    pairs = ((course.x, along), (course.y, off))
    return all(bool((np.abs(v[same] - v[back]) <= u[same] + u[back] + SAME * np.abs(v).max()).all()) for v, u in pairs)
