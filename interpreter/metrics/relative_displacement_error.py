"""Relative displacement error of Marchal et al. (2008)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, ClassVar

from softmark.interpreter.metrics.metric_base import DisplacementMetric
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


@dataclass(frozen=True)
class RelativeDisplacementError(DisplacementMetric):
    """Relative l2 norm of the displacement error over the points of a probe.

    eta = |u^ - u| / |u|, with u of the reference and u^ of the model stacked over the points: equation (1) of Marchal,
    Allard, Duriez and Cotin (2008), who call it the relative energy norm error. It is a plain l2 norm of displacements
    and not the energy norm of finite element theory: it has no stiffness weights and depends on where the points lie.
    """

    probe: Annotated[str, "probe", "probe whose points are compared"]
    against: Annotated[str, "reference or model", "solution taken as correct"]
    unit: ClassVar[str] = "1"
    uncertain: ClassVar[bool] = False

    def value(self, X: NDArray[np.float64], u: NDArray[np.float64], reference: NDArray[np.float64]) -> float:
        """Return the relative error eta of displacements u (n, 3), m, compared with `reference` (n, 3), m."""
        size = float((reference**2).sum())
        if size == 0.0:
            raise Undefined("the reference does not move, so there is no relative error")
        return math.sqrt(float(((u - reference) ** 2).sum() / size))
