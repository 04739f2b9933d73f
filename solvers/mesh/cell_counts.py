"""Numbers of cells of a structured mesh along each direction, computed without making the mesh."""

from __future__ import annotations

import math
from itertools import pairwise

from softmark.solvers.mesh.conforming_planes import Cut, cuts_along, fixed_grid_lines

SMALLEST = 0.2  # relative to a disc's radius: smallest circle around the core
OFF_CENTRE = (
    0.6  # relative to a disc's radius: largest distance of a chord from the centre; cell sizes then vary 1 to 4
)


def count_divisions(length: float, size: float, least: int = 1) -> int:
    """Return the number of edges of about `size` that fit into `length`, at least `least`."""
    return max(least, round(length / size))


def count_rectangle_cells(width: float, height: float, size: float) -> tuple[int, int]:
    """Return the numbers of cells across a rectangle of `width` and `height`, m, with cells of `size` (m).

    Both are even, so that splitting into tetrahedra preserves the mirror symmetries.
    """
    return 2 * count_divisions(width, 2 * size), 2 * count_divisions(height, 2 * size)


def count_disc_cells(radius: float, size: float) -> tuple[int, int]:
    """Return the numbers of cells in a disc mesh: along a side of its inner square, and of rings around the square.

    A side of the square spans a quarter of the circle. For cell sizes `radius` / (2.5 k), k = 1, 2, ..., the two
    numbers are in the ratio 4 to 1, so that meshes of these sizes are similar.
    """
    return 2 * count_divisions(math.pi * radius / 4, size), count_divisions(0.4 * radius, size)


def circle_radii(radius: float, size: float, cuts: tuple[Cut, ...] = ()) -> list[float]:
    """Return the radii (m) of the circles of nodes in a disc mesh, outward: the core and the rings around it.

    `size` (m) is the cell size. Circles lie on the cuts of the coordinate `radius`.
    """
    inner = [cut for cut in cuts_along(cuts, "radius") if SMALLEST * radius <= cut.at < radius]
    core, *ends = fixed_grid_lines(0.0, radius, size, inner)[1:]
    found = [core]
    for a, b in pairwise([core, *ends]):
        n = count_divisions(b - a, size)
        found += [a + (b - a) * k / n for k in range(1, n)] + [b]
    return found
