"""Plane regions for plane strain and plane stress, meshed as slices one hexahedron thick.

To add a region: write a subclass of `PlaneRegion` that maps the unit square to the region, and add a line to SHAPES.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any

from softmark.records import dataclass
from softmark.solvers.mesh.cell_counts import count_divisions
from softmark.solvers.mesh.conforming_planes import Cut, count_cells, cuts_along
from softmark.solvers.mesh.shape import Bounds, CurvedSide, Shape, Span, Vector3

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from softmark.solvers.mesh.mesh import Floats, Mesh
else:
    from softmark.solvers.runtime.lazy_modules import np

ON = 1e-6  # relative to the size: tolerance of nodes on a curved side
NEAR = 1e-9  # relative to the size: tolerance of containment
Place = tuple[float, float]  # x and y, m


class PlaneRegion(Shape):
    """A region of the plane z = 0, defined by a map of the unit square; its slice has the thickness `depth` (m).

    Half of the thickness is on each side of the plane. The mesh is a grid of the square whose nodes, including midside
    nodes, are all mapped to the region.
    """

    flat = True
    depth = 1.0
    across = "t"  # name of the second coordinate; lines along the first, `s`, are straight

    def __call__(self, s: Any, t: Any) -> tuple[Any, Any]:
        """Return x and y (m) of points with coordinates s, t of the unit square, numbers or arrays.

        The map keeps the orientation.
        """
        raise NotImplementedError(f"{type(self).__name__} maps nothing")

    @property
    def area(self) -> float:
        """Exact area, m^2."""
        raise NotImplementedError(f"{type(self).__name__} has no area")

    @property
    def sizes(self) -> tuple[float, float]:
        """Largest lengths of the region along s and along t, m."""
        raise NotImplementedError(f"{type(self).__name__} has no sizes")

    @property
    def ends(self) -> tuple[Place, Place]:
        """Lowest and highest x and y, m."""
        raise NotImplementedError(f"{type(self).__name__} has no ends")

    def within(self, x: float, y: float, slack: float) -> bool:
        """Return whether the region contains a point of the plane, within `slack` (m)."""
        raise NotImplementedError(f"{type(self).__name__} holds no points")

    @property
    def bounds(self) -> Bounds:
        """Lowest and highest coordinates, m."""
        low, high = self.ends
        return (*low, -0.5 * self.depth), (*high, 0.5 * self.depth)

    @property
    def volume(self) -> float:
        """Exact volume of the slice, m^3."""
        return self.area * self.depth

    def contains(self, point: Vector3) -> bool:
        """Return whether the slice contains a point, within 1e-9 of its size."""
        slack = NEAR * self.diagonal
        return abs(point[2]) <= 0.5 * self.depth + slack and self.within(point[0], point[1], slack)

    @property
    def coordinate_ranges(self) -> dict[str, Span]:
        """Ranges of the coordinates s and t along which meshes can be cut."""
        return {"s": (0.0, 1.0), self.across: (0.0, 1.0)}

    @property
    def gradable_coordinates(self) -> tuple[str, ...]:
        """Names of the coordinates along which cells may be graded: those between opposite sides."""
        return ("s", self.across)

    def place(self, **at: float) -> Vector3:
        """Return the point, m, at given values of the two coordinates, passed by name; computed without arrays."""
        x, y = self(at["s"], at[self.across])
        return float(x), float(y), 0.0

    def slice(self, depth: float) -> Shape:
        """Return the slice of the region with the thickness `depth` (m)."""
        return Slice(self, depth)

    def _uniform_cell_counts(self, size: float) -> tuple[int, int]:
        """Return the numbers of equal cells of `size` (m) along s and along t."""
        return count_divisions(self.sizes[0], size), count_divisions(self.sizes[1], size)

    def counts(self, size: float, cuts: tuple[Cut, ...] = ()) -> tuple[int, ...]:
        """Return the numbers of cells along s and along t of a mesh with cells of `size` (m)."""
        each = zip(("s", self.across), self._uniform_cell_counts(size), strict=True)
        return tuple(count_cells(0.0, 1.0, n, cuts_along(cuts, axis)) for axis, n in each)

    def mesh(self, kind: str, size: float, cuts: tuple[Cut, ...] = ()) -> Mesh:
        """Return a mesh of an element with edges of about `size` (m), one cell thick, with nodes on all cuts.

        Raises UnknownElement.
        """
        from softmark.solvers.elements import solid_element_name
        from softmark.solvers.mesh.mesh import Mesh
        from softmark.solvers.mesh.structured_meshes import grid, mesh_extrusion

        lines = (cuts_along(cuts, "s"), cuts_along(cuts, self.across))
        made = mesh_extrusion(grid(*self._uniform_cell_counts(size), *lines), 1.0, 1.0, solid_element_name(kind))
        s, t, z = made.points.T
        points = np.ascontiguousarray(np.stack([*self(s, t), self.depth * (z - 0.5)], axis=1))
        for k, ends in enumerate(made.element.between):
            if len(ends) == 2:
                _straighten_diagonals(points, made, ends, made.element.corners + k)
        return Mesh(points, made.cells, made.kind)


def _straighten_diagonals(points: Floats, square: Mesh, ends: tuple[int, ...], middle: int) -> None:
    """Move nodes on grid diagonals to the middle between the ends of the diagonal; `points` are changed in place, m.

    `square` is the mesh of the unit square, `ends` the local numbers of the diagonal's end nodes, and `middle` that of
    its midside node. The map keeps grid lines straight where sides of the region are straight, but not diagonals.
    """
    both = square.cells[:, list(ends)]
    way = np.ptp(square.points[both, :2], axis=1)
    diagonal = (way > 0.0).all(axis=1)
    points[square.cells[diagonal, middle]] = points[both[diagonal]].mean(axis=1)


@dataclass(frozen=True)
class Slice(PlaneRegion):
    """A plane region with a given thickness (m)."""

    region: PlaneRegion
    depth: float

    def __call__(self, s: Any, t: Any) -> tuple[Any, Any]:
        """Return x and y by the region's map."""
        return self.region(s, t)

    @property
    def fault(self) -> str:
        """Return the error of the region; "" if it is valid."""
        return self.region.fault

    @property
    def convex(self) -> bool:
        """True if the region is convex."""
        return self.region.convex

    @property
    def across(self) -> str:  # type: ignore[override]
        """Name of the coordinate across the region."""
        return self.region.across

    def place(self, **at: float) -> Vector3:
        """Return the region's point, m, at given values of its two coordinates, passed by their names."""
        return self.region.place(**at)

    def _uniform_cell_counts(self, size: float) -> tuple[int, int]:
        """Return the region's numbers of cells of `size` (m) along s and along t."""
        return self.region._uniform_cell_counts(size)

    @property
    def area(self) -> float:
        """Area of the region, m^2."""
        return self.region.area

    @property
    def sizes(self) -> tuple[float, float]:
        """Largest lengths of the region along its two coordinates, m."""
        return self.region.sizes

    @property
    def ends(self) -> tuple[Place, Place]:
        """Lowest and highest x and y of the region, m."""
        return self.region.ends

    @property
    def sides(self) -> tuple[CurvedSide, ...]:
        """Curved sides of the region."""
        return self.region.sides

    def within(self, x: float, y: float, slack: float) -> bool:
        """Return whether the region contains a point of the plane, within `slack` (m)."""
        return self.region.within(x, y, slack)


