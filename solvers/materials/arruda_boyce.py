"""Arruda-Boyce eight-chain material."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from softmark.records import dataclass
from softmark.solvers.materials.isochoric_invariants import IsochoricInvariantMaterial, Number

if TYPE_CHECKING:
    from softmark.solvers.materials.constitutive_law import Array

SERIES = (1.0 / 2.0, 1.0 / 20.0, 11.0 / 1050.0, 19.0 / 7000.0, 519.0 / 673750.0)  # of the inverse Langevin function


@dataclass(frozen=True)
class ArrudaBoyce(IsochoricInvariantMaterial):
    """Arruda-Boyce rubber: the eight-chain model, by the first five terms of its series.

    psi = m sum_n C_n / limit^(2n - 2) (I^n - 3^n) + K/2 g(J)^2, I = J^(-2/3) tr F^T F and C = 1/2, 1/20, 11/1050,
    19/7000, 519/673750. Chains are fully extended at I = 3 limit^2, where the stress of the series, unlike that of the
    chain, remains finite. The initial shear modulus is slightly larger than m: by the fraction 3/(5 limit^2) and
    smaller terms.
    Source: Arruda and Boyce (1993), "A three-dimensional constitutive model for the large stretch behavior of rubber
    elastic materials", J. Mech. Phys. Solids 41:389.
    """

    m: Annotated[float, "Pa in (0, inf)", "modulus of the chains, n k T"]
    limit: Annotated[float, "1 in (1, inf)", "lambda_m, stretch of a fully extended chain; 2 to 10 for rubber"]
    second = False

    @property
    def initial_shear_modulus(self) -> float:
        """Shear modulus of the undeformed solid, Pa."""
        return 2.0 * float(self._energy_derivative(1, 0.0))

    def energy(self, i: Array, k: Array) -> Array:
        """Return W (m,), J/m^3; see `IsochoricInvariantMaterial`."""
        total: Array = 0.0 * i
        for n, c in self._series_terms():  # (3 + i)^n - 3^n = i ((3 + i)^(n-1) + 3 (3 + i)^(n-2) + ... + 3^(n-1))
            total = total + c * sum(3.0**q * (3.0 + i) ** (n - 1 - q) for q in range(n))
        return i * total

    def slopes(self, i: Array, k: Array) -> tuple[Number, Number]:
        """Return the first derivatives of the energy, Pa."""
        return self._energy_derivative(1, i), None

    def curvatures(self, i: Array, k: Array) -> tuple[Number, Number, Number]:
        """Return the second derivatives of the energy, Pa."""
        return self._energy_derivative(2, i), None, None

    def _series_terms(self) -> list[tuple[int, float]]:
        """Return the exponent n and the coefficient m C_n / limit^(2n - 2), Pa, of each term of the series."""
        return [(n, self.m * c / self.limit ** (2 * n - 2)) for n, c in enumerate(SERIES, 1)]

    def _energy_derivative(self, order: int, i: Number) -> Number:
        """Return the first or second derivative of W by i, Pa, by Horner's rule."""
        total: Number = 0.0 * i
        for n, c in reversed(self._series_terms()):
            factor = n if order == 1 else n * (n - 1)
            total = total * (3.0 + i) + factor * c
            if n == order:
                return total
        return total
