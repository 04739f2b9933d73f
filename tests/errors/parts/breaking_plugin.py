"""A plugin whose words break their contracts."""

from typing import Annotated

import numpy as np

from softmark.interpreter.metrics.metric_base import DisplacementMetric
from softmark.records import dataclass

SOFTMARK = {"metrics": {"lean": "Lean", "ratio": "Ratio"}}


@dataclass(frozen=True)
class Lean(DisplacementMetric):
    """leans"""

    probe: Annotated[str, "probe", "where it is looked at"]
    share: Annotated[float, "1 in (0, 1]", "how much of it counts"] = 2.0
    unit = "m"

    def value(self, X, u, reference):
        """Of displacements u (n, 3), m."""
        return u[7, 0]


@dataclass(frozen=True)
class Ratio(DisplacementMetric):
    """How far it goes along x for each step along y."""

    probe: Annotated[str, "probe", "where it is looked at"]
    unit = "1"

    def value(self, X, u, reference):
        """Of displacements u (n, 3), m."""
        with np.errstate(all="ignore"):
            return float((u[:, 0] / u[:, 1]).mean())
