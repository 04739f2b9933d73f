"""Support that rotates a part of a body about an axis."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any, Self

from softmark.interpreter.vocabulary.supports.support import DisplacementSupport, Vector3
from softmark.interpreter.vocabulary.values_in_states import scale_field
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np

    from softmark.interpreter.vocabulary.loads.load import Reason
    from softmark.interpreter.vocabulary.supports.support import Floats, Measured
else:
    from softmark.solvers.runtime.lazy_modules import np

OFF_LINE = "it rotates, and the exchange format has only displacements proportional to the load"


@dataclass(frozen=True)
class Rotated(DisplacementSupport):
    """Rotates the selected part of a body about an axis (right-hand rule), by up to ten full turns.

    Every point moves exactly on its circle about the axis, not only to first order. A static analysis applies the
    rotation in steps of at most 15 degrees from rest, and raises the loads with them, so a rotation of 360 degrees
    differs from none. With all components held the part keeps its shape; with `components = (y, z)` a part that rotates
    about x may slide along x. `moment(NAME, along = +x)` is the torque of the support, `force(NAME, along = +x)` its
    axial force. On a beam whole cross-sections rotate. Because of the load steps, `path = arc_length`,
    `max_iterations`, reduced models and `disturbed` starts are refused. In small strain a large rotation would appear
    as growth of the body.
    """

    moves = True
    on_rigid_bodies = True
    prescribes_rotation = True

    body: Annotated[str, "body", "body that is rotated"]
    where: Annotated[Any, "condition", "selected points, by undeformed coordinates"]
    axis: Annotated[Vector3, "direction", "axis of rotation, right-hand rule"]
    angle: Annotated[float, "rad in [-62.831854, 62.831854]", "angle of rotation at full load: `180 deg`"]
    through: Annotated[Vector3, "m", "point on the axis"] = (0.0, 0.0, 0.0)
    components: Annotated[tuple[int, ...], "components", "directions in which displacements are imposed"] = (0, 1, 2)
    amplitude: Annotated[
        Any | None,
        "amplitude",
        "amplitude over time or from state to state; default: full rotation from the start",
    ] = None

    @property
    def rotation(self) -> Vector3:
        """Prescribed rotation at full load as a vector along the axis, rad."""
        x, y, z = (self.angle * c for c in self.axis)
        return x, y, z

    @property
    def export_fault(self) -> str:  # type: ignore[override]  # a constant of other kinds
        """Reason why the support cannot be exchanged with other programs; "" if it rotates nothing."""
        return OFF_LINE if self.rotates else ""

    def prescribed_displacements(self, X: Floats, share: float = 1.0, measured: Measured | None = None) -> Floats:
        """Return the prescribed displacements (n, 3), m, of points X (n, 3), m, by Rodrigues' formula.

        sin a  n x r + (1 - cos a) n x (n x r), with a the angle, n the axis and r the vector from the axis.
        """
        n, angle = np.array(self.axis), share * self.angle
        across = np.cross(n, X - np.array(self.through))
        found: Floats = math.sin(angle) * across + 2.0 * math.sin(0.5 * angle) ** 2 * np.cross(n, across)
        return found

    def axial_fault(self, body: str) -> Reason:
        """Return the reason why a body of revolution cannot have the support."""
        return (
            "",
            f"rotates a part of `{body}`, a body of revolution",
            "not axisymmetric",
            "use a `solid`: the rings of a body of revolution do not tilt",
        )

    def part(self, share: float) -> Self:
        """Return the support with its angle scaled to the fraction `share`."""
        turned: Self = scale_field(self, "angle", share)
        return turned
