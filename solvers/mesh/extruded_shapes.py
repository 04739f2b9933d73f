"""Bodies of one polygonal section along x, y or z."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Literal

from softmark.records import dataclass
from softmark.solvers.mesh import polygons
from softmark.solvers.mesh.cell_counts import divisions
from softmark.solvers.mesh.conforming_planes import Cut, along, cells
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
    """A polygon moved along z, or along x or y: a body of one section with flat sides, such as an L, an I or a star.

    Corners go around the polygon in either sense, each once; the last is joined to the first. Their two coordinates are
    x and y of a body along z, y and z of one along x, z and x of one along y. Sides must not cross or touch.
    Where all sides go along the coordinates, the section is meshed with a grid through its corners; a convex
    quadrilateral with one between its sides; any other with triangles, each cut in three. Layers of hexahedra go along
    the body, or tetrahedra made of them. Its mesh has its volume exactly. A trapezoid whose ends stand straight across
    x, y or z, and halve each other, is a body along an axis that tapers, which beams take.
    """

    gap = "no convex body"

    corners: Annotated[tuple[tuple[float, float], ...], "points of m", "corners of its section, in order around it"]
    height: Annotated[float, "m in (0, inf)", "how far the section goes"]
    along: Annotated[Along, "the direction in which it goes"] = "z"
    base: Annotated[float, "m", "the coordinate along that direction at which it starts"] = 0.0

    @property
    def fault(self) -> str:
        """What is wrong with the polygon."""
        return polygons.fault(self.corners)

    @property
    def section(self) -> polygons.Corners:
        """The corners, counter-clockwise, m."""
        return polygons.turned(self.corners)

    @property
    def swept(self) -> Swept | None:
        """Rectangles along the middle of a trapezoid whose two ends stand straight across it; None of another."""
        from softmark.solvers.mesh.cross_sections import Rectangle
        from softmark.solvers.mesh.frame_shapes import tapering

        if (found := polygons.trapezoid(self.corners)) is None:
            return None
        along, across = self._order[found.along], self._order[1 - found.along]
        axis = (float(along == 0), float(along == 1), float(along == 2))
        first = transverse(axis)[0][across] != 0.0
        ends = [Rectangle(e, self.height) if first else Rectangle(self.height, e) for e in found.ends]
        place = {along: found.begin, across: found.middle, self._order[2]: self.base + 0.5 * self.height}
        return tapering((place[0], place[1], place[2]), axis, found.length, *ends)

    @property
    def convex(self) -> bool:
        """Whether its section is."""
        return not self.fault and polygons.convex(self.section)

    @property
    def _order(self) -> tuple[int, int, int]:
        """Which of x, y and z are the section's two coordinates, and which goes along."""
        last = "xyz".index(self.along)
        return (last + 1) % 3, (last + 2) % 3, last

    def _point(self, first: float, second: float, up: float) -> Vector3:
        known = dict(zip(self._order, (first, second, up), strict=True))
        return known[0], known[1], known[2]

    @property
    def bounds(self) -> Bounds:
        """Lowest and highest coordinates, m."""
        low, high = polygons.ends(self.corners) if self.corners else ((0.0, 0.0), (0.0, 0.0))
        return self._point(*low, self.base), self._point(*high, self.base + self.height)

    @property
    def volume(self) -> float:
        """Exact volume, m^3."""
        return abs(polygons.signed(self.corners)) * self.height

    @property
    def skin(self) -> float:
        """Exact area of its surface, m^2."""
        around = sum(math.dist(a, b) for a, b in polygons.edges(self.corners))
        return 2.0 * abs(polygons.signed(self.corners)) + around * self.height

    @property
    def gradable(self) -> tuple[str, ...]:
        """Along it, and across a section whose sides go along the coordinates."""
        return ("x", "y", "z") if polygons.square(self.corners) else (self.along,)

    @property
    def spans(self) -> dict[str, Span]:
        """Its own coordinates, m: x, y and z."""
        low, high = self.bounds
        return dict(zip("xyz", zip(low, high, strict=True), strict=True))

    def place(self, x: float, y: float, z: float) -> Vector3:
        """The point of its own coordinates, m: beside its section too."""
        return x, y, z

    def contains(self, point: Vector3) -> bool:
        """Whether it holds a point, give or take 1e-9 of its size."""
        slack = polygons.SAME * self.diagonal
        x, y, up = (point[i] for i in self._order)
        along = self.base - slack <= up <= self.base + self.height + slack
        return along and polygons.within(self.section, x, y, slack)

    def _own(self, cuts: tuple[Cut, ...]) -> tuple[Cut, ...]:
        """Cuts as its section and its layers have them."""
        names = dict(zip(self._order, ("first", "second", "along"), strict=True))
        moved = [(names["xyz".index(cut.axis)], cut) for cut in cuts]
        return tuple(replace(c, axis=n, at=c.at - self.base if n == "along" else c.at) for n, c in moved)

    def counts(self, size: float, cuts: tuple[Cut, ...] = ()) -> tuple[int, ...]:
        """Cells of a mesh of a size (m) across the section along both coordinates, of all its width, and along it."""
        (left, low), (right, high) = polygons.ends(self.corners)
        layers = cells(0.0, self.height, divisions(self.height, size), along(self._own(cuts), "along"))
        return divisions(right - left, size), divisions(high - low, size), layers

    def mesh(self, kind: str, size: float, cuts: tuple[Cut, ...] = ()) -> Mesh:
        """Cells of an element with edges of about `size` (m), nodes on cuts. Raises UnknownElement."""
        from softmark.solvers.mesh.mesh import Mesh
        from softmark.solvers.mesh.quadrilateral_meshing import quads
        from softmark.solvers.mesh.structured_meshes import solid

        own = self._own(cuts)
        made = solid(quads(self.section, size, own), self.height, size, kind, own)
        return Mesh(self.placed(made.points + np.array([0.0, 0.0, self.base])), made.cells, made.kind)

    def placed(self, X: Floats) -> Floats:
        """Points (..., 3) of the section's coordinates and that along it, in x, y and z, m."""
        points: Floats = np.empty_like(X)
        points[..., list(self._order)] = X
        return points
