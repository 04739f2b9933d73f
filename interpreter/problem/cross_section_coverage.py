"""Coverage of cross-sections by conditions: how much of each section is selected, and where that changes."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from softmark.interpreter.language.coordinate_conditions import RELATIVE_TOLERANCE, Border, Condition, Point
from softmark.solvers.mesh.shape import add_multiples, dot

if TYPE_CHECKING:
    from softmark.solvers.mesh.shape import Section, Swept, Vector3

END = 1e-6  # relative to the length: borders closer to an end face are that face
SAME = 1e-8  # relative to the length: stations that are nearer are one
GRID = 256  # stretches of the length in which a border is looked for
HALVINGS = 45  # of a stretch, to the rounding of its stations
LITTLE = 1e-7  # relative to a cross-section: less is nothing


def coverage(condition: Condition, shape: Swept, station: float) -> str:
    """Return how much of the cross-section at `station` (m from the root) a condition selects: all, some or none."""
    return next(iter(coverages(condition, shape, [station])))


@lru_cache(maxsize=256)
def selects_whole_sections(condition: Condition, shape: Swept, stations: tuple[float, ...]) -> tuple[bool, ...]:
    """Return whether a condition selects the whole cross-section at each station; used for supports of beams."""
    return tuple(_is_section_selected(condition, shape, s) for s in stations)


def coverages(condition: Condition, shape: Swept, stations: Sequence[float]) -> set[str]:
    """Return the set of coverages (all, some, none) of the cross-sections at `stations`, m, in ascending order.

    The search stops at the first coverage `some`. Bounds over long parts of the body decide most stations at
    once, so that the work grows with the logarithm of their number.
    """
    extent, found, pending = shape.diagonal, set(), [(0, len(stations))]
    while pending and "some" not in found:
        first, end = pending.pop()
        false, true = condition.over(*shape.bounds_between(stations[first], stations[end - 1]), extent)
        if not (false and true):
            found.add("all" if true else "none")
        elif end - first > 1:
            middle = (first + end) // 2
            pending += [(first, middle), (middle, end)]
        else:
            found.add(_measure_coverage(condition, shape, stations[first], extent))
    return found


def _measure_coverage(condition: Condition, shape: Swept, station: float, extent: float) -> str:
    """Return whether a condition selects all, some or none of a cross-section, by sample points or by area.

    It is called for cross-sections for which bounds give no answer.
    """
    held = {bool(condition.holds(*point, extent)) for point in _points(shape, station)}
    if len(held) == 2:
        return "some"
    if _has_no_crossing_border(condition, shape, station, extent):
        return "all" if held == {True} else "none"
    from softmark.interpreter.problem.surface_selection.section_selection import selected_share

    taken = selected_share(condition, shape, station)
    if held == {True}:
        return "all" if taken >= 1.0 - LITTLE else "some"
    return "none" if taken <= LITTLE else "some"


def _has_no_crossing_border(condition: Condition, shape: Swept, station: float, extent: float) -> bool:
    """Return whether no plane border crosses the cross-section; computing areas near a parallel border is expensive."""
    _, first, second = shape.frame(station)
    centre, section = shape.centre(station), shape.section_at(station)
    for border in condition.borders:
        if border.plane is None:
            return False
        a, slack = border.plane[:3], RELATIVE_TOLERANCE * extent**border.power
        level = dot(a, centre) + border.plane[3]
        low = level - section.support(-dot(a, first), -dot(a, second))
        if low < -slack and level + section.support(dot(a, first), dot(a, second)) > slack:
            return False
    return True


@lru_cache(maxsize=256)
def inner_stations(condition: Condition, shape: Swept) -> tuple[tuple[float, str], ...]:
    """Return stations, m, and their coverage: one in each stretch of equal coverage, and one at each change.

    End faces are left out. A border of the condition can change the coverage only between the first and the last
    station at which it meets a cross-section. Stretches between these are sampled at five stations, for borders along
    the axis.
    """
    length = shape.length
    apart = _merge_near([END * length, (1.0 - END) * length, *_crossing_stations(condition, shape)], SAME * length)
    some = [a + (b - a) * t for a, b in pairwise(apart) for t in (0.02, 0.25, 0.5, 0.75, 0.98)]
    stations = sorted([*some, *apart[1:-1]])
    return tuple((s, coverage(condition, shape, s)) for s in stations)


def selected_end_faces(condition: Condition, shape: Swept) -> set[int]:
    """Return the end faces that a condition selects wholly; 0 is the root.

    The result is empty if it selects a part of a face, or anything else.
    """
    covers = [coverage(condition, shape, s) for s in (0.0, shape.length)]
    if "some" in covers or "all" not in covers or {cover for _, cover in inner_stations(condition, shape)} != {"none"}:
        return set()
    return {end for end, cover in enumerate(covers) if cover == "all"}


def single_selected_end(condition: Condition, shape: Swept) -> int | None:
    """Return the end face that a condition selects, 0 for the root; None unless it selects exactly one whole face."""
    found = selected_end_faces(condition, shape)
    return found.pop() if len(found) == 1 else None


def end_frame(shape: Swept, end: int) -> tuple[Vector3, Vector3]:
    """Return the centre, m, of an end face of a straight body, and the unit vector into the body.

    `end` 0 is the root.
    """
    if end == 0:
        return shape.root, shape.axis
    return add_multiples(shape.root, (shape.length, shape.axis)), add_multiples((0.0, 0.0, 0.0), (-1.0, shape.axis))


def _merge_near(marks: list[float], near: float) -> list[float]:
    """Return the marks in ascending order, with marks closer than `near` merged into their middle."""
    found: list[list[float]] = []
    for mark in sorted(marks):
        if found and mark - found[-1][1] <= near:
            found[-1][1] = mark
        else:
            found.append([mark, mark])
    return [0.5 * (first + last) for first, last in found]


def _crossing_stations(condition: Condition, shape: Swept) -> list[float]:
    """Return the stations along the axis at which a border of the condition starts or stops crossing sections."""
    extent = shape.diagonal
    return [
        s
        for border in condition.borders
        for s in _stations_of_border(border, shape, RELATIVE_TOLERANCE * extent**border.power)
    ]


def _stations_of_border(border: Border, shape: Swept, slack: float) -> list[float]:
    """Return the stations, m, at which one border starts or stops crossing cross-sections, to rounding.

    Between two such stations the level of the border has both signs in every cross-section.
    """

    def crossed(a: float, b: float) -> bool:
        level = border.over(*shape.bounds_between(a, b))
        return level.low < -slack and level.high > slack

    pending, slabs = [(0.0, shape.length)], []
    while pending:
        a, b = pending.pop()
        if not crossed(a, b):
            continue
        if b - a > 1.5 * shape.length / GRID:
            pending += [(0.5 * (a + b), b), (a, 0.5 * (a + b))]
        else:
            slabs.append((a, b))
    found = []
    for i, (a, b) in enumerate(slabs):
        if i == 0 or slabs[i - 1][1] < a:
            found.append(_bisect_first(a, b, lambda t, a=a: crossed(a, t)))
        if i == len(slabs) - 1 or slabs[i + 1][0] > b:
            found.append(_bisect_first(b, a, lambda t, b=b: crossed(t, b)))
    return [s for s in found if END * shape.length < s < (1.0 - END) * shape.length]


def _bisect_first(near: float, far: float, holds: Any) -> float:
    """Return the position between `near` and `far` at which a predicate that holds at `far` begins to hold."""
    if holds(near):
        return near
    for _ in range(HALVINGS):
        middle = 0.5 * (near + far)
        near, far = (near, middle) if holds(middle) else (middle, far)
    return far


@lru_cache(maxsize=64)
def _section_points(section: Section) -> tuple[tuple[float, float], ...]:
    """Return sample points of a cross-section, in its two coordinates, m."""
    return tuple(section.samples())


def _points(shape: Swept, station: float) -> list[Point]:
    """Return sample points in space of the cross-section at a station, m."""
    _, (ax, ay, az), (bx, by, bz) = shape.frame(station)
    x, y, z = shape.centre(station)
    own = _section_points(shape.section_at(station))
    return [(x + (u * ax + v * bx), y + (u * ay + v * by), z + (u * az + v * bz)) for u, v in own]


def selection_borders(condition: Condition, shape: Swept) -> list[float]:
    """Return the stations, m, inside the body at which a selection of whole cross-sections begins or ends.

    The end faces are left out, although conditions hold slightly beyond them by their tolerance.
    """
    found = inner_stations(condition, shape)
    ends = ((s, _is_section_selected(condition, shape, s)) for s in (END * shape.length, (1 - END) * shape.length))
    (first, last) = ends
    known = [first, *((s, cover == "all") for s, cover in found), last]
    return [
        _bisect_border(condition, shape, *((a, b) if before else (b, a)))
        for (a, before), (b, after) in pairwise(known)
        if before != after
    ]


def _is_section_selected(condition: Condition, shape: Swept, station: float) -> bool:
    return coverage(condition, shape, station) == "all"


def _bisect_border(condition: Condition, shape: Swept, inside: float, outside: float) -> float:
    """Return the last selected station, m, by bisection between a station inside the selection and one outside it."""
    while abs(outside - inside) > 1e-12 * shape.length:
        middle = 0.5 * (inside + outside)
        inside, outside = (middle, outside) if _is_section_selected(condition, shape, middle) else (inside, middle)
    return inside
