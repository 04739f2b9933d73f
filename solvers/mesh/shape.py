"""Base classes of shapes: any shape, bodies with sections along an axis, and straight prisms.

The shapes in `shapes.py` derive from these classes. Every member exists on every shape, with a default that means
unknown, so that no caller has to test for it. Fields that a scene sets on some shapes only (`length`, `axis`) are
declared for the type checker only, because a dataclass would take the declaration for the field's default.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any, ClassVar

from softmark.solvers.elements.reference_cells import Tetrahedron
from softmark.solvers.mesh.conforming_planes import Cut

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from softmark.solvers.mesh.mesh import Floats, Ints, Mesh

    Surface = tuple[Floats, Ints]
else:
    from softmark.solvers.runtime.lazy_modules import np

Vector3 = tuple[float, float, float]
Span = tuple[float, float]
Bounds = tuple[Vector3, Vector3]
Plane = tuple[float, float, float, float]


def dot(vector: Any, unit: Sequence[float]) -> Any:
    """Return the dot product of two vectors of three coordinates.

    Coordinates of the first vector may be numbers, arrays or interval bounds; zeros of `unit` are skipped.
    """
    return sum(p * e for p, e in zip(vector, unit, strict=True) if e)


def add_multiples(origin: Vector3, *parts: tuple[float, Vector3]) -> Vector3:
    """Return `origin` plus multiples of vectors; each part is a pair of a factor and a vector."""
    return tuple(o + sum(c * v[i] for c, v in parts) for i, o in enumerate(origin))  # type: ignore[return-value]


def cross(a: tuple[float, ...], b: tuple[float, ...]) -> Vector3:
    """Return a x b."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def replace_coordinate(point: Vector3, axis: int, value: float) -> Vector3:
    """Return a point with its coordinate along x, y or z replaced."""
    x, y, z = (value if i == axis else c for i, c in enumerate(point))
    return x, y, z


def transverse(axis: Vector3) -> tuple[Vector3, Vector3]:
    """Return two unit vectors that make a right-handed frame with the unit vector `axis`.

    For a coordinate axis they are the two other coordinate axes.
    """
    smallest = min(range(3), key=lambda i: (round(abs(axis[i]), 12), i))
    seed = tuple(1.0 if i == smallest else 0.0 for i in range(3))
    second = cross(axis, seed)
    norm = sum(c * c for c in second) ** 0.5
    second = (second[0] / norm, second[1] / norm, second[2] / norm)
    return cross(second, axis), second


def place_mesh(mesh: Mesh, axis: Vector3, origin: Vector3) -> Mesh:
    """Return a mesh made along z, rotated so that z becomes `axis`, and moved to `origin`."""
    from softmark.solvers.mesh.mesh import Mesh

    first, second = transverse(axis)
    frame: Floats = np.array([first, second, axis])  # rows: images of x, y, z
    return Mesh(np.ascontiguousarray(mesh.points @ frame + np.array(origin)), mesh.cells, mesh.kind)


class Section:
    """A cross-section of a body along an axis.

    Coordinates u and v, m, are measured from the centre of the section along the two unit vectors that
    `transverse(axis)` returns for the axis of the body. These are the first and the second axis of the section.
    """

    @property
    def extents(self) -> tuple[float, float]:
        """Extents along the first and the second axis, m."""
        raise NotImplementedError(f"{type(self).__name__} has no extents")

    @property
    def area(self) -> float:
        """Area, m^2."""
        raise NotImplementedError(f"{type(self).__name__} has no area")

    @property
    def moments(self) -> tuple[float, float]:
        """Second moments of area about the first and the second axis, m^4."""
        raise NotImplementedError(f"{type(self).__name__} has no moments")

    @property
    def torsion(self) -> float:
        """Saint-Venant torsion constant, m^4."""
        raise NotImplementedError(f"{type(self).__name__} has no torsion")

    def shear_factor(self, poisson: float) -> float:
        """Return the shear correction factor: shear force = factor x G x area x mean shear strain."""
        raise NotImplementedError(f"{type(self).__name__} has no shear factor")

    def samples(self) -> list[tuple[float, float]]:
        """Sample points of the section, m, including its corners."""
        raise NotImplementedError(f"{type(self).__name__} has no samples")

    def contains(self, u: float, v: float, slack: float) -> bool:
        """Return whether the section contains a point (u, v) of its plane, within `slack` (m)."""
        raise NotImplementedError(f"{type(self).__name__} holds no points")

    def outside(self, u: Floats, v: Floats) -> Floats:
        """Return how far points (u, v) of the section's plane lie outside the section, shape (n,), m."""
        raise NotImplementedError(f"{type(self).__name__} has no outside")

    def outline(self, around: int) -> Floats:
        """Return about `around` points of the outer border (k, 2), m, counter-clockwise."""
        raise NotImplementedError(f"{type(self).__name__} has no outline")

    @property
    def hole_radius(self) -> float | None:
        """Radius of the section's hole, m; None without a hole."""
        return None

    def hole(self, around: int) -> Floats | None:
        """Return points (k, 2), m, of the hole's border, as many as `outline` returns; None without a hole."""
        return None

    def support(self, a: float, b: float) -> float:
        """Return the largest value of a u + b v over the sample points (u, v) of the section, m."""
        return max(a * u + b * v for u, v in self.samples())

    def reach(self, axis: Vector3) -> Vector3:
        """Return how far the sample points of a section normal to `axis` extend from its centre along x, y and z, m."""
        first, second = transverse(axis)
        rows = [tuple(u * a + v * b for a, b in zip(first, second, strict=True)) for u, v in self.samples()]
        x, y, z = (max(abs(c) for c in column) for column in zip(*rows, strict=True))
        return x, y, z


