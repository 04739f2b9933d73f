"""Tendon under tension along a straight or helical route through a beam."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from softmark.interpreter.vocabulary.loads.load import AMPLITUDE, Action, Load, Vector3
from softmark.records import dataclass

if TYPE_CHECKING:
    pass


@dataclass(frozen=True)
class TendonLoad(Action):
    """Tendon under tension along a straight or helical route through a body, frictionless, and fixed at both ends."""

    balanced = True
    unsupported = (
        "point and line forces of a tendon are singular in a solid",
        "use `beam6dof(...)` for tendons; in a solid, replace the pull at the end by a traction on a face",
    )

    begin: Vector3  # m
    end: Vector3  # m
    tension: float  # N
    winding: float = 0.0  # rad
    guides: int | None = None  # number of equally spaced guides, None if guided continuously


@dataclass(frozen=True)
class Tendon(Load):
    """A tendon under tension that runs along a beam, off its axis, through closely spaced guides.

    In the undeformed body it runs straight from one point to another, or winds about the axis on its way. It moves with
    the beam as the beam bends, so its force is a follower force. Guides have no friction: the tension is constant along
    the tendon, and the energy is tension times length. Guides may lie outside the body, as on discs. With `guides`
    there are that many, equally spaced along the axis, with nodes at each, and the tendon is straight between them.
    Each end is fixed to its cross-section, so the pull is internal to the beam: the forces and moments of a tendon sum
    to zero and supports carry none of them. A motor outside the beam would instead pull on the support at that end. A
    straight tendon at a distance d bends a beam to a curvature T d / (E I) and shortens it by T / (E A). Only beams
    with a straight axis take tendons, in static and dynamic analyses. Solids do not: a tendon would press on them along
    a line, where displacements do not converge.
    Source: Rucker and Webster (2011), IEEE Trans. Robot. 27, 1033-1044; Camarillo and others (2008), IEEE Trans. Robot.
    24, 1262-1273.
    """

    strength = "tension"

    body: Annotated[str, "body", "beam that it bends"]
    from_: Annotated[Vector3, "m", "fixed point at one end, by undeformed coordinates"]
    to: Annotated[Vector3, "m", "fixed point at the other end"]
    tension: Annotated[float, "N in [0, inf)", "tension of the tendon"]
    winding: Annotated[
        float,
        "rad in [-1000, 1000]",
        "angle by which it winds about the axis (right-hand rule); `360 deg` is one turn",
    ] = 0.0
    guides: Annotated[
        int | None, "1 in [2, 200]", "number of guides, both ends included; default: guided continuously"
    ] = None
    amplitude: Annotated[Any | None, "amplitude", AMPLITUDE] = None

    @property
    def action(self) -> TendonLoad:
        """Action of the load: a tendon under tension, with its route and guides."""
        return TendonLoad(self.from_, self.to, self.tension, self.winding, self.guides)
