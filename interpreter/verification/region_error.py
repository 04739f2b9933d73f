"""Error of meshes whose cells do not follow the borders of regions, so that cells have the wrong material.

Every cell that a border crosses has the material of its largest part. Giving all cells at the border of one region its
material, or none of them, whichever is farther from the found answer, shifts the answer by more than the true error.
These shifts, summed over the regions so that opposite errors do not cancel, are a part of the stated error.

If cells follow a border with their nodes, whole cells overestimate the error of the curve between nodes, as of a
polygon in a circle. That part is then at most the missed volume relative to the smallest adjacent volume: twice that,
as a bending or torsion stiffness grows with the square of a section's area, and a quarter more, since the missed volume
is itself computed with flat pieces.
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


def parts(whole: SolutionUnderTest) -> dict[str, Callable[[ProbeResultUnderTest], float]]:
    """Return the part of the stated error due to regions; none if meshes follow their borders."""
    from softmark.interpreter.models.shared.region_cells import region_errors

    found = region_errors(whole.case, whole.prepared)
    if not found:
        return {}
    return {"regions": lambda seen: sum(_region_shift(whole, seen, left, way) for left, way in found)}


def _region_shift(whole: SolutionUnderTest, seen: ProbeResultUnderTest, left: float, way: tuple[int, int]) -> float:
    """Return the shift with one material in all cells at the border, or the effect of the missed volume if smaller."""
    most = math.inf if math.isinf(left) else STIFFER * left * seen.size
    if way == (0, 0):
        return most
    try:
        solution, _ = whole.solved(f"leaning {way}", whole.declared, replace(whole.case, leaning=way))
        return min(most, seen.apart(seen.of(solution)))
    except NoErrorEstimate:
        if math.isinf(most):
            raise
        return most
