"""Support of points of a beam network, whose cross-sections may rotate."""

from __future__ import annotations

from typing import Annotated, Any

from softmark.interpreter.vocabulary.supports.support import Vector3, VectorMotion
from softmark.records import dataclass


@dataclass(frozen=True)
class Pinned(VectorMotion):
    """Holds or moves points on the axes of a network, and leaves their cross-sections free to rotate.

    With an `axis` sections rotate only about it, as on a pin; by default they rotate freely, as on a ball joint.
    `components` chooses the directions that are held: `components = y` is a roller that slides along x and z. This is
    not a hinge between two members: members that meet are joined rigidly.
    """

    unsupported_help = "use `frame6dof(...)` with a `network(...)` for hinged points"

    body: Annotated[str, "body", "beam network that is held"]
    where: Annotated[Any, "condition", "selected points, by undeformed coordinates"]
    axis: Annotated[Vector3 | None, "direction", "axis about which sections may rotate; default: all axes"] = None
    by: Annotated[Vector3, "m", "displacement at full load"] = (0.0, 0.0, 0.0)
    components: Annotated[tuple[int, ...], "components", "directions that are held"] = (0, 1, 2)
    amplitude: Annotated[
        Any | None, "amplitude", "amplitude from state to state; default: full motion from the start"
    ] = None

    @property
    def moves(self) -> bool:  # type: ignore[override]  # a constant of other kinds
        """True if the support prescribes a nonzero displacement."""
        return any(self.by)

    @property
    def hinge_axis(self) -> Vector3 | None:
        """Axis about which it lets cross-sections rotate; None if they rotate about all axes."""
        return self.axis

    @property
    def carries_moments(self) -> bool:
        """True if it prevents a rotation of cross-sections, as a pin does about the normals of its axis."""
        return self.axis is not None
