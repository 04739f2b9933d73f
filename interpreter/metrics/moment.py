"""Moment of a support or a contact on a body."""

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

Vector3 = tuple[float, float, float]


@dataclass(frozen=True)
class Moment(ForceMetric):
    """Moment of a support or a contact on the body about an axis, such as a torque or a clamping moment.

    Forces act at the deformed positions of their points; in a model of small strain at the undeformed ones. By default
    the reference point is the centroid of the constrained part in its deformed position: of its volume, or of its
    surface area if no whole cell is constrained; for a beam, of the length of its axis. The report gives it as `at` of
    the reaction. The moment is verified and balanced as forces are. Against another model, the value is the difference
    relative to the magnitude of that model's moment.

    In a dynamic analysis it is the moment of a contact, as for its force.

    The report also gives size_Nm, the magnitude of the moment, and in a dynamic analysis largest_in_time_Nm and its
    time largest_at_s.
    """

    of: Annotated[str, "support or contact", "the support, or the contact"]
    along: Annotated[Vector3, "direction", "the axis, right-handed"]
    about: Annotated[Vector3 | None, "m", "point on the axis; default: centroid of the constrained part"] = None
    over: Annotated[When, WHEN] = "end"
    against: Annotated[str | None, "reference or model", "solution taken as correct"] = None
    natural: ClassVar[str] = "N*m"

    @property
    def subject_name(self) -> str:
        """Name of the support or contact whose moment is measured."""
        return self.of

    @property
    def direction(self) -> Vector3:
        """Axis about which the moment is measured."""
        return self.along

    def amount(self, rest: EquilibriumForces) -> Floats:
        """Return the moment vector (3,), N m."""
        own = rest.reactions[self.of]
        if self.about is None:
            return np.array(own.own_moment)
        moment: Floats = np.array(own.moment) - np.cross(self.about, own.force)
        return moment

    def acting(self, rest: EquilibriumForces) -> float:
        """Return the largest load or reaction on the body times the extent of the body, N m."""
        return rest.acting * rest.extent

    def details(self, value: Floats) -> dict[str, Any]:
        """Return the report entry of the moment's magnitude."""
        return {"size_Nm": self.size(value)}
