"""What metrics of stress, strain and stretch have in common: a number of a tensor at each point of a probe."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from softmark.interpreter.metrics.measurement import Measurement
from softmark.interpreter.metrics.metric import Metric
from softmark.interpreter.metrics.undefined import Undefined

if TYPE_CHECKING:
    import numpy as np

    from softmark.interpreter.metrics.measurement import Floats, Seen
    from softmark.solvers.stresses.field import Part, Stresses
    from softmark.solvers.stresses.measures import Tensors
else:
    from softmark.solvers.base.deferred import np

WORST = 1.5**0.5  # of a tensor's norm: von Mises' stress
EVEN = 1e-9  # relative: steps between points that are one line
Over = Literal["largest", "mean"]


class OfTensors(Metric):
    """One that is made of stresses or strains of a model, at the points of its probe."""

    probe: str
    over: Over

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

    def apart(self, one: Stresses, other: Stresses, X: Floats) -> float:
        """How far two fields are apart at points X (n, 3), in the metric's unit: by all of the tensor.

        One component may agree by chance. The norm of the difference bounds that of every component and principal value
        (Weyl 1912), and that of von Mises' stress with sqrt(3/2).
        """
        difference = self.tensors(one.at(X)) - self.tensors(other.at(X))
        if self.over == "mean":
            difference = difference.mean(axis=0, keepdims=True)
        return WORST * float(np.linalg.norm(difference, axis=(1, 2)).max())

    def usual(self, field: Stresses) -> float:
        """What tensors of the body come to in the mean square, in the metric's unit."""
        raise NotImplementedError(f"{type(self).__name__} has no size")

    def measure(self, seen: Seen) -> Measurement:
        """The value, where it is, and how far the cells there are from agreeing. Raises Undefined."""
        field = field_of(seen)
        tensors = field.at(seen.X)
        values = self.values(tensors)
        if not np.all(np.isfinite(values)):
            raise Undefined("the state is so deformed that it has no number in every point")
        place = int(np.abs(values).argmax())
        value = float(values[place]) if self.over == "largest" else self._mean(values, seen)
        suffix = "Pa" if self.unit == "Pa" else "1"
        at = seen.X[place : place + 1]
        details = {
            f"largest_{suffix}": float(values.max()),
            f"least_{suffix}": float(values.min()),
            "at_m": [float(x) for x in at[0]],
            "points": len(values),
            "norm_Pa": float(np.linalg.norm(tensors.cauchy[place])),
            "cells_apart_Pa": float(field.unresolved(at)[0]),
            "cells_apart_1": float(field.disagreement(at, self.made_of)[0]),
            "usual_stress_Pa": field.usual[0],
        }
        return Measurement(value, details, samples=values if len(values) > 1 else None)

    def _mean(self, values: Floats, seen: Seen) -> float:
        """Over the volume, the area or the length that points stand for; of points without these, each alike."""
        if seen.weights is not None:
            return float(seen.weights @ values / seen.weights.sum())
        if seen.triangles is None or not len(seen.triangles):
            return float(_along(seen.X) @ values)
        corners = seen.X[seen.triangles]
        areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        return float(areas @ values[seen.triangles].mean(axis=1) / areas.sum())


def _along(X: Floats) -> Floats:
    """What each of points (n, 3) counts (n,): alike, and the ends of a straight line half, the trapezoidal rule."""
    count = len(X)
    w: Floats = np.ones(count)
    steps = np.diff(X, axis=0)
    if count > 2 and np.ptp(steps, axis=0).max() <= EVEN * np.abs(steps).max():
        w[[0, -1]] = 0.5
    w /= w.sum()
    return w


def field_of(seen: Seen) -> Stresses:
    """The stresses of what is seen. Raises Undefined where it has none."""
    if seen.stress is None:
        raise Undefined(
            "only finite elements have a stress at every point, and this is known by its displacements alone"
        )
    from softmark.solvers.stresses.sampled import NoStress

    try:
        field: Stresses = seen.stress()
        field.sampled()
    except NoStress as refused:
        raise Undefined(str(refused)) from refused
    return field
