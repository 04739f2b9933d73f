"""Yeoh material."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from softmark.records import dataclass
from softmark.solvers.materials.isochoric_invariants import IsochoricInvariantMaterial, Number

if TYPE_CHECKING:
    from softmark.solvers.materials.constitutive_law import Array


@dataclass(frozen=True)
class Yeoh(IsochoricInvariantMaterial):
    """Yeoh rubber: a cubic polynomial of the first invariant, for rubber that first softens and then stiffens.

    psi = c1 i + c2 i^2 + c3 i^3 + K/2 g(J)^2, i = J^(-2/3) tr F^T F - 3; mu = 2 c1 Fitted to uniaxial tension
    it is close in other states too. c2 is often negative; where c1 + 2 c2 i + 3 c3 i^2 is not positive, the
    material is unstable.
    Source: Yeoh (1993), "Some forms of the strain energy function for rubber", Rubber Chem. Technol. 66:754.
    """

    c1: Annotated[float, "Pa in (0, inf)", "constant of the first power; the shear modulus is 2 c1"]
    c2: Annotated[float, "Pa", "constant of the second power"] = 0.0
    c3: Annotated[float, "Pa", "constant of the third power"] = 0.0
    second = False

    @property
    def initial_shear_modulus(self) -> float:
        """Shear modulus of the undeformed solid, Pa."""
        return 2.0 * self.c1

    @property
    def convex(self) -> bool:
        """True if W is increasing and convex."""
        return self.c2 >= 0.0 and self.c3 >= 0.0

    @property
    def polyconvexity_violation(self) -> tuple[str, str] | None:
        """Reason for loss of stiffness: the stress in simple shear g = sqrt(i) has a maximum.

        It is where c1 + 6 c2 i + 15 c3 i^2 = 0.
        """
        if self.c3 < 0.0:
            return "c3", "its shear stress has a maximum, since c3 is negative"
        if self.c2 < 0.0 and 3.0 * self.c2**2 >= 5.0 * self.c1 * self.c3:
            return "c2", "its shear stress has a maximum, since c2 is negative and 3 c2^2 is not below 5 c1 c3"
        return None

    def energy(self, i: Array, k: Array) -> Array:
        """Return W (m,), J/m^3; see `IsochoricInvariantMaterial`."""
        return i * (self.c1 + i * (self.c2 + i * self.c3))

    def slopes(self, i: Array, k: Array) -> tuple[Number, Number]:
        """Return the first derivatives of the energy, Pa."""
        return self.c1 + i * (2.0 * self.c2 + i * (3.0 * self.c3)), None

    def curvatures(self, i: Array, k: Array) -> tuple[Number, Number, Number]:
        """Return the second derivatives of the energy, Pa."""
        return 2.0 * self.c2 + i * (6.0 * self.c3), None, None
