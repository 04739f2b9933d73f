"""Load stepping: full Newton steps at increasing loads, for large stretches where they diverge at full load.

From the equilibrium at one load the supports move on with the tangent there, and a few full steps find the next. No
decrease is required, so that no line search creeps along the narrow valley of a nearly constant volume. The final
state is checked like any other; if it is unstable, the one found instead is one of several.
"""

from __future__ import annotations

import numpy as np

from softmark.solvers.energies.energy import Floats
from softmark.solvers.statics.static_newton import Newton
from softmark.solvers.statics.static_problem import CoarseTurn, NotConverged
from softmark.solvers.statics.winding_number import COARSE

FIRST, LEAST = 0.25, 1.0 / 512.0  # steps of load: to begin with, and where the way is given up
EACH, EASY = 10, 6  # whole steps at one load at most, and down to which the next step is twice as long
MEETING = 20  # the same where something may touch: a step leaves a quarter of a pressure that is far too large


def solve_in_load_steps(newton: Newton) -> tuple[Floats, int]:
    """Return the equilibrium at full load along the path from rest, and the number of steps. Raises NotConverged."""
    longest = newton.problem.longest
    x, load, step, count = newton.problem.rest, 0.0, min(FIRST, longest), 0
    while load < 1.0:
        target = min(1.0, load + step)
        before = len(newton.history)
        y = _next_equilibrium(newton, x, load, target)
        if y is None:
            step = 0.5 * (target - load)
            if step < LEAST * longest:
                raise NotConverged(f"load stepping stopped at {100 * load:.4g} % of the load", tuple(newton.history))
            continue
        x, load, count = y, target, count + 1
        if len(newton.history) - before <= EASY:
            step = min(2.0 * step, longest)
    return x, count


def _next_equilibrium(newton: Newton, x: Floats, load: float, target: float) -> Floats | None:
    """Return the equilibrium at the target load from that at another; None if full steps find no valid one."""
    most = MEETING if newton.problem.touches else EACH
    try:
        start = newton.carry(x, target - load, load)
        there, done, _ = newton.steps(start, most, target)
    except NotConverged:
        return None
    if newton.problem.way is not None and left_solution_branch(x, start, there):
        return None
    if not (done and newton.problem.sound(there)):
        return None
    lost = newton.problem.lost(there, target)
    if lost == COARSE:  # on the path itself, which a shorter step follows to the same place
        raise CoarseTurn(f"at {100 * target:.4g} % of the load, {lost}", tuple(newton.history))
    return None if lost else there


def left_solution_branch(x: Floats, start: Floats, there: Floats) -> bool:
    """Return whether Newton's steps were longer than the step of the supports: they led to another state."""
    return bool(np.linalg.norm(there - start) > np.linalg.norm(start - x))
