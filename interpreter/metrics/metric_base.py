"""Base classes of metrics."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from softmark.interpreter.metrics.undefined_metric import Undefined

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from softmark.interpreter.language.compiled_scene import Scene
    from softmark.interpreter.metrics.curve_geometry import MetricCurve
    from softmark.interpreter.metrics.measurement import Measurement, MetricInput
    from softmark.interpreter.results.reaction_results import EquilibriumForces

    Floats = NDArray[np.float64]

When = Literal["end", "largest", "mean"]
WHEN = "in a dynamic analysis: value at the end, largest value over time, or mean over time"


class Metric:
    """Base class of metrics: numbers computed from the results of a model or reference.

    The field `probe`, if a metric has one, names the probe at whose points it is evaluated. The field `against`, if it
    has one, names the reference or model with which it compares.
    """

    last: ClassVar[bool] = False  # true if it evaluates only the last point of its probe
    followed: ClassVar[bool] = False  # true if it has a history in a dynamic analysis
    of_all_states: ClassVar[bool] = False  # true if it needs the whole sequence of states; `expect` uses the last

    @property
    def unit(self) -> str:
        """Unit of the value of the metric."""
        raise NotImplementedError(f"{type(self).__name__} has no unit")

    @property
    def uncertain(self) -> bool:
        """True if an uncertainty of the reference, in m, bounds the value of the metric."""
        return False

    @property
    def probe_name(self) -> str | None:
        """Name of the metric's probe; None for a metric of forces, energies or computing time."""
        return vars(self).get("probe")

    @property
    def subject_name(self) -> str | None:
        """Name of the support, load, contact or body that the metric evaluates, if it has no probe.

        None if it concerns all bodies.
        """
        return vars(self).get("body")

    def body_in(self, scene: Scene) -> str | None:
        """Return the name of the body that the metric evaluates; None for all bodies."""
        if (name := self.probe_name or self.subject_name) is None:
            return None
        declared = scene.declared[name]
        return name if declared.kind == "body" else vars(declared.thing).get("body")

    def probe_in(self, scene: Scene) -> str | None:
        """Return the name of the probe of the metric, or of the metric that it evaluates; None without a probe."""
        return self.probe_name

    @property
    def measured_from(self) -> str | None:
        """Name of the reference or model with which the metric compares; None for a plain value."""
        return vars(self).get("against")

    @property
    def in_time(self) -> bool:
        """True if the metric has a value at each time of a dynamic analysis.

        This requires a time history; it excludes errors and values that summarise all times.
        """
        return False

    @property
    def statistic_name(self) -> str:
        """Name of the statistic that reduces the values at the points to one number."""
        return "max"

    @property
    def direction(self) -> tuple[float, float, float] | None:
        """Direction of the component that the metric measures; None if it has no direction."""
        return None

    def measure(self, seen: MetricInput) -> Measurement:
        """Return the value and details of the metric. Raises Undefined, with a reason, if there is no value."""
        raise NotImplementedError(f"{type(self).__name__} does not implement `measure`")


