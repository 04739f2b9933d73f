"""Four-node tetrahedron: linear shape functions, one integration point."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from softmark.solvers.elements.boundary_facets import Tri3
from softmark.solvers.elements.reference_cells import Tetrahedron

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from softmark.solvers.elements.element import Facet, Rows

    Floats = NDArray[np.float64]
else:
    from softmark.solvers.runtime.lazy_modules import np


class Tet4(Tetrahedron):
    """Four-node tetrahedron, linear displacement: cheap, stiff in bending, locks near incompressibility.

    N_0 = 1 - xi - eta - zeta, N_1 = xi, N_2 = eta, N_3 = zeta, one integration point (exact, since the gradient is
    constant). Displacements converge with h^2 and strains with h. At Poisson ratios of 0.45 and above it is much too
    stiff (volumetric locking).
    Source: Zienkiewicz, Taylor and Zhu (2013), section 5.
    """

    name: ClassVar[str] = "tet4"
    described: ClassVar[str] = "four-node tetrahedra"
    briefly: ClassVar[str] = "linear tetrahedra"
    meshio: ClassVar[str] = "tetra"
    nodes: ClassVar[int] = 4
    order: ClassVar[int] = 1
    constant: ClassVar[bool] = True
    locks: ClassVar[float] = 0.45
    finer: ClassVar[str] = "tet10"
    leaves: ClassVar[float] = 2.0
    most: ClassVar[float] = 2e7
    pressures: ClassVar[str | None] = None
    formulations: ClassVar[tuple[str, ...]] = ("displacement",)
    integrations: ClassVar[tuple[str, ...]] = ("full",)
    springs: ClassVar[bool] = True
    between: ClassVar[Rows] = ()
    mirrored_nodes: ClassVar[tuple[int, ...]] = Tetrahedron.mirror
    facets: ClassVar[Rows] = Tetrahedron.sides
    facet: ClassVar[type[Facet]] = Tri3
    monomials: ClassVar[Rows] = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))
    warp: ClassVar[int] = 0

    @staticmethod
    def places() -> Floats:
        """Return the local points of the nodes, shape (4, 3)."""
        return Tetrahedron.rim()

    @staticmethod
    def quadrature() -> tuple[Floats, Floats]:
        """Return one point (1, 3) and its weight (1,) on the unit tetrahedron, whose volume is 1/6."""
        return np.full((1, 3), 0.25), np.full(1, 1.0 / 6.0)

    @staticmethod
    def shape(xi: Floats) -> Floats:
        """Return the shape functions N (m, 4) at local points xi (m, 3)."""
        return np.concatenate([1.0 - xi.sum(axis=1, keepdims=True), xi], axis=1)

    @staticmethod
    def gradient(xi: Floats) -> Floats:
        """Return dN/dxi (m, 4, 3) at local points xi (m, 3)."""
        dN = np.array([[-1.0, -1.0, -1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
        return np.broadcast_to(dN, (len(xi), 4, 3))
