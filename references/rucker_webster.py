"""Tendon-driven rod: a clamped beam bent and twisted by tendons on any route, with its weight."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.records import dataclass
from softmark.references.reference_base import Reference

if TYPE_CHECKING:
    from softmark.references.tendon_driven_rod import DrivenRod, DrivenRodSolution


@dataclass(frozen=True)
class RuckerWebster(Reference):
    """A clamped beam bent and twisted by tendons, geometrically exact in space: the theory of tendon-driven robots.

    The rod of Simo and Reissner, with bending, torsion, shear and stretch, and frictionless strings that push where
    they are curved and pull where they end, in one set of differential equations; solved by collocation to 1e-7 of its
    residual (`scipy.integrate.solve_bvp`), from no load to the full one. A straight tendon at a distance d gives the
    uniform curvature T d / (E I). It applies to a straight cylinder, tube or box, one whole end of it `fixed`, under
    `tendon`s, `gravity` in any direction and a `point_force` at the centre of the free end, at rest.
    Source: Rucker and Webster 2011, Statics and Dynamics of Continuum Robots With General Tendon Routing and External
    Loading, IEEE Trans. Robot. 27, 1033-1044.
    """

    body: Annotated[Any, "body", "straight beam, clamped at one end, bent by tendons"]

    problem_kind: ClassVar[str] = "tendon_rod"
    means: ClassVar[str] = "ordinary differential equation"
    source: ClassVar[str] = "Rucker and Webster 2011, IEEE Trans. Robot. 27, 1033-1044"
    error_meaning: ClassVar[str] = (
        "numerical error of the displacement, m: the change from steps twice as long, plus rounding"
    )

    def solve(self, rod: DrivenRod) -> DrivenRodSolution:
        """Return the rod in equilibrium.

        Raises NotApplicable, and NotSolved if the load cannot be increased further.
        """
        from softmark.references.tendon_driven_rod import solve_driven_rod

        return solve_driven_rod(rod)
