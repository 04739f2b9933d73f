"""Base class of metrics of stress, strain and stretch, which reduce the tensor at each point to a number."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, ClassVar

from softmark.interpreter.metrics.measurement import Measurement
from softmark.interpreter.metrics.metric_base import Metric
from softmark.interpreter.metrics.probe_samples import Over, ProbePlace, ProbeSamples, pair_sides
from softmark.interpreter.metrics.undefined_metric import Undefined

if TYPE_CHECKING:
    import numpy as np

    from softmark.interpreter.metrics.measurement import Floats, MetricInput
    from softmark.solvers.stress_recovery.stress_field import Part, Stresses
    from softmark.solvers.stress_recovery.stress_measures import Tensors, TensorsBySide

    StressSource = Callable[[], Stresses] | None  # stress field of a model or reference; raises NoStress
else:
    from softmark.solvers.runtime.lazy_modules import np

WORST = 1.5**0.5  # largest von Mises stress relative to the tensor's norm


class TensorMetric(Metric):
    """Base class of metrics of a model's stress or strain at the points of a probe.

    Against another model, the value is the difference between both models, point by point, relative to the tensors of
    the other model.
    """

    probe: str
    over: Over
    natural: ClassVar[str]  # unit of its value

    @property
    def unit(self) -> str:
        """Unit of the value; 1 for a relative error."""
        return self.natural if self.measured_from is None else "1"

    @property
    def decisive_tensor_part(self) -> Part:
        """Part of the tensor that decides whether a stress is resolved: adjacent cells must agree in it."""
        return "strain"

    def values(self, tensors: Tensors) -> Floats:
        """Return the requested number of each tensor (n,), in the metric's unit."""
        raise NotImplementedError(f"{type(self).__name__} has no values")

    def tensors(self, tensors: Tensors) -> Floats:
        """Return the stress or strain tensors (n, 3, 3) of which the metric takes a number, in the metric's unit."""
        raise NotImplementedError(f"{type(self).__name__} has no tensors")

    def field_difference(self, one: Stresses, other: Stresses, samples: ProbeSamples, right: Stresses) -> float:
        """Return the difference of two fields at sample points in the metric's unit, by the norm of the whole tensor.

        The norm is used because one component may agree by chance. The norm of the difference bounds that of every
        component and principal value (Weyl 1912), and that of von Mises stress with sqrt(3/2). By the triangle
        inequality the errors of the two fields relative to `right` differ by at most this. On an interface each side is
        compared with the same side. Raises Undefined.
        """
        sides, theirs = pair_sides(one, other, samples)
        difference, shares = self.tensors(sides.tensors) - self.tensors(theirs), sides.divide_among_rows(samples.shares)
        if self.measured_from is not None:
            return WORST * self._norm(difference, shares) / self.error_divisor(right, samples)
        if self.over == "mean":
            difference = np.average(difference, axis=0, weights=shares)[None]
        return WORST * float(np.linalg.norm(difference, axis=(1, 2)).max())

    def error_divisor(self, right: Stresses, samples: ProbeSamples) -> float:
        """Return the divisor of a relative error, in the natural unit; 1 for a plain value. Raises Undefined."""
        if self.measured_from is None:
            return 1.0
        if (size := self._size(right, samples)) == 0.0:
            raise Undefined(f"the value of `{self.measured_from}` is zero, so there is no relative error")
        return size

    def extent(self, own: Stresses, right: Stresses, samples: ProbeSamples) -> float:
        """Return the factor that converts a relative displacement error to the metric's unit. Raises Undefined.

        It is the larger norm of the tensors at the samples and in the whole body, divided by `scale`.
        """
        return max(self._size(own, samples), self.usual(own)) / self.error_divisor(right, samples)

    def _size(self, field: Stresses, samples: ProbeSamples) -> float:
        """Return the norm of a field over the sample points: the largest, or the mean."""
        sides = samples.sides(field)
        return self._norm(self.tensors(sides.tensors), sides.divide_among_rows(samples.shares))

    def norms(self, change: Tensors) -> Floats:
        """Return the norms (n,) of small changes of the tensors, in the metric's unit."""
        return np.asarray(np.linalg.norm(self.tensors(change), axis=(1, 2)), dtype=np.float64)

    def _norm(self, tensors: Floats, shares: Floats) -> float:
        """Return the largest norm of the tensors, or the mean of the norms with the weights `shares`."""
        norms = np.linalg.norm(tensors, axis=(1, 2))
        return float(np.average(norms, weights=shares) if self.over == "mean" else norms.max())

    def samples(self, place: ProbePlace, field: Stresses) -> ProbeSamples:
        """Return the points of a probe at which the metric evaluates a field."""
        return place.sampled(self.over, field, None if self.measured_from is not None else self.values)

    def usual(self, field: Stresses) -> float:
        """Return the root mean square of the tensor's norm in the body, in the metric's unit."""
        raise NotImplementedError(f"{type(self).__name__} has no size")

    def measure(self, seen: MetricInput) -> Measurement:
        """Return the value, its position, and the disagreement of adjacent cells there. Raises Undefined."""
        field = stress_field_of(seen.stress)
        place = ProbePlace(seen.X, seen.triangles, seen.weights, seen.domain)
        if self.measured_from is not None:
            return self._compared(field, place, seen)
        samples = self.samples(place, field)
        sides = samples.sides(field)
        values = self._require_finite_values(sides.tensors)
        row, value = self.reduce_values(values, sides.divide_among_rows(samples.shares))
        at = samples.X[sides.rows[row]][None]
        details = {
            f"largest_{self._unit_suffix}": float(values.max()),
            f"least_{self._unit_suffix}": float(values.min()),
            "at_m": at[0].tolist(),
            "points": len(seen.X),
            "norm_Pa": float(np.linalg.norm(sides.tensors.cauchy[row])),
            "cells_apart_Pa": float(field.unresolved(at)[0]),
            "cells_apart_1": float(field.relative_fit_residual(at, self.decisive_tensor_part)[0]),
            "usual_stress_Pa": field.usual[0],
            "where_materials_meet": self._count_two_valued_points(field, sides, samples, seen),
        }
        here = values[sides.rows == sides.rows[row]]
        if len(here) > 1:
            details[f"sides_{self._unit_suffix}"] = here.tolist()
        return Measurement(value, details, samples=values if len(values) > 1 else None)

    def _count_two_valued_points(
        self, field: Stresses, sides: TensorsBySide, samples: ProbeSamples, seen: MetricInput
    ) -> int:
        """Return the number of points with two values, one on each side of an interface of materials.

        For a mean it is 0 if these points have no weight in the integral.
        """
        if self.over == "largest":
            return int(field.count_interface_points(seen.X))
        part = float(sides.divide_among_rows(samples.shares)[sides.interface_row_mask].sum())
        return round(part * len(seen.X)) or int(part > 0.0)

    def _compared(self, field: Stresses, place: ProbePlace, seen: MetricInput) -> Measurement:
        """Return the measurement of the difference from the reference model at the same points."""
        samples = self.samples(place, field)
        try:
            right = stress_field_of(None if seen.known is None else seen.known.stress)
            sides, known = pair_sides(field, right, samples)
            values, theirs = self._require_finite_values(sides.tensors), self._require_finite_values(known)
        except Undefined as undefined:
            raise Undefined(f"`{self.measured_from}` has no values to compare with: {undefined}") from undefined
        far, size = np.abs(values - theirs), self.error_divisor(right, samples)
        row, value = self.reduce_values(far, sides.divide_among_rows(samples.shares))
        details = {f"difference_{self._unit_suffix}": value, f"size_{self._unit_suffix}": size}
        details |= {"at_m": samples.X[sides.rows[row]].tolist(), "points": len(seen.X)}
        return Measurement(value / size, details, samples=far / size if len(far) > 1 else None)

    @property
    def _unit_suffix(self) -> str:
        return "Pa" if self.natural == "Pa" else "1"

    def _require_finite_values(self, tensors: Tensors) -> Floats:
        values = self.values(tensors)
        if not np.all(np.isfinite(values)):
            raise Undefined("the deformation is so large that a value is not finite")
        return values

    def reduce_values(self, values: Floats, shares: Floats) -> tuple[int, float]:
        """Return the index of the value with the largest magnitude, and that value or the weighted mean of all."""
        row = int(np.abs(values).argmax())
        return row, float(values[row] if self.over == "largest" else shares @ values)


def stress_field_of(told: StressSource) -> Stresses:
    """Return the stress field of a model or reference. Raises Undefined if it has none."""
    if told is None:
        raise Undefined(
            "only finite elements and beams have a stress at every point, and this model has displacements only"
        )
    from softmark.solvers.stress_recovery.sampling_point_stress import StressUnavailable

    try:
        field: Stresses = told()
        field.sampled()
    except StressUnavailable as refused:
        raise Undefined(str(refused)) from refused
    return field
