"""Corotational law: small strain measured in a frame that rotates with the material."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from softmark.records import dataclass
from softmark.solvers.materials.batching import BatchedLaw, tensors
from softmark.solvers.materials.polar_decomposition import rotation, spectrum, stretch
from softmark.solvers.materials.tensor_components import (
    add_diagonal,
    add_identity,
    add_outer,
    cofactor,
    determinant,
    inner,
    product,
    set_outer,
    trace,
    transposed,
)
from softmark.solvers.runtime.scalar_or_array import expm1

if TYPE_CHECKING:
    import numpy as np

    from softmark.solvers.materials.constitutive_law import Array
    from softmark.solvers.materials.principal_axes_law import Principal
else:
    from softmark.solvers.runtime.lazy_modules import np

FLOOR = 1e-6  # smallest divisor s_i + s_j in dR/dF; it is 2 at rest


@dataclass(frozen=True)
class Corotational(BatchedLaw):
    """Corotational energy: mu |F - R|^2 + lam/2 tr(R^T F - I)^2, with R the rotation nearest to F.

    mu and lam are the moduli at rest, Pa. P = 2 mu (F - R) + lam tr(R^T F - I) R: Hooke's law in the frame of R, with
    stress linear in stretch, and finite energy for flat or inverted states. If the sum of the two smallest principal
    stretches vanishes, s2 + s3 = 0, R is not unique: it jumps there and its derivative is unbounded. Denominators s_i +
    s_j are kept above FLOOR.
    Source: McAdams et al. (2011), "Efficient elasticity for character skinning with contact and collisions"; its
    derivative: Smith, De Goes, Kim (2019), "Analytic eigensystems for isotropic distortion energies".
    """

    mu: float
    lam: float

    def _psi(self, f: Array) -> Array:
        r = rotation(f)
        d = f - r
        t = inner(r, d)  # tr(R^T F - I)
        return self.mu * inner(d, d) + 0.5 * self.lam * t * t

    def _P(self, f: Array) -> Array:
        r = rotation(f)
        d = f - r
        t = inner(r, d)
        d *= 2.0 * self.mu
        r *= self.lam * t
        d += r
        return d

    def _dPdF(self, f: Array, H: Array) -> None:
        """Write the tangent 2 mu dF + lam (R : dF) R + c dR into H, with c = lam tr(S - I) - 2 mu.

        dR/dF = Y_ab T_a (x) T_b (see `_rotation_derivatives`). Derivation: with dR = R [w], R^T dF - dF^T R = [w] S +
        S [w], hence w = Y axial(R^T dF - dF^T R) with Y = (tr S I - S)^-1.
        """
        r = rotation(f)
        sums = _stretch_pair_sums(stretch(r, f))
        self._set_tangent(r, _floored_inverse(sums) * self._twist_factor(f, r), H)

    def principal(self, e: Sequence[Any]) -> Principal:
        """Return psi, tau and d tau/de for logarithmic principal stretches e (see principal_axes_law.py)."""
        h = [expm1(a) for a in e]
        t, s = h[0] + h[1] + h[2], [1.0 + a for a in h]
        tau = [b * (2.0 * self.mu * a + self.lam * t) for a, b in zip(h, s, strict=True)]
        bent = [[self.lam * a * b for b in s] for a in s]
        for a in range(3):
            bent[a][a] = bent[a][a] + tau[a] + 2.0 * self.mu * s[a] * s[a]
        return self.mu * sum(a * a for a in h) + 0.5 * self.lam * t * t, tau, bent

    def dPdF_projected(self, F: Array) -> Array:
        """Return the positive semi-definite 9x9 matrix nearest to dPdF, Pa (m, 3, 3, 3, 3).

        Only the twists can have negative eigenvalues, 2 mu + 2 c/(s_i + s_j): they are clamped at zero. The
        others are 2 mu (five times) and 2 mu + 3 lam = 3 K (the mode R), positive for -1 < nu < 1/2.
        """
        return tensors(F, self._set_projected_tangent)

    def _set_projected_tangent(self, f: Array, H: Array) -> None:
        r = rotation(f)
        sums, axes = spectrum(_stretch_pair_sums(stretch(r, f)))
        twists = np.maximum(self._twist_factor(f, r) / np.maximum(sums, FLOOR), -self.mu)
        self._set_tangent(r, product(axes * twists, transposed(axes)), H)

    def _twist_factor(self, f: Array, r: Array) -> Array:
        """Return c = lam tr(S - I) - 2 mu (m,), which multiplies dR/dF."""
        return self.lam * inner(r, f - r) - 2.0 * self.mu

    def _set_tangent(self, r: Array, y: Array, H: Array) -> None:
        """Write H = 2 mu I + lam R (x) R + y_ab T_a (x) T_b, on and above the diagonal; y (3, 3, m) is symmetric."""
        rows = r.reshape(9, -1)
        set_outer(H, rows, self.lam * rows)
        _add_twist_products(H, r, y)
        add_identity(H, 2.0 * self.mu)


def add_rotation_derivative(H: Array, f: Array, r: Array, factor: Array) -> None:
    """Add factor dR/dF to H, on and above the diagonal, with r the rotation nearest to f and `factor` (m,)."""
    _add_twist_products(H, r, _floored_inverse(_stretch_pair_sums(stretch(r, f))) * factor)


def _add_twist_products(H: Array, r: Array, y: Array) -> None:
    """Add y_ab T_a (x) T_b to H, on and above the diagonal; y (3, 3, m) is symmetric."""
    T = _rotation_derivatives(r)
    for a in range(3):
        add_outer(H, T[a], y[a, 0] * T[0] + y[a, 1] * T[1] + y[a, 2] * T[2], skip=a)


def _rotation_derivatives(r: Array) -> Array:
    """Return T_a = R [e_a] (3, 9, m), a = 0, 1, 2: the derivatives of R about its axes; T_a : T_b = 2 delta_ab."""
    T = np.zeros((3, *r.shape), dtype=r.dtype)
    for a, b, c in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        T[a, :, b] = r[:, c]
        T[a, :, c] = -r[:, b]
    return T.reshape(3, 9, -1)


def _stretch_pair_sums(s: Array) -> Array:
    """Return tr S I - S (3, 3, m), whose eigenvalues are the sums s_i + s_j of two principal stretches."""
    return add_diagonal(-s, trace(s))


def _floored_inverse(a: Array) -> Array:
    """Return A^-1 (3, 3, m) of symmetric A >= 0, whose eigenvalues below FLOOR are raised to FLOOR.

    If det A > FLOOR (tr A / 2)^2, all eigenvalues lie above FLOOR.
    """
    cof = cofactor(a)
    det = determinant(a, cof)
    low = np.flatnonzero(~(det > FLOOR * (0.5 * trace(a)) ** 2))
    cof /= det
    if len(low):
        w, v = spectrum(a[:, :, low])
        cof[:, :, low] = product(v / np.maximum(w, FLOOR), transposed(v))
    return cof
