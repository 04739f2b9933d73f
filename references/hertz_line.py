"""A rigid cylinder that is pressed along its length into a strip in plane strain without friction."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.records import dataclass
from softmark.references.reference_base import About, Reference
from softmark.references.straight_cantilever import Refused

if TYPE_CHECKING:
    from softmark.references.indentation import Pressed
    from softmark.references.line_contact import LineContact


@dataclass(frozen=True)
class HertzLine(Reference):
    """A rigid cylinder along z that is pressed into a strip in plane strain without friction: force and pressure.

    Hertz has half the width of contact, sqrt(4 P R / (pi E*)), and the largest pressure, 2 P / (pi a), of the force P
    by length, with E* = E / (1 - nu^2). How deep that presses depends on how thick the body is: the force is found from
    the travel by the integral equation of a strip on its far face, bonded or sliding, whose sides are far away.
    Displacements of points are not told. By how much Hertz's pressure differs from that of the strip is in the
    report (`off`), with the order of what a depth that is not small and free sides make of the force.

    It takes a rectangle in `plane_strain`, and otherwise what `hertz` takes. Metrics `force`, `contact_area`,
    `contact_pressure` and `pressure_along` may be held against it.
    Source: Hertz 1882, J. reine angew. Math. 92, 156-171; Johnson 1985, Contact mechanics, 4.2 and 5.8.
    """

    body: Annotated[Any, "body", "the strip"]

    about: ClassVar[About] = "pressed"
    with_forces: ClassVar[bool] = True
    with_displacements: ClassVar[bool] = False
    means: ClassVar[str] = "integral equation"
    source: ClassVar[str] = "Hertz 1882, J. reine angew. Math. 92, 156-171; Johnson 1985, Contact mechanics, ch. 4"
    error_meaning: ClassVar[str] = "of the depth at which it has its force, m: rounding"

    def must_hold(self, pressed: Pressed) -> None:
        """Raises Refused where an assumption is broken, as far as a look tells."""
        pressed.must_slip_freely()
        pressed.must_be_shallow()
        if pressed.kind != "cylinder":
            raise Refused(f"what presses is a {pressed.kind}", "use `hertz(...)` or `sneddon(...)`")
        if pressed.slice is None:
            raise Refused("a cylinder presses what is not in plane strain", "use `plane_strain(...)`, or a sphere")
        pressed.must_be_wide()

    def solve(self, pressed: Pressed) -> LineContact:
        """What it says. Raises Refused where an assumption is broken."""
        from softmark.references.line_contact import line_contact

        self.must_hold(pressed)
        return line_contact(pressed)
