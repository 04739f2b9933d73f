"""Six-node wedge, linear in the triangle and along zeta. Three-node plane triangles are slices of it."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from softmark.solvers.elements.boundary_facets import Quad4, Tri3
from softmark.solvers.elements.reference_wedge import Wedge, wedge_rule

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from softmark.solvers.elements.element import Facet, Rows

    Floats = NDArray[np.float64]
else:
    from softmark.solvers.runtime.lazy_modules import np


class Wedge6(Wedge):
    """Six-node wedge with linear displacement; three-node plane triangles are slices of it.

    Shape functions are N = L_a (1 +- zeta)/2 with the barycentric coordinates L_a of the triangle. Integration uses one
    point in the triangle times two Gauss points along zeta.
    Source: Zienkiewicz, Taylor and Zhu (2013), section 6.
    """

    name: ClassVar[str] = "wedge6"
    described: ClassVar[str] = "six-node wedges"
    briefly: ClassVar[str] = "linear wedges"
    meshio: ClassVar[str] = "wedge"
    nodes: ClassVar[int] = 6
    order: ClassVar[int] = 1
    constant: ClassVar[bool] = False
    locks: ClassVar[float] = 0.45
    finer: ClassVar[str] = "wedge15"
    leaves: ClassVar[float] = 2.0
    most: ClassVar[float] = 8e6
    pressures: ClassVar[str | None] = None
    formulations: ClassVar[tuple[str, ...]] = ("displacement",)
    integrations: ClassVar[tuple[str, ...]] = ("full",)
    springs: ClassVar[bool] = False
    between: ClassVar[Rows] = ()
    mirrored_nodes: ClassVar[tuple[int, ...]] = Wedge.mirror
    facets: ClassVar[Rows] = Wedge.sides
    facet: ClassVar[type[Facet]] = Quad4
    monomials: ClassVar[Rows] = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1))
    warp: ClassVar[int] = 2

    @staticmethod
    def places() -> Floats:
        """Return the local points of the nodes, shape (6, 3)."""
        return Wedge.rim()

    @staticmethod
    def quadrature() -> tuple[Floats, Floats]:
        """Return points (2, 3) and weights (2,) on the wedge, whose volume is 1."""
        return wedge_rule(Tri3.quadrature(), 2)

    @staticmethod
    def shape(xi: Floats) -> Floats:
        """Return the shape functions N (m, 6) at local points xi (m, 3)."""
        L, t = Tri3.shape(xi[:, :2]), 0.5 * (1.0 + xi[:, 2:])
        return np.concatenate([L * (1.0 - t), L * t], axis=1)

    @staticmethod
    def gradient(xi: Floats) -> Floats:
        """Return dN/dxi (m, 6, 3) at local points xi (m, 3)."""
        L, dL, t = Tri3.shape(xi[:, :2]), Tri3.gradient(xi[:, :2]), 0.5 * (1.0 + xi[:, 2:, None])
        flat = np.concatenate([dL * (1.0 - t), dL * t], axis=1)
        return np.concatenate([flat, np.concatenate([-0.5 * L, 0.5 * L], axis=1)[:, :, None]], axis=2)
