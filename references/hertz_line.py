"""Hertz line contact: a rigid cylinder pressed into a strip in plane strain without friction."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.records import dataclass
from softmark.references.reference_base import Reference
from softmark.references.straight_cantilever import NotApplicable

if TYPE_CHECKING:
    from softmark.references.indentation import Indentation
    from softmark.references.line_contact import LineContact


@dataclass(frozen=True)
class HertzLine(Reference):
    """Hertz line contact of a rigid cylinder along z with a strip in plane strain, frictionless: force and pressure.

    Hertz's half-width of contact is sqrt(4 P R / (pi E*)), and the largest pressure 2 P / (pi a), for the force P per
    length, with E* = E / (1 - nu^2). The indentation depth depends on the thickness of the body: the force is computed
    from the travel by the integral equation of a strip, bonded to its base or sliding, with distant sides.
    Displacements of points are not available. The difference of Hertz's pressure from that of the strip is in the
    report (`off`), with the order of the errors of the force by a depth that is not small and by free sides.

    It applies to a rectangle in `plane_strain`, and otherwise to the same cases as `hertz`. It can be compared with the
    metrics `force`, `contact_area`, `contact_pressure` and `pressure_along`.
    Source: Hertz 1882, J. reine angew. Math. 92, 156-171; Johnson 1985, Contact mechanics, 4.2 and 5.8.
    """

    body: Annotated[Any, "body", "the strip"]

    problem_kind: ClassVar[str] = "indentation"
    with_displacements: ClassVar[bool] = False
    means: ClassVar[str] = "integral equation"
    source: ClassVar[str] = "Hertz 1882, J. reine angew. Math. 92, 156-171; Johnson 1985, Contact mechanics, ch. 4"
    error_meaning: ClassVar[str] = "rounding of the indentation depth at the given force, m"

    def must_hold(self, pressed: Indentation) -> None:
        """Raise NotApplicable if the case violates an assumption of the theory; checked before solving."""
        pressed.must_slip_freely()
        pressed.must_be_shallow()
        if pressed.kind != "cylinder":
            raise NotApplicable(f"the indenter is a {pressed.kind}", "use `hertz(...)` or `sneddon(...)`")
        if pressed.slice is None:
            raise NotApplicable(
                "a cylinder indents a body that is not in plane strain", "use `plane_strain(...)`, or a sphere"
            )
        pressed.must_be_wide()

    def solve(self, pressed: Indentation) -> LineContact:
        """Return the solution. Raises NotApplicable if the case violates an assumption."""
        from softmark.references.line_contact import solve_line_contact

        self.must_hold(pressed)
        return solve_line_contact(pressed)
