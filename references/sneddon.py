"""A rigid cone or a flat punch that is pressed into a face without friction: Sneddon's contact."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.records import dataclass
from softmark.references.reference_base import About, Reference
from softmark.references.straight_cantilever import Refused

if TYPE_CHECKING:
    from softmark.references.half_space_indentation import HalfSpace
    from softmark.references.indentation import Pressed


@dataclass(frozen=True)
class Sneddon(Reference):
    """A rigid cone, or a flat round punch, that is pressed into a face without friction: force and displacements.

    With E* = E / (1 - nu^2) and the angle between the axis and the side of the cone: force 2/pi E* tan(angle) d^2,
    radius of contact 2/pi tan(angle) d; of a punch 2 a E* d. Pressure has no limit under the tip and at the edge:
    the largest is not told. Displacements are those of a half-space, of every point of it.

    It takes what `hertz` takes, with one rigid cone or flat round punch whose axis is normal to the face. Cones that
    are sharp strain the body by much; how much the force may be off is in the report (`off`) but for that.
    Metrics `displacement`, `force`, `contact_area` and, beside the tip and the edge, `pressure_along` may be held
    against it.
    Source: Sneddon 1965, Int. J. Eng. Sci. 3, 47-57; Boussinesq 1885; Love 1939, Quart. J. Math. 10, 161.
    """

    body: Annotated[Any, "body", "the body that is pressed"]

    about: ClassVar[About] = "pressed"
    with_forces: ClassVar[bool] = True
    means: ClassVar[str] = "closed form"
    source: ClassVar[str] = "Sneddon 1965, Int. J. Eng. Sci. 3, 47-57"
    error_meaning: ClassVar[str] = "what a half-space moves where the body ends, m, and rounding"

    def must_hold(self, pressed: Pressed) -> None:
        """Raises Refused where an assumption is broken."""
        pressed.must_slip_freely()
        if pressed.kind not in ("cone", "punch"):
            raise Refused(f"what presses is a {pressed.kind}", "use `hertz(...)`")
        pressed.must_be_half_space()

    def solve(self, pressed: Pressed) -> HalfSpace:
        """What it says. Raises Refused where an assumption is broken."""
        self.must_hold(pressed)
        return pressed.half_space
