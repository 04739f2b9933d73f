"""Tetrahedra in a closed surface: by fTetWild (Hu et al. 2020, ACM Trans. Graph. 39:117), through pytetwild (MPL-2.0).

The mesher draws random numbers that cannot be set. What it made of a surface, a size and a tolerance is kept in the
cache, so that the same file gives the same mesh, and each mesh is known by a digest.
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
from softmark.solvers.mesh.cell_sizes import sizes
from softmark.solvers.mesh.conforming_planes import Cut, smallest
from softmark.solvers.mesh.files.mesh_validation import UnreadableMesh, checked, sharing, sides_of
from softmark.solvers.mesh.files.triangle_proximity import closest, ends_of
from softmark.solvers.mesh.files.watertight_repair import Closed, normals
from softmark.solvers.mesh.mesh import Floats, Ints, Mesh

MESHER = "pytetwild"
MISSING, FAILED = "E575", "E576"
MEANT = "1"  # to be raised when the same input is to give another mesh
UNREAD = (OSError, ValueError, KeyError, EOFError, BadZipFile)  # what a file of arrays that is cut off may raise
REACH = 3.0  # tolerances: how far from the surface a node of the mesh's own may lie to be moved onto it
SHRUNK = 0.3  # of its volume: what a cell keeps at the least when its nodes are moved
SHARP = 0.64  # cosine of 50 degrees: facets that meet at a larger angle meet at an edge of the body
LOST = 1e-3  # of the volume: what hangs on by an edge may be left out if it is no more


@dataclass(frozen=True)
class Filling:
    """How a surface was filled, with cells of about `size` (m) where they are smallest: by what, in how many seconds of
    CPU, no farther from it than `tolerance` (m).

    `repairs` are those of the surface and of its mesh, in words; `beside` are nodes of the mesh's surface that could
    not be moved onto the other; `digest` is that of points and tetrahedra.
    """

    surface: Closed
    size: float
    tolerance: float
    mesher: str
    seconds: float
    digest: str
    repairs: tuple[str, ...]
    beside: int


@dataclass(frozen=True)
class FilledMesh(Mesh):
    """A mesh that knows how it was made."""

    filling: Filling | None = None


def mesher() -> str:
    """The mesher and its version. Raises UnreadableMesh where it is not installed."""
    try:
        return f"{MESHER} {metadata.version(MESHER)}"
    except metadata.PackageNotFoundError:
        raise UnreadableMesh(
            f"a surface is filled by the package {MESHER}, which is not installed",
            MISSING, 'run `pip install "softmark[meshing]"`',
        ) from None  # fmt: skip


def filled(surface: Closed, size: float, tolerance: float, graded: tuple[Cut, ...] = ()) -> FilledMesh:
    """Four-node tetrahedra with edges of about `size` (m), no farther from the surface than `tolerance` (m).

    Where conditions of graded cuts hold they are so many times shorter. Raises UnreadableMesh.
    """
    name = mesher()
    key = hashlib.sha256(repr((name, MEANT, size, tolerance)).encode())
    key.update(surface.points.tobytes())
    key.update(surface.triangles.tobytes())
    field = sizes(surface, size, graded) if graded else {}
    for array in sorted(field):
        key.update(field[array].tobytes())
    points, cells, seconds = _kept(key.hexdigest()) or _made(key.hexdigest(), surface, size, tolerance, field)
    points, cells, repairs = _whole(points, _upright(points, cells))
    points, beside = _onto(surface, Mesh(points, cells), REACH * tolerance)
    mesh = checked(points, cells, "tet4")
    digest = hashlib.sha256(mesh.points.tobytes() + mesh.cells.tobytes()).hexdigest()[:12]
    how = Filling(
        surface, smallest(size, graded), tolerance, name, seconds, digest, (*surface.repairs, *repairs), beside
    )
    return FilledMesh(mesh.points, mesh.cells, mesh.kind, filling=how)


# ------------------------------------------------------------------ the mesher, and what it made before

Made = tuple[Floats, Ints, float]
Field = dict[str, Any]  # arrays of a mesh, and of sizes at its points, as the mesher calls them


def _folder() -> Path | None:
    """Where meshes are kept: $XDG_CACHE_HOME/softmark/filled; None where there is neither a cache nor a home."""
    try:
        return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "softmark" / "filled"
    except RuntimeError:
        return None


def _kept(key: str) -> Made | None:
    """What was made before; None of a cache that has none, or that cannot be read."""
    folder = _folder()
    with suppress(*UNREAD):
        if folder is not None and (folder / f"{key}.npz").is_file():
            return _read(folder / f"{key}.npz")
    return None


def _read(file: Path) -> Made:
    with file.open("rb") as data, np.load(data, allow_pickle=False) as found:
        points, cells = found["points"].astype(np.float64), found["cells"].astype(np.int64)
        seconds = float(found["seconds"]) if "seconds" in found else 0.0
    if points.ndim != 2 or points.shape[1:] != (3,) or cells.ndim != 2 or cells.shape[1:] != (4,):
        raise ValueError("no mesh of tetrahedra")
    return points, cells, seconds


def _made(key: str, surface: Closed, size: float, tolerance: float, field: Field) -> Made:
    """Filled now, and kept; what another process kept in the meantime is taken instead. Raises UnreadableMesh."""
    points, cells, seconds = _filled(surface, size, tolerance, **field)
    folder = _folder()
    if folder is None:
        return points, cells, seconds
    with suppress(OSError):  # a cache that cannot be written is no cache
        folder.mkdir(parents=True, exist_ok=True)
        handle, part = tempfile.mkstemp(dir=folder, prefix=".part-")
        try:
            with os.fdopen(handle, "wb") as out:
                np.savez_compressed(out, points=points, cells=cells, seconds=seconds)
            if _kept(key) is None:
                Path(part).replace(folder / f"{key}.npz")
        finally:
            Path(part).unlink(missing_ok=True)
    return _kept(key) or (points, cells, seconds)


def _filled(surface: Closed, size: float, tolerance: float, **field: Any) -> Made:
    """By the mesher, in a process of its own and in units of the body's extent. Raises UnreadableMesh."""
    origin, extent = surface.points.mean(axis=0), surface.extent
    if field:
        field |= {"bg_vertices": (field["bg_vertices"] - origin) / extent, "bg_values": field["bg_values"] / extent}
    with tempfile.TemporaryDirectory(prefix="softmark-") as folder:
        given, wanted = Path(folder, "surface.npz"), Path(folder, "mesh.npz")
        np.savez(given, points=(surface.points - origin) / extent, triangles=surface.triangles, size=size / extent,
                 tolerance=tolerance / extent, **field)  # fmt: skip
        command = [sys.executable, "-m", "softmark.solvers.mesh.files.ftetwild_process", str(given), str(wanted)]
        before = _spent()
        done = subprocess.run(  # in that folder, for it writes what nobody asked for
            command, cwd=folder, capture_output=True, text=True, errors="replace", stdin=subprocess.DEVNULL
        )
        seconds = _spent() - before
        try:
            points, cells, _ = _read(wanted)
        except UNREAD as error:
            raise _failed(done) from error
    if not len(cells):
        raise UnreadableMesh(
            "the mesher found nothing within its surface", FAILED, "take a smaller `tolerance`, or repair the surface"
        )
    return points * extent + origin, cells, seconds


