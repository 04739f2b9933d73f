"""Tetrahedralization of a closed surface by fTetWild, through the package pytetwild (MPL-2.0).

The mesher uses random numbers that cannot be seeded. Its result for a surface, a size and a tolerance is cached, so
that the same file gives the same mesh, and each mesh is identified by a digest.
Source: Hu et al. (2020), ACM Trans. Graph. 39:117.
"""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from importlib import metadata
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from softmark.records import dataclass
from softmark.solvers.mesh.conforming_planes import Cut, smallest_size
from softmark.solvers.mesh.files.mesh_validation import UnreadableMesh, components_of_rows, facets_of_cells, validate
from softmark.solvers.mesh.files.triangle_proximity import closest_points, edges_of_triangles
from softmark.solvers.mesh.files.watertight_repair import ClosedSurface, normals
from softmark.solvers.mesh.mesh import Floats, Ints, Mesh
from softmark.solvers.mesh.mesh_size_field import build_size_field

MESHER = "pytetwild"
MISSING, FAILED = "E575", "E576"
MEANT = "1"  # increase when the same input should give another mesh
UNREAD = (OSError, ValueError, KeyError, EOFError, BadZipFile)  # errors of a truncated array file
REACH = 3.0  # in tolerances: largest distance of a mesh node from the surface to be moved onto it
SHRUNK = 0.3  # smallest volume of a cell after moving nodes, relative to the one before
SHARP = 0.64  # cosine of 50 degrees: facets that meet at a larger angle meet at an edge of the body
LOST = 1e-3  # relative to the volume: largest loosely connected part that may be dropped


@dataclass(frozen=True)
class MeshingRecord:
    """Record of how a surface was filled: mesher, smallest cell `size` (m), CPU time (s) and `tolerance` (m).

    `repairs` describes the repairs of the surface and of the mesh as text. `beside` counts boundary nodes of the mesh
    that could not be moved onto the given surface. `digest` identifies the points and tetrahedra.
    """

    surface: ClosedSurface
    size: float
    tolerance: float
    mesher: str
    seconds: float
    digest: str
    repairs: tuple[str, ...]
    beside: int


@dataclass(frozen=True)
class FilledMesh(Mesh):
    """A tetrahedral mesh with the record of how it was made."""

    filling: MeshingRecord | None = None


def mesher_version() -> str:
    """Return the name and version of the mesher. Raises UnreadableMesh if it is not installed."""
    try:
        return f"{MESHER} {metadata.version(MESHER)}"
    except metadata.PackageNotFoundError:
        raise UnreadableMesh(
            f"filling a surface needs the package {MESHER}, which is not installed",
            MISSING, 'run `pip install "softmark[meshing]"`',
        ) from None  # fmt: skip


def fill_surface(surface: ClosedSurface, size: float, tolerance: float, graded: tuple[Cut, ...] = ()) -> FilledMesh:
    """Return four-node tetrahedra with edges of about `size` (m), at most `tolerance` (m) from the surface.

    Where the condition of a graded cut holds, edges are shorter by the factor of the cut. Raises UnreadableMesh.
    """
    name = mesher_version()
    key = hashlib.sha256(repr((name, MEANT, size, tolerance)).encode())
    key.update(surface.points.tobytes())
    key.update(surface.triangles.tobytes())
    field = build_size_field(surface, size, graded) if graded else {}
    for array in sorted(field):
        key.update(field[array].tobytes())
    points, cells, seconds = _load_cached_mesh(key.hexdigest()) or _fill_and_cache(
        key.hexdigest(), surface, size, tolerance, field
    )
    points, cells, repairs = _drop_loose_parts(points, _orient_positively(points, cells))
    points, beside = _project_onto_surface(surface, Mesh(points, cells), REACH * tolerance)
    mesh = validate(points, cells, "tet4")
    digest = hashlib.sha256(mesh.points.tobytes() + mesh.cells.tobytes()).hexdigest()[:12]
    how = MeshingRecord(
        surface, smallest_size(size, graded), tolerance, name, seconds, digest, (*surface.repairs, *repairs), beside
    )
    return FilledMesh(mesh.points, mesh.cells, mesh.kind, filling=how)


