"""Bodies given only by a closed surface, such as a segmented organ, filled with tetrahedra of a model's size."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from softmark.records import dataclass
from softmark.solvers.mesh.conforming_planes import smallest_size
from softmark.solvers.mesh.shape import Bounds, Shape

if TYPE_CHECKING:
    from softmark.solvers.mesh.conforming_planes import Cut
    from softmark.solvers.mesh.files.watertight_repair import ClosedSurface
    from softmark.solvers.mesh.shape import Surface
    from softmark.solvers.mesh.tetrahedralization import FilledMesh

NEAR = 0.02  # default tolerance of the surface relative to a model's smallest cells


class SurfaceBody(Shape):
    """The volume inside a closed surface, filled with tetrahedra that deviate from it by at most `tolerance` (m)."""

    enclosed = True
    has_signed_distance = True
    has_mass_properties = True

    if TYPE_CHECKING:

        @property
        def tolerance(self) -> float | None:
            """Largest allowed distance of the mesh from the surface, m."""

    def closed(self, size: float | None = None) -> ClosedSurface:
        """Return the repaired, closed surface with facets suited to cells of `size` (m). Raises UnreadableMesh."""
        raise NotImplementedError(f"{type(self).__name__} has no surface")

    def missed(self, size: float) -> float:
        """Return the volume between the body and its flat facets, m^3; negative if the facets enclose too much."""
        return 0.0

    def surface_tolerance(self, size: float) -> float:
        """Return the largest allowed distance, m, between the surface and a mesh with cells of `size` (m)."""
        return self.tolerance or NEAR * size

    def filling(self, size: float, graded: tuple[Cut, ...] = ()) -> FilledMesh:
        """Return a mesh of four-node tetrahedra that fills the surface. Raises UnreadableMesh.

        Edges have about the `size` (m), and less at graded cuts.
        """
        raise NotImplementedError(f"{type(self).__name__} is not filled")

    def mesh(self, kind: str, size: float, cuts: tuple[Cut, ...] = ()) -> FilledMesh:
        """Return tetrahedra with straight edges of about `size` (m), smaller at graded cuts; other cuts are ignored.

        Raises UnreadableMesh and UnknownElement.
        """
        from softmark.solvers.mesh.files.mesh_reader import convert_cells
        from softmark.solvers.mesh.tetrahedralization import FilledMesh

        made = self.filling(size, tuple(cut for cut in cuts if cut.where is not None))
        mesh = convert_cells(made, kind, "five")
        return FilledMesh(mesh.points, mesh.cells, mesh.kind, filling=made.filling)


@dataclass(frozen=True)
class Tetrahedralized(SurfaceBody):
    """The volume inside a closed surface of triangles in a file, filled with tetrahedra.

    File formats are STL, OBJ, PLY, OFF, VTK and others. A model's `size` is the cell size; smaller cells are made where
    the surface needs them. The mesher, fTetWild (Hu et al. 2020), belongs to the extra `meshing`: `pip install
    "softmark[meshing]"`.

    Certain flaws of the surface are repaired and reported with their numbers: nearly coincident points, reversed,
    duplicate or flat triangles, small holes, tiny shells, parts that intersect others. A surface that encloses no
    volume, or more than one body, is refused. A shell within another one is a hollow if it faces inward.

    Nodes on the boundary of the mesh are moved onto the file's surface. Edges between them are straight, for elements
    of any order; the report gives their distance from the surface and the difference of the volumes.

    The mesher uses random numbers that cannot be seeded, so its meshes are cached: the same file gives the same mesh
    again. Without the cache, two meshes of the same file differ as much as two other meshes of the same size; the
    report has a digest of each mesh.
    """

    path: Annotated[str, "file", "the file of the surface, relative to the scene"]
    unit: Annotated[float, "m in (0, inf)", "length of one unit of the file's coordinates"]
    tolerance: Annotated[
        float | None,
        "m in (0, inf)",
        "largest distance of the mesh from the surface; default: 2 % of the smallest cell size",
    ] = None

    @property
    def file(self) -> str:
        """Path of the surface's file."""
        return self.path

    @property
    def bounds(self) -> Bounds | None:
        """Lowest and highest coordinates, m; None for a missing file or one without a surface."""
        surface = self._surface_if_readable
        if surface is None:
            return None
        low, high = surface.points.min(axis=0).tolist(), surface.points.max(axis=0).tolist()
        return (low[0], low[1], low[2]), (high[0], high[1], high[2])

    @property
    def volume(self) -> float | None:
        """Volume that the surface encloses, m^3; None if the surface intersects itself or is not known."""
        surface = self._surface_if_readable
        return None if surface is None or surface.crossings else surface.volume

    @property
    def _surface_if_readable(self) -> ClosedSurface | None:
        if not Path(self.path).is_file():
            return None
        from softmark.solvers.mesh.files.mesh_validation import UnreadableMesh

        try:
            return self.closed()
        except UnreadableMesh:
            return None

    def closed(self, size: float | None = None) -> ClosedSurface:
        """Return the repaired surface, which is the same for cells of any size. Raises UnreadableMesh."""
        return _read_closed_surface(self.path, self.unit, modification_stamp(self.path))

    def filling(self, size: float, graded: tuple[Cut, ...] = ()) -> FilledMesh:
        """Return four-node tetrahedra with edges of about `size` (m), smaller at graded cuts. Raises UnreadableMesh."""
        return _tetrahedralize(
            self.path,
            self.unit,
            modification_stamp(self.path),
            size,
            self.surface_tolerance(smallest_size(size, graded)),
            graded,
        )

    def surface(self, size: float = 0.0) -> Surface:
        """Return points (n, 3), m, and triangles (t, 3) of the file's repaired surface, facing outward.

        Raises UnreadableMesh.
        """
        surface = self.closed()
        return surface.points, surface.triangles


Seen = tuple[int, int] | None  # modification time and size of a file: a changed file is read again


def modification_stamp(path: str) -> Seen:
    """Return the modification time (ns) and the size (bytes) of a file; None if it does not exist."""
    file = Path(path)
    if not file.is_file():
        return None
    found = file.stat()
    return found.st_mtime_ns, found.st_size


@lru_cache(maxsize=4)
def _read_closed_surface(path: str, unit: float, stamp: Seen) -> ClosedSurface:
    """Return the repaired surface of a file, cached by its modification `stamp`. Raises UnreadableMesh."""
    from softmark.solvers.mesh.files.mesh_reader import read_triangles
    from softmark.solvers.mesh.files.watertight_repair import close_surface

    return close_surface(*read_triangles(path, unit))


@lru_cache(maxsize=8)
def _tetrahedralize(
    path: str, unit: float, stamp: Seen, size: float, tolerance: float, graded: tuple[Cut, ...]
) -> FilledMesh:
    """Return the cached tetrahedral mesh of a surface file; `size` and `tolerance` are in m. Raises UnreadableMesh."""
    from softmark.solvers.mesh.tetrahedralization import fill_surface

    return fill_surface(_read_closed_surface(path, unit, stamp), size, tolerance, graded)
