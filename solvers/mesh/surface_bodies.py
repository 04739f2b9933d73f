"""Bodies of which there is a surface alone, such as a segmented organ: filled with tetrahedra of a model's size."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from softmark.records import dataclass
from softmark.solvers.mesh.conforming_planes import smallest
from softmark.solvers.mesh.shape import Bounds, Shape

if TYPE_CHECKING:
    from softmark.solvers.mesh.conforming_planes import Cut
    from softmark.solvers.mesh.files.watertight_repair import Closed
    from softmark.solvers.mesh.shape import Surface
    from softmark.solvers.mesh.tetrahedralization import FilledMesh

NEAR = 0.02  # of a model's smallest cells: how far a mesh is from its surface where a scene says nothing


class Enclosed(Shape):
    """What a closed surface encloses, filled with tetrahedra: its `tolerance` (m) is how far these may be from it."""

    enclosed = True

    if TYPE_CHECKING:

        @property
        def tolerance(self) -> float | None:
            """How far the mesh may be from the surface, m."""

    def closed(self, size: float | None = None) -> Closed:
        """The surface for cells of a size (m), repaired. Raises UnreadableMesh."""
        raise NotImplementedError(f"{type(self).__name__} has no surface")

    def missed(self, size: float) -> float:
        """Of its volume, what the facets of that surface miss, m^3: negative where they have too much."""
        return 0.0

    def near(self, size: float) -> float:
        """How far a mesh of cells of a size may be from the surface, m."""
        return self.tolerance or NEAR * size

    def filling(self, size: float, graded: tuple[Cut, ...] = ()) -> FilledMesh:
        """Four-node tetrahedra with edges of about `size` (m), less where cuts say so. Raises UnreadableMesh."""
        raise NotImplementedError(f"{type(self).__name__} is not filled")

    def mesh(self, kind: str, size: float, cuts: tuple[Cut, ...] = ()) -> FilledMesh:
        """Tetrahedra with edges of about `size` (m), straight and uncut, less where cells are to be finer.

        Raises UnreadableMesh, UnknownElement.
        """
        from softmark.solvers.mesh.files.mesh_reader import converted
        from softmark.solvers.mesh.tetrahedralization import FilledMesh

        made = self.filling(size, tuple(cut for cut in cuts if cut.where is not None))
        mesh = converted(made, kind, "five")
        return FilledMesh(mesh.points, mesh.cells, mesh.kind, filling=made.filling)


@dataclass(frozen=True)
class Filled(Enclosed):
    """What a closed surface of triangles in a file (STL, OBJ, PLY, OFF, VTK, ...) encloses, filled with tetrahedra.

    A model's `size` is that of its cells; smaller ones are made where the surface needs them. The mesher, fTetWild (Hu
    et al. 2020), is that of the extra `meshing`: `pip install "softmark[meshing]"`.
    What is wrong with the surface is repaired where that is certain, and said with its numbers: points that are nearly
    one, triangles that are turned, doubled or flat, small holes, specks, parts that pass through others. What
    encloses no volume, or more than one body, is refused. A shell within another one is a hollow if it looks inward.
    Nodes of the mesh's surface are moved onto the file's. Edges between them are straight, for elements of any order;
    the report says how far they are from the surface, and how the volumes differ.
    The mesher draws random numbers that cannot be set, so the cache keeps what it made: the same file gives the same
    mesh again. Without that cache it differs as another mesh of the same size does; the report has a digest of each.
    """

    path: Annotated[str, "file", "the file of the surface, relative to the scene"]
    unit: Annotated[float, "m in (0, inf)", "length of one unit of the file's coordinates"]
    tolerance: Annotated[
        float | None, "m in (0, inf)", "how far the mesh may be from the surface; by default 2 % of the smallest cells"
    ] = None

    @property
    def file(self) -> str:
        """The file of the surface."""
        return self.path

    @property
    def bounds(self) -> Bounds | None:
        """Lowest and highest coordinates, m; None of a file that is not here or is no surface."""
        surface = self._known
        if surface is None:
            return None
        low, high = surface.points.min(axis=0).tolist(), surface.points.max(axis=0).tolist()
        return (low[0], low[1], low[2]), (high[0], high[1], high[2])

    @property
    def volume(self) -> float | None:
        """That the surface encloses, m^3; None where it passes through itself, or is not known."""
        surface = self._known
        return None if surface is None or surface.crossings else surface.volume

    @property
    def _known(self) -> Closed | None:
        if not Path(self.path).is_file():
            return None
        from softmark.solvers.mesh.files.mesh_validation import UnreadableMesh

        try:
            return self.closed()
        except UnreadableMesh:
            return None

    def closed(self, size: float | None = None) -> Closed:
        """The surface, repaired, for cells of any size. Raises UnreadableMesh."""
        return _closed(self.path, self.unit, seen(self.path))

    def filling(self, size: float, graded: tuple[Cut, ...] = ()) -> FilledMesh:
        """Four-node tetrahedra with edges of about `size` (m), less where cuts say so. Raises UnreadableMesh."""
        return _filled(self.path, self.unit, seen(self.path), size, self.near(smallest(size, graded)), graded)

    def surface(self, size: float = 0.0) -> Surface:
        """Points (n, 3) in m and triangles (t, 3) of the file's surface, repaired, outward. Raises UnreadableMesh."""
        surface = self.closed()
        return surface.points, surface.triangles


Seen = tuple[int, int] | None  # when a file was changed, and its bytes: one that was changed is read again


def seen(path: str) -> Seen:
    file = Path(path)
    if not file.is_file():
        return None
    found = file.stat()
    return found.st_mtime_ns, found.st_size


@lru_cache(maxsize=4)
def _closed(path: str, unit: float, stamp: Seen) -> Closed:
    from softmark.solvers.mesh.files.mesh_reader import read_triangles
    from softmark.solvers.mesh.files.watertight_repair import closed

    return closed(*read_triangles(path, unit))


@lru_cache(maxsize=8)
def _filled(path: str, unit: float, stamp: Seen, size: float, tolerance: float, graded: tuple[Cut, ...]) -> FilledMesh:
    from softmark.solvers.mesh.tetrahedralization import filled

    return filled(_closed(path, unit, stamp), size, tolerance, graded)
