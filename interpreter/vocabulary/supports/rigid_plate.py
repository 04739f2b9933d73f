"""Support by a rigid frictionless plate that cannot tilt."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from softmark.interpreter.vocabulary.supports.spring_support import SpringSupport, rigid_motions_along
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.vocabulary.supports.spring_support import Result, Springs
    from softmark.interpreter.vocabulary.supports.support import Floats


@dataclass(frozen=True)
class RigidPlate(SpringSupport):
    """Keeps a plane face parallel to itself: a rigid frictionless plate on it that cannot tilt.

    All points of the face move by the same distance along its normal, which follows from the loads, and freely in the
    plane of the face. A load on the plate is a load on the face, such as a `traction`; only its resultant matters. For
    a plate with a given displacement use `displaced(...)`. The constraint is enforced by springs between each point and
    the mean of all points, 1e6 times as stiff as the body behind them; an unevenness of about 1e-5 of the displacement
    remains. Finite elements support it in static and quasistatic analyses, in three dimensions and in the plane, for
    faces normal to x, y or z.
    """

    is_massless_plate = True

    body: Annotated[str, "body", "body under the plate"]
    where: Annotated[Any, "condition", "plane face, by undeformed coordinates"]

    def springs(self, surface: Springs[Result]) -> Result:
        """Return springs between each point of the face and the mean of all its points."""
        return surface.plane_keeping_springs(self.where)

    def resisted_motions(self, X: Floats, normal: Floats) -> Floats:
        """Return the constraint row (p, 1, 6) at each point: its normal displacement relative to the mean."""
        rows = rigid_motions_along(X, normal[:, None])
        rows -= rows.mean(axis=0)
        return rows
