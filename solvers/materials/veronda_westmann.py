"""Veronda-Westmann material."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from softmark.records import dataclass
from softmark.solvers.materials.isochoric_invariants import IsochoricInvariantMaterial, Number
from softmark.solvers.runtime.scalar_or_array import exp, expm1

if TYPE_CHECKING:
    from softmark.solvers.materials.constitutive_law import Array

LEAST = 0.3575  # the largest ln(t^2/2) / (t^2 + 2/t - 3), at t = 1.829


@dataclass(frozen=True)
class VerondaWestmann(IsochoricInvariantMaterial):
    """Skin that stiffens exponentially (Veronda and Westmann), often used for breast and liver.

    psi = c (exp(a i) - 1) - c a/2 k + K/2 g(J)^2, i = J^(-2/3) I1 - 3, k = J^(-4/3) I2 - 3; mu = c a
    The term in k is negative, so the law is not polyconvex: with a small `a` it becomes unstable in equibiaxial tension
    and in torsion.
    Source: Veronda and Westmann (1970), "Mechanical characterization of skin: finite deformations", J. Biomech. 3:111.
    """

    c: Annotated[float, "Pa in (0, inf)", "constant of the exponential; the shear modulus is c a"]
    a: Annotated[float, "1 in (0, inf)", "rate of exponential stiffening"]

    @property
    def initial_shear_modulus(self) -> float:
        """Shear modulus of the undeformed solid, Pa."""
        return self.c * self.a

    @property
    def polyconvexity_violation(self) -> tuple[str, str] | None:
        """Reason for loss of shear stiffness, 2 (W_i + t^2 W_k) at stretch t: it is zero if exp(a i) = t^2/2."""
        if self.a > LEAST:
            return None
        return "a", f"in tension it loses its transverse shear stiffness, since a is not greater than {LEAST}"

    def energy(self, i: Array, k: Array) -> Array:
        """Return W (m,), J/m^3; see `IsochoricInvariantMaterial`."""
        return self.c * expm1(self.a * i) - 0.5 * self.c * self.a * k

    def slopes(self, i: Array, k: Array) -> tuple[Number, Number]:
        """Return the first derivatives of the energy, Pa."""
        return self.c * self.a * exp(self.a * i), -0.5 * self.c * self.a

    def curvatures(self, i: Array, k: Array) -> tuple[Number, Number, Number]:
        """Return the second derivatives of the energy, Pa."""
        return self.c * self.a**2 * exp(self.a * i), None, None