class CircularSection(Section):
    """A section with a circular border and possibly a concentric circular hole."""

    radius: float

    @property
    def extents(self) -> tuple[float, float]:
        """Diameter along both axes, m."""
        return 2.0 * self.radius, 2.0 * self.radius

    @property
    def torsion(self) -> float:
        """Saint-Venant torsion constant, m^4: the polar second moment, since round sections do not warp."""
        return sum(self.moments)

    def outline(self, around: int) -> Floats:
        """Return points of the outer border (around, 2), m, counter-clockwise."""
        turn = 2 * math.pi * np.arange(around) / around
        circle: Floats = self.radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)
        return circle

    def support(self, a: float, b: float) -> float:
        """Return the largest value of a u + b v over the points (u, v) of the section, m."""
        return self.radius * math.hypot(a, b)

    def reach(self, axis: Vector3) -> Vector3:
        """Return how far the section, normal to `axis`, extends from its centre along x, y and z, m; exact."""
        x, y, z = (self.radius * math.sqrt(max(0.0, 1.0 - a * a)) for a in axis)
        return x, y, z


class CurvedSide:
    """A curved part of a shape's boundary, in which mesh facets are inscribed."""

    def of(self, corners: Floats) -> NDArray[np.bool_]:
        """Return which facets, with nodes at (f, k, 3), m, have all their nodes on the side; a mask (f,)."""
        raise NotImplementedError(f"{type(self).__name__} knows no facets")

    def project_points(self, place: Any) -> Any:
        """Return points projected onto the side, m, as x, y and z: numbers, arrays or interval bounds.

        A selection by the distance of projected points does not depend on how flat the facets are.
        """
        raise NotImplementedError(f"{type(self).__name__} has no places")


