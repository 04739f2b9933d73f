"""A porous disc between rigid plates, open around: unconfined compression."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.records import dataclass
from softmark.references.diffusion_modes import require_convergence
from softmark.references.reference_base import About, Reference

if TYPE_CHECKING:
    from softmark.references.poroelastic_compression import Squeezed


@dataclass(frozen=True)
class Unconfined(Reference):
    """A saturated porous disc, pressed between two rigid plates without friction, open all around: cartilage's test.

    At once it is incompressible, three times the shear modulus stiff, and as fluid leaves it comes down to Young's
    modulus of the drained skeleton. A sum over modes for any course of the travel (relaxation) or of the force (creep);
    in small strain, fluid and solid keep their volumes. It takes a whole `cylinder`, or a rectangle that turns
    (`axisymmetric`), of one `biphasic(...)` material, `drained` all around; one plate held along the axis, the other
    displaced along it or kept `level(...)` under a `traction`; and a `quasistatic` analysis. Metrics `displacement`,
    `force`, `pore_pressure` and `outflow` may be held against it.
    Source: Armstrong, Lai and Mow 1984, J. Biomech. Eng. 106:165.
    """

    body: Annotated[Any, "body", "the disc"]

    about: ClassVar[About] = "disc"
    with_forces: ClassVar[bool] = True
    means: ClassVar[str] = "closed form"
    source: ClassVar[str] = "Armstrong, Lai and Mow 1984, J. Biomech. Eng. 106:165"
    error_meaning: ClassVar[str] = "modes that are left out, and rounding of the displacement, m"

    def solve(self, disc: Squeezed) -> Squeezed:
        """What it says: the sums are those of the disc itself. Raises NotSolved just after a jump."""
        require_convergence(disc.driven, disc.now, disc.time)
        return disc
