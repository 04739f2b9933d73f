"""Shapes for rigid bodies only, defined by the distance to their surface, without a mesh.

To add a shape: a class here and a line in SHAPES. A body of revolution with rounded edges derives from
`RoundedRevolution` and needs no more. Other shapes also need a signed distance in solvers/contact/signed_distance and,
by another formula, in interpreter/verification/contact_forces_check.py.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated

from softmark.records import dataclass
from softmark.solvers.mesh import polygons
from softmark.solvers.mesh.polygons import Corners
from softmark.solvers.mesh.revolved_bodies import Revolved
from softmark.solvers.mesh.shape import Bounds, Shape, Vector3, dot, transverse

if TYPE_CHECKING:
    from softmark.solvers.mesh.shape import Surface

SIDES = 8  # sides of a drawn rim arc


def _enlarge_bounds(bounds: Bounds, by: float) -> Bounds:
    (a, b, c), (d, e, f) = bounds
    return (a - by, b - by, c - by), (d + by, e + by, f + by)


@dataclass(frozen=True)
class HalfSpace(Shape):
    """The half-space behind a plane, such as a table or a wall; for rigid bodies only, since it is unbounded.

    `normal` points out of the half-space, towards the bodies that may touch it.
    """

    convex = True
    meshed = False
    has_signed_distance = True

    origin: Annotated[Vector3, "m", "point of the plane"] = (0.0, 0.0, 0.0)
    normal: Annotated[Vector3, "direction", "outward normal of the plane"] = (0.0, 0.0, 1.0)

    def contains(self, point: Vector3) -> bool:
        """Return whether a point is behind the plane, or on it."""
        return bool(dot([p - o for p, o in zip(point, self.origin, strict=True)], self.normal) <= 0.0)


@dataclass(frozen=True)
class RoundedBox(Shape):
    """A box along x, y and z with all edges and corners rounded, for rigid bodies only.

    Edges are quarters of cylinders and corners are parts of spheres, with the radius `rounding`. A box with sharp edges
    is `box`.
    """

    convex = True
    meshed = False
    has_signed_distance = True

    size: Annotated[Vector3, "m in (0, inf)", "extents along x, y and z"]
    rounding: Annotated[float, "m in (0, inf)", "radius of the edges"]
    origin: Annotated[Vector3, "m", "corner with the lowest x, y and z of the same box with sharp edges"] = (
        0.0,
        0.0,
        0.0,
    )

    @property
    def fault(self) -> str:
        """Return an error if roundings of opposite edges overlap; "" if valid."""
        return "" if 2.0 * self.rounding < min(self.size) else "`rounding` is more than half of its smallest side"

    @property
    def bounds(self) -> Bounds:
        """Lowest and highest coordinates, m."""
        return self.origin, tuple(o + s for o, s in zip(self.origin, self.size, strict=True))  # type: ignore[return-value]

    @property
    def volume(self) -> float:
        """Exact volume, m^3: a b c + 2 (a b + b c + c a) r + pi (a + b + c) r^2 + 4/3 pi r^3.

        The flat faces have the edges a, b and c; r is the rounding radius.
        """
        r = self.rounding
        a, b, c = (s - 2.0 * r for s in self.size)
        return a * b * c + 2.0 * (a * b + b * c + c * a) * r + math.pi * (a + b + c) * r**2 + 4.0 / 3.0 * math.pi * r**3

    def contains(self, point: Vector3) -> bool:
        """Return whether the box contains a point, within 1e-9 of its size."""
        r = self.rounding
        sides = zip(point, self.origin, self.size, strict=True)
        beyond = math.hypot(*(max(o + r - p, 0.0, p - (o + s - r)) for p, o, s in sides))  # the core
        return beyond <= r + polygons.SAME * self.diagonal

    def surface(self, size: float = 0.0) -> Surface:
        """Return points (n, 3) in m and triangles (t, 3), outward, fine enough for pictures; `size` has no effect."""
        from softmark.solvers.mesh.shape_surfaces import triangulate_rounded_box

        return triangulate_rounded_box(self.size, self.rounding, self.origin)


class RoundedRevolution(Shape):
    """All points within the distance `rounding` of a convex body of revolution, called the core."""

    convex = True
    meshed = False
    has_signed_distance = True

    length: float
    rounding: float
    axis: Vector3
    origin: Vector3

    @property
    def core(self) -> Corners:
        """Corners (r, z) of half of the core's axial section, counter-clockwise, m; z is measured from `origin`.

        They enclose an area: the core is not a point or a segment of the axis.
        """
        raise NotImplementedError(f"{type(self).__name__} has no core")

    @property
    def fault(self) -> str:
        """Return an error if the roundings at both ends overlap; "" if valid."""
        return "" if 2.0 * self.rounding < self.length else "`rounding` is more than half of its length"

    @property
    def _core_body(self) -> Revolved:
        return Revolved(self.core, self.axis, self.origin)

    @property
    def bounds(self) -> Bounds:
        """Lowest and highest coordinates, m: those of the core, extended by the rounding."""
        return _enlarge_bounds(self._core_body.bounds, self.rounding)

    @property
    def volume(self) -> float:
        """Exact volume, m^3, by Steiner's formula: V + A r + M r^2 + 4/3 pi r^3.

        V, A and M are the core's volume, area and integral of mean curvature; r is the rounding radius.
        """
        r, core = self.rounding, self._core_body
        return core.volume + core.skin * r + _integral_mean_curvature(self.core) * r**2 + 4.0 / 3.0 * math.pi * r**3

    def surface(self, size: float = 0.0) -> Surface:
        """Return points (n, 3) in m and triangles (t, 3), outward, fine enough for pictures; `size` has no effect."""
        import numpy as np

        from softmark.solvers.mesh.shape_surfaces import triangulate_revolved

        return triangulate_revolved(np.array(self.outline(SIDES)), self.axis, self.origin)

    def contains(self, point: Vector3) -> bool:
        """Return whether the body contains a point, within 1e-9 of its size."""
        off = [p - o for p, o in zip(point, self.origin, strict=True)]
        z, *across = (dot(off, e) for e in (self.axis, *transverse(self.axis)))
        slack = self.rounding + polygons.SAME * self.diagonal
        return polygons.contains_point(self.core, math.hypot(*across), z, slack)

    def outline(self, sides: int) -> Corners:
        """Return the corners (r, z) of half of the axial section, m, beginning on the axis; arcs have `sides` sides."""
        flats = list(polygons.edges(self.core))[:-1]  # the last is the axis
        turns = [-0.5 * math.pi, *(math.atan2(a - c, d - b) for (a, b), (c, d) in flats), 0.5 * math.pi]
        found: list[tuple[float, float]] = []
        for (r, z), first, last in zip(self.core, turns[:-1], turns[1:], strict=True):
            parts = sides if last > first else 0
            angles = (first + (last - first) * k / (parts or 1) for k in range(parts + 1))
            found += [(r + self.rounding * math.cos(a), z + self.rounding * math.sin(a)) for a in angles]
        return tuple(found)


def _integral_mean_curvature(corners: Corners) -> float:
    """Return the integral of the mean curvature over a convex body of revolution, m.

    It is pi times the axial rise of the sides plus pi times the sum of r times the turning angle over the corners.
    """
    on_axis = [r == 0.0 for r, _ in corners]
    total = sum(math.pi * (d - b) for (a, b), (c, d) in polygons.edges(corners) if a or c)
    n = len(corners)
    for i, (r, z) in enumerate(corners):
        if not on_axis[i]:
            (a, b), (c, d) = corners[i - 1], corners[(i + 1) % n]
            turn = math.atan2(d - z, c - r) - math.atan2(z - b, r - a)
            total += math.pi * r * (turn % (2.0 * math.pi))
    return total


@dataclass(frozen=True)
class Punch(RoundedRevolution):
    """A flat punch: a straight circular cylinder with two rounded rims, for rigid bodies only.

    Both ends, at `origin` and opposite, have a flat face of radius `radius - rounding`. A punch with sharp rims is
    `cylinder`.
    """

    radius: Annotated[float, "m in (0, inf)", "radius of the cylinder"]
    rounding: Annotated[float, "m in (0, inf)", "radius of the rounded rims"]
    length: Annotated[float, "m in (0, inf)", "length along the axis"]
    axis: Annotated[Vector3, "direction", "direction of the axis, from the end at `origin`"] = (0.0, 0.0, 1.0)
    origin: Annotated[Vector3, "m", "centre of the end where the axis starts"] = (0.0, 0.0, 0.0)

    @property
    def fault(self) -> str:
        """Return an error if the rounded rims overlap; "" if valid."""
        return super().fault if self.rounding < self.radius else "`rounding` must be less than `radius`"

    @property
    def core(self) -> Corners:
        """Section of a cylinder, smaller than the punch by the rounding on all sides."""
        r, low, high = self.radius - self.rounding, self.rounding, self.length - self.rounding
        return (0.0, low), (r, low), (r, high), (0.0, high)


@dataclass(frozen=True)
class RoundedCone(RoundedRevolution):
    """A circular cone with a rounded tip, for rigid bodies only.

    The tip is at `origin`, and the axis points from there into the cone. `angle` is the full angle at the tip, between
    opposite sides. The tip is part of a sphere, and the rim at the far end is rounded as well. A cone with a sharp tip
    is `cone`.
    """

    angle: Annotated[float, "rad in (0, 3.141592]", "full angle at the tip, between opposite sides"]
    rounding: Annotated[float, "m in (0, inf)", "radius of the tip"]
    length: Annotated[float, "m in (0, inf)", "length from the tip to the other end"]
    axis: Annotated[Vector3, "direction", "direction of the axis, from the tip into the cone"] = (0.0, 0.0, 1.0)
    origin: Annotated[Vector3, "m", "position of the tip"] = (0.0, 0.0, 0.0)

    @property
    def core(self) -> Corners:
        """Section of a sharp cone with its tip at the centre of the rounding."""
        low, high = self.rounding, self.length - self.rounding
        return (0.0, low), ((high - low) * math.tan(0.5 * self.angle), high), (0.0, high)