class ForceMetric(Metric):
    """Base class of metrics of forces and energies at equilibrium.

    Against another model or a theory, the value of such a metric is a relative difference.
    """

    natural: ClassVar[str]  # unit of its value
    followed: ClassVar[bool] = True
    extreme: ClassVar[str] = "largest"  # `largest` or `least`: extreme over time that a report gives
    of_surface: ClassVar[bool] = False  # needs contact surface data, which not every step stores

    @property
    def in_time(self) -> bool:
        """True if the metric has a value at each time of a dynamic analysis."""
        return self.followed and self.measured_from is None and self.when == "end"

    @property
    def when(self) -> str:
        """Kind of value that the metric reports over time: `end`, `largest` or `mean`."""
        return str(vars(self).get("over", "end"))

    @property
    def unit(self) -> str:
        """Unit of the value; 1 for a relative error."""
        return self.natural if self.measured_from is None else "1"

    def amount(self, rest: EquilibriumForces) -> Floats:
        """Return the quantity of the metric in its natural unit: a number () or a vector (3,).

        The value of the metric is the component of the vector along `direction`. Raises Undefined.
        """
        raise NotImplementedError(f"{type(self).__name__} has no value")

    def measure(self, seen: MetricInput) -> Measurement:
        """Return the value of the metric, or its relative difference from that of another model. Raises Undefined."""
        from softmark.interpreter.metrics.measurement import Measurement

        own = self._available_amount(seen.at_rest)
        if self.measured_from is None:
            course = self.course(seen.at_rest)
            details = self.details(own) | ({} if course is None else self._extreme_over_time(course))
            off = (
                None
                if seen.at_rest is None or seen.at_rest.relative_error is None
                else seen.at_rest.relative_error * abs(self._along(own))
            )
            return Measurement(self._along(own), details, uncertainty=off, curve=course)
        rest = None if seen.known is None else seen.known.at_rest
        right = self._reference_amount(rest)
        if (size := self.size(right)) == 0.0:
            raise Undefined(f"the value of `{self.measured_from}` is zero, so there is no relative error")
        off = None if rest is None else rest.relative_error
        return Measurement(abs(self._along(own) - self._along(right)) / size, uncertainty=off)

    def _reference_amount(self, rest: EquilibriumForces | None) -> Floats:
        """Return the quantity in the reference solution. Raises Undefined if that solution does not have it."""
        nothing = Undefined(f"`{self.measured_from}` has no such value")
        try:
            right = self._available_amount(rest)
        except Undefined:
            if rest is None or rest.reason is not None:
                raise
            raise nothing from None
        if math.isnan(self.size(right)):
            raise nothing
        return right

    def size(self, value: Floats) -> float:
        """Return the magnitude of the quantity, by which errors are divided; for a vector its norm."""
        return math.sqrt(float((value**2).sum()))

    def difference_in_metric_unit(self, rest: EquilibriumForces | None, right: EquilibriumForces | None) -> float:
        """Return the difference of a solution `rest` from `right`, which is taken as correct, in the metric's unit.

        For vectors the difference includes all components, since one component may agree by chance. It is relative if
        the metric is an error. Raises Undefined.
        """
        far = self.distance(*(self._require_results(known) for known in (rest, right)))
        if self.measured_from is None:
            return far
        if (size := self.size(self._available_amount(right))) == 0.0:
            raise Undefined(f"the value of `{self.measured_from}` is zero, so there is no relative error")
        return far / size

    def distance(self, rest: EquilibriumForces, right: EquilibriumForces) -> float:
        """Return the difference of the quantity between two solutions, in its natural unit. Raises Undefined."""
        return self.size(self._reported_amount(rest) - self._reported_amount(right))

    def extent(self, rest: EquilibriumForces | None) -> float:
        """Return the factor that converts a relative error to the metric's unit. Raises Undefined.

        It is the magnitude of the quantity, or 1 if the metric is itself a relative error.
        """
        return self.size(self._available_amount(rest)) if self.measured_from is None else 1.0

    def at_points(self, X: Floats) -> ForceMetric:
        """Return the metric evaluated at points X (n, 3), m; metrics without a probe are returned unchanged."""
        return self

    def acting(self, rest: EquilibriumForces) -> float:
        """Return the largest quantity of this kind in the whole body, in the natural unit.

        Rounding errors are proportional to it.
        """
        return 0.0

    def details(self, value: Floats) -> dict[str, Any]:
        """Return further report entries, computed from the quantity `value`."""
        return {}

    def _along(self, value: Floats) -> float:
        """Return the component of the quantity along the metric's direction."""
        if self.direction is None:
            return float(value)
        return sum(
            float(v) * d for v, d in zip(value, self.direction, strict=True) if d
        )  # a theory may leave components undefined (nan)

    def course(self, rest: EquilibriumForces | None) -> MetricCurve | None:
        """Return the values of the metric over time in a dynamic analysis; None in statics. Raises Undefined."""
        if (known := self._require_results(rest)).followed is None:
            return None
        from softmark.interpreter.metrics.contact_histories import build_history

        return build_history(self, known.followed)

    def _extreme_over_time(self, course: MetricCurve) -> dict[str, Any]:
        """Return report entries of the largest or least value over time, and the time at which it occurs."""
        at = int((course.y if self.extreme == "least" else -abs(course.y)).argmin())
        unit = course.units[1]
        return {f"{self.extreme}_in_time_{unit}": float(course.y[at]), f"{self.extreme}_at_s": float(course.x[at])}

    def _available_amount(self, rest: EquilibriumForces | None) -> Floats:
        """Return the quantity at the reported time. Raises Undefined if the solution has no such results."""
        return self._reported_amount(self._require_results(rest))

    def _reported_amount(self, rest: EquilibriumForces) -> Floats:
        """Return the quantity at the reported time: at the end, or the largest or mean over time. Raises Undefined."""
        if rest.followed is None or self.when == "end":
            return self.amount(rest)
        from softmark.interpreter.metrics.contact_histories import reduce_history

        return reduce_history(self, rest.followed)

    def _require_results(self, rest: EquilibriumForces | None) -> EquilibriumForces:
        """Return the equilibrium results `rest`. Raises Undefined if they do not contain those of this metric."""
        if rest is None:
            raise Undefined("a reference has no forces")
        if not rest.knows(self.subject_name):
            raise Undefined(rest.reason or "")
        return rest


class DerivedMetric(Metric):
    """Base class of metrics that evaluate another metric, `of`, relative to a reference."""

    if TYPE_CHECKING:
        of: str

    @property
    def unit(self) -> str:
        """Unit of the value, which is relative."""
        return "1"

    @property
    def subject_name(self) -> str:
        """Name of the evaluated metric, `of`."""
        return self.of

    def body_in(self, scene: Scene) -> str | None:
        """Return the name of the body of the evaluated metric, `of`."""
        body: str | None = scene.declared[self.of].thing.body_in(scene)
        return body


class DisplacementMetric(Metric):
    """Base class of metrics that need only the displacements at points."""

    def value(self, X: Floats, u: Floats, reference: Any) -> float:
        """Return the value from material points X (n, 3), m, displacements u (n, 3), m, and those of the reference.

        `reference` is (n, 3), m, or None.
        """
        raise NotImplementedError(f"{type(self).__name__} has no value")

    def measure(self, seen: MetricInput) -> Measurement:
        """Return the value of the metric. Raises Undefined if the reference has no displacements."""
        from softmark.interpreter.metrics.measurement import Measurement

        if self.measured_from and (seen.known is None or seen.known.u is None):
            raise Undefined(f"the reference `{self.measured_from}` has no displacements at this probe")
        return Measurement(float(self.value(seen.X, seen.u, seen.known.u if seen.known else None)))