def _spent() -> float:
    """Seconds of CPU of all processes that ended, where the platform counts them; else of the clock."""
    used = os.times()
    return used.children_user + used.children_system if os.name == "posix" else time.perf_counter()


def _failed(done: subprocess.CompletedProcess[str]) -> UnreadableMesh:
    """What became of the mesher, in words."""
    last = (done.stderr.strip().splitlines() or ["it said nothing"])[-1]
    how = f"it was ended by signal {-done.returncode}" if done.returncode < 0 else last[:200]
    return UnreadableMesh(
        f"{MESHER} could not fill its surface: {how}",
        FAILED, "take a larger `size` or `tolerance`, or repair the surface in the program that made it",
    )  # fmt: skip


# ------------------------------------------------------------------ what it made, as a mesh of the body


def _upright(points: Floats, cells: Ints) -> Ints:
    """Cells of positive volume."""
    inverted = Mesh(points, cells).volumes < 0.0
    cells = cells.copy()
    cells[inverted] = cells[inverted][:, [0, 2, 1, 3]]
    return cells


def _whole(points: Floats, cells: Ints) -> tuple[Floats, Ints, tuple[str, ...]]:
    """Without the little that hangs on by an edge or a node, or by nothing: the rest is one by its faces."""
    mesh = Mesh(points, cells)
    part = sharing(sides_of(mesh)[2].reshape(len(cells), -1))
    sizes = np.bincount(part, mesh.volumes)
    main = int(np.argmax(sizes))
    rest = 1.0 - float(sizes[main] / sizes.sum())
    repairs: tuple[str, ...] = ()
    if 0.0 < rest <= LOST and (part != main).any():
        dropped = int((part != main).sum())
        repairs = (f"{dropped} cells of {100 * rest:.2g} % of the volume left out that hung on by an edge",)
        cells = cells[part == main]
    kept, renumbered = np.unique(cells, return_inverse=True)
    return points[kept], renumbered.reshape(cells.shape).astype(np.int64), repairs


def _features(surface: Closed) -> tuple[Ints, Ints]:
    """Sharp edges of a surface, and its corners, where three or more of them meet: as triangles without an area."""
    n = normals(surface.points, surface.triangles)
    ends = np.sort(ends_of(surface.triangles), axis=1)
    edges, number, count = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(number.ravel(), kind="stable")
    first = np.cumsum(count) - count
    two = np.flatnonzero(count == 2)
    one, other = order[first[two]] // 3, order[first[two] + 1] // 3
    sharp = edges[two[np.einsum("ei,ei->e", n[one], n[other]) < SHARP]]
    points, meeting = np.unique(sharp, return_counts=True)
    return sharp[:, [0, 1, 1]], np.repeat(points[meeting > 2][:, None], 3, axis=1)


def _onto(surface: Closed, mesh: Mesh, reach: float) -> tuple[Floats, int]:
    """Nodes of the mesh's surface moved onto that of the file as far as cells stay sound; and how many are beside.

    Next to a sharp edge of it they are moved onto the edge, and next to a corner onto that: so flat faces are flat.
    """
    outer = np.unique(mesh.facets)
    there, far = closest(mesh.points[outer], surface.points, surface.triangles, reach)
    moves = np.isfinite(far)
    for sharp in _features(surface):
        sharper, away = closest(mesh.points[outer], surface.points, sharp, reach)
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
