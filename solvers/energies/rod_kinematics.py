"""Strains of a two-node geometrically exact rod, with their first and second derivatives.

An element runs from node a to node b. A node carries a position x and a unit quaternion q that rotates the material
axes (e1 along the rod, e2 and e3 in the cross-section) into space. Arrays hold one row per element.

Both strain measures are functions of y = (d, p, c) in R^11, with d = x_b - x_a and the p and c of `ElementRotations`.
They are differentiated by y, and `steps` is the derivative of y by the 12 degrees of freedom. A node has six: a
displacement in space and a rotation vector phi about its material axes, q exp(phi / 2). Bilinear terms are products of
constants with all products of components, because for few elements the number of numpy calls dominates the time. A new
strain measure only needs its derivatives in R^11.

Sources: Simo & Vu-Quoc 1986 (strains), Crisfield & Jelenic 1999 (relative rotations keep the strains objective and
path-independent), Absil, Mahony & Sepulchre 2008, chapter 5 (Hessian on a sphere embedded in R^4).
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats, Ints
from softmark.solvers.energies.rod_rotation import (
    PRODUCT,
    ROTATION,
    half_angle_over_sine,
    half_angle_ratio_derivatives,
    outer,
    relative_rotation,
    rotation,
)

D, P, C = slice(0, 3), slice(3, 7), slice(7, 11)  # positions of the parts of y in R^11
_BY_P = 2.0 * ROTATION.transpose(0, 3, 1, 2).reshape(12, 12)  # d_k p_n to d(R(p)^T d)_i / dp_m
_APART = np.concatenate([-np.eye(3), np.zeros((3, 3)), np.eye(3), np.zeros((3, 3))], axis=1)  # of d
_EYE3, _EYE4 = np.eye(3), np.eye(4)


def _quaternion_derivative_map() -> Floats:
    """Return the constant matrix (12, 96) that maps (q_a, q_b, c) to derivatives (8, 12) of p and c by the 12 dofs.

    q_a and q_b are the node quaternions, p = q_a + q_b and c = conj(q_a) q_b.
    """
    S = np.zeros((3, 4, 2, 4, 12))
    behind = PRODUCT[:, :, 1:].transpose(1, 0, 2) / 2  # q times half a rotation vector, (4, 4, 3)
    S[0, :, 0, :, 3:6] = S[1, :, 0, :, 9:] = S[2, :, 1, :, 9:] = behind
    S[2, :, 1, :, 3:6] = -PRODUCT[:, 1:].transpose(2, 0, 1) / 2  # c = exp(-phi_a / 2) c_0 exp(phi_b / 2)
    return S.reshape(12, 96)


def _force_second_derivative_map() -> Floats:
    """Return the constant matrix (50, 49) that maps products of components to second derivatives by (d, p).

    The products (50,) are those formed in `RodElements._force_second_derivatives`.
    """
    M = np.zeros((50, 7, 7))
    by_dp = np.zeros((3, 7, 3, 4))  # force_i (p, d)_n to d_k, p_m
    by_dp[:, :4] = 2.0 * ROTATION.transpose(1, 3, 0, 2)
    M[:21, :3, 3:], M[:21, 3:, :3] = by_dp.reshape(21, 3, 4), by_dp.reshape(21, 3, 4).swapaxes(1, 2)
    by_pp = np.zeros((3, 7, 4, 4))
    by_pp[:, 4:] = 2.0 * ROTATION.transpose(1, 0, 2, 3)
    M[:21, 3:, 3:] = by_pp.reshape(21, 4, 4)
    own = np.zeros((7, 4, 7, 7))  # t_r p_m, once in either triangle
    for r in range(7):
        for m in range(4):
            own[r, m, r, 3 + m] -= 2.0
            own[r, m, 3 + m, r] -= 2.0
    M[21:49] = own.reshape(28, 7, 7)
    M[49, 3:, 3:] = -2.0 * _EYE4
    return M.reshape(50, 49)


def _moment_second_derivative_map() -> Floats:
    """Return the constant matrix (14, 16) that maps products of components to second derivatives by c.

    The products (14,) are those formed in `ElementRotations.rotation_vector_hessian`.
    """
    M = np.zeros((14, 4, 4))
    for i in range(3):
        M[i, 0, 1 + i] = M[i, 1 + i, 0] = 1.0
        for j in range(3):
            M[3 + 3 * i + j, 1 + i, 1 + j] += 4.0
            M[3 + 3 * i + j, 1 + j, 1 + i] += 4.0
    M[12, 0, 0] = 4.0
    M[13, 1:, 1:] = 4.0 * _EYE3
    return M.reshape(14, 16)


def _rotation_second_derivative_map() -> Floats:
    """Return the constant matrix (17, 144) that maps products to second derivatives of y by the 12 dofs.

    y = (d, p, c) is described in the module docstring. The products (17,) are t_l c_n (16,) and t . q_a, formed in
    `RodElements._second_derivative_products`.
    """
    M = np.zeros((17, 12, 12))
    mixed = -np.einsum("lim,mnj->lnij", PRODUCT[:, 1:], PRODUCT[:, :, 1:]).reshape(16, 3, 3) / 4  # -e_i c e_j / 4
    M[:16, 3:6, 9:], M[:16, 9:, 3:6] = mixed, mixed.swapaxes(1, 2)
    M[16, 3:6, 3:6], M[16, 9:, 9:] = -_EYE3 / 4, _EYE3 / 4
    return M.reshape(17, 144)


_STEPS, _FORCE, _MOMENT, _OWN = (
    _quaternion_derivative_map(),
    _force_second_derivative_map(),
    _moment_second_derivative_map(),
    _rotation_second_derivative_map(),
)


@dataclass(frozen=True)
class ElementRotations:
    """Relative and mean rotations of the two nodes of each element.

    p = q_a + q_b is twice the midpoint of the quaternions; normalised, it is the rotation halfway between them. c = (s,
    v) = conj(q_a) q_b is the relative rotation. The sign of q_b is chosen to make s >= 0.
    """

    q_a: Floats  # (n, 4)
    q_b: Floats  # (n, 4)
    c: Floats  # the rotation from a to b in the axes of a (n, 4)

    @staticmethod
    def of(q: Floats, elements: Ints) -> ElementRotations:
        """Return the rotations of elements (n, 2) between nodes with rotations q (nodes, 4)."""
        q_a, q_b = q[elements[:, 0]], q[elements[:, 1]]
        c = relative_rotation(q_a, q_b)
        if c[:, 0].min(initial=0.0) < 0.0:
            sign = np.where(c[:, :1] < 0.0, -1.0, 1.0)
            q_b, c = q_b * sign, c * sign
        return ElementRotations(q_a, q_b, c)

    @cached_property
    def p(self) -> Floats:
        """Sum of both quaternions, twice their midpoint, (n, 4)."""
        return self.q_a + self.q_b

    @cached_property
    def rho(self) -> Floats:
        """Squared norm |p|^2 of the sum of both quaternions, (n,)."""
        return np.asarray(np.einsum("em,em->e", self.p, self.p))

    @cached_property
    def middle(self) -> Floats:
        """Rotation matrix in the middle of the element, (n, 3, 3)."""
        return rotation(self.p / np.sqrt(self.rho)[:, None])

    @cached_property
    def h(self) -> Floats:
        """Half the relative rotation angle divided by its sine, h = atan2(|v|, s) / |v|, (n,)."""
        return half_angle_over_sine(self.c)

    @cached_property
    def h_slopes(self) -> tuple[Floats, Floats]:
        """First and second derivative of h by |v|^2, each (n,)."""
        return half_angle_ratio_derivatives(self.c, self.h)

    @cached_property
    def theta(self) -> Floats:
        """Rotation vector from a to b, 2 atan2(|v|, s) v / |v|, (n, 3)."""
        return np.asarray((2 * self.h)[:, None] * self.c[:, 1:])

    @cached_property
    def theta_derivatives(self) -> Floats:
        """Derivative dtheta/dc of the rotation vector, (n, 3, 4), for c of unit length."""
        v, h, h_m = self.c[:, 1:], self.h, self.h_slopes[0]
        found = np.empty((len(v), 3, 4))
        found[:, :, 0] = -2 * v
        np.multiply((4 * h_m[:, None] * v)[:, :, None], v[:, None, :], out=found[:, :, 1:])
        found.reshape(-1, 12)[:, 1::5] += (2 * h)[:, None]
        return found

    @cached_property
    def derivative_by_dofs(self) -> Floats:
        """Derivative of y = (d, p, c) by the 12 degrees of freedom, (n, 11, 12), with d = x_b - x_a."""
        found = np.empty((len(self.c), 11, 12))
        found[:, D] = _APART
        known = np.concatenate([self.q_a, self.q_b, self.c], axis=1)
        found[:, 3:] = (known @ _STEPS).reshape(-1, 8, 12)
        return found

    def rotation_vector_hessian(self, moment: Floats) -> Floats:
        """Return the second derivative of moment . theta by c = (s, v) of unit length, (n, 4, 4).

        theta = 2 h(s, |v|^2) v, and `moment` (n, 3) is constant.
        """
        s, v = self.c[:, :1], self.c[:, 1:]
        h_m, h_mm = self.h_slopes
        a = np.einsum("ei,ei->e", moment, v)
        parts = np.empty((len(v), 14))
        av = a[:, None] * v
        parts[:, :3] = 4 * av - 2 * moment
        parts[:, 3:12] = outer(h_m[:, None] * moment + h_mm[:, None] * av, v)
        parts[:, 12] = a * s[:, 0]
        parts[:, 13] = a * h_m
        return np.asarray((parts @ _MOMENT).reshape(-1, 4, 4))


@dataclass(frozen=True)
class RodElements:
    """Rod elements in one state: strains and their derivatives in the middle of each element.

        Gamma = R(p)^T (x_b - x_a) / (l |p|^2)      stretch and shears, e1 when straight and unstrained
        K     = theta / l                           twist and curvatures in 1/m

    `l` are the undeformed lengths in m.
    """

    d: Floats  # x_b - x_a (n, 3)
    turns: ElementRotations
    l: Floats  # (n,)

    @staticmethod
    def of(x: Floats, elements: Ints, l: Floats, turns: ElementRotations | None = None) -> RodElements:
        """Return the elements (n, 2) in state x (nodes * 7,); `turns` are their rotations, if already computed."""
        nodes = x.reshape(-1, 7)
        d = nodes[elements[:, 1], :3] - nodes[elements[:, 0], :3]
        return RodElements(d, ElementRotations.of(nodes[:, 3:], elements) if turns is None else turns, l)

    @cached_property
    def strains(self) -> Floats:
        """Strains (Gamma, K) of each element, (n, 6)."""
        turns = self.turns
        found = np.empty((len(self.l), 6))
        np.einsum("eki,ek->ei", turns.middle, self.d, out=found[:, :3])
        found[:, 3:] = turns.theta
        found /= self.l[:, None]
        return found

    @cached_property
    def _strain_derivative(self) -> Floats:
        """Derivative (n, 6, 11) of (l Gamma, l K) by y = (d, p, c); d = x_b - x_a, p and c as in `turns`."""
        turns = self.turns
        found = np.zeros((len(self.l), 6, 11))
        p = turns.p / turns.rho[:, None]
        l_Gamma = self.strains[:, :3] * (2 * self.l)[:, None]
        by_p = (outer(self.d, p) @ _BY_P).reshape(-1, 3, 4)
        found[:, :3, D] = turns.middle.swapaxes(1, 2)
        np.subtract(by_p, l_Gamma[:, :, None] * p[:, None, :], out=found[:, :3, P])
        found[:, 3:, C] = turns.theta_derivatives
        return found

    @cached_property
    def gradients(self) -> Floats:
        """Derivative of (Gamma, K) by the 12 degrees of freedom, (n, 6, 12)."""
        return np.asarray((self._strain_derivative @ self.turns.derivative_by_dofs) / self.l[:, None, None])

    def forces(self, sigma: Floats) -> Floats:
        """Return the sum of sigma_i times the derivative of strain i by the 12 dofs, (n, 12).

        sigma (n, 6) are section forces and moments, multiplied by the length.
        """
        return np.asarray(np.einsum("ei,eij->ej", sigma, self.gradients))

    def hessians(self, sigma: Floats, stiffness: Floats) -> Floats:
        """Return B^T C B plus the sum of sigma_i times the second derivative of strain i, (n, 12, 12).

        B is the strain derivative by the 12 degrees of freedom; sigma and the diagonal of C are (n, 6).
        """
        n, B, turns = len(self.l), self.gradients, self.turns
        stress = sigma / self.l[:, None]
        t = np.einsum("ei,eij->ej", stress, self._strain_derivative)
        M = np.zeros((n, 11, 11))
        M[:, :7, :7] = self._force_second_derivatives(stress[:, :3], t[:, :7])
        M[:, C, C] = turns.rotation_vector_hessian(stress[:, 3:])
        left = np.concatenate([B, turns.derivative_by_dofs], axis=1)
        right = np.concatenate([stiffness[:, :, None] * B, M @ turns.derivative_by_dofs], axis=1)
        H = (left.swapaxes(1, 2) @ right).reshape(n, 144)
        H += self._second_derivative_products(t) @ _OWN
        return np.asarray(H).reshape(n, 12, 12)

    def _force_second_derivatives(self, force: Floats, t: Floats) -> Floats:
        """Return second derivatives (n, 7, 7) of u = force . l Gamma by (d, p), with d = x_b - x_a and p = q_a + q_b.

        `force` (n, 3) is constant, and t (n, 7) are the first derivatives of u. With N = rho u and rho = |p|^2: u_mn =
        (N_mn - u_m rho_n - rho_m u_n - u rho_mn) / rho.
        """
        p = self.turns.p
        parts = np.empty((len(p), 50))
        parts[:, :21] = outer(force, np.concatenate([p, self.d], axis=1))
        parts[:, 21:49] = outer(t, p)
        parts[:, 49] = np.einsum("ei,ei->e", force, self.strains[:, :3]) * self.l
        parts /= self.turns.rho[:, None]
        return np.asarray((parts @ _FORCE).reshape(-1, 7, 7))

    def _second_derivative_products(self, t: Floats) -> Floats:
        """Return the products (n, 17) of components on which the second derivatives of y = (d, p, c) depend.

        t (n, 11) are derivatives of an energy by y. q exp(phi / 2) = q + ... - |phi|^2 q / 8. So each node adds -(t .
        q) / 4 to its rotational diagonal, and c adds a similar term. Only the directions of c and p matter, so that t .
        c and t . p vanish and t . q_b = -t . q_a.
        """
        parts = np.empty((len(t), 17))
        parts[:, :16] = outer(t[:, C], self.turns.c)
        np.einsum("em,em->e", t[:, P], self.turns.q_a, out=parts[:, 16])
        return parts


_Key = tuple[bytes, bytes, bytes, str]
_KNOWN: tuple[tuple[_Key, RodElements], ...] = ()  # latest first; replaced as a whole, for thread safety
KEPT = 3  # states: before a step, after it, and the trial one


def cached_elements(x: Floats, elements: Ints, l: Floats, turns: ElementRotations | None = None) -> RodElements:
    """Return `RodElements.of`, or its cached result if the state equals one of the last few states.

    A Newton step evaluates energy, forces, tangent and motion of one state, which are functions of the same strains.
    States are compared by value.
    """
    global _KNOWN
    key, known = (x.tobytes(), elements.tobytes(), l.tobytes(), x.dtype.str), _KNOWN
    for place, (other, found) in enumerate(known):
        if other == key:
            if place:
                _KNOWN = (known[place], *known[:place], *known[place + 1 :])
            return found
    found = RodElements.of(x.copy(), elements, l.copy(), turns)
    _KNOWN = ((key, found), *known[: KEPT - 1])
    return found
