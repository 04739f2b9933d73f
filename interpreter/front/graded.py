"""What cannot be of materials that vary in space, as far as it is known without building anything."""

from __future__ import annotations

from collections.abc import Iterator

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.messages import diagnostic
from softmark.interpreter.language.scene import Scene
from softmark.interpreter.problem.case import Fault, case_for, case_of
from softmark.interpreter.problem.graded import faults, varying


def unsound(scene: Scene) -> Iterator[Diagnostic]:
    """Constants that are out of their range somewhere in a body."""
    for body in scene.of_kind("body"):
        yield from (found.diagnostic for found in faults(case_of(scene, body)))


def untaken(scene: Scene) -> Iterator[Diagnostic]:
    """Models that know a material that is the same everywhere alone; references say so themselves."""
    for model in scene.asked("model").values():
        if model.thing.graded:
            continue
        try:
            case = case_for(scene, model)
        except Fault:
            continue
        if not case.uniform:
            yield diagnostic("E328", model.at(),
                             f"`{model.name}` knows a material that is the same everywhere, and {varying(case)} in"
                             " space",
                             "one value of each constant",
                             "use `fem(...)`, which takes every constant at its points of integration")  # fmt: skip
