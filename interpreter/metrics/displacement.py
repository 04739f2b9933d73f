"""Displacement of one point as a number, for models and references alike."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar

from softmark.interpreter.metrics.metric_base import DisplacementMetric
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


@dataclass(frozen=True)
class Displacement(DisplacementMetric):
    """Displacement of the last point of a probe along a direction."""

    probe: Annotated[str, "probe", "probe whose last point is evaluated"]
    along: Annotated[tuple[float, float, float], "direction", "the direction, `-z` for a sag under gravity"]
    unit: ClassVar[str] = "m"
    last: ClassVar[bool] = True
    uncertain: ClassVar[bool] = False

    def value(self, X: NDArray[np.float64], u: NDArray[np.float64], reference: None) -> float:
        """Return the displacement u_n . along of the last point, m."""
        return float(u[-1] @ self.along)

    @property
    def direction(self) -> tuple[float, float, float]:
        """Direction along which the displacement is measured."""
        return self.along
