"""What vouches for networks of springs."""

from __future__ import annotations

from typing import TYPE_CHECKING, cast

import numpy as np

from softmark.interpreter.models.postprocessing.nodal_forces import Wrench
from softmark.interpreter.models.shared.prepared_model import DeformedMesh
from softmark.interpreter.verification.by_model.solid_forces_check import LEFT, by_support
from softmark.interpreter.verification.by_model.verifier import Found, Sized
from softmark.interpreter.verification.load_forces_check import loads_on
from softmark.interpreter.verification.probe_errors import ProbeAnswer, Unknown
from softmark.interpreter.verification.solution_under_test import Answer
from softmark.interpreter.verification.support_reactions_check import held
from softmark.interpreter.verification.unverified_models import Unchecked
from softmark.solvers.independent_forces import solid_forces
from softmark.solvers.independent_forces.solid_forces import Floats, ForceBalance

if TYPE_CHECKING:
    from softmark.interpreter.models.spring_network.spring_builder import PreparedSprings


class Networks(Sized):
    """Of networks of springs: forces spring by spring, and coarser meshes."""

    holds = True

    def balance(self, found: Found) -> tuple[ForceBalance, float | None]:
        """Of each spring by itself. Raises Unchecked."""
        mesh, inside, outside, noise = self._forces(found)
        balance = solid_forces.force_balance(inside, outside, held(found.case, mesh), noise, None)
        return balance, found.solution.facts.get("residual")

    def reactions(self, found: Found) -> tuple[dict[str, Wrench], float]:
        """By the same formulas. Raises Unchecked."""
        mesh, inside, outside, noise = self._forces(found)
        x = mesh.points + np.asarray(mesh.displacement, dtype=np.float64)
        return by_support(found.case, mesh, inside - outside, x), LEFT * noise

    def _forces(self, found: Found) -> tuple[DeformedMesh, Floats, Floats, float]:
        """The mesh, what springs and what loads do at its nodes (n, 3), N, and the rounding of both; once."""
        if Networks not in found.known:
            built, mesh = cast("PreparedSprings", found.prepared), found.solution.mesh  # at rest, as it says
            if mesh is None:
                raise Unchecked("the displacements of its nodes are not known")
            springs, u = built.springs, np.asarray(mesh.displacement, dtype=np.float64)
            inside, noise = solid_forces.spring_forces(mesh.points, springs.edges, springs.k, u)
            outside, unsure = loads_on(found.case, mesh, u, False, "lumped")
            found.known[Networks] = mesh, inside, outside, noise + unsure / LEFT
        known: tuple[DeformedMesh, Floats, Floats, float] = found.known[Networks]
        return known

    def model(self, answer: Answer, seen: ProbeAnswer) -> float:
        """Raises Unknown."""
        raise Unknown("springs are no solid: no estimate of what they cannot do is known")


VOUCHER = Networks()
