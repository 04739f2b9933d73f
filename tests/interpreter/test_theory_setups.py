"""The setups of theories: one class for each kind of problem, registered by name."""

from __future__ import annotations

from importlib import import_module

import pytest

from softmark.interpreter.problem import theories
from softmark.interpreter.problem.theories import THEORIES
from softmark.interpreter.problem.theories.theory_setup import TheorySetup
from softmark.references import REFERENCES


@pytest.mark.parametrize("kind", THEORIES)
def test_a_kind_of_problem_names_its_class(kind: str) -> None:
    module, name = THEORIES[kind].split(":")
    found = getattr(import_module(f"{theories.__name__}.{module}"), name)
    assert issubclass(found, TheorySetup)
    assert found.problem_from is not TheorySetup.problem_from


def test_every_solved_reference_names_a_kind_of_problem() -> None:
    assert {cls.problem_kind for cls in REFERENCES.values() if cls.how == "solved"} == set(THEORIES)
