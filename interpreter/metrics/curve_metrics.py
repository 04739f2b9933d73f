"""Base class of metrics that evaluate the curve of another metric, over time or from state to state."""

from __future__ import annotations

from typing import TYPE_CHECKING

from softmark.interpreter.metrics.metric_base import DerivedMetric

if TYPE_CHECKING:
    from softmark.interpreter.metrics.curve_geometry import Curve, MetricCurve
    from softmark.interpreter.metrics.measurement import Floats


class CurveMetric(DerivedMetric):
    """Base class of metrics that evaluate the curve of the metric `of`, over time or along the metric `over`."""

    if TYPE_CHECKING:
        over: str | None

    def stated(self, course: MetricCurve, off: Floats, along: Floats, reference: Curve | None) -> dict[str, float]:
        """Return bounds of the error of the value, by cause, if y has errors `off` (n,) and x errors `along` (n,).

        Raises Undefined.
        """
        raise NotImplementedError(f"{type(self).__name__} does not implement `stated`")
