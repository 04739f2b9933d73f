"""A rigid body that is pressed into a face: the numbers of it that theories of contact are solved for."""

from __future__ import annotations

import math
from typing import Literal

from softmark.records import dataclass
from softmark.references.half_space_indentation import HalfSpace, Surroundings, Tip
from softmark.references.straight_cantilever import Refused, Vector

Kind = Literal["sphere", "cone", "punch", "cylinder"]
FAR = 0.5  # relative to the radius of a sphere: largest depth for small-depth theories
WIDE = 0.5  # relative to the distance to a free side: largest contact radius
THICK = 0.5  # relative to the thickness: largest contact radius on a half-space
SAID = 0.05  # relative error of the force from omitted effects, above which it is reported
NO_FRICTION = "use a theory with friction, or leave `friction` out"


@dataclass(frozen=True)
class Pressed:
    """A body that a rigid one presses. SI units."""

    kind: Kind
    size: float  # m: radius of a sphere, a cylinder, or of what is flat of a punch; of a cone its half-angle, rad
    depth: float  # m, travel since first contact; negative for a remaining gap
    young: float  # Pa
    poisson: float  # 1
    at: Vector  # m, point of first contact on the undeformed face
    normal: Vector  # unit vector, out of the face
    around: Surroundings
    friction: float = 0.0
    slid: Vector = (0.0, 0.0, 0.0)  # m, along the face since it touched
    share: float = 1.0  # modelled fraction: 1/2 with one plane of symmetry, 1/4 with two
    slice: float | None = None  # m, along z of one in plane strain
    edge: float = 0.0  # m: the radius that the rim of a punch, or the tip of a cone, is rounded by
    turned: bool = False  # whether it was moved along the face while it was pressed in as well, or back

    @property
    def tip(self) -> Tip:
        """Of a body of revolution. Raises Refused."""
        match self.kind:
            case "sphere":
                return Tip.sphere(self.size)
            case "cone":
                return Tip.cone(self.size, self.edge * (1.0 / math.sin(self.size) - 1.0))
            case "punch":
                return Tip.punch(self.size, self.edge)
        raise Refused("what presses is a cylinder along z", "use `hertz_line(...)`")

    @property
    def half_space(self) -> HalfSpace:
        """The same, as if the body ended far away. Raises Refused."""
        return HalfSpace(self.tip, self.depth, self.young, self.poisson, self.at, self.normal, self.around)

    def must_slip_freely(self) -> None:
        """Raises Refused where there is friction."""
        if self.friction > 0.0:
            raise Refused(f"the contact has friction of {self.friction:g}", NO_FRICTION)

    def must_be_shallow(self) -> None:
        """Raises Refused where a sphere or a cylinder is pressed in by much of its radius."""
        if self.kind in ("sphere", "cylinder") and self.depth > FAR * self.size:
            raise Refused(f"it is pressed in by {self.depth / self.size:.3g} of its radius", "press it in by less")

    def must_be_wide(self) -> None:
        """Raises Refused where a free side is near, by the radius of contact of a half-space."""
        radius = math.sqrt(self.size * max(self.depth, 0.0)) if self.kind == "cylinder" else self.half_space.radius
        must_be_far(radius, self.around.width, "the nearest free side", WIDE, "take a wider body")

    def must_be_half_space(self) -> None:
        """Raises Refused where the body ends near what presses."""
        self.must_be_wide()
        must_be_far(self.half_space.radius, self.around.thickness, "the far face", THICK,
                    "take a thicker body, or use `pressed_layer(...)`")  # fmt: skip


def must_be_far(radius: float, away: float, what: str, share: float, remedy: str) -> None:
    """Raises Refused where the radius of contact is more than a share of the distance from what ends the body."""
    if radius > share * away:
        raise Refused(f"the radius of contact is {radius / away:.3g} of the distance to {what}", remedy)
