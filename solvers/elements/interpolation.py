"""What an element makes of a mesh: gradients at integration points, and places of points within cells."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from softmark.solvers.elements.tet4 import Tet4
from softmark.solvers.mesh.mesh import Floats, Ints, Mesh


@dataclass(frozen=True)
class Integration:
    """dNdX (m, q, a, 3) in 1/m and weights times det J, w (m, q) in m^3, of every cell."""

    dNdX: Floats
    w: Floats
    N: Floats  # (q, a)


def integration(mesh: Mesh, element: type[Tet4]) -> Integration:
    """Shape function gradients with respect to the undeformed position X, by the chain rule through dX/dxi."""
    xi, weights = element.quadrature()
    dN = element.gradient(xi)  # (q, a, 3)
    dXdxi = np.einsum("mai,qaj->mqij", mesh.points[mesh.cells], dN)
    dNdX = np.einsum("qaj,mqji->mqai", dN, np.linalg.inv(dXdxi))
    w = weights * np.linalg.det(dXdxi)
    return Integration(np.ascontiguousarray(dNdX), w, element.shape(xi))


@dataclass(frozen=True)
class Located:
    """Where points lie in a mesh: `nodes` (n, a) of the cell and the shape functions `N` (n, a) there.

    `outside` (n,) is about how far, in m, a point lies outside the cell that it was given to: 0 within, and else
    its distance to the farthest of the face planes that it lies beyond.
    """

    nodes: Ints
    N: Floats
    outside: Floats

    def interpolate(self, values: Floats) -> Floats:
        """Values at the points (n, k) from values at the nodes (nodes, k)."""
        result: Floats = np.einsum("na,nak->nk", self.N, values[self.nodes])
        return result


def locate(mesh: Mesh, X: Floats) -> Located:
    """The cell and the barycentric coordinates of each point X (n, 3) of the undeformed body.

    A point between an inscribed mesh and the curved surface that it approximates is given to the nearest cell
    and extrapolated linearly, so the caller must look at `outside`.
    """
    a = mesh.points[mesh.cells[:, 0]]
    inverse = np.linalg.inv(np.stack([mesh.points[mesh.cells[:, i]] - a for i in (1, 2, 3)], axis=2))
    found = np.empty(len(X), dtype=np.int64)
    N = np.empty((len(X), 4))
    for i, point in enumerate(X):
        found[i], N[i] = _best_cell(point, a, inverse)
    dN = inverse[found]  # (n, 3, 3): rows are the gradients of N_1, N_2, N_3
    dN = np.concatenate([-dN.sum(axis=1, keepdims=True), dN], axis=1)
    outside = np.maximum(
        0.0, (-N / np.linalg.norm(dN, axis=2)).max(axis=1, initial=0.0)
    )  # to the farthest face plane
    outside[outside < 1e-9 * mesh.extent] = 0.0
    return Located(mesh.cells[found], N, outside)


def _best_cell(X: Floats, a: Floats, inverse: NDArray[np.float64]) -> tuple[int, Floats]:
    """The cell in which the smallest barycentric coordinate of X is largest, and those coordinates."""
    xi = np.einsum("mij,mj->mi", inverse, X - a)
    N = np.concatenate([1.0 - xi.sum(axis=1, keepdims=True), xi], axis=1)
    best = int(np.argmax(N.min(axis=1)))
    return best, N[best]
