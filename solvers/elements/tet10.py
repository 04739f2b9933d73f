"""Ten-node tetrahedron: quadratic shape functions, four integration points."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from softmark.solvers.elements.boundary_facets import Tri6
from softmark.solvers.elements.reference_cells import Tetrahedron, facet_nodes, mirrored_order
from softmark.solvers.elements.tet4 import Tet4

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from softmark.solvers.elements.element import Facet, Rows

    Floats = NDArray[np.float64]
else:
    from softmark.solvers.runtime.lazy_modules import np

EDGES = Tetrahedron.edges  # corners of the nodes 4 to 9


class Tet10(Tetrahedron):
    """Ten-node tetrahedron, quadratic displacement: accurate in bending, follows curved surfaces, locks only mildly.

    Shape functions are L_a (2 L_a - 1) at corners and 4 L_a L_b at the mid-edge nodes of the edges 01, 12, 02, 03, 13,
    23, with L the barycentric coordinates. Four integration points of degree two (Hammer, Marlowe and Stroud 1956).
    Displacements converge with h^3 and strains with h^2. The mid-edge nodes on the side of a cylinder lie on the true
    surface. Near incompressibility pressures oscillate, while displacements stay accurate: at a Poisson ratio of 0.499
    refine and compare. The cost is about eight times that of `tet4`.
    Source: Zienkiewicz, Taylor and Zhu (2013), section 6.
    """

    name: ClassVar[str] = "tet10"
    described: ClassVar[str] = "ten-node tetrahedra"
    briefly: ClassVar[str] = "tet10"
    meshio: ClassVar[str] = "tetra10"
    nodes: ClassVar[int] = 10
    order: ClassVar[int] = 2
    constant: ClassVar[bool] = False
    locks: ClassVar[float] = 0.4995
    leaves: ClassVar[float] = 2.25
    most: ClassVar[float] = 4e6
    pressures: ClassVar[str | None] = "corners"
    formulations: ClassVar[tuple[str, ...]] = ("displacement", "mixed")
    integrations: ClassVar[tuple[str, ...]] = ("full",)
    springs: ClassVar[bool] = False
    between: ClassVar[Rows] = EDGES
    mirrored_nodes: ClassVar[tuple[int, ...]] = mirrored_order(Tetrahedron.mirror, EDGES)
    facets: ClassVar[Rows] = facet_nodes(Tetrahedron.sides, 4, EDGES, Tri6)
    facet: ClassVar[type[Facet]] = Tri6
    monomials: ClassVar[Rows] = (
        *Tet4.monomials, (2, 0, 0), (0, 2, 0), (0, 0, 2), (1, 1, 0), (0, 1, 1), (1, 0, 1),
    )  # fmt: skip
    warp: ClassVar[int] = 3

    @staticmethod
    def places() -> Floats:
        """Return the local points of the nodes, shape (10, 3)."""
        corners = Tet4.places()
        return np.concatenate([corners, corners[np.array(EDGES)].mean(axis=1)])

    @staticmethod
    def quadrature() -> tuple[Floats, Floats]:
        """Return points (4, 3) and weights (4,) on the unit tetrahedron, whose volume is 1/6."""
        a = (5 - 5**0.5) / 20
        return a + (1 - 4 * a) * Tet4.places(), np.full(4, 1 / 24)

    @staticmethod
    def shape(xi: Floats) -> Floats:
        """Return the shape functions N (m, 10) at local points xi (m, 3)."""
        L = Tet4.shape(xi)
        a, b = np.array(EDGES).T
        return np.concatenate([L * (2 * L - 1), 4 * L[:, a] * L[:, b]], axis=1)

    @staticmethod
    def gradient(xi: Floats) -> Floats:
        """Return dN/dxi (m, 10, 3) at local points xi (m, 3)."""
        L, dL = Tet4.shape(xi)[:, :, None], Tet4.gradient(xi)
        a, b = np.array(EDGES).T
        return np.concatenate([(4 * L - 1) * dL, 4 * (L[:, a] * dL[:, b] + L[:, b] * dL[:, a])], axis=1)
