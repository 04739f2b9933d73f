"""Checks of which models, analyses and options support rigid contacts, before anything is built."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.vocabulary.analysis_words import Dynamic

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Declared
    from softmark.interpreter.problem.body_case import Case

LEVERS = {
    "precision": "double",
    "max_linear_iterations": None,
    "max_iterations": None,
    "initial_guess": None,
}  # contacts need models that are solved until they converge


def refusals(model: Any, declared: Declared, case: Case) -> Iterator[Diagnostic]:
    """Yield errors for contacts that the model, its analysis or its options do not support."""
    touch = case.contacts[0]
    if not model.supports_rigid_contact:
        yield diagnostic("E650", touch.at(), f"`{declared.name}` cannot represent the contact `{touch.name}`",
                         "contact not supported", "use `fem(...)`, which supports contact")  # fmt: skip
        return
    for field, only in LEVERS.items():
        if getattr(model, field, only) != only:
            yield diagnostic(
                "E651",
                declared.at(field),
                f"`{declared.name}` must solve states with contact to the tolerance, from rest, in double precision",
                f"not with the contact `{touch.name}`",
                f"remove `{field}`",
            )
    if isinstance(case.analysis, Dynamic):
        return
    if case.analysis.path != "load" or case.analysis.disturbed != "none":
        word = "path" if case.analysis.path != "load" else "disturbed"
        yield diagnostic(
            "E651",
            touch.at(),
            f"contact needs a load that increases step by step, so `{word}` of the analysis cannot be used",
            "not with a contact",
            f"remove `{word}`",
        )
    elif case.has_material_history:
        yield diagnostic("E651", touch.at(), f"`{case.body.name}` is viscoelastic or poroelastic, and "
                                             "contact of such bodies is not supported", "not with a contact",
                         "use an elastic material")  # fmt: skip
