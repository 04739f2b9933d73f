"""Simple polygons as plain numbers: validity, area, and containment of points.

A polygon is a sequence of corners (x, y), m.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import lru_cache
from itertools import combinations
from typing import NamedTuple

Place = tuple[float, float]
Corners = tuple[Place, ...]

SAME = 1e-9  # relative to the size: closer points coincide
THIN = 1e-9  # relative to the size squared: smaller areas are zero, and smaller angles are no corners
MOST = 500  # largest number of corners: all pairs of sides are compared


@lru_cache(maxsize=64)
def polygon_fault(corners: Corners) -> str:
    """Return why corners, m, define no simple polygon; "" if they define one."""
    if len(corners) < 3:
        return f"a polygon needs at least three corners, and there are {len(corners)}"
    if len(corners) > MOST:
        return (
            f"it has {len(corners)} corners, more than the limit of {MOST}: use fewer, or a `tetrahedralized` surface"
        )
    size = extent(corners)
    for (i, a), (j, b) in combinations(enumerate(corners, 1), 2):
        if math.dist(a, b) <= SAME * size:
            closing = "; do not repeat the first corner at the end" if (i, j) == (1, len(corners)) else ""
            return f"its corners {i} and {j} are at the same position{closing}"
    if max(map(abs, turn_sines(corners))) <= THIN:
        return "all its corners lie on one line"
    sides = list(enumerate(edges(corners), 1))
    for (i, one), (j, other) in combinations(sides, 2):
        if _sides_touch(one, other, SAME * size):
            return f"its sides from corner {i} and from corner {j} intersect or touch"
    return "it has no area" if abs(signed_area(corners)) <= THIN * size**2 else ""


def extent(corners: Corners) -> float:
    """Return the diagonal of the polygon's bounding box, m."""
    low, high = coordinate_range(corners)
    return math.dist(low, high)


def coordinate_range(corners: Corners) -> tuple[Place, Place]:
    """Return the lowest and the highest x and y of the corners, m, as two pairs."""
    x, y = zip(*corners, strict=True)
    return (min(x), min(y)), (max(x), max(y))


def edges(corners: Sequence[Place]) -> Iterator[tuple[Place, Place]]:
    """Yield the sides of the polygon as pairs of corners; the last side ends at the first corner."""
    return zip(corners, (*corners[1:], corners[0]), strict=True)


def signed_area(corners: Corners) -> float:
    """Return the area, m^2, positive if corners go counter-clockwise."""
    (x0, y0), *_ = corners
    return 0.5 * math.fsum((a - x0) * (d - y0) - (c - x0) * (b - y0) for (a, b), (c, d) in edges(corners))


@lru_cache(maxsize=64)
def orient_counterclockwise(corners: Corners) -> Corners:
    """Return the corners in counter-clockwise order."""
    return corners if signed_area(corners) > 0.0 else corners[::-1]


def centroid(corners: Corners) -> Place:
    """Return the centroid of the area, m."""
    (x0, y0), *_ = corners
    moments = [0.0, 0.0]
    for (a, b), (c, d) in edges([(x - x0, y - y0) for x, y in corners]):
        moments[0] += (a + c) * (a * d - c * b) / 6.0
        moments[1] += (b + d) * (a * d - c * b) / 6.0
    area = signed_area(corners)
    return x0 + moments[0] / area, y0 + moments[1] / area


def contains_point(corners: Corners, x: float, y: float, slack: float) -> bool:
    """Return whether the polygon contains a point, within `slack` (m)."""
    inside = False
    for (a, b), (c, d) in edges(corners):
        if distance_to_side((x, y), ((a, b), (c, d))) <= slack:
            return True
        if (b > y) != (d > y) and x < a + (y - b) / (d - b) * (c - a):
            inside = not inside
    return inside


