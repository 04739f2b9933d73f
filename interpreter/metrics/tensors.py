"""What metrics of stress, strain and stretch have in common: a number of a tensor at each point of a probe."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, ClassVar, Literal

from softmark.interpreter.metrics.measurement import Measurement
from softmark.interpreter.metrics.metric import Metric
from softmark.interpreter.metrics.undefined import Undefined

if TYPE_CHECKING:
    import numpy as np

    from softmark.interpreter.metrics.measurement import Floats, Ints, Seen
    from softmark.solvers.stresses.field import Part, Stresses
    from softmark.solvers.stresses.measures import Tensors

    Told = Callable[[], Stresses] | None  # of who is seen; it raises NoStress
else:
    from softmark.solvers.base.deferred import np

WORST = 1.5**0.5  # of a tensor's norm: von Mises' stress
EVEN = 1e-9  # relative: steps between points that are one line
Over = Literal["largest", "mean"]


class OfTensors(Metric):
    """One that is made of stresses or strains of a model, at the points of its probe.

    Against another model it is how far the two are apart, point by point, relative to that model's tensors there.
    """

    probe: str
    over: Over
    natural: ClassVar[str]  # the unit of its value

    @property
    def unit(self) -> str:
        """Of its value: a plain number where it is an error."""
        return self.natural if self.measured_from is None else "1"

    @property
    def made_of(self) -> Part:
        """What cells must agree on for this number to be resolved."""
        return "strain"

    def values(self, tensors: Tensors) -> Floats:
        """The number of each tensor (n,), in the metric's unit."""
        raise NotImplementedError(f"{type(self).__name__} has no values")

    def tensors(self, tensors: Tensors) -> Floats:
        """What the numbers are of (n, 3, 3), in the metric's unit."""
        raise NotImplementedError(f"{type(self).__name__} has no tensors")

    def apart(self, one: Stresses, other: Stresses, X: Floats, right: Stresses, shares: Floats | None = None) -> float:
        """How far two fields are apart at points X (n, 3), in the metric's unit: by all of the tensor.

        `shares` (n,) are what each point counts in a mean, alike without them.

        One component may agree by chance. The norm of the difference bounds that of every component and principal value
        (Weyl 1912), and that of von Mises' stress with sqrt(3/2). How far each is from what is `right` changes by no
        more than that (triangle inequality). Raises Undefined.
        """
        difference = self.tensors(one.at(X)) - self.tensors(other.at(X))
        if self.measured_from is not None:
            return WORST * self._norm(difference, shares) / self.scale(right, X, shares)
        if self.over == "mean":
            difference = np.average(difference, axis=0, weights=shares)[None]
        return WORST * float(np.linalg.norm(difference, axis=(1, 2)).max())

    def scale(self, right: Stresses, X: Floats, shares: Floats | None = None) -> float:
        """What an error is relative to, in its natural unit; 1 of what is none. Raises Undefined."""
        if self.measured_from is None:
            return 1.0
        if (size := self._norm(self.tensors(right.at(X)), shares)) == 0.0:
            raise Undefined(f"that of `{self.measured_from}` is zero, so nothing is relative to it")
        return size

    def extent(self, own: Stresses, right: Stresses, X: Floats, shares: Floats | None = None) -> float:
        """What an error of the displacements is multiplied by, in the metric's unit. Raises Undefined.

        What tensors are there or, where these are none, in the body.
        """
        return max(self._norm(self.tensors(own.at(X)), shares), self.usual(own)) / self.scale(right, X, shares)

    def _norm(self, tensors: Floats, shares: Floats | None) -> float:
        norms = np.linalg.norm(tensors, axis=(1, 2))
        return float(np.average(norms, weights=shares) if self.over == "mean" else norms.max())

    def usual(self, field: Stresses) -> float:
        """What tensors of the body come to in the mean square, in the metric's unit."""
        raise NotImplementedError(f"{type(self).__name__} has no size")

    def measure(self, seen: Seen) -> Measurement:
        """The value, where it is, and how far the cells there are from agreeing. Raises Undefined."""
        field = field_of(seen.stress)
        tensors = field.at(seen.X)
        values = self._finite(tensors)
        if self.measured_from is not None:
            return self._compared(values, seen)
        place, value = self._summed(values, seen)
        at = seen.X[place : place + 1]
        details = {
            f"largest_{self._suffix}": float(values.max()),
            f"least_{self._suffix}": float(values.min()),
            "at_m": at[0].tolist(),
            "points": len(values),
            "norm_Pa": float(np.linalg.norm(tensors.cauchy[place])),
            "cells_apart_Pa": float(field.unresolved(at)[0]),
            "cells_apart_1": float(field.disagreement(at, self.made_of)[0]),
            "usual_stress_Pa": field.usual[0],
            "where_materials_meet": field.shared(seen.X),
        }
        return Measurement(value, details, samples=values if len(values) > 1 else None)

    def _compared(self, values: Floats, seen: Seen) -> Measurement:
        """How far values (n,) are from those of the model that is taken as right, at the same points."""
        try:
            right = field_of(None if seen.known is None else seen.known.stress)
            theirs = self._finite(right.at(seen.X))
        except Undefined as undefined:
            raise Undefined(f"`{self.measured_from}` has nothing to compare with: {undefined}") from undefined
        far, size = np.abs(values - theirs), self.scale(right, seen.X, shares_of(seen.X, seen.weights, seen.triangles))
        place, value = self._summed(far, seen)
        details = {f"difference_{self._suffix}": value, f"size_{self._suffix}": size}
        details |= {"at_m": seen.X[place].tolist(), "points": len(far)}
        return Measurement(value / size, details, samples=far / size if len(far) > 1 else None)

    @property
    def _suffix(self) -> str:
        return "Pa" if self.natural == "Pa" else "1"

    def _finite(self, tensors: Tensors) -> Floats:
        values = self.values(tensors)
        if not np.all(np.isfinite(values)):
            raise Undefined("the state is so deformed that it has no number in every point")
        return values

    def _summed(self, values: Floats, seen: Seen) -> tuple[int, float]:
        """The point of the greatest magnitude, and the value there or the mean."""
        place = int(np.abs(values).argmax())
        if self.over == "largest":
            return place, float(values[place])
        return place, float(shares_of(seen.X, seen.weights, seen.triangles) @ values)


