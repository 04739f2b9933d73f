"""Shapes of bodies in scenes. To add a shape: write a class here or in a new file, and add a line to SHAPES.

A shape derives from `Shape` (shape.py) and makes a mesh only on request. A straight prism derives from `Prism`: it has
`section`, `length`, `axis` and `root`, which is all that a beam model needs. A prism of circular section derives from
`RoundPrism`. A shape with `spans` has coordinates of its own: its meshes accept `cuts`, which are surfaces of constant
coordinate, and have nodes there.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Literal

from softmark.records import dataclass
from softmark.solvers.mesh.arc_shapes import Arc
from softmark.solvers.mesh.boolean_shapes import Difference, Intersection, Union
from softmark.solvers.mesh.cell_counts import circle_radii, count_disc_cells, count_divisions, count_rectangle_cells
from softmark.solvers.mesh.conforming_planes import Cut, count_cells, cuts_along
from softmark.solvers.mesh.cross_sections import Disc, Rectangle
from softmark.solvers.mesh.curved_boundary import CylinderSide, cylinders_of_cuts
from softmark.solvers.mesh.disjoint_shapes import DisjointShapes
from softmark.solvers.mesh.ellipsoidal_shells import TruncatedEllipsoidSection, TruncatedEllipsoidShell
from softmark.solvers.mesh.extruded_shapes import Extruded
from softmark.solvers.mesh.plane_regions import Quadrilateral, QuarterRing
from softmark.solvers.mesh.revolved_bodies import Cone, Revolved
from softmark.solvers.mesh.rigid_shapes import HalfSpace, Punch, RoundedBox, RoundedCone
from softmark.solvers.mesh.shape import (
    Bounds,
    Prism,
    RoundPrism,
    Shape,
    Span,
    Vector3,
    dot,
    place_mesh,
    transverse,
)
from softmark.solvers.mesh.spheres import Ellipsoid, Sphere, SphericalShell
from softmark.solvers.mesh.surface_bodies import Tetrahedralized
from softmark.solvers.mesh.tubes import Tube

if TYPE_CHECKING:
    from softmark.solvers.mesh.mesh import Floats, Mesh
    from softmark.solvers.mesh.shape import Surface


@dataclass(frozen=True)
class Cylinder(RoundPrism):
    """A straight circular cylinder, whose axis starts at `origin`.

    It is meshed with rings of well-shaped cells around a square core. The mesh is inscribed: its points lie on the
    cylinder, so a coarse mesh has less volume (the report gives the difference).
    """

    convex = True
    has_signed_distance = True
    has_mass_properties = True

    length: Annotated[float, "m in (0, inf)", "length along the axis"]
    radius: Annotated[float, "m in (0, inf)", "radius of the cross-section"]
    axis: Annotated[Vector3, "direction", "direction of the axis, from the end at `origin`"] = (1.0, 0.0, 0.0)
    origin: Annotated[Vector3, "m", "centre of the end where the axis starts"] = (0.0, 0.0, 0.0)

    @property
    def section(self) -> Disc:
        """The cross-section."""
        return Disc(self.radius)

    @property
    def similar_mesh_size(self) -> float:
        """Cell size, m, such that this size and its whole fractions give meshes with similar sections."""
        return self.radius / 2.5

    def counts(self, size: float, cuts: tuple[Cut, ...] = ()) -> tuple[int, ...]:
        """Return the numbers of cells for a cell `size` (m): along the core's side, across the rings, axial."""
        side, rings = count_disc_cells(self.radius, size)
        core, *outer = circle_radii(self.radius, size, cuts)
        rings = count_divisions(0.4 * core, size) + len(outer) if outer else rings
        return side, rings, count_cells(0.0, self.length, count_divisions(self.length, size), cuts_along(cuts, "along"))

    def mesh(self, kind: str, size: float, cuts: tuple[Cut, ...] = ()) -> Mesh:
        """Return a mesh of an element with edges of about `size` (m), nodes on cuts. Raises UnknownElement."""
        from softmark.solvers.mesh.structured_meshes import mesh_disc, mesh_extrusion, project_midside_nodes

        mesh = mesh_extrusion(mesh_disc(self.radius, size, cuts=cuts), self.length, size, kind, cuts)
        return project_midside_nodes(
            place_mesh(mesh, self.axis, self.origin), self.sides, cylinders_of_cuts(self, cuts)
        )

    @property
    def sides(self) -> tuple[CylinderSide, ...]:
        """Curved side."""
        return (CylinderSide(self.axis, self.origin, self.length, self.radius),)