def distance_to_side(point: Place, side: tuple[Place, Place]) -> float:
    """Return the distance of a point from a side, m."""
    (a, b), (c, d) = side
    length = (c - a) ** 2 + (d - b) ** 2
    t = 0.0 if length == 0.0 else ((point[0] - a) * (c - a) + (point[1] - b) * (d - b)) / length
    t = min(1.0, max(0.0, t))
    return math.hypot(point[0] - a - t * (c - a), point[1] - b - t * (d - b))


def turn_sines(corners: Corners) -> list[float]:
    """Return the sine of the turning angle at each corner, positive for a left turn."""
    found = []
    for i, (x, y) in enumerate(corners):
        (a, b), (c, d) = corners[i - 1], corners[(i + 1) % len(corners)]
        one, two = (x - a, y - b), (c - x, d - y)
        found.append((one[0] * two[1] - one[1] * two[0]) / (math.hypot(*one) * math.hypot(*two)))
    return found


def is_convex(corners: Corners) -> bool:
    """Return whether a counter-clockwise polygon turns left, or goes straight on, at each corner."""
    return min(turn_sines(corners)) >= -SAME


def is_axis_parallel(corners: Corners) -> bool:
    """Return whether all sides are parallel to the axes."""
    slack = SAME * extent(corners)
    return all(min(abs(a - c), abs(b - d)) <= slack for (a, b), (c, d) in edges(corners))


def _sides_touch(one: tuple[Place, Place], other: tuple[Place, Place], slack: float) -> bool:
    """Return whether two sides touch or cross, within `slack` (m), other than at a corner of both."""
    shared = set(one) & set(other)
    if shared:
        (corner,) = shared if len(shared) == 1 else (one[0],)
        free = [p for side in (one, other) for p in side if p != corner]
        return any(distance_to_side(p, side) <= slack for p, side in zip(free, (other, one), strict=False))
    if min(distance_to_side(p, other) for p in one) <= slack or min(distance_to_side(p, one) for p in other) <= slack:
        return True
    return _product_of_line_sides(one, other) < 0.0 and _product_of_line_sides(other, one) < 0.0


def _product_of_line_sides(line: tuple[Place, Place], other: tuple[Place, Place]) -> float:
    """Return -1 if the ends of the segment `other` are on opposite sides of a line, else 1.

    The line goes through the two points of `line`.
    """
    (a, b), (c, d) = line
    p, q = ((c - a) * (y - b) - (d - b) * (x - a) for x, y in other)
    return math.copysign(1.0, p) * math.copysign(1.0, q)


class Trapezoid(NamedTuple):
    """An isosceles trapezoid: two parallel sides of lengths `ends`, m, at the distance `length`, m, from each other.

    The parallel sides are normal to the coordinate `along` (0 or 1), and the first lies at its value `begin`. Both are
    centred at the value `middle` of the other coordinate.
    """

    along: int
    begin: float
    length: float
    middle: float
    ends: tuple[float, float]


@lru_cache(maxsize=64)
def find_trapezoid(corners: Corners) -> Trapezoid | None:
    """Return the corners as an isosceles trapezoid with parallel sides normal to x or y, or None if they form none.

    If both directions are possible, the one with the larger distance between the parallel sides is taken.
    """
    if len(corners) != 4:
        return None
    sides, found, slack = list(edges(corners)), [], SAME * extent(corners)
    for one, other in ((sides[0], sides[2]), (sides[1], sides[3])):
        for k in (0, 1):
            (a, c), (b, d) = (sorted(end[k] for end in side) for side in (one, other))
            if max(abs(c - a), abs(d - b)) > slack or abs(a - b) <= slack:
                continue
            spans = [sorted(end[1 - k] for end in side) for side in ((one, other) if a < b else (other, one))]
            middles = [0.5 * (low + high) for low, high in spans]
            sizes = spans[0][1] - spans[0][0], spans[1][1] - spans[1][0]
            if abs(middles[1] - middles[0]) <= slack and min(sizes) > slack:
                found.append(Trapezoid(k, min(a, b), abs(b - a), middles[0], sizes))
    return max(found, key=lambda t: t.length, default=None)