def shares_of(X: Floats, weights: Floats | None, triangles: Ints | None) -> Floats:
    """What each of points X (n, 3) counts in a mean (n,), of sum 1.

    The volume, the area or the length that it stands for, by `weights` (n,) or `triangles` (k, 3); else each alike.
    """
    if weights is not None:
        told: Floats = weights / weights.sum()
        return told
    if triangles is None or not len(triangles):
        return _along(X)
    corners = X[triangles]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    found: Floats = np.bincount(triangles.ravel(), np.repeat(areas, 3), minlength=len(X)) / (3.0 * areas.sum())
    return found


def _along(X: Floats) -> Floats:
    """What each of points (n, 3) counts (n,): alike, and the ends of a straight line half, the trapezoidal rule."""
    count = len(X)
    w: Floats = np.ones(count)
    steps = np.diff(X, axis=0)
    if count > 2 and np.ptp(steps, axis=0).max() <= EVEN * np.abs(steps).max():
        w[[0, -1]] = 0.5
    w /= w.sum()
    return w


def field_of(told: Told) -> Stresses:
    """The stresses of who is seen. Raises Undefined where it has none."""
    if told is None:
        raise Undefined(
            "only finite elements and beams have a stress at every point, and this is known by its displacements alone"
        )
    from softmark.solvers.stresses.sampled import NoStress

    try:
        field: Stresses = told()
        field.sampled()
    except NoStress as refused:
        raise Undefined(str(refused)) from refused
    return field
