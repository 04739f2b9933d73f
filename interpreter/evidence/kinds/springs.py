"""What vouches for networks of springs."""

from __future__ import annotations

from typing import TYPE_CHECKING, cast

import numpy as np

from softmark.interpreter.evidence.answer import Answer
from softmark.interpreter.evidence.kinds.solid_forces import LEFT, held
from softmark.interpreter.evidence.kinds.voucher import Found, Sized
from softmark.interpreter.evidence.load_check import Unchecked, loads_on
from softmark.interpreter.evidence.probe_answers import ProbeAnswer, Unknown
from softmark.solvers.checks import solids
from softmark.solvers.checks.solids import ForceBalance

if TYPE_CHECKING:
    from softmark.interpreter.models.springs.build import PreparedSprings


class Networks(Sized):
    """Of networks of springs: forces spring by spring, and coarser meshes."""

    def balance(self, found: Found) -> tuple[ForceBalance, float | None]:
        """Of each spring by itself. Raises Unchecked."""
        built, mesh = cast("PreparedSprings", found.prepared), found.solution.mesh  # at rest: what builds them says so
        if mesh is None:
            raise Unchecked("the displacements of its nodes are not known")
        springs, u = built.springs, np.asarray(mesh.displacement, dtype=np.float64)
        inside, noise = solids.spring_forces(mesh.points, springs.edges, springs.k, u)
        outside, unsure = loads_on(found.case, mesh, u, False, "lumped")
        balance = solids.balance(inside, outside, held(found.case, mesh), noise + unsure / LEFT, None)
        return balance, found.solution.facts.get("residual")

    def model(self, answer: Answer, seen: ProbeAnswer) -> float:
        """Raises Unknown."""
        raise Unknown("springs are no solid: no estimate of what they cannot do is known")


VOUCHER = Networks()
