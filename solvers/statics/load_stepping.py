"""Load stepping: full Newton steps at increasing loads, for large stretches where they diverge at full load.

From the equilibrium at one load the supports move on, and the body follows with its tangent stiffness. A few full steps
then find the next equilibrium. They need not decrease the energy, so that no line search creeps along the narrow valley
of a nearly constant volume. The final state is checked like any other. If it is unstable, the stable state found
instead is one of several.
"""

from __future__ import annotations

import numpy as np

from softmark.solvers.energies.energy import Floats
from softmark.solvers.statics.static_newton import Newton
from softmark.solvers.statics.static_problem import CellsTooCoarseForRotation, NotConverged
from softmark.solvers.statics.winding_number import COARSE

FIRST, LEAST = 0.25, 1.0 / 512.0  # first and least load step
EACH, EASY = 10, 6  # largest number of full steps at one load; with EASY or fewer the load step doubles
MEETING = 20  # the same with contact, where each step reduces an excess pressure to a quarter


def solve_in_load_steps(newton: Newton) -> tuple[Floats, int]:
    """Return the equilibrium (dofs,) at full load along the path from rest, and the number of load steps.

    Raises NotConverged.
    """
    longest = newton.problem.largest_load_step
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
    """Return the equilibrium at the load factor `target`, from the equilibrium x at the load factor `load`.

    Returns None if full steps find no valid one.
    """
    most = MEETING if newton.problem.may_contact else EACH
    try:
        start = newton.predict_equilibrium(x, target - load, load)
        there, done, _ = newton.full_steps(start, most, target)
    except NotConverged:
        return None
    if newton.problem.way is not None and has_left_solution_branch(x, start, there):
        return None
    if not (done and newton.problem.sound(there)):
        return None
    lost = newton.problem.lost_turn_message(there, target)
    if lost == COARSE:  # this happens on the path itself: shorter steps do not help
        raise CellsTooCoarseForRotation(f"at {100 * target:.4g} % of the load, {lost}", tuple(newton.history))
    return None if lost else there


def has_left_solution_branch(x: Floats, start: Floats, there: Floats) -> bool:
    """Return whether Newton's method has converged to another solution branch in a load step.

    This is so if the correction from the predicted state `start` to the result `there` is longer than the step of the
    supports from x to `start`.
    """
    return bool(np.linalg.norm(there - start) > np.linalg.norm(start - x))
