"""Bodies made of two others: what both fill, what one leaves of the other, what they have in common."""

from __future__ import annotations

import math
from functools import lru_cache
from itertools import product
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from softmark.records import dataclass
from softmark.solvers.mesh.conforming_planes import smallest
from softmark.solvers.mesh.shape import Bounds, Shape, Vector3, moved
from softmark.solvers.mesh.surface_bodies import Enclosed, Filled, seen

if TYPE_CHECKING:
    from softmark.solvers.mesh.conforming_planes import Cut
    from softmark.solvers.mesh.files.watertight_repair import Closed
    from softmark.solvers.mesh.shape import Surface
    from softmark.solvers.mesh.tetrahedralization import FilledMesh

Operation = Literal["union", "difference", "intersection"]
FACETS = 0.5  # of a model's size: of facets that curved sides are made of, where a scene says nothing
COARSE = 0.1  # of the extent: a surface is made with cells so large, and its triangles are halved
USUAL = 0.05  # of the extent: of the cells of a model, where none is known
AXES: tuple[Vector3, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
MANY = 1e6  # triangles of a surface: more is not combined in a minute, nor in a gigabyte
FLUSH = 1e-12  # of their extent: bodies that are no farther apart have a face in common
INSIDE = 1e-6  # of the extent: what is within by less is on the border


@dataclass(frozen=True)
class Combined(Enclosed):
    """Two bodies `one` and `other`, and what is done with them."""

    operation: ClassVar[Operation]
    gap = "no convex body"

    one: Annotated[Any, "shape", "a body"]
    other: Annotated[Any, "shape", "another that meets it"]
    facets: Annotated[float | None, "m in (0, inf)", "size of the facets of curved sides"] = None
    tolerance: Annotated[
        float | None, "m in (0, inf)", "how far the mesh may be from the facets; by default 2 % of the smallest cells"
    ] = None

    @property
    def fault(self) -> str:
        """What is wrong with one of them, or that they do not meet."""
        for shape in self.pair:
            if shape.flat:
                return "a plane region is combined with nothing: it has no volume"
            if shape.fault:
                return shape.fault
            if not shape.meshed:
                return "one of its parts is a shape of rigid bodies alone, of which there is no surface to combine"
        return self.apart

    @property
    def apart(self) -> str:
        """That the bounds of both have nothing in common, where that leaves no body, or two."""
        one, other = (shape.bounds for shape in self.pair)
        return _APART[self.operation] if _beside(one, other, self.operation == "union") else ""

    @property
    def pair(self) -> tuple[Shape, Shape]:
        """Both."""
        return self.one, self.other

    @property
    def file(self) -> str:
        """A file that one of them is read from, "" of none."""
        files: tuple[str, str] = (self.one.file, self.other.file)
        return files[0] or files[1]

    @property
    def bounds(self) -> Bounds | None:
        """Coordinates that it does not go beyond, m."""
        one, other = (shape.bounds for shape in self.pair)
        if one is None or other is None:
            return one if self.operation == "difference" else None
        if self.operation == "difference" or _beside(one, other, self.operation == "union"):
            return one
        low, high = (min, max) if self.operation == "union" else (max, min)
        ends: list[Any] = [tuple(map(f, one[i], other[i])) for i, f in enumerate((low, high))]
        return ends[0], ends[1]

    @property
    def least(self) -> float:
        """A volume, m^3, that it has at least, as far as can be told without its surface."""
        if self.operation == "union":
            return float(max(self.one.least, self.other.least))
        if self.operation == "intersection" or self.other.bounds is None:
            return 0.0
        most = self.other.volume or math.prod(b - a for a, b in zip(*self.other.bounds, strict=True))
        return float(max(0.0, self.one.least - most))

    def contains(self, point: Vector3) -> bool:
        """Whether it holds a point, give or take 1e-9 of its size; what is on the border of a hole is of the body."""
        if self.operation == "union":
            return any(shape.contains(point) for shape in self.pair)
        if self.operation == "intersection":
            return all(shape.contains(point) for shape in self.pair)
        if not self.one.contains(point):
            return False
        step = INSIDE * self.one.diagonal
        around = [moved(point, (s * step, e)) for s, e in product((-1.0, 1.0), AXES)]
        return not all(self.other.contains(near) for near in around)

    def fineness(self, size: float | None) -> float:
        """Of the facets for cells of a size, m."""
        return self.facets or FACETS * (size or USUAL * self.diagonal)

    def closed(self, size: float | None = None) -> Closed:
        """Its surface, of facets for cells of a size (m). Raises UnreadableMesh."""
        return _closed(self, stamp(self), self.fineness(size))

    def halved(self, size: float) -> tuple[Closed, Closed]:
        """Its surface for cells of a size (m), and with facets of half the size. Raises UnreadableMesh."""
        here, now = self.fineness(size), stamp(self)
        return _closed(self, now, here), _closed(self, now, here, 1)

    def missed(self, size: float) -> float:
        """Of its volume, what the facets miss, m^3: by such facets halved, which miss a fourth."""
        coarse, fine = self.halved(size)
        return 4.0 / 3.0 * (fine.volume - coarse.volume)

    def filling(self, size: float, graded: tuple[Cut, ...] = ()) -> FilledMesh:
        """Four-node tetrahedra with edges of about `size` (m), less where cuts say so. Raises UnreadableMesh."""
        least = smallest(size, graded)
        return _filled(self, stamp(self), self.fineness(least), size, self.near(least), graded)

    def surface(self, size: float) -> Surface:
        """Points (n, 3) in m and triangles (t, 3) of its surface, outward. Raises UnreadableMesh."""
        surface = self.closed(size)
        return surface.points, surface.triangles


_APART = {
    "union": "its parts do not meet: a body is one piece, declare a body for each",
    "difference": "what is taken away does not meet the rest: nothing would be taken",
    "intersection": "its parts do not meet: nothing is left of them",
}


@dataclass(frozen=True)
class Union(Combined):
    """What two bodies fill together, of any shapes, those read from files too; they must meet.

    Curved sides are made of flat facets, whose size is half that of a model's cells (of the smallest, where they are
    `finer` somewhere), and the surfaces of both are united exactly (manifold3d, the extra `solids`: `pip install
    "softmark[solids]"`). What that encloses is filled with
    tetrahedra by the extra `meshing`, as `filled` says. The report has the volume that the facets miss, and how the
    mesh stands to its surface. Conditions are asked of the facets, which lie inside a ball and inside a hole: borders
    along curved sides need room. What a load takes of them is held against the surfaces of the shapes themselves, or of
    finer facets where one of them is a file's. Three bodies are a union of a union.
    """

    operation = "union"


@dataclass(frozen=True)
class Difference(Combined):
    """What is left of a body when another is taken away from it, as a hole, a notch or a bore; in one piece.

    Facets, extras and what the report says are those of `union`. What lies on the border of the hole is of the body.
    """

    operation = "difference"

    one: Annotated[Any, "shape", "the body"]
    other: Annotated[Any, "shape", "what is taken away from it"]


@dataclass(frozen=True)
class Intersection(Combined):
    """What two bodies have in common, in one piece.

    Facets, extras and what the report says are those of `union`.
    """

    operation = "intersection"


def _beside(one: Bounds | None, other: Bounds | None, touching: bool = False) -> bool:
    """Whether two bounds are known to have nothing in common; or no face, where bodies may meet in one."""
    if one is None or other is None:
        return False
    slack = FLUSH * max(math.dist(*one), math.dist(*other))
    common = [min(b, d) - max(a, c) for a, b, c, d in zip(*one, *other, strict=True)]
    return min(common) < -slack or sum(gap <= slack for gap in common) > touching


def stamp(shape: Shape) -> Any:
    """What changes when a file of one of them does."""
    if isinstance(shape, Combined):
        return tuple(stamp(own) for own in shape.pair)
    return seen(shape.file) if shape.file else None


def _triangles(shape: Shape, facets: float) -> float:
    """About how many triangles of a size (m) a surface with curved sides is made of."""
    if isinstance(shape, Combined):
        return sum(_triangles(own, shape.facets or facets) for own in shape.pair)
    if not shape.sides or shape.bounds is None:
        return 0.0
    a, b, c = (high - low for low, high in zip(*shape.bounds, strict=True))
    return 2.0 * (shape.skin or 2.0 * (a * b + b * c + c * a)) / facets**2


@lru_cache(maxsize=16)
def _closed(shape: Combined, files: Any, facets: float, halved: int = 0) -> Closed:
    from softmark.solvers.mesh.boolean_operations import combined, too_many

    if (count := _triangles(shape, facets)) > MANY:
        raise too_many(count, facets)
    return combined(shape.operation, *(_skin(own, facets, halved) for own in shape.pair))


def _skin(shape: Shape, facets: float, halved: int) -> Surface:
    """Points (n, 3), m, and triangles (t, 3) of a surface, halved some times more. Raises UnreadableMesh."""
    from softmark.solvers.mesh.boolean_operations import halves

    if isinstance(shape, Combined):
        surface = _closed(shape, stamp(shape), shape.facets or facets, halved)
        return surface.points, surface.triangles
    if not shape.sides:
        return shape.surface(facets if shape.prebuilt or isinstance(shape, Filled) else shape.diagonal)
    times = max(0, int(math.log2(max(1.0, COARSE * shape.diagonal / facets))))
    skin = shape.surface(facets * 2**times)
    for _ in range(times + halved):
        skin = halves(*skin, shape.sides)
    return skin


@lru_cache(maxsize=8)
def _filled(
    shape: Combined, files: Any, facets: float, size: float, tolerance: float, graded: tuple[Cut, ...]
) -> FilledMesh:
    from softmark.solvers.mesh.tetrahedralization import filled

    return filled(_closed(shape, files, facets), size, tolerance, graded)
