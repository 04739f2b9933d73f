"""Fifteen-node serendipity wedge, quadratic. Six-node plane triangles are slices of it."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from softmark.solvers.elements.boundary_facets import Quad8, Tri3, Tri6
from softmark.solvers.elements.reference_cells import facet_nodes, mirrored_order
from softmark.solvers.elements.reference_wedge import Wedge, wedge_rule

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from softmark.solvers.elements.element import Facet, Rows

    Floats = NDArray[np.float64]
else:
    from softmark.solvers.runtime.lazy_modules import np


class Wedge15(Wedge):
    """Fifteen-node wedge with quadratic displacement; six-node plane triangles are slices of it.

    With L the barycentric coordinates in the triangle and z the coordinate along the wedge, shape functions are L (2 L
    - 1) (1 +- z)/2 - L (1 - z^2)/2 at corners, 2 L L' (1 +- z) in the middles of triangle sides, and L (1 - z^2) in the
    middles of the other edges. Integration uses three points in the triangle, of degree two, times two Gauss points
    along z.
    Source: Zienkiewicz, Taylor and Zhu (2013), section 6.
    """

    name: ClassVar[str] = "wedge15"
    described: ClassVar[str] = "fifteen-node wedges"
    briefly: ClassVar[str] = "wedge15"
    meshio: ClassVar[str] = "wedge15"
    nodes: ClassVar[int] = 15
    order: ClassVar[int] = 2
    constant: ClassVar[bool] = False
    locks: ClassVar[float] = 0.4995
    leaves: ClassVar[float] = 2.25
    most: ClassVar[float] = 2e6
    pressures: ClassVar[str | None] = "corners"
    formulations: ClassVar[tuple[str, ...]] = ("displacement", "mixed")
    integrations: ClassVar[tuple[str, ...]] = ("full",)
    springs: ClassVar[bool] = False
    between: ClassVar[Rows] = Wedge.edges
    mirrored_nodes: ClassVar[tuple[int, ...]] = mirrored_order(Wedge.mirror, Wedge.edges)
    facets: ClassVar[Rows] = facet_nodes(Wedge.sides, 6, Wedge.edges, Quad8)
    facet: ClassVar[type[Facet]] = Quad8
    monomials: ClassVar[Rows] = (
        *((p, q, r) for p, q in Tri6.monomials for r in (0, 1)),
        *((p, q, 2) for p, q in Tri3.monomials),
    )
    warp: ClassVar[int] = 5

    @staticmethod
    def places() -> Floats:
        """Return the local points of the nodes, shape (15, 3)."""
        corners = Wedge.rim()
        return np.concatenate([corners, corners[np.array(Wedge.edges)].mean(axis=1)])

    @staticmethod
    def quadrature() -> tuple[Floats, Floats]:
        """Return points (6, 3) and weights (6,) on the wedge, whose volume is 1."""
        inner = 1 / 6 + 0.5 * np.array(Tri3.rim)
        return wedge_rule((inner, np.full(3, 1 / 6)), 2)

    @staticmethod
    def shape(xi: Floats) -> Floats:
        """Return the shape functions N (m, 15) at local points xi (m, 3)."""
        L, z = Tri3.shape(xi[:, :2]), xi[:, 2:]
        rest, M = 0.5 * L * (1.0 - z**2), Tri6.shape(xi[:, :2])
        below, above = 0.5 * (1.0 - z) * M, 0.5 * (1.0 + z) * M
        corners = [below[:, :3] - rest, above[:, :3] - rest]
        return np.concatenate([*corners, below[:, 3:], above[:, 3:], 2.0 * rest], axis=1)

    @staticmethod
    def gradient(xi: Floats) -> Floats:
        """Return dN/dxi (m, 15, 3) at local points xi (m, 3)."""
        L, M, z = Tri3.shape(xi[:, :2]), Tri6.shape(xi[:, :2]), xi[:, 2:]
        dL, dM, h = Tri3.gradient(xi[:, :2]), Tri6.gradient(xi[:, :2]), z[:, :, None]
        rest = np.concatenate([0.5 * dL * (1.0 - h**2), -(L * z)[:, :, None]], axis=2)
        below = np.concatenate([0.5 * (1.0 - h) * dM, -0.5 * M[:, :, None]], axis=2)
        above = np.concatenate([0.5 * (1.0 + h) * dM, 0.5 * M[:, :, None]], axis=2)
        corners = [below[:, :3] - rest, above[:, :3] - rest]
        return np.concatenate([*corners, below[:, 3:], above[:, 3:], 2.0 * rest], axis=1)
