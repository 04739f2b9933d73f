"""Largest displacement error over a probe."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, ClassVar

from softmark.interpreter.metrics.metric_base import DisplacementMetric
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


@dataclass(frozen=True)
class MaxError(DisplacementMetric):
    """Largest distance between model and reference over the points of a probe."""

    probe: Annotated[str, "probe", "probe whose points are compared"]
    against: Annotated[str, "reference or model", "solution taken as correct"]
    unit: ClassVar[str] = "m"
    uncertain: ClassVar[bool] = True

    def value(self, X: NDArray[np.float64], u: NDArray[np.float64], reference: NDArray[np.float64]) -> float:
        """Return the largest distance max |u_i - reference_i| over the points, m."""
        return math.sqrt(float(((u - reference) ** 2).sum(axis=1).max()))
