"""What every shape says, every body along an axis, and every straight prism.

Those of `shapes.py` derive from these, and say what is otherwise.

Nobody asks whether a shape has a member: all are here, with what a shape says of which nothing else is known. What a
scene writes as a field of some (`length`, `axis`) is declared for the type checker alone: a dataclass would take it for
the field's default.
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
    """Their product; of numbers, arrays and bounds alike."""
    return sum(p * e for p, e in zip(vector, unit, strict=True) if e)


def moved(origin: Vector3, *parts: tuple[float, Vector3]) -> Vector3:
    """The origin plus multiples of vectors."""
    return tuple(o + sum(c * v[i] for c, v in parts) for i, o in enumerate(origin))  # type: ignore[return-value]


def cross(a: tuple[float, ...], b: tuple[float, ...]) -> Vector3:
    """a x b."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def with_coordinate(point: Vector3, axis: int, value: float) -> Vector3:
    """A point with another coordinate along x, y or z."""
    x, y, z = (value if i == axis else c for i, c in enumerate(point))
    return x, y, z


def transverse(axis: Vector3) -> tuple[Vector3, Vector3]:
    """Two unit vectors that make a right-handed frame with `axis`; coordinate axes stay coordinate axes."""
    smallest = min(range(3), key=lambda i: (round(abs(axis[i]), 12), i))
    seed = tuple(1.0 if i == smallest else 0.0 for i in range(3))
    second = cross(axis, seed)
    norm = sum(c * c for c in second) ** 0.5
    second = (second[0] / norm, second[1] / norm, second[2] / norm)
    return cross(second, axis), second


def placed(mesh: Mesh, axis: Vector3, origin: Vector3) -> Mesh:
    """A mesh made along z, turned so that z becomes `axis`, and moved to `origin`."""
    from softmark.solvers.mesh.mesh import Mesh

    first, second = transverse(axis)
    frame: Floats = np.array([first, second, axis])  # rows: images of x, y, z
    return Mesh(np.ascontiguousarray(mesh.points @ frame + np.array(origin)), mesh.cells, mesh.kind)


class Section:
    """A cross-section, in coordinates from its centre along the two axes of `transverse`, m."""

    @property
    def extents(self) -> tuple[float, float]:
        """Along its first and its second axis, m."""
        raise NotImplementedError(f"{type(self).__name__} has no extents")

    @property
    def area(self) -> float:
        """Area, m^2."""
        raise NotImplementedError(f"{type(self).__name__} has no area")

    @property
    def moments(self) -> tuple[float, float]:
        """Second moments of area about its first and its second axis, m^4."""
        raise NotImplementedError(f"{type(self).__name__} has no moments")

    @property
    def torsion(self) -> float:
        """Saint-Venant torsion constant, m^4."""
        raise NotImplementedError(f"{type(self).__name__} has no torsion")

    def shear_factor(self, poisson: float) -> float:
        """Mean shear strain times it, G and the area is the shear force."""
        raise NotImplementedError(f"{type(self).__name__} has no shear factor")

    def samples(self) -> list[tuple[float, float]]:
        """Points of it, m, its corners among them."""
        raise NotImplementedError(f"{type(self).__name__} has no samples")

    def contains(self, u: float, v: float, slack: float) -> bool:
        """Whether a point of its plane lies within, give or take `slack` (m)."""
        raise NotImplementedError(f"{type(self).__name__} holds no points")

    def outside(self, u: Floats, v: Floats) -> Floats:
        """How far points of its plane (n,) lie outside (n,), m."""
        raise NotImplementedError(f"{type(self).__name__} has no outside")

    def outline(self, around: int) -> Floats:
        """About `around` points of its border (k, 2), m, counter-clockwise."""
        raise NotImplementedError(f"{type(self).__name__} has no outline")

    @property
    def hollow(self) -> float | None:
        """The radius of its hole, m; None where it has none."""
        return None

    def hole(self, around: int) -> Floats | None:
        """As many points of the border of its hole (k, 2), m, counter-clockwise; None where it has none."""
        return None

    def support(self, a: float, b: float) -> float:
        """The largest a u + b v over its points (u, v), m: of one with corners."""
        return max(a * u + b * v for u, v in self.samples())

    def reach(self, axis: Vector3) -> Vector3:
        """How far it reaches from its centre along x, y and z, m, normal to an axis: of one with corners."""
        first, second = transverse(axis)
        rows = [tuple(u * a + v * b for a, b in zip(first, second, strict=True)) for u, v in self.samples()]
        x, y, z = (max(abs(c) for c in column) for column in zip(*rows, strict=True))
        return x, y, z


