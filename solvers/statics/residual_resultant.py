"""Out-of-balance forces of a state of rest, without what the last digit of its numbers leaves in them.

A position is known to a part of 1e-16, so that in stiff members a force is known to E A / l times that: of a light load
on a heavy frame this may be 1e-5, and no better state can be written down. What the next Newton step d would change can
be: d is far below the last digit of x, but g + K d is as exact as forces are. At free unknowns that is nothing; at held
ones it is what supports carry. This is iterative refinement whose last correction stays beside the state (Wilkinson
1963; Demmel, Hida, Kahan, Li, Mukherjee and Riedy 2006).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.energies.energy import Floats, Ints
from softmark.solvers.linear.factorisations import Singular, factor
from softmark.solvers.statics.static_problem import Statics

SMALL = 1e-10  # of the extent: a longer step is no matter of rounding
BALANCED = 1e-11  # of the largest force: less is left as it is


def resultant_on(points: Floats) -> Callable[[Floats], float]:
    """What forces (3 n,) at points X (n, 3), m, add up to, N: the force, or the moment by the extent."""
    arms = points - points.mean(axis=0)
    arms /= 2.0 * float(np.linalg.norm(arms, axis=1).max())

    def of(forces: Floats) -> float:
        f = forces.reshape(-1, 3)
        return max(float(np.linalg.norm(f.sum(axis=0))), float(np.linalg.norm(np.cross(arms, f).sum(axis=0))))

    return of


def out_of_balance(assembly: Assembly, x: Floats, fixed: Ints, without: Floats | None = None) -> float:
    """What is left of forces in a state x (dofs,), whoever found it, relative to the larger of load and reactions.

    `without` (dofs,) are forces to take off first, as those of another state. Not finite outside the law's domain.
    """
    g, external = assembly.gradient(x, 1.0), np.zeros(assembly.dofs)
    for energy, scale in assembly.loaded(1.0):
        energy.add_gradient(x, external, scale)
    largest = max(float(np.linalg.norm(external)), float(np.linalg.norm(g[fixed])))
    left = float(np.linalg.norm((g if without is None else g - without)[assembly.free]))
    return left / largest if largest > 0.0 else left


def unrounded(problem: Statics, x: Floats) -> Floats:
    """Out-of-balance forces (dofs,) in a state that Newton's method has found, with the step that rounding forbids.

    As they are where that step is not small, so that the state is not as good as it can be written down, and where the
    tangent cannot be factored.
    """
    assembly, free = problem.assembly, problem.assembly.free
    g = assembly.gradient(x, 1.0)
    sizes = np.abs(g * problem.weights)
    if not len(free) or sizes[free].max() <= BALANCED * sizes.max():
        return g
    whole = Assembly(assembly.dofs, np.zeros(0, dtype=np.int64), assembly.internal, assembly.loads)
    K, d = whole.tangent(x, 1.0), np.zeros_like(g)
    try:
        d[free] = -factor(K[free][:, free].tocsr(), symmetric=assembly.conservative).solve(g[free])
    except Singular:
        return g
    if not np.abs(d / problem.weights).max() <= SMALL * problem.extent:
        return g
    found: Floats = g + K @ d
    return found
