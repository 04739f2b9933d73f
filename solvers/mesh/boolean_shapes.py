"""Bodies made of two other bodies by union, difference or intersection."""

from __future__ import annotations

import math
from functools import lru_cache
from itertools import product
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from softmark.records import dataclass
from softmark.solvers.mesh.conforming_planes import smallest_size
from softmark.solvers.mesh.shape import Bounds, Shape, Vector3, add_multiples
from softmark.solvers.mesh.surface_bodies import SurfaceBody, Tetrahedralized, modification_stamp

if TYPE_CHECKING:
    from softmark.solvers.mesh.conforming_planes import Cut
    from softmark.solvers.mesh.files.watertight_repair import ClosedSurface
    from softmark.solvers.mesh.shape import Surface
    from softmark.solvers.mesh.tetrahedralization import FilledMesh

Operation = Literal["union", "difference", "intersection"]
FACETS = 0.5  # facet size of curved sides relative to a model's cell size, by default
COARSE = 0.1  # relative to the extent: cell size of the surface before its triangles are refined
USUAL = 0.05  # relative to the extent: cell size if no model gives one
AXES: tuple[Vector3, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
MANY = 1e6  # largest number of triangles of a surface: more take over a minute and a gigabyte
FLUSH = 1e-12  # relative to the extent: bodies closer than this share a face
INSIDE = 1e-6  # relative to the extent: tolerance of the border


@dataclass(frozen=True)
class BooleanShape(SurfaceBody):
    """A body made of two bodies, `one` and `other`, by a Boolean operation."""

    operation: ClassVar[Operation]
    gap = "not a convex body"

    one: Annotated[Any, "shape", "first shape"]
    other: Annotated[Any, "shape", "second shape, which overlaps the first"]
    facets: Annotated[float | None, "m in (0, inf)", "facet size on curved sides; default: half the cell size"] = None
    tolerance: Annotated[
        float | None,
        "m in (0, inf)",
        "largest distance of the mesh from the facets; default: 2 % of the smallest cell size",
    ] = None

    @property
    def fault(self) -> str:
        """Return an error of one of the two bodies, or the error that they do not meet; "" if valid."""
        for shape in self.pair:
            if shape.flat:
                return "a plane region cannot be combined: it has no volume"
            if shape.fault:
                return shape.fault
            if not shape.meshed:
                return "one of its parts is a shape for rigid bodies only and cannot be combined"
        return self.disjointness_error

    @property
    def disjointness_error(self) -> str:
        """Return an error if the bounding boxes do not overlap, so that the result is empty or in two pieces."""
        one, other = (shape.bounds for shape in self.pair)
        return _APART[self.operation] if _are_boxes_disjoint(one, other, self.operation == "union") else ""

    @property
    def pair(self) -> tuple[Shape, Shape]:
        """The two bodies that are combined."""
        return self.one, self.other

    @property
    def file(self) -> str:
        """Mesh file of one of the two bodies; "" if neither is read from a file."""
        files: tuple[str, str] = (self.one.file, self.other.file)
        return files[0] or files[1]

    @property
    def bounds(self) -> Bounds | None:
        """Lowest and highest coordinates of a box that contains the body, m; None if unknown."""
        one, other = (shape.bounds for shape in self.pair)
        if one is None or other is None:
            return one if self.operation == "difference" else None
        if self.operation == "difference" or _are_boxes_disjoint(one, other, self.operation == "union"):
            return one
        low, high = (min, max) if self.operation == "union" else (max, min)
        ends: list[Any] = [tuple(map(f, one[i], other[i])) for i, f in enumerate((low, high))]
        return ends[0], ends[1]

    @property
    def least(self) -> float:
        """Lower bound of the volume, m^3, from the shapes' volumes and bounding boxes, without making the surface."""
        if self.operation == "union":
            return float(max(self.one.least, self.other.least))
        if self.operation == "intersection" or self.other.bounds is None:
            return 0.0
        most = self.other.volume or math.prod(b - a for a, b in zip(*self.other.bounds, strict=True))
        return float(max(0.0, self.one.least - most))

    def contains(self, point: Vector3) -> bool:
        """Return whether the body contains a point, within 1e-9 of its size; the surface of its holes belongs to it."""
        if self.operation == "union":
            return any(shape.contains(point) for shape in self.pair)
        if self.operation == "intersection":
            return all(shape.contains(point) for shape in self.pair)
        if not self.one.contains(point):
            return False
        step = INSIDE * self.one.diagonal
        around = [add_multiples(point, (s * step, e)) for s, e in product((-1.0, 1.0), AXES)]
        return not all(self.other.contains(near) for near in around)

    def facet_size(self, size: float | None) -> float:
        """Return the size of the surface's facets, m, for cells of `size` (m); the field `facets` takes precedence."""
        return self.facets or FACETS * (size or USUAL * self.diagonal)

    def closed(self, size: float | None = None) -> ClosedSurface:
        """Return the surface of the body, with facets suited to cells of `size` (m). Raises UnreadableMesh."""
        return _combine_closed_surfaces(self, file_stamp(self), self.facet_size(size))

    def coarse_and_fine_surfaces(self, size: float) -> tuple[ClosedSurface, ClosedSurface]:
        """Return the surface with facets for cells of `size` (m), and the surface with facets of half that size.

        Raises UnreadableMesh.
        """
        here, now = self.facet_size(size), file_stamp(self)
        return _combine_closed_surfaces(self, now, here), _combine_closed_surfaces(self, now, here, 1)

    def missed(self, size: float) -> float:
        """Return the volume between the flat facets and the curved surface, m^3, for cells of `size` (m).

        It is estimated from facets of half the size, which miss a fourth of this volume.
        """
        coarse, fine = self.coarse_and_fine_surfaces(size)
        return 4.0 / 3.0 * (fine.volume - coarse.volume)

    def filling(self, size: float, graded: tuple[Cut, ...] = ()) -> FilledMesh:
        """Return four-node tetrahedra with edges of about `size` (m), smaller at graded cuts. Raises UnreadableMesh."""
        least = smallest_size(size, graded)
        return _tetrahedralize(
            self, file_stamp(self), self.facet_size(least), size, self.surface_tolerance(least), graded
        )

    def surface(self, size: float) -> Surface:
        """Return points (n, 3), m, and triangles (t, 3) of the surface, facing outward. Raises UnreadableMesh."""
        surface = self.closed(size)
        return surface.points, surface.triangles


_APART = {
    "union": "its parts do not overlap: a body must be one piece, so declare a body for each",
    "difference": "the subtracted shape does not overlap the body, so nothing would be removed",
    "intersection": "nothing is left: its parts do not overlap",
}


@dataclass(frozen=True)
class Union(BooleanShape):
    """The union of two bodies of any shapes, including those read from files; the two bodies must overlap or touch.

    Curved sides are approximated by flat facets, half the size of a model's cells (of the smallest cells in a graded
    mesh). The two surfaces are united exactly (by manifold3d, the extra `solids`: `pip install "softmark[solids]"`).
    The volume inside is filled with tetrahedra by the extra `meshing`, as for `tetrahedralized`. The report gives the
    volume that the facets miss and how the mesh deviates from its surface. Conditions such as selections are evaluated
    on the facets, which lie inside a ball and inside a hole: selections along curved sides need some margin. The area
    that a load selects is compared with the surfaces of the shapes themselves, or with finer facets if one of them
    comes from a file. For three bodies write a union of a union.
    """

    operation = "union"


@dataclass(frozen=True)
class Difference(BooleanShape):
    """A body from which another body is subtracted, as a hole, a notch or a bore; the result must be in one piece.

    Facets, extras and report are those of `union`. The surface of the hole belongs to the body.
    """

    operation = "difference"

    one: Annotated[Any, "shape", "the body"]
    other: Annotated[Any, "shape", "the body that is subtracted"]


@dataclass(frozen=True)
class Intersection(BooleanShape):
    """The common part of two bodies, which must be in one piece.

    Facets, extras and report are those of `union`.
    """

    operation = "intersection"


def _are_boxes_disjoint(one: Bounds | None, other: Bounds | None, touching: bool = False) -> bool:
    """Return whether two bounding boxes are known not to overlap; with `touching`, also not to share a face."""
    if one is None or other is None:
        return False
    slack = FLUSH * max(math.dist(*one), math.dist(*other))
    common = [min(b, d) - max(a, c) for a, b, c, d in zip(*one, *other, strict=True)]
    return min(common) < -slack or sum(gap <= slack for gap in common) > touching


def file_stamp(shape: Shape) -> Any:
    """Return a value that changes whenever the mesh file of the shape, or one of a combined shape, changes."""
    if isinstance(shape, BooleanShape):
        return tuple(file_stamp(own) for own in shape.pair)
    return modification_stamp(shape.file) if shape.file else None


def _estimate_triangle_count(shape: Shape, facets: float) -> float:
    """Return the approximate number of triangles of size `facets` (m) on the surface of a shape."""
    if isinstance(shape, BooleanShape):
        return sum(_estimate_triangle_count(own, shape.facets or facets) for own in shape.pair)
    if not shape.sides or shape.bounds is None:
        return 0.0
    a, b, c = (high - low for low, high in zip(*shape.bounds, strict=True))
    return 2.0 * (shape.skin or 2.0 * (a * b + b * c + c * a)) / facets**2


@lru_cache(maxsize=16)
def _combine_closed_surfaces(shape: BooleanShape, files: Any, facets: float, halved: int = 0) -> ClosedSurface:
    """Return the closed surface of a combined shape with facets of the size `facets` (m). Raises UnreadableMesh.

    Facets are halved `halved` more times. `files` is the result of `file_stamp`, a key of the cache.
    """
    from softmark.solvers.mesh.boolean_operations import combine_surfaces, too_many_triangles_error

    if (count := _estimate_triangle_count(shape, facets)) > MANY:
        raise too_many_triangles_error(count, facets)
    return combine_surfaces(shape.operation, *(_faceted_surface(own, facets, halved) for own in shape.pair))


def _faceted_surface(shape: Shape, facets: float, halved: int) -> Surface:
    """Return points (n, 3), m, and triangles (t, 3) of a shape's surface. Raises UnreadableMesh.

    Facets of the size `facets` (m) are halved `halved` more times.
    """
    from softmark.solvers.mesh.boolean_operations import refine_surface

    if isinstance(shape, BooleanShape):
        surface = _combine_closed_surfaces(shape, file_stamp(shape), shape.facets or facets, halved)
        return surface.points, surface.triangles
    if not shape.sides:
        return shape.surface(facets if shape.prebuilt or isinstance(shape, Tetrahedralized) else shape.diagonal)
    times = max(0, int(math.log2(max(1.0, COARSE * shape.diagonal / facets))))
    skin = shape.surface(facets * 2**times)
    for _ in range(times + halved):
        skin = refine_surface(*skin, shape.sides)
    return skin


@lru_cache(maxsize=8)
def _tetrahedralize(
    shape: BooleanShape, files: Any, facets: float, size: float, tolerance: float, graded: tuple[Cut, ...]
) -> FilledMesh:
    """Return the cached tetrahedral mesh of a combined shape. Raises UnreadableMesh.

    `facets`, `size` and `tolerance` are in m. `files` is the result of `file_stamp`, a key of the cache.
    """
    from softmark.solvers.mesh.tetrahedralization import fill_surface

    return fill_surface(_combine_closed_surfaces(shape, files, facets), size, tolerance, graded)
