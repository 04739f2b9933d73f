"""A plate with a circular hole that is pulled from afar."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.records import dataclass
from softmark.references.reference_base import About, Reference

if TYPE_CHECKING:
    from softmark.references.inclusion import RoundCore


@dataclass(frozen=True)
class Kirsch(Reference):
    """A plate with a circular hole that is pulled in its plane from afar: displacement, stress and strain.

    In an unbounded plate pulled along x the stress around the hole is three times that from afar where y = a, and minus
    that where x = a. The body of a scene ends somewhere. So what is told is the exact solution for the ring that it is,
    with tractions of the uniform stress on its outer circle: the same functions of the radius, with one more that
    vanishes where the ring is large. How far stress at the hole is from that in an unbounded plate is in the report
    (`size_matters`, relative to the stress from afar): 9 times the square of the ratio of the radii, so that 1 % takes
    a ring of thirty times its hole.

    It takes a `quarter_ring` of two circles in `plane_strain` or `plane_stress`, of one `linear_elastic` solid, held by
    `symmetric` on both straight sides and loaded by `tension` or `pressure` on all of its outer circle and by nothing
    else. Metrics of displacements, `stress`, `strain` and `stretch` may be held against it.
    Source: Kirsch 1898, Z. VDI 42, 797-807; Timoshenko and Goodier 1970, sections 32 to 35.
    """

    body: Annotated[Any, "body", "the plate with its hole"]

    about: ClassVar[About] = "hole"
    with_stress: ClassVar[bool] = True
    means: ClassVar[str] = "closed form"
    source: ClassVar[str] = "Kirsch 1898, Z. VDI 42, 797-807; Timoshenko and Goodier 1970, sections 32 to 35"
    error_meaning: ClassVar[str] = "rounding of the displacement, m: the formula solves its equations exactly"

    def solve(self, core: RoundCore) -> RoundCore:
        """What it says: the closed form is that of the body itself."""
        return core
