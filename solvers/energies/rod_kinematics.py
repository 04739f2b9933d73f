"""Strains of a two-node geometrically exact rod, with their first and second derivatives.

One element runs from node a to node b. A node carries a position x and a unit quaternion q (scalar first) that turns
the material axes (e1 along the rod, e2 and e3 in the cross-section) into space. All arrays hold one row per element.

Both strain measures are functions of the four vectors (x_a, q_a, x_b, q_b) in R^14, homogeneous of degree zero in
their quaternion arguments, and are differentiated there; `tangents` then maps increments of the 12 degrees of
freedom to R^14. So a new strain measure needs its derivatives in R^14 only.

Sources: Simo & Vu-Quoc 1986 (strains), Crisfield & Jelenic 1999 (why relative rotations keep the strains objective),
Absil, Mahony & Sepulchre 2008, chapter 5 (Hessian on a sphere embedded in R^4).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


def _hamilton() -> Array:
    """Structure constants of the quaternions: (p q)_j = H[j, m, n] p_m q_n."""
    H = np.zeros((4, 4, 4))
    H[0] = np.diag([1.0, -1.0, -1.0, -1.0])
    for i, j, k in ((1, 2, 3), (2, 3, 1), (3, 1, 2)):
        H[i, 0, i] = H[i, i, 0] = 1.0
        H[i, j, k], H[i, k, j] = 1.0, -1.0
    return H


_CONJUGATE = np.array([1.0, -1.0, -1.0, -1.0])
_PRODUCT = _hamilton()
_RELATIVE = _PRODUCT * _CONJUGATE[:, None]  # conj(p) q, (4, 4, 4)
_SANDWICH = np.einsum("kan,n,ami->kimn", _PRODUCT[1:], _CONJUGATE, _PRODUCT[:, :, 1:])  # p v conj(p)
_ROTATION = (_SANDWICH + _SANDWICH.swapaxes(2, 3)) / 2  # R_ki = _ROTATION[k, i, m, n] p_m p_n

_TERMS = np.arange(16)
_SIGNED = (-1.0) ** _TERMS / (2 * _TERMS + 1)  # atan(w) / w = sum of _SIGNED[k] w^(2k)
_SIGNED_1 = (_SIGNED * _TERMS)[1:]
_SIGNED_2 = (_SIGNED * _TERMS * (_TERMS - 1))[2:]
_SMALL = 0.05  # of tan^2 of half the angle: below, 16 terms leave 1e-20; above, the closed form loses 3 digits at most


def product(p: Array, q: Array) -> Array:
    """Hamilton product p q of quaternions (..., 4), scalar first."""
    return np.asarray(np.einsum("jmn,...m,...n->...j", _PRODUCT, p, q))


def conjugate(q: Array) -> Array:
    """The inverse of unit quaternions (..., 4)."""
    return q * _CONJUGATE


def rotation(q: Array) -> Array:
    """Rotation matrices (..., 3, 3) of unit quaternions (..., 4); R scales with |q|^2 otherwise."""
    return np.asarray(np.einsum("kimn,...m,...n->...ki", _ROTATION, q, q))


def quaternion(R: Array) -> Array:
    """Unit quaternions (..., 4) of rotation matrices (..., 3, 3), scalar not negative.

    4 q q^T is linear in R; its column under the largest diagonal entry is q without loss of digits
    (Shepperd 1978).
    """
    outer = np.einsum("kimn,...ki->...mn", _ROTATION, R) + np.eye(4)  # (..., 4, 4)
    largest = np.argmax(np.diagonal(outer, axis1=-2, axis2=-1), axis=-1)
    q = np.take_along_axis(outer, largest[..., None, None], axis=-1)[..., 0]
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    return np.asarray(np.where(q[..., :1] < 0.0, -q, q))


def exponential(phi: Array) -> Array:
    """Unit quaternions (..., 4) of rotation vectors (..., 3) in rad: (cos |phi|/2, sin(|phi|/2) phi/|phi|)."""
    angle = np.linalg.norm(phi, axis=-1, keepdims=True)
    return np.concatenate([np.cos(angle / 2), np.sinc(angle / (2 * np.pi)) / 2 * phi], axis=-1)


def logarithm(q: Array) -> Array:
    """Rotation vectors (..., 3) in rad, of length at most pi, of quaternions (..., 4)."""
    c = np.where(q[..., :1] < 0.0, -q, q)
    return np.asarray(2 * _angle(c)[0][..., None] * c[..., 1:])


def between(q_a: Array, q_b: Array, t: Array) -> Array:
    """Geodesic interpolation (..., 4) of rotations: q_a at t = 0, q_b at t = 1 (Shoemake 1985)."""
    return product(q_a, exponential(t[..., None] * logarithm(product(conjugate(q_a), q_b))))


def _angle(c: Array) -> tuple[Array, Array, Array]:
    """h = atan2(|v|, s) / |v| for c = (s, v), s >= 0, with dh/dm and d2h/dm2, m = |v|^2."""
    s, m = c[..., 0], np.sum(c[..., 1:] ** 2, axis=-1)
    small = m < _SMALL * s**2
    near, far = np.where(small, s, 1.0), np.where(small, 1.0, m)
    z = np.where(small, m / near**2, 0.0)
    polynomial = np.polynomial.polynomial.polyval
    r2 = s**2 + far
    h = np.arctan2(np.sqrt(far), s) / np.sqrt(far)
    h_m = (s / r2 - h) / (2 * far)
    h_mm = (-s / r2**2 - 3 * h_m) / (2 * far)
    return (
        np.where(small, polynomial(z, _SIGNED) / near, h),
        np.where(small, polynomial(z, _SIGNED_1) / near**3, h_m),
        np.where(small, polynomial(z, _SIGNED_2) / near**5, h_mm),
    )


@dataclass(frozen=True)
class Segments:
    """Elements of a rod in one state: strains and their derivatives at the middle of each.

    With p = q_a + q_b (the geodesic middle of the two rotations, once normalised) and c = conj(q_a) q_b:

        Gamma = R(p)^T (x_b - x_a) / (l |p|^2)      stretch and shears, e1 when straight and unstrained
        K     = 2 atan2(|v|, s) v / (|v| l)          twist and curvatures in 1/m, c = (s, v)

    The sign of q_b is that which makes s >= 0. `l` are the undeformed lengths in m.
    """

    d: Array  # x_b - x_a (n, 3)
    q_a: Array  # (n, 4)
    q_b: Array  # (n, 4)
    l: Array  # (n,)

    @staticmethod
    def of(x: Array, elements: Indices, l: Array) -> Segments:
        """The elements (n, 2) of the state x (nodes * 7,)."""
        a, b = (x.reshape(-1, 7)[elements[:, i]] for i in (0, 1))
        sign = np.where(np.sum(a[:, 3:] * b[:, 3:], axis=1) < 0.0, -1.0, 1.0)
        return Segments(b[:, :3] - a[:, :3], a[:, 3:], b[:, 3:] * sign[:, None], l)

    @cached_property
    def p(self) -> Array:
        return self.q_a + self.q_b  # (n, 4)

    @cached_property
    def rho(self) -> Array:
        return np.sum(self.p**2, axis=1)  # |p|^2, (n,)

    @cached_property
    def c(self) -> Array:
        return np.asarray(np.einsum("jmn,em,en->ej", _RELATIVE, self.q_a, self.q_b))  # (n, 4)

    @cached_property
    def h(self) -> tuple[Array, Array, Array]:
        return _angle(self.c)

    @cached_property
    def strains(self) -> Array:
        """(Gamma, K), (n, 6)."""
        Gamma = np.einsum("eki,ek->ei", rotation(self.p), self.d) / self.rho[:, None]
        theta = 2 * self.h[0][:, None] * self.c[:, 1:]
        return np.concatenate([Gamma, theta], axis=1) / self.l[:, None]

    @cached_property
    def _dc(self) -> tuple[Array, Array]:
        """dc/dq_a and dc/dq_b, (n, 4, 4)."""
        return (
            np.asarray(np.einsum("jmn,en->ejm", _RELATIVE, self.q_b)),
            np.asarray(np.einsum("jmn,em->ejn", _RELATIVE, self.q_a)),
        )

    @cached_property
    def _dGamma(self) -> tuple[Array, Array]:
        """d(l Gamma)/dd (n, 3, 3) and d(l Gamma)/dp (n, 3, 4)."""
        numerator = 2 * np.einsum("kimn,ek,en->eim", _ROTATION, self.d, self.p)
        l_Gamma = self.strains[:, :3] * self.l[:, None]
        rho = self.rho[:, None, None]
        dp = (numerator - 2 * l_Gamma[:, :, None] * self.p[:, None, :]) / rho
        return rotation(self.p).swapaxes(1, 2) / rho, dp

    @cached_property
    def _dtheta(self) -> Array:
        """d(l K)/dc, (n, 3, 4)."""
        h, h_m, _ = self.h
        v = self.c[:, 1:]
        ds = -2 * v / np.sum(self.c**2, axis=1)[:, None]
        dv = 2 * h[:, None, None] * np.eye(3) + 4 * h_m[:, None, None] * v[:, :, None] * v[:, None, :]
        return np.concatenate([ds[:, :, None], dv], axis=2)

    @cached_property
    def gradients(self) -> Array:
        """d(Gamma, K)/d(x_a, q_a, x_b, q_b), (n, 6, 14)."""
        B = np.zeros((len(self.l), 6, 14))
        dd, dp = self._dGamma
        B[:, :3, 0:3], B[:, :3, 7:10] = -dd, dd
        B[:, :3, 3:7] = B[:, :3, 10:14] = dp
        B[:, 3:, 3:7], B[:, 3:, 10:14] = (self._dtheta @ dc for dc in self._dc)
        return B / self.l[:, None, None]

    def hessians(self, sigma: Array) -> Array:
        """Sum of sigma_i times the second derivative of strain i, (n, 14, 14), for sigma (n, 6)."""
        H = np.zeros((len(self.l), 14, 14))
        self._add_force_part(H, sigma[:, :3])
        self._add_moment_part(H, sigma[:, 3:])
        return H / self.l[:, None, None]

    def _add_force_part(self, H: Array, force: Array) -> None:
        """With N = rho u for u = l Gamma: u_mn = (N_mn - u_m rho_n - rho_m u_n - u rho_mn) / rho."""
        dd, dp = self._dGamma
        rho, p = self.rho[:, None, None], self.p
        u = np.sum(force * self.strains[:, :3], axis=1) * self.l  # (n,)
        u_d = np.einsum("ei,eik->ek", force, dd)
        u_p = np.einsum("ei,eim->em", force, dp)
        N_dp = 2 * np.einsum("kimn,ei,en->ekm", _ROTATION, force, p)
        N_pp = 2 * np.einsum("kimn,ei,ek->emn", _ROTATION, force, self.d)
        dp = (N_dp - 2 * u_d[:, :, None] * p[:, None, :]) / rho
        mixed = 2 * u_p[:, :, None] * p[:, None, :]
        pp = (N_pp - mixed - mixed.swapaxes(1, 2) - 2 * u[:, None, None] * np.eye(4)) / rho
        for quaternion_a in (slice(3, 7), slice(10, 14)):
            for position, sign in ((slice(0, 3), -1.0), (slice(7, 10), 1.0)):
                H[:, position, quaternion_a] += sign * dp
                H[:, quaternion_a, position] += sign * dp.swapaxes(1, 2)
            for quaternion_b in (slice(3, 7), slice(10, 14)):
                H[:, quaternion_a, quaternion_b] += pp

    def _add_moment_part(self, H: Array, moment: Array) -> None:
        """The bilinear c(q_a, q_b) adds dtheta/dc times its own mixed derivative to the blocks (a, b), (b, a)."""
        W = self._theta_hessian(moment)
        t = np.einsum("ei,eij->ej", moment, self._dtheta)
        dc_a, dc_b = self._dc
        ab = dc_a.swapaxes(1, 2) @ W @ dc_b + np.einsum("ej,jmn->emn", t, _RELATIVE)
        H[:, 3:7, 3:7] += dc_a.swapaxes(1, 2) @ W @ dc_a
        H[:, 3:7, 10:14] += ab
        H[:, 10:14, 3:7] += ab.swapaxes(1, 2)
        H[:, 10:14, 10:14] += dc_b.swapaxes(1, 2) @ W @ dc_b

    def _theta_hessian(self, moment: Array) -> Array:
        """Second derivative of moment . theta, theta = 2 h(s, |v|^2) v, in c = (s, v): (n, 4, 4)."""
        s, v = self.c[:, 0], self.c[:, 1:]
        _, h_m, h_mm = (f[:, None, None] for f in self.h)
        r2 = np.sum(self.c**2, axis=1)
        a = np.sum(moment * v, axis=1)
        W = np.empty((len(self.l), 4, 4))
        W[:, 0, 0] = 4 * a * s / r2**2
        W[:, 0, 1:] = W[:, 1:, 0] = (-2 * moment + 4 * (a / r2)[:, None] * v) / r2[:, None]
        mixed = moment[:, :, None] * v[:, None, :]
        vv = v[:, :, None] * v[:, None, :]
        W[:, 1:, 1:] = 4 * h_m * (mixed + mixed.swapaxes(1, 2) + a[:, None, None] * np.eye(3))
        W[:, 1:, 1:] += 8 * h_mm * a[:, None, None] * vv
        return W

    @cached_property
    def tangents(self) -> Array:
        """d(x_a, q_a, x_b, q_b)/d(12 degrees of freedom), (n, 14, 12).

        A node's six are a displacement in space and a rotation vector phi about the material axes, q exp(phi/2).
        """
        T = np.zeros((len(self.l), 14, 12))
        T[:, 0:3, 0:3] = T[:, 7:10, 6:9] = np.eye(3)
        for rows, columns, q in ((slice(3, 7), slice(3, 6), self.q_a), (slice(10, 14), slice(9, 12), self.q_b)):
            T[:, rows, columns] = np.einsum("jmn,em->ejn", _PRODUCT[:, :, 1:], q) / 2
        return T

    def project_hessian(self, g: Array, H: Array) -> Array:
        """Second derivative in the 12 degrees of freedom, (n, 12, 12), of a function with g (n, 14), H (n, 14, 14).

        q exp(phi/2) = q + T phi - |phi|^2 q / 8 + ..., so each node adds -(g_q . q) / 4 to its rotational diagonal.
        """
        local = self.tangents.swapaxes(1, 2) @ H @ self.tangents
        for columns, q, g_q in ((slice(3, 6), self.q_a, g[:, 3:7]), (slice(9, 12), self.q_b, g[:, 10:14])):
            local[:, columns, columns] -= np.sum(g_q * q, axis=1)[:, None, None] / 4 * np.eye(3)
        return np.asarray(local)
