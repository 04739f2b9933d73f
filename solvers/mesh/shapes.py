"""Shapes: what a scene may call a body's geometry. To add one: a class here or in a file of its own, a line in SHAPES.

A shape derives from `Shape` (shape.py), which says what may be asked of it, and makes a mesh only when it is asked. A
straight prism derives from `Prism`: it has `section`, `length`, `axis` and `root`, which is all that a beam model needs
of it; one of circular section from `RoundPrism`. A shape with `spans` has coordinates of its own: its meshes take
`cuts`, surfaces on which one of these is constant, and put nodes there.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Literal

from softmark.records import dataclass
from softmark.solvers.mesh.cuts import Cut, along, cells
from softmark.solvers.mesh.divisions import circles, divisions, of_disc, of_rectangle
from softmark.solvers.mesh.filled import Filled
from softmark.solvers.mesh.flat import Quadrilateral, QuarterRing
from softmark.solvers.mesh.shape import (
    Bounds,
    Circular,
    Prism,
    RoundPrism,
    Section,
    Shape,
    Span,
    Vector3,
    dot,
    placed,
    transverse,
)
from softmark.solvers.mesh.sides import Around, cylinders
from softmark.solvers.mesh.spheres import Ellipsoid, Sphere, SphericalShell
from softmark.solvers.mesh.tube import Tube

if TYPE_CHECKING:
    import numpy as np

    from softmark.solvers.mesh.mesh import Floats, Mesh
    from softmark.solvers.mesh.shape import Surface
else:
    from softmark.solvers.base.deferred import np


@dataclass(frozen=True)
class Disc(Circular):
    """A circular cross-section, radius in m."""

    radius: float

    @property
    def area(self) -> float:
        """Area, m^2."""
        return math.pi * self.radius**2

    @property
    def moments(self) -> tuple[float, float]:
        """Second moments of area about the two axes of the section, m^4."""
        return math.pi * self.radius**4 / 4, math.pi * self.radius**4 / 4

    def shear_factor(self, poisson: float) -> float:
        """Cowper (1966): 6 (1 + nu) / (7 + 6 nu)."""
        return 6 * (1 + poisson) / (7 + 6 * poisson)

    def samples(self) -> list[tuple[float, float]]:
        """Points of the section, m: its centre and two rings."""
        turns = [2 * math.pi * i / 16 for i in range(16)]
        rings = [(r * math.cos(t), r * math.sin(t)) for r in (0.5 * self.radius, self.radius) for t in turns]
        return [(0.0, 0.0), *rings]

    def contains(self, u: float, v: float, slack: float) -> bool:
        """Whether a point of the section's plane lies within, give or take `slack` (m)."""
        return math.hypot(u, v) <= self.radius + slack

    def outside(self, u: Floats, v: Floats) -> Floats:
        """How far points of its plane (n,) lie outside (n,), m."""
        far: Floats = np.maximum(np.hypot(u, v) - self.radius, 0.0)
        return far


@dataclass(frozen=True)
class Rectangle(Section):
    """A rectangular cross-section: extents in m along the two axes of the section."""

    width: float  # along the first transverse axis
    height: float  # along the second transverse axis

    @property
    def extents(self) -> tuple[float, float]:
        """Its width and its height, m."""
        return self.width, self.height

    @property
    def area(self) -> float:
        """Area, m^2."""
        return self.width * self.height

    @property
    def moments(self) -> tuple[float, float]:
        """Second moments of area about the first and the second transverse axis, m^4."""
        return self.width * self.height**3 / 12, self.height * self.width**3 / 12

    @property
    def torsion(self) -> float:
        """Saint-Venant torsion constant, m^4, by its series (Timoshenko and Goodier 1970, section 109)."""
        a, b = sorted((self.width, self.height))
        odd = range(1, 40, 2)
        series = sum(math.tanh(n * math.pi * b / (2 * a)) / n**5 for n in odd)
        return a**3 * b / 3 * (1 - 192 * a / (math.pi**5 * b) * series)

    def shear_factor(self, poisson: float) -> float:
        """Cowper (1966): 10 (1 + nu) / (12 + 11 nu)."""
        return 10 * (1 + poisson) / (12 + 11 * poisson)

    def samples(self) -> list[tuple[float, float]]:
        """Points of the section, m: a grid with its corners."""
        steps = (-0.5, -0.25, 0.0, 0.25, 0.5)
        return [(a * self.width, b * self.height) for a in steps for b in steps]

    def contains(self, u: float, v: float, slack: float) -> bool:
        """Whether a point of the section's plane lies within, give or take `slack` (m)."""
        return abs(u) <= self.width / 2 + slack and abs(v) <= self.height / 2 + slack

    def outside(self, u: Floats, v: Floats) -> Floats:
        """How far points of its plane (n,) lie outside (n,), m."""
        sides = np.abs(u) - 0.5 * self.width, np.abs(v) - 0.5 * self.height
        far: Floats = np.hypot(*(np.maximum(side, 0.0) for side in sides))
        return far

    def outline(self, around: int) -> Floats:
        """Points of its border (k, 2), m, as many on each side, counter-clockwise from its lowest corner."""
        n = around // 4
        t = np.linspace(-0.5, 0.5, n + 1)[:-1]
        half = np.full(n, 0.5)
        sides = [(t, -half), (half, t), (-t, half), (-half, -t)]
        unit = np.concatenate([np.stack(side, axis=1) for side in sides])
        rectangle: Floats = unit * np.array([self.width, self.height])
        return rectangle


