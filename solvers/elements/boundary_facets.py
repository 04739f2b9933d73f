"""Boundary facets of solid elements: triangles of three and six nodes, quadrilaterals of four, eight and nine.

To add a facet: write its class (element.py lists the members) and add a line to FACETS.
"""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING, ClassVar

from softmark.solvers.elements import quadratic_shape_functions

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from softmark.solvers.elements.element import Facet, Rows

    Floats = NDArray[np.float64]
else:
    from softmark.solvers.runtime.lazy_modules import np


Three = tuple[tuple[int, int, int], ...]


class Triangle:
    """The reference triangle with corners (0, 0), (1, 0), (0, 1)."""

    corners: ClassVar[int] = 3
    square: ClassVar[bool] = False
    rim: ClassVar[tuple[tuple[float, float], ...]] = ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))
    centre: ClassVar[tuple[float, float]] = (1 / 3, 1 / 3)
    halves: ClassVar[Three] = ((0, 1, 2),)

    @staticmethod
    def monomial_exponents(degree: int) -> Floats:
        """Return the exponents (k, 2) of all monomials in xi and eta of a total degree up to `degree`."""
        return np.array([(i, j) for i in range(degree + 1) for j in range(degree + 1 - i)], dtype=float)

    @staticmethod
    def lattice(steps: int) -> Floats:
        """Return the points (k, 2) of a lattice on the triangle with `steps` equal intervals along each side."""
        return Triangle.monomial_exponents(steps) / steps

    @staticmethod
    def rule_from_square(a: Floats, b: Floats, w: Floats) -> tuple[Floats, Floats]:
        """Map a quadrature rule from the square [-1, 1]^2 to the triangle, as points (q, 2) and weights (q,).

        `a` and `b` (q,) are the coordinates of the rule's points on the square, and `w` (q,) its weights.
        """
        a, b = 0.5 * (a + 1.0), 0.5 * (b + 1.0)
        return np.stack([a, (1.0 - a) * b], axis=1), 0.25 * w * (1.0 - a)


class Quadrilateral:
    """The reference square [-1, 1]^2."""

    corners: ClassVar[int] = 4
    square: ClassVar[bool] = True
    rim: ClassVar[tuple[tuple[float, float], ...]] = ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))
    centre: ClassVar[tuple[float, float]] = (0.0, 0.0)
    halves: ClassVar[Three] = ((0, 1, 2), (0, 2, 3))

    @staticmethod
    def monomial_exponents(degree: int) -> Floats:
        """Return the exponents (k, 2) of all monomials of at most `degree` in xi and at most `degree` in eta."""
        return np.array(list(product(range(degree + 1), repeat=2)), dtype=float)

    @staticmethod
    def lattice(steps: int) -> Floats:
        """Return the points (k, 2) of a lattice on the square with `steps` equal intervals along each side."""
        found: Floats = 2.0 * Quadrilateral.monomial_exponents(steps) / steps - 1.0
        return found

    @staticmethod
    def rule_from_square(a: Floats, b: Floats, w: Floats) -> tuple[Floats, Floats]:
        """Return a quadrature rule of the square unchanged, as points (q, 2) and weights (q,)."""
        return np.stack([a, b], axis=1), w


class Tri3(Triangle):
    """Three-node triangle: N_0 = 1 - xi - eta, N_1 = xi, N_2 = eta."""

    nodes: ClassVar[int] = 3
    between: ClassVar[Rows] = ()
    triangles: ClassVar[Three] = Triangle.halves
    integrand_degree: ClassVar[int] = 1
    bend: ClassVar[int] = 2
    monomials: ClassVar[Rows] = ((0, 0), (1, 0), (0, 1))

    @staticmethod
    def quadrature() -> tuple[Floats, Floats]:
        """Return the centroid as the only point (1, 2), and its weight (1,).

        The rule is exact for a pressure, because the triangle stays flat.
        """
        return np.full((1, 2), 1 / 3), np.full(1, 0.5)

    @staticmethod
    def shape(xi: Floats) -> Floats:
        """Return the shape functions N (m, 3) at local points xi (m, 2)."""
        return np.concatenate([1.0 - xi.sum(axis=1, keepdims=True), xi], axis=1)

    @staticmethod
    def gradient(xi: Floats) -> Floats:
        """Return dN/dxi (m, 3, 2) at local points xi (m, 2)."""
        return np.broadcast_to(np.array([[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]]), (len(xi), 3, 2))


