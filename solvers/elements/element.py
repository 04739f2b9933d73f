"""What an element is, and what a facet of one is: all that is known of either, in one class.

A class of an element derives from the reference cell that it lives on (reference_cells.py), one of a facet from its
triangle or square (boundary_facets.py): they know what follows from the shape alone.
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
        """Points (q, 2) and weights (q,) that integrate a pressure on the facet as it deforms."""

    @staticmethod
    def shape(xi: Floats) -> Floats:
        """Shape functions N (m, k) at local points xi (m, 2)."""

    @staticmethod
    def gradient(xi: Floats) -> Floats:
        """dN/dxi (m, k, 2) at local points xi (m, 2)."""

    @staticmethod
    def powers(degree: int) -> Floats:
        """Exponents (k, 2) of the monomials of a degree."""

    @staticmethod
    def lattice(steps: int) -> Floats:
        """Local points (k, 2) of so many equal steps along each side."""

    @staticmethod
    def folded(a: Floats, b: Floats, w: Floats) -> tuple[Floats, Floats]:
        """Points (q, 2) and weights (q,) of a rule a, b, w (q,) of the square [-1, 1]^2."""


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
    constant: ClassVar[bool]  # whether strain is the same everywhere in a cell
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
    linear: ClassVar[str]  # the element of the corners alone
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
        """Local points of the nodes (a, 3)."""

    @staticmethod
    def quadrature() -> tuple[Floats, Floats]:
        """Points (q, 3) and weights (q,) that the stiffness needs."""

    @staticmethod
    def mass_quadrature() -> tuple[Floats, Floats]:
        """Points (q, 3) and weights (q,) that the mass needs: they integrate products of shape functions."""

    @staticmethod
    def shape(xi: Floats) -> Floats:
        """Shape functions N (m, a) at local points xi (m, 3)."""

    @staticmethod
    def gradient(xi: Floats) -> Floats:
        """dN/dxi (m, a, 3) at local points xi (m, 3)."""

    # ---- of its reference cell

    @staticmethod
    def clip(xi: Floats) -> Floats:
        """Local points (m, 3) moved into the reference cell where they lie outside."""

    @staticmethod
    def strewn(rng: np.random.Generator, count: int) -> Floats:
        """Local points at random (count, 3), evenly."""

    @staticmethod
    def children() -> Floats:
        """Corners of the eight parts of the cell (8, c, 3)."""

    @staticmethod
    def ratio(corners: Floats) -> Floats:
        """Mean ratio (m,) of cells with corners (m, c, 3): 1 for the best, negative where one is inside out."""

    @staticmethod
    def lattice(degree: int) -> Floats:
        """Local points (k, 3) that determine a polynomial of a degree."""

    @staticmethod
    def bernstein(degree: int, xi: Floats) -> Floats:
        """Bernstein's polynomials (m, k) of a degree at local points xi (m, 3)."""

    @staticmethod
    def eighths(degree: int) -> list[Floats]:
        """The lattices (k, 3) of eight parts of the cell."""
