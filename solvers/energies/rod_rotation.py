"""Rotations as quaternions (scalar first), over arrays of shape (..., 4).

Every product is a contraction with constant arrays, so that the strains of `rod_kinematics` can be differentiated. To
add another parametrisation of rotations, add its conversion from and to quaternions here.
"""

from __future__ import annotations

import numpy as np

from softmark.solvers.energies.energy import Floats


def _hamilton_product_constants() -> Floats:
    """Return the structure constants of the quaternions: (p q)_j = H[j, m, n] p_m q_n."""
    H = np.zeros((4, 4, 4))
    H[0] = np.diag([1.0, -1.0, -1.0, -1.0])
    for i, j, k in ((1, 2, 3), (2, 3, 1), (3, 1, 2)):
        H[i, 0, i] = H[i, i, 0] = 1.0
        H[i, j, k], H[i, k, j] = 1.0, -1.0
    return H


_CONJUGATE = np.array([1.0, -1.0, -1.0, -1.0])
PRODUCT = _hamilton_product_constants()
_SANDWICH = np.einsum("kan,n,ami->kimn", PRODUCT[1:], _CONJUGATE, PRODUCT[:, :, 1:])  # p v conj(p)
ROTATION = (_SANDWICH + _SANDWICH.swapaxes(2, 3)) / 2  # R_ki = ROTATION[k, i, m, n] p_m p_n
# the same, applied to all products of components (16,)
_PRODUCT_OF = PRODUCT.reshape(4, 16).T
_RELATIVE_OF = (PRODUCT * _CONJUGATE[:, None]).reshape(4, 16).T
_ROTATION_OF = ROTATION.reshape(9, 16).T

_TERMS = np.arange(18)
_SIGNED = np.where(_TERMS < 16, (-1.0) ** _TERMS / (2 * _TERMS + 1), 0.0)  # atan(w) / w = sum of _SIGNED[k] w^(2k)
# columns: coefficients of the two derivatives of that series in w^2
_SERIES = np.stack([(_SIGNED * _TERMS)[1:17], (_SIGNED * _TERMS * (_TERMS - 1))[2:18]], axis=1)
# Switch at this tan^2 of half the angle: below it, 16 terms omit less than 1e-18; above, the closed form loses 3
# digits at most.
_SMALL = 0.05


def product(p: Floats, q: Floats) -> Floats:
    """Return the Hamilton product p q of quaternions (..., 4), scalar first."""
    return np.asarray(outer(p, q) @ _PRODUCT_OF)


def relative_rotation(p: Floats, q: Floats) -> Floats:
    """Return conj(p) q of unit quaternions (..., 4): the rotation from p to q in the axes of p."""
    return np.asarray(outer(p, q) @ _RELATIVE_OF)


def outer(a: Floats, b: Floats) -> Floats:
    """Return all products of components of a (..., i) and b (..., j), as an array (..., i * j).

    Rows are contiguous in memory, so that numpy's inner loops are as long as the number of rows.
    """
    if a.ndim != b.ndim:
        lead = np.broadcast_shapes(a.shape[:-1], b.shape[:-1])
        a, b = np.broadcast_to(a, (*lead, a.shape[-1])), np.broadcast_to(b, (*lead, b.shape[-1]))
    products = a.T[:, None] * b.T
    return np.asarray(products.reshape(-1, *products.shape[2:]).T)


def conjugate(q: Floats) -> Floats:
    """Return the inverse of unit quaternions (..., 4)."""
    return np.asarray(q * _CONJUGATE)


def rotation(q: Floats) -> Floats:
    """Return rotation matrices (..., 3, 3) of unit quaternions (..., 4); for other lengths R scales with |q|^2."""
    R = outer(q, q) @ _ROTATION_OF
    return np.asarray(R.reshape(*q.shape[:-1], 3, 3))


def quaternion(R: Floats) -> Floats:
    """Return unit quaternions (..., 4) of rotation matrices (..., 3, 3), with non-negative scalar part.

    4 q q^T is linear in R; the column under its largest diagonal entry gives q without loss of digits (Shepperd 1978).
    """
    outer = np.einsum("kimn,...ki->...mn", ROTATION, R) + np.eye(4)  # (..., 4, 4)
    largest = np.argmax(np.diagonal(outer, axis1=-2, axis2=-1), axis=-1)
    q = np.take_along_axis(outer, largest[..., None, None], axis=-1)[..., 0]
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    return np.asarray(np.where(q[..., :1] < 0.0, -q, q))


def exponential(phi: Floats) -> Floats:
    """Return unit quaternions (cos |phi|/2, sin(|phi|/2) phi/|phi|), (..., 4), of rotation vectors (..., 3), rad."""
    half = np.maximum(np.sqrt(np.einsum("...i,...i->...", phi, phi)) / 2, 1e-20)[..., None]
    return np.concatenate([np.cos(half), np.sin(half) / (2 * half) * phi], axis=-1)


def logarithm(q: Floats) -> Floats:
    """Return rotation vectors (..., 3), rad, at most pi long, of quaternions (..., 4)."""
    c = np.where(q[..., :1] < 0.0, -q, q)
    return np.asarray(2 * half_angle_over_sine(c)[..., None] * c[..., 1:])


def interpolate_rotation(q_a: Floats, q_b: Floats, t: Floats) -> Floats:
    """Return the geodesic interpolation (..., 4) of rotations: q_a at t = 0, q_b at t = 1 (Shoemake 1985)."""
    return product(q_a, exponential(t[..., None] * logarithm(product(conjugate(q_a), q_b))))


def half_angle_over_sine(c: Floats) -> Floats:
    """Return h = atan2(|v|, s) / |v| of quaternions c = (s, v) (..., 4) with s >= 0."""
    v = c[..., 1:]
    size = np.maximum(np.sqrt(np.einsum("...i,...i->...", v, v)), 1e-150)  # lower bound against 0 / 0
    return np.asarray(np.arctan2(size, c[..., 0]) / size)


def half_angle_ratio_derivatives(c: Floats, h: Floats) -> tuple[Floats, Floats]:
    """Return dh/dm and d2h/dm2 of h = `half_angle_over_sine` with m = |v|^2."""
    s, m = c[..., 0], np.einsum("...i,...i->...", c[..., 1:], c[..., 1:])
    squared = s * s
    small = m < _SMALL * squared
    if small.all():  # usual case: segments rotate little
        return _half_angle_series(s, m / squared)
    near, far = np.where(small, s, 1.0), np.where(small, 1.0, m)
    r2 = s**2 + far
    h_m = (s / r2 - h) / (2 * far)
    h_mm = (-s / r2**2 - 3 * h_m) / (2 * far)
    series = _half_angle_series(near, np.where(small, m / near**2, 0.0))
    return np.where(small, series[0], h_m), np.where(small, series[1], h_mm)


def _half_angle_series(s: Floats, z: Floats) -> tuple[Floats, Floats]:
    """Return `half_angle_ratio_derivatives` from power series in z = |v|^2 / s^2, for quaternions (s, v)."""
    powers = np.ones((*z.shape, 16))
    square = z[..., None]
    for k in (1, 2, 4, 8):
        np.multiply(powers[..., :k], square, out=powers[..., k : 2 * k])
        square = square * square
    sums, squared = powers @ _SERIES, s * s
    h_m = sums[..., 0] / (squared * s)
    return h_m, sums[..., 1] / (squared * squared * s)
