"""What an element is, and what a facet of one is: reference cells with shape functions and quadrature."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Protocol

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]


class Facet(Protocol):
    """A boundary facet: a surface patch x(xi), xi in a reference triangle or square."""

    nodes: ClassVar[int]
    corners: ClassVar[int]
    triangles: ClassVar[tuple[tuple[int, int, int], ...]]  # over its nodes, turning as the facet does

    @staticmethod
    def quadrature() -> tuple[Floats, Floats]:
        """Points (q, 2) and weights (q,) that integrate a pressure on the facet as it deforms."""

    @staticmethod
    def shape(xi: Floats) -> Floats:
        """Shape functions N (m, k) at local points xi (m, 2)."""

    @staticmethod
    def gradient(xi: Floats) -> Floats:
        """dN/dxi (m, k, 2) at local points xi (m, 2)."""


class Element(Protocol):
    """A solid element on a reference cell; its nodes are in the order of VTK and meshio."""

    nodes: ClassVar[int]
    corners: ClassVar[int]  # the first nodes
    order: ClassVar[int]  # of the complete polynomials in its shape functions
    dimension: ClassVar[int]
    family: ClassVar[str]  # for reports: tetrahedra | hexahedra
    locks: ClassVar[float]  # Poisson's ratio from which it is visibly too stiff; 0.5 where it never is
    centre: ClassVar[tuple[float, float, float]]  # of the reference cell
    volume: ClassVar[float]  # of the reference cell
    facets: ClassVar[tuple[tuple[int, ...], ...]]  # nodes of each, counter-clockwise from outside
    facet: ClassVar[type[Facet]]

    @staticmethod
    def places() -> Floats:
        """Local points of the nodes (a, 3)."""

    @staticmethod
    def quadrature() -> tuple[Floats, Floats]:
        """Points (q, 3) and weights (q,) that the stiffness needs."""

    @staticmethod
    def shape(xi: Floats) -> Floats:
        """Shape functions N (m, a) at local points xi (m, 3)."""

    @staticmethod
    def gradient(xi: Floats) -> Floats:
        """dN/dxi (m, a, 3) at local points xi (m, 3)."""

    @staticmethod
    def clip(xi: Floats) -> Floats:
        """Local points (m, 3) moved into the reference cell where they lie outside."""
