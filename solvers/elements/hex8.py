"""Eight-node hexahedron: trilinear shape functions, two by two by two Gauss points."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from softmark.solvers.elements.boundary_facets import Quad4
from softmark.solvers.elements.reference_cells import Hexahedron

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from softmark.solvers.elements.element import Facet, Rows

    Floats = NDArray[np.float64]
else:
    from softmark.solvers.runtime.lazy_modules import np


class Hex8(Hexahedron):
    """Eight-node hexahedron, trilinear displacement: better than linear tetrahedra, but still stiff in bending.

    N_a = (1 + xi_a xi)(1 + eta_a eta)(1 + zeta_a zeta)/8 on [-1, 1]^3, eight Gauss points. Displacements converge with
    h^2 and strains with h. With full integration (`integration = full`) the element locks from a Poisson ratio of about
    0.45: at 0.49 the tip of a cantilever beam (the beam of 2008) sinks by 127 mm instead of 133 mm. With `integration =
    selective` the terms of the Lame modulus lambda are evaluated once per cell, from the mean deformation gradient of
    the cell, and the element does not lock (Malkus and Hughes 1978). Cells of any shape then pass the patch test
    (Flanagan and Belytschko 1981).
    Source: Zienkiewicz, Taylor and Zhu (2013), sections 6 and 10.
    """

    name: ClassVar[str] = "hex8"
    described: ClassVar[str] = "hexahedra"
    briefly: ClassVar[str] = "linear hexahedra"
    meshio: ClassVar[str] = "hexahedron"
    nodes: ClassVar[int] = 8
    order: ClassVar[int] = 1
    constant: ClassVar[bool] = False
    locks: ClassVar[float] = 0.45
    leaves: ClassVar[float] = 2.25
    most: ClassVar[float] = 4e6
    pressures: ClassVar[str | None] = "cell"
    formulations: ClassVar[tuple[str, ...]] = ("displacement", "mixed", "mean_dilatation")
    integrations: ClassVar[tuple[str, ...]] = ("full", "selective")
    springs: ClassVar[bool] = True
    between: ClassVar[Rows] = ()
    mirrored_nodes: ClassVar[tuple[int, ...]] = Hexahedron.mirror
    facets: ClassVar[Rows] = Hexahedron.sides
    facet: ClassVar[type[Facet]] = Quad4
    monomials: ClassVar[Rows] = (
        (0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (0, 1, 1), (1, 0, 1), (1, 1, 1),
    )  # fmt: skip
    warp: ClassVar[int] = 2

    @staticmethod
    def places() -> Floats:
        """Return the local points of the nodes, shape (8, 3)."""
        return Hexahedron.rim()

    @staticmethod
    def quadrature() -> tuple[Floats, Floats]:
        """Return points (8, 3) and weights (8,) on the cube [-1, 1]^3."""
        return Hex8.places() / 3**0.5, np.ones(8)

    @staticmethod
    def mass_quadrature() -> tuple[Floats, Floats]:
        """Return the points (8, 3) and weights (8,) of `quadrature`, which are also exact for the mass."""
        return Hex8.quadrature()

    @staticmethod
    def shape(xi: Floats) -> Floats:
        """Return the shape functions N (m, 8) at local points xi (m, 3)."""
        factors = 1 + xi[:, None, :] * Hex8.places()  # (m, 8, 3)
        N: Floats = factors.prod(axis=2) / 8
        return N

    @staticmethod
    def gradient(xi: Floats) -> Floats:
        """Return dN/dxi (m, 8, 3) at local points xi (m, 3)."""
        corners = Hex8.places()
        x, y, z = np.moveaxis(1 + xi[:, None, :] * corners, 2, 0)  # (m, 8) each
        return np.stack([y * z, z * x, x * y], axis=2) * corners / 8