@dataclass(frozen=True)
class Cylinder(RoundPrism):
    """A straight circular cylinder, its axis starting at `origin`.

    Meshed with rings of well-shaped cells around a square core. The mesh is inscribed: its points lie on the cylinder,
    so a coarse mesh holds less volume (the report says how much).
    """

    convex = True

    length: Annotated[float, "m in (0, inf)", "length along the axis"]
    radius: Annotated[float, "m in (0, inf)", "radius of the cross-section"]
    axis: Annotated[Vector3, "direction", "direction of the axis, from the end at `origin`"] = (1.0, 0.0, 0.0)
    origin: Annotated[Vector3, "m", "centre of the end where the axis starts"] = (0.0, 0.0, 0.0)

    @property
    def section(self) -> Disc:
        """The cross-section."""
        return Disc(self.radius)

    @property
    def even(self) -> float:
        """Sizes that are this by whole numbers give meshes whose sections are similar, m."""
        return self.radius / 2.5

    def counts(self, size: float, cuts: tuple[Cut, ...] = ()) -> tuple[int, ...]:
        """Cells of a mesh of a size (m) along the square's side, across the rings and along the axis."""
        side, rings = of_disc(self.radius, size)
        core, *outer = circles(self.radius, size, cuts)
        rings = divisions(0.4 * core, size) + len(outer) if outer else rings
        return side, rings, cells(0.0, self.length, divisions(self.length, size), along(cuts, "along"))

    def mesh(self, kind: str, size: float, cuts: tuple[Cut, ...] = ()) -> Mesh:
        """Cells of an element with edges of about `size` (m), nodes on cuts. Raises UnknownElement."""
        from softmark.solvers.mesh.structured import disc, rounded, solid

        mesh = solid(disc(self.radius, size, cuts=cuts), self.length, size, kind, cuts)
        return rounded(placed(mesh, self.axis, self.origin), self.sides, cylinders(self, cuts))

    @property
    def sides(self) -> tuple[Around, ...]:
        """Its curved side."""
        return (Around(self.axis, self.origin, self.length, self.radius),)


@dataclass(frozen=True)
class Box(Prism):
    """A rectangular box with edges along x, y and z."""

    convex = True

    size: Annotated[Vector3, "m in (0, inf)", "extents along x, y and z"]
    origin: Annotated[Vector3, "m", "corner with the lowest x, y and z"] = (0.0, 0.0, 0.0)

    @property
    def _longest(self) -> int:
        return max(range(3), key=lambda i: self.size[i])

    @property
    def axis(self) -> Vector3:
        """Unit vector along the longest edge: the axis of a beam."""
        return tuple(1.0 if i == self._longest else 0.0 for i in range(3))  # type: ignore[return-value]

    @property
    def length(self) -> float:
        """Longest extent, m."""
        return self.size[self._longest]

    @property
    def section(self) -> Rectangle:
        """The cross-section normal to the longest edge, along `transverse(axis)`."""
        extents = [sum(abs(t[i]) * self.size[i] for i in range(3)) for t in transverse(self.axis)]
        return Rectangle(extents[0], extents[1])

    @property
    def root(self) -> Vector3:
        """Centre of the end face with the lowest coordinate, m."""
        along = self._longest
        return tuple(  # type: ignore[return-value]
            o if i == along else o + 0.5 * s for i, (o, s) in enumerate(zip(self.origin, self.size, strict=True))
        )

    @property
    def bounds(self) -> Bounds:
        """Lowest and highest coordinates, m."""
        return self.origin, tuple(o + s for o, s in zip(self.origin, self.size, strict=True))  # type: ignore[return-value]

    @property
    def volume(self) -> float:
        """Exact volume, m^3."""
        return self.size[0] * self.size[1] * self.size[2]

    @property
    def even(self) -> float:
        """Sizes that are this by whole numbers divide the shortest edge evenly, m."""
        return min(self.size) / 2

    @property
    def spans(self) -> dict[str, Span]:
        """Its own coordinates, m: x, y and z."""
        return {n: (o, o + s) for n, o, s in zip("xyz", self.origin, self.size, strict=True)}

    def place(self, x: float, y: float, z: float) -> Vector3:
        """The point of its own coordinates, m."""
        return x, y, z

    def _turned(self, cuts: tuple[Cut, ...]) -> tuple[Cut, ...]:
        """Cuts as the mesh has them before it is placed: along the axis, and along the edges of the section."""
        frame = dict(zip(("first", "second", "along"), (*transverse(self.axis), self.axis), strict=True))
        found = []
        for cut in cuts:
            way = [float(axis == cut.axis) for axis in "xyz"]
            name, sense = next((n, dot(way, v)) for n, v in frame.items() if abs(dot(way, v)) > 0.5)
            found.append(replace(cut, axis=name, at=sense * (cut.at - dot(way, self.root))))
        return tuple(found)

    def counts(self, size: float, cuts: tuple[Cut, ...] = ()) -> tuple[int, ...]:
        """Cells of a mesh of a size (m) along both edges of the section and along the longest."""
        nx, ny = of_rectangle(self.section.width, self.section.height, size)
        w, h, own = self.section.width / 2, self.section.height / 2, self._turned(cuts)
        return (
            cells(-w, w, nx, along(own, "first")),
            cells(-h, h, ny, along(own, "second")),
            cells(0.0, self.length, divisions(self.length, size), along(own, "along")),
        )

    def mesh(self, kind: str, size: float, cuts: tuple[Cut, ...] = ()) -> Mesh:
        """Cells of an element with edges of about `size` (m), nodes on cuts. Raises UnknownElement."""
        from softmark.solvers.mesh.structured import rectangle, solid

        own = self._turned(cuts)
        section = rectangle(self.section.width, self.section.height, size, own)
        return placed(solid(section, self.length, size, kind, own), self.axis, self.root)


