"""Error between two motions, over the points of a probe and over time."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, ClassVar

from softmark.interpreter.metrics.measurement import Measurement
from softmark.interpreter.metrics.metric_base import Metric
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np

    from softmark.interpreter.metrics.measurement import Floats, MetricInput
else:
    from softmark.solvers.runtime.lazy_modules import np


@dataclass(frozen=True)
class TrajectoryError(Metric):
    """Relative l2 norm of the error of a motion, over the points of a probe and all times.

    sqrt(sum |u(X, t) - u_ref(X, t)|^2 / sum |u_ref(X, t)|^2), over the points X of the probe and the times t of the
    reference that both cover, each time weighted by its interval (steps may have been halved). Between its own times u
    is interpolated linearly. Errors on the way show here and not in metrics of the end, where a damped body has come to
    rest whatever it did before: an unconverged step that was accepted, numerical damping, a wrong frequency. Details:
    worst_m, the largest distance of any point at any time, and when_s.
    """

    probe: Annotated[str, "probe", "probe whose points are followed"]
    against: Annotated[str, "reference or model", "model with a history, taken as correct"]
    unit: ClassVar[str] = "1"
    uncertain: ClassVar[bool] = False

    def measure(self, seen: MetricInput) -> Measurement:
        """Return the relative norm of the error. Raises Undefined if the model or the reference has no history."""
        known = seen.known
        if seen.times is None or seen.course is None:
            raise Undefined("it has no time history: the analysis is static, or the probe is a surface")
        if known is None or known.times is None or known.course is None:
            raise Undefined(f"`{self.against}` has no time history")
        common = known.times <= seen.times[-1] * (1 + 1e-9)
        t, right = known.times[common], known.course[common]
        distance = np.linalg.norm(_interpolate_history(t, seen.times, seen.course) - right, axis=2)  # (t, n)
        stands = _time_intervals(t)[:, None]
        size = float((stands[:, :, None] * right**2).sum())
        if size == 0.0:
            raise Undefined(f"`{self.against}` does not move, so there is no relative error")
        worst = np.unravel_index(int(distance.argmax()), distance.shape)
        details = {"worst_m": float(distance[worst]), "when_s": float(t[worst[0]])}
        return Measurement(math.sqrt(float((stands * distance**2).sum()) / size), details, distance.max(axis=1))


def _time_intervals(t: Floats) -> Floats:
    """Return the time interval (k,), s, that each time t (k,) represents in the sum.

    It reaches half-way to both neighbours; at the ends it is the full interval to the only neighbour.
    """
    if len(t) < 2:
        return np.ones(len(t))
    steps = np.diff(t)
    stands: Floats = 0.5 * (np.concatenate([steps[:1], steps]) + np.concatenate([steps, steps[-1:]]))
    return stands


def _interpolate_history(t: Floats, times: Floats, course: Floats) -> Floats:
    """Return a history, known at `times` (m,), linearly interpolated at the times t (k,), shape (k, n, 3).

    `course` (m, n, 3) are its known values.
    """
    after = np.clip(np.searchsorted(times, t), 1, len(times) - 1)
    share = (t - times[after - 1]) / (times[after] - times[after - 1])
    between: Floats = course[after - 1] + share[:, None, None] * (course[after] - course[after - 1])
    return between
