"""Equilibrium beside rigid bodies: what presses through a barrier is solved again with a stiffer one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

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
        problem = replace(problem, assembly=_stiffer(problem.assembly), twin=_stiffer(problem.twin), start=found.x)
    raise NotConverged("no barrier keeps its surface in front of the rigid body", history)


def least_gap(problem: Statics, x: Any) -> float:
    """The least gap of all contacts in a state (dofs,), m; inf without any."""
    each: list[Any] = [energy for energy in problem.assembly.loads if energy.driven]
    return min((float(energy.at(1.0).gaps(x).min()) for energy in each), default=float("inf"))


def _stiffer(assembly: Any) -> Any:
    if assembly is None:
        return None
    loads = [replace(energy.stiffer(STIFFER), earlier=None) if energy.driven else energy for energy in assembly.loads]
    return assembly.acting(assembly.internal, loads)


def approach(assembly: Any, x: Any, load: float, to: float) -> Any:
    """How forces on a state x (dofs,) change (dofs,), N, to first order, as rigid bodies go from a load to another."""
    found = np.zeros(assembly.dofs)
    for energy in assembly.loads:
        if energy.driven:
            energy.at(load).add_towed(x, energy.at(to).body, found)
    return found


def begun(problem: Statics, x: Any) -> Any:
    """What a state (dofs,) becomes whose rigid bodies go on from where they were: (dofs,), to first order.

    What touched them goes along; where nothing is known of where they were, and where that leads nowhere, the state.
    """
    if problem.rubs:
        from softmark.solvers.statics.towing import towed

        return towed(problem, x)
    known: list[Any] = list(problem.assembly.loads)
    each = [energy for energy in known if energy.driven and energy.earlier is not None]
    if not each:
        return x
    loads = [energy.before() if energy.driven else energy for energy in known]
    there, free = problem.assembly.acting(problem.assembly.internal, loads), problem.assembly.free
    change, d = np.zeros(there.dofs), np.zeros(there.dofs)
    for energy in each:
        energy.before().add_towed(x, energy.body, change)
    try:
        d[free] = -factor(there.tangent(x, 1.0), symmetric=there.conservative).solve(change[free])
    except Singular:
        return x
    return x + there.limit(x, d) * d  # no farther than to where surfaces would meet
