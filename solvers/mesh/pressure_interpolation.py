"""Pressure interpolation of mixed elements: the pressure unknowns of cells, and their shape functions."""

from __future__ import annotations

import numpy as np

from softmark.records import dataclass
from softmark.solvers.elements import element_of
from softmark.solvers.mesh.element_interpolation import Rule
from softmark.solvers.mesh.mesh import Floats, Ints, Mesh


@dataclass(frozen=True)
class PressureSpace:
    """Pressure unknowns of a mesh: `count` in all, `cells` (m, b) in each cell, and shape functions `N` (q, b)."""

    cells: Ints
    N: Floats
    count: int


def build_pressure_space(mesh: Mesh, rule: Rule | None = None) -> PressureSpace:
    """Return the pressure unknowns of a mesh: continuous and linear between corners, or one in each cell.

    The shape functions are evaluated at the points of `rule`, by default the element's own. Raises KeyError for
    elements without pressures: a linear tetrahedron has too few displacements for any.
    """
    xi, _ = rule or mesh.element.quadrature()
    element = mesh.element
    if element.pressures == "corners":
        corners, numbers = np.unique(mesh.cells[:, : element.corners], return_inverse=True)
        cells = numbers.reshape(-1, element.corners).astype(np.int64)
        return PressureSpace(cells, element_of(element.linear).shape(xi), len(corners))
    if element.pressures == "cell":
        return PressureSpace(np.arange(len(mesh.cells))[:, None], np.ones((len(xi), 1)), len(mesh.cells))
    raise KeyError(mesh.kind)
