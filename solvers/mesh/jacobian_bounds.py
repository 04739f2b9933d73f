"""Guaranteed detection of curved cells that are inverted somewhere, by bounds of the Jacobian determinant.

det dX/dxi is a cubic polynomial in a ten-node tetrahedron, and of degree two in each local coordinate in an eight-node
hexahedron. Such a polynomial lies between its least and its largest Bernstein coefficient, computed from values on a
regular lattice. If these bounds do not decide, the cell is split into eight parts, whose coefficients are closer to the
polynomial, and tested again.
Source: Johnen, Remacle and Geuzaine (2013), "Geometrical validity of curvilinear finite elements".
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from softmark.solvers.elements import element_of
from softmark.solvers.elements.reference_cells import Hexahedron
from softmark.solvers.mesh.mesh import Floats, Ints, Mesh, jacobians

POINTS = 5  # points per axis of the finest Gauss rule checked: the elements' rules have 2 or 3
DEPTH = 8  # largest number of splits: a cell undecided then is within 1e-4 of zero volume, and counts as folded


@lru_cache(maxsize=2)
def _bernstein_lattice(kind: str) -> tuple[Floats, Floats, Floats]:
    """Return the points at which the Jacobian determinant is evaluated, and two matrices for its values.

    These are the k local points (k, 3), the matrix (k, k) from values to Bernstein coefficients, and the matrices (8,
    k, k) from values on the cell to values on each of its eight parts.
    """
    element = element_of(kind)
    n, at = element.warp, element.lattice(element.warp)
    coefficients = np.asarray(np.linalg.inv(element.bernstein(n, at)), dtype=np.float64)
    within: Floats = np.stack([element.bernstein(n, part) @ coefficients for part in element.child_lattices(n)])
    return at, coefficients, within


def find_folded_cells(mesh: Mesh, least: Floats) -> tuple[Ints, Floats]:
    """Return the numbers of the cells in which det dX/dxi is at most `least` (m,), m^3, at some point.

    Return also the local point (k, 3) of each of these cells with the lowest value found. Four-node tetrahedra are
    never among them, because their determinant is uniform.
    """
    if mesh.element.constant:
        return np.zeros(0, dtype=np.int64), np.zeros((0, 3))
    at, coefficients, within = _bernstein_lattice(mesh.kind)
    values = jacobians(mesh, at) - least[:, None]
    cell, bad = np.arange(len(values)), values.min(axis=1) <= 0.0
    for _ in range(DEPTH):
        open_ = ~bad[cell] & ((values @ coefficients.T).min(axis=1) <= 0.0)
        values, cell = values[open_], cell[open_]
        if not len(cell):
            break
        values = np.einsum("pkl,ml->mpk", within, values).reshape(-1, values.shape[1])
        cell = np.repeat(cell, 8)
        np.logical_or.at(bad, cell, values.min(axis=1) <= 0.0)
    bad[cell] = True
    found = np.flatnonzero(bad)
    fine = np.concatenate([at, *mesh.element.child_lattices(mesh.element.warp)])
    lowest = jacobians(Mesh(mesh.points, mesh.cells[found], mesh.kind), fine).argmin(axis=1)
    return found, fine[lowest]


def has_folded_corner(mesh: Mesh) -> NDArray[np.bool_]:
    """Return a mask (m,) of the hexahedra that are inverted at a corner, but positive at all points of a Gauss rule.

    The Gauss rule has POINTS points along each axis. Integrals over such cells remain exact for polynomials, so that
    they pass the patch test.
    Source: MacNeal and Harder (1985), "A proposed standard set of problems to test finite element accuracy", whose
    solid patch has such a cell.
    """
    if not issubclass(mesh.element, Hexahedron):
        return np.zeros(len(mesh.cells), dtype=np.bool_)
    ends = np.array([-1.0, 1.0])
    inner = np.polynomial.legendre.leggauss(POINTS)[0]
    corners, points = (np.stack(np.meshgrid(s, s, s), axis=-1).reshape(-1, 3) for s in (ends, inner))
    least = 1e-3 * np.abs(mesh.volumes) / mesh.element.volume  # smaller determinants count as flat
    turned = np.asarray((jacobians(mesh, corners) <= 0.0).any(axis=1), dtype=np.bool_)
    return np.asarray(turned & (jacobians(mesh, points) > least[:, None]).all(axis=1), dtype=np.bool_)
