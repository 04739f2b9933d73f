"""Interfaces of an element and of a boundary facet.

The class of an element derives from its reference cell (reference_cells.py, reference_wedge.py). The class of a facet
derives from its reference triangle or square (boundary_facets.py). These base classes provide everything that depends
only on the geometry.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Protocol

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

Rows = tuple[tuple[int, ...], ...]  # each row lists node numbers, or exponents


class Facet(Protocol):
    """Interface of a boundary facet: a surface patch x(xi), with xi in a reference triangle or square."""

    nodes: ClassVar[int]
    between: ClassVar[Rows]  # for each node after the corners: the corners whose mean is its position
    triangles: ClassVar[tuple[tuple[int, int, int], ...]]  # split into triangles over its nodes, oriented alike
    integrand_degree: ClassVar[int]  # of shape function times area vector: total on triangles, else per coordinate
    bend: ClassVar[int]  # degree of the map x(xi) in local coordinates of any triangle, at least two
    monomials: ClassVar[Rows]  # exponents of xi, eta of the monomials in its shape functions

    # ---- defined by the reference triangle or square
    corners: ClassVar[int]  # number of corners; they are the first nodes
    square: ClassVar[bool]
    rim: ClassVar[tuple[tuple[float, float], ...]]  # local points of the corners
    centre: ClassVar[tuple[float, float]]
    halves: ClassVar[tuple[tuple[int, int, int], ...]]  # split into triangles over its corners

    @staticmethod
    def quadrature() -> tuple[Floats, Floats]:
        """Return points (q, 2) and weights (q,) that are exact for a pressure on the deformed facet."""

    @staticmethod
    def shape(xi: Floats) -> Floats:
        """Return the shape functions N (m, k) at local points xi (m, 2)."""

    @staticmethod
    def gradient(xi: Floats) -> Floats:
        """Return dN/dxi (m, k, 2) at local points xi (m, 2)."""

    @staticmethod
    def monomial_exponents(degree: int) -> Floats:
        """Return the exponents (k, 2) of the monomials in xi and eta up to a degree.

        On triangles it is the total degree, on squares the degree in each coordinate.
        """

    @staticmethod
    def lattice(steps: int) -> Floats:
        """Return the points (k, 2) of a lattice on the facet with `steps` equal intervals along each side."""

    @staticmethod
    def rule_from_square(a: Floats, b: Floats, w: Floats) -> tuple[Floats, Floats]:
        """Map a quadrature rule from the square [-1, 1]^2 to the facet: return points (q, 2) and weights (q,).

        `a` and `b` (q,) are the coordinates of the rule's points on the square, `w` (q,) the weights.
        """


class Element(Protocol):
    """Interface of a solid element on a reference cell; nodes are ordered as in VTK and meshio."""

    name: ClassVar[str]  # name in scenes
    described: ClassVar[str]  # noun phrase inside a sentence: `it has four-node tetrahedra`
    briefly: ClassVar[str]  # noun phrase at the start of a sentence: `linear tetrahedra lock`
    meshio: ClassVar[str]  # meshio's cell name, for reading and writing files
    nodes: ClassVar[int]
    between: ClassVar[Rows]  # for each node after the corners: the corners whose mean is its position
    mirrored_nodes: ClassVar[tuple[int, ...]]  # node order that turns an inverted cell into a valid one
    facets: ClassVar[Rows]  # nodes of each facet, counter-clockwise from outside
    facet: ClassVar[type[Facet]]
    monomials: ClassVar[Rows]  # exponents of xi, eta, zeta of the monomials in its shape functions
    order: ClassVar[int]  # degree of the complete polynomials that its shape functions contain
    warp: ClassVar[int]  # degree of det dX/dxi: total on tetrahedra, per coordinate on hexahedra
    constant: ClassVar[bool]  # whether strain is uniform in a cell
    locks: ClassVar[float]  # Poisson's ratio from which it is visibly too stiff; 0.5 if it never locks
    most: ClassVar[float]  # largest number of cells that fits in memory
    pressures: ClassVar[str | None]  # pressures of mixed formulations: linear between `corners`, or one per `cell`
    formulations: ClassVar[tuple[str, ...]]  # formulations of models/fem that are known to work with it
    integrations: ClassVar[tuple[str, ...]]  # `full`; `selective`: volumetric terms once per cell
    springs: ClassVar[bool]  # whether its edges and diagonals can form a spring network
    finer: ClassVar[str]  # element of higher order on the same cells, for error estimates; "": itself on split cells
    leaves: ClassVar[float]  # error / distance to the finer solution, for a convergence order of at least 0.85

    # ---- defined by the reference cell
    family: ClassVar[str]  # tetrahedra | hexahedra
    dimension: ClassVar[int]
    corners: ClassVar[int]  # number of corners; they are the first nodes
    linear: ClassVar[str]  # name of the element with corner nodes only
    centre: ClassVar[tuple[float, float, float]]
    inner: ClassVar[tuple[float, float, float]]  # an interior point that lies on no face of `tetrahedra`
    volume: ClassVar[float]  # volume of the reference cell
    edges: ClassVar[Rows]
    diagonals: ClassVar[tuple[Rows, Rows]]  # face diagonals, and body diagonals
    tetrahedra: ClassVar[Rows]  # tetrahedra that fill the cell, by its corners
    split: ClassVar[tuple[Rows, Rows]]  # cells that a grid hexahedron is split into if its corner 0 is even, or odd
    warps: ClassVar[bool]  # whether a cell with straight edges may be inverted inside although no corner is

    @staticmethod
    def places() -> Floats:
        """Return the local points of the nodes, shape (a, 3)."""

    @staticmethod
    def quadrature() -> tuple[Floats, Floats]:
        """Return points (q, 3) and weights (q,) of the rule for the stiffness."""

    @staticmethod
    def mass_quadrature() -> tuple[Floats, Floats]:
        """Return points (q, 3) and weights (q,) of the rule for the mass matrix."""

    @staticmethod
    def shape(xi: Floats) -> Floats:
        """Return the shape functions N (m, a) at local points xi (m, 3)."""

    @staticmethod
    def gradient(xi: Floats) -> Floats:
        """Return dN/dxi (m, a, 3) at local points xi (m, 3)."""

    # ---- defined by the reference cell

    @staticmethod
    def clip(xi: Floats) -> Floats:
        """Return local points (m, 3) with points outside the reference cell moved to its boundary."""

    @staticmethod
    def random_points(rng: np.random.Generator, count: int) -> Floats:
        """Return random local points (count, 3), uniformly distributed in the reference cell."""

    @staticmethod
    def child_corners() -> Floats:
        """Return the local corners (8, c, 3) of the eight parts into which the reference cell is split."""

    @staticmethod
    def mean_ratio_quality(corners: Floats) -> Floats:
        """Return the mean-ratio quality (m,) of cells with corners (m, c, 3): 1 at best, negative if inverted."""

    @staticmethod
    def lattice(degree: int) -> Floats:
        """Return local points (k, 3) at which the values of a polynomial of this degree determine it."""

    @staticmethod
    def bernstein(degree: int, xi: Floats) -> Floats:
        """Return the Bernstein polynomials (m, k) of a degree at local points xi (m, 3)."""

    @staticmethod
    def child_lattices(degree: int) -> list[Floats]:
        """Return for each of the eight parts of the reference cell the points (k, 3) of a lattice of this degree."""
