"""A rigid sphere that is pressed into a face without friction: Hertz's contact."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.records import dataclass
from softmark.references.reference_base import About, Reference
from softmark.references.straight_cantilever import Refused

if TYPE_CHECKING:
    from softmark.references.half_space_indentation import HalfSpace
    from softmark.references.indentation import Pressed


@dataclass(frozen=True)
class Hertz(Reference):
    """A rigid sphere that is pressed into a face without friction: force, area, pressure and displacements.

    With E* = E / (1 - nu^2): radius of contact sqrt(R d), force 4/3 E* sqrt(R) d^(3/2), largest pressure
    2 E*/pi sqrt(d/R); displacements are those of a half-space, of every point of it. `hertz_line` is of cylinders.

    It takes a box, a cylinder pressed on an end, or a rectangle beside x = 0 in `axisymmetric`;
    one rigid body that is `displaced` toward it, or stays; and a far face that is fixed, or held along its normal.
    `symmetric` planes may go through the axis. A law of large strain has its small-strain moduli. By how much the force
    may be off for a depth that is not small, for the thickness and for free sides is in the report (`off`), and said
    with every answer beyond 5 %; half the thickness or the width is refused. Metrics `displacement`, `force`,
    `contact_area`, `contact_pressure` and `pressure_along` may be held against it.
    Source: Hertz 1882, J. reine angew. Math. 92, 156-171; Johnson 1985, Contact mechanics, ch. 4.
    """

    body: Annotated[Any, "body", "the body that is pressed"]

    about: ClassVar[About] = "pressed"
    with_forces: ClassVar[bool] = True
    means: ClassVar[str] = "closed form"
    source: ClassVar[str] = "Hertz 1882, J. reine angew. Math. 92, 156-171; Johnson 1985, Contact mechanics, ch. 4"
    error_meaning: ClassVar[str] = "what a half-space moves where the body ends, m, and rounding"

    def must_hold(self, pressed: Pressed) -> None:
        """Raises Refused where an assumption is broken, as far as a look tells."""
        pressed.must_slip_freely()
        pressed.must_be_shallow()
        if pressed.kind != "sphere":
            other = "hertz_line" if pressed.kind == "cylinder" else "sneddon"
            raise Refused(f"what presses is a {pressed.kind}", f"use `{other}(...)`")
        pressed.must_be_half_space()

    def solve(self, pressed: Pressed) -> HalfSpace:
        """What it says. Raises Refused where an assumption is broken."""
        self.must_hold(pressed)
        return pressed.half_space
