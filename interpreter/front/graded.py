"""What cannot be of materials that vary in space, as far as it is known without building anything."""

from __future__ import annotations

from collections.abc import Iterator

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.messages import diagnostic
from softmark.interpreter.language.scene import Scene
from softmark.interpreter.problem.case import Case, Fault, case_for, case_of
from softmark.interpreter.problem.graded import faults, graded, profiles


def unsound(scene: Scene) -> Iterator[Diagnostic]:
    """Constants that are out of their range somewhere in a body."""
    for body in scene.of_kind("body"):
        yield from (found.diagnostic for found in faults(case_of(scene, body)))


def untaken(scene: Scene) -> Iterator[Diagnostic]:
    """Models and references that know a material that is the same everywhere alone."""
    for kind in ("model", "reference"):
        for worker in scene.asked(kind).values():
            if worker.thing.graded or (kind == "reference" and worker.thing.how != "solved"):
                continue
            try:
                case = case_for(scene, worker)
            except Fault:
                continue
            if graded(case):
                names = " and ".join(f"`{name}`" for name in varying(case))
                yield diagnostic("E328" if kind == "model" else "E329", worker.at(),
                                 f"`{worker.name}` knows a material that is the same everywhere, and {names} of"
                                 f" `{case.body.name}` {'vary' if ' and ' in names else 'varies'} in space",
                                 "one value of each constant", _remedy(kind))  # fmt: skip


def varying(case: Case) -> tuple[str, ...]:
    """The constants that vary, of any of its materials."""
    return tuple(dict.fromkeys(name for material in case.materials for name in profiles(material)))


def _remedy(kind: str) -> str:
    if kind == "model":
        return "use `fem(...)`, which takes every constant at its points of integration"
    return "compare with what was measured or published, or with a finer model: `self_converged(...)`"
