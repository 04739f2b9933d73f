"""What does not take contacts of a body with itself, and ties: nothing is imported where there is none."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.messages import diagnostic
from softmark.interpreter.vocabulary.analyses import Static

if TYPE_CHECKING:
    from softmark.interpreter.language.scene import Declared
    from softmark.interpreter.problem.case import Case


def refusals(surfaced: bool, declared: Declared, case: Case) -> Iterator[Diagnostic]:
    """Errors for models that are not `surfaced`, and for bodies and analyses with a past or a motion."""
    for pair in case.pairs:
        if not surfaced:
            yield _error(pair, f"`{declared.name}` has no surface that could touch", "no finite elements",
                         "`fem(...)` takes it")  # fmt: skip
        elif case.remembers or case.porous or not isinstance(case.analysis, Static):
            yield _error(pair, f"`{pair.name}` is found at rest alone, of what has no past", "not at rest",
                         "use `static(...)`, and a material without memory or fluid")  # fmt: skip
        elif case.planar == "plane_stress":
            yield _error(pair, f"`{pair.name}` is asked of a plate in plane stress, whose thickness changes",
                         "not in plane stress", "use `plane_strain(...)` or `solid(...)`")  # fmt: skip


def _error(pair: Declared, message: str, label: str, help: str) -> Diagnostic:
    return diagnostic("E633", pair.at(), message, label, help)
