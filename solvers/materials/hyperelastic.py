"""Isotropic hyperelastic laws: consequences of psi(Q1 F Q2) = psi(F) for rotations Q1 and Q2.

To add a law, derive a dataclass from `Hyperelastic` and `Isotropic` (in this order) with `_psi`, `_P` and `_dPdF`, and
add one line to MATERIALS.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from softmark.solvers.materials.batching import BatchedLaw, tensors
from softmark.solvers.materials.polar_decomposition import rotation, spectrum, stretch
from softmark.solvers.materials.tensor_components import add_outer, product, transposed

if TYPE_CHECKING:
    import numpy as np

    from softmark.solvers.materials.constitutive_law import Array, Law
else:
    from softmark.solvers.runtime.lazy_modules import np

AXES = [0, 4, 8]  # the entries aa of a 3x3 matrix in a row of nine
PLANES = ((0, 1), (1, 2), (2, 0))


class Hyperelastic(BatchedLaw):
    """An isotropic finite-strain law: P and dPdF rotate with F on either side."""

    def finite_law(self) -> Law | None:
        """Return the law itself."""
        return self

    def dPdF_projected(self, F: Array) -> Array:
        """Return the positive semi-definite 9x9 matrix nearest to dPdF, Pa (m, 3, 3, 3, 3).

        With F = U diag(s) V^T, dPdF(diag s) decomposes into a 3x3 block that couples the three axes and, in each plane
        ab, a twist (u_a v_b - u_b v_a) and a flip (u_a v_b + u_b v_a), each with its own sign. Source: Smith, De Goes,
        Kim (2019), "Analytic eigensystems for isotropic distortion energies".
        """
        return tensors(F, self._projected)

    def _projected(self, f: Array, H: Array) -> None:
        """Write the tangent at f (3, 3, m), with negative eigenvalues set to zero, into H (9, 9, m), upper triangle."""
        r = rotation(f)
        s, v = spectrum(stretch(r, f))
        self._dPdF(_diagonal(s), H)
        axes, twist, flip = _principal_blocks(H)
        H[...] = 0.0
        add_modes(H, product(r, v), v, axes, twist, flip)


def _diagonal(s: Array) -> Array:
    """Return diag(s) (3, 3, m) of s (3, m)."""
    f = np.zeros((3, *s.shape), dtype=s.dtype)
    for a in range(3):
        f[a, a] = s[a]
    return f


def _principal_blocks(H: Array) -> tuple[Array, list[Array], list[Array]]:
    """Return the blocks of the tangent H (9, 9, m) in principal axes, with negative eigenvalues set to zero.

    The first result (3, 3, m) couples the three axes. The others are the eigenvalues of the twist and of the flip in
    each plane of two axes.
    """
    full = H[AXES][:, AXES]
    full[1, 0], full[2, 0], full[2, 1] = full[0, 1], full[0, 2], full[1, 2]
    w, v = spectrum(full)
    axes = product(v * np.maximum(w, 0.0), transposed(v))
    twist, flip = [], []
    for a, b in PLANES:
        ab, ba = sorted((3 * a + b, 3 * b + a))
        twist.append(np.maximum(H[ab, ab] - H[ab, ba], 0.0))
        flip.append(np.maximum(H[ab, ab] + H[ab, ba], 0.0))
    return axes, twist, flip


def add_modes(H: Array, u: Array, v: Array, axes: Array, twist: list[Array], flip: list[Array]) -> None:
    """Add sum axes_ab D_a (x) D_b, with D_a = u_a v_a^T, and the twist and flip modes to H.

    Only entries on and above the diagonal are written.
    """
    D = np.stack([_dyad(u[:, a], v[:, a]) for a in range(3)])  # (3, 9, m)
    for a in range(3):
        add_outer(H, D[a], axes[a, 0] * D[0] + axes[a, 1] * D[1] + axes[a, 2] * D[2])
    for (a, b), t, e in zip(PLANES, twist, flip, strict=True):
        ab, ba = _dyad(u[:, a], v[:, b]), _dyad(u[:, b], v[:, a])
        add_outer(H, ab - ba, 0.5 * t * (ab - ba))
        add_outer(H, ab + ba, 0.5 * e * (ab + ba))


def _dyad(x: Array, y: Array) -> Array:
    """Return x y^T (9, m)."""
    return (x[:, None] * y).reshape(9, -1)
