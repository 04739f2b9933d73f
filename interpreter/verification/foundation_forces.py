"""Independent forces of elastic foundations, by line sweeps as for loads (facet_sweep.py).

The solver multiplies nodal displacements by integrals over facets. Here the traction at every sample point is computed
from the displacement there, and its force is distributed to the nodes.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from softmark.interpreter.verification.facet_sweep import MOST_UNSURE, sample_facets, select_facets
from softmark.interpreter.verification.unverified_model_error import NoIndependentFormula
from softmark.records import dataclass
from softmark.solvers.independent_forces import solid_forces
from softmark.solvers.independent_forces.solid_forces import Floats, Ints

if TYPE_CHECKING:
    from softmark.interpreter.language.coordinate_conditions import Condition
    from softmark.interpreter.models.shared.prepared_model import DeformedMesh
    from softmark.interpreter.problem.body_case import Case


def foundation_forces(case: Case, mesh: DeformedMesh, u: Floats) -> tuple[dict[str, Floats], float]:
    """Return nodal forces (n, 3), N, of every foundation by name, and their uncertainty, N.

    Raises NoIndependentFormula.
    """
    found, unsure = {}, 0.0
    check = IndependentSurfaceSprings(case, mesh, u)
    for bed in case.beds:
        found[bed.name], left = bed.thing.springs(check)
        if left > MOST_UNSURE * float(np.abs(found[bed.name]).sum()):
            raise NoIndependentFormula(
                "the border of the surface on the foundation is too complex to be integrated independently"
            )
        unsure += left
    return found, unsure


@dataclass(frozen=True)
class IndependentSurfaceSprings:
    """Operations from which supports compute their nodal forces (n, 3), N, and their uncertainty, N.

    `u` (n, 3), m, are the displacements of the nodes.
    """

    case: Case
    mesh: DeformedMesh
    u: Floats

    def distributed_springs(
        self, where: Condition, stiffness: float, damping: float, normal: bool
    ) -> tuple[Floats, float]:
        """Return the forces at rest of springs, Pa/m, per undeformed area; with `normal` only along the normal."""
        total, unsure = np.zeros_like(self.u), 0.0
        for whole, parts, (open_facets, left) in select_facets(where, self.case, self.mesh.mesh):
            for facets, xi, w in (*sample_facets(whole), parts):
                total += self._spring_forces(stiffness, normal, facets, xi, w)
            middle = np.full((len(open_facets), 2), 0.25)
            unsure += float(np.abs(self._spring_forces(stiffness, normal, open_facets, middle, left)).sum())
        return total, unsure

    def plane_keeping_springs(self, where: Condition) -> tuple[Floats, float]:
        """Return the forces of springs between a face and its mean plane, as of a rigid plate.

        The mean displacement is computed first, and then the force at each point.
        """
        from softmark.interpreter.models.shared.foundation_setup import plate_stiffness

        case, mesh, u = self.case, self.mesh, self.u
        pieces = [
            p for whole, parts, _ in select_facets(where, case, mesh.mesh) for p in (*sample_facets(whole), parts)
        ]

        def total(value: Callable[[Floats, Floats], Floats]) -> Floats:
            """Return the sum over all points of a function of their displacements (p, 3), m, and areas (p, 3), m^2."""
            found = np.zeros_like(u)
            for facets, xi, w in pieces:
                found += solid_forces.part_forces(
                    mesh.points, facets, xi, w, partial(value, _point_displacements(facets, xi, u)), case.depth
                )
            return found

        whole = total(lambda moved, dA: dA).sum(axis=0)
        area = float(np.linalg.norm(whole))
        n = whole / area
        mean = float(total(lambda moved, dA: (moved @ n)[:, None] * dA).sum(axis=0) @ n) / area
        stiff = plate_stiffness(case, mesh.mesh, area)
        return total(lambda moved, dA: -stiff * ((moved @ n) - mean)[:, None] * dA), 0.0

    def _spring_forces(self, stiffness: float, normal: bool, facets: Ints, xi: Floats, w: Floats) -> Floats:
        """Return nodal spring forces (n, 3), N, of quadrature points on facets (p, k).

        The points have weights w (p,) and local coordinates xi (p, 2).
        """
        moved = _point_displacements(facets, xi, self.u)

        def push(dA: Floats) -> Floats:
            size = np.linalg.norm(dA, axis=1, keepdims=True)
            way = moved
            if normal:
                n = dA / size
                way = n * (n * moved).sum(axis=1, keepdims=True)
            force: Floats = -stiffness * size * way
            return force

        return solid_forces.part_forces(self.mesh.points, facets, xi, w, push, self.case.depth)


def _point_displacements(facets: Ints, xi: Floats, u: Floats) -> Floats:
    """Return displacements (p, 3), m, of points at local coordinates xi (p, 2) of facets (p, k)."""
    found: Floats = (solid_forces.shape_functions(facets.shape[1], xi)[:, :, None] * u[facets]).sum(axis=1)
    return found
