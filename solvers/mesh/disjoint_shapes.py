"""A body of two shapes that share no node: each has its own mesh, and only contact or a tie connects them."""

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
    """One body of two separate shapes: they share no node, whether they touch or not.

    Each has its own mesh, and the meshes need not match. `contact c = self_contact(BODY)` keeps them from penetrating
    each other, `contact c = tied(BODY)` glues them where they touch; without either, nothing connects them. `region
    upper = part(BODY, where = ..., material = ...)` gives one its own material. For three shapes, write two apart from
    a third. Both are solids, or both plane regions.
    """

    gap = "separate pieces"

    one: Annotated[Any, "shape", "a shape"]
    other: Annotated[Any, "shape", "another"]
    coarser: Annotated[float, "1 in (0, inf)", "ratio of the cell size in the other shape to `size`"] = 1.0

    @property
    def pair(self) -> tuple[Any, Any]:
        """The two shapes."""
        return self.one, self.other

    @property
    def flat(self) -> bool:  # type: ignore[override]
        """True if they are plane regions; a file counts as whatever the other is."""
        return any(bool(shape.flat) for shape in self.pair)

    @property
    def fault(self) -> str:
        """Return the error of one of them, or that one is plane and the other is not."""
        found = next((shape.fault for shape in self.pair if shape.fault), "")
        if found or len({shape.flat for shape in self.pair if not shape.prebuilt}) < 2:
            return str(found)
        return "one of its shapes is a plane region, but the other is a solid"

    @property
    def file(self) -> str:
        """File that one of them is read from; "" if none."""
        files: tuple[str, str] = (self.one.file, self.other.file)
        return files[0] or files[1]

    @property
    def bounds(self) -> Bounds | None:
        """Lowest and highest coordinates, m."""
        a, b = self.one.bounds, self.other.bounds
        if a is None or b is None:
            return None
        ends: list[Any] = [tuple(map(f, a[i], b[i])) for i, f in enumerate((min, max))]
        return ends[0], ends[1]

    @property
    def ends(self) -> tuple[Place, Place]:
        """Lowest and highest x and y of plane regions, m."""
        (a, b), (c, d) = (_plane_bounds(shape) for shape in self.pair)
        return (min(a[0], c[0]), min(a[1], c[1])), (max(b[0], d[0]), max(b[1], d[1]))

    @property
    def volume(self) -> float | None:
        """Volume of both, m^3; None if unknown."""
        one, other = (shape.volume for shape in self.pair)
        return None if one is None or other is None else one + other

    @property
    def lacks(self) -> str:
        """Return why one of them has no mesh of hexahedra."""
        return str(self.one.lacks or self.other.lacks)

    @property
    def sides(self) -> tuple[CurvedSide, ...]:
        """Curved sides of both."""
        found: tuple[CurvedSide, ...] = (*self.one.sides, *self.other.sides)
        return found

    @property
    def _sizes(self) -> tuple[float, float]:
        return 1.0, self.coarser

    def contains(self, point: Vector3) -> bool:
        """Return whether one of them contains a point."""
        return any(shape.contains(point) for shape in self.pair)

    def slice(self, depth: float) -> DisjointShapes:
        """Return the slices of both plane regions with a thickness (m)."""
        return DisjointShapes(_slice_region(self.one, depth), _slice_region(self.other, depth), self.coarser)

    def counts(self, size: float, cuts: tuple[Cut, ...] = ()) -> tuple[int, ...] | None:
        """Return the number of cells of both along their directions; None if the size does not determine them."""
        both = [shape.counts(by * size) for shape, by in zip(self.pair, self._sizes, strict=True)]
        return None if None in both else (*both[0], *both[1])

    def mesh(self, kind: str, size: float, cuts: tuple[Cut, ...] = ()) -> Mesh:
        """Return both meshes as one, unconnected. Raises UnknownElement, UnreadableMesh if they overlap."""
        from softmark.solvers.mesh.files.mesh_validation import UnreadableMesh, find_overlap, format_position
        from softmark.solvers.mesh.mesh import Mesh

        a, b = (shape.mesh(kind, by * size) for shape, by in zip(self.pair, self._sizes, strict=True))
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
        """Return points (n, 3) in m and triangles (t, 3) of both surfaces, outward."""
        (a, s), (b, t) = (shape.surface(by * size) for shape, by in zip(self.pair, self._sizes, strict=True))
        return np.concatenate([a, b]), np.concatenate([s, t + len(a)])


def _slice_region(region: Any, depth: float) -> Any:
    """Return a slice of a region, or of the region in a file, with a thickness, m."""
    if not region.prebuilt:
        return region.slice(depth)
    from softmark.solvers.mesh.plane_region_files import FileSlice

    return FileSlice(region, depth)


def _plane_bounds(region: Any) -> tuple[Place, Place]:
    """Return the lowest and highest x and y of a region, m; nothing for an unreadable file, reported elsewhere."""
    if not region.prebuilt:
        ends: tuple[Place, Place] = region.ends
        return ends
    (a, b, _), (c, d, _) = _slice_region(region, 1.0).bounds or ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    return (a, b), (c, d)
