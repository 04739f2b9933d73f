"""What vouches for models that other programs solve: their displacements in our formulas, and no error of theirs."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from softmark.interpreter.models.postprocessing.nodal_forces import Wrench
from softmark.interpreter.verification.by_model import solid_verifier
from softmark.interpreter.verification.by_model.verifier import Found, Voucher
from softmark.interpreter.verification.probe_errors import ProbeAnswer, Unknown
from softmark.interpreter.verification.solution_under_test import Answer
from softmark.solvers.independent_forces.solid_forces import ForceBalance

UNCHECKED = "another program solved it: state the error of `fem(...)` of the same element and size"


def ours(found: Found) -> Found:
    """The same as if it were finite elements of ours."""
    return replace(found, declared=replace(found.declared, thing=found.declared.thing.solid))


class Outsiders(Voucher):
    """Of finite elements that another program solved."""

    def facts(self, found: Found) -> dict[str, Any]:
        """As of ours."""
        return solid_verifier.VOUCHER.facts(ours(found))

    def balance(self, found: Found) -> tuple[ForceBalance, float | None]:
        """By the same formulas. Raises Unchecked."""
        return solid_verifier.VOUCHER.balance(ours(found))

    def reactions(self, found: Found) -> tuple[dict[str, Wrench], float]:
        """By the same formulas. Raises Unchecked."""
        return solid_verifier.VOUCHER.reactions(ours(found))

    def discretisation(self, answer: Answer, seen: ProbeAnswer) -> float:
        """Raises Unknown."""
        raise Unknown(UNCHECKED)

    def model(self, answer: Answer, seen: ProbeAnswer) -> float:
        """Raises Unknown."""
        raise Unknown(UNCHECKED)


VOUCHER = Outsiders()
