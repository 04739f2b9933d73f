"""A sphere in a matrix that is pulled from afar."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.records import dataclass
from softmark.references.reference_base import About, Reference

if TYPE_CHECKING:
    from softmark.references.inclusion import RoundCore


@dataclass(frozen=True)
class Goodier(Reference):
    """A spherical inclusion, or a cavity, in a matrix that is pulled from afar: displacement, stress and strain.

    In an unbounded matrix stress within an inclusion is the same everywhere (Eshelby 1957), and beside a cavity it is
    3 (9 - 5 nu) / (2 (7 - 5 nu)) times that from afar. The body of a scene ends somewhere. So what is told is the exact
    solution for the ball that it is, with tractions of the uniform stress on its outer sphere: the same functions of
    the radius, with two more that vanish where the ball is large. How far stress at the border of the inclusion is
    from that in an unbounded matrix is in the report (`size_matters`, relative to the stress from afar): six
    times the cube of the ratio of the radii beside a cavity, so that 1 % takes a ball of nine times its radius.

    It takes the octant of a `sphere` with one part `x^2 + y^2 + z^2 <= a^2` around its centre, that of a
    `spherical_shell`, or a `quarter_ring` of two circles as a body of revolution; of `linear_elastic` solids that are
    bonded, held by `symmetric` on all its planes and loaded by `tension` or `pressure` on all of its outer sphere and
    by nothing else. Metrics of displacements, `stress`, `strain` and `stretch` may be held against it.
    Source: Goodier 1933, Trans. ASME 55, 39-44; Eshelby 1957, Proc. R. Soc. A 241, 376-396.
    """

    body: Annotated[Any, "body", "the ball with its inclusion or its cavity"]

    about: ClassVar[About] = "sphere"
    with_stress: ClassVar[bool] = True
    means: ClassVar[str] = "closed form"
    source: ClassVar[str] = "Goodier 1933, Trans. ASME 55, 39-44; Eshelby 1957, Proc. R. Soc. A 241, 376-396"
    error_meaning: ClassVar[str] = "rounding of the displacement, m: the formula solves its equations exactly"

    def solve(self, core: RoundCore) -> RoundCore:
        """What it says: the closed form is that of the body itself."""
        return core
