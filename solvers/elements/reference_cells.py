"""Reference tetrahedron and hexahedron: geometry and polynomials shared by all elements on these cells."""

from __future__ import annotations

from functools import cache
from itertools import product
from math import comb, factorial
from typing import TYPE_CHECKING, Any, ClassVar

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from softmark.solvers.elements.element import Facet, Rows

    Floats = NDArray[np.float64]
    Ints = NDArray[np.int64]
else:
    from softmark.solvers.runtime.lazy_modules import np


def mirrored_order(corners: tuple[int, ...], between: Rows) -> tuple[int, ...]:
    """Return the node order that turns an inverted cell into a valid one.

    `corners` is the new order of the corners. `between` lists, for each other node, the corners whose mean is its
    position; these nodes are reordered accordingly.
    """
    number = {frozenset(ends): len(corners) + k for k, ends in enumerate(between)}
    return (*corners, *(number[frozenset(corners[c] for c in ends)] for ends in between))


def facet_nodes(sides: Rows, corners: int, between: Rows, facet: type[Facet]) -> Rows:
    """Return the nodes of each facet of a cell, in the order of the facet's class.

    `sides` lists the corners of each facet, `corners` is the number of corners of the cell, and `between` lists for
    each further node the corners whose mean is its position. A midside node between two equal corners is the corner
    itself.
    """
    number = {frozenset((k,)): k for k in range(corners)}
    number |= {frozenset(ends): corners + k for k, ends in enumerate(between)}
    return tuple((*side, *(number[frozenset(side[c] for c in ends)] for ends in facet.between)) for side in sides)


