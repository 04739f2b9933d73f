"""Mooney-Rivlin material."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from softmark.records import dataclass
from softmark.solvers.materials.isochoric_invariants import IsochoricInvariantMaterial, Number

if TYPE_CHECKING:
    from softmark.solvers.materials.constitutive_law import Array


@dataclass(frozen=True)
class MooneyRivlin(IsochoricInvariantMaterial):
    """Mooney-Rivlin rubber: neo-Hookean plus a term that softens with stretch.

    psi = c1 (J^(-2/3) I1 - 3) + c2 (J^(-4/3) I2 - 3) + K/2 g(J)^2, I1 and I2 the invariants of F^T F; mu = 2 (c1 + c2)
    With c2 = 0 and `volumetric = squared` it is `neo_hookean_isochoric`. For rubber up to stretches of about 2 to 3. A
    c2 fitted to uniaxial tension only makes other states far too stiff; it must not be negative.
    Source: Mooney (1940), J. Appl. Phys. 11:582; Rivlin (1948), Phil. Trans. R. Soc. A 241:379; Holzapfel, "Nonlinear
    Solid Mechanics" (2000), section 6.5.
    """

    c1: Annotated[float, "Pa in (0, inf)", "constant of the first invariant; the shear modulus is 2 (c1 + c2)"]
    c2: Annotated[float, "Pa in [0, inf)", "constant of the second invariant"]

    @property
    def initial_shear_modulus(self) -> float:
        """Shear modulus of the undeformed solid, Pa."""
        return 2.0 * (self.c1 + self.c2)

    @property
    def convex(self) -> bool:
        """True if the term in k is absent."""
        return self.c2 == 0.0

    @property
    def is_log_convex(self) -> bool:
        """True: i and k are sums of exponentials of logarithmic stretches."""
        return True

    def energy(self, i: Array, k: Array) -> Array:
        """Return W (m,), J/m^3; see `IsochoricInvariantMaterial`."""
        return self.c1 * i + self.c2 * k

    def slopes(self, i: Array, k: Array) -> tuple[Number, Number]:
        """Return the first derivatives of the energy, Pa."""
        return self.c1, self.c2

    def curvatures(self, i: Array, k: Array) -> tuple[Number, Number, Number]:
        """Return the second derivatives of the energy, Pa."""
        return None, None, None
