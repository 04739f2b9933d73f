"""Placement of curve names next to the ends of curves.

A name is placed at the end of its curve, or farther away with a thin leader line. Among the positions that fit, the one
with the shortest leader line and the fewest crossings is chosen. A name that fits nowhere appears only in the legend.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from softmark.records import dataclass

Point = tuple[float, float]
Path = Sequence[Point | None]
Box = tuple[float, float, float, float]  # left, top, right, bottom

CLOSE = 16.0  # pixels; names of curves that end nearer to each other than this need leader lines
LED = 9  # with more curves than this, leader lines would cross too often
LETTER = 7.4  # width of a letter, pixels
ANGLES = (-20, 25, -50, 55, 160, -160, 90, 125, -125, -90)  # degrees, clockwise from the right


@dataclass(frozen=True)
class LabelPlace:
    """Position of a curve name; `line` is the leader line from the end of its curve, if there is one."""

    x: float
    y: float
    anchor: str
    line: tuple[Point, Point] | None = None

    def box(self, name: str) -> Box:
        """Return the rectangle that the name covers, in pixels."""
        width = LETTER * len(name)
        left = self.x - {"start": 0.0, "middle": 0.5, "end": 1.0}[self.anchor] * width
        return left - 3, self.y - 12, left + width + 3, self.y + 5


def place_labels(paths: Sequence[Path], names: Sequence[str | None], area: Box) -> dict[int, LabelPlace]:
    """Return the positions, by index of the curve, of all names that fit into `area`, pixels.

    A name fits if it covers no curve and no other name.

    A curve whose name is None gets no label.
    """
    named = [i for i, path in enumerate(paths) if names[i] is not None and any(path)]
    ends = {i: [p for p in paths[i] if p][-1] for i in named}
    room = _OccupiedArea(area, {i: [p for p in densify(paths[i]) if _is_inside(p, area)] for i in named}, ends)
    found = {}
    for i in named:
        crowd = any(math.dist(ends[i], ends[j]) < CLOSE for j in named if j != i)
        place = room.occupy_best_position(i, names[i] or "", _candidates(ends[i], crowd, len(named) <= LED))
        if place is not None:
            found[i] = place
    return found


class _OccupiedArea:
    """Parts of the plot that are occupied by curves, their ends, names and leader lines."""

    def __init__(self, area: Box, curves: dict[int, list[Point]], ends: dict[int, Point]) -> None:
        self.area = area
        self.points = np.array([p for curve in curves.values() for p in curve], dtype=float).reshape(-1, 2)
        self.owners = np.repeat(list(curves), [len(curve) for curve in curves.values()])  # curve of each point
        self.ends = np.array(list(ends.values()), dtype=float).reshape(-1, 2)
        self.named = np.array(list(ends))
        self.taken: list[Box] = []
        self.lines = np.zeros((0, 2))

    def occupy_best_position(self, index: int, name: str, candidates: Iterable[LabelPlace]) -> LabelPlace | None:
        """Choose and occupy the cheapest position for the name of a curve; return None if none fits.

        The cost is the length of the leader line plus penalties, so candidates with a longer line than the cheapest
        cost so far are skipped.
        """
        fitting = [place for place in candidates if self.fits(place.box(name))]
        chosen, least = None, math.inf
        for place in sorted(fitting, key=_leader_line_length):
            if _leader_line_length(place) >= least:
                break
            cost = self.cost(index, place)
            if cost < least:
                chosen, least = place, cost
        if chosen is not None:
            self.taken.append(chosen.box(name))
            if chosen.line:
                self.lines = np.concatenate([self.lines, _points_between(*chosen.line, 3.0)])
        return chosen

    def fits(self, box: Box) -> bool:
        """Return whether a rectangle lies within the plot and covers nothing."""
        area = self.area
        if not (box[0] >= area[0] and box[1] >= area[1] and box[2] <= area[2] and box[3] <= area[3]):
            return False
        if any(box[0] < o[2] and o[0] < box[2] and box[1] < o[3] and o[1] < box[3] for o in self.taken):
            return False
        return not (_are_inside_box(self.points, box).any() or _are_inside_box(self.lines, box).any())

    def cost(self, index: int, place: LabelPlace) -> float:
        """Return the length of a leader line, pixels, plus a penalty for everything that it crosses."""
        if place.line is None:
            return 0.0
        steps = np.array(_points_between(*place.line, 3.0))
        others = self.owners != index
        crossed = len(np.unique(self.owners[others][_near_points_mask(self.points[others], steps, 4.0)]))
        wrong = int(_near_points_mask(self.ends[self.named != index], steps, 9.0).sum())
        covered = sum(bool(_are_inside_box(steps, box).any()) for box in self.taken)
        tangled = bool(_near_points_mask(self.lines, steps, 5.0).any())
        return _leader_line_length(place) + 12 * crossed + 40 * wrong + 200 * covered + 60 * tangled


def _leader_line_length(place: LabelPlace) -> float:
    return math.dist(*place.line) if place.line else 0.0


def _are_inside_box(points: Any, box: Box) -> Any:
    """Return which of the points (n, 2), pixels, are inside a box, as booleans (n,)."""
    x, y = points[:, 0], points[:, 1]
    return (box[0] < x) & (x < box[2]) & (box[1] < y) & (y < box[3])


def _near_points_mask(points: Any, steps: Any, reach: float) -> Any:
    """Return booleans (n,): which points (n, 2) are closer than `reach` to one of the points `steps` (k, 2).

    All lengths are in pixels.
    """
    apart = points[:, None, :] - steps[None, :, :]
    return ((apart * apart).sum(axis=2) < reach * reach).any(axis=1)


def _is_inside(point: Point, box: Box) -> bool:
    return box[0] < point[0] < box[2] and box[1] < point[1] < box[3]


def _candidates(end: Point, crowd: bool, led: bool) -> Iterator[LabelPlace]:
    """Yield candidate positions for a name next to the end point of its curve, pixels.

    With `crowd`, other curves end nearby, and the positions directly at the end point are left out. With `led`,
    positions farther away, with a leader line, are added.
    """
    x, y = end
    if not crowd:
        yield LabelPlace(x + 9, y + 4, "start")
        yield LabelPlace(x, y + 20, "middle")
        yield LabelPlace(x, y - 12, "middle")
        yield LabelPlace(x - 9, y + 4, "end")
    if not led:
        return
    for dy in (0, -15, 15, -30, 30, -45, 45):  # one above the other, where curves end at the right edge
        yield LabelPlace(x + 22, y + dy + 4, "start", ((x + 6, y + dy / 4), (x + 19, y + dy)))
    for radius in (28.0, 46.0, 68.0, 96.0):
        for angle in ANGLES:
            yield _position_with_leader_line(end, radius, math.radians(angle))


def _position_with_leader_line(end: Point, radius: float, angle: float) -> LabelPlace:
    """Return the position of a name at a distance and angle from the end of its curve, with a leader line."""
    c, s = math.cos(angle), math.sin(angle)
    stop = end[0] + radius * c, end[1] + radius * s
    line = (end[0] + 6 * c, end[1] + 6 * s), stop
    if abs(c) < 0.3:
        return LabelPlace(stop[0], stop[1] + (13 if s > 0 else -4), "middle", line)
    return LabelPlace(stop[0] + math.copysign(4, c), stop[1] + 4, "start" if c > 0 else "end", line)


def connected_pieces(path: Path) -> Iterator[list[Point]]:
    """Yield the connected pieces of a path, which may have gaps."""
    run: list[Point] = []
    for point in (*path, None):
        if point is not None:
            run.append(point)
        elif run:
            yield run
            run = []


def densify(path: Path) -> Iterator[Point]:
    """Yield the points of a path and points in between, about 6 pixels apart."""
    for run in connected_pieces(path):
        yield run[0]
        for a, b in pairwise(run):
            yield from _points_between(a, b, 6.0)


def _points_between(a: Point, b: Point, step: float) -> list[Point]:
    """Return points on the segment from a (excluded) to b, about `step` pixels apart."""
    n = max(1, min(200, round(math.dist(a, b) / step)))
    return [(a[0] + (b[0] - a[0]) * i / n, a[1] + (b[1] - a[1]) * i / n) for i in range(1, n + 1)]
