"""Theory of a spherical inclusion or cavity in a matrix under remote tension."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.records import dataclass
from softmark.references.reference_base import Reference

if TYPE_CHECKING:
    from softmark.references.inclusion import BodyWithRoundCore


@dataclass(frozen=True)
class Goodier(Reference):
    """A spherical inclusion, or a cavity, in a matrix under remote load: displacement, stress and strain.

    In an unbounded matrix the stress in an inclusion is uniform (Eshelby 1957), and at a cavity it is 3 (9 - 5 nu) / (2
    (7 - 5 nu)) times the remote stress. The body of a scene is finite, so this is the exact solution of the finite
    sphere, with tractions of the uniform stress on its outer surface: the same functions of the radius, with two more
    that vanish if the sphere is large. The difference of the stress at the border of the inclusion from that in an
    unbounded matrix is in the report (`size_matters`, relative to the remote stress): six times the cube of the ratio
    of the radii for a cavity, so that 1 % needs a sphere of nine times its radius.

    It applies to the octant of a `sphere` with one part `x^2 + y^2 + z^2 <= a^2` around its centre, that of a
    `spherical_shell`, or a `quarter_ring` of two circles as a body of revolution; of bonded `linear_elastic` solids,
    held by `symmetric` on all its planes and loaded by `remote_stress` or `pressure` on all of its outer surface and by
    nothing else. It can be compared with metrics of displacements, `stress`, `strain` and `stretch`.
    Source: Goodier 1933, Trans. ASME 55, 39-44; Eshelby 1957, Proc. R. Soc. A 241, 376-396.
    """

    body: Annotated[Any, "body", "sphere with its inclusion or cavity"]

    problem_kind: ClassVar[str] = "inclusion"
    means: ClassVar[str] = "closed form"
    source: ClassVar[str] = "Goodier 1933, Trans. ASME 55, 39-44; Eshelby 1957, Proc. R. Soc. A 241, 376-396"
    error_meaning: ClassVar[str] = "rounding of the displacement, m: the formula solves its equations exactly"

    def solve(self, core: BodyWithRoundCore) -> BodyWithRoundCore:
        """Return the body itself, whose class contains the closed-form solution."""
        return core
