"""Ogden material."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from softmark.ranges import InvalidCombination
from softmark.records import dataclass
from softmark.solvers.materials.principal_stretches import PrincipalStretchMaterial
from softmark.solvers.runtime.scalar_or_array import exp, expm1

if TYPE_CHECKING:
    import numpy as np

    from softmark.solvers.materials.constitutive_law import Array
else:
    from softmark.solvers.runtime.lazy_modules import np


@dataclass(frozen=True)
class Ogden(PrincipalStretchMaterial):
    """Ogden rubber: a sum of powers of the principal stretches, with any number of terms.

    psi = sum_n mu_n/alpha_n (t1^alpha_n + t2^alpha_n + t3^alpha_n - 3) + K/2 g(J)^2, t_a = J^(-1/3) times the stretches
    The shear modulus is the sum of mu_n alpha_n / 2. In the form with 2 mu_n/alpha_n^2, mu_n is alpha_n/2 times this
    one. The single power alpha = 2 is neo-Hookean, and [2, -2] is Mooney-Rivlin. Terms with negative mu_n alpha_n may
    make the material unstable at some stretch.
    Source: Ogden (1972), "Large deformation isotropic elasticity", Proc. R. Soc. Lond. A 326:565; in isochoric form
    Holzapfel, "Nonlinear Solid Mechanics" (2000), section 6.5.
    """

    mu: Annotated[tuple[float, ...], "each of Pa", "mu_n, constants of the terms"]
    alpha: Annotated[tuple[float, ...], "each of 1", "alpha_n, powers of the terms, one for each constant"]
    powerless = (
        "mu", "the sum of mu_n alpha_n is not positive", "no initial shear modulus",
        "give mu_n and alpha_n of each term the same sign, or make other terms larger",
    )  # fmt: skip

    @property
    def initial_shear_modulus(self) -> float:
        """Shear modulus of the undeformed solid, Pa."""
        if len(self.mu) != len(self.alpha):
            raise InvalidCombination("alpha",
                        f"there are {len(self.mu)} constants `mu` but {len(self.alpha)} exponents `alpha`",
                        "numbers differ", "write one `mu` and one `alpha` for each term")  # fmt: skip
        if 0.0 in self.alpha:
            raise InvalidCombination(
                "alpha", "a term with the exponent 0 has no effect", "exponent 0", "remove the term"
            )
        return 0.5 * sum(m * a for m, a in self._terms)

    @property
    def _terms(self) -> list[tuple[float, float]]:
        return list(zip(self.mu, self.alpha, strict=True))

    @property
    def convex(self) -> bool:
        """True if each term is polyconvex: sum s^alpha J^(-alpha/3) for alpha >= 3/2, and of cofactors for alpha <= -3.

        Reason: x^p y^-q is convex if p >= q + 1. Source: Hartmann and Neff (2003), Int. J. Solids Struct. 40:2767.
        """
        return all(m * a >= 0.0 and (a >= 1.5 or a <= -3.0) for m, a in self._terms)

    @property
    def is_log_convex(self) -> bool:
        """True if each term is a sum of exponentials with positive coefficients."""
        return all(m * a >= 0.0 for m, a in self._terms)

    @property
    def polyconvexity_violation(self) -> tuple[str, str] | None:
        """Reason for loss of shear stiffness, which is w''(e) / t^2 between two equal stretches t, e = ln t.

        The outermost powers decide. In simple shear the energy grows as |F| to the largest power of both signs; below
        power 1 its slope decreases.
        """
        sums: dict[float, float] = {}
        for m, a in self._terms:
            sums[a] = sums.get(a, 0.0) + m * a
        powers = [a for a in sums if sums[a] != 0.0]
        for a, far in ((max(powers), "stretched"), (min(powers), "squeezed")):
            if sums[a] < 0.0:
                return "mu", f"{far} far enough, its term alpha = {a:g} dominates, whose mu_n alpha_n is negative"
        if max(map(abs, powers)) < 1.0:
            return "alpha", "its shear stress has a maximum, since all exponents lie between -1 and 1"
        return None

    def energy(self, e: Array) -> Array:
        return sum(m / a * expm1(a * e) for m, a in self._terms)  # type: ignore[return-value]

    def slope(self, e: Array) -> Array:
        return sum(m * expm1(a * e) for m, a in self._terms)  # type: ignore[return-value]

    def curvature(self, e: Array) -> Array:
        return sum(m * a * exp(a * e) for m, a in self._terms)  # type: ignore[return-value]

    def quotient(self, m: Array, d: Array) -> Array:
        same, apart = d == 0.0, np.sinh(d)
        return sum(  # type: ignore[return-value]
            c * np.exp(a * m) * np.where(same, a, np.sinh(a * d) / np.where(same, 1.0, apart)) for c, a in self._terms
        )
