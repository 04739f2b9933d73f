"""Plane regions whose cells come from a mesh file."""

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

NEAR = 1e-9  # tolerance of the bounds, relative to the size


class FileDeclaration(Protocol):
    """A mesh file as declared in a scene: path, length of its unit in m, and treatment of coincident points."""

    path: str
    unit: float
    coincident: Any


@dataclass(frozen=True)
class FileSlice(Shape):
    """A slice, with a thickness in m, of the plane region in a mesh file; bounds are read from the file."""

    region: FileDeclaration
    depth: float

    prebuilt = True
    flat = True

    @property
    def file(self) -> str:
        """Path of the file."""
        return self.region.path

    @cached_property
    def read(self) -> Mesh:
        """Return the slice of the cells in the file, with their named groups. Raises UnreadableMesh."""
        from softmark.solvers.mesh.surface_bodies import modification_stamp

        path = self.region.path
        found = _cached_slice(path, self.region.unit, self.region.coincident, modification_stamp(path))
        points = found.points.copy()
        points[:, 2] *= self.depth / (points[:, 2].max() - points[:, 2].min())
        return replace(found, points=points)

    @cached_property
    def bounds(self) -> Bounds | None:
        """Lowest and highest coordinates, m; None for an unreadable file, which is reported elsewhere."""
        from softmark.solvers.mesh.files.mesh_validation import UnreadableMesh

        try:
            points = self.read.points
        except UnreadableMesh:
            return None
        (a, b, c), (d, e, f) = points.min(axis=0).tolist(), points.max(axis=0).tolist()
        return (a, b, c), (d, e, f)

    def contains(self, point: Vector3) -> bool:
        """Return whether the bounding box contains a point, within 1e-9 of its size; a cell search costs more."""
        if self.bounds is None:
            return True
        slack = NEAR * self.diagonal
        return all(a - slack <= p <= b + slack for p, a, b in zip(point, *self.bounds, strict=True))

    def mesh(self, kind: str, size: float = 0.0, cuts: tuple[Cut, ...] = ()) -> Mesh:
        """Return the file's cells as an element; size and cuts are ignored. Raises UnreadableMesh, UnknownElement."""
        return replace(self.mesh_with_groups(kind), groups=None)

    def mesh_with_groups(self, kind: str | None = None) -> Mesh:
        """Return the mesh with its named groups, as the element `kind`, or by default with the file's own cells.

        Raises the errors of `mesh`.
        """
        from softmark.solvers.elements import solid_element_name
        from softmark.solvers.mesh.files.plane_cells import convert_slice

        return self.read if kind is None else convert_slice(self.read, solid_element_name(kind))

    def surface(self, size: float = 0.0) -> Surface:
        """Return points (n, 3) in m and triangles (t, 3) of the slice's boundary. Raises UnreadableMesh."""
        from softmark.solvers.mesh.mesh import boundary_surface

        return boundary_surface(self.read)


@lru_cache(maxsize=4)
def _cached_slice(path: str, unit: float, coincident: str, stamp: Seen) -> Mesh:
    """Return the slice of a file, read once for all bodies of that file."""
    from softmark.solvers.mesh.files.plane_cells import read_slice

    return read_slice(path, unit, coincident)
