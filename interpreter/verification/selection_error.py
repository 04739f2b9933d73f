"""Error of meshes whose cells do not follow the selections of supports.

A support holds the nodes that it selects, so slightly less than the selection. With all nodes of partly selected facets
and cells, it would hold slightly more. The exact answer lies between these two, and their distance is a part of the
stated error. If almost nothing is missed, the missed fraction of the selection is used instead.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

from softmark.interpreter.results.reaction_results import SupportResult

if TYPE_CHECKING:
    from softmark.interpreter.models.shared.prepared_model import Prepared
    from softmark.interpreter.models.shared.support_selection import SupportSelection
    from softmark.interpreter.problem.body_case import Case
    from softmark.interpreter.results.reaction_results import EquilibriumForces
    from softmark.interpreter.verification.probe_errors import ProbeResultUnderTest
    from softmark.interpreter.verification.solution_under_test import SolutionUnderTest


def support_facts(case: Case, prepared: Prepared, known: EquilibriumForces) -> dict[str, SupportResult]:
    """Return facts of a model's supports and foundations, by name: the held fraction of the selection, the reaction."""
    grips, found = _support_selections(case, prepared), {}
    for name in (support.name for support in case.named_supports):
        carried, own = None if known.reason is not None else known.reactions[name], grips.get(name)
        held, beyond = (None, 0.0) if own is None else (own.held, own.beyond)
        found[name] = SupportResult(held, beyond, carried, known.reason)
    for name, share in _foundation_shares(case, prepared).items():
        found[name] = SupportResult(
            share, 0.0, None if known.reason is not None else known.reactions[name], known.reason
        )
    return found


def selection_errors(whole: SolutionUnderTest) -> dict[str, Callable[[ProbeResultUnderTest], float]]:
    """Return the error part due to selections of supports, as {part name: function of a probe result}.

    It is empty if the meshes hold the selections exactly.
    """
    grips = _support_selections(whole.case, whole.prepared)
    left = max((max(1.0 - own.held, own.beyond) for own in grips.values()), default=0.0)
    left = max(left, *(abs(1.0 - share) for share in _foundation_shares(whole.case, whole.prepared).values()), 0.0)
    if left == 0.0:
        return {}
    if not any(own.missed for own in grips.values()):
        return {"selection": lambda seen: left * seen.size}
    return {"selection": lambda seen: _selection_shift(whole, seen)}


def _selection_shift(whole: SolutionUnderTest, seen: ProbeResultUnderTest) -> float:
    """Return the change of a result if all partly selected facets and cells are held."""
    solution, _ = whole.solve_other_model("wide", whole.declared, replace(whole.case, wide=True))
    return seen.apart(seen.of(solution))


def _foundation_shares(case: Case, prepared: Prepared) -> dict[str, float]:
    """Return the ratio of covered to selected area of each foundation, by name; 1 if the exact area is not known."""
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
            find_loaded_surface(case.shape, prepared.mesh, where).area_with_depth(case.depth) / exact if exact else 1.0
        )
    return found


def _support_selections(case: Case, prepared: Prepared) -> dict[str, SupportSelection]:
    if prepared.mesh is None:
        return {}
    from softmark.interpreter.models.shared.support_selection import select_supports

    return select_supports(case, prepared.mesh)