@dataclass(frozen=True)
class MeshFile(Shape):
    """A mesh read from a file, in any format that meshio knows (VTK, VTU, Gmsh, Abaqus, ...), and Gmsh's first.

    Its cells are taken as they are, so `size` of a model does not apply: tetrahedra of four or ten nodes, or
    hexahedra of eight, 20 or 27; those of eight are split where a model asks for tetrahedra. `five` tetrahedra for
    each hexahedron, with matching faces, need a mesh whose points can be coloured like a chessboard. `repeated` are
    five, cut alike in every hexahedron; `alternating` are six, mirrored by the hexahedron's number, as SOFA split
    meshes in 2008; `kuhn` are six around one diagonal. The faces of these three need not match: there cells may
    pass through each other when they deform, and the three serve to repeat what others computed.
    Points that no cell uses are dropped; cells that are inside out are turned, flat cells are an error. Nodes that lie
    at one place without being one (nearer than 1e-6 of the extent and a hundredth of the shortest edge) make a mesh
    fall apart that looks whole: they are an error, unless `coincident = merge` joins them or `keep` says that a slit
    is meant.
    Parts that share no face, faces of three cells and a mesh that passes through itself are errors.
    """

    prebuilt = True

    path: Annotated[str, "file", "the file, relative to the scene"]
    unit: Annotated[float, "m in (0, inf)", "length of one unit of the file's coordinates"]
    split: Annotated[Literal["five", "repeated", "alternating", "kuhn"], "how hexahedra are split into tetrahedra"] = (
        "five"
    )
    coincident: Annotated[
        Literal["refuse", "merge", "keep"], "what is done with nodes that lie at one place without being one"
    ] = "refuse"

    @property
    def file(self) -> str:
        """The file."""
        return self.path

    def mesh(self, kind: str, size: float = 0.0, cuts: tuple[Cut, ...] = ()) -> Mesh:
        """The cells of the file as an element, of no other size and uncut. Raises UnreadableMesh, UnknownElement."""
        from softmark.solvers.mesh.files.reading import converted, read

        return converted(read(self.path, self.unit, self.coincident), kind, self.split)

    def named(self, kind: str | None = None) -> Mesh:
        """The same with the groups of the file; without an element as the file has its cells. Raises as `mesh`."""
        from softmark.solvers.mesh.files.reading import converted, read

        whole = read(self.path, self.unit, self.coincident, named=True)
        return whole if kind is None else converted(whole, kind, self.split)

    def surface(self, size: float = 0.0) -> Surface:
        """Points (n, 3) in m and triangles (t, 3) of its boundary, or of a file of triangles. Raises UnreadableMesh."""
        from softmark.solvers.mesh.files.reading import read_surface

        return read_surface(self.path, self.unit, self.coincident)

    def points(self) -> Floats:
        """The points of the file that its cells use (n, 3), m, in the order of the file. Raises UnreadableMesh."""
        from softmark.solvers.mesh.files.reading import read_points

        return read_points(self.path, self.unit)


SHAPES: dict[str, type[Shape]] = {
    "cylinder": Cylinder,
    "box": Box,
    "tube": Tube,
    "sphere": Sphere,
    "ellipsoid": Ellipsoid,
    "spherical_shell": SphericalShell,
    "quadrilateral": Quadrilateral,
    "quarter_ring": QuarterRing,
    "mesh": MeshFile,
    "filled": Filled,
}
