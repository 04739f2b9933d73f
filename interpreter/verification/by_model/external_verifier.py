"""Verifier of external solvers: forces of their displacements by our formulas; no error estimate."""

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
    """Return the solution as if our finite elements had found it."""
    return replace(found, declared=replace(found.declared, thing=found.declared.thing.solid))


class ExternalVerifier(Verifier):
    """Verifier of finite elements that another program solved."""

    def facts(self, found: VerifiedSolution) -> dict[str, Any]:
        """Return the same facts as for our elements."""
        return solid_verifier.VERIFIER.facts(as_own_solution(found))

    def balance(self, found: VerifiedSolution) -> tuple[ForceBalance, float | None]:
        """Compute the force balance by the same formulas. Raises NoIndependentFormula."""
        return solid_verifier.VERIFIER.balance(as_own_solution(found))

    def reactions(self, found: VerifiedSolution) -> tuple[dict[str, Wrench], float]:
        """Compute the reactions by the same formulas. Raises NoIndependentFormula."""
        return solid_verifier.VERIFIER.reactions(as_own_solution(found))

    def discretisation(self, answer: SolutionUnderTest, seen: ProbeResultUnderTest) -> float:
        """Raise NoErrorEstimate: there is no error estimate."""
        raise NoErrorEstimate(UNCHECKED)

    def model(self, answer: SolutionUnderTest, seen: ProbeResultUnderTest) -> float:
        """Raise NoErrorEstimate: there is no error estimate."""
        raise NoErrorEstimate(UNCHECKED)


VERIFIER = ExternalVerifier()
