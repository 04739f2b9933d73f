"""Common base class of the quadratic hexahedra with 20 and 27 nodes."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from softmark.solvers.elements import quadratic_shape_functions
from softmark.solvers.elements.reference_cells import Hexahedron

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from softmark.solvers.elements.element import Rows

    Floats = NDArray[np.float64]
else:
    from softmark.solvers.runtime.lazy_modules import np


class QuadraticHexahedron(Hexahedron):
    """Quadratic hexahedron: nodes at corners and midway between corners, 27 Gauss points.

    In a mixed formulation, pressures are linear between the corners.
    """

    order: ClassVar[int] = 2
    constant: ClassVar[bool] = False
    leaves: ClassVar[float] = 2.25
    pressures: ClassVar[str | None] = "corners"
    formulations: ClassVar[tuple[str, ...]] = ("displacement", "mixed")
    integrations: ClassVar[tuple[str, ...]] = ("full",)
    springs: ClassVar[bool] = False
    warp: ClassVar[int] = 5
    between: ClassVar[Rows]

    @classmethod
    def places(cls) -> Floats:
        """Return the local points of the nodes, shape (a, 3)."""
        corners = Hexahedron.rim()
        return np.array([*corners, *(corners[list(ends)].mean(axis=0) for ends in cls.between)])

    @staticmethod
    def quadrature() -> tuple[Floats, Floats]:
        """Return points (27, 3) and weights (27,) on the cube [-1, 1]^3."""
        return quadratic_shape_functions.three_point_tensor_gauss_rule(3)

    @staticmethod
    def mass_quadrature() -> tuple[Floats, Floats]:
        """Return the points (27, 3) and weights (27,) of `quadrature`, exact for the mass of box-shaped cells."""
        return quadratic_shape_functions.three_point_tensor_gauss_rule(3)
