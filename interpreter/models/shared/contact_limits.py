"""Checks of models that support contact: analyses, options and materials that exclude contact.

Only scenes with contact import this module.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.models.shared.option_limits import CONTACT_OPTIONS, SELF_CONTACT_OPTIONS
from softmark.interpreter.vocabulary.analysis_words import Dynamic, Static
from softmark.interpreter.vocabulary.self_contact_words import Tied

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Declared
    from softmark.interpreter.problem.body_case import Case


def check_rigid_contact(declared: Declared, case: Case) -> Iterator[Diagnostic]:
    """Yield errors for options, analyses and materials that a model does not support together with rigid contact."""
    touch = case.contacts[0]
    yield from CONTACT_OPTIONS.excluded_value_errors(declared, case, touch.name)
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


def check_self_contact(declared: Declared, case: Case) -> Iterator[Diagnostic]:
    """Yield errors for analyses, options and materials that exclude self-contact or ties."""
    for pair in case.pairs:
        if not (case.has_material_history or case.porous or isinstance(case.analysis, Static | Dynamic)):
            yield _pair_contact_error(pair, f"`{pair.name}` is not supported in `quasistatic(...)` analyses",
                         "not in this analysis", "use `static(...)` or `dynamic(...)`")  # fmt: skip
        elif case.has_material_history or case.porous:
            yield _pair_contact_error(
                pair,
                f"`{pair.name}` does not support viscoelastic or poroelastic bodies",
                "viscoelastic or poroelastic",
                "use `static(...)` or `dynamic(...)`, with an elastic material",
            )
        elif isinstance(pair.thing, Tied) and isinstance(case.analysis, Dynamic):
            yield _pair_contact_error(pair, f"the tie constraint `{pair.name}` works only in static analyses",
                         "not in a dynamic analysis", "use `static(...)`, or make one piece: `union(...)`")  # fmt: skip
        elif isinstance(case.analysis, Dynamic) and declared.thing.iteration_cap is not None:
            yield from SELF_CONTACT_OPTIONS.excluded_value_errors(declared, case, pair.name)
        elif case.planar == "plane_stress":
            yield _pair_contact_error(pair, f"`{pair.name}` does not support plane stress, since the thickness changes",
                         "not in plane stress", "use `plane_strain(...)` or `solid(...)`")  # fmt: skip


def _pair_contact_error(pair: Declared, message: str, label: str, help: str) -> Diagnostic:
    """Return the error E633 at the declaration of a self-contact or tie."""
    return diagnostic("E633", pair.at(), message, label, help)
