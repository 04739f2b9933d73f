"""Hertz contact: frictionless indentation of a body by a rigid sphere."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.records import dataclass
from softmark.references.reference_base import Reference
from softmark.references.straight_cantilever import NotApplicable

if TYPE_CHECKING:
    from softmark.references.half_space_indentation import HalfSpace
    from softmark.references.indentation import Indentation


@dataclass(frozen=True)
class Hertz(Reference):
    """Hertz contact of a rigid sphere with a face, without friction: force, area, pressure and displacements.

    With E* = E / (1 - nu^2): contact radius sqrt(R d), force 4/3 E* sqrt(R) d^(3/2), largest pressure 2 E*/pi
    sqrt(d/R); displacements are those of a half-space, at every point. `hertz_line` is for cylinders.

    It applies to a box, a cylinder pressed on an end, or a rectangle at x = 0 in `axisymmetric`; one rigid body that is
    `displaced` toward it, or fixed; and a far face that is fixed, or held along its normal. `symmetric` planes may
    contain the axis. A law of large strain uses its small-strain moduli. The errors of the force by a depth that is not
    small, by the thickness and by free sides are in the report (`off`), and reported with every result beyond 5 %; half
    the thickness or the width is refused. It can be compared with the metrics `displacement`, `force`, `contact_area`,
    `contact_pressure` and `pressure_along`.
    Source: Hertz 1882, J. reine angew. Math. 92, 156-171; Johnson 1985, Contact mechanics, ch. 4.
    """

    body: Annotated[Any, "body", "deformable body that is indented"]

    problem_kind: ClassVar[str] = "indentation"
    means: ClassVar[str] = "closed form"
    source: ClassVar[str] = "Hertz 1882, J. reine angew. Math. 92, 156-171; Johnson 1985, Contact mechanics, ch. 4"
    error_meaning: ClassVar[str] = "displacement of the half-space at the borders of the body, m, and rounding"

    def must_hold(self, pressed: Indentation) -> None:
        """Raise NotApplicable if the case violates an assumption of the theory; checked before solving."""
        pressed.must_slip_freely()
        pressed.must_be_shallow()
        if pressed.kind != "sphere":
            other = "hertz_line" if pressed.kind == "cylinder" else "sneddon"
            raise NotApplicable(f"the indenter is a {pressed.kind}", f"use `{other}(...)`")
        pressed.must_be_half_space()

    def solve(self, pressed: Indentation) -> HalfSpace:
        """Return the solution. Raises NotApplicable if the case violates an assumption."""
        self.must_hold(pressed)
        return pressed.half_space