# ------------------------------------------------------------------ the mesher and the cache of its meshes

Made = tuple[Floats, Ints, float]
Field = dict[str, Any]  # arrays of a mesh and of sizes at its points, by the mesher's names


def _cache_folder() -> Path | None:
    """Return the folder of cached meshes, $XDG_CACHE_HOME/softmark/filled; None if there is no home folder either."""
    try:
        return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "softmark" / "filled"
    except RuntimeError:
        return None


def _load_cached_mesh(key: str) -> Made | None:
    """Return a cached mesh; None if the cache has none, or cannot be read."""
    folder = _cache_folder()
    with suppress(*UNREAD):
        if folder is not None and (folder / f"{key}.npz").is_file():
            return _read_cached_mesh(folder / f"{key}.npz")
    return None


def _read_cached_mesh(file: Path) -> Made:
    with file.open("rb") as data, np.load(data, allow_pickle=False) as found:
        points, cells = found["points"].astype(np.float64), found["cells"].astype(np.int64)
        seconds = float(found["seconds"]) if "seconds" in found else 0.0
    if points.ndim != 2 or points.shape[1:] != (3,) or cells.ndim != 2 or cells.shape[1:] != (4,):
        raise ValueError("the cached file contains no tetrahedral mesh")
    return points, cells, seconds


def _fill_and_cache(key: str, surface: ClosedSurface, size: float, tolerance: float, field: Field) -> Made:
    """Fill the surface with tetrahedra and cache the mesh under `key`. Raises UnreadableMesh.

    Return points (n, 3), m, cells (m, 4) and CPU time, s. If another process has cached a mesh meanwhile, that mesh is
    returned instead.
    """
    points, cells, seconds = _run_mesher(surface, size, tolerance, **field)
    folder = _cache_folder()
    if folder is None:
        return points, cells, seconds
    with suppress(OSError):  # the cache is optional
        folder.mkdir(parents=True, exist_ok=True)
        handle, part = tempfile.mkstemp(dir=folder, prefix=".part-")
        try:
            with os.fdopen(handle, "wb") as out:
                np.savez_compressed(out, points=points, cells=cells, seconds=seconds)
            if _load_cached_mesh(key) is None:
                Path(part).replace(folder / f"{key}.npz")
        finally:
            Path(part).unlink(missing_ok=True)
    return _load_cached_mesh(key) or (points, cells, seconds)


def _run_mesher(surface: ClosedSurface, size: float, tolerance: float, **field: Any) -> Made:
    """Run the mesher in a separate process, with lengths divided by the body's extent. Raises UnreadableMesh."""
    origin, extent = surface.points.mean(axis=0), surface.extent
    if field:
        field |= {"bg_vertices": (field["bg_vertices"] - origin) / extent, "bg_values": field["bg_values"] / extent}
    with tempfile.TemporaryDirectory(prefix="softmark-") as folder:
        given, wanted = Path(folder, "surface.npz"), Path(folder, "mesh.npz")
        np.savez(given, points=(surface.points - origin) / extent, triangles=surface.triangles, size=size / extent,
                 tolerance=tolerance / extent, **field)  # fmt: skip
        command = [sys.executable, "-m", "softmark.solvers.mesh.files.ftetwild_process", str(given), str(wanted)]
        before = _child_process_cpu_seconds()
        done = subprocess.run(  # in that folder, since it writes additional files
            command, cwd=folder, capture_output=True, text=True, errors="replace", stdin=subprocess.DEVNULL
        )
        seconds = _child_process_cpu_seconds() - before
        try:
            points, cells, _ = _read_cached_mesh(wanted)
        except UNREAD as error:
            raise _mesher_error(done) from error
    if not len(cells):
        raise UnreadableMesh(
            "the mesher found no volume inside its surface", FAILED, "use a smaller `tolerance`, or repair the surface"
        )
    return points * extent + origin, cells, seconds


