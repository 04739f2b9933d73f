"""The reference wedge: a triangle with corners (0, 0), (1, 0), (0, 1), extruded for zeta from -1 to 1.

Plane triangles are slices of wedges (triangles.py). The two triangular ends are stored as quadrilateral facets whose
last two corners are equal; such a facet has the area and the points of the triangle.
"""

from __future__ import annotations

from itertools import product
from math import comb, factorial
from typing import TYPE_CHECKING, ClassVar

from softmark.solvers.elements.boundary_facets import Tri3, Tri6
from softmark.solvers.elements.reference_cells import determinants

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from softmark.solvers.elements.element import Rows

    Floats = NDArray[np.float64]
else:
    from softmark.solvers.runtime.lazy_modules import np


class Wedge:
    """The reference wedge: the product of a triangle and the interval [-1, 1]."""

    family: ClassVar[str] = "wedges"
    dimension: ClassVar[int] = 3
    corners: ClassVar[int] = 6
    linear: ClassVar[str] = "wedge6"
    centre: ClassVar[tuple[float, float, float]] = (1 / 3, 1 / 3, 0.0)
    inner: ClassVar[tuple[float, float, float]] = (0.3, 0.25, 0.1)
    volume: ClassVar[float] = 1.0
    edges: ClassVar[Rows] = ((0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5))
    diagonals: ClassVar[tuple[Rows, Rows]] = (((0, 4), (1, 3), (1, 5), (2, 4), (2, 3), (0, 5)), ())
    sides: ClassVar[Rows] = ((0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5), (0, 2, 1, 1), (3, 4, 5, 5))
    mirror: ClassVar[tuple[int, ...]] = (3, 4, 5, 0, 1, 2)
    tetrahedra: ClassVar[Rows] = ((0, 1, 2, 5), (0, 1, 5, 4), (0, 4, 5, 3))
    split: ClassVar[tuple[Rows, Rows]] = (
        ((0, 1, 2, 4, 5, 6), (0, 2, 3, 4, 6, 7)),
        ((0, 1, 3, 4, 5, 7), (1, 2, 3, 5, 6, 7)),
    )  # diagonals of neighbouring cells meet at common points, so that no direction is stiffer
    warps: ClassVar[bool] = True
    finer: ClassVar[str] = ""

    @staticmethod
    def rim() -> Floats:
        """Return the local points of the corners, shape (6, 3)."""
        return np.array([(x, y, z) for z in (-1.0, 1.0) for x, y in Tri3.rim])

    @staticmethod
    def clip(xi: Floats) -> Floats:
        """Return local points (m, 3) moved into the wedge.

        Negative barycentric coordinates in the triangle are set to zero and the others are scaled so that their sum is
        one; zeta is clipped to [-1, 1].
        """
        L = np.maximum(Tri3.shape(xi[:, :2]), 0.0)
        inside: Floats = L[:, 1:] / L.sum(axis=1, keepdims=True)
        return np.column_stack([inside, np.clip(xi[:, 2], -1.0, 1.0)])

    @staticmethod
    def random_points(rng: np.random.Generator, count: int) -> Floats:
        """Return uniformly distributed random local points (count, 3)."""
        return np.column_stack([rng.dirichlet(np.ones(3), size=count)[:, 1:], rng.uniform(-1.0, 1.0, count)])

    @staticmethod
    def child_corners() -> Floats:
        """Return the local corners (8, 6, 3) of the eight wedges into which the cell is split.

        The triangle is split into four, below and above zeta = 0.
        """
        nodes = np.concatenate([np.array(Tri3.rim), 0.5 * (np.array(Tri3.rim) + np.roll(Tri3.rim, -1, axis=0))])
        found = [
            [(*nodes[corner], z) for z in ends for corner in triangle]
            for ends in ((-1.0, 0.0), (0.0, 1.0))
            for triangle in ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5))
        ]
        return np.array(found)

    @staticmethod
    def mean_ratio_quality(corners: Floats) -> Floats:
        """Return the mean-ratio quality (m,) of wedges with corners (m, 6, 3).

        It is the least of 3 det(J)^(2/3) / |J|^2 over the corners, with the sign of det(J). J maps the edges at a
        corner of the ideal wedge, an equilateral triangle as high as its sides are long, to the edges at the corner of
        the cell.
        Source: Knupp (2001).
        """
        others = np.array([[1, 2, 3], [2, 0, 4], [0, 1, 5], [5, 4, 0], [3, 5, 1], [4, 3, 2]])
        e = corners[:, others] - corners[:, :, None]  # (m, 6, 3, 3), right-handed
        J = np.stack([e[:, :, 0], (2.0 * e[:, :, 1] - e[:, :, 0]) / 3**0.5, e[:, :, 2]], axis=2)
        root = np.cbrt(determinants(J))
        found: Floats = (3.0 * root * np.abs(root) / np.sum(J**2, axis=(-2, -1))).min(axis=1)
        return found

    @staticmethod
    def mass_quadrature() -> tuple[Floats, Floats]:
        """Return points (18, 3) and weights (18,) that integrate products of quadratic shape functions."""
        return wedge_rule(Tri6.quadrature(), 3)

    # -------------------------------------------------------------- polynomials by Bernstein's basis

    @staticmethod
    def lattice(degree: int) -> Floats:
        """Return local points (k, 3) at which the values of a polynomial determine it.

        `degree` is the total degree in the triangle and the degree in zeta.
        """
        along = np.linspace(-1.0, 1.0, degree + 1).tolist()
        return np.array([(*at, z) for at, z in product((Tri3.monomial_exponents(degree) / degree).tolist(), along)])

    @staticmethod
    def bernstein(degree: int, xi: Floats) -> Floats:
        """Return the Bernstein polynomials (m, k) of the wedge at local points xi (m, 3).

        They are products of Bernstein polynomials of total degree `degree` in the triangle and of degree `degree` in
        zeta.
        """
        n, t, L = degree, 0.5 * (1.0 + xi[:, 2]), Tri3.shape(xi[:, :2])
        powers = [(n - i - j, i, j) for i, j in Tri3.monomial_exponents(n).astype(int).tolist()]
        flat = [factorial(n) / np.prod([factorial(k) for k in p]) * np.prod(L ** np.array(p), axis=1) for p in powers]
        along = [comb(n, i) * t**i * (1.0 - t) ** (n - i) for i in range(n + 1)]
        return np.stack([a * b for a, b in product(flat, along)], axis=1)

    @staticmethod
    def child_lattices(degree: int) -> list[Floats]:
        """Return the lattice points (k, 3) of this degree in each of the eight wedges into which the cell is split."""
        at = Wedge.lattice(degree)
        L, t = Tri3.shape(at[:, :2]), 0.5 * (1.0 + at[:, 2:])
        return [np.concatenate([L * (1.0 - t), L * t], axis=1) @ part for part in Wedge.child_corners()]


def wedge_rule(flat: tuple[Floats, Floats], many: int) -> tuple[Floats, Floats]:
    """Return points (q, 3) and weights (q,) of the product of a triangle rule and a Gauss rule along zeta.

    `flat` holds the points and weights of the triangle rule; `many` is the number of Gauss points along zeta.
    """
    z, v = np.polynomial.legendre.leggauss(many)
    xi = np.array([(*at, h) for at, h in product(flat[0].tolist(), z.tolist())])
    return xi, np.outer(flat[1], v).ravel()
