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
    """Hertz contact of a rigid sphere with a flat face, without friction: force, area, pressure and displacements.

    Use it for a body that is a box, a cylinder pressed on an end, or a rectangle at x = 0 in `axisymmetric`. One
    rigid sphere is in contact; it is `displaced` toward the body, or fixed. The far face is fixed, or held along
    its normal. Planes with `symmetric` may contain the axis. Compare models by the metrics `displacement`, `force`,
    `contact_area`, `contact_pressure` and `pressure_along`. For a cylinder use `hertz_line`.

    With depth d, radius R and E* = E / (1 - nu^2), the contact radius is sqrt(R d), the force 4/3 E* sqrt(R)
    d^(3/2), and the largest pressure 2 E*/pi sqrt(d/R). The displacements are those of a half-space at every point.
    For a law of large strain, E and nu are its moduli at small strain.

    Limits: the theory holds for a small depth in a thick and wide body. The report gives an estimate of the error
    of the force from each of these three simplifications (`off`); above 5 %, every result carries a warning. A
    contact radius above half of the thickness, or of the distance to a free side, is refused.
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
