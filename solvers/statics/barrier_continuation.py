"""Equilibrium beside rigid bodies: what presses through a barrier is solved again with a stiffer one.

And what cuts in between the points that are kept clear is solved again with more of them
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
    """A rigid body has passed through the surface in one step: smaller steps may avoid it."""


def clear(problem: Statics, find: Find) -> Equilibrium:
    """What `find` finds, with barriers and points that it takes to keep clear of rigid bodies: `beside`.

    `stiffened` of its facts says by how much, and `joined` how many points press that were not kept clear at first;
    these are there with all others from the state before on. Raises NotConverged where nothing is found, no barrier
    holds, or a rigid body has gone through the surface.
    """
    found, used = _behind_barriers(problem, find)
    last, contacts = found, _driven(used.assembly)
    for rounds in range(ROUNDS + 1):
        more, stays = _joined(problem, last.x)
        if stays:
            found, contacts = last, _driven(used.assembly)
        if more is None or rounds == ROUNDS:
            break
        try:
            again, used = _behind_barriers(more, find, last)
        except NotConverged:
            break
        problem, last = more, replace(again, history=(*last.history, *again.history))
    if not _at_its_body(contacts, found.x):  # what had joined in the state before presses on nothing
        found, used = _behind_barriers(_bare(problem), find)
        contacts = _driven(used.assembly)
    contacts = [energy.shed(found.x) for energy in contacts]
    facts = found.facts | {"joined": sum(len(energy.A) - energy.lasting for energy in contacts)}
    return replace(found, beside=tuple(contacts), history=last.history, facts=facts)


def _at_its_body(contacts: list[Any], x: Floats) -> bool:
    """Whether what has joined presses on what is there, so that a state is one, be it that something still cuts in."""
    if all(energy.extra is None for energy in contacts):
        return True
    from softmark.solvers.contact.facet_penetration import MOST, presses_off_surface

    return not any(presses_off_surface(energy, x, MOST) for energy in contacts)


def _behind_barriers(problem: Statics, find: Find, near: Equilibrium | None = None) -> tuple[Equilibrium, Statics]:
    """What is found with barriers as stiff as it takes, and how; `near` what is known already. Raises NotConverged."""
    history, given, factor = tuple[Iteration, ...](), problem, 1.0
    if near is not None:
        factor = near.facts["stiffened"]
        problem = replace(_stiffer(problem, factor, stay=True), start=near.x)
    for _ in range(TIMES):
        found = find(problem)
        found = replace(found, history=(*history, *found.history), facts=found.facts | {"stiffened": factor})
        if least_gap(problem, found.x) > 0.0:
            _must_be_in_front(given, found)
            return found, problem
        history, factor = found.history, STIFFER * factor
        problem = replace(_stiffer(problem, STIFFER, stay=True), start=found.x)
    raise NotConverged("no barrier keeps its surface in front of the rigid body", history)


def _must_be_in_front(problem: Statics, found: Equilibrium) -> None:
    """Raises NotConverged where a rigid body has gone through the surface since the state that was started from."""
    from softmark.solvers.contact.tunnelling_check import tunnelling_depth

    before = problem.rest if problem.start is None else problem.start
    if deep := max((tunnelling_depth(energy, before, found.x) for energy in _driven(problem.assembly)), default=0.0):
        reason = f"a rigid body goes through the surface in one step, by {1e3 * deep:.3g} mm: take more, smaller states"
        raise PassedThrough(reason, found.history, found.facts)


def _driven(assembly: Assembly) -> list[Any]:
    """Its contacts with rigid bodies where these are in the end."""
    known: list[Any] = [energy for energy in assembly.loads if energy.driven]
    return [energy.at(1.0) for energy in known]


def least_gap(problem: Statics, x: Floats) -> float:
    """The least gap of all contacts in a state (dofs,), m; inf without any."""
    return min((float(energy.gaps(x).min()) for energy in _driven(problem.assembly)), default=float("inf"))


def _stiffer(problem: Statics, factor: float, stay: bool = False) -> Statics:
    """With barriers so many times as stiff; rigid bodies `stay` where the state to start from has them already."""

    def each(assembly: Assembly) -> Assembly:
        known: list[Any] = list(assembly.loads)
        loads = [energy.stiffer(factor) if energy.driven else energy for energy in known]
        return assembly.acting(assembly.internal, [replace(e, earlier=None) if e.driven and stay else e for e in loads])

    return replace(problem, assembly=each(problem.assembly), twin=problem.twin and each(problem.twin))


def _bare(problem: Statics) -> Statics:
    """Without points that have joined."""
    before = problem.rest if problem.start is None else problem.start
    known: list[Any] = list(problem.assembly.loads)
    loads = [energy.joining(None, before) if energy.driven else energy for energy in known]
    return replace(problem, assembly=problem.assembly.joined(loads))


def _joined(problem: Statics, x: Floats) -> tuple[Statics | None, bool]:
    """With more points, where facets cut into rigid bodies in a state (dofs,), or None; and whether it may stay."""
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
