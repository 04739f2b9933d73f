"""Equilibrium beside rigid bodies: what presses through a barrier is solved again with a stiffer one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.energies.energy import Floats
from softmark.solvers.statics.problem import Equilibrium, Iteration, NotConverged, Statics

STIFFER = 8.0  # times, at once
TIMES = 6  # at most: a pressure of a million times Young's modulus is no solid's


def clear(problem: Statics, find: Callable[[Statics], Equilibrium]) -> Equilibrium:
    """What `find` finds, with barriers as stiff as it takes that no gap is closed; `stiffened` of its facts says so.

    Raises NotConverged where nothing is found, no barrier holds, or a rigid body has gone through the surface.
    """
    factor, history, given = 1.0, tuple[Iteration, ...](), problem
    for _ in range(TIMES):
        found = find(problem)
        found = replace(found, history=(*history, *found.history), facts=found.facts | {"stiffened": factor})
        if least_gap(problem, found.x) > 0.0:
            _must_be_in_front(given, found)
            return found
        history, factor = found.history, STIFFER * factor
        twin = None if problem.twin is None else _stiffer(problem.twin)
        problem = replace(problem, assembly=_stiffer(problem.assembly), twin=twin, start=found.x)
    raise NotConverged("no barrier keeps its surface in front of the rigid body", history)


def _must_be_in_front(problem: Statics, found: Equilibrium) -> None:
    """Raises NotConverged where a rigid body has gone through the surface since the state that was started from."""
    from softmark.solvers.contact.passing import passed

    before = problem.rest if problem.start is None else problem.start
    each: list[Any] = [energy for energy in problem.assembly.loads if energy.driven]
    if deep := max((passed(energy, before, found.x) for energy in each), default=0.0):
        reason = f"a rigid body goes through the surface in one step, by {1e3 * deep:.3g} mm: take more, smaller states"
        raise NotConverged(reason, found.history, found.facts)


def least_gap(problem: Statics, x: Floats) -> float:
    """The least gap of all contacts in a state (dofs,), m; inf without any."""
    each: list[Any] = [energy for energy in problem.assembly.loads if energy.driven]
    return min((float(energy.at(1.0).gaps(x).min()) for energy in each), default=float("inf"))


def _stiffer(assembly: Assembly) -> Assembly:
    known: list[Any] = list(assembly.loads)
    loads = [replace(energy.stiffer(STIFFER), earlier=None) if energy.driven else energy for energy in known]
    return assembly.acting(assembly.internal, loads)
