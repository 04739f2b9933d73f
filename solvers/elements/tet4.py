"""The four-node tetrahedron: linear shape functions, one integration point."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from softmark.solvers.elements.facets import Tri3

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from softmark.solvers.elements.element import Facet

    Floats = NDArray[np.float64]
else:
    from softmark.solvers.base.deferred import np


class Tet4:
    """Four-node tetrahedron, linear displacement: cheap, stiff in bending, locks near incompressibility.

    N_0 = 1 - xi - eta - zeta, N_1 = xi, N_2 = eta, N_3 = zeta, one integration point (exact, since the gradient
    is constant). Displacements converge with h^2 and strains with h. At Poisson ratios of 0.45 and above it is much too
    stiff (volumetric locking). Source: Zienkiewicz, Taylor and Zhu (2013), section 5.
    """

    nodes: ClassVar[int] = 4
    corners: ClassVar[int] = 4
    order: ClassVar[int] = 1
    dimension: ClassVar[int] = 3
    family: ClassVar[str] = "tetrahedra"
    locks: ClassVar[float] = 0.45
    centre: ClassVar[tuple[float, float, float]] = (0.25, 0.25, 0.25)
    volume: ClassVar[float] = 1 / 6
    facets: ClassVar[tuple[tuple[int, ...], ...]] = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))
    facet: ClassVar[type[Facet]] = Tri3

    @staticmethod
    def places() -> Floats:
        """Local points of the nodes (4, 3)."""
        return np.concatenate([np.zeros((1, 3)), np.eye(3)])

    @staticmethod
    def quadrature() -> tuple[Floats, Floats]:
        """Points (q, 3) and weights (q,) on the unit tetrahedron, whose volume is 1/6."""
        return np.full((1, 3), 0.25), np.full(1, 1.0 / 6.0)

    @staticmethod
    def shape(xi: Floats) -> Floats:
        """Shape functions N (m, 4) at local points xi (m, 3)."""
        return np.concatenate([1.0 - xi.sum(axis=1, keepdims=True), xi], axis=1)

    @staticmethod
    def gradient(xi: Floats) -> Floats:
        """dN/dxi (m, 4, 3) at local points xi (m, 3)."""
        dN = np.array([[-1.0, -1.0, -1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
        return np.broadcast_to(dN, (len(xi), 4, 3))

    @staticmethod
    def clip(xi: Floats) -> Floats:
        """Barycentric coordinates below zero become zero, and the others keep their proportions."""
        N = np.maximum(Tet4.shape(xi), 0.0)
        inside: Floats = N[:, 1:] / N.sum(axis=1, keepdims=True)
        return inside
