"""Strains of a two-node geometrically exact rod, with their first and second derivatives.

An element runs from node a to node b. A node carries a position x and a unit quaternion q that turns the
material axes (e1 along the rod, e2 and e3 in the cross-section) into space. Arrays hold one row per element.

Both strain measures depend on nine numbers: on d = x_b - x_a, and on rotation vectors phi of both nodes about their
material axes, q exp(phi / 2). They are functions of d, p and c (below) and are differentiated there; `steps` says how p
and c go with phi, and the second derivatives of these are short: q and c shrink as 1 - |phi|^2 / 8, and c has a mixed
derivative. What is bilinear is one product with constants (`rod_rotation`): for few elements the number of calls is what
takes time. A new strain measure needs its derivatives by d, p and c and nothing else.

Sources: Simo & Vu-Quoc 1986 (strains), Crisfield & Jelenic 1999 (relative rotations keep the strains
objective and independent of the path), Absil, Mahony & Sepulchre 2008, chapter 5 (Hessian on a sphere
embedded in R^4).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from softmark.solvers.energies.energy import Floats, Ints
from softmark.solvers.energies.rod_rotation import PRODUCT, ROTATION, half_angle, relative, rotation

PHI_A, PHI_B = slice(3, 6), slice(6, 9)  # where the parts of (d, phi_a, phi_b) stand in R^9
# where the 12 degrees of freedom of an element stand in R^9, and with which sign: d = x_b - x_a
_PLACE = np.array([0, 1, 2, 3, 4, 5, 0, 1, 2, 6, 7, 8])
_SIGN = np.array([-1.0] * 3 + [1.0] * 9)
_PAIR = (9 * _PLACE[:, None] + _PLACE).ravel()
_PAIR_SIGN = (_SIGN[:, None] * _SIGN).ravel()

# twice the derivatives of (R(p)^T d)_i = ROTATION[k, i, m, n] d_k p_m p_n, as matrices behind products of two vectors
_BY_P = 2.0 * ROTATION.transpose(0, 3, 1, 2).reshape(12, 12)  # d_k p_n to (i, m)
_BY_DP = 2.0 * ROTATION.transpose(1, 3, 0, 2).reshape(12, 12)  # force_i p_n to (k, m)
_BY_PP = 2.0 * ROTATION.transpose(1, 0, 2, 3).reshape(9, 16)  # force_i d_k to (m, n)


def _step_constants() -> Floats:
    """From (q_a, q_b, c) to the derivatives of p and c by phi_a and phi_b: (12, 48), read as (2, 4, 6)."""
    S = np.zeros((3, 4, 2, 4, 6))
    behind = PRODUCT[:, :, 1:].transpose(1, 0, 2) / 2  # q times a half rotation vector, (4, 4, 3)
    S[0, :, 0, :, :3] = S[1, :, 0, :, 3:] = S[2, :, 1, :, 3:] = behind
    S[2, :, 1, :, :3] = -PRODUCT[:, 1:].transpose(2, 0, 1) / 2  # c = exp(-phi_a / 2) c_0 exp(phi_b / 2)
    return S.reshape(12, 48)


_STEPS = _step_constants()
# t_l c_n to the derivative of t . c by phi_a (i) and phi_b (j): -e_i c e_j / 4
_MIXED = -np.einsum("lim,mnj->lnij", PRODUCT[:, 1:], PRODUCT[:, :, 1:]).reshape(16, 9) / 4
_EYE3, _EYE4 = np.eye(3), np.eye(4)


@dataclass(frozen=True)
class Turns:
    """What the rotations of both nodes say of the elements.

    p = q_a + q_b is twice the middle of both (the geodesic one, once normalised), c = (s, v) = conj(q_a) q_b. The sign
    of q_b is that which makes s >= 0.
    """

    q_a: Floats  # (n, 4)
    q_b: Floats  # (n, 4)
    c: Floats  # the rotation from a to b in the axes of a (n, 4)

    @staticmethod
    def of(q: Floats, elements: Ints) -> Turns:
        """The elements (n, 2) between nodes with rotations q (nodes, 4)."""
        q_a, q_b = q[elements[:, 0]], q[elements[:, 1]]
        c = relative(q_a, q_b)
        if c[:, 0].min(initial=0.0) < 0.0:
            sign = np.where(c[:, :1] < 0.0, -1.0, 1.0)
            q_b, c = q_b * sign, c * sign
        return Turns(q_a, q_b, c)

    @cached_property
    def p(self) -> Floats:
        """Twice the middle of both quaternions, (n, 4)."""
        return self.q_a + self.q_b

    @cached_property
    def rho(self) -> Floats:
        """|p|^2, (n,)."""
        return np.asarray(np.einsum("em,em->e", self.p, self.p))

    @cached_property
    def middle(self) -> Floats:
        """The rotation in the middle, (n, 3, 3)."""
        return rotation(self.p) / self.rho[:, None, None]

    @cached_property
    def h(self) -> tuple[Floats, Floats, Floats]:
        """Half the relative angle over its sine, and two derivatives, each (n,)."""
        return half_angle(self.c)

    @cached_property
    def theta(self) -> Floats:
        """The rotation vector from a to b, 2 atan2(|v|, s) v / |v|, (n, 3)."""
        return 2 * self.h[0][:, None] * self.c[:, 1:]

    @cached_property
    def by_c(self) -> Floats:
        """dtheta/dc, (n, 3, 4)."""
        h, h_m, _ = self.h
        v = self.c[:, 1:]
        found = np.empty((len(v), 3, 4))
        found[:, :, 0] = v * (-2 / np.einsum("em,em->e", self.c, self.c))[:, None]
        found[:, :, 1:] = (4 * h_m[:, None] * v)[:, :, None] * v[:, None, :]
        found.reshape(-1, 12)[:, 1::5] += 2 * h[:, None]
        return found

    @cached_property
    def steps(self) -> Floats:
        """dp and dc by (phi_a, phi_b), (n, 2, 4, 6)."""
        known = np.concatenate([self.q_a, self.q_b, self.c], axis=1)
        return np.asarray((known @ _STEPS).reshape(-1, 2, 4, 6))

    def curvature(self, moment: Floats) -> Floats:
        """Second derivative of moment . theta, theta = 2 h(s, |v|^2) v, in c = (s, v): (n, 4, 4)."""
        s, v = self.c[:, :1], self.c[:, 1:]
        _, h_m, h_mm = (f[:, None] for f in self.h)
        r2 = np.einsum("em,em->e", self.c, self.c)[:, None]
        a = np.einsum("ei,ei->e", moment, v)[:, None]
        W = np.empty((len(v), 4, 4))
        W[:, 0, 0] = (4 * a * s / r2**2)[:, 0]
        W[:, 0, 1:] = W[:, 1:, 0] = (4 * (a / r2) * v - 2 * moment) / r2
        half = (4 * h_m * moment + 4 * h_mm * a * v)[:, :, None] * v[:, None, :]
        W[:, 1:, 1:] = half + half.swapaxes(1, 2)
        W.reshape(-1, 16)[:, 5::5] += 4 * h_m * a
        return W


@dataclass(frozen=True)
class Segments:
    """Elements of a rod in one state: strains and their derivatives at the middle of each.

        Gamma = R(p)^T (x_b - x_a) / (l |p|^2)      stretch and shears, e1 when straight and unstrained
        K     = theta / l                           twist and curvatures in 1/m

    `l` are the undeformed lengths in m.
    """

    d: Floats  # x_b - x_a (n, 3)
    turns: Turns
    l: Floats  # (n,)

    @staticmethod
    def of(x: Floats, elements: Ints, l: Floats, turns: Turns | None = None) -> Segments:
        """The elements (n, 2) of the state x (nodes * 7,), whose `turns` may be known."""
        nodes = x.reshape(-1, 7)
        d = nodes[elements[:, 1], :3] - nodes[elements[:, 0], :3]
        return Segments(d, Turns.of(nodes[:, 3:], elements) if turns is None else turns, l)

    @cached_property
    def _by_p(self) -> Floats:
        """d(R(p)^T d)/dp, (n, 3, 4)."""
        return np.asarray((_outer(self.d, self.turns.p) @ _BY_P).reshape(-1, 3, 4))

    @cached_property
    def strains(self) -> Floats:
        """(Gamma, K), (n, 6)."""
        turns = self.turns
        found = np.empty((len(self.l), 6))
        found[:, :3] = np.einsum("eim,em->ei", self._by_p, turns.p) / (2 * turns.rho)[:, None]
        found[:, 3:] = turns.theta
        found /= self.l[:, None]
        return found

    @cached_property
    def _inner(self) -> Floats:
        """d(l Gamma)/dp and d(l K)/dc, (n, 2, 3, 4)."""
        turns = self.turns
        found = np.empty((len(self.l), 2, 3, 4))
        l_Gamma = self.strains[:, :3] * (2 * self.l)[:, None]
        found[:, 0] = (self._by_p - l_Gamma[:, :, None] * turns.p[:, None, :]) / turns.rho[:, None, None]
        found[:, 1] = turns.by_c
        return found

    @cached_property
    def gradients(self) -> Floats:
        """d(Gamma, K)/d(d, phi_a, phi_b), (n, 6, 9)."""
        B = np.zeros((len(self.l), 6, 9))
        B[:, :3, :3] = self.turns.middle.swapaxes(1, 2)
        B[:, :, 3:] = (self._inner @ self.turns.steps).reshape(-1, 6, 6)
        B /= self.l[:, None, None]
        return B

    def forces(self, sigma: Floats) -> Floats:
        """Sum of sigma_i times the derivative of strain i by the 12 degrees of freedom, (n, 12), for sigma (n, 6)."""
        return np.asarray(np.einsum("ei,eij->ej", sigma, self.gradients)[:, _PLACE] * _SIGN)

    def hessians(self, sigma: Floats, C: Floats) -> Floats:
        """B^T C B plus the sum of sigma_i times the second derivative of strain i, (n, 12, 12).

        B the gradients by the 12 degrees of freedom; sigma (n, 6) and C (n, 6).
        """
        n, B, turns = len(self.l), self.gradients, self.turns
        stress = sigma / self.l[:, None]
        t = np.einsum("ebi,ebim->ebm", stress.reshape(n, 2, 3), self._inner)  # by p and by c
        bent = self._second(stress, t) @ turns.steps  # (n, 2, 7, 6)
        left, right = np.zeros((n, 14, 9)), np.zeros((n, 14, 9))
        left[:, :6], right[:, :6] = B, C[:, :, None] * B
        left[:, 6:, 3:], right[:, 6:, 3:] = turns.steps.reshape(n, 8, 6), bent[:, :, 3:].reshape(n, 8, 6)
        H = left.swapaxes(1, 2) @ right
        H[:, :3, 3:] += bent[:, 0, :3]
        H[:, 3:, :3] += bent[:, 0, :3].swapaxes(1, 2)
        self._add_own(H, t)
        return np.asarray(H.reshape(n, 81)[:, _PAIR] * _PAIR_SIGN).reshape(n, 12, 12)

    def _second(self, stress: Floats, t: Floats) -> Floats:
        """Second derivatives by (d, p) and p, (n, 7, 4), and by c behind three rows of zeros: (n, 2, 7, 4).

        With N = rho u for u = l Gamma: u_mn = (N_mn - u_m rho_n - rho_m u_n - u rho_mn) / rho.
        """
        n, force, p, rho = len(self.l), stress[:, :3], self.turns.p, self.turns.rho
        u = np.einsum("ei,ei->e", force, self.strains[:, :3]) * self.l
        u_d = np.einsum("ei,eki->ek", force, self.turns.middle)
        M = np.zeros((n, 2, 7, 4))
        M[:, 0, :3] = (_outer(force, p) @ _BY_DP).reshape(n, 3, 4)
        M[:, 0, 3:] = (_outer(force, self.d) @ _BY_PP).reshape(n, 4, 4)
        own = 2 * np.concatenate([u_d, t[:, 0]], axis=1)[:, :, None] * p[:, None, :]  # (n, 7, 4)
        M[:, 0] -= own
        M[:, 0, 3:] -= own[:, 3:].swapaxes(1, 2)
        M[:, 0].reshape(n, 28)[:, 12::5] -= 2 * u[:, None]
        M[:, 0] /= rho[:, None, None]
        M[:, 1, 3:] = self.turns.curvature(stress[:, 3:])
        return M

    def _add_own(self, H: Floats, t: Floats) -> None:
        """What the second derivatives of p and c by phi_a and phi_b add."""
        turns, flat = self.turns, H.reshape(-1, 81)
        around = np.einsum("em,em->e", t[:, 1], turns.c)
        flat[:, 30:51:10] -= ((np.einsum("em,em->e", t[:, 0], turns.q_a) + around) / 4)[:, None]
        flat[:, 60:81:10] -= ((np.einsum("em,em->e", t[:, 0], turns.q_b) + around) / 4)[:, None]
        mixed = (_outer(t[:, 1], turns.c) @ _MIXED).reshape(-1, 3, 3)
        H[:, PHI_A, PHI_B] += mixed
        H[:, PHI_B, PHI_A] += mixed.swapaxes(1, 2)


def _outer(a: Floats, b: Floats) -> Floats:
    """All products of components, (n, i * j) of (n, i) and (n, j)."""
    return (a[:, :, None] * b[:, None, :]).reshape(len(a), -1)


_Key = tuple[bytes, bytes, bytes, str]
_KNOWN: tuple[tuple[_Key, Segments], ...] = ()  # the latest first; replaced as a whole, for threads
KEPT = 3  # states: that before a step, that behind it, and the one that is tried


def segments_of(x: Floats, elements: Ints, l: Floats, turns: Turns | None = None) -> Segments:
    """`Segments.of`, with all that was computed of one of the last states: numbers are compared, arrays may change.

    A step of Newton's method asks a state for its energy, its forces, its tangent and how it moves; each is a function
    of the same strains.
    """
    global _KNOWN
    key, known = (x.tobytes(), elements.tobytes(), l.tobytes(), x.dtype.str), _KNOWN
    for place, (other, found) in enumerate(known):
        if other == key:
            if place:
                _KNOWN = (known[place], *known[:place], *known[place + 1 :])
            return found
    found = Segments.of(x.copy(), elements, l.copy(), turns)
    _KNOWN = ((key, found), *known[: KEPT - 1])
    return found
