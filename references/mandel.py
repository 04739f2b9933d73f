"""Mandel's problem: a porous slab between rigid plates, with open sides."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.records import dataclass
from softmark.references.diffusion_modes import require_convergence
from softmark.references.reference_base import About, Reference

if TYPE_CHECKING:
    from softmark.references.poroelastic_compression import CompressedPorousBody


@dataclass(frozen=True)
class Mandel(Reference):
    """A saturated porous slab in plane strain between two rigid frictionless plates, with open sides.

    The fluid at the sides leaves first and they soften, so that the middle carries more: under a force its pressure
    first rises above its initial value, by 10 % for a skeleton of `poisson = 0.2`, and then falls, which no theory of
    diffusion alone predicts (the Mandel-Cryer effect). Prescribing the plate displacement that this force causes gives
    the same result. It is a sum over modes for any amplitude of force or travel; in small strain, with incompressible
    fluid and solid. It applies to a rectangle as `plane_strain(...)`, or a box held across one direction, of one
    `biphasic(...)` material; one side held as a plane of symmetry and the other `drained`; one plate held along its
    normal, the other displaced along it or kept `rigid_plate(...)` under a `traction`; and a `quasistatic` analysis.
    It can be compared with the metrics `displacement`, `force`, `pore_pressure` and `outflow`.
    Source: Mandel 1953, Geotechnique 3:287; Abousleiman, Cheng, Cui, Detournay and Roegiers 1996, Geotechnique 46:187.
    """

    body: Annotated[Any, "body", "the slab"]

    about: ClassVar[About] = "slab"
    with_forces: ClassVar[bool] = True
    means: ClassVar[str] = "closed form"
    source: ClassVar[str] = "Mandel 1953, Geotechnique 3:287; Abousleiman et al. 1996, Geotechnique 46:187"
    error_meaning: ClassVar[str] = "omitted modes and rounding of the displacement, m"

    def solve(self, slab: CompressedPorousBody) -> CompressedPorousBody:
        """Return the slab itself, whose class contains the sums over modes. Raises NotSolved just after a jump."""
        require_convergence(slab.driven, slab.now, slab.time)
        return slab