class Circular(Section):
    """A section with a circular border, and no other but that of a round hole in its middle."""

    radius: float

    @property
    def extents(self) -> tuple[float, float]:
        """Its diameter, m."""
        return 2.0 * self.radius, 2.0 * self.radius

    @property
    def torsion(self) -> float:
        """Saint-Venant torsion constant, m^4: as round sections do not warp, the polar second moment."""
        return sum(self.moments)

    def outline(self, around: int) -> Floats:
        """Points of its outer border (around, 2), m, counter-clockwise."""
        turn = 2 * math.pi * np.arange(around) / around
        circle: Floats = self.radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)
        return circle

    def support(self, a: float, b: float) -> float:
        """The largest a u + b v over its points (u, v), m."""
        return self.radius * math.hypot(a, b)

    def reach(self, axis: Vector3) -> Vector3:
        """How far it reaches from its centre along x, y and z, m: all of it, points of its rim may miss that."""
        x, y, z = (self.radius * math.sqrt(max(0.0, 1.0 - a * a)) for a in axis)
        return x, y, z


class Side:
    """A curved part of a shape's boundary: facets of meshes are inscribed in it."""

    def of(self, corners: Floats) -> NDArray[np.bool_]:
        """Which facets with nodes (f, k, 3), m, stand for it (f,): all their nodes lie on it."""
        raise NotImplementedError(f"{type(self).__name__} knows no facets")

    def onto(self, place: Any) -> Any:
        """x, y and z of points, moved straight out onto it: numbers, arrays or bounds of them, m.

        What is selected by a distance from it must not depend on how flat facets are.
        """
        raise NotImplementedError(f"{type(self).__name__} has no places")


class Shape:
    """The geometry of a body, of which nothing else is said."""

    prebuilt: ClassVar[bool] = False  # its cells are those of a file, and a size has no part in them
    enclosed: ClassVar[bool] = False  # it is filled with tetrahedra, and asks a mesher for them
    flat: ClassVar[bool] = False  # it is a region of a plane, for plane problems
    meshed: ClassVar[bool] = True  # cells can be made of it; of others there are rigid bodies alone
    wired: ClassVar[bool] = False  # it is a network of axes, of which no cells are made
    gap: ClassVar[str] = "hollow"  # why a point between others that it holds may be outside, where it is not convex

    @property
    def fault(self) -> str:
        """Why no body has this shape, where its fields do not go together; "" where they do."""
        return ""

    @property
    def convex(self) -> bool:
        """Whether it holds all between two points that it holds: known, and true."""
        return False

    @property
    def file(self) -> str:
        """The file that it is read from, "" of none."""
        return ""

    @property
    def bounds(self) -> Bounds | None:
        """Lowest and highest coordinates, m; None where only its file knows."""
        return None

    @property
    def diagonal(self) -> float:
        """Of its bounds, m; 0 where there are none."""
        return 0.0 if self.bounds is None else math.dist(*self.bounds)

    @property
    def volume(self) -> float | None:
        """Exact volume, m^3, where it is known."""
        return None

    @property
    def least(self) -> float:
        """A volume, m^3, that it has at least, as far as can be told without its surface."""
        return self.volume or 0.0

    @property
    def skin(self) -> float | None:
        """Exact area of its surface, m^2, where it is known."""
        return None

    @property
    def gradable(self) -> tuple[str, ...]:
        """Those of its own coordinates along which its meshes can be graded."""
        return ()

    @property
    def lacks(self) -> str:
        """Why it has no mesh of hexahedra; "" where it has one, and of a file."""
        return ""

    @property
    def even(self) -> float | None:
        """Sizes that are this by whole numbers give similar meshes, m; None where there are none such."""
        return None

    @property
    def spans(self) -> dict[str, Span]:
        """Coordinates of its own, and their ends; none where meshes cannot be cut along them."""
        return {}

    @property
    def swept(self) -> Swept | None:
        """The same as sections along an axis, which is what beams take; None where it is no such body."""
        return None

    def place(self, *args: Any, **kwargs: Any) -> Vector3:
        """The point of its own coordinates, m."""
        raise NotImplementedError(f"{type(self).__name__} has no coordinates of its own")

    def chord(self, plane: Plane) -> Cut | None:
        """The cut of a plane a x + b y + c z + d = 0 across its section, where a mesh can have one."""
        return None

    def counts(self, size: float, cuts: tuple[Cut, ...] = ()) -> tuple[int, ...] | None:
        """Cells of a mesh of a size (m) along its directions; None where a size does not say."""
        return None

    def mesh(self, kind: str, size: float, cuts: tuple[Cut, ...] = ()) -> Mesh:
        """Cells of an element with edges of about `size` (m), nodes on cuts. Raises UnknownElement."""
        raise NotImplementedError(f"{type(self).__name__} has no mesh")

    def named(self, kind: str | None = None) -> Mesh:
        """The mesh of a file with its groups, as an element, or without one as the file has its cells."""
        raise NotImplementedError(f"{type(self).__name__} reads no file")

    def surface(self, size: float) -> Surface:
        """Points (n, 3) in m and triangles (t, 3) of its surface, outward, with edges of about `size` (m)."""
        from softmark.solvers.mesh.mesh import surface

        return surface(self.mesh(Tetrahedron.linear, size))

    @property
    def sides(self) -> tuple[Side, ...]:
        """The curved parts of its boundary."""
        return ()

    def contains(self, point: Vector3) -> bool:
        """Whether it holds a point, give or take 1e-9 of its size; True where that is not known."""
        return True

    def hollow_at(self, point: Vector3) -> bool:
        """Whether a point is on its axis, give or take 1e-9 of its length, within a hole: sections are around it."""
        return False


