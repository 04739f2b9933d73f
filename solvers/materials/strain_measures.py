"""Strain measures E(F) for stresses H stored from earlier times: H : E(F) and its two derivatives by F.

There are four measures: small strain; U - 1 of F = R U (Biot), with the rotation removed; (C - 1)/2 with C = F^T F
(Green); and its isochoric form with J^(-2/3) C. The last three do not change under a rotation, so neither does the
stored stress.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

from softmark.records import dataclass
from softmark.solvers.materials.corotational import FLOOR
from softmark.solvers.materials.polar_decomposition import rotations

if TYPE_CHECKING:
    import numpy as np

    from softmark.solvers.materials.constitutive_law import Array, Law
else:
    from softmark.solvers.runtime.lazy_modules import np


class StrainMeasure(Protocol):
    """Interface of a strain measure E (n, 3, 3) of deformation gradients F (n, 3, 3).

    H (n, 3, 3), Pa, is conjugate to E.
    """

    def strain(self, F: Array) -> Array:
        """Return the strain E (n, 3, 3)."""

    def stress(self, law: Law, F: Array) -> Array:
        """Return the stress (n, 3, 3), Pa, of an isotropic law, work-conjugate to E; `pulled` converts it to P."""

    def first_piola_stress(self, F: Array, H: Array) -> Array:
        """Return the first Piola-Kirchhoff stress d(H : E)/dF (n, 3, 3), Pa, of a stress H that is conjugate to E."""

    def add_tangent(self, F: Array, H: Array, A: Array) -> None:
        """Add d2(H : E)/dF dF, Pa, to A (n, 3, 3, 3, 3)."""


@dataclass(frozen=True)
class SmallStrainMeasure:
    """Small strain (F + F^T)/2 - 1."""

    def strain(self, F: Array) -> Array:
        return _symmetric_part(F - np.eye(3))

    def stress(self, law: Law, F: Array) -> Array:
        return law.P(F)

    def first_piola_stress(self, F: Array, H: Array) -> Array:
        return H

    def add_tangent(self, F: Array, H: Array, A: Array) -> None:
        """Do nothing: the strain is linear in F."""


@dataclass(frozen=True)
class GreenStrain:
    """Green strain (F^T F - 1)/2, with the second Piola-Kirchhoff stress."""

    def strain(self, F: Array) -> Array:
        H = F - np.eye(3)
        return _symmetric_part(H) + 0.5 * (_transposed(H) @ H)

    def stress(self, law: Law, F: Array) -> Array:
        S: Any = np.linalg.solve(F, law.P(F))
        return _symmetric_part(S)

    def first_piola_stress(self, F: Array, H: Array) -> Array:
        found: Array = F @ H
        return found

    def add_tangent(self, F: Array, H: Array, A: Array) -> None:
        for i in range(3):
            A[:, i, :, i, :] += H


@dataclass(frozen=True)
class IsochoricStrain:
    """Isochoric Green strain (J^(-2/3) F^T F - 1)/2, with J^(2/3) times the second Piola-Kirchhoff stress.

    Source: Simo (1987), Comput. Methods Appl. Mech. Eng. 60:153, equation 3.8.
    """

    def strain(self, F: Array) -> Array:
        log = np.log(np.linalg.det(F))[:, None, None]
        found: Array = np.exp(-2.0 / 3.0 * log) * GreenStrain().strain(F) + 0.5 * np.expm1(-2.0 / 3.0 * log) * np.eye(3)
        return found

    def stress(self, law: Law, F: Array) -> Array:
        found: Array = np.linalg.det(F)[:, None, None] ** (2.0 / 3.0) * GreenStrain().stress(law, F)
        return found

    def first_piola_stress(self, F: Array, H: Array) -> Array:
        """Return J^(-2/3) (F H - (H : C)/3 F^-T)."""
        a, FH, G, held = self._isochoric_factors(F, H)
        found: Array = a[:, None, None] * (FH - held[:, None, None] / 3.0 * G)
        return found

    def add_tangent(self, F: Array, H: Array, A: Array) -> None:
        a, FH, G, held = self._isochoric_factors(F, H)
        mixed = np.einsum("niJ,nkL->niJkL", FH, G)
        more = -2.0 / 3.0 * (mixed + mixed.transpose(0, 3, 4, 1, 2))
        more += np.einsum("n,niJ,nkL->niJkL", 2.0 / 9.0 * held, G, G) + np.einsum("n,niL,nkJ->niJkL", held / 3.0, G, G)
        for i in range(3):
            more[:, i, :, i, :] += H
        A += a[:, None, None, None, None] * more

    @staticmethod
    def _isochoric_factors(F: Array, H: Array) -> tuple[Array, Array, Array, Array]:
        """Return J^(-2/3) (n,), F H (n, 3, 3), F^-T (n, 3, 3) and H : C (n,)."""
        FH, inverse = F @ H, np.linalg.inv(F)
        G: Any = inverse.swapaxes(1, 2)
        return np.linalg.det(F) ** (-2.0 / 3.0), FH, G, np.einsum("nij,nij->n", FH, F)


@dataclass(frozen=True)
class BiotStrain:
    """Biot strain U - 1, with Biot's stress R^T P, R the rotation nearest to F.

    H : dU = X : dC, where X is the solution of U X + X U = H, so the first Piola-Kirchhoff stress is 2 F X. In the axes
    of U, with stretches s, X is H / (s_i + s_j). Differentiating that equation again gives the tangent.
    """

    def strain(self, F: Array) -> Array:
        R = rotations(F)
        return _symmetric_part(_transposed(R) @ (F - R))

    def stress(self, law: Law, F: Array) -> Array:
        return _symmetric_part(_transposed(rotations(F)) @ law.P(F))

    def first_piola_stress(self, F: Array, H: Array) -> Array:
        V, sums = self._stretch_axes_and_sums(F)
        found: Array = 2.0 * F @ (V @ (_transposed(V) @ H @ V / sums) @ _transposed(V))
        return found

    def add_tangent(self, F: Array, H: Array, A: Array) -> None:
        V, sums = self._stretch_axes_and_sums(F)
        X = _transposed(V) @ H @ V / sums
        T: Any = np.zeros((len(F), 3, 3, 3, 3))  # dX by dC, in the axes of U
        for a in range(3):
            T[:, a, :, a, :] -= X / sums[:, a, None, :]
            T[:, :, a, :, a] -= X / sums[:, None, :, a]
        T /= sums[:, :, :, None, None]
        T = 0.5 * (T + T.transpose(0, 1, 2, 4, 3))
        FV = F @ V
        A += 4.0 * np.einsum("nia,nabcd,nkc,nJb,nLd->niJkL", FV, T, FV, V, V, optimize=True)
        whole = 2.0 * V @ X @ _transposed(V)
        for i in range(3):
            A[:, i, :, i, :] += whole

    @staticmethod
    def _stretch_axes_and_sums(F: Array) -> tuple[Array, Array]:
        """Return the axes of U as columns (n, 3, 3), and s_i + s_j (n, 3, 3), at least FLOOR."""
        s, V = np.linalg.eigh(_symmetric_part(_transposed(rotations(F)) @ F))
        return V, np.maximum(s[:, :, None] + s[:, None, :], FLOOR)


def _transposed(A: Array) -> Array:
    return A.swapaxes(1, 2)


def _symmetric_part(A: Array) -> Array:
    found: Array = 0.5 * (A + _transposed(A))
    return found
