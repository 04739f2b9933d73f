"""Sneddon's contact: frictionless indentation by a rigid cone or flat punch."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.records import dataclass
from softmark.references.reference_base import Reference
from softmark.references.straight_cantilever import NotApplicable

if TYPE_CHECKING:
    from softmark.references.half_space_indentation import HalfSpace
    from softmark.references.indentation import Indentation


@dataclass(frozen=True)
class Sneddon(Reference):
    """Sneddon's contact of a rigid cone or flat round punch with a face, without friction: force, displacements.

    With E* = E / (1 - nu^2) and the angle between the axis and the side of the cone: force 2/pi E* tan(angle) d^2,
    contact radius 2/pi tan(angle) d; for a punch 2 a E* d. Pressure is unbounded under the tip and at the edge: the
    largest is not available. Displacements are those of a half-space, at every point.

    It applies to the same cases as `hertz`, with one rigid cone or flat round punch whose axis is normal to the face.
    Sharp cones cause large strain; this error of the force is not in the report, others are (`off`). It can be compared
    with the metrics `displacement`, `force`, `contact_area` and, away from the tip and the edge, `pressure_along`.
    Source: Sneddon 1965, Int. J. Eng. Sci. 3, 47-57; Boussinesq 1885; Love 1939, Quart. J. Math. 10, 161.
    """

    body: Annotated[Any, "body", "deformable body that is indented"]

    problem_kind: ClassVar[str] = "indentation"
    means: ClassVar[str] = "closed form"
    source: ClassVar[str] = "Sneddon 1965, Int. J. Eng. Sci. 3, 47-57"
    error_meaning: ClassVar[str] = "displacement of the half-space at the borders of the body, m, and rounding"

    def must_hold(self, pressed: Indentation) -> None:
        """Raise NotApplicable if the case violates an assumption of the theory."""
        pressed.must_slip_freely()
        if pressed.kind not in ("cone", "punch"):
            raise NotApplicable(f"the indenter is a {pressed.kind}", "use `hertz(...)`")
        pressed.must_be_half_space()

    def solve(self, pressed: Indentation) -> HalfSpace:
        """Return the solution. Raises NotApplicable if the case violates an assumption."""
        self.must_hold(pressed)
        return pressed.half_space
