"""Barrier continuation: solves rigid contact again with stiffer barriers until all gaps are positive.

If facets still penetrate between contact points, points are added and the problem is solved again
(contact/facet_penetration.py).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from softmark.solvers.energies.energy import Floats
from softmark.solvers.statics.static_problem import Equilibrium, Iteration, NotConverged, Statics

STIFFER = 8.0  # factor of one increase of the barrier stiffness
TIMES = 6  # largest number of increases: higher pressures do not occur in solids
ROUNDS = 12  # largest number of rounds that add points; after that the state is reported as it is

Find = Callable[[Statics], Equilibrium]


class RigidBodyTunnelling(NotConverged):
    """Raised if a rigid body has passed through the surface in one step; smaller steps may avoid this."""


def solve_with_stiffer_barriers(problem: Statics, find: Find) -> Equilibrium:
    """Return the equilibrium with positive gaps, by stiffer barriers and additional contact points.

    `find` solves the problem for given barriers and points. The field `contacts` of the result holds the final
    rigid contacts. In its facts, `stiffened` is the factor of the barrier stiffness, and `joined` the number of added
    points with a contact force. Added points start with the friction history of the last state, like all others. Raises
    NotConverged if no equilibrium is found, no barrier is stiff enough, or a rigid body has passed through the surface.
    """
    found, used = _stiffen_until_gaps_positive(problem, find)
    last, contacts = found, used.assembly.rigid_contacts_at(1.0)
    for rounds in range(ROUNDS + 1):
        more, stays = _with_added_points(problem, last.x)
        if stays:
            found, contacts = last, used.assembly.rigid_contacts_at(1.0)
        if more is None or rounds == ROUNDS:
            break
        try:
            again, used = _stiffen_until_gaps_positive(more, find, last)
        except NotConverged:
            break
        problem, last = more, replace(again, history=(*last.history, *again.history))
    if not _is_on_body_surface(contacts, found.x):  # points added in the last state press where there is no body
        found, used = _stiffen_until_gaps_positive(_without_added_points(problem), find)
        contacts = used.assembly.rigid_contacts_at(1.0)
    contacts = {name: energy.without_unloaded_points(found.x) for name, energy in contacts.items()}
    facts = found.facts | {"joined": sum(len(energy.A) - energy.lasting for energy in contacts.values())}
    return replace(found, contacts=contacts, history=last.history, facts=facts)


def _is_on_body_surface(contacts: Mapping[str, Any], x: Floats) -> bool:
    """Return whether contact forces on added points act close to the surface of their rigid body.

    Only then is the state x acceptable.
    """
    if all(energy.extra is None for energy in contacts.values()):
        return True
    from softmark.solvers.contact.facet_penetration import MOST, presses_off_surface

    return not any(presses_off_surface(energy, x, MOST) for energy in contacts.values())


def _stiffen_until_gaps_positive(
    problem: Statics, find: Find, near: Equilibrium | None = None
) -> tuple[Equilibrium, Statics]:
    """Return the equilibrium with positive gaps, and the problem with the barriers used. Raises NotConverged.

    The solution starts from the equilibrium `near`, if given.
    """
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
    """Raise PassedThrough if a rigid body has passed through the surface between the start and the result `found`."""
    from softmark.solvers.contact.tunnelling_check import tunnelling_depth

    before = problem.rest if problem.start is None else problem.start
    contacts = problem.assembly.rigid_contacts_at(1.0).values()
    if deep := max((tunnelling_depth(energy, before, found.x) for energy in contacts), default=0.0):
        reason = f"a rigid body penetrates the surface by {1e3 * deep:.3g} mm in one step: use more, smaller states"
        raise RigidBodyTunnelling(reason, found.history, found.facts)


def least_gap(problem: Statics, x: Floats) -> float:
    """Return the smallest gap of all rigid contacts in a state x (dofs,), m; inf without contacts."""
    contacts = problem.assembly.rigid_contacts_at(1.0).values()
    return min((float(energy.gaps(x).min()) for energy in contacts), default=float("inf"))


def _with_stiffer_barriers(problem: Statics, factor: float, stay: bool = False) -> Statics:
    """Return the problem with the barrier stiffnesses of all rigid contacts multiplied by `factor`.

    If `stay` is true, the start state of the problem already belongs to the final positions of the rigid bodies, so
    their positions at the start of their motion are discarded.
    """

    stiffer = {name: energy.stiffer(factor) for name, energy in problem.assembly.rigid_contacts.items()}
    return problem.with_energies({n: replace(e, earlier=None) if stay else e for n, e in stiffer.items()})


def _without_added_points(problem: Statics) -> Statics:
    """Return the problem without added contact points."""
    before = problem.rest if problem.start is None else problem.start
    contacts = {n: energy.with_added_points(None, before) for n, energy in problem.assembly.rigid_contacts.items()}
    return replace(problem, assembly=problem.assembly.with_energies(contacts))


def _with_added_points(problem: Statics, x: Floats) -> tuple[Statics | None, bool]:
    """Return the problem with more contact points, or None, and whether the state x is acceptable.

    Points are added where facets penetrate a rigid body in x; the problem is None if no facet does.
    """
    before = problem.rest if problem.start is None else problem.start
    changed, stays = dict[str, Any](), True
    for name, energy in problem.assembly.rigid_contacts.items():
        if energy.facing is not None:
            from softmark.solvers.contact.facet_penetration import search_penetration

            extra, may = search_penetration(energy.at(1.0), x)
            stays &= may
            if extra is not None:
                changed[name] = energy.with_added_points(extra, before)
    return replace(problem, assembly=problem.assembly.with_energies(changed)) if changed else None, stays
