"""What a mesh makes of selections that its cells do not follow: the shares held, and the error that comes of it.

A support holds the nodes that it selects, and so a little less than was asked; with all nodes of the facets and cells
that the selection has a part of, a little more. The answer on this mesh with the selection itself lies between the two,
and how far they are apart is a part of the stated error. Where next to nothing is missed, what is missed is that part.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

from softmark.interpreter.results.reaction_results import SupportResult

if TYPE_CHECKING:
    from softmark.interpreter.models.shared.prepared_model import Prepared
    from softmark.interpreter.models.shared.support_selection import Grip
    from softmark.interpreter.problem.body_case import Case
    from softmark.interpreter.results.reaction_results import EquilibriumForces
    from softmark.interpreter.verification.probe_errors import ProbeAnswer
    from softmark.interpreter.verification.solution_under_test import Answer


def reactions(case: Case, prepared: Prepared, known: EquilibriumForces) -> dict[str, SupportResult]:
    """What a report says of the supports of a model, by name: what of its selection each holds, and what it carries."""
    grips, found = _grips(case, prepared), {}
    for name in (support.name for support in case.named_supports):
        carried, own = None if known.reason is not None else known.reactions[name], grips.get(name)
        held, beyond = (None, 0.0) if own is None else (own.held, own.beyond)
        found[name] = SupportResult(held, beyond, carried, known.reason)
    for name, share in _beds(case, prepared).items():
        found[name] = SupportResult(
            share, 0.0, None if known.reason is not None else known.reactions[name], known.reason
        )
    return found


def selection(whole: Answer) -> dict[str, Callable[[ProbeAnswer], float]]:
    """The part of the stated error that comes of selections; none where all that is selected is held, and no more."""
    grips = _grips(whole.case, whole.prepared)
    left = max((max(1.0 - own.held, own.beyond) for own in grips.values()), default=0.0)
    left = max(left, *(abs(1.0 - share) for share in _beds(whole.case, whole.prepared).values()), 0.0)
    if left == 0.0:
        return {}
    if not any(own.missed for own in grips.values()):
        return {"selection": lambda seen: left * seen.size}
    return {"selection": lambda seen: _apart(whole, seen)}


def _apart(whole: Answer, seen: ProbeAnswer) -> float:
    """How far the same is with everything held that supports select a part of."""
    solution, _ = whole.solved("wide", whole.declared, replace(whole.case, wide=True))
    return seen.apart(seen.of(solution))


def _beds(case: Case, prepared: Prepared) -> dict[str, float]:
    """What share of the area that each bed selects is on it, by name, as far as its shape knows of areas."""
    if prepared.mesh is None or not case.beds:
        return {}
    from softmark.interpreter.problem.surface_selection.exact_surface import select_surface
    from softmark.interpreter.problem.surface_selection.loaded_surface_part import find_loaded_surface
    from softmark.interpreter.problem.surface_selection.region_outline import selected_edge_area

    found = {}
    for bed in case.beds:
        where = bed.thing.where
        if case.planar:
            exact = selected_edge_area(case.shape, where, case.depth)
        else:
            known = select_surface(case.shape, where)
            exact = None if known is None else known[0]
        found[bed.name] = (
            find_loaded_surface(case.shape, prepared.mesh, where).area_of(case.depth) / exact if exact else 1.0
        )
    return found


def _grips(case: Case, prepared: Prepared) -> dict[str, Grip]:
    if prepared.mesh is None:
        return {}
    from softmark.interpreter.models.shared.support_selection import grips

    return grips(case, prepared.mesh)
