"""Barrier continuation: solves rigid contact again with stiffer barriers until all gaps are positive.

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

STIFFER = 8.0  # factor of one increase of the barrier stiffness
TIMES = 6  # largest number of increases: higher pressures do not occur in solids
ROUNDS = 12  # largest number of rounds that add points; after that the state is reported as it is

Find = Callable[[Statics], Equilibrium]


class RigidBodyTunnelling(NotConverged):
    """Raised if a rigid body has passed through the surface in one step; smaller steps may avoid this."""


def solve_with_stiffer_barriers(problem: Statics, find: Find) -> Equilibrium:
    """Return the equilibrium with positive gaps, by stiffer barriers and additional contact points.

    `find` solves the problem for given barriers and points. The field `beside` of the result holds the final rigid
    contacts. In its facts, `stiffened` is the factor of the barrier stiffness, and `joined` the number of added points
    with a contact force. Added points start with the friction history of the last state, like all others. Raises
    NotConverged if no equilibrium is found, no barrier is stiff enough, or a rigid body has passed through the surface.
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
    if not _is_on_body_surface(contacts, found.x):  # points added in the last state press where there is no body
        found, used = _stiffen_until_gaps_positive(_without_added_points(problem), find)
        contacts = _rigid_contacts(used.assembly)
    contacts = [energy.without_unloaded_points(found.x) for energy in contacts]
    facts = found.facts | {"joined": sum(len(energy.A) - energy.lasting for energy in contacts)}
    return replace(found, beside=tuple(contacts), history=last.history, facts=facts)


def _is_on_body_surface(contacts: list[Any], x: Floats) -> bool:
    """Return whether contact forces on added points act close to the surface of their rigid body.

    Only then is the state x acceptable.
    """
    if all(energy.extra is None for energy in contacts):
        return True
    from softmark.solvers.contact.facet_penetration import MOST, presses_off_surface

    return not any(presses_off_surface(energy, x, MOST) for energy in contacts)


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
    if deep := max(
        (tunnelling_depth(energy, before, found.x) for energy in _rigid_contacts(problem.assembly)), default=0.0
    ):
        reason = f"a rigid body penetrates the surface by {1e3 * deep:.3g} mm in one step: use more, smaller states"
        raise RigidBodyTunnelling(reason, found.history, found.facts)


def _rigid_contacts(assembly: Assembly) -> list[Any]:
    """Return the rigid contacts of an assembly, at full load."""
    known: list[Any] = [energy for energy in assembly.loads if energy.not_proportional]
    return [energy.at(1.0) for energy in known]


def least_gap(problem: Statics, x: Floats) -> float:
    """Return the smallest gap of all rigid contacts in a state x (dofs,), m; inf without contacts."""
    return min((float(energy.gaps(x).min()) for energy in _rigid_contacts(problem.assembly)), default=float("inf"))


def _with_stiffer_barriers(problem: Statics, factor: float, stay: bool = False) -> Statics:
    """Return the problem with the barrier stiffnesses of all rigid contacts multiplied by `factor`.

    If `stay` is true, the start state of the problem already belongs to the final positions of the rigid bodies, so
    their positions at the start of their motion are discarded.
    """

    def each(assembly: Assembly) -> Assembly:
        """Return an assembly with stiffer barriers in its rigid contacts."""
        known: list[Any] = list(assembly.loads)
        loads = [energy.stiffer(factor) if energy.not_proportional else energy for energy in known]
        return assembly.acting(
            assembly.internal, [replace(e, earlier=None) if e.not_proportional and stay else e for e in loads]
        )

    return replace(problem, assembly=each(problem.assembly), twin=problem.twin and each(problem.twin))


def _without_added_points(problem: Statics) -> Statics:
    """Return the problem without added contact points."""
    before = problem.rest if problem.start is None else problem.start
    known: list[Any] = list(problem.assembly.loads)
    loads = [energy.with_added_points(None, before) if energy.not_proportional else energy for energy in known]
    return replace(problem, assembly=problem.assembly.joined(loads))


def _with_added_points(problem: Statics, x: Floats) -> tuple[Statics | None, bool]:
    """Return the problem with more contact points, or None, and whether the state x is acceptable.

    Points are added where facets penetrate a rigid body in x; the problem is None if no facet does.
    """
    before = problem.rest if problem.start is None else problem.start
    loads: list[Any] = list(problem.assembly.loads)
    stays = True
    for i, energy in enumerate(loads):
        if energy.not_proportional and energy.facing is not None:
            from softmark.solvers.contact.facet_penetration import search_penetration

            extra, may = search_penetration(energy.at(1.0), x)
            stays &= may
            loads[i] = energy if extra is None else energy.with_added_points(extra, before)
    same = all(a is b for a, b in zip(loads, problem.assembly.loads, strict=True))
    return None if same else replace(problem, assembly=problem.assembly.joined(loads)), stays
