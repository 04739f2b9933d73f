"""Mandel's problem: a porous slab between rigid plates, with open sides."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.records import dataclass
from softmark.references.diffusion_modes import require_convergence
from softmark.references.reference_base import Reference

if TYPE_CHECKING:
    from softmark.references.poroelastic_compression import CompressedPorousBody


@dataclass(frozen=True)
class Mandel(Reference):
    """A saturated porous slab in plane strain between two rigid frictionless plates, with open sides.

    Fluid leaves at the sides first. The sides soften, and the middle carries more of the force. The pressure in the
    middle therefore first rises above its initial value, by 10 % for a skeleton of `poisson = 0.2`, and then falls. No
    theory of diffusion alone predicts this (the Mandel-Cryer effect). The solution is a sum over modes, for small
    strain, incompressible fluid and solid, and any amplitude of the force or of the plate displacement. The body is a
    rectangle as `plane_strain(...)`, or a box held across one direction, of one `biphasic(...)` material. One side is
    held as a plane of symmetry and the other is `drained`. One plate is held along its normal; the other is displaced
    along it, or kept `rigid_plate(...)` under a `traction`. The analysis is `quasistatic`. The metrics
    `displacement`, `force`, `pore_pressure` and `outflow` can be compared with the theory.
    Source: Mandel 1953, Geotechnique 3:287; Abousleiman, Cheng, Cui, Detournay and Roegiers 1996, Geotechnique 46:187.
    """

    body: Annotated[Any, "body", "the slab"]

    problem_kind: ClassVar[str] = "porous_slab"
    means: ClassVar[str] = "closed form"
    source: ClassVar[str] = "Mandel 1953, Geotechnique 3:287; Abousleiman et al. 1996, Geotechnique 46:187"
    error_meaning: ClassVar[str] = "omitted modes and rounding of the displacement, m"

    def solve(self, slab: CompressedPorousBody) -> CompressedPorousBody:
        """Return the slab itself, whose class contains the sums over modes. Raises NotSolved just after a jump."""
        require_convergence(slab.driven, slab.now, slab.time)
        return slab
