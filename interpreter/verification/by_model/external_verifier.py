"""Verifier of external solvers: it applies softmark's force formulas to their displacements, but estimates no error."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from softmark.interpreter.models.postprocessing.nodal_forces import Wrench
from softmark.interpreter.verification.by_model import solid_verifier
from softmark.interpreter.verification.by_model.verifier import VerifiedSolution, Verifier
from softmark.interpreter.verification.probe_errors import NoErrorEstimate, ProbeResultUnderTest
from softmark.interpreter.verification.solution_under_test import SolutionUnderTest
from softmark.solvers.independent_forces.solid_forces import ForceBalance

UNCHECKED = "an external program solved it: use the stated error of `fem(...)` with the same element and size"


def as_own_solution(found: VerifiedSolution) -> VerifiedSolution:
    """Return the solution of an external program in the form of a solution by softmark's own finite elements."""
    return replace(found, declared=replace(found.declared, thing=found.declared.thing.solid))


class ExternalVerifier(Verifier):
    """Verifier of finite element solutions that another program computed."""

    def facts(self, found: VerifiedSolution) -> dict[str, Any]:
        """Return the facts that softmark's own finite elements report about such a solution."""
        return solid_verifier.VERIFIER.facts(as_own_solution(found))

    def balance(self, found: VerifiedSolution) -> tuple[ForceBalance, float | None]:
        """Compute the force balance by the formulas for softmark's own finite elements. Raises NoIndependentFormula."""
        return solid_verifier.VERIFIER.balance(as_own_solution(found))

    def reactions(self, found: VerifiedSolution) -> tuple[dict[str, Wrench], float]:
        """Compute the reactions by the formulas for softmark's own finite elements. Raises NoIndependentFormula."""
        return solid_verifier.VERIFIER.reactions(as_own_solution(found))

    def discretisation(self, answer: SolutionUnderTest, seen: ProbeResultUnderTest) -> float:
        """Raise NoErrorEstimate: the discretisation error of an external solver is not estimated."""
        raise NoErrorEstimate(UNCHECKED)

    def model(self, answer: SolutionUnderTest, seen: ProbeResultUnderTest) -> float:
        """Raise NoErrorEstimate: the model error of an external solver is not estimated."""
        raise NoErrorEstimate(UNCHECKED)


VERIFIER = ExternalVerifier()
