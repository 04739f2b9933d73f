"""A mesh is points and cells as plain arrays; what can be derived from them is derived here."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# Faces of a tetrahedron seen from outside, counter-clockwise: positive volume gives outward normals.
TET_FACES = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))


@dataclass(frozen=True)
class Mesh:
    """Tetrahedra: `points` (n, 3) in m and `cells` (m, 4), positively oriented. Arrays are never written to."""

    points: Floats  # (n, 3)
    cells: Ints  # (m, 4)

    @cached_property
    def volumes(self) -> Floats:
        """Signed volume of each cell, m^3 (m,)."""
        a, b, c, d = (self.points[self.cells[:, i]] for i in range(4))
        volumes: Floats = np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) / 6.0
        return volumes

    @cached_property
    def faces(self) -> Ints:
        """Boundary triangles (f, 3), counter-clockwise from outside: those that belong to one cell only."""
        faces = self.cells[:, TET_FACES].reshape(-1, 3)
        _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
        boundary: Ints = faces[np.sort(first[count == 1])]
        return boundary

    @cached_property
    def extent(self) -> float:
        """Diagonal of the bounding box, m."""
        return float(np.linalg.norm(np.ptp(self.points, axis=0)))


def shape_quality(mesh: Mesh) -> Floats:
    """Mean-ratio quality of each tetrahedron (m,): 1 for a regular one, 0 for a flat one.

    q = 12 (3 V)^(2/3) / (sum of squared edge lengths); Liu and Joe (1994).
    """
    corners = mesh.points[mesh.cells]  # (m, 4, 3)
    i, j = np.triu_indices(4, 1)
    squares = np.sum((corners[:, i] - corners[:, j]) ** 2, axis=(1, 2))
    quality: Floats = 12.0 * (3.0 * np.maximum(mesh.volumes, 0.0)) ** (2.0 / 3.0) / squares
    return quality
