"""Exact outline of a plane region without a mesh: selected area of its edge, or of the revolved rings."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import lru_cache

import numpy as np

from softmark.interpreter.language.coordinate_conditions import Condition
from softmark.interpreter.problem.surface_selection.facet_patches import Floats
from softmark.solvers.mesh.plane_regions import Slice
from softmark.solvers.mesh.shape import Shape

PIECES = 1024  # pieces of a side sampled at their middles; narrower ones are missed
HALVINGS = 50  # bisections between a selected and an unselected piece
CHORDS = 64  # chords of a selected interval, and twice as many for extrapolation

Curve = Callable[[Floats], Floats]  # points (n, 3), m, of the places u (n,) from 0 to 1


@lru_cache(maxsize=64)
def selected_edge_area(shape: Shape, condition: Condition, depth: float) -> float | None:
    """Return the selected area, m^2, of the edge of a slice; None for regions from files.

    With a `depth`, m, it is the area of the whole rings that a slice of this thickness represents.
    """
    if condition.groups or not isinstance(shape, Slice):
        return None
    found = 0.0
    for curve in _sides(shape):
        for begin, end in _selected_intervals(curve, condition, shape.diagonal):
            few, many = (
                _swept_area(curve(np.linspace(begin, end, n + 1)), shape.depth, depth) for n in (CHORDS, 2 * CHORDS)
            )
            found += many + (many - few) / 3.0
    return found


def _sides(shape: Slice) -> Iterator[Curve]:
    """Yield the four sides of the square whose image is the region."""
    for s, t in ((None, 0.0), (1.0, None), (None, 1.0), (0.0, None)):

        def curve(u: Floats, s: float | None = s, t: float | None = t) -> Floats:
            x, y = shape(u if s is None else np.full_like(u, s), u if t is None else np.full_like(u, t))
            return np.stack([np.broadcast_to(x, u.shape), np.broadcast_to(y, u.shape), np.zeros_like(u)], axis=1)

        yield curve


def _selected_intervals(curve: Curve, condition: Condition, extent: float) -> Iterator[tuple[float, float]]:
    """Yield the intervals along a curve on which the condition holds."""

    def holds(u: Floats) -> Floats:
        x, y, z = curve(u).T
        return np.broadcast_to(condition.holds(x, y, z, extent), u.shape)

    middles = (np.arange(PIECES) + 0.5) / PIECES
    held = holds(middles)
    turns = np.flatnonzero(held[1:] != held[:-1])
    low, high = middles[turns], middles[turns + 1]
    for _ in range(HALVINGS if len(turns) else 0):
        half = 0.5 * (low + high)
        same = holds(half) == held[turns]
        low, high = np.where(same, half, low), np.where(same, high, half)
    places = [0.0, *(0.5 * (low + high)).tolist(), 1.0]
    first = 0 if held[0] else 1
    for i in range(first, len(places) - 1, 2):
        yield places[i], places[i + 1]


def _swept_area(points: Floats, thickness: float, depth: float) -> float:
    """Return the area, m^2, of chords (n, 3), m, swept through a `thickness`, m, or with a `depth` around the axis."""
    length = np.linalg.norm(np.diff(points, axis=0), axis=1)
    if not depth:
        return thickness * float(length.sum())
    return float(np.pi * length @ (points[1:, 0] + points[:-1, 0]))
