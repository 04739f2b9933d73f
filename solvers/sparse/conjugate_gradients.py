"""Conjugate gradients with a preconditioner."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy import sparse

from softmark.solvers.energies.energy import Floats


def conjugate_gradients(
    K: sparse.csr_matrix, b: Floats, precondition: Callable[[Floats], Floats], goal: float, budget: int
) -> tuple[Floats, int, bool]:
    """x with |b - K x| <= goal, iterations, and whether that was reached (Hestenes and Stiefel 1952).

    They end early where K or the preconditioner shows a curvature that is not positive.
    """
    x, r = np.zeros_like(b), b.copy()
    p, rz = np.zeros_like(b), 1.0
    for number in range(1, budget + 1):
        if dot(r, r) <= goal * goal:
            return x, number - 1, True
        z = precondition(r)
        rz, before = dot(r, z), rz
        p = z + (rz / before if number > 1 else 0.0) * p
        q = K @ p
        curvature = dot(p, q)
        if not (curvature > 0.0 and rz > 0.0):
            return x, number, False
        x += (rz / curvature) * p
        r -= (rz / curvature) * q
    return x, budget, dot(r, r) <= goal * goal


def dot(a: Floats, b: Floats) -> float:
    """a . b, by one thread: a second one of BLAS waits for longer than it works."""
    return float(np.einsum("i,i->", a, b))
