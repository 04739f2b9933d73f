"""The eight-node hexahedron: trilinear shape functions, two by two by two Gauss points."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from softmark.solvers.elements.facets import Quad4

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from softmark.solvers.elements.element import Facet

    Floats = NDArray[np.float64]
else:
    from softmark.solvers.base.deferred import np


class Hex8:
    """Eight-node hexahedron, trilinear displacement: better than linear tetrahedra, stiff in bending all the same.

    N_a = (1 + xi_a xi)(1 + eta_a eta)(1 + zeta_a zeta)/8 on [-1, 1]^3, eight Gauss points. Displacements
    converge with h^2 and strains with h. With all eight points for everything (`integration = full`) it locks from a
    Poisson ratio of about 0.45: the beam of 2008 at 0.49 sinks 127 mm where 133 mm are right. With `integration =
    selective`, what belongs to the modulus lambda is taken at the centre of the cell only, and it does not lock (Malkus
    and Hughes 1978). Source: Zienkiewicz, Taylor and Zhu (2013), sections 6 and 10.
    """

    nodes: ClassVar[int] = 8
    corners: ClassVar[int] = 8
    order: ClassVar[int] = 1
    dimension: ClassVar[int] = 3
    family: ClassVar[str] = "hexahedra"
    locks: ClassVar[float] = 0.45
    centre: ClassVar[tuple[float, float, float]] = (0.0, 0.0, 0.0)
    volume: ClassVar[float] = 8.0
    facets: ClassVar[tuple[tuple[int, ...], ...]] = (
        (0, 3, 2, 1),
        (4, 5, 6, 7),
        (0, 1, 5, 4),
        (1, 2, 6, 5),
        (2, 3, 7, 6),
        (3, 0, 4, 7),
    )
    facet: ClassVar[type[Facet]] = Quad4

    @staticmethod
    def places() -> Floats:
        """Local points of the nodes (8, 3)."""
        low = [(-1.0, -1.0, -1.0), (1.0, -1.0, -1.0), (1.0, 1.0, -1.0), (-1.0, 1.0, -1.0)]
        return np.array([*low, *((x, y, 1.0) for x, y, _ in low)])

    @staticmethod
    def quadrature() -> tuple[Floats, Floats]:
        """Points (8, 3) and weights (8,) on the cube [-1, 1]^3."""
        return Hex8.places() / 3**0.5, np.ones(8)

    @staticmethod
    def shape(xi: Floats) -> Floats:
        """Shape functions N (m, 8) at local points xi (m, 3)."""
        factors = 1 + xi[:, None, :] * Hex8.places()  # (m, 8, 3)
        N: Floats = factors.prod(axis=2) / 8
        return N

    @staticmethod
    def gradient(xi: Floats) -> Floats:
        """dN/dxi (m, 8, 3) at local points xi (m, 3)."""
        corners = Hex8.places()
        x, y, z = np.moveaxis(1 + xi[:, None, :] * corners, 2, 0)  # (m, 8) each
        return np.stack([y * z, z * x, x * y], axis=2) * corners / 8

    @staticmethod
    def clip(xi: Floats) -> Floats:
        """Each coordinate within [-1, 1]."""
        return np.clip(xi, -1.0, 1.0)
