"""Where a law with directions has lost strong ellipticity: its acoustic tensor looked at in directions, and beyond.

Of such laws it is not decided, as of isotropic ones (ellipticity.py). Where a law knows of a state that it is
elliptic, by a bound (`elliptic`), nothing is computed. Elsewhere the acoustic tensor Q(n) is asked in thirteen
directions, the axes of a cube along fibres and sheets, those of its edges and of its corners: as the law writes it
(`waves`), or of its stiffness. From the weakest of them the two vectors of a n : A : a n are then improved in turn,
each by an eigenvalue of three by three, which can only lower it: at the weakest fiftieth of the points, and at all
where that finds more. What is found is lost; a state that is lost in none of the directions so reached is taken for
one that is not.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.solvers.materials.batched_stability import STIFF, Bools, Held
from softmark.solvers.materials.heterogeneous import arrays, changed
from softmark.solvers.materials.tensor_components import components

if TYPE_CHECKING:
    from softmark.solvers.materials.constitutive_law import Array

TURNS = 5  # of the two vectors
WEAKEST, FEW = 0.02, 64  # share of the points from which they are improved, and at least so many
_CUBE = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (1, -1, 0), (1, 0, 1), (1, 0, -1), (0, 1, 1), (0, 1, -1),
         (1, 1, 1), (1, 1, -1), (1, -1, 1), (-1, 1, 1)]  # fmt: skip
DIRECTIONS = np.array(_CUBE) / np.linalg.norm(_CUBE, axis=1)[:, None]


def lost(law: Any, F: Array, held: Held | None) -> Bools:
    """At which of the states F (m, 3, 3) a law with directions was found to have lost strong ellipticity (m,).

    `held` is what holds the volume beside it, or None.
    """
    found = np.zeros(len(F), dtype=np.bool_)
    passive = getattr(law, "passive", law)  # a tension only adds to it
    with np.errstate(all="ignore"):
        left = np.arange(len(F))
        if hasattr(passive, "elliptic"):
            left = np.flatnonzero(~passive.elliptic(components(F)))
        if len(left):
            found[left] = _looked(_some(law, left), F[left], None if held is None else held.of(left))
    return found


def _looked(law: Any, F: Array, held: Held | None) -> Bools:
    """The same of states of which no bound is known."""
    least, positive, sound = _in_directions(law, F, held)
    found: Bools = sound & ~positive.all(axis=1)
    order = np.flatnonzero(sound & ~found)
    order = order[np.argsort(least[order].min(axis=1))]
    count = max(FEW, int(WEAKEST * len(order)))
    for some in (order[:count], order[count:]):
        if len(some):
            own = _some(law, some)
            A = _stiffness(own, F[some], None if held is None else held.of(some))
            n = np.einsum("da,aim->mdi", DIRECTIONS, _axes(own, len(some)))
            found[some] = _reached(A, n[np.arange(len(some)), least[some].argmin(axis=1)])
        if not found[some].any():
            break
    return found


def _in_directions(law: Any, F: Array, held: Held | None) -> tuple[Array, Bools, Bools]:
    """How weak acoustic tensors are, whether they are positive (m, 13), and whether the law has a value there (m,)."""
    passive = getattr(law, "passive", law)
    if hasattr(passive, "waves") and not (law is not passive and law.own is not None):
        K = 0.0 if held is None else np.minimum(held.modulus, STIFF * passive.stiffness)
        Q = passive.waves(components(F), DIRECTIONS, K, getattr(law, "tension", 0.0)).transpose(3, 0, 1, 2)
    else:
        A = _stiffness(law, F, held)
        n = np.einsum("da,aim->mdi", DIRECTIONS, _axes(law, len(F)))
        B = A.transpose(0, 1, 3, 2, 4).reshape(len(F), 9, 9)
        Q = (B @ (n[:, :, :, None] * n[:, :, None, :]).reshape(len(F), -1, 9).transpose(0, 2, 1)).transpose(0, 2, 1)
        Q = Q.reshape(len(F), -1, 3, 3)
    return *_weak(Q), np.isfinite(Q).all(axis=(1, 2, 3))


def _axes(law: Any, count: int) -> Array:
    """Fibres, sheets and what is across both (3, 3, m), the components second."""
    found: Array = np.broadcast_to(law.frame.axes(np.float64), (3, 3, count))
    return found


def _some(law: Any, some: Any) -> Any:
    """The law of some points."""
    return changed(law, lambda a: np.ravel(a)[some]) if next(arrays(law), None) is not None else law


def _stiffness(law: Any, F: Array, held: Held | None) -> Array:
    """dP/dF (m, 3, 3, 3, 3), Pa, with what holds the volume."""
    A: Array = law.dPdF(F)
    if held is not None:
        g = held.constraint.gradient(F)
        most = STIFF * np.abs(A).max(axis=(1, 2, 3, 4)) / (g * g).sum(axis=(1, 2))
        M = np.minimum(held.modulus, most)
        A = A + held.constraint.curvature(F, held.pressure)
        A = A + M[:, None, None, None, None] * g[:, :, :, None, None] * g[:, None, None, :, :]
    return A


def _weak(Q: Array) -> tuple[Array, Bools]:
    """1 / sum(1 / eigenvalues) (m, d) of symmetric Q (m, d, 3, 3), and whether it is positive definite."""
    a, b, c, d, e, f = (Q[..., i, j] for i, j in ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)))
    first, second, third = b * c - d * d, a * c - e * e, a * b - f * f
    det = a * first - f * (f * c - d * e) + e * (f * d - b * e)
    return det / (first + second + third), (a > 0.0) & (third > 0.0) & (det > 0.0)


def _reached(A: Array, n: Array) -> Bools:
    """Whether a n : A : a n comes to zero or less, from a direction n (k, 3)."""
    for _ in range(TURNS):
        value, vectors = np.linalg.eigh(np.einsum("miJkL,mJ,mL->mik", A, n, n, optimize=True))
        a = vectors[:, :, 0]
        _, vectors = np.linalg.eigh(_even(np.einsum("miJkL,mi,mk->mJL", A, a, a, optimize=True)))
        n = vectors[:, :, 0]
    found: Bools = value[:, 0] <= 0.0
    return found


def _even(R: Array) -> Array:
    return 0.5 * (R + R.transpose(0, 2, 1))
