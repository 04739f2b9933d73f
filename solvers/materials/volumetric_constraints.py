"""Volume constraints g(F) = 0, one for each kind of strain, enforced by a pressure.

A law with volume energy M/2 g(F)^2 has the same solutions as p g(F) - p^2 / (2 M) with a separate pressure p. The
second form stays finite if M does not: 1/M = 0 is the incompressible solid, with g = 0. p is positive in tension.
Sources: Herrmann (1965), "Elasticity equations for incompressible and nearly incompressible materials by a variational
theorem"; Simo, Taylor and Pister (1985), Comput. Methods Appl. Mech. Eng. 51:177; Bonet and Wood (2008), section 8.5.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

from softmark.records import dataclass
from softmark.solvers.materials.corotational import add_rotation_derivative
from softmark.solvers.materials.polar_decomposition import rotation
from softmark.solvers.materials.tensor_components import (
    add_diagonal,
    add_identity,
    add_outer,
    add_tensor_cross_product,
    cofactor,
    components,
    displacement_gradient,
    inner,
    trace,
    volume_change,
    write_symmetric,
)
from softmark.solvers.runtime.scalar_or_array import full_like, log1p, where

if TYPE_CHECKING:
    import numpy as np

    from softmark.solvers.materials.constitutive_law import Array, Law
else:
    from softmark.solvers.runtime.lazy_modules import np


class Constraint(ABC):
    """Base class of volume constraints g(F), which are zero at rest, and NaN outside their domain.

    A subclass writes `_value`, `_gradient` and `_add_curvature` on components f (3, 3, m) (see tensor_components.py).
    """

    @abstractmethod
    def _value(self, f: Array) -> Array:
        """Return g (m,), no unit."""

    @abstractmethod
    def _gradient(self, f: Array) -> Array:
        """Return dg/dF (3, 3, m)."""

    @abstractmethod
    def _add_curvature(self, f: Array, p: Array, H: Array) -> None:
        """Add p d2g/dF2, Pa, to H (9, 9, m), on and above the diagonal, for pressures p (m,), Pa."""

    def value(self, F: Array) -> Array:
        """Return g (m,), no unit."""
        with np.errstate(all="ignore"):
            return self._value(components(F))

    def gradient(self, F: Array) -> Array:
        """Return dg/dF (m, 3, 3), no unit."""
        with np.errstate(all="ignore"):
            return np.ascontiguousarray(self._gradient(components(F)).transpose(2, 0, 1))

    def curvature(self, F: Array, p: Array) -> Array:
        """Return p d2g/dF2 (m, 3, 3, 3, 3), Pa, for pressures p (m,)."""
        f = components(F)
        H, A = np.zeros((9, 9, len(F)), dtype=f.dtype), np.empty((len(F), 3, 3, 3, 3), dtype=f.dtype)
        with np.errstate(all="ignore"):
            self._add_curvature(f, p, H)
        write_symmetric(H, A)
        return A


@dataclass(frozen=True)
class MixedSplit:
    """Split of a law for mixed elements: the point-wise law `shape`, and M/2 g^2 of the constraint g.

    `modulus` is M in Pa, infinite if incompressible. It is the bulk modulus K for small or corotational strain, and lam
    minus `Isotropic.local_lambda` for finite strain.
    """

    shape: Law
    constraint: Constraint
    modulus: float

    @property
    def compliance(self) -> float:
        """Compliance 1/M, 1/Pa; 0 if incompressible."""
        return 1.0 / self.modulus


class Dilatation(Constraint):
    """Constraint g = tr eps, for small strains."""

    def _value(self, f: Array) -> Array:
        """Return tr (F - I)."""
        return trace(displacement_gradient(f))

    def _gradient(self, f: Array) -> Array:
        """Return I."""
        return add_diagonal(np.zeros_like(f), 1.0)

    def _add_curvature(self, f: Array, p: Array, H: Array) -> None:
        """Do nothing: g is linear."""


class CorotationalDilatation(Constraint):
    """Constraint g = tr (R^T F - I), R the rotation nearest to F, for corotational strain."""

    def _value(self, f: Array) -> Array:
        """Return R : (F - R)."""
        r = rotation(f)
        return inner(r, f - r)

    def _gradient(self, f: Array) -> Array:
        """Return R; the rotation of R does not change R : F."""
        return rotation(f)

    def _add_curvature(self, f: Array, p: Array, H: Array) -> None:
        """Add p dR/dF."""
        add_rotation_derivative(H, f, rotation(f), p)


class VolumeRatioConstraint(Constraint):
    """Base class of constraints g(J) that depend only on J = det F.

    A subclass computes g and its two derivatives.
    """

    @abstractmethod
    def of(self, j: Array) -> tuple[Array, Array, Array | None]:
        """Return g, dg/dJ and d2g/dJ2 (m,) from j = J - 1 (m,).

        g is NaN outside its domain, and d2g/dJ2 is None if it is zero.
        """

    def _value(self, f: Array) -> Array:
        """Return g, accurate near rest."""
        return self.of(volume_change(displacement_gradient(f)))[0]

    def _gradient(self, f: Array) -> Array:
        """Return dg/dJ cof F."""
        return self.of(volume_change(displacement_gradient(f)))[1] * cofactor(f)

    def _add_curvature(self, f: Array, p: Array, H: Array) -> None:
        """Add p (dg/dJ d(cof F)/dF + d2g/dJ2 cof F (x) cof F)."""
        _, first, second = self.of(volume_change(displacement_gradient(f)))
        add_tensor_cross_product(H, (p * first) * f)
        if second is not None:
            C = cofactor(f).reshape(9, -1)
            add_outer(H, (p * second) * C, C)


class VolumeRatio(VolumeRatioConstraint):
    """Constraint g = J - 1."""

    def of(self, j: Array) -> tuple[Array, Array, Array | None]:
        """Return J - 1, 1 and None."""
        return j, full_like(j, 1.0), None

    def _gradient(self, f: Array) -> Array:
        """Return cof F, without computing J."""
        return cofactor(f)

    def _add_curvature(self, f: Array, p: Array, H: Array) -> None:
        """Add p d(cof F)/dF."""
        add_tensor_cross_product(H, p * f)


class LogarithmicVolume(VolumeRatioConstraint):
    """Constraint g = ln J, for J > 0."""

    def of(self, j: Array) -> tuple[Array, Array, Array | None]:
        """Return ln J, 1/J and -1/J^2; NaN if J <= 0."""
        first = 1.0 / (1.0 + j)
        return log1p(where(j > -1.0, j, math.nan)), first, -first * first


class ReciprocalVolume(VolumeRatioConstraint):
    """Constraint g = (J - 1/J)/2, for J > 0, whose size is equal for halved and doubled volume.

    K/2 g^2 = K/8 (J^2 + J^-2 - 2).
    Source: Hartmann and Neff (2003), "Polyconvexity of generalized polynomial-type hyperelastic strain energy functions
    for near-incompressibility", the family K/(2 n^2) (J^n + J^-n - 2) with n = 2.
    """

    def of(self, j: Array) -> tuple[Array, Array, Array | None]:
        """Return (J - 1/J)/2, (1 + 1/J^2)/2 and -1/J^3; NaN if J <= 0."""
        inverse = 1.0 / where(j > -1.0, 1.0 + j, math.nan)
        return 0.5 * j * (1.0 + inverse), 0.5 * (1.0 + inverse**2), -(inverse**3)


class GreenDilatation(Constraint):
    """Constraint g = tr E, E = (F^T F - I)/2: the volume measure of the St Venant-Kirchhoff law."""

    def _value(self, f: Array) -> Array:
        """Return tr h + h : h / 2, h = F - I."""
        h = displacement_gradient(f)
        return trace(h) + 0.5 * inner(h, h)

    def _gradient(self, f: Array) -> Array:
        """Return F."""
        return f

    def _add_curvature(self, f: Array, p: Array, H: Array) -> None:
        """Add p times the identity."""
        add_identity(H, p)
