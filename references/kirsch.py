"""Theory of a plate with a circular hole under remote tension."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.records import dataclass
from softmark.references.reference_base import Reference

if TYPE_CHECKING:
    from softmark.references.inclusion import BodyWithRoundCore


@dataclass(frozen=True)
class Kirsch(Reference):
    """A plate with a circular hole under remote in-plane load: displacement, stress and strain.

    In an unbounded plate under tension along x the stress at the hole is three times the remote stress at y = a, and
    minus it at x = a. The body of a scene is finite, so this is the exact solution of the finite ring, with tractions
    of the uniform stress on its outer circle: the same functions of the radius, with one more that vanishes if the ring
    is large. The difference of the stress at the hole from that in an unbounded plate is in the report (`size_matters`,
    relative to the remote stress): 9 times the square of the ratio of the radii, so that 1 % needs a ring of thirty
    times its hole.

    It applies to a `quarter_ring` of two circles in `plane_strain` or `plane_stress`, of one `linear_elastic` solid,
    held by `symmetric` on both straight sides and loaded by `remote_stress` or `pressure` on all of its outer circle
    and by nothing else. It can be compared with metrics of displacements, `stress`, `strain` and `stretch`.
    Source: Kirsch 1898, Z. VDI 42, 797-807; Timoshenko and Goodier 1970, sections 32 to 35.
    """

    body: Annotated[Any, "body", "plate with its hole"]

    problem_kind: ClassVar[str] = "hole"
    means: ClassVar[str] = "closed form"
    source: ClassVar[str] = "Kirsch 1898, Z. VDI 42, 797-807; Timoshenko and Goodier 1970, sections 32 to 35"
    error_meaning: ClassVar[str] = "rounding of the displacement, m: the formula solves its equations exactly"

    def solve(self, core: BodyWithRoundCore) -> BodyWithRoundCore:
        """Return the body itself, whose class contains the closed-form solution."""
        return core