class Tetrahedron:
    """The unit tetrahedron, with corners at the origin and at (1, 0, 0), (0, 1, 0), (0, 0, 1)."""

    family: ClassVar[str] = "tetrahedra"
    dimension: ClassVar[int] = 3
    corners: ClassVar[int] = 4
    linear: ClassVar[str] = "tet4"
    centre: ClassVar[tuple[float, float, float]] = (0.25, 0.25, 0.25)
    inner: ClassVar[tuple[float, float, float]] = (0.25, 0.25, 0.25)
    volume: ClassVar[float] = 1 / 6
    edges: ClassVar[Rows] = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))
    diagonals: ClassVar[tuple[Rows, Rows]] = ((), ())
    sides: ClassVar[Rows] = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))
    mirror: ClassVar[tuple[int, ...]] = (0, 1, 3, 2)
    tetrahedra: ClassVar[Rows] = ((0, 1, 2, 3),)
    # The five tetrahedra of a hexahedron whose corner 0 is even: four at the odd corners 1, 3, 4, 6, and one in the
    # middle between the even corners 0, 2, 5, 7.
    split: ClassVar[tuple[Rows, Rows]] = (
        ((1, 2, 0, 5), (3, 0, 2, 7), (4, 5, 7, 0), (6, 7, 5, 2), (0, 2, 7, 5)),
        ((0, 1, 3, 4), (2, 3, 1, 6), (5, 4, 6, 1), (7, 6, 4, 3), (1, 3, 4, 6)),
    )
    warps: ClassVar[bool] = False
    finer: ClassVar[str] = ""

    @staticmethod
    def rim() -> Floats:
        """Return the local points of the corners, shape (4, 3)."""
        return np.concatenate([np.zeros((1, 3)), np.eye(3)])

    @staticmethod
    def clip(xi: Floats) -> Floats:
        """Return local points (m, 3) moved into the tetrahedron.

        Negative barycentric coordinates are set to zero, and the others are scaled so that their sum is one.
        """
        N = np.maximum(np.concatenate([1.0 - xi.sum(axis=1, keepdims=True), xi], axis=1), 0.0)
        inside: Floats = N[:, 1:] / N.sum(axis=1, keepdims=True)
        return inside

    @staticmethod
    def random_points(rng: np.random.Generator, count: int) -> Floats:
        """Return uniformly distributed random local points (count, 3)."""
        return rng.dirichlet(np.ones(4), size=count)[:, 1:]

    @staticmethod
    def child_corners() -> Floats:
        """Return the local corners (8, 4, 3) of the eight tetrahedra into which the cell is split.

        One of them lies at each corner. The other four fill the remaining octahedron around its diagonal between the
        middles of the edges 02 and 13.
        Source: Bey (1995).
        """
        rim = Tetrahedron.rim()
        nodes = np.concatenate([rim, rim[np.array(Tetrahedron.edges)].mean(axis=1)])
        near = [[4 + e for e, ends in enumerate(Tetrahedron.edges) if corner in ends] for corner in range(4)]
        inner = [(4, 6, 7, 8), (4, 5, 6, 8), (6, 7, 8, 9), (5, 6, 8, 9)]
        found = np.array([nodes[list(four)] for four in (*((i, *near[i]) for i in range(4)), *inner)])
        out = np.linalg.det(found[:, 1:] - found[:, :1]) < 0
        found[out] = found[out][:, [0, 2, 1, 3]]
        return found

    @staticmethod
    def mean_ratio_quality(corners: Floats) -> Floats:
        """Return the mean-ratio quality (m,) of tetrahedra with corners (m, 4, 3).

        It is 12 (3 V)^(2/3) over the sum of squared edge lengths, with the sign of the volume V.
        Source: Liu and Joe (1994).
        """
        i, j = np.triu_indices(4, 1)
        squares = np.sum((corners[:, i] - corners[:, j]) ** 2, axis=(1, 2))
        volume = determinants(corners[:, 1:] - corners[:, :1]) / 6.0
        signed: Floats = 12.0 * np.cbrt(3.0 * volume) * np.abs(np.cbrt(3.0 * volume)) / squares
        return signed

    @staticmethod
    def mass_quadrature() -> tuple[Floats, Floats]:
        """Return points (q, 3) and weights (q,) that integrate products of quadratic shape functions.

        The stiffness needs fewer points. With the single point of the linear tetrahedron the mass matrix would be
        singular.
        """
        return conical_product_rule(3)

    # -------------------------------------------------------------- polynomials by Bernstein's basis

    @staticmethod
    @cache
    def powers(degree: int) -> Ints:
        """Return the exponents (k, 4) of all monomials of a total `degree` in the four barycentric coordinates."""
        return np.array([p for p in product(range(degree + 1), repeat=4) if sum(p) == degree])

    @staticmethod
    def lattice(degree: int) -> Floats:
        """Return local points (k, 3) at which the values of a polynomial of this total degree determine it."""
        found: Floats = Tetrahedron.powers(degree)[:, 1:] / degree
        return found

    @staticmethod
    def bernstein(degree: int, xi: Floats) -> Floats:
        """Return the Bernstein polynomials (m, k) of a total degree at local points xi (m, 3)."""
        powers = Tetrahedron.powers(degree)
        many = np.array([factorial(degree) / np.prod([factorial(i) for i in p]) for p in powers])
        L = np.column_stack([1.0 - xi.sum(axis=1), xi])
        found: Floats = many * np.prod(L[:, None, :] ** powers, axis=2)
        return found

    @staticmethod
    def child_lattices(degree: int) -> list[Floats]:
        """Return the lattice points (k, 3) of this degree in each of the eight parts of the tetrahedron.

        Corners of the parts are the corners and the edge middles of the tetrahedron.
        """
        v = Tetrahedron.rim()
        m = {(a, b): 0.5 * (v[a] + v[b]) for a in range(4) for b in range(a + 1, 4)}
        inner = [(m[0, 1], m[2, 3], m[0, 2], m[1, 2]), (m[0, 1], m[2, 3], m[1, 2], m[1, 3]),
                 (m[0, 1], m[2, 3], m[1, 3], m[0, 3]), (m[0, 1], m[2, 3], m[0, 3], m[0, 2])]  # fmt: skip
        outer = [tuple(v[a] if a == b else m[min(a, b), max(a, b)] for b in range(4)) for a in range(4)]
        L = Tetrahedron.powers(degree) / degree
        return [L @ np.array(four) for four in (*outer, *inner)]


