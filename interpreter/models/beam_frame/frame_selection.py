"""Selections on a network: points and members that a condition selects, and the member on whose axis a point lies."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

from softmark.interpreter.language.coordinate_conditions import Condition
from softmark.interpreter.models.beam.beam_declaration import on_axis

if TYPE_CHECKING:
    from softmark.solvers.mesh.frame_shapes import Member, Network
    from softmark.solvers.mesh.shape import Vector3

HALVINGS = 12  # number of bisections of a member by which bounds of a condition are evaluated
END = 1e-3  # of a member: a selection this near to its end counts as the end


@lru_cache(maxsize=256)
def select_points_and_members(
    condition: Condition, network: Network
) -> tuple[tuple[int, ...], tuple[int, ...], tuple[int, ...]]:
    """Return the points, whole members and partly selected members of a condition, each counted from 0.

    The ends of a member do not count. Conditions are evaluated on axes, by bounds over pieces of them; where the
    bounds remain undecided, the middle of the piece decides.
    """
    size = network.diagonal
    points = tuple(i for i, point in enumerate(network.points) if condition.holds(*point, size))
    taken = [_condition_along_axis(condition, member, size) for member in network.members]
    whole = tuple(i for i, found in enumerate(taken) if found == {True} and _has_both_ends(network, i, points))
    part = tuple(i for i, found in enumerate(taken) if True in found and i not in whole)
    return points, whole, part


def _has_both_ends(network: Network, member: int, points: tuple[int, ...]) -> bool:
    """Return whether both ends of a member are among the points."""
    return {n - 1 for n in network.pairs[member]} <= set(points)


def _condition_along_axis(condition: Condition, member: Member, size: float) -> set[bool]:
    """Return the set of values that a condition has along the axis of a member, excluding its ends."""
    found: set[bool] = set()
    pending = [(END * member.length, (1.0 - END) * member.length, 0)]
    while pending and len(found) < 2:
        first, last, deep = pending.pop()
        ends = zip(member.centre(first), member.centre(last), strict=True)
        low, high = zip(*((min(pair), max(pair)) for pair in ends), strict=True)
        false, true = condition.over(low, high, size)
        if not (false and true):
            found.add(true)
        elif deep < HALVINGS:
            middle = 0.5 * (first + last)
            pending += [(first, middle, deep + 1), (middle, last, deep + 1)]
        else:
            found.add(bool(condition.holds(*member.centre(0.5 * (first + last)), size)))
    return found


def locate_on_member(network: Network, point: Vector3) -> tuple[int, float] | None:
    """Return the first member whose axis contains a point (counted from 0), and the station, m; else None."""
    for i, member in enumerate(network.members):
        if (s := on_axis(member, point)) is not None:
            return i, s
    return None


def locate_line_on_member(network: Network, begin: Vector3, end: Vector3) -> tuple[int, float, float] | None:
    """Return the member along whose axis a line runs (counted from 0), and the stations of its ends, m; else None."""
    for i, member in enumerate(network.members):
        first, last = on_axis(member, begin), on_axis(member, end)
        if first is not None and last is not None:
            return i, min(first, last), max(first, last)
    return None
