"""Errors from meshes of two or three sizes: grid convergence indices (Roache 1994) of what a metric sees."""

from __future__ import annotations

import math
from collections.abc import Sequence

from softmark.interpreter.evidence.probe_answers import Unknown

FIRST = 3.0  # safety factor of two grids, as if errors fell with the size alone, and of an order far from theory
THREE = 1.25  # of three whose order is that of theory
NEAR = 0.5  # how far it may be from that
LEAST = 0.5  # order below which three grids say no more than two
COARSE = 0.3  # relative distance of two grids above which neither says anything
HOPELESS = 1.0  # relative: an error of all that moves is no statement


def index(apart: float, ratio: float, theory: float, farther: float | None = None) -> float:
    """The error of a grid, from its distance to one that is `ratio` times coarser, and that to the next coarser one.

    `theory` is the order that smooth solutions have. Orders above it are those of meshes that are too coarse.
    """
    if farther is None or not farther > 0.0 or not apart > 0.0:
        return FIRST * apart / (ratio - 1.0)
    order = math.log(farther / apart) / math.log(ratio)
    if abs(order - theory) <= NEAR:
        return THREE * apart / math.expm1(min(order, theory) * math.log(ratio))
    return FIRST * apart / math.expm1(min(max(order, LEAST), 1.0) * math.log(ratio))


def must_tell(apart: Sequence[float], size: float, limit: float = COARSE) -> None:
    """Raises Unknown where two grids are farther apart than a part of the `size` of what is measured."""
    if max(apart) > limit * size:
        raise Unknown(f"the mesh is too coarse to say: another one is {100 * max(apart) / size:.2g} % away")