class Swept(Shape):
    """A body of one cross-section along an axis: what beams, and all that goes along an axis, ask of a shape.

    Where it tapers, `section` holds all of its sections, and `section_at` says each.
    """

    @property
    def tapered(self) -> bool:
        """Whether its sections differ."""
        return False

    if TYPE_CHECKING:

        @property
        def length(self) -> float:
            """Along the axis, m."""

        @property
        def axis(self) -> Vector3:
            """Unit vector along the axis where it starts, at `root`."""

        @property
        def root(self) -> Vector3:
            """The centre of the section where the axis starts, m."""

        @property
        def section(self) -> Section:
            """The cross-section."""

    @property
    def swept(self) -> Swept | None:
        """Itself."""
        return self

    @property
    def bend(self) -> float:
        """The curvature of its axis, 1/m."""
        return 0.0

    @property
    def slope(self) -> float:
        """How fast half of its widest extent grows or shrinks along the axis."""
        return 0.0

    def section_at(self, station: float) -> Section:
        """The cross-section at a station, m from the root."""
        return self.section

    def centre(self, station: float) -> Vector3:
        """The centre of the section at a station, m from the root along the axis."""
        raise NotImplementedError(f"{type(self).__name__} has no axis")

    def frame(self, station: float) -> tuple[Vector3, Vector3, Vector3]:
        """Unit vectors of the section there, right-handed: along the axis, and the section's first and second."""
        raise NotImplementedError(f"{type(self).__name__} has no axis")

    def slab(self, first: float, last: float) -> Bounds:
        """The lowest and highest coordinates of all between two stations, m."""
        raise NotImplementedError(f"{type(self).__name__} has no axis")

    def own(self, point: Vector3) -> Vector3:
        """The station of a point, and its place in the section there, m; stations go on beyond the ends."""
        raise NotImplementedError(f"{type(self).__name__} has no axis")

    def stations(self, X: Floats) -> Floats:
        """The stations (n,) of points (n, 3), m."""
        return self.coordinates(X)[0]

    def coordinates(self, X: Floats) -> tuple[Floats, Floats, Floats]:
        """What `own` says of each of points (n, 3), m, as three arrays (n,)."""
        s, u, v = np.array([self.own(tuple(point)) for point in X.tolist()]).reshape(-1, 3).T
        return s, u, v

    @property
    def bounds(self) -> Bounds:
        """Lowest and highest coordinates, m."""
        return self.slab(0.0, self.length)

    @property
    def volume(self) -> float:
        """Exact volume, m^3: its axis goes through the centroids of its sections (Pappus)."""
        return self.section.area * self.length

    def contains(self, point: Vector3) -> bool:
        """Whether it holds a point, give or take 1e-9 of its length."""
        slack = 1e-9 * self.length
        s, u, v = self.own(point)
        return -slack <= s <= self.length + slack and self.section_at(s).contains(u, v, slack)

    def hollow_at(self, point: Vector3) -> bool:
        """Whether a point is on its axis, give or take 1e-9 of its length, within a hole: sections are around it."""
        slack = 1e-9 * self.length
        s, u, v = self.own(point)
        on = -slack <= s <= self.length + slack and math.hypot(u, v) <= slack
        return on and self.section_at(s).hollow is not None


