"""Bodies with one polygonal section extruded along x, y or z."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Literal

from softmark.records import dataclass
from softmark.solvers.mesh import polygons
from softmark.solvers.mesh.cell_counts import count_divisions
from softmark.solvers.mesh.conforming_planes import Cut, count_cells, cuts_along
from softmark.solvers.mesh.shape import Bounds, Shape, Span, Vector3, transverse

if TYPE_CHECKING:
    import numpy as np

    from softmark.solvers.mesh.mesh import Floats, Mesh
    from softmark.solvers.mesh.shape import Swept
else:
    from softmark.solvers.runtime.lazy_modules import np

Along = Literal["x", "y", "z"]


@dataclass(frozen=True)
class Extruded(Shape):
    """A polygon extruded along x, y or z: a body of one section with flat sides, such as an L, an I or a star.

    Corners go around the polygon in either sense, each once; the last is joined to the first. Their two coordinates are
    x and y for a body along z, y and z along x, z and x along y. Sides must not cross or touch. If all sides are
    parallel to the coordinate axes, the section is meshed with a grid through its corners. A convex quadrilateral is
    meshed with a grid between its sides. Any other polygon is meshed with triangles, each split into three
    quadrilaterals. Layers of hexahedra, or of tetrahedra made of them, go along the body. The mesh has the exact
    volume. A trapezoid whose parallel ends are perpendicular to x, y or z, and centred on one line, is a tapered body
    along an axis, which beam models accept.
    """

    gap = "not a convex body"
    has_signed_distance = True

    corners: Annotated[tuple[tuple[float, float], ...], "points of m", "corners of the section, in order around it"]
    height: Annotated[float, "m in (0, inf)", "length of the body along that direction"]
    along: Annotated[Along, "direction of extrusion"] = "z"
    base: Annotated[float, "m", "coordinate along that direction where the body starts"] = 0.0

    @property
    def fault(self) -> str:
        """Return why the polygon is invalid; "" if it is valid."""
        return polygons.polygon_fault(self.corners)

    @property
    def section(self) -> polygons.Corners:
        """Corners of the section, counter-clockwise, m."""
        return polygons.orient_counterclockwise(self.corners)

    @property
    def swept(self) -> Swept | None:
        """Tapered rectangular body along the middle line of the section, for beam models; None if there is none.

        It exists only if the section is an isosceles trapezoid whose parallel ends are perpendicular to x, y or z.
        """
        from softmark.solvers.mesh.cross_sections import Rectangle
        from softmark.solvers.mesh.frame_shapes import tapered_member

        if (found := polygons.find_trapezoid(self.corners)) is None:
            return None
        along, across = self._coordinate_order[found.along], self._coordinate_order[1 - found.along]
        axis = (float(along == 0), float(along == 1), float(along == 2))
        first = transverse(axis)[0][across] != 0.0
        ends = [Rectangle(e, self.height) if first else Rectangle(self.height, e) for e in found.ends]
        place = {along: found.begin, across: found.middle, self._coordinate_order[2]: self.base + 0.5 * self.height}
        return tapered_member((place[0], place[1], place[2]), axis, found.length, *ends)

    @property
    def convex(self) -> bool:
        """True if the section is convex."""
        return not self.fault and polygons.is_convex(self.section)

    @property
    def _coordinate_order(self) -> tuple[int, int, int]:
        """Indices of the section's two coordinates and of the axial one: 0 for x, 1 for y, 2 for z."""
        last = "xyz".index(self.along)
        return (last + 1) % 3, (last + 2) % 3, last

    def _point_from_section(self, first: float, second: float, up: float) -> Vector3:
        known = dict(zip(self._coordinate_order, (first, second, up), strict=True))
        return known[0], known[1], known[2]

    @property
    def bounds(self) -> Bounds:
        """Lowest and highest coordinates, m."""
        low, high = polygons.coordinate_range(self.corners) if self.corners else ((0.0, 0.0), (0.0, 0.0))
        return self._point_from_section(*low, self.base), self._point_from_section(*high, self.base + self.height)

    @property
    def volume(self) -> float:
        """Exact volume, m^3."""
        return abs(polygons.signed_area(self.corners)) * self.height

    @property
    def skin(self) -> float:
        """Exact surface area, m^2."""
        around = sum(math.dist(a, b) for a, b in polygons.edges(self.corners))
        return 2.0 * abs(polygons.signed_area(self.corners)) + around * self.height

    @property
    def gradable_coordinates(self) -> tuple[str, ...]:
        """Names of the coordinates along which cells may be graded.

        These are the coordinate along the body and, if the section's sides are parallel to the axes, those across it.
        """
        return ("x", "y", "z") if polygons.is_axis_parallel(self.corners) else (self.along,)

    @property
    def coordinate_ranges(self) -> dict[str, Span]:
        """Ranges of the body's coordinates x, y and z, m."""
        low, high = self.bounds
        return dict(zip("xyz", zip(low, high, strict=True), strict=True))

    def place(self, x: float, y: float, z: float) -> Vector3:
        """Return the point with coordinates x, y and z, m; it may lie outside the section."""
        return x, y, z

    def contains(self, point: Vector3) -> bool:
        """Return whether the body contains a point, within 1e-9 of its size."""
        slack = polygons.SAME * self.diagonal
        x, y, up = (point[i] for i in self._coordinate_order)
        along = self.base - slack <= up <= self.base + self.height + slack
        return along and polygons.contains_point(self.section, x, y, slack)

    def _cuts_in_section_coordinates(self, cuts: tuple[Cut, ...]) -> tuple[Cut, ...]:
        """Return cuts of x, y and z as cuts in the coordinates of the section and along its extrusion."""
        names = dict(zip(self._coordinate_order, ("first", "second", "along"), strict=True))
        moved = [(names["xyz".index(cut.axis)], cut) for cut in cuts]
        return tuple(replace(c, axis=n, at=c.at - self.base if n == "along" else c.at) for n, c in moved)

    def counts(self, size: float, cuts: tuple[Cut, ...] = ()) -> tuple[int, ...]:
        """Return the numbers of cells of a mesh with cells of `size` (m) along its three directions.

        These are both coordinates of the section's bounding box, and the coordinate along the body.
        """
        (left, low), (right, high) = polygons.coordinate_range(self.corners)
        layers = count_cells(
            0.0,
            self.height,
            count_divisions(self.height, size),
            cuts_along(self._cuts_in_section_coordinates(cuts), "along"),
        )
        return count_divisions(right - left, size), count_divisions(high - low, size), layers

    def mesh(self, kind: str, size: float, cuts: tuple[Cut, ...] = ()) -> Mesh:
        """Return a mesh of the element `kind` with edges of about `size` (m). Raises UnknownElement.

        Nodes lie on all `cuts`.
        """
        from softmark.solvers.mesh.mesh import Mesh
        from softmark.solvers.mesh.quadrilateral_meshing import mesh_polygon
        from softmark.solvers.mesh.structured_meshes import mesh_extrusion

        own = self._cuts_in_section_coordinates(cuts)
        made = mesh_extrusion(mesh_polygon(self.section, size, own), self.height, size, kind, own)
        return Mesh(self.placed(made.points + np.array([0.0, 0.0, self.base])), made.cells, made.kind)

    def placed(self, X: Floats) -> Floats:
        """Return points in the coordinates x, y and z, m, shape (..., 3).

        `X` (..., 3), m, gives each point by the two coordinates of the section and the coordinate along the body.
        """
        points: Floats = np.empty_like(X)
        points[..., list(self._coordinate_order)] = X
        return points
