"""Error of meshes whose cells do not follow the borders of material regions.

Such cells have the wrong material in a part of their volume. Every cell that a border crosses has the material of its
largest part. Giving all cells at the border of one region its material, or none of them, whichever is farther from the
found answer, shifts the answer by more than the true error. These shifts, summed over the regions so that opposite
errors do not cancel, are a part of the stated error.

If the nodes of cells follow a border, changing whole cells overestimates the error of the curve between nodes, as of a
polygon in a circle. The error is then at most a multiple of the missed volume relative to the smallest adjacent volume:
twice, as a bending or torsion stiffness grows with the square of a section's area, and a quarter more, since the missed
volume is itself computed with flat pieces.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

from softmark.interpreter.verification.probe_errors import NoErrorEstimate

if TYPE_CHECKING:
    from softmark.interpreter.verification.probe_errors import ProbeResultUnderTest
    from softmark.interpreter.verification.solution_under_test import SolutionUnderTest

STIFFER = 2.5  # factor on the relative volume error


def region_border_errors(whole: SolutionUnderTest) -> dict[str, Callable[[ProbeResultUnderTest], float]]:
    """Return the error part due to material regions, as {part name: function of a probe result}.

    It is empty if the meshes follow the borders of the regions.
    """
    from softmark.interpreter.models.shared.region_cells import region_errors

    found = region_errors(whole.case, whole.prepared)
    if not found:
        return {}
    return {"regions": lambda seen: sum(_region_shift(whole, seen, left, way) for left, way in found)}


def _region_shift(whole: SolutionUnderTest, seen: ProbeResultUnderTest, left: float, way: tuple[int, int]) -> float:
    """Return the change of a result if all cells that the border of a region crosses get the material of one side.

    `way` is the number of the region, and 1 if the cells get its material or -1 if they get the other. The change
    is limited to the effect of the volume with the wrong material; `left` is this volume relative to the smallest
    adjacent volume. For `way` (0, 0) this limit is returned.
    """
    most = math.inf if math.isinf(left) else STIFFER * left * seen.size
    if way == (0, 0):
        return most
    try:
        solution, _ = whole.solve_other_model(f"leaning {way}", whole.declared, replace(whole.case, leaning=way))
        return min(most, seen.apart(seen.of(solution)))
    except NoErrorEstimate:
        if math.isinf(most):
            raise
        return most
