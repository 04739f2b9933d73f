"""A plugin some of whose words cannot be used."""

from typing import Annotated

from softmark.interpreter.metrics.metric_base import DisplacementMetric
from softmark.records import dataclass

SOFTMARK = {
    "metrics": {"sway": "Sway", "stress": "Sway", "drift": "Drift", "lean": "Lean"},
    "meters": {"sway": "Sway"},
    "loads": {"sway": "Sway"},
}


@dataclass(frozen=True)
class Sway(DisplacementMetric):
    """How far the farthest point of a probe goes sideways."""

    probe: Annotated[str, "probe", "where it is looked at"]
    unit = "m"

    def value(self, X, u, reference):
        """Of displacements u (n, 3), m."""
        return float(abs(u[:, 1]).max())


@dataclass(frozen=True)
class Lean(DisplacementMetric):
    """How far it leans, which nobody says."""

    probe: Annotated[str, "probe", "where it is looked at"]
    unit = "1"
