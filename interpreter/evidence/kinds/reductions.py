"""What vouches for models reduced from finite elements: they are held against the whole."""

from __future__ import annotations

from typing import Any

from softmark.interpreter.evidence.kinds.solid_forces import balance_of, solved
from softmark.interpreter.evidence.kinds.solids import Solids
from softmark.interpreter.evidence.kinds.voucher import Found
from softmark.interpreter.problem.case import case_for
from softmark.solvers.checks.solids import ForceBalance


class Reductions(Solids):
    """The forces of all elements in the state that a few fields make, and the error of the elements beside it."""

    holds = False

    def facts(self, found: Found) -> dict[str, Any]:
        """None of its own."""
        return {}

    def balance(self, found: Found) -> tuple[ForceBalance, float | None]:
        """That of all the elements in its state, beside what it says of their residual. Raises Unchecked."""
        full, solution = found.scene.declared[found.declared.thing.reduces], found.solution
        reduced = solution.facts.get("reduced") or {}
        state = solved(full.thing, case_for(found.scene, full), solution.mesh)
        return balance_of(state), reduced.get("full_residual")


VOUCHER = Reductions()
