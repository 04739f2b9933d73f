"""Search for loss of strong ellipticity in anisotropic laws, by testing the acoustic tensor in sampled directions.

For anisotropic laws, unlike isotropic ones (ellipticity.py), there is no exact criterion. If a law can prove by a bound
that a state is elliptic (its method `elliptic`), nothing is computed. Otherwise the acoustic tensor Q(n) is tested in
thirteen directions: the face, edge and corner axes of a cube aligned with fibres and sheets. Q comes from the law's own
formula (its method `waves`) or from its stiffness A. Then a n : A : a n is minimised from the weakest direction: the
vectors a and n are improved in turn, each by a 3x3 eigenvalue problem, which can only lower the value. This is done at
the weakest fiftieth of the points, and at all points if it finds losses there. A loss that is found is certain. A state
where none is found is taken as elliptic.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.solvers.materials.batched_stability import STIFF, Bools, VolumePressure
from softmark.solvers.materials.heterogeneous import iterate_arrays, map_arrays
from softmark.solvers.materials.tensor_components import components

if TYPE_CHECKING:
    from softmark.solvers.materials.constitutive_law import Array

TURNS = 5  # alternating improvements of the two vectors
WEAKEST, FEW = 0.02, 64  # fraction of the points from which they are improved, and the smallest number
_CUBE = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (1, -1, 0), (1, 0, 1), (1, 0, -1), (0, 1, 1), (0, 1, -1),
         (1, 1, 1), (1, 1, -1), (1, -1, 1), (-1, 1, 1)]  # fmt: skip
DIRECTIONS = np.array(_CUBE) / np.linalg.norm(_CUBE, axis=1)[:, None]


def find_loss_in_directions(law: Any, F: Array, held: VolumePressure | None) -> Bools:
    """Return for which states F (m, 3, 3) a loss of strong ellipticity of an anisotropic law was found (m,).

    `held` is the separate volume constraint, or None.
    """
    found = np.zeros(len(F), dtype=np.bool_)
    passive = getattr(law, "passive", law)  # an active tension only adds to ellipticity
    with np.errstate(all="ignore"):
        left = np.arange(len(F))
        if hasattr(passive, "elliptic"):
            left = np.flatnonzero(~passive.elliptic(components(F)))
        if len(left):
            found[left] = _search_sampled_directions(
                _law_at_points(law, left), F[left], None if held is None else held.of(left)
            )
    return found


def _search_sampled_directions(law: Any, F: Array, held: VolumePressure | None) -> Bools:
    """Return for which states F (m, 3, 3) a loss of ellipticity is found (m,), without using a bound of the law."""
    least, positive, sound = _acoustic_tensor_tests(law, F, held)
    found: Bools = sound & ~positive.all(axis=1)
    order = np.flatnonzero(sound & ~found)
    order = order[np.argsort(least[order].min(axis=1))]
    count = max(FEW, int(WEAKEST * len(order)))
    for some in (order[:count], order[count:]):
        if len(some):
            own = _law_at_points(law, some)
            A = _constrained_tangent(own, F[some], None if held is None else held.of(some))
            n = np.einsum("da,aim->mdi", DIRECTIONS, _material_axes(own, len(some)))
            found[some] = _has_loss_near_directions(A, n[np.arange(len(some)), least[some].argmin(axis=1)])
        if not found[some].any():
            break
    return found


def _acoustic_tensor_tests(law: Any, F: Array, held: VolumePressure | None) -> tuple[Array, Bools, Bools]:
    """Return, for m states and 13 directions, a measure of the acoustic tensor Q and whether Q is positive definite.

    Both results are (m, 13). The measure is about the weakest eigenvalue of Q, or of a scaled Q of the same sign. The
    third result (m,) is False for states outside the domain of the law.
    """
    passive = getattr(law, "passive", law)
    if hasattr(passive, "waves") and not (law is not passive and law.own is not None):
        K = 0.0 if held is None else np.minimum(held.modulus, STIFF * passive.stiffness)
        Q = passive.waves(components(F), DIRECTIONS, K, getattr(law, "tension", 0.0)).transpose(3, 0, 1, 2)
    else:
        A = _constrained_tangent(law, F, held)
        n = np.einsum("da,aim->mdi", DIRECTIONS, _material_axes(law, len(F)))
        B = A.transpose(0, 1, 3, 2, 4).reshape(len(F), 9, 9)
        Q = (B @ (n[:, :, :, None] * n[:, :, None, :]).reshape(len(F), -1, 9).transpose(0, 2, 1)).transpose(0, 2, 1)
        Q = Q.reshape(len(F), -1, 3, 3)
    return *_weakest_eigenvalue(Q), np.isfinite(Q).all(axis=(1, 2, 3))


def _material_axes(law: Any, count: int) -> Array:
    """Return fibre, sheet and normal directions (3, 3, m): indices of direction, component and point."""
    found: Array = np.broadcast_to(law.frame.axes(np.float64), (3, 3, count))
    return found


def _law_at_points(law: Any, some: Any) -> Any:
    """Return the law at the points `some`, whose constants and directions may differ."""
    return map_arrays(law, lambda a: np.ravel(a)[some]) if next(iterate_arrays(law), None) is not None else law


def _constrained_tangent(law: Any, F: Array, held: VolumePressure | None) -> Array:
    """Return dP/dF (m, 3, 3, 3, 3), Pa, including the volume constraint."""
    A: Array = law.dPdF(F)
    if held is not None:
        g = held.constraint.gradient(F)
        most = STIFF * np.abs(A).max(axis=(1, 2, 3, 4)) / (g * g).sum(axis=(1, 2))
        M = np.minimum(held.modulus, most)
        A = A + held.constraint.curvature(F, held.pressure)
        A = A + M[:, None, None, None, None] * g[:, :, :, None, None] * g[:, None, None, :, :]
    return A


def _weakest_eigenvalue(Q: Array) -> tuple[Array, Bools]:
    """Return 1 / sum(1 / eigenvalues) (m, d) of Q (m, d, 3, 3), about the weakest eigenvalue, and definiteness.

    Q is symmetric. The second result (m, d) is True where Q is positive definite.
    """
    a, b, c, d, e, f = (Q[..., i, j] for i, j in ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)))
    first, second, third = b * c - d * d, a * c - e * e, a * b - f * f
    det = a * first - f * (f * c - d * e) + e * (f * d - b * e)
    return det / (first + second + third), (a > 0.0) & (third > 0.0) & (det > 0.0)


def _has_loss_near_directions(A: Array, n: Array) -> Bools:
    """Return whether a search from the directions n (k, 3) finds a loss of strong ellipticity, (k,).

    The search minimises a n : A : a n over unit vectors a and n, with the stiffness A (k, 3, 3, 3, 3), Pa. A minimum of
    zero or less is a loss.
    """
    for _ in range(TURNS):
        value, vectors = np.linalg.eigh(np.einsum("miJkL,mJ,mL->mik", A, n, n, optimize=True))
        a = vectors[:, :, 0]
        _, vectors = np.linalg.eigh(_symmetric_part(np.einsum("miJkL,mi,mk->mJL", A, a, a, optimize=True)))
        n = vectors[:, :, 0]
    found: Bools = value[:, 0] <= 0.0
    return found


def _symmetric_part(R: Array) -> Array:
    """Return the symmetric part of R (k, 3, 3)."""
    return 0.5 * (R + R.transpose(0, 2, 1))
