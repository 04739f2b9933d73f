"""A displacement as a number: a measurement rather than an error, of models and references alike."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar

from softmark.interpreter.metrics.metric_base import OfDisplacements
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


@dataclass(frozen=True)
class Displacement(OfDisplacements):
    """Displacement of the last point of a probe along a direction."""

    probe: Annotated[str, "probe", "its last point is looked at"]
    along: Annotated[tuple[float, float, float], "direction", "the direction, `-z` for a sag under gravity"]
    unit: ClassVar[str] = "m"
    last: ClassVar[bool] = True
    uncertain: ClassVar[bool] = False

    def value(self, X: NDArray[np.float64], u: NDArray[np.float64], reference: None) -> float:
        """u_n . along in m."""
        return float(u[-1] @ self.along)

    @property
    def direction(self) -> tuple[float, float, float]:
        """The one direction that it looks along."""
        return self.along