@dataclass(frozen=True)
class Quadrilateral(PlaneRegion):
    """A plane region with four straight sides, for `plane_strain` and `plane_stress`.

    Corners are given counter-clockwise with z = 0; the border turns left at each. Cells form a grid between opposite
    sides: `size` is the cell size along the longer of two opposite sides.
    """

    convex = True

    first: Annotated[Vector3, "m", "a corner, z = 0"]
    second: Annotated[Vector3, "m", "the next corner counter-clockwise"]
    third: Annotated[Vector3, "m", "the corner opposite to the first"]
    fourth: Annotated[Vector3, "m", "the last corner"]

    @property
    def _corners(self) -> list[Place]:
        return [(c[0], c[1]) for c in (self.first, self.second, self.third, self.fourth)]

    @property
    def _turns(self) -> list[float]:
        """Twice the area of the triangle at each corner, m^2: positive for a left turn of the border."""
        at = self._corners
        return [_doubled_area(at[i - 1], at[i], at[(i + 1) % 4]) for i in range(4)]

    @property
    def fault(self) -> str:
        """Return an error if corners lie off the plane or the border turns right at one; "" if valid."""
        if any(c[2] for c in (self.first, self.second, self.third, self.fourth)):
            return "its corners must lie in the plane z = 0"
        if min(self._turns) <= NEAR * max(map(abs, self._turns)):
            return "its corners must be in counter-clockwise order, with a left turn at each"
        return ""

    def __call__(self, s: Any, t: Any) -> tuple[Any, Any]:
        """Return the bilinear map of s and t to x and y, m: straight lines between points of opposite sides."""
        weights = ((1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t)
        x, y = (sum(w * c[i] for w, c in zip(weights, self._corners, strict=True)) for i in (0, 1))
        return x, y

    @property
    def area(self) -> float:
        """Exact area, m^2."""
        return 0.5 * (self._turns[0] + self._turns[2])

    @property
    def sizes(self) -> tuple[float, float]:
        """Length of the longer side in each pair of opposite sides, m."""
        a, b, c, d = self._corners
        return max(math.dist(a, b), math.dist(d, c)), max(math.dist(a, d), math.dist(b, c))

    @property
    def ends(self) -> tuple[Place, Place]:
        """Lowest and highest x and y, m."""
        x, y = zip(*self._corners, strict=True)
        return (min(x), min(y)), (max(x), max(y))

    def within(self, x: float, y: float, slack: float) -> bool:
        """Return whether a point lies left of all sides, within `slack` (m)."""
        at = self._corners
        sides = ((at[i], at[(i + 1) % 4]) for i in range(4))
        return all(_doubled_area(a, b, (x, y)) >= -slack * math.dist(a, b) for a, b in sides)


def _doubled_area(a: Place, b: Place, c: Place) -> float:
    """Return twice the area of a triangle, m^2: positive if its corners are counter-clockwise."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


@dataclass(frozen=True)
class QuarterRing(PlaneRegion):
    """The quarter x >= 0, y >= 0 of the region between two ellipses, or two circles, around the origin.

    For `plane_strain` and `plane_stress`. With `symmetric(...)` on both straight sides it represents the whole ring.
    Rows of cells go from one ellipse to the other along straight lines between points of equal eccentric angle, and all
    nodes of curved sides lie on the ellipses. `size` is the largest cell size.
    """

    across = "turn"

    inner: Annotated[float, "m in (0, inf)", "semi-axis of the hole along x"]
    outer: Annotated[float, "m in (0, inf)", "semi-axis of the outer border along x"]
    inner_y: Annotated[float | None, "m in (0, inf)", "semi-axis of the hole along y; default: as along x"] = None
    outer_y: Annotated[float | None, "m in (0, inf)", "semi-axis of the outer border along y; default: as along x"] = (
        None
    )

    @property
    def _hole_semiaxes(self) -> Place:
        return self.inner, self.inner_y or self.inner

    @property
    def _outer_semiaxes(self) -> Place:
        return self.outer, self.outer_y or self.outer

    @property
    def fault(self) -> str:
        """Return an error if the wall has no thickness; "" if valid."""
        (a, b), (c, d) = self._hole_semiaxes, self._outer_semiaxes
        return "" if a < c and b < d else "its hole must be smaller than the outer border, along both x and y"

    def __call__(self, s: Any, t: Any) -> tuple[Any, Any]:
        """Return x and y, m, for s from the hole (0) outward and t from the x axis (0) around to the y axis (1)."""
        turn = 0.5 * math.pi * t
        (a, b), (c, d) = self._hole_semiaxes, self._outer_semiaxes
        return (a + s * (c - a)) * np.cos(turn) * (t < 1), (b + s * (d - b)) * np.sin(turn)  # 0 on the y axis, exactly

    def place(self, **at: float) -> Vector3:
        """Return the point, m, at given values of the two coordinates, passed by name; computed without arrays."""
        turn, s = 0.5 * math.pi * at["turn"], at["s"]
        (a, b), (c, d) = self._hole_semiaxes, self._outer_semiaxes
        return (a + s * (c - a)) * math.cos(turn), (b + s * (d - b)) * math.sin(turn), 0.0

    @property
    def area(self) -> float:
        """Exact area, m^2."""
        (a, b), (c, d) = self._hole_semiaxes, self._outer_semiaxes
        return 0.25 * math.pi * (c * d - a * b)

    @property
    def sizes(self) -> tuple[float, float]:
        """Largest wall thickness, and a quarter of the circumscribed circle, m."""
        (a, b), (c, d) = self._hole_semiaxes, self._outer_semiaxes
        return max(c - a, d - b), 0.5 * math.pi * max(c, d)

    @property
    def ends(self) -> tuple[Place, Place]:
        """Lowest and highest x and y, m."""
        return (0.0, 0.0), self._outer_semiaxes

    def within(self, x: float, y: float, slack: float) -> bool:
        """Return whether a point lies in the quarter and between the ellipses, within `slack` (m)."""
        (a, b), (c, d) = self._hole_semiaxes, self._outer_semiaxes
        out, off = math.hypot(x / a, y / b) - 1.0, math.hypot(x / c, y / d) - 1.0
        return x >= -slack and y >= -slack and out >= -slack / min(a, b) and off <= slack / min(c, d)

    @property
    def sides(self) -> tuple[CurvedSide, ...]:
        """Hole and outer border."""
        return (EllipticCylinderSide(*self._outer_semiaxes), EllipticCylinderSide(*self._hole_semiaxes))


@dataclass(frozen=True)
class EllipticCylinderSide(CurvedSide):
    """The surface of an elliptic cylinder around the z axis: semi-axes along x and y, m.

    Points are projected along rays from the axis.
    """

    a: float
    b: float

    def of(self, corners: Floats) -> NDArray[np.bool_]:
        """Return which facets, with nodes at (f, k, 3), m, have all their nodes on the cylinder; a mask (f,)."""
        unit = np.hypot(corners[..., 0] / self.a, corners[..., 1] / self.b)
        found: NDArray[np.bool_] = np.asarray((np.abs(unit - 1.0) < ON).all(axis=1))
        return found

    def project_points(self, place: Any) -> Any:
        """Return points projected along rays from the axis onto the cylinder, m."""
        x, y, z = place
        out = ((x * (1.0 / self.a)) ** 2 + (y * (1.0 / self.b)) ** 2) ** -0.5
        return x * out, y * out, z
