"""Result at a probe of a model, and its distance from the results of other solutions, in the unit of a metric."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from softmark.interpreter.metrics.measurement import MetricInput as Looked
from softmark.interpreter.metrics.measurement import ReferenceData
from softmark.interpreter.metrics.metric_base import DisplacementMetric, ForceMetric, Metric
from softmark.interpreter.metrics.metric_evaluation import measure_metric
from softmark.interpreter.metrics.probe_samples import ProbePlace, ProbeSamples
from softmark.interpreter.metrics.tensor_metrics import TensorMetric
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.interpreter.models.shared.prepared_model import Solution
from softmark.interpreter.problem.solution import View
from softmark.interpreter.results.motion_history import History
from softmark.interpreter.results.reaction_results import EquilibriumForces
from softmark.interpreter.results.run_report import ProbeResult
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.models.shared.deformed_mesh import NodalDisplacementField

Floats = NDArray[np.float64]
Field = Callable[[Floats], Floats]

TRIFLE = 1e-6  # relative to forces in the body: smaller values are solver and rounding errors
NO_ERROR = "no error estimate is available for this metric"


class NoErrorEstimate(Exception):
    """Exception: a part of the error cannot be estimated; the text gives the reason."""


@dataclass(frozen=True)
class CachedField:
    """Displacement field that stores the values at points already evaluated, since several metrics share a probe."""

    field: Field
    stress: Callable[[], Any]  # stress of this field
    known: dict[bytes, Floats]

    def __call__(self, X: Floats) -> Floats:
        """Return displacements (n, 3), m, of points (n, 3)."""
        key = X.tobytes()
        if key not in self.known:
            self.known[key] = self.field(X)
        return self.known[key]


@dataclass(frozen=True)
class ProbeResultUnderTest:
    """Result at a probe at points X (n, 3), m, whose error is estimated: displacements u (n, 3) or (t, n, 3), m.

    `field` gives the displacement at any point at the end, `history` that over time. `probe`, `view`, `stress`
    and `at_rest` are further input of the metric.
    """

    X: Floats
    u: Floats
    times: Floats | None = None
    metric: Metric | None = None
    field: Field | None = None
    probe: ProbeResult | None = None
    view: View | None = None
    history: History | None = None
    stress: Callable[[], Any] | None = None
    at_rest: EquilibriumForces | None = None
    right: Callable[[], Any] | None = None  # stress of the reference model

    def of(self, solution: Solution) -> ProbeResultUnderTest:
        """Return the result of the same probe for another solution, at the same times. Raises NoErrorEstimate."""
        seen = replace(
            self, u=self._displacements_of_solution(solution), field=solution.displacement, history=solution.history
        )
        return replace(seen, stress=solution.stress, at_rest=solution.at_rest)

    def at(self, field: CachedField) -> ProbeResultUnderTest:
        """Return the result of the same probe for a static displacement field."""
        return replace(self, u=np.asarray(field(self.X)), field=field, history=None, stress=field.stress)

    def moved(self, step: NodalDisplacementField) -> ProbeResultUnderTest:
        """Return the result at the same probe after a displacement field has been added, in statics."""
        own = self.field
        field = None if own is None else lambda X: own(X) + step(X)
        stress = self.stress
        moved = None if stress is None else lambda: stress().moved(step.nodes)
        return replace(self, u=self.u + np.asarray(step(self.X)), field=field, stress=moved)

    @property
    def is_about_displacements(self) -> bool:
        """True if the metric measures displacements, so that their relative error is also that of the metric."""
        plain = self.metric is None or isinstance(self.metric, DisplacementMetric)
        return plain or self.times is not None or (self.unit == "m" and not self.is_about_forces)

    @property
    def is_single_displacement(self) -> bool:
        """True if the metric is the displacement of one point at the end."""
        if self.times is not None or not self.is_about_displacements or not len(self.X):
            return False
        return len(self.X) == 1 or (self.metric is not None and self.metric.last)

    @property
    def is_tensor_at_point(self) -> bool:
        """True if the metric is a stress or strain at one point at the end."""
        plain = isinstance(self.metric, TensorMetric) and self.metric.measured_from is None
        return plain and len(self.X) == 1 and self.times is None

    def around(self, X: Floats, other: Solution) -> float:
        """Return the root mean square difference of stress or strain from another solution at points X (n, 3), m."""
        metric: Any = self.metric
        if self.stress is None or other.stress is None:
            raise NoErrorEstimate(NO_ERROR)
        theirs = other.stress

        def distance(own: Any, _: Any) -> float:
            far: Floats = metric.values(own.at(X)) - metric.values(theirs().at(X))
            return float(np.sqrt(np.mean(far**2)))

        return self._number_from_stresses(distance, self.stress)

    def rms_displacement_change(self, apart: Floats) -> float:
        """Return the root mean square of displacement changes `apart` (n, 3), m, around the metric's single point.

        Components and unit are those of the metric: in m, or relative to the displacement of the point.
        """
        along = self.metric.direction if self.metric is not None and self.metric.last else None
        far = np.linalg.norm(apart, axis=1) if along is None else apart @ along
        rms = float(np.sqrt(np.mean(far**2)))
        size = float(np.linalg.norm(self.u[-1]))
        return rms if self.unit == "m" or size == 0.0 else rms / size

    @property
    def is_about_forces(self) -> bool:
        """True if the metric measures forces, which displacements of points do not determine."""
        return isinstance(self.metric, ForceMetric)

    @property
    def unit(self) -> str:
        """Unit of the error: that of the metric, or 1 for a probe."""
        return "1" if self.metric is None else str(self.metric.unit)

    @property
    def size(self) -> float:
        """Factor that converts an error relative to the displacements into the metric's unit."""
        if self.unit == "m" and not self.is_about_forces:
            return float(np.linalg.norm(self.u, axis=-1).max(initial=0.0))
        if isinstance(self.metric, TensorMetric):
            return self._tensor_error_scale(self.metric)
        if isinstance(self.metric, ForceMetric):
            try:
                return self.metric.at_points(self.X).extent(self.at_rest)
            except Undefined as undefined:
                raise NoErrorEstimate(f"{NO_ERROR}: {undefined}") from undefined
        return abs(self.value) if self.unit == "s" else 1.0

    def _tensor_error_scale(self, metric: TensorMetric) -> float:
        """Return the stress or strain value, at least the typical size of the tensors in the body.

        A component that is zero still has an error.
        """
        if self.stress is None:
            raise NoErrorEstimate(NO_ERROR)
        if metric.measured_from is None:
            return max(abs(self.value), metric.usual(self.stress()))
        return self._number_from_stresses(
            lambda own, right: metric.extent(own, right, self._samples(metric, own)), self.stress
        )

    @property
    def acting(self) -> float:
        """Scale of rounding and solver errors: the larger of `size` and the forces or motions in the whole body.

        A force that vanishes by symmetry is the difference of forces that do not vanish.
        """
        rest = self.at_rest
        if rest is None or not rest.knows(self.metric.subject_name if isinstance(self.metric, ForceMetric) else None):
            return self.size
        if self.unit == "m":
            return max(self.size, rest.moved)
        known = isinstance(self.metric, ForceMetric) and self.metric.measured_from is None
        return max(self.size, self.metric.acting(rest)) if known else self.size  # type: ignore[union-attr]

    def comparison_scale(self, apart: float) -> float:
        """Return the scale to compare a distance `apart` with: `size`, or `acting` if the distance is negligible."""
        return self.size if apart > TRIFLE * self.acting else self.acting

    @property
    def value(self) -> float:
        """Value of the metric. Raises NoErrorEstimate."""
        return self._evaluate_metric_for(self, None)

    def _displacements_of_solution(self, solution: Solution) -> Floats:
        if solution.displacement is None:
            raise NoErrorEstimate(solution.message or "there is no solution")
        if self.is_about_forces:  # and at no points
            return self.u
        if self.times is None or solution.history is None:
            return np.asarray(solution.displacement(self.X))
        theirs = np.asarray(solution.history.displacement(self.X))
        flat = theirs.reshape(len(theirs), -1)
        columns = [np.interp(self.times, solution.history.times, column) for column in flat.T]
        return np.array(columns).T.reshape(len(self.times), *theirs.shape[1:])

    def apart(self, other: ProbeResultUnderTest) -> float:
        """Return the error that this result would have if the other solution were exact, in the metric's unit.

        Raises NoErrorEstimate.
        """
        if not np.all(np.isfinite(other.u)):
            raise NoErrorEstimate("another solution has values that are not finite")
        if self.metric is None or self.times is not None:
            return self._norm(other)
        if isinstance(self.metric, ForceMetric):
            return self._force_distance(self.metric, other)
        if isinstance(self.metric, TensorMetric):
            return self._tensor_distance(self.metric, other)
        if self.unit == "m":
            return self._statistic_change_bound(other)
        if self.metric.measured_from is None:
            return abs(self._evaluate_metric_for(other, None) - self.value)
        if self.metric.statistic_name.endswith("sd"):
            raise NoErrorEstimate(f"{NO_ERROR}: a standard deviation does not measure the distance of two solutions")
        return self._evaluate_metric_for(other, ReferenceData(self.view.name if self.view else "", self.u, self.field))

    def change(self, other: ProbeResultUnderTest) -> float:
        """Return the difference between the metric's values of this and of another solution, in the metric's unit.

        The other solution is of the same problem, for example on a finer mesh. For forces and tensors only the two
        metric values are compared. `apart` compares more, for solutions whose metric values may agree by chance; all
        other metrics use it. Raises NoErrorEstimate.
        """
        plain = self.metric is not None and self.metric.measured_from is None and self.times is None
        if plain and isinstance(self.metric, ForceMetric | TensorMetric):
            theirs, own = self._evaluate_metric_for(other, None), self.value
            if isinstance(self.metric, TensorMetric) and self.metric.over == "largest":
                return abs(abs(theirs) - abs(own))  # of two sides that are stressed alike, either may be the larger
            return abs(theirs - own)
        return self.apart(other)

    def _force_distance(self, metric: ForceMetric, other: ProbeResultUnderTest) -> float:
        try:
            return metric.at_points(self.X).difference_in_metric_unit(other.at_rest, self.at_rest)
        except Undefined as undefined:
            raise NoErrorEstimate(f"{NO_ERROR}: {undefined}") from undefined

    def _tensor_distance(self, metric: TensorMetric, other: ProbeResultUnderTest) -> float:
        if self.stress is None or other.stress is None:
            raise NoErrorEstimate(NO_ERROR)
        own, theirs = self.stress, other.stress
        return self._number_from_stresses(
            lambda one, right: metric.field_difference(one, theirs(), self._samples(metric, one), right), own
        )

    @property
    def place(self) -> ProbePlace:
        """Probe of the metric: its points, triangles, weights and domain."""
        name, view = "" if self.metric is None else self.metric.probe_name or "", self.view
        weights, domain = (None, None) if view is None else (view.weights.get(name), view.domains.get(name))
        return ProbePlace(self.X, None if self.probe is None else self.probe.triangles, weights, domain)

    def _samples(self, metric: TensorMetric, field: Any) -> ProbeSamples:
        return metric.samples(self.place, field)

    def _number_from_stresses(self, number: Callable[[Any, Any], float], own: Callable[[], Any]) -> float:
        """Return number(own stresses, stresses of the reference), where without a reference both are the own stresses.

        Raises NoErrorEstimate if a stress is unavailable or the number is undefined.
        """
        from softmark.solvers.stress_recovery.sampling_point_stress import StressUnavailable

        try:
            return number(own(), (self.right or own)())
        except (StressUnavailable, Undefined) as refused:
            raise NoErrorEstimate(f"{NO_ERROR}: {refused}") from refused

    def _norm(self, other: ProbeResultUnderTest) -> float:
        size = float(np.linalg.norm(self.u))
        if size == 0.0:
            raise NoErrorEstimate("the probe does not move, so there is no relative error")
        return float(np.linalg.norm(other.u - self.u)) / size

    def _statistic_change_bound(self, other: ProbeResultUnderTest) -> float:
        """Return a bound of the difference, m, between the metric of this solution and that of the solution `other`.

        The metric is a statistic of distances to a reference. By the triangle inequality the difference is at most the
        same
        statistic of the distances between the two solutions.
        """
        apart = other.u - self.u
        if self.metric is not None and self.metric.last:
            along = self.metric.direction
            return abs(float(apart[-1] @ along)) if along is not None else float(np.linalg.norm(apart[-1]))
        distances = np.linalg.norm(apart, axis=1)
        match self.metric.statistic_name if self.metric is not None else "max":
            case "mean":
                return float(distances.mean())
            case "max":
                return float(distances.max())
        return float(np.sqrt(np.mean(distances**2)))

    def _evaluate_metric_for(self, other: ProbeResultUnderTest, known: ReferenceData | None) -> float:
        """Return the value of the metric for another solution, against reference data if `known`.

        Raises NoErrorEstimate.
        """
        view, probe, metric = self.view, self.probe, self.metric
        if view is None or probe is None or metric is None:
            raise NoErrorEstimate(NO_ERROR)
        weights = view.weights.get(metric.probe_name or "")
        looked = Looked(
            view.name, view.case, self.X, other.u, probe.triangles, weights, known, other.field,
            history=other.history, stress=other.stress, at_rest=other.at_rest,
            domain=view.domains.get(metric.probe_name or ""),
        )  # fmt: skip
        try:
            return measure_metric(metric, looked).value
        except Undefined as undefined:
            raise NoErrorEstimate(f"{NO_ERROR}: {undefined}") from undefined
