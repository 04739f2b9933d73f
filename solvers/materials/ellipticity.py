"""Loss of strong ellipticity: small waves can no longer travel, and strain localises in bands.

A state F is strongly elliptic if a n : dP/dF : a n > 0 for all directions a and n (Hadamard). Equivalently, the
acoustic tensor Q(n)_ik = A_iJkL n_J n_L is positive definite for every n. Positive second-order work is required of
waves only, so structural buckling is not counted. A law with polyconvex energy never loses ellipticity.

For isotropic laws the decision is exact, without sampling. In principal axes Q_ii = sum_j d_ij n_j^2 and Q_ij = b_ij
n_i n_j with d_ij = A_ijij and b_ij = A_iijj + A_ijji. So det Q is a cubic form of y = n^2 on the triangle y >= 0. If Q
is positive definite at one corner and the form is positive on the whole triangle, Q is positive definite everywhere.
The form is positive if all its Bernstein coefficients are. Otherwise the triangle is subdivided until all coefficients
are positive, or until the form is not positive at a corner.
Sources: Simpson and Spector (1983), "On copositive matrices and strong ellipticity for isotropic elastic materials";
Farin (1986), "Triangular Bernstein-Bezier patches".
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.solvers.materials.batched_stability import (
    STIFF,
    Bools,
    VolumePressure,
    evaluate_by_law,
    evaluate_in_blocks,
)
from softmark.solvers.materials.hyperelastic import Hyperelastic
from softmark.solvers.materials.polar_decomposition import stretches
from softmark.solvers.materials.tensor_components import cofactor, components
from softmark.solvers.materials.two_invariant_law import TwoInvariantLaw, shifted_invariants

if TYPE_CHECKING:
    from softmark.solvers.materials.constitutive_law import Array

CUTS = 7  # subdivisions of the triangle; a form still undecided is taken as positive
CORNERS = np.eye(3)
PERMUTATIONS = ((0, 1, 2), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0))
PARTS = 0.5 * np.array([  # corners of the four parts of a triangle
    [[2, 0, 0], [1, 1, 0], [1, 0, 1]], [[1, 1, 0], [0, 2, 0], [0, 1, 1]],
    [[1, 0, 1], [0, 1, 1], [0, 0, 2]], [[1, 1, 0], [0, 1, 1], [1, 0, 1]],
])  # fmt: skip


def find_ellipticity_loss(law: Any, F: Array, held: VolumePressure | None = None) -> Bools | None:
    """Return for which states F (m, 3, 3) a law is not strongly elliptic (m,); None if unknown.

    For anisotropic laws the result is the losses that were found (acoustic_tensor.py). States outside the domain, which
    have no stress, are not counted. `held` is the separate volume constraint, or None.
    """
    return evaluate_by_law(_is_ellipticity_lost, law, F, held)


def _is_ellipticity_lost(law: Any, F: Array, held: VolumePressure | None) -> Bools | None:
    """Return for which states F (m, 3, 3) one law is not strongly elliptic (m,); None if unknown."""
    if getattr(law, "directed", False):
        from softmark.solvers.materials import acoustic_tensor

        return acoustic_tensor.find_loss_in_directions(law, F, held)
    if not isinstance(law, Hyperelastic):
        return None
    return evaluate_in_blocks(
        _find_invariant_law_loss if isinstance(law, TwoInvariantLaw) and held is None else _find_isotropic_loss,
        law,
        F,
        held,
    )


def _find_invariant_law_loss(law: Any, F: Array, held: VolumePressure | None = None) -> Bools:
    """Return the states (m,) where a law psi(I1, J) without coupling of I1 and J has lost ellipticity.

    For such a law, linear in I1, Q = a 1 + d (C n) (C n)^T with C = cof F.
    """
    f = components(F)
    stretch, j = shifted_invariants(f)
    (a, _), (c, d) = law.slopes(stretch, j), law.curvatures(stretch, j)
    if c is not None:
        return _find_isotropic_loss(law, F, None)
    found: Bools = (a <= 0.0) & np.isfinite(d)
    soft = np.flatnonzero(d < 0.0)
    if len(soft):
        C = cofactor(f[:, :, soft]).transpose(2, 0, 1)
        found[soft] |= np.broadcast_to(a, d.shape)[soft] + d[soft] * np.linalg.norm(C, 2, axis=(1, 2)) ** 2 <= 0.0
    return found


def _find_isotropic_loss(law: Any, F: Array, held: VolumePressure | None) -> Bools:
    """Return the states (m,) where an isotropic law has lost ellipticity, from its stiffness in principal axes."""
    s = stretches(components(F))
    s[0] *= np.where(np.linalg.det(F) < 0.0, -1.0, 1.0)
    state = np.zeros((len(F), 3, 3))
    state[:, range(3), range(3)] = s.T
    A = law.dPdF(state)
    if held is not None:
        A = A + held.constraint.curvature(state, held.pressure)
    i, k = np.indices((3, 3))
    d, b = A[:, i, k, i, k], A[:, i, i, k, k] + np.where(i == k, 0.0, A[:, i, k, k, i])  # (m, 3, 3)
    if held is not None:
        g = held.constraint.gradient(state)[:, range(3), range(3)]
        most = STIFF * np.abs(d).max(axis=(1, 2)) / (g * g).max(axis=1)
        M = np.minimum(held.modulus, most)
        d = d + (M[:, None] * g * g)[:, :, None] * np.eye(3)
        b = b + M[:, None, None] * g[:, :, None] * g[:, None, :]
    sound = np.isfinite(d).all(axis=(1, 2)) & np.isfinite(b).all(axis=(1, 2))
    found: Bools = sound & np.any(d[:, :, 0] <= 0.0, axis=1)
    form = _acoustic_determinant_form(d, b)
    doubtful = np.flatnonzero(sound & ~found & ~(form > 0.0).all(axis=(1, 2, 3)))
    if len(doubtful):
        found[doubtful] = _has_nonpositive_value(form[doubtful])
    return found


def _acoustic_determinant_form(d: Array, b: Array) -> Array:
    """Return det Q as the symmetric tensor (k, 3, 3, 3) of the cubic form in y, from d and b (k, 3, 3)."""
    d, b = np.moveaxis(d, 0, -1), np.moveaxis(b, 0, -1)  # rows of points
    x = (b[1, 2] ** 2, b[2, 0] ** 2, b[0, 1] ** 2)
    T = np.empty((3, 3, 3, d.shape[2]))
    for a in range(3):
        T[a, a, a] = d[0, a] * d[1, a] * d[2, a]
        for c in range(3):
            if c != a:  # of y_a^2 y_c: x_i goes with y_j y_k of i's others, one of which is a and one c
                i = 3 - a - c
                own = sum(d[i, c] * d[j, a] * d[k, a] for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)))
                T[a, a, c] = T[a, c, a] = T[c, a, a] = (own - d[i, a] * x[i]) / 3.0
    mixed = 2.0 * b[0, 1] * b[1, 2] * b[2, 0] - d[0, 0] * x[0] - d[1, 1] * x[1] - d[2, 2] * x[2]
    for p in PERMUTATIONS:
        mixed = mixed + d[0, p[0]] * d[1, p[1]] * d[2, p[2]]
    for p in PERMUTATIONS:
        T[p] = mixed / 6.0
    return np.moveaxis(T, -1, 0)


def _has_nonpositive_value(T: Array) -> Bools:
    """Return which cubic forms (k, 3, 3, 3) are zero or less somewhere on the triangle."""
    found, who = np.zeros(len(T), dtype=np.bool_), np.arange(len(T))
    corners = np.tile(CORNERS, (len(T), 1, 1))  # (k, 3, 3): each row a corner
    for _ in range(CUTS):
        B = np.einsum("mabc,mia,mjb,mkc->mijk", T[who], corners, corners, corners, optimize=True)
        at = B[:, range(3), range(3), range(3)]
        found[who[np.any(at <= 0.0, axis=1)]] = True
        open_ = ~(B > 0.0).all(axis=(1, 2, 3)) & ~found[who]
        if not open_.any():
            break
        who = np.repeat(who[open_], len(PARTS))
        corners = np.einsum("pij,mjk->mpik", PARTS, corners[open_]).reshape(-1, 3, 3)
    return found
