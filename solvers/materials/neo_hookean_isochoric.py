"""Neo-Hookean material with isochoric-volumetric split."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from softmark.records import dataclass
from softmark.solvers.materials.isotropic_material import Isotropic, clamp_value
from softmark.solvers.materials.two_invariant_law import TwoInvariantLaw
from softmark.solvers.runtime.scalar_or_array import exp, expm1, log1p, where

if TYPE_CHECKING:
    from softmark.solvers.materials.constitutive_law import Array, Law
    from softmark.solvers.materials.volumetric_constraints import Constraint


@dataclass(frozen=True)
class NeoHookeanIsochoric(TwoInvariantLaw, Isotropic):
    """Nearly incompressible neo-Hookean rubber with isochoric-volumetric split.

    psi = mu/2 (J^(-2/3) tr F^T F - 3) + K/2 (J - 1)^2, J = det F > 0, K the bulk modulus P = mu J^(-2/3) (F -
    I1/3 F^-T) + K (J - 1) J F^-T, I1 = tr F^T F The usual form for nearly incompressible rubber and tissue, and
    that of many finite element codes. The volumetric energy is finite at J = 0: a uniform collapse costs only
    K/2 per volume and is not prevented.
    Source: Simo, Taylor, Pister (1985), Comput. Methods Appl. Mech. Eng. 51:177; Holzapfel, "Nonlinear Solid
    Mechanics" (2000), section 6.4.
    """

    polyconvex = True
    convex_above = 0.5  # (J - 1)^2 is convex in ln J above this J

    def finite_parts(self) -> tuple[Law, Law] | None:
        """Return the shear part and the volume part; the shear part keeps 5 mu/3 of K, as at nu = 1/4."""
        return _Shear(**vars(self)), _Volume(**vars(self))

    def finite_mixed(self) -> tuple[Law, Constraint] | None:
        """Return the law with `local_lambda` in place of `lame_lambda`, and the volume constraint."""
        from softmark.solvers.materials.volumetric_constraints import VolumeRatio

        return _Shape(**vars(self)), VolumeRatio()

    def isochoric(self) -> Law:
        """Return the law without the volume energy."""
        return _Isochoric(**vars(self))

    @property
    def _shear_part_bulk(self) -> float:
        """Part of K in the shear law: 5 mu/3, or all of K = lam + 2 mu/3 if that is less, Pa."""
        kept: float = (2.0 / 3.0 + clamp_value(-1.0, self._ratio, 1.0)) * self.young / (2.0 * (1.0 + self.poisson))
        return kept

    def energy(self, stretch: Array, j: Array) -> Array:
        """Return psi (m,), J/m^3, of I1 - 3 and J - 1."""
        mu, K = self.shear_modulus, self.bulk_modulus
        shape = stretch + expm1(-2.0 / 3.0 * log1p(j)) * (stretch + 3.0)
        return where(j > -1.0, 0.5 * mu * shape + 0.5 * K * j * j, math.inf)

    def slopes(self, stretch: Array, j: Array) -> tuple[Array, Array]:
        """Return the first derivatives of the energy, Pa."""
        m = self._isochoric_modulus(j)
        return m, self.bulk_modulus * j - m * (stretch + 3.0) / (3.0 * (1.0 + j))

    def curvatures(self, stretch: Array, j: Array) -> tuple[Array | None, Array]:
        """Return the second derivatives of the energy, Pa."""
        m, J = self._isochoric_modulus(j), 1.0 + j
        return -2.0 / 3.0 * m / J, self.bulk_modulus + 5.0 / 9.0 * m * (stretch + 3.0) / (J * J)

    def _isochoric_modulus(self, j: Array) -> Array:
        """Return mu J^(-2/3), NaN if J <= 0."""
        return self.shear_modulus * exp(-2.0 / 3.0 * log1p(j))


class _Shear(NeoHookeanIsochoric):
    """The part of the law proportional to mu, with some volume stiffness, without which it is unstable in tension."""

    volume_share = 0.0

    @property
    def bulk_modulus(self) -> float:
        """Part of the modulus that stays in the point-wise law, Pa."""
        return self._shear_part_bulk


class _Isochoric(NeoHookeanIsochoric):
    """The isochoric part of the law."""

    @property
    def bulk_modulus(self) -> float:
        """Zero: no volume stiffness."""
        return 0.0


class _Volume(NeoHookeanIsochoric):
    """The volume part of the law."""

    shear_share = 0.0

    @property
    def bulk_modulus(self) -> float:
        """Remaining part of K, Pa; 0 if K is not above 5 mu/3."""
        return super().bulk_modulus - self._shear_part_bulk


class _Shape(NeoHookeanIsochoric):
    """The law without the volume energy that a separate pressure carries."""

    @property
    def bulk_modulus(self) -> float:
        """Part of the modulus that stays in the point-wise law, Pa."""
        return self.local_lambda + 2.0 / 3.0 * self.shear_modulus
