"""Stored and dissipated energy of Maxwell branches (terms of a Prony series) at finite strain.

With Q = g S(0) - H, the stress that a branch has lost, the branch law is dQ/dt = (g S(0) - Q) / tau. Let q = Q/g. The
energy of the branch, divided by its share g, is W(C) - q : C/2 + sup over C' of (q : C'/2 - W(C')). For an isochoric W,
the C' have unit determinant. The supremum is attained at the C' in which the branch is at rest, and the dissipation is
(C - C') : (S(0)(C) - q) / 2 tau. It is never negative if every C is at rest under its own stress. That holds for convex
W that increases with the isochoric I1, with C' = lam (2 W' 1 - q)^-1 (`FirstInvariantBranch`). S is the stress of the
isochoric strain in strain_measures.py.
Source: the free energy of Simo (1987), equation 3.12, with the energy of Q chosen so that no state of rest dissipates.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from softmark.records import dataclass
from softmark.solvers.materials.isochoric_invariants import IsochoricInvariantMaterial
from softmark.solvers.materials.neo_hookean_isochoric import NeoHookeanIsochoric

if TYPE_CHECKING:
    import numpy as np

    from softmark.solvers.materials.constitutive_law import Array, Law
else:
    from softmark.solvers.runtime.lazy_modules import np

DOUBLED = 60  # largest number of doublings of a bracket of I1 - 3
HALVED = 100  # largest number of bisections


@dataclass(frozen=True)
class FirstInvariantBranch:
    """Branch energy of a law W(i), where i = I1 - 3 of the isochoric C.

    `energy` is W (n,), J/m^3, and `slope` twice its derivative, Pa, as functions of i; both are NaN outside the domain.
    """

    energy: Callable[[Array], Array]
    slope: Callable[[Array], Array]
    even: bool  # constant slope
    is_isochoric = True

    def stress(self, C: Array) -> Array:
        """Return the instantaneous stress S(0) (n, 3, 3), Pa, at C (n, 3, 3)."""
        i = np.einsum("nii->n", C) - 3.0
        y = self.slope(i)[:, None, None]
        found: Array = y * (np.eye(3) - (i[:, None, None] / 3.0 + 1.0) * np.linalg.inv(C))
        return found

    def rest_strain(self, q: Array) -> Array:
        """Return the strain C' (n, 3, 3) in which a branch with lost stress q (n, 3, 3), Pa, is at rest."""
        values, axes = np.linalg.eigh(q)
        y = self.slope(np.zeros(len(q))) if self.even else self._rest_slopes(values)
        each = 1.0 / (y[:, None] - values)
        each /= np.cbrt(each.prod(axis=1))[:, None]
        found: Array = (axes * each[:, None, :]) @ axes.swapaxes(1, 2)
        return found

    def _rest_slopes(self, q: Array) -> Array:
        """Return 2 W' (n,), Pa, at the strain C' in which a branch is at rest, by bisection for a consistent I1.

        q (n, 3), Pa, are the eigenvalues of the lost stress. I1 of C' must agree with the argument of W'.
        """

        def above(i: Array) -> Array:  # True if I1 of the resulting C' exceeds i + 3
            with np.errstate(all="ignore"):
                y = self.slope(i)
                each = 1.0 / (y[:, None] - q)
                own = each.sum(axis=1) / np.cbrt(each.prod(axis=1)) - 3.0
                found: Array = np.isfinite(y) & ((y <= q[:, 2]) | (own > i))
            return found

        low, high = np.zeros(len(q)), np.full(len(q), 1.0)
        for _ in range(DOUBLED):
            if not (more := above(high)).any():
                break
            low, high = np.where(more, high, low), np.where(more, 2.0 * high, high)
        for _ in range(HALVED):
            half = 0.5 * (low + high)
            if ((half <= low) | (half >= high)).all():
                break
            up = above(half)
            low, high = np.where(up, half, low), np.where(up, high, half)
        return self.slope(low)

    def stored(self, C: Array, q: Array) -> Array:
        """Return the stored energy per unit share (n,), J/m^3, for C (n, 3, 3) and lost stress q (n, 3, 3), Pa."""
        rest = self.rest_strain(q)
        i, j = (np.einsum("nii->n", A) - 3.0 for A in (C, rest))
        found: Array = self.energy(i) - self.energy(j) - 0.5 * np.einsum("nij,nij->n", q, C - rest)
        return np.maximum(found, 0.0)  # negative only by rounding

    def dissipation_times_tau(self, C: Array, q: Array) -> Array:
        """Return the dissipated power of a branch times tau, divided by its share (n,), J/m^3.

        It is (C - C') : (S(0)(C) - q)/2 >= 0, with C' the strain at rest under the lost stress q (n, 3, 3), Pa.
        """
        found: Array = 0.5 * np.einsum("nij,nij->n", C - self.rest_strain(q), self.stress(C) - q)
        return np.maximum(found, 0.0)  # negative only by rounding


