"""Predictor for moving rigid bodies: moves the initial state with them, with sticking or frictionless contact."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.energies.energy import Floats
from softmark.solvers.linear.factorisations import Singular, factor
from softmark.solvers.statics.static_problem import NotConverged

if TYPE_CHECKING:
    from softmark.solvers.statics.static_problem import Statics


def predict_sticking_motion(problem: Statics, x: Floats) -> Floats:
    """Return the initial state x (dofs,), moved as if all points in contact stuck to the moving rigid bodies.

    The motion d solves (K + C) d = C v, with K the tangent stiffness, C the stiffness of sticking contacts and v the
    motion of each node with its rigid body.
    """
    assembly, way, old = problem.assembly, np.zeros_like(x), []
    for energy in assembly.loads:
        known: Any = energy
        old.append(
            known.with_sticking_points(x, way)
            if energy.has_friction
            else known.before()
            if energy.not_proportional
            else energy
        )
    C = Assembly(assembly.dofs, problem.fixed, [], [e for e in old if e.not_proportional]).tangent(x, 1.0)
    change = np.zeros_like(x)
    change[assembly.free] = -C @ way[assembly.free]
    return predict_by_linear_response(problem, assembly.acting(assembly.internal, old), x, change)


def force_change_of_rigid_motion(assembly: Assembly, x: Floats, load: float, to: float) -> Floats:
    """Return the first-order change of forces (dofs,), N, as rigid bodies move from one load factor to another.

    The nodes stay in the state x.
    """
    found, known = np.zeros(assembly.dofs), list[Any](assembly.loads)
    for energy in known:
        if energy.not_proportional:
            energy.at(load).add_force_change_of_motion(x, energy.at(to).body, found)
    return found


def predict_rigid_motion(problem: Statics, x: Floats) -> Floats:
    """Return an initial state x (dofs,) moved with the rigid bodies, to first order.

    Points in contact move with their rigid body. The state is returned unchanged if the earlier positions of rigid
    bodies are unknown, or the tangent is singular.
    """
    if any(energy.has_friction for energy in problem.assembly.loads):
        return predict_sticking_motion(problem, x)
    known: list[Any] = list(problem.assembly.loads)
    each = [energy.not_proportional and energy.earlier is not None for energy in known]
    if not any(each):
        return x
    loads = [energy.before() if energy.not_proportional else energy for energy in known]
    change = np.zeros(problem.assembly.dofs)
    for energy, was, moves in zip(known, loads, each, strict=True):
        if moves:
            was.add_force_change_of_motion(x, energy.body, change)
    return predict_by_linear_response(problem, problem.assembly.acting(problem.assembly.internal, loads), x, change)


def predict_by_linear_response(problem: Statics, before: Assembly, x: Floats, change: Floats) -> Floats:
    """Return the state x (dofs,) plus its first-order response to a change of forces (dofs,), N.

    The tangent is that of the assembly `before`; if it is singular, x is returned. The step is shortened so that no
    surfaces meet and no points pass through a moving rigid body. Raises NotConverged if points would pass through a
    rigid body even in the shortest step.
    """
    d, free = np.zeros(before.dofs), before.free
    try:
        d[free] = -factor(before.tangent(x, 1.0), symmetric=before.conservative).solve(change[free])
    except Singular:
        return x
    from softmark.solvers.contact.continuous_collision import collision_free_fraction

    d = before.limit(x, d) * d
    was, now = ([e.at(1.0) for e in list[Any](each.loads) if e.not_proportional] for each in (before, problem.assembly))
    part = collision_free_fraction(was, x, d, now)
    if part == 0.0:
        raise NotConverged("moving from the previous state, rigid bodies would pass through the surface")
    return x + part * d
