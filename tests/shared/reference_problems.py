"""What the reference `told` of a scene is solved for, and why it does not hold."""

from __future__ import annotations

from typing import Any

import pytest

import softmark
from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.problem.body_case import Case, case_of
from softmark.interpreter.problem.theories.reference_solution import problem_of


def case(text: str) -> tuple[Declared, Case]:
    """The reference, and the case of its body."""
    scene = softmark.loads("softmark 1\n" + text).scene
    reference = scene.declared["told"]
    return reference, case_of(scene, reference.value("body"))


def problem(text: str) -> Any:
    """What it is solved for."""
    return problem_of(*case(text))


def refused(text: str) -> str:
    """Why it does not hold for a scene."""
    with pytest.raises(softmark.SceneError) as failure:
        softmark.loads("softmark 1\n" + text)
    said = [d for d in failure.value.diagnostics if d.code == "E503"]
    assert len(said) == 1, failure.value
    return said[0].message
