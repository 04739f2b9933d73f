"""Polar decomposition: the rotation nearest to F and the principal axes of F, for every F, flat or inverted too.

F = R S with det R = +1 and S symmetric. If det F < 0 the smallest principal stretch is negative (Irving, Teran, Fedkiw
2004): R is still the rotation that maximises tr(R^T F), and is continuous through inversion.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from softmark.solvers.materials.tensor_components import (
    add_diagonal,
    cofactor,
    components,
    determinant,
    inner,
    product,
    transposed,
)
from softmark.solvers.runtime.work_count import count_principal_stretches

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from softmark.solvers.materials.constitutive_law import Array
else:
    from softmark.solvers.runtime.lazy_modules import np

GAP = 1e-6  # bound of (s1 + s2)(s2 + s3)(s3 + s1) / |F|^3: below it the SVD is used
FINE = 1e-7  # size of a step or defect whose square is below round-off: one more step suffices


def rotations(F: Array) -> Array:
    """Return the rotations (m, 3, 3) nearest to F (m, 3, 3)."""
    return np.ascontiguousarray(rotation(components(F)).transpose(2, 0, 1))


def rotation(f: Array) -> Array:
    """Return R (3, 3, m), the rotation nearest to F (3, 3, m); its error is a few rounding errors / (s2 + s3).

    With g = F/|F| and the invariants I, II, III of S: R (I II - III) = I cof g + (I^2 - II) g - g g^T g, by
    Cayley-Hamilton, where I = s1 + s2 + s3 is the largest root of a quartic (Lin, Chitalu, Komura 2022, "Isotropic ARAP
    energy using Cauchy-Green invariants"). An error of I leaves R times a symmetric matrix, which one Newton-Schulz
    step removes. Rows near the singular set s2 + s3 = 0, where R is not unique, are decomposed one by one. NaN if F is
    not finite.
    """
    norm = np.sqrt(inner(f, f))
    g = f / norm
    cof = cofactor(g)
    I, gap, step = _solve_stretch_sum(cof, determinant(g, cof))
    r = cof * I
    r += g * (0.5 * (I * I + 1.0))  # I^2 - II, as II = (I^2 - |g|^2)/2
    r -= product(g, product(transposed(g), g))
    r /= gap
    defect = _orthonormalise(r)
    fine = _relative_tolerance(f)
    regular = (gap > GAP) & (step < 10.0 * fine) & (defect < fine)
    if not regular.all():
        finite = np.isfinite(norm)
        r[:, :, ~finite] = np.nan
        _set_rotation_by_svd(f, r, np.flatnonzero(~regular & finite))
    return r


def _relative_tolerance(a: Array) -> float:
    return max(FINE, 8.0 * float(np.finfo(a.dtype).eps))


def _solve_stretch_sum(cof: Array, det: Array) -> tuple[Array, Array, Array]:
    """Return I = s1 + s2 + s3 (m,) for |g| = 1, then I II - III, and the last Newton step.

    I is the largest root of (x^2 - 1)^2 = 8 det x + 4 |cof|^2. All four roots +-s1 +-s2 +-s3 (even number of minuses)
    are real, so that Newton's method cannot overshoot from above. It starts from the bound x <= sqrt(3).
    """
    q = 4.0 * inner(cof, cof)
    x = np.sqrt(1.0 + np.sqrt(q + 8.0 * np.sqrt(3.0) * np.maximum(det, 0.0)))
    fine = _relative_tolerance(x)
    for _ in range(12):
        y = x * x - 1.0
        step = (y * y - 8.0 * det * x - q) / (4.0 * x * y - 8.0 * det)
        x -= step
        if not (np.abs(step) > fine).any():
            break
    return x, 0.5 * x * (x * x - 1.0) - det, np.abs(step)


def _orthonormalise(r: Array) -> Array:
    """Iterate R <- R (3 I - R^T R)/2 in place until R is orthonormal.

    Return |R^T R - I| (m,) before the last step.
    """
    for _ in range(3):
        e = add_diagonal(product(transposed(r), r), -1.0)
        r -= 0.5 * product(r, e)
        defect: Array = np.abs(e).reshape(9, -1).max(axis=0)
        if not (defect > 1e-8).any():  # quadratic convergence: the remaining defect is below round-off
            break
    return defect


def _set_rotation_by_svd(f: Array, r: Array, rows: NDArray[np.intp]) -> None:
    """Set R = U V^T of the singular value decomposition in place, with the last axis reversed if det (U V^T) = -1."""
    if len(rows):
        U, _, Vt = np.linalg.svd(f[:, :, rows].transpose(2, 0, 1))
        U[:, :, 2] *= np.sign(np.linalg.det(U) * np.linalg.det(Vt))[:, None]
        r[:, :, rows] = components(U @ Vt)


def stretch(r: Array, f: Array) -> Array:
    """Return the right stretch tensor S = R^T F (3, 3, m), made exactly symmetric."""
    s = product(transposed(r), f)
    return 0.5 * (s + transposed(s))


def stretches(f: Array) -> Array:
    """Return the principal stretches (3, m) of f (3, 3, m), unordered, in double precision."""
    found: Array = np.sqrt(np.maximum(spectrum(np.einsum("iJm,iKm->JKm", f, f))[0], 0.0)) * np.ones((3, 1))
    return found


def spectrum(a: Array) -> tuple[Array, Array]:
    """Return eigenvalues (3, m), unordered, and eigenvectors v[:, k] (3, 3, m) of symmetric a (3, 3, m).

    Cyclic Jacobi rotations (Golub, Van Loan 2013, section 8.5): accurate to round-off of |a| even for repeated
    eigenvalues, unlike closed forms.
    """
    count_principal_stretches(a.shape[-1])
    a = a.copy()
    v = add_diagonal(np.zeros_like(a), 1.0)
    floor = 0.45 * np.finfo(a.dtype).eps * np.sqrt(inner(a, a))
    for _ in range(8):
        for p, q, other in ((0, 1, 2), (0, 2, 1), (1, 2, 0)):
            _annihilate_entry(a, v, p, q, other)
        if not (np.abs(a[0, 1]) + np.abs(a[0, 2]) + np.abs(a[1, 2]) > floor).any():
            break
    return np.stack((a[0, 0], a[1, 1], a[2, 2])), v


def _annihilate_entry(a: Array, v: Array, p: int, q: int, other: int) -> None:
    """Apply one Jacobi rotation of the p-q plane that makes a_pq zero; only the upper triangle of a is kept."""
    apq = a[p, q].copy()
    d = a[q, q] - a[p, p]
    tiny = np.finfo(a.dtype).tiny  # avoids 0/0 if a matrix is already diagonal
    t = 2.0 * apq / (d + np.copysign(np.sqrt(d * d + 4.0 * apq * apq + tiny), d))
    c = 1.0 / np.sqrt(1.0 + t * t)
    s = t * c
    a[p, p] -= t * apq
    a[q, q] += t * apq
    a[p, q] = 0.0
    _rotate_rows(_symmetric_entry(a, p, other), _symmetric_entry(a, q, other), c, s)
    _rotate_rows(v[:, p], v[:, q], c, s)


def _symmetric_entry(a: Array, i: int, j: int) -> Array:
    """Return the stored copy of a_ij = a_ji."""
    entry: Array = a[min(i, j), max(i, j)]
    return entry


def _rotate_rows(x: Array, y: Array, c: Array, s: Array) -> None:
    """Rotate rows in place: (x, y) <- (c x - s y, s x + c y)."""
    old = x.copy()
    x *= c
    x -= s * y
    y *= c
    y += s * old


def least_stretch(F: Array) -> float:
    """Return the smallest principal stretch among deformation gradients (n, 3, 3), negative if one is inverted."""
    least = np.sqrt(np.maximum(np.linalg.eigvalsh(F.transpose(0, 2, 1) @ F)[:, 0], 0.0))
    return float((np.sign(np.linalg.det(F)) * least).min(initial=1.0))
