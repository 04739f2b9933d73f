"""Equilibrium with friction: energies with the pressures of the iterate before, and then whole steps with its own.

Forces of friction depend on pressures that are sought as well, and have no energy. With pressures and normals of an
earlier iterate they have one, which Newton's method descends as it does without friction; what that finds gives new
pressures, and the distances of one from the next shrink by the coupling of pressure and shear (Jean 1999; Li et al.
2020). When it is close, whole steps with the tangent of all of it, which is not symmetric, are quadratic.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.solvers.energies.energy import Floats
from softmark.solvers.statics.problem import NotConverged

if TYPE_CHECKING:
    from softmark.solvers.assembly.assembly import Assembly
    from softmark.solvers.statics.newton import Newton

MOST = 60  # iterates
SOFT = (0.01,)  # of the stiffness across and along the surface: first, so that nodes come and go in whole steps
ROUGH, FINER = 1e-2, 0.05  # how well an iterate is worth solving: at most, and of the residual that friction leaves
CLOSE, EACH = 0.05, 8  # residual from which whole steps are tried, and how many


def rubbed(newton: Newton, x: Floats, load: float) -> Floats:
    """The equilibrium with friction at a load, from x. Raises NotConverged."""
    problem = newton.problem
    before, residual = _at(newton.assembly, load), 1.0
    for number in range(MOST):
        soft = SOFT[number] if number < len(SOFT) else 1.0
        lagged = newton.assembly.acting(newton.assembly.internal, _lagged(newton.assembly, x, load, soft, before))
        rough = ROUGH if number <= len(SOFT) else max(problem.tolerance, min(ROUGH, FINER * residual))
        x, before = _descended(newton, lagged, x, load, rough), lagged.loads
        if soft < 1.0:
            continue
        _, residual = newton.residual(x, load)
        if residual > CLOSE and residual > problem.tolerance:
            continue
        try:
            y, done, left = newton.steps(x, EACH, load)
        except NotConverged:
            continue
        if done:
            return y
        if np.isfinite(left) and left < 0.1 * residual:
            x, residual = y, left
    reason = f"friction does not settle at {100 * load:.4g} % of the load, residual {residual:.1e}"
    raise NotConverged(reason, tuple(newton.history))


def _descended(newton: Newton, lagged: Assembly, x: Floats, load: float, tolerance: float) -> Floats:
    """The equilibrium of an iterate, nearly. Raises NotConverged."""
    problem = replace(newton.problem, assembly=lagged, tolerance=tolerance, exact=None)
    own = type(newton)(problem, newton.history, newton.systems, newton.phase)
    own.towed, own.moved = newton.towed, newton.moved
    found = own.descend(x, load)
    newton.moved = own.moved
    return found


def _at(assembly: Assembly, load: float) -> Sequence[Any]:
    return [e.at(load) if e.rubs else e for e in assembly.loads]


def _lagged(assembly: Assembly, x: Floats, load: float, soft: float, before: Sequence[Any]) -> list[Any]:
    """Loads with the pressures that those before have in x."""
    each = zip(_at(assembly, load), before, strict=True)
    return [e.lagged(x, soft, was) if e.rubs else e for e, was in each]
