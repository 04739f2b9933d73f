"""Geometrically exact planar rod with bending, stretch and shear, for a cantilever under its own weight."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.records import dataclass
from softmark.references.beam_centre_line import CentreLine
from softmark.references.elastica_collocation import solve_rod
from softmark.references.reference_base import Reference
from softmark.references.straight_cantilever import Cantilever, NotApplicable

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
else:
    from softmark.references.lazy_imports import np


@dataclass(frozen=True)
class SimoReissner(Reference):
    """The cantilever under its own weight, geometrically exact, with shear and axial strain.

    With t = (cos phi, sin phi) normal to the section and n = (-sin phi, cos phi) in it, the centre line obeys r' = (1 +
    Gamma1) t + Gamma2 n. The weight beyond s is a dead force w (L - s) along gravity, so N = EA Gamma1 = w (L - s)
    sin(phi), Q = kappa G A Gamma2 = w (L - s) cos(phi), and the balance of moments M' + r' x (force) = 0 with M = EI
    phi' leaves one equation for the rotation of the section,

    phi'' = -(w / EI) (L - s) cos(phi) [1 + w (L - s) (1/EA - 1/(kappa G A)) sin(phi)],
    phi(0) = 0, phi'(L) = 0.

    The shear factor kappa is Cowper's (1966). It assumes a straight uniform beam, clamped at one end and horizontal
    there, constant stiffnesses, and rigid sections: of the rod theories, the closest to a moderately thick soft solid.
    It is refused if w L (1/(kappa G A) - 1/EA) is above 1: there the shear strain is far outside the linear law, and
    the equilibrium need not be unique.
    Source: Reissner 1972, ZAMP 23:795; Simo 1985, Comput. Methods Appl. Mech. Eng. 49:55.
    """

    body: Annotated[Any, "body", "straight beam, clamped at one end, bent by gravity"]
    young: Annotated[
        float | None, "Pa in (0, inf)", "Young's modulus to use instead of the body's, for example to identify it"
    ] = None

    means: ClassVar[str] = "ordinary differential equation"
    source: ClassVar[str] = "Reissner 1972, ZAMP 23:795; Simo 1985, Comput. Methods Appl. Mech. Eng. 49:55"
    error_meaning: ClassVar[str] = (
        "numerical error of the displacement, m: the change between the last two resolutions, plus rounding"
    )

    def solve(self, cantilever: Cantilever) -> CentreLine:
        """Return the deformed centre line.

        Raises NotApplicable, and NotSolved if a relative accuracy of 1e-10 is not reached.
        """
        weight = cantilever.weight_per_length * cantilever.length  # N
        stretch, shear = weight / cantilever.axial_stiffness, weight / cantilever.shear_stiffness
        if shear - stretch > 1:
            raise NotApplicable(
                f"the shear strain at the root under the weight is {shear:.3g}, so the equilibrium may not be unique",
                "use a stiffer or lighter beam, or remove this reference",
            )
        return solve_rod(ShearDeformableRod(cantilever.load_parameter, stretch, shear), cantilever)


@dataclass(frozen=True)
class ShearDeformableRod:
    """Planar rod with bending, stretch and shear, scaled by its length."""

    k: float  # w L^3 / (EI)
    stretch: float  # w L / (EA), the axial strain of the hanging rod at its root
    shear: float  # w L / (kappa G A), the shear strain of the straight rod at its root

    def bending(self, s: Array, phi: Array) -> Array:
        """Return the scaled bending load g = k (1 - s) x' (n,)."""
        return self.k * (1 - s) * np.cos(phi) * (1 + self._strain_difference(s) * np.sin(phi))

    def bending_slope(self, s: Array, phi: Array) -> Array:
        """Return the derivative dg/dphi = k (1 - s) [-sin(phi) + (stretch - shear) (1 - s) cos(2 phi)] (n,)."""
        return self.k * (1 - s) * (-np.sin(phi) + self._strain_difference(s) * np.cos(2 * phi))

    def strain(self, s: Array, phi: Array) -> tuple[Array, Array]:
        """Return x' - 1 and y' (n,), the derivatives of the displacements along the axis and along gravity.

        x' = (1 + Gamma1) cos(phi) - Gamma2 sin(phi) and y' = (1 + Gamma1) sin(phi) + Gamma2 cos(phi), Gamma1 = stretch
        (1 - s) sin(phi), Gamma2 = shear (1 - s) cos(phi).
        """
        sin, cos = np.sin(phi), np.cos(phi)
        axial = -2 * np.sin(phi / 2) ** 2 + self._strain_difference(s) * sin * cos
        return axial, sin + (1 - s) * (self.stretch * sin**2 + self.shear * cos**2)

    def _strain_difference(self, s: Array) -> Array:
        return (self.stretch - self.shear) * (1 - s)
