"""The ten-node tetrahedron: quadratic shape functions, four integration points."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from softmark.solvers.elements.facets import Tri6
from softmark.solvers.elements.tet4 import Tet4

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from softmark.solvers.elements.element import Facet

    Floats = NDArray[np.float64]
else:
    from softmark.solvers.base.deferred import np

EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))  # corners of the nodes 4 to 9


class Tet10:
    """Ten-node tetrahedron, quadratic displacement: bends well, follows curved surfaces, locks mildly only.

    Corners L_a (2 L_a - 1), mid-edge nodes 4 L_a L_b of the edges 01, 12, 02, 03, 13, 23, with L the barycentric
    coordinates; four integration points of degree two (Hammer, Marlowe and Stroud 1956). Displacements converge
    with h^3 and strains with h^2. On a cylinder its mid-edge nodes lie on the true surface. Near incompressibility
    pressures oscillate, while displacements stay close: at a Poisson ratio of 0.499 refine and compare.
    Costs about eight times a four-node tetrahedron. Source: Zienkiewicz, Taylor and Zhu (2013), section 6.
    """

    nodes: ClassVar[int] = 10
    corners: ClassVar[int] = 4
    order: ClassVar[int] = 2
    dimension: ClassVar[int] = 3
    family: ClassVar[str] = "tetrahedra"
    locks: ClassVar[float] = 0.4995
    centre: ClassVar[tuple[float, float, float]] = (0.25, 0.25, 0.25)
    volume: ClassVar[float] = 1 / 6
    facets: ClassVar[tuple[tuple[int, ...], ...]] = (
        (0, 2, 1, 6, 5, 4),
        (0, 1, 3, 4, 8, 7),
        (1, 2, 3, 5, 9, 8),
        (0, 3, 2, 7, 9, 6),
    )
    facet: ClassVar[type[Facet]] = Tri6

    @staticmethod
    def places() -> Floats:
        """Local points of the nodes (10, 3)."""
        corners = Tet4.places()
        return np.concatenate([corners, corners[np.array(EDGES)].mean(axis=1)])

    @staticmethod
    def quadrature() -> tuple[Floats, Floats]:
        """Points (4, 3) and weights (4,) on the unit tetrahedron, whose volume is 1/6."""
        a = (5 - 5**0.5) / 20
        return a + (1 - 4 * a) * Tet4.places(), np.full(4, 1 / 24)

    @staticmethod
    def shape(xi: Floats) -> Floats:
        """Shape functions N (m, 10) at local points xi (m, 3)."""
        L = Tet4.shape(xi)
        a, b = np.array(EDGES).T
        return np.concatenate([L * (2 * L - 1), 4 * L[:, a] * L[:, b]], axis=1)

    @staticmethod
    def gradient(xi: Floats) -> Floats:
        """dN/dxi (m, 10, 3) at local points xi (m, 3)."""
        L, dL = Tet4.shape(xi)[:, :, None], Tet4.gradient(xi)
        a, b = np.array(EDGES).T
        return np.concatenate([(4 * L - 1) * dL, 4 * (L[:, a] * dL[:, b] + L[:, b] * dL[:, a])], axis=1)

    @staticmethod
    def clip(xi: Floats) -> Floats:
        """As in the four-node tetrahedron."""
        return Tet4.clip(xi)
