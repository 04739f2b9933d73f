"""Interfaces of an element and of a boundary facet.

An element's class derives from its reference cell (reference_cells.py), a facet's class from its triangle or square
(boundary_facets.py), which provide what follows from the shape only.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Protocol

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

Rows = tuple[tuple[int, ...], ...]  # of numbers of nodes, or of exponents


class Facet(Protocol):
    """A boundary facet: a surface patch x(xi), xi in a reference triangle or square."""

    nodes: ClassVar[int]
    between: ClassVar[Rows]  # of each node after the corners, the corners that it lies in the middle of
    triangles: ClassVar[tuple[tuple[int, int, int], ...]]  # over its nodes, turning as the facet does
    pressed: ClassVar[int]  # degree of shape functions times area vector: in all on triangles, in each on squares
    bend: ClassVar[int]  # degree of x over any triangle of local coordinates, at least two
    monomials: ClassVar[Rows]  # exponents of xi, eta that its shape functions are made of

    # ---- of its triangle or square
    corners: ClassVar[int]  # the first nodes
    square: ClassVar[bool]
    rim: ClassVar[tuple[tuple[float, float], ...]]  # local points of the corners
    centre: ClassVar[tuple[float, float]]
    halves: ClassVar[tuple[tuple[int, int, int], ...]]  # triangles over its corners

    @staticmethod
    def quadrature() -> tuple[Floats, Floats]:
        """Return points (q, 2) and weights (q,) that integrate a pressure on the facet as it deforms."""

    @staticmethod
    def shape(xi: Floats) -> Floats:
        """Return the shape functions N (m, k) at local points xi (m, 2)."""

    @staticmethod
    def gradient(xi: Floats) -> Floats:
        """Return dN/dxi (m, k, 2) at local points xi (m, 2)."""

    @staticmethod
    def powers(degree: int) -> Floats:
        """Return the exponents (k, 2) of the monomials of a degree."""

    @staticmethod
    def lattice(steps: int) -> Floats:
        """Return local points (k, 2) at `steps` equal steps along each side."""

    @staticmethod
    def folded(a: Floats, b: Floats, w: Floats) -> tuple[Floats, Floats]:
        """Return points (q, 2) and weights (q,) of a rule a, b, w (q,) of the square [-1, 1]^2, mapped to the facet."""


class Element(Protocol):
    """A solid element on a reference cell; its nodes are in the order of VTK and meshio."""

    name: ClassVar[str]  # the word in scenes
    described: ClassVar[str]  # in a sentence: `it has four-node tetrahedra`
    briefly: ClassVar[str]  # at the start of one: `linear tetrahedra lock`
    meshio: ClassVar[str]  # meshio's word, by which files are read and written
    nodes: ClassVar[int]
    between: ClassVar[Rows]  # of each node after the corners, the corners that it lies in the middle of
    turned: ClassVar[tuple[int, ...]]  # nodes of a cell that is inside out in an order that is not
    facets: ClassVar[Rows]  # nodes of each, counter-clockwise from outside
    facet: ClassVar[type[Facet]]
    monomials: ClassVar[Rows]  # exponents of xi, eta, zeta that its shape functions are made of
    order: ClassVar[int]  # of the complete polynomials in its shape functions
    warp: ClassVar[int]  # degree of det dX/dxi, in all on tetrahedra, in each coordinate on hexahedra
    constant: ClassVar[bool]  # whether strain is uniform in a cell
    locks: ClassVar[float]  # Poisson's ratio from which it is visibly too stiff; 0.5 where it never is
    most: ClassVar[float]  # cells that fit in memory
    pressures: ClassVar[str | None]  # that go with it: linear between `corners`, one in each `cell`
    formulations: ClassVar[tuple[str, ...]]  # of models/fem that it is known to work in
    integrations: ClassVar[tuple[str, ...]]  # at all points in `full`, of the volume once per cell in `selective`
    springs: ClassVar[bool]  # whether its edges and diagonals make a network
    finer: ClassVar[str]  # the element of its finer space: another on the same cells, or itself on eight for each
    leaves: ClassVar[float]  # error over the distance of the finer space: as of an order of 0.85 or more

    # ---- of its reference cell
    family: ClassVar[str]  # tetrahedra | hexahedra
    dimension: ClassVar[int]
    corners: ClassVar[int]  # the first nodes
    linear: ClassVar[str]  # element of the corners only
    centre: ClassVar[tuple[float, float, float]]
    inner: ClassVar[tuple[float, float, float]]  # a point within, on no face of `tetrahedra`
    volume: ClassVar[float]  # of the reference cell
    edges: ClassVar[Rows]
    diagonals: ClassVar[tuple[Rows, Rows]]  # of faces, and of the body
    tetrahedra: ClassVar[Rows]  # that fill it, by its corners
    split: ClassVar[tuple[Rows, Rows]]  # cells made of a hexahedron in a grid whose corner 0 is even, or odd
    warps: ClassVar[bool]  # whether it may fold within though no corner does, with straight edges

    @staticmethod
    def places() -> Floats:
        """Return the local points of the nodes (a, 3)."""

    @staticmethod
    def quadrature() -> tuple[Floats, Floats]:
        """Return points (q, 3) and weights (q,) for the stiffness."""

    @staticmethod
    def mass_quadrature() -> tuple[Floats, Floats]:
        """Return points (q, 3) and weights (q,) for the mass, which integrate products of shape functions."""

    @staticmethod
    def shape(xi: Floats) -> Floats:
        """Return the shape functions N (m, a) at local points xi (m, 3)."""

    @staticmethod
    def gradient(xi: Floats) -> Floats:
        """Return dN/dxi (m, a, 3) at local points xi (m, 3)."""

    # ---- of its reference cell

    @staticmethod
    def clip(xi: Floats) -> Floats:
        """Return local points (m, 3), moved into the reference cell if they lie outside."""

    @staticmethod
    def strewn(rng: np.random.Generator, count: int) -> Floats:
        """Return uniformly distributed random local points (count, 3)."""

    @staticmethod
    def children() -> Floats:
        """Return the corners of the eight parts of the cell (8, c, 3)."""

    @staticmethod
    def ratio(corners: Floats) -> Floats:
        """Return the mean ratio (m,) of cells with corners (m, c, 3): 1 at best, negative for an inverted cell."""

    @staticmethod
    def lattice(degree: int) -> Floats:
        """Return local points (k, 3) that determine a polynomial of a degree."""

    @staticmethod
    def bernstein(degree: int, xi: Floats) -> Floats:
        """Return the Bernstein polynomials (m, k) of a degree at local points xi (m, 3)."""

    @staticmethod
    def eighths(degree: int) -> list[Floats]:
        """Return the lattices (k, 3) of eight parts of the cell."""
