"""Residual forces of an equilibrium without the part that rounding of its numbers leaves in them.

Positions are known to a relative 1e-16, so that forces in stiff members are known to E A / l times that: for a light
load on a heavy frame this may be 1e-5, and no better state can be represented. The change by the next Newton step d
can be: d is far below the last digit of x, but g + K d is as exact as forces are. At free unknowns it is zero; at fixed
ones it is the reaction. This is iterative refinement with the last correction stored separately (Wilkinson 1963;
Demmel, Hida, Kahan, Li, Mukherjee and Riedy 2006).
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
    """Return a function of the resultant of forces (3 n,) at points X (n, 3), m, in N: the larger of force and moment /
    size.
    """
    arms = points - points.mean(axis=0)
    arms /= 2.0 * float(np.linalg.norm(arms, axis=1).max())

    def of(forces: Floats) -> float:
        f = forces.reshape(-1, 3)
        return max(float(np.linalg.norm(f.sum(axis=0))), float(np.linalg.norm(np.cross(arms, f).sum(axis=0))))

    return of


def relative_residual(assembly: Assembly, x: Floats, fixed: Ints, without: Floats | None = None) -> float:
    """Return the norm of residual forces in any state x (dofs,), relative to the larger of load and reactions.

    `without` (dofs,) are forces to subtract first, such as those of another state. The result is not finite outside the
    domain of the law.
    """
    g, external = assembly.gradient(x, 1.0), np.zeros(assembly.dofs)
    for energy, scale in assembly.loaded(1.0):
        energy.add_gradient(x, external, scale)
    largest = max(float(np.linalg.norm(external)), float(np.linalg.norm(g[fixed])))
    left = float(np.linalg.norm((g if without is None else g - without)[assembly.free]))
    return left / largest if largest > 0.0 else left


def residual_without_rounding(problem: Statics, x: Floats) -> Floats:
    """Return residual forces (dofs,) of a converged state, after the next Newton step, too small to represent.

    They are returned unchanged if that step is not small, so that the state could be better, or the tangent is
    singular.
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
