"""Simple polygons: what is wrong with one, its area, and what lies within it. Plain numbers."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import lru_cache
from itertools import combinations
from typing import NamedTuple

Place = tuple[float, float]
Corners = tuple[Place, ...]

SAME = 1e-9  # of its size: what is nearer is at one place
THIN = 1e-9  # of its size squared: an area that is no more is none, and so much of an angle is no turn
MOST = 500  # corners: each pair of sides is looked at


@lru_cache(maxsize=64)
def fault(corners: Corners) -> str:
    """Why corners, m, make no simple polygon, in words; "" where they do."""
    if len(corners) < 3:
        return f"a polygon has three corners at least, and {len(corners)} are given"
    if len(corners) > MOST:
        return f"it has {len(corners)} corners, and {MOST} are looked at: take fewer, or a `filled` surface"
    size = extent(corners)
    for (i, a), (j, b) in combinations(enumerate(corners, 1), 2):
        if math.dist(a, b) <= SAME * size:
            closing = "; the last corner is joined to the first by itself" if (i, j) == (1, len(corners)) else ""
            return f"its corners {i} and {j} are at one place{closing}"
    if max(map(abs, turns(corners))) <= THIN:
        return "all its corners lie on one line"
    sides = list(enumerate(edges(corners), 1))
    for (i, one), (j, other) in combinations(sides, 2):
        if _touch(one, other, SAME * size):
            return f"its sides from corner {i} and from corner {j} cross or touch"
    return "it has no area" if abs(signed(corners)) <= THIN * size**2 else ""


def extent(corners: Corners) -> float:
    """Diagonal of its bounds, m."""
    low, high = ends(corners)
    return math.dist(low, high)


def ends(corners: Corners) -> tuple[Place, Place]:
    """Its lowest and its highest coordinates, m."""
    x, y = zip(*corners, strict=True)
    return (min(x), min(y)), (max(x), max(y))


def edges(corners: Sequence[Place]) -> Iterator[tuple[Place, Place]]:
    """Its sides, the last back to the first corner."""
    return zip(corners, (*corners[1:], corners[0]), strict=True)


def signed(corners: Corners) -> float:
    """Its area, m^2, positive where corners go counter-clockwise."""
    (x0, y0), *_ = corners
    return 0.5 * math.fsum((a - x0) * (d - y0) - (c - x0) * (b - y0) for (a, b), (c, d) in edges(corners))


@lru_cache(maxsize=64)
def turned(corners: Corners) -> Corners:
    """The same, counter-clockwise."""
    return corners if signed(corners) > 0.0 else corners[::-1]


def centroid(corners: Corners) -> Place:
    """The middle of its area, m."""
    (x0, y0), *_ = corners
    moments = [0.0, 0.0]
    for (a, b), (c, d) in edges([(x - x0, y - y0) for x, y in corners]):
        moments[0] += (a + c) * (a * d - c * b) / 6.0
        moments[1] += (b + d) * (a * d - c * b) / 6.0
    area = signed(corners)
    return x0 + moments[0] / area, y0 + moments[1] / area


def within(corners: Corners, x: float, y: float, slack: float) -> bool:
    """Whether it holds a point, give or take `slack` (m)."""
    inside = False
    for (a, b), (c, d) in edges(corners):
        if away((x, y), ((a, b), (c, d))) <= slack:
            return True
        if (b > y) != (d > y) and x < a + (y - b) / (d - b) * (c - a):
            inside = not inside
    return inside


def away(point: Place, side: tuple[Place, Place]) -> float:
    """How far a point is from a side, m."""
    (a, b), (c, d) = side
    length = (c - a) ** 2 + (d - b) ** 2
    t = 0.0 if length == 0.0 else ((point[0] - a) * (c - a) + (point[1] - b) * (d - b)) / length
    t = min(1.0, max(0.0, t))
    return math.hypot(point[0] - a - t * (c - a), point[1] - b - t * (d - b))


def turns(corners: Corners) -> list[float]:
    """The sine of the angle by which it turns left at each corner."""
    found = []
    for i, (x, y) in enumerate(corners):
        (a, b), (c, d) = corners[i - 1], corners[(i + 1) % len(corners)]
        one, two = (x - a, y - b), (c - x, d - y)
        found.append((one[0] * two[1] - one[1] * two[0]) / (math.hypot(*one) * math.hypot(*two)))
    return found


def convex(corners: Corners) -> bool:
    """Whether a counter-clockwise one turns left, or goes on straight, at each corner."""
    return min(turns(corners)) >= -SAME


def square(corners: Corners) -> bool:
    """Whether all its sides go along the axes."""
    slack = SAME * extent(corners)
    return all(min(abs(a - c), abs(b - d)) <= slack for (a, b), (c, d) in edges(corners))


def _touch(one: tuple[Place, Place], other: tuple[Place, Place], slack: float) -> bool:
    """Whether two sides have a point in common that is no corner of both."""
    shared = set(one) & set(other)
    if shared:
        (corner,) = shared if len(shared) == 1 else (one[0],)
        free = [p for side in (one, other) for p in side if p != corner]
        return any(away(p, side) <= slack for p, side in zip(free, (other, one), strict=False))
    if min(away(p, other) for p in one) <= slack or min(away(p, one) for p in other) <= slack:
        return True
    return _sides(one, other) < 0.0 and _sides(other, one) < 0.0


def _sides(line: tuple[Place, Place], other: tuple[Place, Place]) -> float:
    """Negative where the ends of another segment are on two sides of a line."""
    (a, b), (c, d) = line
    p, q = ((c - a) * (y - b) - (d - b) * (x - a) for x, y in other)
    return math.copysign(1.0, p) * math.copysign(1.0, q)


class Trapezoid(NamedTuple):
    """Two sides across a coordinate (0 or 1), `ends` long, m, `length` apart, whose middles have the same other one."""

    along: int
    begin: float
    length: float
    middle: float
    ends: tuple[float, float]


@lru_cache(maxsize=64)
def trapezoid(corners: Corners) -> Trapezoid | None:
    """One as the longer of the two ways to see it; None of what is none."""
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