class Tri6(Triangle):
    """Six-node triangle with quadratic sides: three corners, then the middles of the sides 01, 12 and 20.

    Shape functions are L (2 L - 1) at corners and 4 L L' at midside nodes, with L the barycentric coordinates.
    """

    nodes: ClassVar[int] = 6
    between: ClassVar[Rows] = ((0, 1), (1, 2), (2, 0))
    triangles: ClassVar[Three] = ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5))
    integrand_degree: ClassVar[int] = 4
    bend: ClassVar[int] = 2
    monomials: ClassVar[Rows] = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))

    @staticmethod
    def quadrature() -> tuple[Floats, Floats]:
        """Return six points (6, 2) and weights (6,), exact for polynomials of degree four.

        This is the degree of a shape function times the area vector of the deformed facet.
        Source: Strang and Fix (1973); Dunavant (1985).
        """
        a, b = 0.445948490915965, 0.091576213509771
        wa, wb = 0.111690794839005, 0.054975871827661
        xi = [(a, a), (1 - 2 * a, a), (a, 1 - 2 * a), (b, b), (1 - 2 * b, b), (b, 1 - 2 * b)]
        return np.array(xi), np.array([wa, wa, wa, wb, wb, wb])

    @staticmethod
    def shape(xi: Floats) -> Floats:
        """Return the shape functions N (m, 6) at local points xi (m, 2)."""
        L = Tri3.shape(xi)
        return np.concatenate([L * (2 * L - 1), 4 * L * L[:, [1, 2, 0]]], axis=1)

    @staticmethod
    def gradient(xi: Floats) -> Floats:
        """Return dN/dxi (m, 6, 2) at local points xi (m, 2)."""
        L, dL = Tri3.shape(xi)[:, :, None], Tri3.gradient(xi)
        after = [1, 2, 0]
        return np.concatenate([(4 * L - 1) * dL, 4 * (L * dL[:, after] + L[:, after] * dL)], axis=1)


class Quad4(Quadrilateral):
    """Four-node quadrilateral on [-1, 1]^2, N = (1 +- xi)(1 +- eta)/4; its four nodes need not lie in one plane."""

    nodes: ClassVar[int] = 4
    between: ClassVar[Rows] = ()
    triangles: ClassVar[Three] = Quadrilateral.halves
    integrand_degree: ClassVar[int] = 2
    bend: ClassVar[int] = 2
    monomials: ClassVar[Rows] = ((0, 0), (1, 0), (0, 1), (1, 1))

    @staticmethod
    def quadrature() -> tuple[Floats, Floats]:
        """Return two by two Gauss points (4, 2) and weights (4,).

        The rule is exact for a shape function times the area vector of the deformed facet.
        """
        g = 3**-0.5
        return np.array([(-g, -g), (g, -g), (g, g), (-g, g)]), np.ones(4)

    @staticmethod
    def shape(xi: Floats) -> Floats:
        """Return the shape functions N (m, 4) at local points xi (m, 2)."""
        a, b = np.array(Quad4.rim).T
        N: Floats = (1 + a * xi[:, :1]) * (1 + b * xi[:, 1:]) / 4
        return N

    @staticmethod
    def gradient(xi: Floats) -> Floats:
        """Return dN/dxi (m, 4, 2) at local points xi (m, 2)."""
        a, b = np.array(Quad4.rim).T
        return np.stack([a * (1 + b * xi[:, 1:]) / 4, b * (1 + a * xi[:, :1]) / 4], axis=2)


