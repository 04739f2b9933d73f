"""What a mesh makes of parts that its cells do not follow: the error that comes of cells of the wrong material.

Every cell that a border passes is of the material that it holds the most of. With all cells that the border of one part
passes its own, or none of them, whichever is farther from what was taken, the answer is off to one side of that of the
part itself by more than it is. How far these answers are from the one that was found, summed over the parts, for two
that err in opposite ways must not make up for each other, is a part of the stated error.

Where cells follow a border with their nodes, whole cells of another material are far more than the curve leaves between
nodes, as a polygon misses of a circle. That part is then no more than what is missed, relative to the smallest volume
beside it: twice that, for a stiffness in bending or torsion goes with the square of a section's area, and a quarter of
it more, for what is missed is itself found in flat pieces.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

from softmark.interpreter.verification.probe_errors import Unknown

if TYPE_CHECKING:
    from softmark.interpreter.verification.probe_errors import ProbeAnswer
    from softmark.interpreter.verification.solution_under_test import Answer

STIFFER = 2.5  # times the share of the volume


def parts(whole: Answer) -> dict[str, Callable[[ProbeAnswer], float]]:
    """The part of the stated error that comes of parts of other materials; none where meshes follow them."""
    from softmark.interpreter.models.shared.region_cells import region_errors

    found = region_errors(whole.case, whole.prepared)
    if not found:
        return {}
    return {"regions": lambda seen: sum(_apart(whole, seen, left, way) for left, way in found)}


def _apart(whole: Answer, seen: ProbeAnswer, left: float, way: tuple[int, int]) -> float:
    """How far the same is with every cell that the border passes of one material, or what is missed may do if less."""
    most = math.inf if math.isinf(left) else STIFFER * left * seen.size
    if way == (0, 0):
        return most
    try:
        solution, _ = whole.solved(f"leaning {way}", whole.declared, replace(whole.case, leaning=way))
        return min(most, seen.apart(seen.of(solution)))
    except Unknown:
        if math.isinf(most):
            raise
        return most