@dataclass(frozen=True)
class Box(Prism):
    """A rectangular box with edges along x, y and z."""

    convex = True
    has_signed_distance = True
    has_mass_properties = True

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
        """The cross-section normal to the longest edge; its axes are those of `transverse(axis)`."""
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
    def similar_mesh_size(self) -> float:
        """Cell size, m, such that this size and its whole fractions divide the shortest edge evenly."""
        return min(self.size) / 2

    @property
    def gradable_coordinates(self) -> tuple[str, ...]:
        """Names of the coordinates along which cells may be graded: all three."""
        return ("x", "y", "z")

    @property
    def coordinate_ranges(self) -> dict[str, Span]:
        """Ranges of the coordinates x, y and z, m."""
        return {n: (o, o + s) for n, o, s in zip("xyz", self.origin, self.size, strict=True)}

    def place(self, x: float, y: float, z: float) -> Vector3:
        """Return the point with coordinates x, y and z, m."""
        return x, y, z

    def _cuts_in_mesh_coordinates(self, cuts: tuple[Cut, ...]) -> tuple[Cut, ...]:
        """Return cuts along x, y and z as cuts along the section's two edges and along the axis.

        These are the coordinates in which the mesh is made before it is rotated into place.
        """
        frame = dict(zip(("first", "second", "along"), (*transverse(self.axis), self.axis), strict=True))
        found = []
        for cut in cuts:
            way = [float(axis == cut.axis) for axis in "xyz"]
            name, sense = next((n, dot(way, v)) for n, v in frame.items() if abs(dot(way, v)) > 0.5)
            found.append(replace(cut, axis=name, at=sense * (cut.at - dot(way, self.root))))
        return tuple(found)

    def counts(self, size: float, cuts: tuple[Cut, ...] = ()) -> tuple[int, ...]:
        """Return the numbers of cells for a cell `size` (m): along both edges of the section and the longest edge."""
        nx, ny = count_rectangle_cells(self.section.width, self.section.height, size)
        w, h, own = self.section.width / 2, self.section.height / 2, self._cuts_in_mesh_coordinates(cuts)
        return (
            count_cells(-w, w, nx, cuts_along(own, "first")),
            count_cells(-h, h, ny, cuts_along(own, "second")),
            count_cells(0.0, self.length, count_divisions(self.length, size), cuts_along(own, "along")),
        )

    def mesh(self, kind: str, size: float, cuts: tuple[Cut, ...] = ()) -> Mesh:
        """Return a mesh of an element with edges of about `size` (m), nodes on cuts. Raises UnknownElement."""
        from softmark.solvers.mesh.structured_meshes import mesh_extrusion, mesh_rectangle

        own = self._cuts_in_mesh_coordinates(cuts)
        section = mesh_rectangle(self.section.width, self.section.height, size, own)
        return place_mesh(mesh_extrusion(section, self.length, size, kind, own), self.axis, self.root)


