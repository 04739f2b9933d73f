"""A porous slab between rigid plates, its sides open: Mandel's problem."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.records import dataclass
from softmark.references.diffusion_modes import require_convergence
from softmark.references.reference_base import About, Reference

if TYPE_CHECKING:
    from softmark.references.poroelastic_compression import Squeezed


@dataclass(frozen=True)
class Mandel(Reference):
    """A saturated porous slab in plane strain, pressed between two rigid plates without friction, its sides open.

    The fluid at the sides leaves first and they soften, so that the middle carries more: under a force its pressure
    rises above what it is at once before it falls, by 10 % of a skeleton of `poisson = 0.2`, as no theory of diffusion
    alone has it (the Mandel-Cryer effect). Imposed, the travel of that force has the same effect. A sum over modes for
    any course of the force or of the travel; in small strain, fluid and solid keep their volumes. It takes a rectangle
    as `plane_strain(...)`, or a box held across one direction, of one `biphasic(...)` material; one side held as a
    plane of symmetry and the other `drained`; one plate held along its normal, the other displaced along it or kept
    `level(...)` under a `traction`; and a `quasistatic` analysis. Metrics `displacement`, `force`, `pore_pressure` and
    `outflow` may be held against it.
    Source: Mandel 1953, Geotechnique 3:287; Abousleiman, Cheng, Cui, Detournay and Roegiers 1996, Geotechnique 46:187.
    """

    body: Annotated[Any, "body", "the slab"]

    about: ClassVar[About] = "slab"
    with_forces: ClassVar[bool] = True
    means: ClassVar[str] = "closed form"
    source: ClassVar[str] = "Mandel 1953, Geotechnique 3:287; Abousleiman et al. 1996, Geotechnique 46:187"
    error_meaning: ClassVar[str] = "modes that are left out, and rounding of the displacement, m"

    def solve(self, slab: Squeezed) -> Squeezed:
        """What it says: the sums are those of the slab itself. Raises NotSolved just after a jump."""
        require_convergence(slab.driven, slab.now, slab.time)
        return slab
