"""How large the cells of a filled surface are to be, where they are finer in some places: on a grid around it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from softmark.solvers.mesh.cell_splitting import kuhn
from softmark.solvers.mesh.conforming_planes import Cut
from softmark.solvers.mesh.files.mesh_validation import UnreadableMesh
from softmark.solvers.mesh.files.watertight_repair import Closed
from softmark.solvers.mesh.mesh import Floats, Mesh
from softmark.solvers.mesh.structured_meshes import extruded_to, grid_of

NOWHERE = "E341"
FINE = 24  # cells of that grid along the longest extent
BEYOND = 0.05  # of the extent: how far it goes beyond the surface
REACH = 0.5  # of the extent: how far from where cells are finer they have their size again


def sizes(surface: Closed, size: float, graded: Sequence[Cut]) -> dict[str, Any]:
    """Points (n, 3), m, and tetrahedra of a grid, and the size at each point (n,), m. Raises UnreadableMesh."""
    X, cells = _grid(surface)
    share = np.ones(len(X))
    for cut in graded:
        share = np.minimum(share, cut.share(_away(cut, surface, X), REACH * surface.extent))
    tets = kuhn(Mesh(X, cells, "hex8")).cells
    return {"bg_vertices": X, "bg_tets": tets.astype(np.int32), "bg_values": size * share}


def _grid(surface: Closed) -> tuple[Floats, Any]:
    """Points and hexahedra around a surface."""
    low, high = surface.points.min(axis=0), surface.points.max(axis=0)
    edge = float((high - low).max()) / FINE
    low, high = low - BEYOND * surface.extent, high + BEYOND * surface.extent
    x, y, z = (np.linspace(a, b, 1 + int(np.ceil((b - a) / edge))) for a, b in zip(low, high, strict=True))
    points, cells, _ = extruded_to(grid_of(x, y), z)
    return points, cells


def _away(cut: Cut, surface: Closed, X: Floats) -> Floats:
    """How far points (n, 3) are from where a condition holds (n,), m: at points of the grid and of the surface."""
    from scipy.spatial import cKDTree

    every = np.concatenate([X, surface.points, surface.points[surface.triangles].mean(axis=1)])
    held = np.broadcast_to(cut.where.holds(*every.T, surface.extent), len(every))
    if not held.any():
        raise UnreadableMesh(
            "it is to be finer where nothing of it lies", NOWHERE, "look at the condition of `towards`"
        )
    away: Floats = cKDTree(every[held]).query(X)[0]
    return away
