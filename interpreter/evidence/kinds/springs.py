"""What vouches for networks of springs."""

from __future__ import annotations

from typing import TYPE_CHECKING, cast

import numpy as np

from softmark.interpreter.evidence.answer import Answer
from softmark.interpreter.evidence.held import held
from softmark.interpreter.evidence.kinds.solid_forces import LEFT, by_support
from softmark.interpreter.evidence.kinds.voucher import Found, Sized
from softmark.interpreter.evidence.load_check import loads_on
from softmark.interpreter.evidence.probe_answers import ProbeAnswer, Unknown
from softmark.interpreter.evidence.unchecked import Unchecked
from softmark.interpreter.models.answers.carried import Wrench
from softmark.interpreter.models.shared.prepared import Moved
from softmark.solvers.checks import solids
from softmark.solvers.checks.solids import Floats, ForceBalance

if TYPE_CHECKING:
    from softmark.interpreter.models.springs.build import PreparedSprings


class Networks(Sized):
    """Of networks of springs: forces spring by spring, and coarser meshes."""

    holds = True

    def balance(self, found: Found) -> tuple[ForceBalance, float | None]:
        """Of each spring by itself. Raises Unchecked."""
        mesh, inside, outside, noise = self._forces(found)
        balance = solids.balance(inside, outside, held(found.case, mesh), noise, None)
        return balance, found.solution.facts.get("residual")

    def reactions(self, found: Found) -> tuple[dict[str, Wrench], float]:
        """By the same formulas. Raises Unchecked."""
        mesh, inside, outside, noise = self._forces(found)
        x = mesh.points + np.asarray(mesh.displacement, dtype=np.float64)
        return by_support(found.case, mesh, inside - outside, x), LEFT * noise

    def _forces(self, found: Found) -> tuple[Moved, Floats, Floats, float]:
        """The mesh, what springs and what loads do at its nodes (n, 3), N, and the rounding of both; once."""
        if Networks not in found.known:
            built, mesh = cast("PreparedSprings", found.prepared), found.solution.mesh  # at rest, as it says
            if mesh is None:
                raise Unchecked("the displacements of its nodes are not known")
            springs, u = built.springs, np.asarray(mesh.displacement, dtype=np.float64)
            inside, noise = solids.spring_forces(mesh.points, springs.edges, springs.k, u)
            outside, unsure = loads_on(found.case, mesh, u, False, "lumped")
            found.known[Networks] = mesh, inside, outside, noise + unsure / LEFT
        known: tuple[Moved, Floats, Floats, float] = found.known[Networks]
        return known

    def model(self, answer: Answer, seen: ProbeAnswer) -> float:
        """Raises Unknown."""
        raise Unknown("springs are no solid: no estimate of what they cannot do is known")


VOUCHER = Networks()
