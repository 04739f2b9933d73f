"""Errors from meshes of two or three sizes: grid convergence indices (Roache 1994) of what a metric sees."""

from __future__ import annotations

import math
from collections.abc import Sequence

from softmark.interpreter.verification.probe_errors import Unknown

FIRST = 3.0  # safety factor of two grids, and of an order far from theory (Roache 1994)
HIGHEST = 2.0  # order that two grids count on at most
THREE = 1.25  # of three whose order is that of theory
NEAR = 0.5  # how far it may be from that
LEAST = 0.5  # order below which three grids say no more than two
COARSE = 0.3  # relative distance of two grids above which neither says anything
HOPELESS = 1.0  # relative: an error of all that moves is no statement


def index(apart: float, ratio: float, theory: float, farther: float | None = None) -> float:
    """The error of a grid, from its distance to one that is `ratio` times coarser, and that to the next coarser one.

    `theory` is the order that smooth solutions have. Two grids count on no more than HIGHEST of it, for edges that are
    held leave less. Grids nearer than theory has it agree by chance, or are too coarse: then the farther one tells.
    """
    formal = min(theory, HIGHEST)
    if farther is None or not farther > 0.0 or not apart > 0.0:
        return FIRST * apart / _fall(ratio, formal)
    order = math.log(farther / apart) / math.log(ratio)
    if order > theory + NEAR:
        return FIRST * farther * math.exp(-theory * math.log(ratio)) / _fall(ratio, formal)
    if order >= theory - NEAR:
        return THREE * apart / _fall(ratio, min(order, theory))
    return FIRST * apart / _fall(ratio, min(max(order, LEAST), formal))


def _fall(ratio: float, order: float) -> float:
    """r^p - 1: the distance of two grids over the error of the finer one."""
    return math.expm1(order * math.log(ratio))


def must_tell(apart: Sequence[float], size: float, limit: float = COARSE) -> None:
    """Raises Unknown where two grids are farther apart than a part of the `size` of what is measured."""
    if max(apart) > limit * size:
        raise Unknown(f"the mesh is too coarse to say: another one is {100 * max(apart) / size:.2g} % away")
