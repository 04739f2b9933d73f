"""Regions with their own material, and which region counts where regions overlap."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import combinations
from typing import Any

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.language.coordinate_conditions import Condition, Point
from softmark.interpreter.problem.body_case import Case, Fault, fault

MOST = 3000  # largest number of boxes searched for an overlap


def region_conditions(case: Case) -> tuple[Condition, ...]:
    """Return the condition under which each region has its material: its own, without regions that overlie it.

    Where regions of one material overlap, the first of them counts.
    """
    found = []
    for i, part in enumerate(case.parts):
        where = part.thing.where
        for j, other in enumerate(case.parts):
            alike = other.thing.material == part.thing.material and other.name not in part.thing.over
            if part.name in other.thing.over or (alike and j < i):
                where = Condition.junction("and", where, Condition.negation(other.thing.where))
        found.append(where)
    return tuple(found)


def material_numbers(case: Case, X: Any, members: Callable[[str], Any]) -> Any:
    """Return the material number (n,) of each point X (n, 3), m; 0 is the material of the body.

    `members` returns a mask of the points that are in a named group.
    """
    import numpy as np

    from softmark.interpreter.problem.mesh_group_conditions import split_by_groups

    found = np.zeros(len(X), dtype=np.int64)
    bounds = case.shape.bounds or (X.min(axis=0), X.max(axis=0))
    for i, where in enumerate(region_conditions(case), start=1):
        for own, which in split_by_groups(where, members):
            x, y, z = X[which].T
            held = np.broadcast_to(own.holds(x, y, z, math.dist(*bounds)), len(x))
            found[which] = np.where(held, i, found[which])
    return found


def unordered_overlaps(case: Case) -> list[tuple[Declared, Declared]]:
    """Return pairs of overlapping regions of different materials for which the scene gives no order."""
    return [
        (a, b) for a, b in combinations(case.parts, 2)
        if a.thing.material != b.thing.material and a.name not in b.thing.over and b.name not in a.thing.over
    ]  # fmt: skip


def overlap_fault(a: Declared, b: Declared, label: str) -> Fault:
    """Return the Fault about two overlapping regions whose order is not given."""
    return fault(
        "E592", b.at("where" if b.thing.group is None else "name"),
        f"`{a.name}` and `{b.name}` overlap and have different materials", label,
        f"write `over = [{a.name}]` in `{b.name}`, which then replaces `{a.name}`, or exclude `{a.name}`: "
        f"`where = ... and not {a.name}`",
    )  # fmt: skip


def find_common_point(a: Condition, b: Condition, low: Point, high: Point) -> Point | None:
    """Return the middle of a box in which both conditions hold everywhere, m; None if none was found.

    The box from `low` to `high`, m, is halved repeatedly across its longest side, the largest box first.
    """
    extent, boxes = math.dist(low, high), [(low, high)]
    for low, high in boxes:  # grows in the loop
        bounds = [where.over(low, high, extent) for where in (a, b)]
        if not all(true for _, true in bounds):
            continue
        if not any(false for false, _ in bounds):
            x, y, z = (0.5 * (p + q) for p, q in zip(low, high, strict=True))
            return x, y, z
        if len(boxes) < MOST:
            boxes += _halves(low, high)
    return None


def _halves(low: Sequence[float], high: Sequence[float]) -> list[tuple[Point, Point]]:
    """Return the two halves of a box, cut across its longest side."""
    i = max(range(3), key=lambda k: high[k] - low[k])
    middle = 0.5 * (low[i] + high[i])
    upper, lower = list(high), list(low)
    upper[i] = lower[i] = middle
    return [(_point(low), _point(upper)), (_point(lower), _point(high))]


def _point(p: Sequence[float]) -> Point:
    x, y, z = p
    return x, y, z
