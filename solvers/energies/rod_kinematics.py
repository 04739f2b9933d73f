"""Strains of a two-node geometrically exact rod, with their first and second derivatives.

An element runs from node a to node b. A node carries a position x and a unit quaternion q that turns the
material axes (e1 along the rod, e2 and e3 in the cross-section) into space. Arrays hold one row per element.

Both strain measures are functions of the four vectors (x_a, q_a, x_b, q_b) in R^14 and are differentiated
there; `tangents` maps increments of the 12 degrees of freedom to R^14. A new strain measure needs its
derivatives in R^14 and nothing else.

Sources: Simo & Vu-Quoc 1986 (strains), Crisfield & Jelenic 1999 (relative rotations keep the strains
objective and independent of the path), Absil, Mahony & Sepulchre 2008, chapter 5 (Hessian on a sphere
embedded in R^4).
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats, Ints
from softmark.solvers.energies.rod_rotation import PRODUCT, RELATIVE, ROTATION, half_angle, rotation

POSITION_A, ROTATION_A = slice(0, 3), slice(3, 7)  # where the parts of (x_a, q_a, x_b, q_b) stand in R^14
POSITION_B, ROTATION_B = slice(7, 10), slice(10, 14)


@dataclass(frozen=True)
class Segments:
    """Elements of a rod in one state: strains and their derivatives at the middle of each.

    With p = q_a + q_b (the geodesic middle of the two rotations, once normalised) and c = conj(q_a) q_b:

        Gamma = R(p)^T (x_b - x_a) / (l |p|^2)      stretch and shears, e1 when straight and unstrained
        K     = 2 atan2(|v|, s) v / (|v| l)          twist and curvatures in 1/m, c = (s, v)

    The sign of q_b is that which makes s >= 0. `l` are the undeformed lengths in m.
    """

    d: Floats  # x_b - x_a (n, 3)
    q_a: Floats  # (n, 4)
    q_b: Floats  # (n, 4)
    l: Floats  # (n,)

    @staticmethod
    def of(x: Floats, elements: Ints, l: Floats) -> Segments:
        """The elements (n, 2) of the state x (nodes * 7,)."""
        a, b = (x.reshape(-1, 7)[elements[:, i]] for i in (0, 1))
        sign = np.where(np.sum(a[:, 3:] * b[:, 3:], axis=1) < 0.0, -1.0, 1.0)
        return Segments(b[:, :3] - a[:, :3], a[:, 3:], b[:, 3:] * sign[:, None], l)

    @cached_property
    def p(self) -> Floats:
        """Twice the middle of both quaternions, (n, 4)."""
        return np.asarray(self.q_a + self.q_b)

    @cached_property
    def rho(self) -> Floats:
        """|p|^2, (n,)."""
        return np.asarray(np.sum(self.p**2, axis=1))

    @cached_property
    def c(self) -> Floats:
        """The rotation from a to b in the axes of a, (n, 4)."""
        return np.asarray(np.einsum("jmn,em,en->ej", RELATIVE, self.q_a, self.q_b))

    @cached_property
    def h(self) -> tuple[Floats, Floats, Floats]:
        """Half the relative angle over its sine, and two derivatives, each (n,)."""
        return half_angle(self.c)

    @cached_property
    def strains(self) -> Floats:
        """(Gamma, K), (n, 6)."""
        Gamma = np.einsum("eki,ek->ei", rotation(self.p), self.d) / self.rho[:, None]
        theta = 2 * self.h[0][:, None] * self.c[:, 1:]
        return np.concatenate([Gamma, theta], axis=1) / self.l[:, None]

    @cached_property
    def _dc(self) -> tuple[Floats, Floats]:
        """dc/dq_a and dc/dq_b, (n, 4, 4)."""
        return (
            np.asarray(np.einsum("jmn,en->ejm", RELATIVE, self.q_b)),
            np.asarray(np.einsum("jmn,em->ejn", RELATIVE, self.q_a)),
        )

    @cached_property
    def _dGamma(self) -> tuple[Floats, Floats]:
        """d(l Gamma)/dd (n, 3, 3) and d(l Gamma)/dp (n, 3, 4)."""
        numerator = 2 * np.einsum("kimn,ek,en->eim", ROTATION, self.d, self.p)
        l_Gamma = self.strains[:, :3] * self.l[:, None]
        rho = self.rho[:, None, None]
        dp = (numerator - 2 * l_Gamma[:, :, None] * self.p[:, None, :]) / rho
        return rotation(self.p).swapaxes(1, 2) / rho, dp

    @cached_property
    def _dtheta(self) -> Floats:
        """d(l K)/dc, (n, 3, 4)."""
        h, h_m, _ = self.h
        v = self.c[:, 1:]
        ds = -2 * v / np.sum(self.c**2, axis=1)[:, None]
        dv = 2 * h[:, None, None] * np.eye(3) + 4 * h_m[:, None, None] * v[:, :, None] * v[:, None, :]
        return np.concatenate([ds[:, :, None], dv], axis=2)

    @cached_property
    def gradients(self) -> Floats:
        """d(Gamma, K)/d(x_a, q_a, x_b, q_b), (n, 6, 14)."""
        B = np.zeros((len(self.l), 6, 14))
        dd, dp = self._dGamma
        B[:, :3, POSITION_A], B[:, :3, POSITION_B] = -dd, dd
        B[:, :3, ROTATION_A] = B[:, :3, ROTATION_B] = dp
        B[:, 3:, ROTATION_A], B[:, 3:, ROTATION_B] = (self._dtheta @ dc for dc in self._dc)
        return B / self.l[:, None, None]

    def hessians(self, sigma: Floats) -> Floats:
        """Sum of sigma_i times the second derivative of strain i, (n, 14, 14), for sigma (n, 6)."""
        H = np.zeros((len(self.l), 14, 14))
        self._add_force_part(H, sigma[:, :3])
        self._add_moment_part(H, sigma[:, 3:])
        return H / self.l[:, None, None]

    def _add_force_part(self, H: Floats, force: Floats) -> None:
        """With N = rho u for u = l Gamma: u_mn = (N_mn - u_m rho_n - rho_m u_n - u rho_mn) / rho."""
        dd, dp = self._dGamma
        rho, p = self.rho[:, None, None], self.p
        u = np.sum(force * self.strains[:, :3], axis=1) * self.l  # (n,)
        u_d = np.einsum("ei,eik->ek", force, dd)
        u_p = np.einsum("ei,eim->em", force, dp)
        N_dp = 2 * np.einsum("kimn,ei,en->ekm", ROTATION, force, p)
        N_pp = 2 * np.einsum("kimn,ei,ek->emn", ROTATION, force, self.d)
        dp = (N_dp - 2 * u_d[:, :, None] * p[:, None, :]) / rho
        mixed = 2 * u_p[:, :, None] * p[:, None, :]
        pp = (N_pp - mixed - mixed.swapaxes(1, 2) - 2 * u[:, None, None] * np.eye(4)) / rho
        for rotations in (ROTATION_A, ROTATION_B):
            H[:, POSITION_A, rotations] -= dp
            H[:, POSITION_B, rotations] += dp
            H[:, rotations, POSITION_A] -= dp.swapaxes(1, 2)
            H[:, rotations, POSITION_B] += dp.swapaxes(1, 2)
            H[:, rotations, ROTATION_A] += pp
            H[:, rotations, ROTATION_B] += pp

    def _add_moment_part(self, H: Floats, moment: Floats) -> None:
        """The bilinear c(q_a, q_b) has a mixed derivative, which enters the blocks (a, b) and (b, a)."""
        W = self._theta_hessian(moment)
        t = np.einsum("ei,eij->ej", moment, self._dtheta)
        dc_a, dc_b = self._dc
        ab = dc_a.swapaxes(1, 2) @ W @ dc_b + np.einsum("ej,jmn->emn", t, RELATIVE)
        H[:, ROTATION_A, ROTATION_A] += dc_a.swapaxes(1, 2) @ W @ dc_a
        H[:, ROTATION_A, ROTATION_B] += ab
        H[:, ROTATION_B, ROTATION_A] += ab.swapaxes(1, 2)
        H[:, ROTATION_B, ROTATION_B] += dc_b.swapaxes(1, 2) @ W @ dc_b

    def _theta_hessian(self, moment: Floats) -> Floats:
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
    def tangents(self) -> Floats:
        """d(x_a, q_a, x_b, q_b)/d(12 degrees of freedom), (n, 14, 12).

        A node's six are a displacement in space and a rotation vector phi about its material axes: q
        exp(phi/2).
        """
        T = np.zeros((len(self.l), 14, 12))
        T[:, POSITION_A, 0:3] = T[:, POSITION_B, 6:9] = np.eye(3)
        T[:, ROTATION_A, 3:6] = np.einsum("jmn,em->ejn", PRODUCT[:, :, 1:], self.q_a) / 2
        T[:, ROTATION_B, 9:12] = np.einsum("jmn,em->ejn", PRODUCT[:, :, 1:], self.q_b) / 2
        return T

    def project_hessian(self, g: Floats, H: Floats) -> Floats:
        """From first and second derivative in R^14, g and H, to the second in the 12 degrees of freedom.

        q exp(phi/2) = q + T phi - |phi|^2 q / 8 + ..., so each node adds -(g_q . q) / 4 to its rotational
        diagonal. Shapes (n, 14), (n, 14, 14) to (n, 12, 12).
        """
        local = self.tangents.swapaxes(1, 2) @ H @ self.tangents
        radial_a = np.sum(g[:, ROTATION_A] * self.q_a, axis=1)
        radial_b = np.sum(g[:, ROTATION_B] * self.q_b, axis=1)
        local[:, 3:6, 3:6] -= radial_a[:, None, None] / 4 * np.eye(3)
        local[:, 9:12, 9:12] -= radial_b[:, None, None] / 4 * np.eye(3)
        return np.asarray(local)


_KNOWN: tuple[tuple[Floats, Ints, Floats, Segments], ...] = ()  # the latest first; replaced as a whole, for threads
KEPT = 3  # states: that before a step, that behind it, and the one that is tried


def segments_of(x: Floats, elements: Ints, l: Floats) -> Segments:
    """`Segments.of`, with all that was computed of one of the last states: numbers are compared, arrays may change.

    A step of Newton's method asks a state for its energy, its forces, its tangent and how it moves; each is a function
    of the same strains.
    """
    global _KNOWN
    for state, kept, lengths, known in _KNOWN:
        same = np.array_equal(state, x) and np.array_equal(kept, elements) and np.array_equal(lengths, l)
        if same and state.dtype == x.dtype:
            return known
    found = Segments.of(x.copy(), elements, l)
    _KNOWN = ((x.copy(), elements.copy(), l.copy(), found), *_KNOWN[: KEPT - 1])
    return found
