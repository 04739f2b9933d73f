"""Unconfined compression: a porous disc between rigid plates, with an open side."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.records import dataclass
from softmark.references.diffusion_modes import require_convergence
from softmark.references.reference_base import Reference

if TYPE_CHECKING:
    from softmark.references.poroelastic_compression import CompressedPorousBody


@dataclass(frozen=True)
class Unconfined(Reference):
    """Unconfined compression of a saturated porous disc between two rigid frictionless plates, open all around.

    At first it is incompressible, with three times the shear modulus as stiffness, and as fluid leaves the stiffness
    falls to Young's modulus of the drained skeleton. It is a sum over modes for any amplitude of the travel
    (relaxation) or of the force (creep); in small strain, with incompressible fluid and solid. It applies to a whole
    `cylinder`, or a revolved rectangle (`axisymmetric`), of one `biphasic(...)` material, `drained` all around; one
    plate held along the axis, the other displaced along it or kept `rigid_plate(...)` under a `traction`; and a
    `quasistatic` analysis. It can be compared with the metrics `displacement`, `force`, `pore_pressure` and `outflow`.
    Source: Armstrong, Lai and Mow 1984, J. Biomech. Eng. 106:165.
    """

    body: Annotated[Any, "body", "the disc"]

    problem_kind: ClassVar[str] = "porous_disc"
    means: ClassVar[str] = "closed form"
    source: ClassVar[str] = "Armstrong, Lai and Mow 1984, J. Biomech. Eng. 106:165"
    error_meaning: ClassVar[str] = "omitted modes and rounding of the displacement, m"

    def solve(self, disc: CompressedPorousBody) -> CompressedPorousBody:
        """Return the disc itself, whose class contains the sums over modes. Raises NotSolved just after a jump."""
        require_convergence(disc.driven, disc.now, disc.time)
        return disc
