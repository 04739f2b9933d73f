"""Closed surfaces of eight triangles, as text of an .obj file."""

from __future__ import annotations

FACES = ((1, 3, 5), (3, 2, 5), (2, 4, 5), (4, 1, 5), (3, 1, 6), (2, 3, 6), (4, 2, 6), (1, 4, 6))
Point = tuple[float, float, float]


def octahedron(corners: tuple[Point, ...]) -> str:
    """Of six corners, two of each axis after each other."""
    lines = [("v", *corner) for corner in corners] + [("f", *face) for face in FACES]
    return "".join(" ".join(map(str, line)) + "\n" for line in lines)
