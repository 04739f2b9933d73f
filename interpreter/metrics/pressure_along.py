"""Contact pressure along a line, as a curve."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.interpreter.metrics.contact import ContactMetric
from softmark.interpreter.metrics.curve_geometry import MetricCurve
from softmark.interpreter.metrics.measurement import Measurement
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np

    from softmark.interpreter.metrics.measurement import MetricInput
    from softmark.interpreter.metrics.metric_base import Floats
    from softmark.interpreter.results.reaction_results import EquilibriumForces
else:
    from softmark.solvers.runtime.lazy_modules import np


@dataclass(frozen=True)
class PressureAlong(ContactMetric):
    """Contact pressure on the surface of a body at the points of a probe: a curve along a line, and its maximum.

    Its value is the largest pressure at these points; the report draws the curve along a line. The pressure is that of
    `contact_pressure`, force per deformed area (with small strain, per undeformed area); points are given by their
    undeformed positions. Against another model or a theory, the value is the root mean square of the difference over
    the points, divided by that of the other solution's pressure. Where the pressure is singular, as at the edge of a
    sharp punch and under the tip of a cone, a warning appears (W388), no error is stated, and no theory has a value:
    let the probe end before such a point.

    The report also gives largest_Pa and mean_Pa over the points, the position of the largest pressure or difference
    (at_m), and the number of points.
    """

    of: Annotated[str, "contact", "the contact"]
    probe: Annotated[str, "probe", "probe on the surface, such as a `line(...)`"]
    against: Annotated[str | None, "reference or model", "solution taken as correct"] = None
    natural: ClassVar[str] = "Pa"
    followed: ClassVar[bool] = False  # only the curve at the end is stored, no history

    def measure(self, seen: MetricInput) -> Measurement:
        """Return the largest pressure, or the relative difference, with the curve of pressures. Raises Undefined."""
        own = self.pressures_at_points(self._require_results(seen.at_rest), seen.X)
        if self.measured_from is None:
            return self._build_measurement(own, own, float(own.max(initial=0.0)), seen)
        right = self._reference_pressure(None if seen.known is None else seen.known.at_rest, seen.X)
        if (size := self.size(right)) == 0.0:
            raise Undefined(f"the pressure of `{self.measured_from}` is zero there, so there is no relative error")
        return self._build_measurement(own, own - right, self.size(own - right) / size, seen, right)

    def _build_measurement(
        self, own: Floats, judged: Floats, value: float, seen: MetricInput, right: Floats | None = None
    ) -> Measurement:
        """Return the measurement; its reported position is that of the largest |judged| (n,).

        `own` (n,) are the pressures, Pa, and `right` (n,) those of the reference.
        """
        details = {
            "largest_Pa": float(own.max()),
            "mean_Pa": float(own.mean()),
            "at_m": seen.X[int(np.abs(judged).argmax())].tolist(),
            "points": len(own),
        }
        curve = None
        if seen.triangles is None and len(own) > 1:
            steps = np.linalg.norm(np.diff(seen.X, axis=0), axis=1)
            curve = MetricCurve(np.concatenate([[0.0], np.cumsum(steps)]), own, ("m", "Pa"), right)
        return Measurement(value, details, samples=own if len(own) > 1 and right is None else None, curve=curve)

    def pressures_at_points(self, rest: EquilibriumForces, X: Floats) -> Floats:
        """Return the contact pressure (n,), Pa, at undeformed surface points X (n, 3), m.

        Raises Undefined for points off the surface.
        """
        touch = self.contact_numbers(rest)
        if touch.field is None:
            raise Undefined(f"only the largest pressure of `{self.of}` is known, not the pressure along a probe")
        found = touch.field.pressures(X)
        if (off := np.isnan(found)).any():
            where = ", ".join(f"{1e3 * c:.4g}" for c in X[int(off.argmax())])
            raise Undefined(f"{np.count_nonzero(off)} of {len(X)} points of the undeformed probe are not on "
                            f"the surface of the contact `{self.of}`: one is ({where}) mm")  # fmt: skip
        return found

    def _reference_pressure(self, rest: EquilibriumForces | None, X: Floats) -> Floats:
        """Return the pressure (n,), Pa, of the reference at points X (n, 3), m.

        Raises Undefined if the reference has no pressure, or a singular one.
        """
        right = self.pressures_at_points(self._require_results(rest), X)
        if not np.all(np.isfinite(right)):
            raise Undefined(
                f"the pressure of `{self.measured_from}` is infinite at a point of `{self.probe}`: end the "
                "probe before it"
            )
        return right

    def at_points(self, X: Floats) -> ContactMetric:
        """Return the same metric at points X (n, 3), m, for its error estimate."""
        return _PressureAtPoints(self.of, self.probe, self.against, X)

    def acting(self, rest: EquilibriumForces) -> float:
        """Return the largest pressure of all contacts, Pa."""
        return max(touch.pressure for touch in rest.touches.values())

    def size(self, value: Floats) -> float:
        """Return the largest magnitude of the pressures; for a comparison, their root mean square."""
        if self.measured_from is not None:
            return float(np.sqrt(np.mean(value**2)))
        return float(np.abs(value).max(initial=0.0))


@dataclass(frozen=True)
class _PressureAtPoints(PressureAlong):
    """Metric of the contact pressure at given points X (n, 3), m."""

    X: Any = None

    def amount(self, rest: EquilibriumForces) -> Floats:
        """Return the pressures at the points (n,), Pa."""
        return self.pressures_at_points(rest, self.X)
