"""The compressible neo-Hookean solid with ln J."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from softmark.solvers.materials.components import (
    add_cross,
    add_identity,
    cofactor,
    displacement_gradient,
    inner,
    set_outer,
    trace,
    volume_change,
)
from softmark.solvers.materials.hyperelastic import Hyperelastic
from softmark.solvers.materials.isotropic import Isotropic

if TYPE_CHECKING:
    import numpy as np

    from softmark.solvers.materials.law import Array, Law
else:
    from softmark.solvers.deferred import np


@dataclass(frozen=True)
class NeoHookean(Hyperelastic, Isotropic):
    """Compressible neo-Hookean rubber, the form with ln J.

    psi = mu/2 (tr F^T F - 3) - mu ln J + lam/2 (ln J)^2, J = det F > 0
    P = mu (F - F^-T) + lam ln J F^-T
    Infinite energy at J = 0, so elements cannot turn inside out. In simple shear sigma_12 = mu gamma exactly.
    Realistic for rubber and gels up to stretches of about 1.5.
    Source: Bonet, Wood, "Nonlinear Continuum Mechanics for Finite Element Analysis" (2nd ed. 2008),
    chapter 6.
    """

    def finite_parts(self) -> tuple[Law, Law] | None:
        """The energy is linear in its two moduli."""
        return _Shear(**vars(self)), _Volume(**vars(self))

    def _psi(self, f: Array) -> Array:
        mu, lam = self.shear_modulus, self.lame_lambda
        h = displacement_gradient(f)
        j = volume_change(h)
        l = np.log1p(j)
        psi = mu * (trace(h) - l) + 0.5 * mu * inner(h, h) + 0.5 * lam * l * l
        return np.where(j > -1.0, psi, np.inf)

    def _P(self, f: Array) -> Array:
        mu, lam = self.shear_modulus, self.lame_lambda
        j = volume_change(displacement_gradient(f))
        P = cofactor(f)  # J F^-T
        P *= (lam * np.log1p(j) - mu) / (1.0 + j)
        P += mu * f
        return P

    def _dPdF(self, f: Array, H: Array) -> None:
        """mu delta_ik delta_JL + q G_iL G_kJ + lam G_iJ G_kL, G = F^-T, q = mu - lam ln J (see add_cross)."""
        mu, lam = self.shear_modulus, self.lame_lambda
        j = volume_change(displacement_gradient(f))
        J = 1.0 + j
        q = mu - lam * np.log1p(j)
        cof = cofactor(f).reshape(9, -1)
        set_outer(H, cof, cof * ((lam + q) / (J * J)))
        add_cross(H, f * (-q / J))
        add_identity(H, mu)


class _Shear(NeoHookean):
    """The part that belongs to mu."""

    volume_share = 0.0


class _Volume(NeoHookean):
    """The part that belongs to lam."""

    shear_share = 0.0