class Hexahedron:
    """The reference cube [-1, 1]^3 of hexahedra."""

    family: ClassVar[str] = "hexahedra"
    dimension: ClassVar[int] = 3
    corners: ClassVar[int] = 8
    linear: ClassVar[str] = "hex8"
    centre: ClassVar[tuple[float, float, float]] = (0.0, 0.0, 0.0)
    # not the centre: it lies on the body diagonal, an edge of all six tetrahedra of a coinciding cell in any numbering
    inner: ClassVar[tuple[float, float, float]] = (0.22, 0.14, 0.06)
    volume: ClassVar[float] = 8.0
    edges: ClassVar[Rows] = (
        *((0, 1), (1, 2), (2, 3), (3, 0)),
        *((4, 5), (5, 6), (6, 7), (7, 4)),
        *((0, 4), (1, 5), (2, 6), (3, 7)),
    )
    diagonals: ClassVar[tuple[Rows, Rows]] = (
        (
            *((0, 2), (1, 3), (4, 6), (5, 7)),
            *((0, 5), (1, 4), (1, 6), (2, 5)),
            *((2, 7), (3, 6), (3, 4), (0, 7)),
        ),
        ((0, 6), (1, 7), (2, 4), (3, 5)),
    )
    sides: ClassVar[Rows] = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
    mirror: ClassVar[tuple[int, ...]] = (4, 5, 6, 7, 0, 1, 2, 3)
    tetrahedra: ClassVar[Rows] = (
        (0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6),
    )  # fmt: skip
    split: ClassVar[tuple[Rows, Rows]] = (((0, 1, 2, 3, 4, 5, 6, 7),), ((0, 1, 2, 3, 4, 5, 6, 7),))
    warps: ClassVar[bool] = True
    finer: ClassVar[str] = ""

    @staticmethod
    def rim() -> Floats:
        """Return the local points of the corners, shape (8, 3)."""
        low = [(-1.0, -1.0, -1.0), (1.0, -1.0, -1.0), (1.0, 1.0, -1.0), (-1.0, 1.0, -1.0)]
        return np.array([*low, *((x, y, 1.0) for x, y, _ in low)])

    @staticmethod
    def clip(xi: Floats) -> Floats:
        """Return local points (m, 3) with each coordinate clipped to [-1, 1]."""
        return np.clip(xi, -1.0, 1.0)

    @staticmethod
    def random_points(rng: np.random.Generator, count: int) -> Floats:
        """Return uniformly distributed random local points (count, 3)."""
        return rng.uniform(-1.0, 1.0, size=(count, 3))

    @staticmethod
    def child_corners() -> Floats:
        """Return the local corners (8, 8, 3) of the eight cubes into which the cell is split."""
        corners = Hexahedron.rim()
        found: Floats = 0.5 * corners[:, None] + 0.5 * corners
        return found

    @staticmethod
    def mean_ratio_quality(corners: Floats) -> Floats:
        """Return the mean-ratio quality (m,) of hexahedra with corners (m, 8, 3).

        It is the least of 3 det(J)^(2/3) / |J|^2 over the corners, with the sign of det(J), where the rows of J are the
        three edges at a corner.
        Source: Knupp (2001).
        """
        others = np.array([[1, 3, 4], [2, 0, 5], [3, 1, 6], [0, 2, 7], [7, 5, 0], [4, 6, 1], [5, 7, 2], [6, 4, 3]])
        J = corners[:, others] - corners[:, :, None]  # (m, 8, 3, 3), right-handed
        root = np.cbrt(determinants(J))
        found: Floats = (3.0 * root * np.abs(root) / np.sum(J**2, axis=(-2, -1))).min(axis=1)
        return found

    # -------------------------------------------------------------- polynomials by Bernstein's basis

    @staticmethod
    def lattice(degree: int) -> Floats:
        """Return local points (k, 3) at which the values of a polynomial determine it.

        `degree` is the degree in each coordinate.
        """
        return np.array(list(product(np.linspace(-1.0, 1.0, degree + 1).tolist(), repeat=3)))

    @staticmethod
    def bernstein(degree: int, xi: Floats) -> Floats:
        """Return the Bernstein polynomials (m, k) of a degree in each coordinate at local points xi (m, 3)."""
        t = 0.5 * (1.0 + xi)  # (m, 3)
        n = degree
        one = np.stack([comb(n, i) * t**i * (1.0 - t) ** (n - i) for i in range(n + 1)])  # (n + 1, m, 3)
        found: Floats = np.einsum("im,jm,km->mijk", one[:, :, 0], one[:, :, 1], one[:, :, 2]).reshape(len(xi), -1)
        return found

    @staticmethod
    def child_lattices(degree: int) -> list[Floats]:
        """Return the lattice points (k, 3) of this degree in each of the eight cubes into which the cell is split."""
        at = Hexahedron.lattice(degree)
        return [0.5 * (at + np.array(corner)) for corner in product((-1.0, 1.0), repeat=3)]


def conical_product_rule(n: int) -> tuple[Floats, Floats]:
    """Return n^3 points (q, 3) on the unit tetrahedron and weights (q,), exact to degree 2n - 1.

    The points are Gauss-Jacobi points along the three coordinates of a cube that is collapsed to the tetrahedron.
    Source: Stroud (1971).
    """
    from softmark.solvers.runtime.gauss_jacobi import gauss_jacobi

    rules = [gauss_jacobi(n, power) for power in (2, 1, 0)]
    (a, wa), (b, wb), (c, wc) = (((1 + s) / 2, w / 2 ** (3 - i)) for i, (s, w) in enumerate(rules))
    a, b, c = (t.ravel() for t in np.meshgrid(a, b, c, indexing="ij"))
    xi = np.stack([a, (1 - a) * b, (1 - a) * (1 - b) * c], axis=1)
    return xi, np.einsum("i,j,k->ijk", wa, wb, wc).ravel()


def determinants(J: Any) -> Floats:
    """Return the determinants (...) of matrices J (..., 3, 3) as triple products of their rows.

    Small determinants are accurate to the last digit, which they are not by LU factorisation.
    """
    det: Floats = np.einsum("...i,...i->...", np.cross(J[..., 0, :], J[..., 1, :]), J[..., 2, :])
    return det
