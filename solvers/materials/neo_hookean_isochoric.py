"""The neo-Hookean solid split into change of shape and change of volume."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from softmark.solvers.materials.components import (
    add_cross,
    add_identity,
    add_outer,
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
class NeoHookeanIsochoric(Hyperelastic, Isotropic):
    """Neo-Hookean rubber with shape and volume apart (isochoric-volumetric split).

    psi = mu/2 (J^(-2/3) tr F^T F - 3) + K/2 (J - 1)^2, J = det F > 0, K the bulk modulus
    P = mu J^(-2/3) (F - I1/3 F^-T) + K (J - 1) J F^-T, I1 = tr F^T F
    The usual form for nearly incompressible rubber and tissue, and that of many finite element codes. The
    volume part is finite at J = 0: a uniform collapse costs K/2 per volume, and no energy holds it back.
    Source: Simo, Taylor, Pister (1985), Comput. Methods Appl. Mech. Eng. 51:177; Holzapfel, "Nonlinear Solid
    Mechanics" (2000), section 6.4.
    """

    def finite_parts(self) -> tuple[Law, Law] | None:
        """The energy is linear in its two moduli."""
        return _Shear(**vars(self)), _Volume(**vars(self))

    def _psi(self, f: Array) -> Array:
        mu, K = self.shear_modulus, self.bulk_modulus
        h = displacement_gradient(f)
        j = volume_change(h)
        stretch = 2.0 * trace(h) + inner(h, h)  # I1 - 3
        shape = stretch + np.expm1(-2.0 / 3.0 * np.log1p(j)) * (stretch + 3.0)
        return np.where(j > -1.0, 0.5 * mu * shape + 0.5 * K * j * j, np.inf)

    def _P(self, f: Array) -> Array:
        K = self.bulk_modulus
        j = volume_change(displacement_gradient(f))
        J, m = 1.0 + j, self._isochoric_modulus(j)
        P = cofactor(f)  # J F^-T
        P *= K * j - m * inner(f, f) / (3.0 * J)
        P += m * f
        return P

    def _dPdF(self, f: Array, H: Array) -> None:
        """m (delta_ik delta_JL - 2/3 (F G + G F) + 2/9 I1 G G) + K J (2 J - 1) G G + q G_iL G_kJ, G = F^-T.

        m = mu J^(-2/3), q = m I1/3 - K (J - 1) J; products without indices are dyadic (see add_cross for q).
        """
        K = self.bulk_modulus
        j = volume_change(displacement_gradient(f))
        J, m, I1 = 1.0 + j, self._isochoric_modulus(j), inner(f, f)
        q = m * I1 / 3.0 - K * j * J
        a = f.reshape(9, -1) * (-2.0 / 3.0 * m)
        G = cofactor(f).reshape(9, -1) / J
        set_outer(H, G, a + G * (2.0 / 9.0 * m * I1 + K * J * (J + j) + q))
        add_outer(H, a, G)
        add_cross(H, f * (-q / J))
        add_identity(H, m)

    def _isochoric_modulus(self, j: Array) -> Array:
        """mu J^(-2/3), NaN where J <= 0."""
        return self.shear_modulus * np.exp(-2.0 / 3.0 * np.log1p(j))


class _Shear(NeoHookeanIsochoric):
    """The part that belongs to mu."""

    volume_share = 0.0


class _Volume(NeoHookeanIsochoric):
    """The part that belongs to K."""

    shear_share = 0.0
