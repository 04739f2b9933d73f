"""Displacement error at the end of a probe."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, ClassVar

from softmark.interpreter.metrics.metric_base import DisplacementMetric
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


@dataclass(frozen=True)
class TipError(DisplacementMetric):
    """Distance between model and reference at the last point of a probe."""

    probe: Annotated[str, "probe", "probe whose last point is compared"]
    against: Annotated[str, "reference or model", "solution taken as correct"]
    unit: ClassVar[str] = "m"
    last: ClassVar[bool] = True
    uncertain: ClassVar[bool] = True

    def value(self, X: NDArray[np.float64], u: NDArray[np.float64], reference: NDArray[np.float64]) -> float:
        """Return the distance |u_n - reference_n| at the last point, m."""
        return math.sqrt(float(((u[-1] - reference[-1]) ** 2).sum()))
