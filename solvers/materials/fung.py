"""Fung-Demiray material: isotropic exponential solid."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from softmark.records import dataclass
from softmark.solvers.materials.isochoric_invariants import IsochoricInvariantMaterial, Number
from softmark.solvers.runtime.scalar_or_array import exp, expm1

if TYPE_CHECKING:
    from softmark.solvers.materials.constitutive_law import Array


@dataclass(frozen=True)
class Fung(IsochoricInvariantMaterial):
    """Isotropic soft tissue that stiffens exponentially (Fung and Demiray).

    psi = mu/(2 b) (exp(b i) - 1) + K/2 g(J)^2, i = J^(-2/3) tr F^T F - 3
    Source: Demiray (1972), "A note on the elasticity of soft biological tissues", J. Biomech. 5:309; Fung (1967),
    Am. J. Physiol. 213:1532.
    """

    mu: Annotated[float, "Pa in (0, inf)", "shear modulus of the undeformed solid"]
    b: Annotated[float, "1 in (0, inf)", "rate of exponential stiffening; 0.5 to 20 for soft tissue"]
    second = False

    @property
    def initial_shear_modulus(self) -> float:
        """Shear modulus of the undeformed solid, Pa."""
        return self.mu

    def energy(self, i: Array, k: Array) -> Array:
        """Return W (m,), J/m^3; see `IsochoricInvariantMaterial`."""
        return 0.5 * self.mu / self.b * expm1(self.b * i)

    def slopes(self, i: Array, k: Array) -> tuple[Number, Number]:
        """Return dW/di and dW/dk, Pa; None stands for zero."""
        return 0.5 * self.mu * exp(self.b * i), None

    def curvatures(self, i: Array, k: Array) -> tuple[Number, Number, Number]:
        """Return d2W/di2, d2W/di dk and d2W/dk2, Pa; None stands for zero."""
        return 0.5 * self.mu * self.b * exp(self.b * i), None, None
