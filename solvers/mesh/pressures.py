"""Pressures of mixed elements: which cells share them, and their shape functions."""

from __future__ import annotations

import numpy as np

from softmark.records import dataclass
from softmark.solvers.elements.tet4 import Tet4
from softmark.solvers.mesh.interpolation import Rule
from softmark.solvers.mesh.mesh import Floats, Ints, Mesh

PAIRED = ("tet10", "hex8")  # elements that have pressures to go with their displacements


@dataclass(frozen=True)
class Pressures:
    """`cells` (m, b): the numbers, from 0, of each cell's pressures; `N` (q, b) their shape functions; how many."""

    cells: Ints
    N: Floats
    count: int


def pressures(mesh: Mesh, rule: Rule | None = None) -> Pressures:
    """Linear and continuous, at the corners of ten-node tetrahedra; constant in each hexahedron.

    Raises KeyError for elements that have none: a linear tetrahedron has too few displacements for any pressure.
    """
    xi, _ = rule or mesh.element.quadrature()
    if mesh.kind == "tet10":
        corners, numbers = np.unique(mesh.cells[:, :4], return_inverse=True)
        return Pressures(numbers.reshape(-1, 4).astype(np.int64), Tet4.shape(xi), len(corners))
    if mesh.kind == "hex8":
        return Pressures(np.arange(len(mesh.cells))[:, None], np.ones((len(xi), 1)), len(mesh.cells))
    raise KeyError(mesh.kind)
