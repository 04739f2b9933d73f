"""What metrics of curves have in common: a curve of another metric, over time or from state to state."""

from __future__ import annotations

from typing import TYPE_CHECKING

from softmark.interpreter.metrics.metric_base import OfMetric

if TYPE_CHECKING:
    from softmark.interpreter.metrics.curve_geometry import Course, Curve
    from softmark.interpreter.metrics.measurement import Floats


class OfCurves(OfMetric):
    """One of the curve that the metric `of` has over time, or at rest along the metric `over`."""

    if TYPE_CHECKING:
        over: str | None

    def stated(self, course: Course, off: Floats, along: Floats, reference: Curve | None) -> dict[str, float]:
        """By how much it may be off, in parts, where values are by `off` (n,) and lie `along` (n,) elsewhere.

        Raises Undefined.
        """
        raise NotImplementedError(f"{type(self).__name__} states nothing")
