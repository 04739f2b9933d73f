"""Tetrahedral meshes from files, through meshio."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from softmark.solvers.mesh.mesh import Mesh


class Unreadable(Exception):
    """A mesh file cannot be used; the message says what is wrong with it."""


def read(path: str, unit: float) -> Mesh:
    """The tetrahedra of `path` in m, cells turned to positive volume. Raises Unreadable."""
    import meshio

    if not Path(path).is_file():
        raise Unreadable(f"there is no file {path}")
    try:
        data = meshio.read(path)
    except (Exception, SystemExit) as error:  # meshio's readers raise what they like, and exit
        raise Unreadable(f"meshio cannot read it ({error or type(error).__name__})") from error
    cells = [block.data for block in data.cells if block.type == "tetra"]
    if not cells:
        kinds = ", ".join(sorted({block.type for block in data.cells})) or "none"
        raise Unreadable(f"it has no four-node tetrahedra (its cells: {kinds})")
    points = unit * np.asarray(data.points, dtype=np.float64)[:, :3]
    return _checked(points, np.concatenate(cells).astype(np.int64))


def _checked(points: np.ndarray, cells: np.ndarray) -> Mesh:
    if cells.min() < 0 or cells.max() >= len(points):
        raise Unreadable("a cell names a point that does not exist")
    used, renumbered = np.unique(cells, return_inverse=True)
    points, cells = np.ascontiguousarray(points[used]), renumbered.reshape(cells.shape)
    if not np.all(np.isfinite(points)):
        raise Unreadable("a coordinate is not a finite number")
    volumes = Mesh(points, cells).volumes
    flat = np.abs(volumes) <= 1e-14 * np.ptp(points, axis=0).max() ** 3
    if np.any(flat):
        raise Unreadable(f"{int(flat.sum())} of its {len(cells)} tetrahedra are flat, the first is cell {int(np.argmax(flat))}")
    turned = volumes < 0
    cells[turned, 2:] = cells[turned, :1:-1]
    return Mesh(points, cells)
