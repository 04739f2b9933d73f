"""Equilibrium beside rigid bodies: what presses through a barrier is solved again with a stiffer one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.energies.energy import Floats
from softmark.solvers.linear.factorisations import Singular, factor
from softmark.solvers.statics.problem import Equilibrium, Iteration, NotConverged, Statics

STIFFER = 8.0  # times, at once
TIMES = 6  # at most: a pressure of a million times Young's modulus is no solid's


def clear(problem: Statics, find: Callable[[Statics], Equilibrium]) -> Equilibrium:
    """What `find` finds, with barriers as stiff as it takes that no gap is closed; `stiffened` of its facts says so.

    Raises NotConverged where nothing is found, or no barrier holds.
    """
    factor, history = 1.0, tuple[Iteration, ...]()
    for _ in range(TIMES):
        found = find(problem)
        found = replace(found, history=(*history, *found.history), facts=found.facts | {"stiffened": factor})
        if least_gap(problem, found.x) > 0.0:
            return found
        history, factor = found.history, STIFFER * factor
        twin = None if problem.twin is None else _stiffer(problem.twin)
        problem = replace(problem, assembly=_stiffer(problem.assembly), twin=twin, start=found.x)
    raise NotConverged("no barrier keeps its surface in front of the rigid body", history)


def least_gap(problem: Statics, x: Floats) -> float:
    """The least gap of all contacts in a state (dofs,), m; inf without any."""
    each: list[Any] = [energy for energy in problem.assembly.loads if energy.driven]
    return min((float(energy.at(1.0).gaps(x).min()) for energy in each), default=float("inf"))


def _stiffer(assembly: Assembly) -> Assembly:
    known: list[Any] = list(assembly.loads)
    loads = [replace(energy.stiffer(STIFFER), earlier=None) if energy.driven else energy for energy in known]
    return assembly.acting(assembly.internal, loads)


def approach(assembly: Assembly, x: Floats, load: float, to: float) -> Floats:
    """How forces on a state x (dofs,) change (dofs,), N, to first order, as rigid bodies go from a load to another."""
    found, known = np.zeros(assembly.dofs), list[Any](assembly.loads)
    for energy in known:
        if energy.driven:
            energy.at(load).add_towed(x, energy.at(to).body, found)
    return found


def begun(problem: Statics, x: Floats) -> Floats:
    """What a state (dofs,) becomes whose rigid bodies go on from where they were: (dofs,), to first order.

    What touched them goes along; where nothing is known of where they were, and where that leads nowhere, the state.
    """
    if any(energy.rubs for energy in problem.assembly.loads):
        from softmark.solvers.statics.towing import towed

        return towed(problem, x)
    known: list[Any] = list(problem.assembly.loads)
    each = [energy.driven and energy.earlier is not None for energy in known]
    if not any(each):
        return x
    loads = [energy.before() if energy.driven else energy for energy in known]
    change = np.zeros(problem.assembly.dofs)
    for energy, was, moves in zip(known, loads, each, strict=True):
        if moves:
            was.add_towed(x, energy.body, change)
    return pushed(problem.assembly.acting(problem.assembly.internal, loads), x, change)


def pushed(assembly: Assembly, x: Floats, change: Floats) -> Floats:
    """A state x with what its tangent gives way by where the gradient changes (dofs,), N: itself of a singular one.

    No farther than to where surfaces would meet.
    """
    d, free = np.zeros(assembly.dofs), assembly.free
    try:
        d[free] = -factor(assembly.tangent(x, 1.0), symmetric=assembly.conservative).solve(change[free])
    except Singular:
        return x
    return x + assembly.limit(x, d) * d
