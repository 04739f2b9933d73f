"""Checks of which models and analyses support self-contact and ties. They are imported only if a scene has these."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.vocabulary.analysis_words import Dynamic, Static
from softmark.interpreter.vocabulary.self_contact_words import Tied

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Declared
    from softmark.interpreter.problem.body_case import Case


def refusals(surfaced: bool, declared: Declared, case: Case) -> Iterator[Diagnostic]:
    """Yield errors for self-contact or ties in models without a mesh surface, viscoelastic bodies and dynamics.

    `surfaced` is true if the model has a mesh surface.
    """
    for pair in case.pairs:
        if not surfaced:
            yield _error(pair, f"`{declared.name}` has no surface for contact", "no finite elements",
                         "use `fem(...)`")  # fmt: skip
        elif not (case.has_material_history or case.porous or isinstance(case.analysis, Static | Dynamic)):
            yield _error(pair, f"`{pair.name}` is not supported in `quasistatic(...)` analyses",
                         "not in this analysis", "use `static(...)` or `dynamic(...)`")  # fmt: skip
        elif case.has_material_history or case.porous:
            yield _error(
                pair,
                f"`{pair.name}` does not support viscoelastic or poroelastic bodies",
                "viscoelastic or poroelastic",
                "use `static(...)` or `dynamic(...)`, with an elastic material",
            )
        elif isinstance(pair.thing, Tied) and isinstance(case.analysis, Dynamic):
            yield _error(pair, f"the tie constraint `{pair.name}` works only in static analyses",
                         "not in a dynamic analysis", "use `static(...)`, or make one piece: `union(...)`")  # fmt: skip
        elif isinstance(case.analysis, Dynamic) and declared.thing.iteration_cap is not None:
            yield diagnostic(
                "E651",
                declared.at("max_iterations"),
                f"`{declared.name}` must solve states with contact to the tolerance, from rest, in double precision",
                f"not with the contact `{pair.name}`",
                "remove `max_iterations`",
            )
        elif case.planar == "plane_stress":
            yield _error(pair, f"`{pair.name}` does not support plane stress, since the thickness changes",
                         "not in plane stress", "use `plane_strain(...)` or `solid(...)`")  # fmt: skip


def _error(pair: Declared, message: str, label: str, help: str) -> Diagnostic:
    """Return the error about one self-contact or tie."""
    return diagnostic("E633", pair.at(), message, label, help)
