"""Data of an indentation by a rigid body, to which contact theories are applied."""

from __future__ import annotations

import math
from typing import Literal

from softmark.records import dataclass
from softmark.references.half_space_indentation import HalfSpace, Surroundings, Tip
from softmark.references.straight_cantilever import NotApplicable, Vector

Kind = Literal["sphere", "cone", "punch", "cylinder"]
FAR = 0.5  # relative to the radius of a sphere: largest depth for small-depth theories
WIDE = 0.5  # relative to the distance to a free side: largest contact radius
THICK = 0.5  # relative to the thickness: largest contact radius on a half-space
SAID = 0.05  # relative error of the force from omitted effects, above which it is reported
NO_FRICTION = "use a theory with friction, or remove `friction`"


@dataclass(frozen=True)
class Indentation:
    """Data of the indentation of a deformable body by a rigid body, in SI units."""

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
        """Tip of the rigid body of revolution. Raises NotApplicable."""
        match self.kind:
            case "sphere":
                return Tip.sphere(self.size)
            case "cone":
                return Tip.cone(self.size, self.edge * (1.0 / math.sin(self.size) - 1.0))
            case "punch":
                return Tip.punch(self.size, self.edge)
        raise NotApplicable("the indenter is a cylinder along z", "use `hertz_line(...)`")

    @property
    def half_space(self) -> HalfSpace:
        """Indentation of an unbounded body by the same rigid body. Raises NotApplicable."""
        return HalfSpace(self.tip, self.depth, self.young, self.poisson, self.at, self.normal, self.around)

    def must_slip_freely(self) -> None:
        """Raise NotApplicable if the contact has friction."""
        if self.friction > 0.0:
            raise NotApplicable(f"the contact has friction of {self.friction:g}", NO_FRICTION)

    def must_be_shallow(self) -> None:
        """Raise NotApplicable if the depth is not small compared with the radius of a sphere or a cylinder."""
        if self.kind in ("sphere", "cylinder") and self.depth > FAR * self.size:
            raise NotApplicable(
                f"the indentation depth is {self.depth / self.size:.3g} of the radius", "reduce the depth"
            )

    def must_be_wide(self) -> None:
        """Raise NotApplicable if a free side is too near, compared with the contact radius on a half-space."""
        radius = math.sqrt(self.size * max(self.depth, 0.0)) if self.kind == "cylinder" else self.half_space.radius
        require_distance(radius, self.around.width, "the nearest free side", WIDE, "use a wider body")

    def must_be_half_space(self) -> None:
        """Raise NotApplicable if the body ends too near the contact for the theory of a half-space."""
        self.must_be_wide()
        require_distance(self.half_space.radius, self.around.thickness, "the far face", THICK,
                    "use a thicker body, or `pressed_layer(...)`")  # fmt: skip


def require_distance(radius: float, away: float, what: str, share: float, remedy: str) -> None:
    """Raise NotApplicable if the contact radius exceeds a fraction `share` of the distance `away` to the body's end."""
    if radius > share * away:
        raise NotApplicable(f"the contact radius is {radius / away:.3g} times the distance to {what}", remedy)
