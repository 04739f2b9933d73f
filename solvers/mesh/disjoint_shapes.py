"""A body of two shapes that share no node: each has its own mesh, and only contact or glue connects the two."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from softmark.records import dataclass
from softmark.solvers.mesh.shape import Bounds, CurvedSide, Shape, Vector3

if TYPE_CHECKING:
    import numpy as np

    from softmark.solvers.mesh.conforming_planes import Cut
    from softmark.solvers.mesh.mesh import Mesh
    from softmark.solvers.mesh.plane_regions import Place
    from softmark.solvers.mesh.shape import Surface
else:
    from softmark.solvers.runtime.lazy_modules import np


@dataclass(frozen=True)
class DisjointShapes(Shape):
    """One body of two separate shapes: the shapes share no node, whether they touch or not.

    Each shape has its own mesh, and the meshes need not match. `contact c = self_contact(BODY)` keeps the shapes from
    penetrating each other, and `contact c = tied(BODY)` glues them where they touch; without either, nothing connects
    them. `region upper = part(BODY, where = ..., material = ...)` gives one of them its own material. For three shapes
    write a `disjoint` of a `disjoint`. Both shapes are solids, or both are plane regions.
    """

    gap = "separate pieces"

    one: Annotated[Any, "shape", "first shape"]
    other: Annotated[Any, "shape", "second shape"]
    coarser: Annotated[float, "1 in (0, inf)", "ratio of the cell size in the other shape to `size`"] = 1.0

    @property
    def pair(self) -> tuple[Any, Any]:
        """The two shapes."""
        return self.one, self.other

    @property
    def flat(self) -> bool:  # type: ignore[override]
        """True if both shapes are plane regions; a mesh file counts as plane if the other shape is."""
        return any(bool(shape.flat) for shape in self.pair)

    @property
    def fault(self) -> str:
        """Return an error of one of the shapes, or the error that only one of them is plane; "" if valid."""
        found = next((shape.fault for shape in self.pair if shape.fault), "")
        if found or len({shape.flat for shape in self.pair if not shape.prebuilt}) < 2:
            return str(found)
        return "one of its shapes is a plane region, but the other is a solid"

    @property
    def file(self) -> str:
        """Mesh file of one of the shapes; "" if neither is read from a file."""
        files: tuple[str, str] = (self.one.file, self.other.file)
        return files[0] or files[1]

    @property
    def bounds(self) -> Bounds | None:
        """Lowest and highest coordinates of both shapes, m."""
        a, b = self.one.bounds, self.other.bounds
        if a is None or b is None:
            return None
        ends: list[Any] = [tuple(map(f, a[i], b[i])) for i, f in enumerate((min, max))]
        return ends[0], ends[1]

    @property
    def ends(self) -> tuple[Place, Place]:
        """Lowest and highest x and y of both plane regions, m."""
        (a, b), (c, d) = (_plane_bounds(shape) for shape in self.pair)
        return (min(a[0], c[0]), min(a[1], c[1])), (max(b[0], d[0]), max(b[1], d[1]))

    @property
    def volume(self) -> float | None:
        """Sum of the volumes of both shapes, m^3; None if one is unknown."""
        one, other = (shape.volume for shape in self.pair)
        return None if one is None or other is None else one + other

    @property
    def no_hexahedra_reason(self) -> str:
        """Return why one of the shapes has no hexahedral mesh; "" if both have one."""
        return str(self.one.no_hexahedra_reason or self.other.no_hexahedra_reason)

    @property
    def sides(self) -> tuple[CurvedSide, ...]:
        """Curved sides of both shapes."""
        found: tuple[CurvedSide, ...] = (*self.one.sides, *self.other.sides)
        return found

    @property
    def _cell_size_ratios(self) -> tuple[float, float]:
        return 1.0, self.coarser

    def contains(self, point: Vector3) -> bool:
        """Return whether one of the shapes contains a point."""
        return any(shape.contains(point) for shape in self.pair)

    def slice(self, depth: float) -> DisjointShapes:
        """Return the slices of both plane regions with the thickness `depth` (m)."""
        return DisjointShapes(_slice_region(self.one, depth), _slice_region(self.other, depth), self.coarser)

    def counts(self, size: float, cuts: tuple[Cut, ...] = ()) -> tuple[int, ...] | None:
        """Return the numbers of cells of both shapes along their directions for cells of `size` (m).

        Return None if the size does not determine them.
        """
        both = [shape.counts(by * size) for shape, by in zip(self.pair, self._cell_size_ratios, strict=True)]
        return None if None in both else (*both[0], *both[1])

    def mesh(self, kind: str, size: float, cuts: tuple[Cut, ...] = ()) -> Mesh:
        """Return both meshes as one mesh of two unconnected pieces. Raises UnknownElement.

        Raises UnreadableMesh if the shapes overlap.
        """
        from softmark.solvers.mesh.files.mesh_validation import UnreadableMesh, find_overlap, format_position
        from softmark.solvers.mesh.mesh import Mesh

        a, b = (shape.mesh(kind, by * size) for shape, by in zip(self.pair, self._cell_size_ratios, strict=True))
        points, cells = np.concatenate([a.points, b.points]), np.concatenate([a.cells, b.cells + len(a.points)])
        skin = None
        if a.skin is not None or b.skin is not None:
            skin = np.concatenate([a.facets, b.facets + len(a.points)])
        made = Mesh(points, cells, a.kind, skin)
        if (found := find_overlap(made)) is not None:
            raise UnreadableMesh(
                f"the shapes of `disjoint(...)` overlap: {format_position(found[0])} lies in both",
                "E569", "move one of the shapes: the material there would be counted twice",
            )  # fmt: skip
        return made

    def surface(self, size: float) -> Surface:
        """Return points (n, 3), m, and triangles (t, 3) of both surfaces, facing outward, for cells of `size` (m)."""
        (a, s), (b, t) = (shape.surface(by * size) for shape, by in zip(self.pair, self._cell_size_ratios, strict=True))
        return np.concatenate([a, b]), np.concatenate([s, t + len(a)])


def _slice_region(region: Any, depth: float) -> Any:
    """Return the slice of a plane region, or of the plane region in a mesh file, with the thickness `depth` (m)."""
    if not region.prebuilt:
        return region.slice(depth)
    from softmark.solvers.mesh.plane_region_files import FileSlice

    return FileSlice(region, depth)


def _plane_bounds(region: Any) -> tuple[Place, Place]:
    """Return the lowest and highest x and y of a plane region, m.

    They are zero for an unreadable mesh file, whose error is reported elsewhere.
    """
    if not region.prebuilt:
        ends: tuple[Place, Place] = region.ends
        return ends
    (a, b, _), (c, d, _) = _slice_region(region, 1.0).bounds or ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    return (a, b), (c, d)
