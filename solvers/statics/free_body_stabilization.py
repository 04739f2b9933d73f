"""Equilibrium of bodies held only by contact, with a stabilising spring whose force vanishes at the end.

The spring ties every node to a reference position. Each solution becomes the next reference, until the spring force has
vanished (proximal point method, Rockafellar 1976). So the result does not depend on the spring stiffness. As long as
contact does not balance the loads, each iteration moves the body by a fraction of its size; these iterations are no
motion in time.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from softmark.solvers.assembly.assembly import Assembly, number_energies
from softmark.solvers.energies.energy import Floats
from softmark.solvers.energies.stabilization_spring import STABILIZATION, StabilizationSpring
from softmark.solvers.statics.static_problem import HELD, SLIDES, Equilibrium, Iteration, NotConverged, Statics

REACH = 0.1  # of its size: largest motion of a free body in one iteration
WEAKER = 100.0  # factor by which the spring is weakened per iteration while its force falls
GONE = 1e-10  # of the forces on the body: largest spring force at the end
STUCK = 30  # largest number of iterations in which the spring force does not fall
MOST = 60  # largest number of iterations
NOTHING = 1e-6  # of the force of the weakest spring stretched by the size of the body: zero force
FALLS = 0.5  # ratio of spring forces above which contact does not yet carry the loads
FREE = 0.99  # of the forces: above this, only the spring carries the loads
CLOSER = 0.3  # of the tolerance: the remainder is for the spring force


def solve_with_vanishing_spring(problem: Statics, find: Callable[[Statics], Equilibrium]) -> Equilibrium:
    """Return the equilibrium of a body held only by contact, without any force of the stabilising spring.

    The spring is the energy `stabilization` of the problem, and `find` solves the problem with a given spring. In the
    facts of the result, `grounded` holds the spring force relative to the forces on the body, and the number of
    reference positions. Raises NotConverged if no equilibrium is found, or if contact never balances the loads.
    """
    known: Any = problem.assembly.internal_energies(STABILIZATION)[0]
    ground: StabilizationSpring = replace(known, place=problem.rest if problem.start is None else problem.start)
    weakest, history, before, stuck = ground.spring, tuple[Iteration, ...](), 1.0, 0
    least = NOTHING * weakest * problem.extent
    ground = replace(ground, spring=max(weakest, _load_resultant(problem) / (REACH * problem.extent)))
    for number in range(MOST):
        found = find(replace(_with_stabilization_spring(problem, ground), tolerance=CLOSER * problem.tolerance))
        history += found.history
        borne = _relative_spring_force(problem.assembly, ground, found.x, least)
        if borne <= GONE:
            facts = {"bears": borne, "places": number + 1}
            return replace(found, history=history, facts=found.facts | {"grounded": facts})
        if problem.has_friction and borne > FALLS:
            raise NotConverged(
                "the body falls onto a contact with friction, where this motion would wrongly count as slip", history
            )
        less = borne < 0.5 * before
        stuck, before = (0 if less else stuck + 1), borne
        if stuck > STUCK:
            break
        spring = max(weakest, ground.spring / WEAKER) if less else ground.spring
        ground = replace(ground, spring=spring, place=found.x)
        problem = replace(problem, start=found.x, assembly=_with_bodies_in_final_positions(problem.assembly))
    raise NotConverged(_failure_reason(problem, ground, found.x, before), history)


def _load_resultant(problem: Statics) -> float:
    """Return the resultant, N, of the loads at rest that do not come from rigid bodies.

    Their moment divided by the size of the body replaces it if larger.
    """
    f = np.zeros(problem.assembly.dofs)
    for energy, scale in problem.assembly.loads_with_factors(1.0):
        if not energy.not_proportional:
            energy.add_gradient(problem.rest, f, scale)
    return 0.0 if problem.resultant is None else problem.resultant(f)


def _relative_spring_force(assembly: Assembly, ground: StabilizationSpring, x: Floats, least: float) -> float:
    """Return the spring force relative to the nodal forces of loads and contacts, or to `least`, N, if larger."""
    f = np.zeros(assembly.dofs)
    meets = [(pair, 1.0) for pair in assembly.pair_contacts.values()]
    for energy, scale in (*assembly.loads_with_factors(1.0), *meets):
        energy.add_gradient(x, f, scale)
    own, whole = (float(np.linalg.norm(each, axis=1).sum()) for each in (ground.forces(x), f[ground.stencils]))
    return own / max(whole, least)


def _with_stabilization_spring(problem: Statics, ground: StabilizationSpring) -> Statics:
    """Return the problem with another stabilising spring."""
    return problem.with_energies(number_energies(STABILIZATION, [ground]))


def _with_bodies_in_final_positions(assembly: Assembly) -> Assembly:
    """Return the assembly with rigid bodies already in their final positions at the start."""
    return assembly.with_energies({n: replace(e, earlier=None) for n, e in assembly.rigid_contacts.items()})


def _failure_reason(problem: Statics, ground: StabilizationSpring, x: Floats, borne: float) -> str:
    """Return the reason why contact does not hold the body, as text.

    `borne` is the spring force relative to the forces on the body.
    """
    each: list[Any] = [e for e in problem.assembly.loads if e.has_friction]
    if any(e.at(1.0).pressures(x).any() for e in each) and not any(e.at(1.0).holds(x) for e in each):
        held = problem.fixed.size > 0 or any(
            e.resists_rigid_motion for e in problem.assembly.internal if not isinstance(e, StabilizationSpring)
        )
        return f"{SLIDES} at 100 % of the load{HELD if held else ', and nothing else holds it'}"
    way = ground.forces(x).sum(axis=0)
    size = float(np.linalg.norm(way))
    along = "" if not size else f" along ({', '.join(f'{c:.2g}' for c in np.round(way / size, 6) + 0.0)})"
    if borne > FREE:
        return f"nothing stops the body within {STUCK * REACH:.2g} times its size: it moves away{along}"
    return f"nothing stops the body: {100 * borne:.2g} % of the forces on it are unbalanced and move it{along}"
