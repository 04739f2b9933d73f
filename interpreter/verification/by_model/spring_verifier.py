"""Verifier of spring networks."""

from __future__ import annotations

from typing import TYPE_CHECKING, cast

import numpy as np

from softmark.interpreter.models.postprocessing.nodal_forces import Wrench
from softmark.interpreter.models.shared.prepared_model import DeformedMesh
from softmark.interpreter.verification.by_model.solid_forces_check import LEFT, residuals_by_support
from softmark.interpreter.verification.by_model.verifier import SizedMeshVerifier, VerifiedSolution
from softmark.interpreter.verification.load_forces_check import load_forces
from softmark.interpreter.verification.probe_errors import NoErrorEstimate, ProbeResultUnderTest
from softmark.interpreter.verification.solution_under_test import SolutionUnderTest
from softmark.interpreter.verification.support_reactions_check import held_components
from softmark.interpreter.verification.unverified_model_error import NoIndependentFormula
from softmark.solvers.independent_forces import solid_forces
from softmark.solvers.independent_forces.solid_forces import Floats, ForceBalance

if TYPE_CHECKING:
    from softmark.interpreter.models.spring_network.spring_builder import PreparedSprings


class SpringVerifier(SizedMeshVerifier):
    """Verifier of spring networks: sums the forces of single springs, and solves coarser meshes."""

    holds = True

    def balance(self, found: VerifiedSolution) -> tuple[ForceBalance, float | None]:
        """Compute the force balance from each spring separately. Raises NoIndependentFormula."""
        mesh, inside, outside, noise = self._mesh_and_nodal_forces(found)
        balance = solid_forces.force_balance(inside, outside, held_components(found.case, mesh), noise, None)
        return balance, found.solution.facts.get("residual")

    def reactions(self, found: VerifiedSolution) -> tuple[dict[str, Wrench], float]:
        """Compute the reactions from the forces of single springs. Raises NoIndependentFormula."""
        mesh, inside, outside, noise = self._mesh_and_nodal_forces(found)
        x = mesh.points + np.asarray(mesh.displacement, dtype=np.float64)
        return residuals_by_support(found.case, mesh, inside - outside, x), LEFT * noise

    def _mesh_and_nodal_forces(self, found: VerifiedSolution) -> tuple[DeformedMesh, Floats, Floats, float]:
        """Return the mesh, nodal forces of springs and of loads (n, 3), N, and their rounding; computed once."""
        if SpringVerifier not in found.known:
            built, mesh = cast("PreparedSprings", found.prepared), found.solution.mesh  # at rest, as it says
            if mesh is None:
                raise NoIndependentFormula("the nodal displacements are not known")
            springs, u = built.springs, np.asarray(mesh.displacement, dtype=np.float64)
            inside, noise = solid_forces.spring_forces(mesh.points, springs.edges, springs.k, u)
            outside, unsure = load_forces(found.case, mesh, u, False, "lumped")
            found.known[SpringVerifier] = mesh, inside, outside, noise + unsure / LEFT
        known: tuple[DeformedMesh, Floats, Floats, float] = found.known[SpringVerifier]
        return known

    def model(self, answer: SolutionUnderTest, seen: ProbeResultUnderTest) -> float:
        """Raise NoErrorEstimate: the model error is not known."""
        raise NoErrorEstimate("the modelling error of a spring network cannot be estimated")


VERIFIER = SpringVerifier()
