"""What beams with a curved axis cannot do, and what the theory of slender rods leaves out of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from softmark.interpreter.language.messages import diagnostic
from softmark.interpreter.vocabulary.analyses import Dynamic
from softmark.interpreter.vocabulary.loads import AtPoint, PerArea, PerMass
from softmark.solvers.mesh.shape import Prism

if TYPE_CHECKING:
    from softmark.grammar.diagnostic import Diagnostic
    from softmark.interpreter.language.scene import Declared
    from softmark.interpreter.problem.case import Case
    from softmark.solvers.mesh.shape import Swept

HELP = "curved beams come to rest under gravity, traction on an end and forces on the axis; `fem(...)` takes all"


def refusals(declared: Declared, case: Case) -> list[Diagnostic]:
    """What of a case is known of straight beams alone, where this one is curved."""
    if isinstance(case.shape, Prism):
        return []
    found = []
    if isinstance(case.analysis, Dynamic):
        found.append(_refused(declared, declared, "has no motion"))
    for load in case.loads:
        if not isinstance(load.thing.action, PerMass | PerArea | AtPoint):
            found.append(_refused(declared, load, f"does not take the load `{load.name}`"))
    for support in case.supports:
        if type(support.thing).__name__ not in ("Fixed", "Displaced"):
            found.append(_refused(declared, support, f"does not take the support `{support.name}`"))
    return found


def _refused(declared: Declared, at: Declared, what: str) -> Diagnostic:
    problem = f"the axis of the body is curved, and of curved axes `{declared.name}` {what}"
    return diagnostic("E317", at.at(), problem, "straight beams only", HELP)
