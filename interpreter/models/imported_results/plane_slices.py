"""Results of a plane body, from plane cells of a file or from its single layer of solid cells.

All points with equal x and y move alike in a plane slice, so positions are compared by x and y only.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softmark.interpreter.models.imported_results.matching_error import SAME, Unmatched
from softmark.interpreter.models.imported_results.result_file import Floats, Ints, ResultFile
from softmark.solvers.mesh.files.mesh_validation import UnreadableMesh
from softmark.solvers.mesh.files.plane_cells import extrude_cells
from softmark.solvers.mesh.mesh import Mesh

Which = NDArray[np.int64]
LAYERS = "write the cells or points of one plane z = 0, or of a slice one cell thick"


def slice_of(X: Floats, told: ResultFile, depth: float) -> tuple[Mesh, Which] | None:
    """Return a plane slice of thickness `depth`, m, on a file's plane cells, and the file point of each node.

    X (n, 3), m, are the points of the file. The result is None if the file has no plane cells. Raises Unmatched.
    """
    if told.flat is None:
        return None
    kind, cells = told.flat
    try:
        mesh = extrude_cells(X, cells, kind)
    except UnreadableMesh as error:
        raise Unmatched(f"its plane cells do not form a slice: {error}", error.remedy or LAYERS) from None
    which = _file_point_indices(mesh, X, cells)
    mesh.points[:, 2] *= depth / np.ptp(mesh.points[:, 2])
    return mesh, which


def _file_point_indices(mesh: Mesh, X: Floats, cells: Ints) -> Which:
    """Return, for each node of a slice, the index of the file point in the same cell with the same x and y."""
    which = np.empty(len(mesh.points), dtype=np.int64)
    for own, flat in zip(mesh.cells, cells, strict=True):
        apart = mesh.points[own, None, :2] - X[None, flat, :2]  # (a, b, 2)
        which[own] = flat[(apart**2).sum(axis=2).argmin(axis=1)]
    return which


def must_be_one_layer(X: Floats, mesh: Mesh | None) -> None:
    """Raise Unmatched if points X (n, 3), m, or cells form several layers along z."""
    z = X[:, 2]
    thick, extent = float(np.ptp(z)), float(np.linalg.norm(np.ptp(X, axis=0)))
    if mesh is None:
        if thick > SAME * extent:
            raise Unmatched("its points lie in several planes, but the body is one slice", LAYERS)
        return
    own = z[mesh.cells]
    if float(np.ptp(own, axis=1).min()) < (1.0 - SAME) * thick:
        raise Unmatched("its cells lie in several layers, but the body is one slice", LAYERS)
