"""Faces of boxes, rectangles and cylinders that supports and loads select, for theories of such bodies."""

from __future__ import annotations

import math
from typing import Any

from softmark.interpreter.language.coordinate_conditions import Condition
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.problem.cross_section_coverage import selected_end_faces
from softmark.records import dataclass
from softmark.references.straight_cantilever import NotApplicable
from softmark.solvers.mesh.plane_regions import Quadrilateral, Slice
from softmark.solvers.mesh.shape import Bounds, Vector3, add_multiples, replace_coordinate
from softmark.solvers.mesh.shapes import Box, Cylinder

NONE = (0.0, 0.0, 0.0)
SAME = 1e-9  # relative to its size: how far a side may be from straight along x or y
BESIDE = 1e-4  # relative to its radius: what is nearer to a plane through the axis is on it
ANGLES = ((1.0, 0.0), (0.8, 0.6), (0.28, 0.96), (0.0, 1.0), (-0.6, 0.8), (-1.0, 0.0), (-0.96, -0.28), (0.6, -0.8))
WITHIN = (0.0, 0.3, 0.6, 0.9, 0.99, 0.9999)  # relative to the radius: where a side is not


@dataclass(frozen=True)
class BoxAlongAxis(Box):
    """Box whose axis (x, y or z by number) is given, and need not be its longest edge."""

    way: int = 0

    @property
    def _longest(self) -> int:
        return self.way


@dataclass(frozen=True)
class BoxBody:
    """Body that theories treat as a box: a box, or a plane rectangle as a slice of a box.

    `turns` is true if the rectangle is the half section of a body of revolution.
    """

    low: Vector3  # m
    high: Vector3  # m
    flat: bool = False  # held in its plane, z = 0
    turns: bool = False

    @property
    def bounds(self) -> Bounds:
        """Lowest and highest coordinates of the body, m, as two points."""
        return self.low, self.high

    def size(self, axis: int) -> float:
        """Return the extent of the body along x, y or z, m."""
        return self.high[axis] - self.low[axis]

    def area(self, axis: int) -> float:
        """Return the area of a face normal to an axis, m^2; for a body of revolution, of the face all around it."""
        if self.turns:
            return math.pi * (self.high[0] ** 2 - self.low[0] ** 2)
        first, second = (self.size(c) for c in range(3) if c != axis)
        return first * second

    def outward(self, axis: int, end: int) -> Vector3:
        """Return the outward unit normal of a face; `end` 0 is the low one."""
        return replace_coordinate(NONE, axis, 1.0 if end else -1.0)

    def centre(self, axis: int, end: int) -> Vector3:
        """Return the centre of a face, m; for a body of revolution, on its axis. `end` 0 is the low one."""
        found = replace_coordinate(self.middle, axis, self.bounds[end][axis])
        return replace_coordinate(found, 0, 0.0) if self.turns else found

    @property
    def middle(self) -> Vector3:
        """Centre of the body, m."""
        x, y, z = (0.5 * (a + b) for a, b in zip(self.low, self.high, strict=True))
        return x, y, z

    def selected_faces(self, condition: Condition, axis: int) -> set[int]:
        """Return the faces normal to an axis that a condition selects wholly: 0 is the low one, 1 the high one.

        The result is empty if the condition selects a part of a face, or anything else.
        """
        x, y, z = (self.size(a) for a in range(3))
        return selected_end_faces(condition, BoxAlongAxis((x, y, z), self.low, axis))

    def is_wholly_selected(self, condition: Condition) -> bool:
        """Return whether a condition selects the whole body."""
        return condition.over(self.low, self.high) == (False, True)


