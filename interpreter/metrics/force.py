"""Force of a support or a contact on a body."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.interpreter.metrics.metric_base import WHEN, ForceMetric, When
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np

    from softmark.interpreter.metrics.metric_base import Floats
    from softmark.interpreter.results.reaction_results import EquilibriumForces
else:
    from softmark.solvers.runtime.lazy_modules import np


@dataclass(frozen=True)
class Force(ForceMetric):
    """Force of a support or a contact on the body, along a direction.

    It is the sum of internal minus applied forces over the points that the support constrains. It is computed again by
    independent formulas and balanced with all loads to 1e-8 (`checks` of the report). The part that two supports share
    counts for the first of them in the scene; the report gives the point of action. The force of a plate that pulls
    along +z is positive along +z. Against another model, the value is the difference relative to the magnitude of that
    model's force.

    In a dynamic analysis it is the force of a contact, from barrier and friction: at the end, or the largest or the
    mean over time, and a curve; `MODEL.METRIC.at(2 ms)` gives the value at a time. There it is the mean over the two
    adjacent steps, so that the curve has the impulse that the body received.

    The report also gives size_N, the magnitude of the force, and in a dynamic analysis largest_in_time_N and its time
    largest_at_s.
    """

    of: Annotated[str, "support or contact", "the support, or the contact"]
    along: Annotated[tuple[float, float, float], "direction", "the direction, `+z` for a pull upwards"]
    over: Annotated[When, WHEN] = "end"
    against: Annotated[str | None, "reference or model", "solution taken as correct"] = None
    natural: ClassVar[str] = "N"

    @property
    def subject_name(self) -> str:
        """Name of the support or contact whose force is measured."""
        return self.of

    @property
    def direction(self) -> tuple[float, float, float]:
        """Direction along which the force is measured."""
        return self.along

    def amount(self, rest: EquilibriumForces) -> Floats:
        """Return the force vector (3,), N."""
        return np.array(rest.reactions[self.of].force)

    def acting(self, rest: EquilibriumForces) -> float:
        """Return the largest load or reaction on the body, N."""
        return rest.acting

    def details(self, value: Floats) -> dict[str, Any]:
        """Return the report entry of the force's magnitude."""
        return {"size_N": self.size(value)}
