"""Barrier continuation: solves contact with rigid bodies again with stiffer barriers until all gaps are positive.

If facets still penetrate between contact points, points are added and the problem is solved again
(contact/facet_penetration.py).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.energies.energy import Floats
from softmark.solvers.statics.static_problem import Equilibrium, Iteration, NotConverged, Statics

STIFFER = 8.0  # times, at once
TIMES = 6  # at most: a pressure of a million times Young's modulus is no solid's
ROUNDS = 12  # of more points at most: where something still cuts in then, the state without them stays, and is told

Find = Callable[[Statics], Equilibrium]


class PassedThrough(NotConverged):
    """Raised if a rigid body has passed through the surface in one step: smaller steps may avoid it."""


def solve_with_stiffer_barriers(problem: Statics, find: Find) -> Equilibrium:
    """Return the equilibrium from `find` with barriers stiff enough, and contact points enough, for positive gaps.

    Its `beside` has the final contacts. In its facts, `stiffened` is the factor of stiffness, and `joined` the number
    of added points in contact; these start with the state before, like all others. Raises NotConverged if no
    equilibrium is found, no barrier is stiff enough, or a rigid body has passed through the surface.
    """
    found, used = _stiffen_until_gaps_positive(problem, find)
    last, contacts = found, _rigid_contacts(used.assembly)
    for rounds in range(ROUNDS + 1):
        more, stays = _with_added_points(problem, last.x)
        if stays:
            found, contacts = last, _rigid_contacts(used.assembly)
        if more is None or rounds == ROUNDS:
            break
        try:
            again, used = _stiffen_until_gaps_positive(more, find, last)
        except NotConverged:
            break
        problem, last = more, replace(again, history=(*last.history, *again.history))
    if not _is_on_body_surface(contacts, found.x):  # what had joined in the state before presses on nothing
        found, used = _stiffen_until_gaps_positive(_without_added_points(problem), find)
        contacts = _rigid_contacts(used.assembly)
    contacts = [energy.without_unloaded_points(found.x) for energy in contacts]
    facts = found.facts | {"joined": sum(len(energy.A) - energy.lasting for energy in contacts)}
    return replace(found, beside=tuple(contacts), history=last.history, facts=facts)


def _is_on_body_surface(contacts: list[Any], x: Floats) -> bool:
    """Return whether added points press close to the surface of their rigid body, so that the state is acceptable."""
    if all(energy.extra is None for energy in contacts):
        return True
    from softmark.solvers.contact.facet_penetration import MOST, presses_off_surface

    return not any(presses_off_surface(energy, x, MOST) for energy in contacts)


def _stiffen_until_gaps_positive(
    problem: Statics, find: Find, near: Equilibrium | None = None
) -> tuple[Equilibrium, Statics]:
    """Return the equilibrium with barriers stiff enough, and its problem; starts from `near`. Raises NotConverged."""
    history, given, factor = tuple[Iteration, ...](), problem, 1.0
    if near is not None:
        factor = near.facts["stiffened"]
        problem = replace(_with_stiffer_barriers(problem, factor, stay=True), start=near.x)
    for _ in range(TIMES):
        found = find(problem)
        found = replace(found, history=(*history, *found.history), facts=found.facts | {"stiffened": factor})
        if least_gap(problem, found.x) > 0.0:
            _check_tunnelling(given, found)
            return found, problem
        history, factor = found.history, STIFFER * factor
        problem = replace(_with_stiffer_barriers(problem, STIFFER, stay=True), start=found.x)
    raise NotConverged("no barrier keeps the surface outside the rigid body", history)


def _check_tunnelling(problem: Statics, found: Equilibrium) -> None:
    """Raise PassedThrough if a rigid body has passed through the surface since the start."""
    from softmark.solvers.contact.tunnelling_check import tunnelling_depth

    before = problem.rest if problem.start is None else problem.start
    if deep := max(
        (tunnelling_depth(energy, before, found.x) for energy in _rigid_contacts(problem.assembly)), default=0.0
    ):
        reason = f"a rigid body penetrates the surface by {1e3 * deep:.3g} mm in one step: use more, smaller states"
        raise PassedThrough(reason, found.history, found.facts)


def _rigid_contacts(assembly: Assembly) -> list[Any]:
    """Return the contacts with rigid bodies at full load."""
    known: list[Any] = [energy for energy in assembly.loads if energy.driven]
    return [energy.at(1.0) for energy in known]


def least_gap(problem: Statics, x: Floats) -> float:
    """Return the smallest gap of all contacts in a state (dofs,), m; inf without contacts."""
    return min((float(energy.gaps(x).min()) for energy in _rigid_contacts(problem.assembly)), default=float("inf"))


def _with_stiffer_barriers(problem: Statics, factor: float, stay: bool = False) -> Statics:
    """Return the problem with stiffer barriers; with `stay`, rigid bodies are already in place in the start."""

    def each(assembly: Assembly) -> Assembly:
        known: list[Any] = list(assembly.loads)
        loads = [energy.stiffer(factor) if energy.driven else energy for energy in known]
        return assembly.acting(assembly.internal, [replace(e, earlier=None) if e.driven and stay else e for e in loads])

    return replace(problem, assembly=each(problem.assembly), twin=problem.twin and each(problem.twin))


def _without_added_points(problem: Statics) -> Statics:
    """Return the problem without added contact points."""
    before = problem.rest if problem.start is None else problem.start
    known: list[Any] = list(problem.assembly.loads)
    loads = [energy.joining(None, before) if energy.driven else energy for energy in known]
    return replace(problem, assembly=problem.assembly.joined(loads))


def _with_added_points(problem: Statics, x: Floats) -> tuple[Statics | None, bool]:
    """Return the problem with more points if facets penetrate in x, else None, and whether x is acceptable."""
    before = problem.rest if problem.start is None else problem.start
    loads: list[Any] = list(problem.assembly.loads)
    stays = True
    for i, energy in enumerate(loads):
        if energy.driven and energy.facing is not None:
            from softmark.solvers.contact.facet_penetration import search_penetration

            extra, may = search_penetration(energy.at(1.0), x)
            stays &= may
            loads[i] = energy if extra is None else energy.joining(extra, before)
    same = all(a is b for a, b in zip(loads, problem.assembly.loads, strict=True))
    return None if same else replace(problem, assembly=problem.assembly.joined(loads)), stays
