"""Compiled strain energy, forces and tangents of a rod described by rotation vectors, in one loop over elements.

The formulas differ from those of `rod_kinematics`: derivatives are taken in the axes of the middle of each element.
With theta the rotation vector from node a to node b, t = |theta| and [v] the matrix of v x

    d theta = J phi_b - J^T phi_a      J = 1 + [theta]/2 + b [theta]^2, b = (1 - t/2 cot(t/2)) / t^2
    psi     = A phi_b + A^T phi_a      A = (1 + tau [theta]) / 2,       tau = tan(t/4) / t

phi_a and phi_b are rotation increments of the nodes about their own axes, psi is the rotation increment of the middle.
Both equations follow from the right Jacobian of the exponential map (Sola, Deray and Atchuthan 2018, arXiv:1812.01537,
equations 143 to 145). The tangent is the derivative of the forces. It is not symmetric out of equilibrium; its
symmetric part is the Hessian of `RodElastic`.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from softmark.solvers.runtime.kernel_cache import allocating_kernel, kernel, kernel_part

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@kernel
def update_rotations(x: Floats, X: Floats, q0: Floats, at: Floats, q: Floats, T: Floats) -> None:
    """Compute the positions, rotations and right Jacobians of nodes with unknowns x (n, 6).

    The unknowns of a node are a displacement u and a rotation vector phi. The positions `at` (n, 3) are X + u, the
    rotations `q` (n, 4) are q0 exp(phi / 2), and `T` (n, 3, 3) is the right Jacobian of phi.
    """
    for k in range(x.shape[0]):
        a, b, c = x[k, 3], x[k, 4], x[k, 5]
        m = a * a + b * b + c * c
        if m < 0.01:  # the truncation error of the series is below rounding
            s = 0.5 - m * (1.0 / 48.0 - m * (1.0 / 3840.0 - m / 645120.0))
        else:
            s = math.sin(0.5 * math.sqrt(m)) / math.sqrt(m)
        p, r = _jacobian_factors(m)
        w = math.cos(0.5 * math.sqrt(m))
        a, b, c = s * a, s * b, s * c
        q[k, 0] = q0[k, 0] * w - q0[k, 1] * a - q0[k, 2] * b - q0[k, 3] * c
        q[k, 1] = q0[k, 0] * a + q0[k, 1] * w + q0[k, 2] * c - q0[k, 3] * b
        q[k, 2] = q0[k, 0] * b + q0[k, 2] * w + q0[k, 3] * a - q0[k, 1] * c
        q[k, 3] = q0[k, 0] * c + q0[k, 3] * w + q0[k, 1] * b - q0[k, 2] * a
        for i in range(3):
            at[k, i] = X[k, i] + x[k, i]
            for j in range(3):
                T[k, i, j] = r * x[k, 3 + i] * x[k, 3 + j]
            T[k, i, i] += 1.0 - r * m
        for i in range(3):
            j, h = (i + 1) % 3, (i + 2) % 3
            T[k, h, j] -= p * x[k, 3 + i]
            T[k, j, h] += p * x[k, 3 + i]


@kernel_part
def _jacobian_factors(m: float) -> tuple[float, float]:
    """Return (1 - cos t) / t^2 and (t - sin t) / t^3 for m = t^2.

    For small t they are computed from truncated series, which are exact to rounding.
    """
    if m < 0.01:
        p = 0.5 - m * (1.0 / 24.0 - m * (1.0 / 720.0 - m * (1.0 / 40320.0 - m / 3628800.0)))
        return p, 1.0 / 6.0 - m * (1.0 / 120.0 - m * (1.0 / 5040.0 - m / 362880.0))
    t = math.sqrt(m)
    return (1.0 - math.cos(t)) / m, (t - math.sin(t)) / (m * t)


@kernel_part
def _rotation_factors(m: float) -> tuple[float, float, float, float]:
    """Return tau, tau' / t, b and b' / t of the module docstring for m = t^2.

    For t below 0.5 series are used, because the closed forms lose digits there.
    """
    if m < 0.25:
        y = m / 16.0
        tau = 0.25 * (1.0 + y * (1.0 / 3.0 + y * (2.0 / 15.0 + y * (17.0 / 315.0 + y * (
            62.0 / 2835.0 + y * (1382.0 / 155925.0 + y * 21844.0 / 6081075.0))))))  # fmt: skip
        tau_t = (1.0 / 3.0 + y * (4.0 / 15.0 + y * (51.0 / 315.0 + y * (248.0 / 2835.0 + y * (
            6910.0 / 155925.0 + y * 131064.0 / 6081075.0))))) / 32.0  # fmt: skip
        b = 1.0 / 12.0 + m * (1.0 / 720.0 + m * (1.0 / 30240.0 + m * (1.0 / 1209600.0 + m * (
            1.0 / 47900160.0 + m * (691.0 / 1307674368000.0 + m / 74724249600.0)))))  # fmt: skip
        b_t = 2.0 * (1.0 / 720.0 + m * (2.0 / 30240.0 + m * (3.0 / 1209600.0 + m * (4.0 / 47900160.0 + m * (
            3455.0 / 1307674368000.0 + m * 6.0 / 74724249600.0)))))  # fmt: skip
        return tau, tau_t, b, b_t
    t = math.sqrt(m)
    tangent, cosine, cot = math.tan(0.25 * t), math.cos(0.25 * t), 1.0 / math.tan(0.5 * t)
    b = (1.0 - 0.5 * t * cot) / m
    b_t = (0.25 * t / math.sin(0.5 * t) ** 2 - 0.5 * cot - 2.0 * b * t) / (t * m)
    return tangent / t, (0.25 * t / cosine**2 - tangent) / (t * m), b, b_t


@kernel_part
def _add_cross_matrix(v: Floats, scale: float, M: Floats) -> None:
    """Add a cross-product matrix: M += scale [v]."""
    for i in range(3):
        j, h = (i + 1) % 3, (i + 2) % 3
        M[h, j] += scale * v[i]
        M[j, h] -= scale * v[i]


@kernel_part
def _add_rank_one(a: Floats, b: Floats, scale: float, M: Floats) -> None:
    """Add a rank-one matrix: M += scale a b^T."""
    for i in range(3):
        for j in range(3):
            M[i, j] += scale * a[i] * b[j]


@kernel_part
def _compute_cross_product(a: Floats, b: Floats, found: Floats) -> None:
    """Compute the cross product a x b and write it into `found` (3,)."""
    for i in range(3):
        j, h = (i + 1) % 3, (i + 2) % 3
        found[i] = a[j] * b[h] - a[h] * b[j]


@kernel_part
def _add_product(A: Floats, B: Floats, scale: float, C: Floats, transposed: bool) -> None:
    """Add a matrix product: C (3, n) += scale A B, or scale A^T B if `transposed`."""
    for i in range(3):
        for k in range(3):
            factor = scale * (A[k, i] if transposed else A[i, k])
            if factor != 0.0:
                for j in range(B.shape[1]):
                    C[i, j] += factor * B[k, j]


@kernel_part
def _compute_rotation_matrix(q: Floats, R: Floats) -> None:
    """Compute the rotation matrix R of a unit quaternion."""
    w, a, b, c = q[0], q[1], q[2], q[3]
    R[0, 0], R[0, 1], R[0, 2] = 1.0 - 2.0 * (b * b + c * c), 2.0 * (a * b - w * c), 2.0 * (a * c + w * b)
    R[1, 0], R[1, 1], R[1, 2] = 2.0 * (a * b + w * c), 1.0 - 2.0 * (a * a + c * c), 2.0 * (b * c - w * a)
    R[2, 0], R[2, 1], R[2, 2] = 2.0 * (a * c - w * b), 2.0 * (b * c + w * a), 1.0 - 2.0 * (a * a + b * b)


@kernel_part
def _compute_relative_rotation(qa: Floats, qb: Floats, theta: Floats, R: Floats, p: Floats) -> float:
    """Compute the relative and the mean rotation of two nodes with quaternions qa and qb, and return |theta|^2.

    `theta` is the rotation vector from qa to qb. The mean rotation is written as the quaternion `p` and as the matrix
    `R`.
    """
    dot = qa[0] * qb[0] + qa[1] * qb[1] + qa[2] * qb[2] + qa[3] * qb[3]
    sign = -1.0 if dot < 0.0 else 1.0
    dot *= sign
    _compute_cross_product(qb[1:], qa[1:], theta)
    size = 0.0
    for i in range(3):
        theta[i] = sign * (theta[i] + qa[0] * qb[1 + i] - qb[0] * qa[1 + i])
        size += theta[i] ** 2
    size = math.sqrt(size)
    t = 2.0 * math.atan2(size, dot)
    for i in range(3):
        theta[i] *= t / size if size > 0.0 else 2.0
    norm = 0.0
    for i in range(4):
        p[i] = qa[i] + sign * qb[i]
        norm += p[i] ** 2
    for i in range(4):
        p[i] /= math.sqrt(norm)
    _compute_rotation_matrix(p, R)
    return t * t


@kernel_part
def _add_element_forces(
    e: int, elements: Ints, l: Floats, theta: Floats, factors: tuple[float, float, float, float], R: Floats,
    Gamma: Floats, N: Floats, M: Floats, scale: float, w: Floats, tw: Floats, tM: Floats, ttM: Floats, g: Floats,
) -> None:  # fmt: skip
    """Add the nodal forces of element e with section force N and moment M to g (n, 6), unless g is empty.

    Also compute the products w = l N x Gamma, theta x w, theta x M and theta x (theta x M), which the tangent needs.
    """
    tau, _, beta, _ = factors
    _compute_cross_product(N, Gamma, w)
    for i in range(3):
        w[i] *= l[e]
    _compute_cross_product(theta, w, tw)
    _compute_cross_product(theta, M, tM)
    _compute_cross_product(theta, tM, ttM)
    if g.shape[0] == 0:
        return
    a, b = elements[e, 0], elements[e, 1]
    for i in range(3):
        force = 0.0
        for k in range(3):
            force += R[i, k] * N[k]
        g[a, i] -= scale * force
        g[b, i] += scale * force
        even, odd = 0.5 * w[i], 0.5 * tau * tw[i]
        stiff = M[i] + beta * ttM[i]
        g[a, 3 + i] += scale * (even + odd - stiff - 0.5 * tM[i])
        g[b, 3 + i] += scale * (even - odd + stiff - 0.5 * tM[i])


@kernel_part
def _compute_strain_derivatives(
    theta: Floats, m: float, factors: tuple[float, float, float, float], R: Floats, Gamma: Floats, l: float,
    A: Floats, J: Floats, by: Floats,
) -> None:  # fmt: skip
    """Compute A and J, and the derivatives of theta, psi and Gamma by the 12 nodal increments.

    theta is the rotation vector from the first node to the second, psi the rotation increment of the middle, and Gamma
    the stretch and shears (see the module docstring). The derivatives (3, 12) are written into `by[0]`, `by[1]` and
    `by[2]`.
    """
    tau, _, beta, _ = factors
    A[:], J[:], by[:] = 0.0, 0.0, 0.0
    _add_cross_matrix(theta, 0.5 * tau, A)
    _add_cross_matrix(theta, 0.5, J)
    _add_rank_one(theta, theta, beta, J)
    for i in range(3):
        A[i, i] += 0.5
        J[i, i] += 1.0 - beta * m
    for i in range(3):
        for j in range(3):
            by[0, i, 3 + j], by[0, i, 9 + j] = -J[j, i], J[i, j]
            by[1, i, 3 + j], by[1, i, 9 + j] = A[j, i], A[i, j]
            by[2, i, j], by[2, i, 6 + j] = -R[j, i] / l, R[j, i] / l
    _add_cross_products(Gamma, by[1], 1.0, by[2])


@kernel_part
def _compute_element_tangent(
    l: float, theta: Floats, factors: tuple[float, float, float, float], R: Floats, Gamma: Floats, N: Floats, M: Floats,
    w: Floats, tw: Floats, ttM: Floats, A: Floats, J: Floats, by: Floats, D_a: Floats, D_b: Floats, block: Floats,
) -> None:  # fmt: skip
    """Compute the tangent of one element, `block` (12, 12), by rotations of the nodes about their own axes.

    `by` holds the derivatives of theta, psi, Gamma, N, w and M by the nodal increments.
    """
    tau, tau_t, beta, beta_t = factors
    D_a[:], D_b[:], block[:] = 0.0, 0.0, 0.0
    dot = theta[0] * M[0] + theta[1] * M[1] + theta[2] * M[2]
    _add_cross_matrix(w, -0.5 * tau, D_a)
    _add_rank_one(tw, theta, 0.5 * tau_t, D_a)
    _add_rank_one(theta, M, beta, D_b)  # common part of J M and J^T M
    _add_rank_one(M, theta, -2.0 * beta, D_b)
    _add_rank_one(ttM, theta, beta_t, D_b)
    for i in range(3):
        D_b[i, i] += beta * dot
        for j in range(3):
            D_b[i, j] -= D_a[i, j]  # derivative of A^T w: minus that of A w
            D_a[i, j] = -D_b[i, j]
    _add_cross_matrix(M, 0.5, D_a)
    _add_cross_matrix(M, 0.5, D_b)
    _add_cross_products(N, by[2], l, by[4])
    _add_cross_products(Gamma, by[3], -l, by[4])
    _add_cross_products(N, by[1], -1.0, by[3])
    _add_product(R, by[3], 1.0, block[6:9], False)
    _add_product(R, by[3], -1.0, block[0:3], False)
    _add_product(A, by[4], 1.0, block[3:6], False)
    _add_product(A, by[4], 1.0, block[9:12], True)
    _add_product(D_a, by[0], 1.0, block[3:6], False)
    _add_product(D_b, by[0], 1.0, block[9:12], False)
    _add_product(J, by[5], -1.0, block[3:6], False)
    _add_product(J, by[5], 1.0, block[9:12], True)


@kernel_part
def _scatter_block(
    e: int, elements: Ints, T: Floats, slots: Ints, scale: float, block: Floats, moment: Floats, data: Floats
) -> None:
    """Add the tangent of element e to data[slots], converted from own-axis rotations to the unknowns.

    The matrices T (n, 3, 3) are the right Jacobians of the rotation vectors.
    """
    a, b = elements[e, 0], elements[e, 1]
    for i in range(12):
        _multiply_row(block[i, 3:6], T[a], moment)
        _multiply_row(block[i, 9:12], T[b], moment)
        for j in range(12):
            if slots[e, i, j] >= 0:
                data[slots[e, i, j]] += scale * block[i, j]


@allocating_kernel
def assemble_rod(
    at: Floats, q: Floats, T: Floats, elements: Ints, l: Floats, C: Floats, rest: Floats, scale: float,
    g: Floats, slots: Ints, data: Floats,
) -> float:  # fmt: skip
    """Return the strain energy of a rod, J, and add `scale` times its forces to `g` and its tangent to `data`.

    `g` (n, 6) are forces and moments about own axes. The tangent is the derivative by the unknowns and uses T (n, 3,
    3). If `g` or `slots` is empty, forces or tangent are not computed; negative slots are skipped. `C` (m, 6) are the
    stiffnesses of the elements, and `rest` (m, 6) their strains at rest.
    """
    energy = 0.0
    theta, w, M, tw, tM, ttM, N, Gamma, moment, p = np.zeros((10, 4))
    theta, w, M, tw, tM, ttM = theta[:3], w[:3], M[:3], tw[:3], tM[:3], ttM[:3]
    N, Gamma, moment = N[:3], Gamma[:3], moment[:3]
    R, A, J, D_a, D_b = np.zeros((5, 3, 3))
    by = np.zeros((6, 3, 12))  # derivatives of theta, psi, Gamma, N, w, M by both nodes' increments
    block = np.zeros((12, 12))
    for e in range(elements.shape[0]):
        a, b = elements[e, 0], elements[e, 1]
        m = _compute_relative_rotation(q[a], q[b], theta, R, p)
        for i in range(3):
            Gamma[i] = 0.0
            for k in range(3):
                Gamma[i] += R[k, i] * (at[b, k] - at[a, k]) / l[e]
            gap, bend = Gamma[i] - rest[e, i], theta[i] / l[e] - rest[e, 3 + i]
            N[i], M[i] = C[e, i] * gap, C[e, 3 + i] * bend
            energy += 0.5 * l[e] * (N[i] * gap + M[i] * bend)
        if g.shape[0] == 0 and slots.shape[0] == 0:
            continue
        factors = _rotation_factors(m)
        _add_element_forces(e, elements, l, theta, factors, R, Gamma, N, M, scale, w, tw, tM, ttM, g)
        if slots.shape[0] == 0:
            continue
        _compute_strain_derivatives(theta, m, factors, R, Gamma, l[e], A, J, by)
        for i in range(3):
            for j in range(12):
                by[3, i, j] = C[e, i] * by[2, i, j]
                by[5, i, j] = C[e, 3 + i] * by[0, i, j] / l[e]
        _compute_element_tangent(l[e], theta, factors, R, Gamma, N, M, w, tw, ttM, A, J, by, D_a, D_b, block)
        _scatter_block(e, elements, T, slots, scale, block, moment, data)
    return energy


@allocating_kernel
def assemble_tendons(
    at: Floats, q: Floats, T: Floats, elements: Ints, l: Floats, arms: Floats, slopes: Floats, pulls: Floats,
    scale: float, g: Floats, slots: Ints, data: Floats,
) -> float:  # fmt: skip
    """Return the energy of tendons, J, and add `scale` times their forces to `g` and their tangent to `data`.

    `arms` and `slopes` (k, m, 3) and tensions `pulls` (k, m), N, are those of k tendons in the middle of m elements.
    With y = Gamma + K x a + a' and t = y / |y|, a tendon adds pull t to the section force N and a x pull t to the
    moment M, where a is its arm and a' its slope. The other arguments are as in `assemble_rod`.
    """
    energy = 0.0
    theta, w, M, tw, tM, ttM, N, Gamma, moment, p, y, pull, own, K = np.zeros((14, 4))
    theta, w, M, tw, tM, ttM = theta[:3], w[:3], M[:3], tw[:3], tM[:3], ttM[:3]
    N, Gamma, moment, y, pull, own, K = N[:3], Gamma[:3], moment[:3], y[:3], pull[:3], own[:3], K[:3]
    R, A, J, D_a, D_b = np.zeros((5, 3, 3))
    by, change = np.zeros((6, 3, 12)), np.zeros((3, 12))
    block = np.zeros((12, 12))
    for e in range(elements.shape[0]):
        a, b = elements[e, 0], elements[e, 1]
        m = _compute_relative_rotation(q[a], q[b], theta, R, p)
        for i in range(3):
            N[i], M[i], Gamma[i], K[i] = 0.0, 0.0, 0.0, theta[i] / l[e]
            for k in range(3):
                Gamma[i] += R[k, i] * (at[b, k] - at[a, k]) / l[e]
        for k in range(arms.shape[0]):
            energy += (
                l[e]
                * pulls[k, e]
                * _compute_tendon_force(Gamma, K, arms[k, e], slopes[k, e], pulls[k, e], y, pull, own)
            )
            for i in range(3):
                N[i] += pull[i]
                M[i] += own[i]
        if g.shape[0] == 0 and slots.shape[0] == 0:
            continue
        factors = _rotation_factors(m)
        _add_element_forces(e, elements, l, theta, factors, R, Gamma, N, M, scale, w, tw, tM, ttM, g)
        if slots.shape[0] == 0:
            continue
        _compute_strain_derivatives(theta, m, factors, R, Gamma, l[e], A, J, by)
        for k in range(arms.shape[0]):
            size = _compute_tendon_force(
                Gamma, K, arms[k, e], slopes[k, e], 1.0, y, pull, own
            )  # `pull` is the direction
            for j in range(12):
                for i in range(3):
                    f, h = (i + 1) % 3, (i + 2) % 3
                    change[i, j] = by[2, i, j] + (by[0, f, j] * arms[k, e, h] - by[0, h, j] * arms[k, e, f]) / l[e]
                along = pull[0] * change[0, j] + pull[1] * change[1, j] + pull[2] * change[2, j]
                for i in range(3):
                    change[i, j] = pulls[k, e] / size * (change[i, j] - along * pull[i])
                    by[3, i, j] += change[i, j]
            _add_cross_products(arms[k, e], change, 1.0, by[5])
        _compute_element_tangent(l[e], theta, factors, R, Gamma, N, M, w, tw, ttM, A, J, by, D_a, D_b, block)
        _scatter_block(e, elements, T, slots, scale, block, moment, data)
    return energy


@kernel_part
def _compute_tendon_force(
    Gamma: Floats, K: Floats, arm: Floats, slope: Floats, tension: float, y: Floats, pull: Floats, own: Floats
) -> float:
    """Compute the direction y of a tendon, its force `pull` along y, and the moment `own` = a x pull; return |y|."""
    _compute_cross_product(K, arm, y)
    size = 0.0
    for i in range(3):
        y[i] += Gamma[i] + slope[i]
        size += y[i] ** 2
    size = max(math.sqrt(size), 1e-12)
    for i in range(3):
        pull[i] = tension * y[i] / size
    _compute_cross_product(arm, pull, own)
    return size


@kernel_part
def _add_cross_products(v: Floats, B: Floats, scale: float, C: Floats) -> None:
    """Add the cross products of v with the columns of B: C (3, n) += scale [v] B."""
    for i in range(3):
        j, h = (i + 1) % 3, (i + 2) % 3
        for c in range(B.shape[1]):
            C[i, c] += scale * (v[j] * B[h, c] - v[h] * B[j, c])


@kernel_part
def _multiply_row(row: Floats, T: Floats, left: Floats) -> None:
    """Multiply a row vector by a matrix in place: `row` (3,) becomes row T; `left` (3,) is a work array."""
    for i in range(3):
        left[i] = row[i]
    for j in range(3):
        row[j] = left[0] * T[0, j] + left[1] * T[1, j] + left[2] * T[2, j]


@kernel_part
def _compute_rotation_and_jacobian(x: float, y: float, z: float, E: Floats, T: Floats) -> None:
    """Compute the rotation matrix E = exp(theta) and the right Jacobian T of theta = (x, y, z)."""
    m = x * x + y * y + z * z
    if m < 0.01:
        s = 1.0 - m / 6.0 * (1.0 - m / 20.0 * (1.0 - m / 42.0 * (1.0 - m / 72.0)))
    else:
        s = math.sin(math.sqrt(m)) / math.sqrt(m)
    p, r = _jacobian_factors(m)
    E[0, 0], E[0, 1], E[0, 2] = 1.0 - p * (y * y + z * z), p * x * y - s * z, p * x * z + s * y
    E[1, 0], E[1, 1], E[1, 2] = p * x * y + s * z, 1.0 - p * (x * x + z * z), p * y * z - s * x
    E[2, 0], E[2, 1], E[2, 2] = p * x * z - s * y, p * y * z + s * x, 1.0 - p * (x * x + y * y)
    T[0, 0], T[0, 1], T[0, 2] = 1.0 - r * (y * y + z * z), r * x * y + p * z, r * x * z - p * y
    T[1, 0], T[1, 1], T[1, 2] = r * x * y - p * z, 1.0 - r * (x * x + z * z), r * y * z + p * x
    T[2, 0], T[2, 1], T[2, 2] = r * x * z + p * y, r * y * z - p * x, 1.0 - r * (x * x + y * y)


@kernel
def add_gyroscopic_moments(where: Ints, v: Floats, J: Floats, scale: float, f: Floats) -> None:
    """Add gyroscopic moments of sections: f (dofs,) += scale w x J w.

    w = v[where] (n, 3) are angular velocities in section axes, and J (n, 3) the principal moments of inertia.
    """
    for k in range(where.shape[0]):
        for i in range(3):
            a, b = (i + 1) % 3, (i + 2) % 3
            f[where[k, i]] += scale * v[where[k, a]] * v[where[k, b]] * (J[k, b] - J[k, a])


@kernel
def gyroscopic_derivatives(where: Ints, v: Floats, J: Floats, scale: float, found: Floats) -> None:
    """Write `scale` times the derivatives of the gyroscopic moments w x J w by w into `found` (n, 3, 3)."""
    for k in range(where.shape[0]):
        for i in range(3):
            a, b = (i + 1) % 3, (i + 2) % 3
            found[k, i, i] = 0.0
            found[k, i, a] = scale * v[where[k, b]] * (J[k, b] - J[k, a])
            found[k, i, b] = scale * v[where[k, a]] * (J[k, b] - J[k, a])


@allocating_kernel
def add_angular_momentum_change(
    where: Ints, x: Floats, v0: Floats, v1: Floats, J: Floats, h: float, B: float, f: Floats, found: Floats
) -> None:
    """Add the part of the change of angular momentum over a step h, s, that exceeds J (w1 - w0) / h.

    f (dofs,) += (exp(x/2) J w1 - exp(-x/2) J w0 - J (w1 - w0)) / h, in the axes of the middle of the step. x is the
    rotation of the step, w0 and w1 are the angular velocities before and after it. `found` (n, 3, 3), unless empty,
    receives the derivative by x, where w1 changes by B times the change of x.
    """
    E, T = np.zeros((2, 3, 3))
    for k in range(where.shape[0]):
        X, Y, Z = 0.5 * x[where[k, 0]], 0.5 * x[where[k, 1]], 0.5 * x[where[k, 2]]
        for side in range(2):
            sign = 1.0 - 2.0 * side
            v = v1 if side == 0 else v0
            _compute_rotation_and_jacobian(sign * X, sign * Y, sign * Z, E, T)
            a, b, c = J[k, 0] * v[where[k, 0]], J[k, 1] * v[where[k, 1]], J[k, 2] * v[where[k, 2]]
            f[where[k, 0]] += sign / h * (E[0, 0] * a + E[0, 1] * b + E[0, 2] * c - a)
            f[where[k, 1]] += sign / h * (E[1, 0] * a + E[1, 1] * b + E[1, 2] * c - b)
            f[where[k, 2]] += sign / h * (E[2, 0] * a + E[2, 1] * b + E[2, 2] * c - c)
            if found.shape[0] == 0:
                continue
            for j in range(3):  # d exp(y) u = -exp(y) [u] T dy
                x_, y_, z_ = b * T[2, j] - c * T[1, j], c * T[0, j] - a * T[2, j], a * T[1, j] - b * T[0, j]
                for i in range(3):
                    change = -0.5 / h * (E[i, 0] * x_ + E[i, 1] * y_ + E[i, 2] * z_)
                    if side == 0:
                        found[k, i, j] = change + B / h * J[k, j] * (E[i, j] - (1.0 if i == j else 0.0))
                    else:
                        found[k, i, j] += change
