"""What vouches for models that other programs solve: their displacements in our formulas, and no error of theirs."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from softmark.interpreter.evidence.answer import Answer
from softmark.interpreter.evidence.kinds import solids
from softmark.interpreter.evidence.kinds.voucher import Found, Voucher
from softmark.interpreter.evidence.probe_answers import ProbeAnswer, Unknown
from softmark.interpreter.models.answers.carried import Wrench
from softmark.solvers.checks.solids import ForceBalance

UNCHECKED = "another program solved it: state the error of `fem(...)` of the same element and size"


def ours(found: Found) -> Found:
    """The same as if it were finite elements of ours."""
    return replace(found, declared=replace(found.declared, thing=found.declared.thing.solid))


class Outsiders(Voucher):
    """Of finite elements that another program solved."""

    def facts(self, found: Found) -> dict[str, Any]:
        """As of ours."""
        return solids.VOUCHER.facts(ours(found))

    def balance(self, found: Found) -> tuple[ForceBalance, float | None]:
        """By the same formulas. Raises Unchecked."""
        return solids.VOUCHER.balance(ours(found))

    def reactions(self, found: Found) -> tuple[dict[str, Wrench], float]:
        """By the same formulas. Raises Unchecked."""
        return solids.VOUCHER.reactions(ours(found))

    def discretisation(self, answer: Answer, seen: ProbeAnswer) -> float:
        """Raises Unknown."""
        raise Unknown(UNCHECKED)

    def model(self, answer: Answer, seen: ProbeAnswer) -> float:
        """Raises Unknown."""
        raise Unknown(UNCHECKED)


VOUCHER = Outsiders()
