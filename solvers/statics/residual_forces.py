"""Residual forces of an equilibrium, without the part that is due to rounding of its numbers.

Positions are known to a relative 1e-16, so forces in stiff members are known to E A / l times that length. For a light
load on a heavy frame this error may be 1e-5 of the load, and no better state can be represented. But the change by the
next Newton step d can be represented: d is far below the last digit of x, and g + K d is as exact as forces are. It is
zero at free unknowns, and the reaction at fixed ones.

This is iterative refinement with the last correction stored separately.

Source: Wilkinson 1963; Demmel, Hida, Kahan, Li, Mukherjee and Riedy 2006.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.energies.energy import Floats, Ints
from softmark.solvers.linear.factorisations import Singular, factor
from softmark.solvers.statics.static_problem import Statics

SMALL = 1e-10  # of the extent: longer steps are not due to rounding
BALANCED = 1e-11  # of the largest force: smaller residuals are not corrected


def resultant_on(points: Floats) -> Callable[[Floats], float]:
    """Return a function that maps nodal forces (3 n,) to the size of their resultant, N.

    `points` (n, 3), m, are the nodes. The moment of the forces divided by the size of the body replaces the resultant
    if it is larger.
    """
    arms = points - points.mean(axis=0)
    arms /= 2.0 * float(np.linalg.norm(arms, axis=1).max())

    def of(forces: Floats) -> float:
        """Return the resultant of nodal forces (3 n,), N."""
        f = forces.reshape(-1, 3)
        return max(float(np.linalg.norm(f.sum(axis=0))), float(np.linalg.norm(np.cross(arms, f).sum(axis=0))))

    return of


def relative_residual(assembly: Assembly, x: Floats, fixed: Ints, without: Floats | None = None) -> float:
    """Return the norm of the residual forces in any state x (dofs,), relative to the larger of load and reactions.

    `without` (dofs,) are forces to subtract first, such as those of another state. The result is not finite outside the
    domain of the law.
    """
    internal, external = assembly.forces(x, 1.0)
    g = internal + external
    largest = max(float(np.linalg.norm(external)), float(np.linalg.norm(g[fixed])))
    left = float(np.linalg.norm((g if without is None else g - without)[assembly.free]))
    return left / largest if largest > 0.0 else left


def residual_without_rounding(problem: Statics, x: Floats) -> Floats:
    """Return the residual forces (dofs,) of a converged state x, corrected for rounding.

    They are the forces after the next Newton step, which is too small to be represented in x. If this step is not
    small, so that a better state exists, or the tangent is singular, they are returned without correction.
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