@dataclass(frozen=True)
class MeshFile(Shape):
    """A mesh read from a file, in any format that meshio supports (VTK, VTU, Abaqus, ...), or Gmsh.

    The cells are used as they are, so the `size` of a model does not apply. They are tetrahedra of four or ten nodes,
    or hexahedra of eight, 20 or 27 nodes. Hexahedra of eight nodes are split if a model needs tetrahedra, in one of
    four ways. `five` makes five tetrahedra of each hexahedron, with matching faces; it needs a mesh whose points can be
    coloured like a chessboard. `repeated` makes five tetrahedra, cut alike in every hexahedron. `alternating` makes
    six, mirrored by the hexahedron's number, as SOFA split meshes in 2008. `kuhn` makes six around one diagonal. The
    faces of the last three need not match: cells may then penetrate each other when they deform, so these three serve
    only to reproduce published results.

    Points that no cell uses are dropped; inverted cells are reordered; flat cells are an error. Coincident nodes
    (nearer than 1e-6 of the extent and a hundredth of the shortest edge) separate parts of a mesh that looks connected:
    they are an error, unless `coincident = merge` joins them or `keep` declares a slit.

    Parts that share no face, faces of three cells and self-intersecting meshes are errors. Pieces that share no node
    are an error too, unless `pieces = keep` declares a body in several pieces: then only supports, contact
    (`self_contact(BODY)`) or glue (`tied(BODY)`) connect one piece to another.
    """

    prebuilt = True
    has_signed_distance = True
    has_mass_properties = True

    path: Annotated[str, "file", "the file, relative to the scene"]
    unit: Annotated[float, "m in (0, inf)", "length of one unit of the file's coordinates"]
    split: Annotated[Literal["five", "repeated", "alternating", "kuhn"], "how hexahedra are split into tetrahedra"] = (
        "five"
    )
    coincident: Annotated[Literal["refuse", "merge", "keep"], "treatment of distinct nodes at the same place"] = (
        "refuse"
    )
    pieces: Annotated[Literal["refuse", "keep"], "treatment of pieces that share no nodes"] = "refuse"

    @property
    def file(self) -> str:
        """Path of the file."""
        return self.path

    def mesh(self, kind: str, size: float = 0.0, cuts: tuple[Cut, ...] = ()) -> Mesh:
        """Return the file's cells as an element; size and cuts are ignored. Raises UnreadableMesh, UnknownElement."""
        from softmark.solvers.mesh.files.mesh_reader import convert_cells, read_cells

        return convert_cells(read_cells(self.path, self.unit, self.coincident, pieces=self.pieces), kind, self.split)

    def mesh_with_groups(self, kind: str | None = None) -> Mesh:
        """Return the mesh with its named groups, as the element `kind`, or by default with the file's own cells.

        Raises the errors of `mesh`.
        """
        from softmark.solvers.mesh.files.mesh_reader import convert_cells, read_cells

        whole = read_cells(self.path, self.unit, self.coincident, named=True, pieces=self.pieces)
        return whole if kind is None else convert_cells(whole, kind, self.split)

    def surface(self, size: float = 0.0) -> Surface:
        """Return points (n, 3), m, and triangles (t, 3) of the mesh boundary, or of a surface file.

        Raises UnreadableMesh.
        """
        from softmark.solvers.mesh.files.mesh_reader import read_surface

        return read_surface(self.path, self.unit, self.coincident, self.pieces)

    def points(self) -> Floats:
        """Return the points (n, 3), m, that the cells of the file use, in file order. Raises UnreadableMesh."""
        from softmark.solvers.mesh.files.mesh_reader import read_points

        return read_points(self.path, self.unit)


SHAPES: dict[str, type[Shape]] = {
    "cylinder": Cylinder,
    "box": Box,
    "arc": Arc,
    "tube": Tube,
    "cone": Cone,
    "extruded": Extruded,
    "revolved": Revolved,
    "sphere": Sphere,
    "ellipsoid": Ellipsoid,
    "spherical_shell": SphericalShell,
    "quadrilateral": Quadrilateral,
    "quarter_ring": QuarterRing,
    "truncated_ellipsoid_shell": TruncatedEllipsoidShell,
    "truncated_ellipsoid_section": TruncatedEllipsoidSection,
    "mesh": MeshFile,
    "tetrahedralized": Tetrahedralized,
    "union": Union,
    "difference": Difference,
    "intersection": Intersection,
    "disjoint": DisjointShapes,
    "half_space": HalfSpace,
    "rounded_box": RoundedBox,
    "punch": Punch,
    "rounded_cone": RoundedCone,
}
