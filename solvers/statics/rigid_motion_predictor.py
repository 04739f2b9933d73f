"""Predictor for moving rigid bodies: moves the initial state with them, with sticking or frictionless contact."""

from __future__ import annotations

from typing import TYPE_CHECKING

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
    assembly, way = problem.assembly, np.zeros_like(x)
    old = {
        name: contact.with_sticking_points(x, way) if contact.has_friction else contact.before()
        for name, contact in assembly.rigid_contacts.items()
    }
    C = Assembly(assembly.dofs, problem.fixed, [], old).tangent(x, 1.0)
    change = np.zeros_like(x)
    change[assembly.free] = -C @ way[assembly.free]
    return predict_by_linear_response(problem, assembly.with_energies(old), x, change)


def force_change_of_rigid_motion(assembly: Assembly, x: Floats, load: float, to: float) -> Floats:
    """Return the first-order change of forces (dofs,), N, as rigid bodies move from one load factor to another.

    The nodes stay in the state x.
    """
    found = np.zeros(assembly.dofs)
    for contact in assembly.rigid_contacts.values():
        contact.at(load).add_force_change_of_motion(x, contact.at(to).body, found)
    return found


def predict_rigid_motion(problem: Statics, x: Floats) -> Floats:
    """Return an initial state x (dofs,) moved with the rigid bodies, to first order.

    Points in contact move with their rigid body. The state is returned unchanged if the earlier positions of rigid
    bodies are unknown, or the tangent is singular.
    """
    contacts = problem.assembly.rigid_contacts
    if any(contact.has_friction for contact in contacts.values()):
        return predict_sticking_motion(problem, x)
    moving = {name: contact for name, contact in contacts.items() if contact.earlier is not None}
    if not moving:
        return x
    old = {name: contact.before() for name, contact in moving.items()}
    change = np.zeros(problem.assembly.dofs)
    for name, contact in moving.items():
        old[name].add_force_change_of_motion(x, contact.body, change)
    return predict_by_linear_response(problem, problem.assembly.with_energies(old), x, change)


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
    was, now = ([*each.rigid_contacts_at(1.0).values()] for each in (before, problem.assembly))
    part = collision_free_fraction(was, x, d, now)
    if part == 0.0:
        raise NotConverged("a rigid body would pass through the surface on its way from the previous state")
    return x + part * d