def _child_process_cpu_seconds() -> float:
    """Return the CPU time of all finished child processes, s; wall-clock time if the platform does not count it."""
    used = os.times()
    return used.children_user + used.children_system if os.name == "posix" else time.perf_counter()


def _mesher_error(done: subprocess.CompletedProcess[str]) -> UnreadableMesh:
    """Return an error that describes how the mesher process `done` failed."""
    last = (done.stderr.strip().splitlines() or ["no output"])[-1]
    how = f"it was terminated by signal {-done.returncode}" if done.returncode < 0 else last[:200]
    return UnreadableMesh(
        f"{MESHER} could not fill its surface: {how}",
        FAILED, "use a larger `size` or `tolerance`, or repair the surface in the program that made it",
    )  # fmt: skip


# ------------------------------------------------------------------ corrections of the mesher's result


def _orient_positively(points: Floats, cells: Ints) -> Ints:
    """Return the cells with nodes reordered so that all volumes are positive."""
    inverted = Mesh(points, cells).volumes < 0.0
    cells = cells.copy()
    cells[inverted] = cells[inverted][:, [0, 2, 1, 3]]
    return cells


def _drop_loose_parts(points: Floats, cells: Ints) -> tuple[Floats, Ints, tuple[str, ...]]:
    """Return points and cells without small parts that share no face with the largest part, and a report as text.

    Parts are kept if they have more than the fraction LOST of the volume.
    """
    mesh = Mesh(points, cells)
    part = components_of_rows(facets_of_cells(mesh)[2].reshape(len(cells), -1))
    sizes = np.bincount(part, mesh.volumes)
    main = int(np.argmax(sizes))
    rest = 1.0 - float(sizes[main] / sizes.sum())
    repairs: tuple[str, ...] = ()
    if 0.0 < rest <= LOST and (part != main).any():
        dropped = int((part != main).sum())
        repairs = (
            f"{dropped} cells with {100 * rest:.2g} % of the volume removed, which were connected only by an edge",
        )
        cells = cells[part == main]
    kept, renumbered = np.unique(cells, return_inverse=True)
    return points[kept], renumbered.reshape(cells.shape).astype(np.int64), repairs


def _sharp_edges_and_corners(surface: ClosedSurface) -> tuple[Ints, Ints]:
    """Return the sharp edges of a surface, and its corners (where at least three meet), as triangles without area."""
    n = normals(surface.points, surface.triangles)
    ends = np.sort(edges_of_triangles(surface.triangles), axis=1)
    edges, number, count = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(number.ravel(), kind="stable")
    first = np.cumsum(count) - count
    two = np.flatnonzero(count == 2)
    one, other = order[first[two]] // 3, order[first[two] + 1] // 3
    sharp = edges[two[np.einsum("ei,ei->e", n[one], n[other]) < SHARP]]
    points, meeting = np.unique(sharp, return_counts=True)
    return sharp[:, [0, 1, 1]], np.repeat(points[meeting > 2][:, None], 3, axis=1)


def _project_onto_surface(surface: ClosedSurface, mesh: Mesh, reach: float) -> tuple[Floats, int]:
    """Return the mesh points with boundary nodes moved onto the given surface, and the number of nodes left off it.

    Nodes farther from the surface than `reach` (m) are not moved, nor nodes whose move would flatten a cell. Nodes near
    a sharp edge are moved onto the edge, and near a corner onto the corner, so that flat faces stay flat.
    """
    outer = np.unique(mesh.facets)
    there, far = closest_points(mesh.points[outer], surface.points, surface.triangles, reach)
    moves = np.isfinite(far)
    for sharp in _sharp_edges_and_corners(surface):
        sharper, away = closest_points(mesh.points[outer], surface.points, sharp, reach)
        there[np.isfinite(away)] = sharper[np.isfinite(away)]
    before = mesh.volumes
    while True:
        points = mesh.points.copy()
        points[outer[moves]] = there[moves]
        bad = Mesh(points, mesh.cells).volumes < SHRUNK * before
        back = np.isin(outer, mesh.cells[bad]) & moves
        if not back.any():
            return points, int((~moves).sum())
        moves &= ~back
