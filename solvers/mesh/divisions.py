"""How many cells a structured mesh has along each direction: plain counts, known without making the mesh."""

from __future__ import annotations

import math


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
