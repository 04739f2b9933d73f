"""Compressible neo-Hookean material with ln J."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from softmark.records import dataclass
from softmark.solvers.materials.isotropic_material import Isotropic, is_array
from softmark.solvers.materials.two_invariant_law import TwoInvariantLaw
from softmark.solvers.runtime.scalar_or_array import full_like, log1p, where

if TYPE_CHECKING:
    from softmark.solvers.materials.constitutive_law import Array, Law
    from softmark.solvers.materials.volumetric_constraints import Constraint


@dataclass(frozen=True)
class NeoHookean(TwoInvariantLaw, Isotropic):
    """Compressible neo-Hookean rubber, the form with ln J.

    psi = mu/2 (tr F^T F - 3) - mu ln J + lam/2 (ln J)^2, J = det F > 0 P = mu (F - F^-T) + lam ln J F^-T
    Infinite energy at J = 0, so elements cannot turn inside out. In simple shear sigma_12 = mu gamma exactly.
    Realistic for rubber and gels up to stretches of about 1.5.
    Source: Bonet, Wood, "Nonlinear Continuum Mechanics for Finite Element Analysis" (2nd ed. 2008),
    chapter 6.
    """

    @property
    def polyconvexity_violation(self) -> tuple[str, str] | None:
        """Reason for nu < 0: lam/2 (ln J)^2 has no lower bound, so that the energy falls without limit."""
        if is_array(self.poisson) or not isinstance(self.poisson, float | int) or self.poisson >= 0.0:
            return None
        return "poisson", "with a negative Poisson's ratio its energy has no lower bound as the volume vanishes"

    @property
    def convex_above(self) -> float:  # type: ignore[override]
        """Zero: (ln J)^2 and powers of stretches are convex in ln J for every J."""
        known = not is_array(self.poisson) and isinstance(self.poisson, float | int) and self.poisson >= 0.0
        return 0.0 if known else math.inf

    def finite_parts(self) -> tuple[Law, Law] | None:
        """Return the shear part and the volume part; the energy is linear in the two moduli."""
        return _Shear(**vars(self)), _Volume(**vars(self))

    def finite_mixed(self) -> tuple[Law, Constraint] | None:
        """Return the law with `local_lambda` in place of `lame_lambda`, and the volume constraint."""
        from softmark.solvers.materials.volumetric_constraints import LogarithmicVolume

        return _Shape(**vars(self)), LogarithmicVolume()

    def energy(self, stretch: Array, j: Array) -> Array:
        """Return psi (m,), J/m^3, of I1 - 3 and J - 1."""
        mu, lam = self.shear_modulus, self.lame_lambda
        l = log1p(j)
        return where(j > -1.0, 0.5 * mu * stretch - mu * l + 0.5 * lam * l * l, math.inf)

    def slopes(self, stretch: Array, j: Array) -> tuple[Array, Array]:
        """Return the first derivatives of the energy, Pa."""
        mu, lam = self.shear_modulus, self.lame_lambda
        return full_like(j, mu), (lam * log1p(j) - mu) / (1.0 + j)

    def curvatures(self, stretch: Array, j: Array) -> tuple[Array | None, Array]:
        """Return the second derivatives of the energy, Pa."""
        mu, lam = self.shear_modulus, self.lame_lambda
        return None, (lam + mu - lam * log1p(j)) / (1.0 + j) ** 2


class _Shear(NeoHookean):
    """The part of the law proportional to mu."""

    volume_share = 0.0


class _Volume(NeoHookean):
    """The part of the law proportional to lam."""

    shear_share = 0.0


class _Shape(NeoHookean):
    """The law without the volume energy that a separate pressure carries."""

    @property
    def lame_lambda(self) -> float:
        """Part of the modulus that stays in the point-wise law, Pa."""
        return self.local_lambda
