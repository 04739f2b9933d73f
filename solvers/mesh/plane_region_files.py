"""A plane region whose cells are those of a file: what a plane body makes of a mesh file."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any, Protocol

from softmark.records import dataclass
from softmark.solvers.mesh.shape import Bounds, Shape, Vector3

if TYPE_CHECKING:
    from softmark.solvers.mesh.conforming_planes import Cut
    from softmark.solvers.mesh.mesh import Mesh
    from softmark.solvers.mesh.shape import Surface
    from softmark.solvers.mesh.surface_bodies import Seen

NEAR = 1e-9  # of its size: what lies so near to its bounds is within them


class OfFile(Protocol):
    """A mesh file, as a scene says it: where it is, what its unit is, m, and what points in one place mean."""

    path: str
    unit: float
    coincident: Any


@dataclass(frozen=True)
class FlatFile(Shape):
    """A slice of a region in a file, so thick (m). Its bounds are those of the file, which is read for them."""

    region: OfFile
    depth: float

    prebuilt = True
    flat = True

    @property
    def file(self) -> str:
        """The file."""
        return self.region.path

    @cached_property
    def read(self) -> Mesh:
        """The slice of the file's own cells, with its groups. Raises UnreadableMesh."""
        from softmark.solvers.mesh.surface_bodies import seen

        path = self.region.path
        found = _sliced(path, self.region.unit, self.region.coincident, seen(path))
        points = found.points.copy()
        points[:, 2] *= self.depth / (points[:, 2].max() - points[:, 2].min())
        return replace(found, points=points)

    @cached_property
    def bounds(self) -> Bounds | None:
        """Lowest and highest coordinates, m; None where the file cannot be read, which is said elsewhere."""
        from softmark.solvers.mesh.files.mesh_validation import UnreadableMesh

        try:
            points = self.read.points
        except UnreadableMesh:
            return None
        (a, b, c), (d, e, f) = points.min(axis=0).tolist(), points.max(axis=0).tolist()
        return (a, b, c), (d, e, f)

    def contains(self, point: Vector3) -> bool:
        """Whether its bounds do, give or take 1e-9 of its size: no more is known without a search."""
        if self.bounds is None:
            return True
        slack = NEAR * self.diagonal
        return all(a - slack <= p <= b + slack for p, a, b in zip(point, *self.bounds, strict=True))

    def mesh(self, kind: str, size: float = 0.0, cuts: tuple[Cut, ...] = ()) -> Mesh:
        """The cells of the file as an element, of no other size and uncut. Raises UnreadableMesh, UnknownElement."""
        return replace(self.named(kind), groups=None)

    def named(self, kind: str | None = None) -> Mesh:
        """The same with the groups of the file; without an element as the file has its cells. Raises as `mesh`."""
        from softmark.solvers.elements import sliced
        from softmark.solvers.mesh.files.plane_cells import taken

        return self.read if kind is None else taken(self.read, sliced(kind))

    def surface(self, size: float = 0.0) -> Surface:
        """Points (n, 3) in m and triangles (t, 3) of the slice's boundary. Raises UnreadableMesh."""
        from softmark.solvers.mesh.mesh import surface

        return surface(self.read)


@lru_cache(maxsize=4)
def _sliced(path: str, unit: float, coincident: str, stamp: Seen) -> Mesh:
    """What the bodies of a file share: it is read once for all of them."""
    from softmark.solvers.mesh.files.plane_cells import read

    return read(path, unit, coincident)
