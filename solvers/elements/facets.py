"""Boundary facets of solid elements: triangles of three and six nodes, quadrilaterals of four."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from softmark.solvers.elements.element import Facet

    Floats = NDArray[np.float64]
else:
    from softmark.solvers.base.deferred import np


class Tri3:
    """Three-node triangle: N_0 = 1 - xi - eta, N_1 = xi, N_2 = eta."""

    nodes: ClassVar[int] = 3
    corners: ClassVar[int] = 3
    triangles: ClassVar[tuple[tuple[int, int, int], ...]] = ((0, 1, 2),)

    @staticmethod
    def quadrature() -> tuple[Floats, Floats]:
        """The centroid: exact, since the triangle stays flat."""
        return np.full((1, 2), 1 / 3), np.full(1, 0.5)

    @staticmethod
    def shape(xi: Floats) -> Floats:
        """N (m, 3)."""
        return np.concatenate([1.0 - xi.sum(axis=1, keepdims=True), xi], axis=1)

    @staticmethod
    def gradient(xi: Floats) -> Floats:
        """dN/dxi (m, 3, 2)."""
        return np.broadcast_to(np.array([[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]]), (len(xi), 3, 2))


class Tri6:
    """Six-node triangle, sides of second degree: corners L (2 L - 1), then mid-sides 4 L L' of 01, 12, 20."""

    nodes: ClassVar[int] = 6
    corners: ClassVar[int] = 3
    triangles: ClassVar[tuple[tuple[int, int, int], ...]] = ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5))

    @staticmethod
    def quadrature() -> tuple[Floats, Floats]:
        """Six points of degree four (Strang and Fix 1973; Dunavant 1985): N times the area vector."""
        a, b = 0.445948490915965, 0.091576213509771
        wa, wb = 0.111690794839005, 0.054975871827661
        xi = [(a, a), (1 - 2 * a, a), (a, 1 - 2 * a), (b, b), (1 - 2 * b, b), (b, 1 - 2 * b)]
        return np.array(xi), np.array([wa, wa, wa, wb, wb, wb])

    @staticmethod
    def shape(xi: Floats) -> Floats:
        """N (m, 6)."""
        L = Tri3.shape(xi)
        return np.concatenate([L * (2 * L - 1), 4 * L * L[:, [1, 2, 0]]], axis=1)

    @staticmethod
    def gradient(xi: Floats) -> Floats:
        """dN/dxi (m, 6, 2)."""
        L, dL = Tri3.shape(xi)[:, :, None], Tri3.gradient(xi)
        after = [1, 2, 0]
        return np.concatenate([(4 * L - 1) * dL, 4 * (L * dL[:, after] + L[:, after] * dL)], axis=1)


class Quad4:
    """Four-node quadrilateral on [-1, 1]^2, N = (1 +- xi)(1 +- eta)/4; it need not be flat."""

    nodes: ClassVar[int] = 4
    corners: ClassVar[int] = 4
    triangles: ClassVar[tuple[tuple[int, int, int], ...]] = ((0, 1, 2), (0, 2, 3))

    @staticmethod
    def quadrature() -> tuple[Floats, Floats]:
        """Two by two Gauss points: exact for N times the area vector."""
        g = 3**-0.5
        return np.array([(-g, -g), (g, -g), (g, g), (-g, g)]), np.ones(4)

    @staticmethod
    def shape(xi: Floats) -> Floats:
        """N (m, 4)."""
        x, y = 1 + _quad_corners()[0] * xi[:, :1], 1 + _quad_corners()[1] * xi[:, 1:]
        N: Floats = x * y / 4
        return N

    @staticmethod
    def gradient(xi: Floats) -> Floats:
        """dN/dxi (m, 4, 2)."""
        a, b = _quad_corners()
        return np.stack([a * (1 + b * xi[:, 1:]) / 4, b * (1 + a * xi[:, :1]) / 4], axis=2)


def _quad_corners() -> Floats:
    """Local coordinates of the four corners (2, 4)."""
    return np.array([[-1.0, 1.0, 1.0, -1.0], [-1.0, -1.0, 1.0, 1.0]])


FACETS: dict[int, type[Facet]] = {3: Tri3, 6: Tri6, 4: Quad4}  # by their number of nodes
