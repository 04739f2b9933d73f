"""How much of the work of loading a body does not give back."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar

from softmark.interpreter.metrics import curve_geometry
from softmark.interpreter.metrics.curve_geometry import Course
from softmark.interpreter.metrics.curve_metrics import OfCurves
from softmark.interpreter.metrics.measurement import Measurement
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np

    from softmark.interpreter.metrics.curve_geometry import Curve, Loop
    from softmark.interpreter.metrics.measurement import Floats, Seen
else:
    from softmark.solvers.runtime.lazy_modules import np

SAME = 1e-9  # of the largest: values that are nearer are one


@dataclass(frozen=True)
class Hysteresis(OfCurves):
    """The area of the loop between loading and unloading, relative to the work of loading: what is not given back.

    The states of the analysis go up and down again: `static(states = [25, 50, 75, 100, 75, 50, 25] %)`. The curve is
    what the metric `of` comes to where the metric `over` says that it lies, as force over travel; it turns where it
    is farthest from its beginning. The value is 1 - (int y dx of unloading) / (int y dx of loading), on the range that
    both ways have, exact for straight lines between states. It is 0 of whatever is elastic and finds back the way
    that it came, 1 where nothing is given back, and negative where more comes back than was put in. Before the
    states turn it has no value; `expect` asks for that of the last state.

    `against` a measured curve that unloads as well: how far the two are apart, as a difference of shares, both on
    the range of the model's loop that the measured one has too. Its uncertainty is what values that are off by
    theirs, up on one way and down on the other, make of it, with the deviation between repeats in quadrature.

    What is stated of it has a part for what straight lines between states leave out. Errors of mesh or segments are
    the same on both ways where these go through the same states and agree there: all work is off by one factor then.

    Beside its value a report has the two works, where the loop begins and ends, and where it turns; of a difference
    both shares and covered, the share of the loop's range that was measured.
    """

    of: Annotated[str, "metric", "the metric whose curve is looked at, such as a force"]
    over: Annotated[str, "metric", "the metric along which the curve goes, such as the travel"]
    against: Annotated[str | None, "reference", "a measured curve, a reference `curve`, that turns back as well"] = None
    of_all_states: ClassVar[bool] = True

    def measure(self, seen: Seen) -> Measurement:
        """The share that is lost, or how far it is from that of a measured curve. Raises Undefined."""
        if seen.curve is None:
            raise Undefined("it has no curve")
        along, own = seen.curve.units
        loop = curve_geometry.loop(seen.curve.x, seen.curve.y, along)
        (loading, unloading), (low, high) = loop.works, loop.ends
        details = {
            f"loading_{own}{along}": loading, f"unloading_{own}{along}": unloading,
            f"from_{along}": low, f"to_{along}": high, f"turns_at_{along}": float(seen.curve.x[loop.turn]),
        }  # fmt: skip
        if self.against is None:
            return Measurement(loop.lost, details, curve=seen.curve)
        if seen.known is None or seen.known.curve is None:
            raise Undefined(f"`{self.against}` is no curve, or there is none to compare it with")
        return self._apart(loop, seen.known.curve, details, seen.curve)

    def _apart(self, loop: Loop, reference: Curve, details: dict[str, float], course: Course) -> Measurement:
        (low, high), along = loop.ends, course.units[0]
        begin, end = max(low, float(reference.x[0])), min(high, float(reference.x[-1]))
        measured = reference.lost(begin, end) if reference.lost is not None and begin < end else None
        if measured is None:
            raise Undefined(
                f"`{self.against}` was not measured on both ways from {low:.4g} to {high:.4g} {along}, so it has"
                " no loop there"
            )
        own = loop.within(begin, end).lost
        share, uncertainty = measured
        details |= {"lost_share": own, "measured_share": share, "covered_share": (end - begin) / (high - low)}
        return Measurement(abs(own - share), details, uncertainty=uncertainty, curve=course)

    def stated(self, course: Course, off: Floats, along: Floats, reference: Curve | None) -> dict[str, float]:
        """What chords between states leave out, and what values and their places are off by. Raises Undefined."""
        loop = curve_geometry.loop(course.x, course.y)
        shared = _paired(course, loop.turn, off, along)
        return {
            "states": _chords(course, loop),
            self.of: _moved(course, loop, off, shared),
            self.over: _moved(course, loop, along * _steep(course), shared),
        }


def _chords(course: Course, loop: Loop) -> float:
    """A third of what it changes by without every second state, for that falls with the square of their distance."""
    last = len(course.x) - 1
    some = np.unique([0, *range(loop.turn, 0, -2), *range(loop.turn, last, 2), last])  # alike on both ways
    if len(some) == last + 1:
        raise Undefined("what a curve does between two states on each way is not known")
    return abs(curve_geometry.loop(course.x[some], course.y[some]).lost - loop.lost) / 3.0


def _steep(course: Course) -> Floats:
    """The steepest that the curve is beside each of its points (n,), on either way."""
    rises = np.abs(np.diff(course.y) / np.diff(course.x))
    before, after = np.append(rises[:1], rises), np.append(rises, rises[-1:])
    return np.asarray(np.maximum(before, after))


def _moved(course: Course, loop: Loop, off: Floats, shared: bool) -> float:
    """How much it may change where values are off by `off` (n,).

    Of works W of loading and U of unloading by up to w and u: (u + |U / W| w) / (|W| - w). Where both ways go through
    the same states an error is that of a state, whichever way it was reached: both works are off by the same amount,
    and the share by itself times w / (|W| - w).
    """
    w, u = curve_geometry.loop(course.x, off).works
    loading, unloading = loop.works
    if w >= abs(loading):
        raise Undefined("what is stated of the values is as large as they are")
    return (abs(loop.lost) * w if shared else u + abs(unloading / loading) * w) / (abs(loading) - w)


def _paired(course: Course, turn: int, off: Floats, along: Floats) -> bool:
    """Whether every point of the way back is one of the way there, as far as can be told."""
    back = np.arange(turn + 1, len(course.x))
    same = 2 * turn - back
    if same[-1] < 0:
        return False
    pairs = ((course.x, along), (course.y, off))
    return all(bool((np.abs(v[same] - v[back]) <= u[same] + u[back] + SAME * np.abs(v).max()).all()) for v, u in pairs)
