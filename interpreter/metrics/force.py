"""The force with which a support holds or moves a body."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.interpreter.metrics.metric_base import WHEN, OfForces, When
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np

    from softmark.interpreter.metrics.metric_base import Floats
    from softmark.interpreter.results.reaction_results import AtRest
else:
    from softmark.solvers.runtime.lazy_modules import np


@dataclass(frozen=True)
class Force(OfForces):
    """Force of a support or a contact on the body, along a direction: what pulls, presses or holds it.

    The sum of internal less applied forces over what the support holds, found again by other formulas and balanced with
    all loads to 1e-8 (`checks` of the report). What two supports both hold counts as that of the first in the scene;
    the report says what acts there. Of a plate that pulls along +z it is positive along +z. Against another model it is
    the difference relative to the size of that model's force.

    In a motion it is that of a contact, barrier and friction, at the end, or the largest or the mean over time, and a
    curve; `MODEL.METRIC.at(2 ms)` asks for it at a time. There it is the mean over the two steps that meet, so that the
    curve has the impulse that the body has got.

    Beside its value a report has size_N, that of the force whatever its direction, and in a motion largest_in_time_N
    and when that is, largest_at_s.
    """

    of: Annotated[str, "support or contact", "the support, or the contact"]
    along: Annotated[tuple[float, float, float], "direction", "the direction, `+z` for a pull upwards"]
    over: Annotated[When, WHEN] = "end"
    against: Annotated[str | None, "reference or model", "what is taken as right"] = None
    natural: ClassVar[str] = "N"

    @property
    def concerned(self) -> str:
        """The support or contact."""
        return self.of

    @property
    def direction(self) -> tuple[float, float, float]:
        """The one direction that it looks along."""
        return self.along

    def amount(self, rest: AtRest) -> Floats:
        """The force (3,), N."""
        return np.array(rest.reactions[self.of].force)

    def acting(self, rest: AtRest) -> float:
        """The largest load or reaction, N."""
        return rest.acting

    def details(self, value: Floats) -> dict[str, Any]:
        """The size of the force."""
        return {"size_N": self.size(value)}