@dataclass(frozen=True)
class CylinderBody:
    """Full cylinder, whose faces are its two ends; its methods ignore the argument `axis`."""

    shape: Cylinder

    @property
    def bounds(self) -> Bounds:
        """Lowest and highest coordinates of the body, m, as two points."""
        return self.shape.bounds

    def size(self, axis: int) -> float:
        """Return the length of the cylinder, m."""
        return self.shape.length

    def area(self, axis: int) -> float:
        """Return the area of an end, m^2."""
        return math.pi * self.shape.radius**2

    def outward(self, axis: int, end: int) -> Vector3:
        """Return the outward unit normal of an end; 0 is the root."""
        return add_multiples(NONE, (1.0 if end else -1.0, self.shape.axis))

    def centre(self, axis: int, end: int) -> Vector3:
        """Return the centre of an end, m."""
        return add_multiples(self.shape.root, (end * self.shape.length, self.shape.axis))

    def selected_faces(self, condition: Condition, axis: int) -> set[int]:
        """Return the ends of the cylinder that a condition selects; 0 is the root."""
        return selected_end_faces(condition, self.shape)

    def around(self, condition: Condition) -> bool:
        """Return whether a condition on the distance from the axis selects exactly the curved side."""
        if condition.groups:
            return False
        shape, extent = self.shape, self.shape.diagonal
        stations = [shape.length * s for s in (0.0, 0.37, 1.0)]
        for border in condition.borders:
            for r in (0.37 * shape.radius, shape.radius):
                levels = [border.at(*self._point_at(s, r, way)) for s in stations for way in ANGLES]
                if max(levels) - min(levels) > SAME * extent**border.power:
                    return False
        holds = [
            bool(condition.holds(*self._point_at(stations[1], r * shape.radius, ANGLES[1]), extent))
            for r in (*WITHIN, 1)
        ]
        return holds[-1] and not any(holds[:-1])

    def selects_axial_plane(self, condition: Condition, axis: int) -> bool:
        """Return whether a condition selects only points on the plane through the axis with normal x, y or z."""
        low, high = self.shape.bounds
        slack, at, extent = BESIDE * self.shape.radius, self.shape.root[axis], self.shape.diagonal
        above, below = replace_coordinate(low, axis, at + slack), replace_coordinate(high, axis, at - slack)
        beside = condition.over(above, high, extent), condition.over(low, below, extent)
        return not any(true for _, true in beside)

    def _point_at(self, station: float, radius: float, way: tuple[float, float]) -> Vector3:
        axis, first, second = self.shape.frame(0.0)
        x, y, z = (
            r + station * a + radius * (way[0] * u + way[1] * v)
            for r, a, u, v in zip(self.shape.root, axis, first, second, strict=True)
        )
        return x, y, z


def box_body_of_case(case: Case) -> BoxBody | None:
    """Return the box of a case, or the rectangle of a plane one; None for any other body."""
    return box_body_of_shape(case.shape, case.body.thing.thickness if case.planar else 0.0, bool(case.depth))


def box_body_of_shape(shape: Any, thickness: float, turns: bool) -> BoxBody | None:
    """Return a box or an upright rectangle as a BoxBody; None for any other shape.

    A rectangle becomes a slice of the given `thickness`, m. `turns` is true if it is the half section of a body
    revolved about y.
    """
    if isinstance(shape, Box):
        return BoxBody(*shape.bounds)
    if isinstance(shape, Slice) and isinstance(shape.region, Quadrilateral):
        corners = [
            (c[0], c[1]) for c in (shape.region.first, shape.region.second, shape.region.third, shape.region.fourth)
        ]
        (left, below), (right, above) = shape.region.ends
        size = max(right - left, above - below)
        straight = all(
            min(abs(x - left), abs(x - right)) <= SAME * size and min(abs(y - below), abs(y - above)) <= SAME * size
            for x, y in corners
        )
        if straight:
            return BoxBody((left, below, -0.5 * thickness), (right, above, 0.5 * thickness), True, turns)
    return None


def box_or_cylinder_body(case: Case) -> BoxBody | CylinderBody:
    """Return the body of a case if it is a box, a rectangle or a full cylinder. Raises NotApplicable."""
    if isinstance(case.shape, Cylinder):
        return CylinderBody(case.shape)
    found = box_body_of_case(case)
    if found is None:
        raise NotApplicable(f"`{case.body.name}` is not a box, a cylinder or an upright rectangle", "use one of these")
    return found
