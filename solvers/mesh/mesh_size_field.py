"""Target cell size of a graded tetrahedral mesh inside a closed surface, given on a background grid."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from softmark.solvers.mesh.cell_splitting import split_into_six_kuhn
from softmark.solvers.mesh.conforming_planes import Cut
from softmark.solvers.mesh.files.mesh_validation import UnreadableMesh
from softmark.solvers.mesh.files.watertight_repair import ClosedSurface
from softmark.solvers.mesh.mesh import Floats, Mesh
from softmark.solvers.mesh.structured_meshes import extrude_layers, grid_between_lines

NOWHERE = "E341"
FINE = 24  # cells of that grid along the longest extent
BEYOND = 0.05  # margin of the grid around the surface, relative to the extent
REACH = 0.5  # distance over which sizes grow back, relative to the extent


def build_size_field(surface: ClosedSurface, size: float, graded: Sequence[Cut]) -> dict[str, Any]:
    """Return a background mesh around a surface, and the target cell size at its points.

    The result has the mesher's names for points (n, 3), m, tetrahedra, and cell sizes (n,), m. Cells have the `size`
    (m) except near the conditions of `graded` cuts. Raises UnreadableMesh.
    """
    X, cells = _background_grid(surface)
    share = np.ones(len(X))
    for cut in graded:
        share = np.minimum(share, cut.share(_distance_to_condition(cut, surface, X), REACH * surface.extent))
    tets = split_into_six_kuhn(Mesh(X, cells, "hex8")).cells
    return {"bg_vertices": X, "bg_tets": tets.astype(np.int32), "bg_values": size * share}


def _background_grid(surface: ClosedSurface) -> tuple[Floats, Any]:
    """Return the points and hexahedra of a grid around a closed surface."""
    low, high = surface.points.min(axis=0), surface.points.max(axis=0)
    edge = float((high - low).max()) / FINE
    low, high = low - BEYOND * surface.extent, high + BEYOND * surface.extent
    x, y, z = (np.linspace(a, b, 1 + int(np.ceil((b - a) / edge))) for a, b in zip(low, high, strict=True))
    points, cells, _ = extrude_layers(grid_between_lines(x, y), z)
    return points, cells


def _distance_to_condition(cut: Cut, surface: ClosedSurface, X: Floats) -> Floats:
    """Return the distance (n,), m, between points X (n, 3) and the region where the condition of a cut holds.

    The region is represented by those grid points X and surface points at which the condition holds.
    """
    from scipy.spatial import cKDTree

    every = np.concatenate([X, surface.points, surface.points[surface.triangles].mean(axis=1)])
    held = np.broadcast_to(cut.where.holds(*every.T, surface.extent), len(every))
    if not held.any():
        raise UnreadableMesh(
            "no part of it lies where it should be refined", NOWHERE, "check the condition of `refine_at`"
        )
    away: Floats = cKDTree(every[held]).query(X)[0]
    return away
