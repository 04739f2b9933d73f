"""The moment with which a support holds or turns a body."""

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

Vector3 = tuple[float, float, float]


@dataclass(frozen=True)
class Moment(OfForces):
    """Moment of a support or a contact on the body, about an axis: a torque, or what a clamp resists.

    Forces act where their points came to lie; in a model of small strain where they were. Without `about` the point is
    the middle of what is held, there where it came to lie: of its volume, or where no cell is held whole, of its area
    on the surface; of a beam, of the length of its axis. It is `at` of the reaction in the report. Found again and
    balanced as forces are. Against another model it is the difference relative to the size of that model's moment.

    In a motion it is that of a contact, as its force is.

    Beside its value a report has size_Nm, that of the moment whatever its direction, and in a motion largest_in_time_Nm
    and when that is, largest_at_s.
    """

    of: Annotated[str, "support or contact", "the support, or the contact"]
    along: Annotated[Vector3, "direction", "the axis, right-handed"]
    about: Annotated[Vector3 | None, "m", "a point of the axis; without it the middle of what is held"] = None
    over: Annotated[When, WHEN] = "end"
    against: Annotated[str | None, "reference or model", "what is taken as right"] = None
    natural: ClassVar[str] = "N*m"

    @property
    def concerned(self) -> str:
        """The support or contact."""
        return self.of

    @property
    def direction(self) -> Vector3:
        """The one direction that it looks along."""
        return self.along

    def amount(self, rest: AtRest) -> Floats:
        """The moment (3,), N m."""
        own = rest.reactions[self.of]
        if self.about is None:
            return np.array(own.own_moment)
        moment: Floats = np.array(own.moment) - np.cross(self.about, own.force)
        return moment

    def acting(self, rest: AtRest) -> float:
        """The same of forces times the extent of the body, N m."""
        return rest.acting * rest.extent

    def details(self, value: Floats) -> dict[str, Any]:
        """The size of the moment."""
        return {"size_Nm": self.size(value)}