class Shape:
    """The geometry of a body."""

    prebuilt: ClassVar[bool] = False  # cells come from a file and have no adjustable size
    enclosed: ClassVar[bool] = False  # filled with tetrahedra by a mesher
    flat: ClassVar[bool] = False  # a plane region, for plane problems
    meshed: ClassVar[bool] = True  # can be meshed; other shapes are for rigid bodies only
    has_mass_properties: ClassVar[bool] = False  # rigid bodies can move freely: solvers/contact/rigid_mass_properties
    wired: ClassVar[bool] = False  # a frame of axes, without cells
    gap: ClassVar[str] = "hollow"  # reason why the shape is not convex

    @property
    def fault(self) -> str:
        """Return why the fields define no valid shape; "" if they do."""
        return ""

    @property
    def convex(self) -> bool:
        """True if the shape is known to be convex."""
        return False

    @property
    def has_signed_distance(self) -> bool:
        """True if a rigid body of this shape can touch others: solvers/contact/signed_distance has its distance."""
        return False

    @property
    def file(self) -> str:
        """File from which the shape is read; "" if none."""
        return ""

    @property
    def bounds(self) -> Bounds | None:
        """Lowest and highest coordinates, m; None if they are known only from a file."""
        return None

    @property
    def diagonal(self) -> float:
        """Diagonal of the bounding box, m; 0 if the bounds are unknown."""
        return 0.0 if self.bounds is None else math.dist(*self.bounds)

    @property
    def volume(self) -> float | None:
        """Exact volume, m^3; None if unknown."""
        return None

    @property
    def least(self) -> float:
        """Lower bound of the volume, m^3, computed without making the surface; 0 if unknown."""
        return self.volume or 0.0

    @property
    def skin(self) -> float | None:
        """Exact surface area, m^2; None if unknown."""
        return None

    @property
    def gradable_coordinates(self) -> tuple[str, ...]:
        """Names of the coordinates along which cells may be graded."""
        return ()

    @property
    def no_hexahedra_reason(self) -> str:
        """Return why the shape has no hexahedral mesh; "" if it has one, or is read from a file."""
        return ""

    @property
    def similar_mesh_size(self) -> float | None:
        """Cell size, m, such that this size and its whole fractions give similar meshes; None if there is none."""
        return None

    @property
    def coordinate_ranges(self) -> dict[str, Span]:
        """Ranges of the coordinates that belong to the shape, by name; empty if meshes cannot be cut along them."""
        return {}

    @property
    def swept(self) -> Swept | None:
        """Equivalent body with sections along an axis, as beam models need; None if there is none."""
        return None

    def place(self, *args: Any, **kwargs: Any) -> Vector3:
        """Return the point, m, at given values of the shape's coordinates, those named in `spans`."""
        raise NotImplementedError(f"{type(self).__name__} has no coordinates of its own")

    def cut_at_plane(self, plane: Plane) -> Cut | None:
        """Return the cut across the section in the plane a x + b y + c z + d = 0, given by (a, b, c, d).

        Return None if a mesh cannot have nodes on this plane.
        """
        return None

    def counts(self, size: float, cuts: tuple[Cut, ...] = ()) -> tuple[int, ...] | None:
        """Return the numbers of cells along the mesh's directions for a cell `size` (m); None if undetermined."""
        return None

    def mesh(self, kind: str, size: float, cuts: tuple[Cut, ...] = ()) -> Mesh:
        """Return a mesh of the element `kind`, edges of about `size` (m), nodes on `cuts`. Raises UnknownElement."""
        raise NotImplementedError(f"{type(self).__name__} has no mesh")

    def mesh_with_groups(self, kind: str | None = None) -> Mesh:
        """Return the mesh of a file with its named groups, as the element `kind` or with the file's own cells."""
        raise NotImplementedError(f"{type(self).__name__} reads no file")

    def surface(self, size: float) -> Surface:
        """Return points (n, 3), m, and triangles (t, 3) of the surface, outward, with edges of about `size` (m)."""
        from softmark.solvers.mesh.mesh import boundary_surface

        return boundary_surface(self.mesh(Tetrahedron.linear, size))

    @property
    def sides(self) -> tuple[CurvedSide, ...]:
        """Curved parts of the boundary."""
        return ()

    def contains(self, point: Vector3) -> bool:
        """Return whether the shape contains a point, within 1e-9 of its size; True if unknown."""
        return True

    def hollow_at(self, point: Vector3) -> bool:
        """Return whether a point lies inside a hole on the axis, within 1e-9 of the length."""
        return False


