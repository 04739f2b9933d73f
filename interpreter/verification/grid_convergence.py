"""Grid convergence index (Roache 1994) of a metric, from meshes of two or three sizes."""

from __future__ import annotations

import math
from collections.abc import Sequence

from softmark.interpreter.verification.probe_errors import NoErrorEstimate

FIRST = 3.0  # safety factor of two grids, or of an order far from theory (Roache 1994)
HIGHEST = 2.0  # order that two grids count on at most
THREE = 1.25  # safety factor of three grids with the theoretical order
NEAR = 0.5  # allowed difference from the theoretical order
LEAST = 0.5  # least useful observed order
COARSE = 0.3  # relative distance of two grids above which neither is useful
HOPELESS = 1.0  # relative error above which nothing is stated


def convergence_index(apart: float, ratio: float, theory: float, farther: float | None = None) -> float:
    """Return the error of a grid, from its distance `apart` to a grid that is `ratio` times coarser.

    `theory` is the order of smooth solutions. Two grids use at most the order HIGHEST, since edges of supports reduce
    it. `farther` is the distance from that coarser grid to the next coarser one. It decides if the first two grids are
    closer than theory predicts, because then they agree by chance or are too coarse.
    """
    formal = min(theory, HIGHEST)
    if farther is None or not farther > 0.0 or not apart > 0.0:
        return FIRST * apart / _error_ratio(ratio, formal)
    order = math.log(farther / apart) / math.log(ratio)
    if order > theory + NEAR:
        return FIRST * farther * math.exp(-theory * math.log(ratio)) / _error_ratio(ratio, formal)
    if order >= theory - NEAR:
        return THREE * apart / _error_ratio(ratio, min(order, theory))
    return FIRST * apart / _error_ratio(ratio, min(max(order, LEAST), formal))


def error_from_finer(apart: float, ratio: float, theory: float, farther: float | None = None) -> float:
    """Return the error of a solution, from its distance `apart` to a solution that is `ratio` times finer.

    `farther` is the distance to a solution that is `ratio` times coarser. The order is the observed one, between LEAST
    and that of smooth solutions, `theory`; half of `theory` if there is no coarser solution. A finer solution that is
    closer than theory predicts agrees by chance.
    """
    if farther is None or not farther > 0.0 or not apart > 0.0:
        return apart / -math.expm1(-0.5 * theory * math.log(ratio))
    apart = max(apart, farther * math.exp(-theory * math.log(ratio)))
    order = min(max(math.log(farther / apart) / math.log(ratio), LEAST), theory)
    return THREE * apart / -math.expm1(-order * math.log(ratio))


def _error_ratio(ratio: float, order: float) -> float:
    """Return the ratio r^p - 1 of the distance between two grids to the error of the finer one."""
    return math.expm1(order * math.log(ratio))


def require_close_grids(apart: Sequence[float], size: float, limit: float = COARSE) -> None:
    """Raise NoErrorEstimate if two grids differ by more than a fraction of the `size` of the result."""
    if max(apart) > limit * size:
        raise NoErrorEstimate(
            "the mesh is too coarse for an error estimate: the result on another mesh differs by "
            f"{100 * max(apart) / size:.2g} %"
        )
