"""The pressure of a contact along a line, as a curve."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.interpreter.metrics.contact import OfContact
from softmark.interpreter.metrics.curve_geometry import Course
from softmark.interpreter.metrics.measurement import Measurement
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np

    from softmark.interpreter.metrics.measurement import Seen
    from softmark.interpreter.metrics.metric_base import Floats
    from softmark.interpreter.results.reaction_results import AtRest
else:
    from softmark.solvers.runtime.lazy_modules import np


@dataclass(frozen=True)
class PressureAlong(OfContact):
    """Pressure of a contact on the surface of a body at the points of a probe: a curve along a line, and its top.

    Its value is the largest at these points; a report draws it along a line. It is that of `contact_pressure`, force
    per area as it is deformed (of small strain, undeformed), at points of the surface by their places before
    deformation. Against another model or a theory it is the root of the mean square of the difference over the points,
    over that of the other's pressure there. Where pressure has no limit, as at the edge of a sharp punch and under the
    tip of a cone, a warning says so (W388), no error is stated, and no theory has a number: let the probe end beside
    it.

    Beside its value a report has largest_Pa and mean_Pa over the points, where the pressure, or the difference, is
    largest (at_m), and the number of points.
    """

    of: Annotated[str, "contact", "the contact"]
    probe: Annotated[str, "probe", "where on the surface it is looked at, such as a `line(...)`"]
    against: Annotated[str | None, "reference or model", "what is taken as right"] = None
    natural: ClassVar[str] = "Pa"
    followed: ClassVar[bool] = False  # a curve along a line at the end

    def measure(self, seen: Seen) -> Measurement:
        """The largest, or the largest difference, and the curve. Raises Undefined."""
        own = self.amount_at(self._sound(seen.at_rest), seen.X)
        if self.measured_from is None:
            return self._told(own, own, float(own.max(initial=0.0)), seen)
        right = self._right_at(None if seen.known is None else seen.known.at_rest, seen.X)
        if (size := self.size(right)) == 0.0:
            raise Undefined(f"that of `{self.measured_from}` is zero there, so nothing is relative to it")
        return self._told(own, own - right, self.size(own - right) / size, seen, right)

    def _told(self, own: Floats, judged: Floats, value: float, seen: Seen, right: Floats | None = None) -> Measurement:
        """A value that is at the largest of what is `judged` (n,)."""
        details = {
            "largest_Pa": float(own.max()),
            "mean_Pa": float(own.mean()),
            "at_m": seen.X[int(np.abs(judged).argmax())].tolist(),
            "points": len(own),
        }
        curve = None
        if seen.triangles is None and len(own) > 1:
            steps = np.linalg.norm(np.diff(seen.X, axis=0), axis=1)
            curve = Course(np.concatenate([[0.0], np.cumsum(steps)]), own, ("m", "Pa"), right)
        return Measurement(value, details, samples=own if len(own) > 1 and right is None else None, curve=curve)

    def amount_at(self, rest: AtRest, X: Floats) -> Floats:
        """At points X (n, 3), m, of the undeformed surface: (n,), Pa. Raises Undefined where one is not on it."""
        touch = self.touch(rest)
        if touch.field is None:
            raise Undefined(f"the pressure of `{self.of}` is known here where it is largest alone")
        found = touch.field.pressures(X)
        if (off := np.isnan(found)).any():
            where = ", ".join(f"{1e3 * c:.4g}" for c in X[int(off.argmax())])
            raise Undefined(f"{np.count_nonzero(off)} of {len(X)} points are not on the part of the surface that "
                            f"`{self.of}` is about, before deformation: one is ({where}) mm")  # fmt: skip
        return found

    def _right_at(self, rest: AtRest | None, X: Floats) -> Floats:
        """What is taken as right. Raises Undefined where it has none, or no limit."""
        right = self.amount_at(self._sound(rest), X)
        if not np.all(np.isfinite(right)):
            raise Undefined(f"that of `{self.measured_from}` has no limit at a point of `{self.probe}`: end it beside")
        return right

    def at_points(self, X: Floats) -> OfContact:
        """The same of these points, as errors are stated of it."""
        return _At(self.of, self.probe, self.against, X)

    def acting(self, rest: AtRest) -> float:
        """The largest pressure of all contacts, Pa."""
        return max(touch.pressure for touch in rest.touches.values())

    def size(self, value: Floats) -> float:
        """The largest; of what is held against another, the root of the mean square."""
        if self.measured_from is not None:
            return float(np.sqrt(np.mean(value**2)))
        return float(np.abs(value).max(initial=0.0))


@dataclass(frozen=True)
class _At(PressureAlong):
    """A metric at points X (n, 3), m."""

    X: Any = None

    def amount(self, rest: AtRest) -> Floats:
        """(n,), Pa."""
        return self.amount_at(rest, self.X)