class Swept(Shape):
    """A body with cross-sections along an axis, as beam models need.

    For a tapered body, `section` encloses all its sections, and `section_at` returns the section at a station.
    """

    @property
    def tapered(self) -> bool:
        """True if the sections of the body differ."""
        return False

    if TYPE_CHECKING:

        @property
        def length(self) -> float:
            """Length along the axis, m."""

        @property
        def axis(self) -> Vector3:
            """Unit vector along the axis at its start, `root`."""

        @property
        def root(self) -> Vector3:
            """Centre of the section at the start of the axis, m."""

        @property
        def section(self) -> Section:
            """The cross-section."""

    @property
    def swept(self) -> Swept | None:
        """The body itself."""
        return self

    @property
    def axis_curvature(self) -> float:
        """Curvature of the axis, 1/m."""
        return 0.0

    @property
    def taper_slope(self) -> float:
        """Change of half of the section's widest extent per length of the axis, dimensionless; 0 without taper."""
        return 0.0

    def section_at(self, station: float) -> Section:
        """Return the cross-section at a station: a distance from the root along the axis, m."""
        return self.section

    def centre(self, station: float) -> Vector3:
        """Return the centre of the section at a station, m from the root along the axis."""
        raise NotImplementedError(f"{type(self).__name__} has no axis")

    def frame(self, station: float) -> tuple[Vector3, Vector3, Vector3]:
        """Return the unit vectors at a station, right-handed: along the axis, and the two axes of the section."""
        raise NotImplementedError(f"{type(self).__name__} has no axis")

    def bounds_between(self, first: float, last: float) -> Bounds:
        """Return the lowest and highest coordinates of the part between two stations, m."""
        raise NotImplementedError(f"{type(self).__name__} has no axis")

    def section_coordinates(self, point: Vector3) -> Vector3:
        """Return a point's station and two section coordinates, m; stations continue beyond the ends."""
        raise NotImplementedError(f"{type(self).__name__} has no axis")

    def stations(self, X: Floats) -> Floats:
        """Return the stations (n,) of points (n, 3), m."""
        return self.coordinates(X)[0]

    def coordinates(self, X: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the stations and both section coordinates of points X (n, 3), as three arrays (n,), m."""
        s, u, v = np.array([self.section_coordinates(tuple(point)) for point in X.tolist()]).reshape(-1, 3).T
        return s, u, v

    @property
    def bounds(self) -> Bounds:
        """Lowest and highest coordinates, m."""
        return self.bounds_between(0.0, self.length)

    @property
    def volume(self) -> float:
        """Exact volume, m^3, by Pappus: the axis passes through the centroids of the sections."""
        return self.section.area * self.length

    def contains(self, point: Vector3) -> bool:
        """Return whether the body contains a point, within 1e-9 of its length."""
        slack = 1e-9 * self.length
        s, u, v = self.section_coordinates(point)
        return -slack <= s <= self.length + slack and self.section_at(s).contains(u, v, slack)

    def hollow_at(self, point: Vector3) -> bool:
        """Return whether a point lies inside a hole on the axis, within 1e-9 of the length."""
        slack = 1e-9 * self.length
        s, u, v = self.section_coordinates(point)
        on = -slack <= s <= self.length + slack and math.hypot(u, v) <= slack
        return on and self.section_at(s).hole_radius is not None


class Prism(Swept):
    """A straight body with one cross-section."""

    def centre(self, station: float) -> Vector3:
        """Return the centre of the section at a station, m from the root."""
        x, y, z = (r + station * a for r, a in zip(self.root, self.axis, strict=True))
        return x, y, z

    def frame(self, station: float) -> tuple[Vector3, Vector3, Vector3]:
        """Return the unit vectors of all sections: along the axis, and the two axes of the section."""
        return self.axis, *transverse(self.axis)

    def bounds_between(self, first: float, last: float) -> Bounds:
        """Return the lowest and highest coordinates of the part between two stations, m."""
        ends = zip(self.centre(first), self.centre(last), strict=True)
        x, y, z = ((min(pair) - r, max(pair) + r) for pair, r in zip(ends, _section_reach(self), strict=True))
        return (x[0], y[0], z[0]), (x[1], y[1], z[1])

    def section_coordinates(self, point: Vector3) -> Vector3:
        """Return a point's station and its two section coordinates, m."""
        offset = [p - r for p, r in zip(point, self.root, strict=True)]
        s, u, v = (sum(a * o for a, o in zip(t, offset, strict=True)) for t in self.frame(0.0))
        return s, u, v

    def coordinates(self, X: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the stations and both section coordinates of points X (n, 3), as three arrays (n,), m."""
        offset = X - np.array(self.root)
        s, u, v = (offset @ np.array(t) for t in self.frame(0.0))
        return s, u, v


@lru_cache(maxsize=64)
def _section_reach(shape: Prism) -> Vector3:
    """Return how far the sections of a straight body extend from their centres along x, y and z, m."""
    return shape.section.reach(shape.axis)


class RoundPrism(Prism):
    """A straight body of circular section, whose axis starts at `origin`."""

    if TYPE_CHECKING:

        @property
        def radius(self) -> float:
            """Outer radius, m."""

        @property
        def origin(self) -> Vector3:
            """Centre of the end where the axis starts, m."""

    @property
    def root(self) -> Vector3:
        """Start of the axis, m."""
        return self.origin

    @property
    def gradable_coordinates(self) -> tuple[str, ...]:
        """Names of the coordinates along which cells may be graded: along the axis, and across a wall."""
        return ("along",) if self.section.hole_radius is None else ("radius", "along")

    @property
    def coordinate_ranges(self) -> dict[str, Span]:
        """Ranges of radius and axial position, m, and of the angle from the first transverse axis, rad."""
        inner = self.section.hole_radius or 0.0
        return {"radius": (inner, self.radius), "turn": (0.0, 2.0 * math.pi), "along": (0.0, self.length)}

    def place(self, radius: float, turn: float, along: float) -> Vector3:
        """Return the point, m, at a radius, m, an angle (`turn`, rad) and an axial position (`along`, m)."""
        first, second = transverse(self.axis)
        u, v = radius * math.cos(turn), radius * math.sin(turn)
        return add_multiples(self.origin, (u, first), (v, second), (along, self.axis))

    def cut_at_plane(self, plane: Plane) -> Cut | None:
        """Return the cut across the section in the plane a x + b y + c z + d = 0, given by (a, b, c, d).

        Return None if the plane is not parallel to the axis, or misses the body.
        """
        normal = plane[:3]
        norm = math.hypot(*normal)
        if norm == 0.0 or abs(dot(normal, self.axis)) > 1e-9 * norm:
            return None
        first, second = transverse(self.axis)
        at = -(dot(normal, self.origin) + plane[3]) / norm
        turn = math.atan2(dot(normal, second), dot(normal, first))
        return Cut("chord", at, turn=turn) if abs(at) < self.radius else None
