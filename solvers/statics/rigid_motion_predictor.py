"""States that are started from, carried along by rigid bodies that go on: what touches them gives way, or sticks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.energies.energy import Floats
from softmark.solvers.linear.factorisations import Singular, factor
from softmark.solvers.statics.static_problem import NotConverged

if TYPE_CHECKING:
    from softmark.solvers.statics.static_problem import Statics


def towed(problem: Statics, x: Floats) -> Floats:
    """A state x that is started from, carried on as if all that touches stuck to the rigid bodies, which have moved.

    Solves (K + C) d = C v, C the stiffness of contacts that hold on and v the way of each node with its rigid body.
    """
    assembly, way, old = problem.assembly, np.zeros_like(x), []
    for energy in assembly.loads:
        known: Any = energy
        old.append(known.towing(x, way) if energy.rubs else known.before() if energy.driven else energy)
    C = Assembly(assembly.dofs, problem.fixed, [], [e for e in old if e.driven]).tangent(x, 1.0)
    change = np.zeros_like(x)
    change[assembly.free] = -C @ way[assembly.free]
    return pushed(problem, assembly.acting(assembly.internal, old), x, change)


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
    return pushed(problem, problem.assembly.acting(problem.assembly.internal, loads), x, change)


def pushed(problem: Statics, before: Assembly, x: Floats, change: Floats) -> Floats:
    """A state x with what its tangent `before` gives way by where the gradient changes (dofs,), N: itself of a singular
    one.

    No farther than to where surfaces would meet, and through no rigid body as it goes on. Raises NotConverged where
    points would be on the other side of one whatever they do.
    """
    d, free = np.zeros(before.dofs), before.free
    try:
        d[free] = -factor(before.tangent(x, 1.0), symmetric=before.conservative).solve(change[free])
    except Singular:
        return x
    from softmark.solvers.contact.continuous_collision import collision_free_fraction

    d = before.limit(x, d) * d
    was, now = ([e.at(1.0) for e in list[Any](each.loads) if e.driven] for each in (before, problem.assembly))
    part = collision_free_fraction(was, x, d, now)
    if part == 0.0:
        raise NotConverged("rigid bodies would go through the surface on their way from the state before")
    return x + part * d
