"""Tetrahedral meshes from files, through meshio."""

from __future__ import annotations

from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np

from softmark.solvers.mesh.mesh import Mesh

UNENDING = frozenset({"ansys", "tecplot"})  # meshio's readers of these never return from a truncated file

SOLIDS = frozenset(
    {
        "hexahedron",
        "wedge",
        "pyramid",
        "tetra10",
        "hexahedron20",
        "hexahedron27",
        "wedge15",
        "wedge18",
        "pyramid13",
        "pyramid14",
    }
)


class Unreadable(Exception):
    """A mesh file cannot be used; the message says what is wrong with it."""


def read(path: str, unit: float) -> Mesh:
    """The tetrahedra of `path` in m, cells turned to positive volume. Raises Unreadable."""
    if not Path(path).is_file():
        raise Unreadable(f"there is no file {path}")
    data = _parsed(Path(path))
    cells = [block.data for block in data.cells if block.type == "tetra"]
    if not cells:
        kinds = ", ".join(sorted({block.type for block in data.cells})) or "none"
        raise Unreadable(f"it has no four-node tetrahedra (its cells: {kinds})")
    others = {block.type for block in data.cells} & SOLIDS
    if others:
        raise Unreadable(f"it has other solid cells beside its tetrahedra ({', '.join(sorted(others))})")
    points = unit * np.asarray(data.points, dtype=np.float64)[:, :3]
    return _checked(points, np.concatenate(cells).astype(np.int64))


def _parsed(path: Path) -> Any:
    """What meshio makes of the file in one of the formats of its name."""
    import meshio

    kinds = meshio.extension_to_filetypes.get(path.suffix.lower(), [None])  # None: let meshio say it
    reasons = []
    for kind in (k for k in kinds if k not in UNENDING):
        said = StringIO()  # meshio prints why it fails, and exits
        try:
            with redirect_stdout(said), redirect_stderr(said):
                return meshio.read(path, kind)
        except SystemExit:
            reasons.append(
                " ".join(said.getvalue().partition("Error:")[0].split()) or f"it is no {kind} file"
            )
        except Exception as error:  # its readers raise what they like
            reasons.append(str(error) or type(error).__name__)
    raise Unreadable(f"meshio cannot read it ({'; '.join(reasons) or 'in this format it may never finish'})")


def _checked(points: np.ndarray, cells: np.ndarray) -> Mesh:
    if cells.min() < 0 or cells.max() >= len(points):
        raise Unreadable("a cell names a point that does not exist")
    used, renumbered = np.unique(cells, return_inverse=True)
    points, cells = np.ascontiguousarray(points[used]), renumbered.reshape(cells.shape)
    if not np.all(np.isfinite(points)):
        raise Unreadable("a coordinate is not a finite number")
    if len(np.unique(np.sort(cells, axis=1), axis=0)) < len(cells):
        raise Unreadable("some of its cells are given twice")
    if (parts := _parts(len(points), cells)) > 1:
        raise Unreadable(f"it falls into {parts} parts that share no points")
    volumes = Mesh(points, cells).volumes
    flat = np.abs(volumes) <= 1e-14 * np.ptp(points, axis=0).max() ** 3
    if np.any(flat):
        which = f"{int(flat.sum())} of its {len(cells)} tetrahedra are flat"
        raise Unreadable(f"{which}, the first is cell {int(np.argmax(flat))}")
    turned = volumes < 0
    cells[turned, 2:] = cells[turned, :1:-1]
    return Mesh(points, cells)


def _parts(points: int, cells: np.ndarray) -> int:
    """How many parts of a mesh are not connected by cells."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    edges = (np.repeat(cells[:, 0], 3), cells[:, 1:].ravel())
    links = coo_matrix((np.ones(len(edges[0])), edges), shape=(points, points))
    return int(connected_components(links, directed=False)[0])
