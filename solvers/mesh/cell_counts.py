"""How many cells a structured mesh has along each direction: plain counts, known without making the mesh."""

from __future__ import annotations

import math
from itertools import pairwise

from softmark.solvers.mesh.conforming_planes import Cut, along, anchors

SMALLEST = 0.2  # of a disc's radius: a circle around the core may be as small
OFF_CENTRE = 0.6  # of a disc's radius: a chord may be as far from the middle; cells there are 1 to 4 in size


def divisions(length: float, size: float, least: int = 1) -> int:
    """How many edges of about `size` fit in `length`."""
    return max(least, round(length / size))


def of_rectangle(width: float, height: float, size: float) -> tuple[int, int]:
    """Cells across a rectangle, m: even numbers, which keep its mirror symmetries in a split."""
    return 2 * divisions(width, 2 * size), 2 * divisions(height, 2 * size)


def of_disc(radius: float, size: float) -> tuple[int, int]:
    """Cells along a side of the square in a disc, which is a quarter of the circle, and rings around the square.

    Both come in the same proportion, 4 to 1, at sizes of `radius` / 2.5 k, k = 1, 2, ...: meshes of those are similar.
    """
    return 2 * divisions(math.pi * radius / 4, size), divisions(0.4 * radius, size)


def circles(radius: float, size: float, cuts: tuple[Cut, ...] = ()) -> list[float]:
    """Radii (m) of the rings that are circles, outward: that of the core's rings, and of all around it."""
    inner = [cut for cut in along(cuts, "radius") if SMALLEST * radius <= cut.at < radius]
    core, *ends = anchors(0.0, radius, size, inner)[1:]
    found = [core]
    for a, b in pairwise([core, *ends]):
        n = divisions(b - a, size)
        found += [a + (b - a) * k / n for k in range(1, n)] + [b]
    return found
