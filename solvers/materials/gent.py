"""Gent material."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated

from softmark.records import dataclass
from softmark.solvers.materials.isochoric_invariants import IsochoricInvariantMaterial, Number
from softmark.solvers.runtime.scalar_or_array import log1p, where

if TYPE_CHECKING:
    from softmark.solvers.materials.constitutive_law import Array


@dataclass(frozen=True)
class Gent(IsochoricInvariantMaterial):
    """Gent rubber: chains of limited extensibility, so that stress grows without bound as the limit is approached.

    psi = -mu/2 limit ln(1 - i/limit) + K/2 g(J)^2, i = J^(-2/3) tr F^T F - 3 < limit The energy is infinite
    beyond the limit, and no such state is ever tried. In uniaxial tension the largest stretch t satisfies t^2 +
    2/t - 3 = limit. As the limit tends to infinity the law is neo-Hookean.
    Source: Gent (1996), "A new constitutive relation for rubber", Rubber Chem. Technol. 69:59.
    """

    mu: Annotated[float, "Pa in (0, inf)", "shear modulus of the undeformed solid"]
    limit: Annotated[float, "1 in (0, inf)", "J_m, upper bound of J^(-2/3) tr F^T F - 3; 30 to 100 for rubber"]
    second = False

    @property
    def initial_shear_modulus(self) -> float:
        """Shear modulus of the undeformed solid, Pa."""
        return self.mu

    @property
    def ends(self) -> str | None:
        """Limit stretch in isochoric uniaxial tension, in words: the largest root t of t^2 + 2/t - 3 = limit."""
        third = 1.0 + self.limit / 3.0
        t = 2.0 * third**0.5 * math.cos(math.acos(-(third**-1.5)) / 3.0)
        return (
            f"its law has no state at or above J^(-2/3) tr F^T F - 3 = {self.limit:g}, in isochoric "
            f"tension a stretch of {t:.4g}, and close to it is too stiff to compute"
        )

    def energy(self, i: Array, k: Array) -> Array:
        """Return W (m,), J/m^3; see `IsochoricInvariantMaterial`."""
        return where(i < self.limit, -0.5 * self.mu * self.limit * log1p(-i / self.limit), math.inf)

    def slopes(self, i: Array, k: Array) -> tuple[Number, Number]:
        """Return the first derivatives of the energy, Pa."""
        return 0.5 * self.mu / self._remaining_extensibility(i), None

    def curvatures(self, i: Array, k: Array) -> tuple[Number, Number, Number]:
        """Return the second derivatives of the energy, Pa."""
        return 0.5 * self.mu / (self.limit * self._remaining_extensibility(i) ** 2), None, None

    def _remaining_extensibility(self, i: Array) -> Array:
        """Return 1 - i/limit (m,); NaN at the limit and beyond."""
        return where(i < self.limit, 1.0 - i / self.limit, math.nan)