class Quad8(Quadrilateral):
    """Eight-node serendipity quadrilateral: corners, then middles of the sides 01, 12, 23, 30."""

    nodes: ClassVar[int] = 8
    between: ClassVar[Rows] = ((0, 1), (1, 2), (2, 3), (3, 0))
    triangles: ClassVar[Three] = ((0, 4, 7), (4, 1, 5), (5, 2, 6), (6, 3, 7), (4, 5, 7), (5, 6, 7))
    integrand_degree: ClassVar[int] = 5
    bend: ClassVar[int] = 3
    monomials: ClassVar[Rows] = ((0, 0), (1, 0), (0, 1), (1, 1), (2, 0), (0, 2), (2, 1), (1, 2))

    @staticmethod
    def places() -> Floats:
        """Return the local points of the nodes, shape (8, 2)."""
        return _corners_and_midside_points(Quad8.between)

    @staticmethod
    def quadrature() -> tuple[Floats, Floats]:
        """Return three by three Gauss points (9, 2) and weights (9,).

        The rule is exact for a shape function times the area vector of the deformed facet.
        """
        return quadratic_shape_functions.three_point_tensor_gauss_rule(2)

    @staticmethod
    def shape(xi: Floats) -> Floats:
        """Return the shape functions N (m, 8) at local points xi (m, 2)."""
        return quadratic_shape_functions.serendipity(Quad8.places(), xi)

    @staticmethod
    def gradient(xi: Floats) -> Floats:
        """Return dN/dxi (m, 8, 2) at local points xi (m, 2)."""
        return quadratic_shape_functions.serendipity_gradient(Quad8.places(), xi)


class Quad9(Quadrilateral):
    """Nine-node Lagrange quadrilateral: corners, middles of the sides 01, 12, 23, 30, and the centre."""

    nodes: ClassVar[int] = 9
    between: ClassVar[Rows] = (*Quad8.between, (0, 1, 2, 3))
    triangles: ClassVar[Three] = (
        (0, 4, 8), (4, 1, 8), (1, 5, 8), (5, 2, 8), (2, 6, 8), (6, 3, 8), (3, 7, 8), (7, 0, 8),
    )  # fmt: skip
    integrand_degree: ClassVar[int] = 5
    bend: ClassVar[int] = 4
    monomials: ClassVar[Rows] = tuple(product(range(3), repeat=2))

    @staticmethod
    def places() -> Floats:
        """Return the local points of the nodes, shape (9, 2)."""
        return _corners_and_midside_points(Quad9.between)

    @staticmethod
    def quadrature() -> tuple[Floats, Floats]:
        """Return three by three Gauss points (9, 2) and weights (9,).

        The rule is exact for a shape function times the area vector of the deformed facet.
        """
        return quadratic_shape_functions.three_point_tensor_gauss_rule(2)

    @staticmethod
    def shape(xi: Floats) -> Floats:
        """Return the shape functions N (m, 9) at local points xi (m, 2)."""
        return quadratic_shape_functions.lagrange(Quad9.places(), xi)

    @staticmethod
    def gradient(xi: Floats) -> Floats:
        """Return dN/dxi (m, 9, 2) at local points xi (m, 2)."""
        return quadratic_shape_functions.lagrange_gradient(Quad9.places(), xi)


def _corners_and_midside_points(between: Rows) -> Floats:
    """Return the local points (k, 2) of the square's corners, followed by its midside nodes.

    Each entry of `between` lists the corners whose mean is the position of one midside node.
    """
    rim = np.array(Quadrilateral.rim)
    return np.array([*rim, *(rim[list(ends)].mean(axis=0) for ends in between)])


FACETS: dict[int, type[Facet]] = {3: Tri3, 6: Tri6, 4: Quad4, 8: Quad8, 9: Quad9}  # by their number of nodes