@dataclass(frozen=True)
class IsotropicBranch:
    """Branch energy of any isotropic `law`, by Newton's method for the strain C' in which the branch is at rest.

    C' has the axes of the lost stress q, and its stretches are the unknowns: two for an isochoric law (`keeps`),
    otherwise three. If no solution is found, for example where the law is not convex, stored and dissipated energy are
    NaN.
    """

    law: Law
    mu: float
    is_isochoric: bool

    def stored(self, C: Array, q: Array) -> Array:
        """Return the stored energy per unit share (n,), J/m^3, for C (n, 3, 3) and lost stress q (n, 3, 3), Pa."""
        e, rest = self._rest_tensor(q)
        own = self.law.psi(_matrix_square_root(C)) - self.law.psi(_diagonal_matrices(np.exp(0.5 * e)))
        found: Array = own - 0.5 * np.einsum("nij,nij->n", q, C - rest)
        return found

    def dissipation_times_tau(self, C: Array, q: Array) -> Array:
        """Return the dissipated power of a branch times tau, divided by its share (n,), J/m^3.

        It is (C - C') : (S(0)(C) - q)/2, with C' the strain at rest under the lost stress q (n, 3, 3), Pa.
        """
        F = _matrix_square_root(C)
        S = np.linalg.solve(F, self.law.P(F))
        found: Array = 0.5 * np.einsum("nij,nij->n", C - self._rest_tensor(q)[1], S - q)
        return found

    def _rest_tensor(self, q: Array) -> tuple[Array, Array]:
        """Return the strain C' (n, 3, 3) in which a branch is at rest, after the logarithms of its eigenvalues (n, 3).

        q (n, 3, 3), Pa, is the lost stress.
        """
        values, axes = np.linalg.eigh(q)
        with np.errstate(all="ignore"):
            e = self._log_eigenvalues(values)
        return e, (axes * np.exp(e)[:, None, :]) @ axes.swapaxes(1, 2)

    def _log_eigenvalues(self, q: Array) -> Array:
        """Return logarithms of the eigenvalues of C' (n, 3), the strain at rest, from those of q (n, 3), Pa."""
        ways = np.array(ACROSS if self.is_isochoric else (*ACROSS, ALL))
        e, found = np.zeros_like(q), np.zeros(len(q), dtype=bool)
        for _ in range(STEPS):
            slope = self._potential_derivative(e, q)
            sides = [(self._potential_derivative(e + NEAR * way, q) - slope) / NEAR for way in ways]
            g, K = slope @ ways.T, np.stack([side @ ways.T for side in sides], axis=2)
            low, V = np.linalg.eigh(np.nan_to_num(0.5 * (K + K.swapaxes(1, 2))))
            size = self.mu + np.abs(q).max(axis=1)
            found = (np.abs(slope).max(axis=1) <= FLAT * size) & (low.min(axis=1) > 0.0)
            if found.all():
                break
            step = -np.einsum("nab,nb,ncb,nc->na", V, 1.0 / np.maximum(np.abs(low), SOFT * self.mu), V, g)
            step *= np.minimum(1.0, FAR / np.maximum(np.abs(step).max(axis=1), FAR))[:, None]
            e = e + np.where(found[:, None], 0.0, step @ ways)
        e[~found] = np.nan
        return e

    def _potential_derivative(self, e: Array, q: Array) -> Array:
        """Return d(W - q : C/2)/de (n, 3), Pa."""
        c = np.exp(e)
        P = self.law.P(_diagonal_matrices(np.sqrt(c)))
        found: Array = 0.5 * (np.sqrt(c) * np.einsum("nii->ni", P) - q * c)
        return found - found.mean(axis=1, keepdims=True) if self.is_isochoric else found


# Newton's method of `IsotropicBranch`: iterations, slope, side steps, curvature, step
STEPS, FLAT, NEAR, SOFT, FAR = 40, 1e-9, 1e-6, 1e-3, 0.5
ACROSS = (
    (0.5**0.5, -(0.5**0.5), 0.0),
    (6.0**-0.5, 6.0**-0.5, -2.0 * 6.0**-0.5),
)  # isochoric directions of logarithmic stretches
ALL = (3.0**-0.5, 3.0**-0.5, 3.0**-0.5)


def _diagonal_matrices(values: Array) -> Array:
    found: Array = values[:, :, None] * np.eye(3)
    return found


def _matrix_square_root(C: Array) -> Array:
    """Return the symmetric square root of C (n, 3, 3)."""
    values, axes = np.linalg.eigh(C)
    found: Array = (axes * np.sqrt(values)[:, None, :]) @ axes.swapaxes(1, 2)
    return found


def first_invariant_branch(material: Any) -> FirstInvariantBranch | None:
    """Return the branch energy of a material whose W depends on the first invariant only.

    Return None if W depends on more, or may not be convex and increasing.
    """
    if isinstance(material, NeoHookeanIsochoric):
        mu: float = material.shear_modulus
        return FirstInvariantBranch(lambda i: 0.5 * mu * i, lambda i: np.full(i.shape, mu), True)
    if not isinstance(material, IsochoricInvariantMaterial) or material.second or not material.convex:
        return None
    own: IsochoricInvariantMaterial = material

    def slope(i: Array) -> Array:
        found: Array = 2.0 * np.broadcast_to(own.slopes(i, i)[0], i.shape)
        return found

    return FirstInvariantBranch(lambda i: own.energy(i, i), slope, False)