class Prism(Swept):
    """A straight body of one cross-section."""

    def centre(self, station: float) -> Vector3:
        """The centre of the section at a station, m from the root."""
        x, y, z = (r + station * a for r, a in zip(self.root, self.axis, strict=True))
        return x, y, z

    def frame(self, station: float) -> tuple[Vector3, Vector3, Vector3]:
        """Unit vectors of all its sections: along the axis, and across it."""
        return self.axis, *transverse(self.axis)

    def slab(self, first: float, last: float) -> Bounds:
        """The lowest and highest coordinates of all between two stations, m."""
        ends = zip(self.centre(first), self.centre(last), strict=True)
        x, y, z = ((min(pair) - r, max(pair) + r) for pair, r in zip(ends, _reach(self), strict=True))
        return (x[0], y[0], z[0]), (x[1], y[1], z[1])

    def own(self, point: Vector3) -> Vector3:
        """The station of a point, and its place in the section, m."""
        offset = [p - r for p, r in zip(point, self.root, strict=True)]
        s, u, v = (sum(a * o for a, o in zip(t, offset, strict=True)) for t in self.frame(0.0))
        return s, u, v

    def coordinates(self, X: Floats) -> tuple[Floats, Floats, Floats]:
        """What `own` says of each of points (n, 3), m, as three arrays (n,)."""
        offset = X - np.array(self.root)
        s, u, v = (offset @ np.array(t) for t in self.frame(0.0))
        return s, u, v


@lru_cache(maxsize=64)
def _reach(shape: Prism) -> Vector3:
    """How far its sections reach from their centres along x, y and z, m."""
    return shape.section.reach(shape.axis)


class RoundPrism(Prism):
    """A straight body of circular section, its axis starting at `origin`."""

    if TYPE_CHECKING:

        @property
        def radius(self) -> float:
            """Of its outer side, m."""

        @property
        def origin(self) -> Vector3:
            """The centre of the end where the axis starts, m."""

    @property
    def root(self) -> Vector3:
        """Where the axis starts, m."""
        return self.origin

    @property
    def gradable(self) -> tuple[str, ...]:
        """Along the axis, and across a wall."""
        return ("along",) if self.section.hollow is None else ("radius", "along")

    @property
    def spans(self) -> dict[str, Span]:
        """Its own coordinates: distance from the axis and along it, m, and the angle from the first transverse axis."""
        inner = self.section.hollow or 0.0
        return {"radius": (inner, self.radius), "turn": (0.0, 2.0 * math.pi), "along": (0.0, self.length)}

    def place(self, radius: float, turn: float, along: float) -> Vector3:
        """The point of its own coordinates, m."""
        first, second = transverse(self.axis)
        u, v = radius * math.cos(turn), radius * math.sin(turn)
        return moved(self.origin, (u, first), (v, second), (along, self.axis))

    def chord(self, plane: Plane) -> Cut | None:
        """The cut of a plane a x + b y + c z + d = 0 along the axis; None where it is not along it, or outside."""
        normal = plane[:3]
        norm = math.hypot(*normal)
        if norm == 0.0 or abs(dot(normal, self.axis)) > 1e-9 * norm:
            return None
        first, second = transverse(self.axis)
        at = -(dot(normal, self.origin) + plane[3]) / norm
        turn = math.atan2(dot(normal, second), dot(normal, first))
        return Cut("chord", at, turn=turn) if abs(at) < self.radius else None
