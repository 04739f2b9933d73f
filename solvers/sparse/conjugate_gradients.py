"""Preconditioned conjugate gradients."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy import sparse

from softmark.solvers.energies.energy import Floats
from softmark.solvers.runtime.work_count import count_product


def conjugate_gradients(
    K: sparse.csr_matrix, b: Floats, precondition: Callable[[Floats], Floats], goal: float, budget: int
) -> tuple[Floats, int, bool]:
    """Return the solution x of K x = b, the number of iterations, and whether |b - K x| <= `goal` was reached.

    `precondition` applies the preconditioner to a residual; `budget` is the largest number of iterations. Iterations
    stop early if K or the preconditioner has a curvature that is not positive.
    Source: Hestenes and Stiefel (1952).
    """
    x, r = np.zeros_like(b), b.copy()
    p, rz = np.zeros_like(b), 1.0
    for number in range(1, budget + 1):
        if dot(r, r) <= goal * goal:
            return x, number - 1, True
        count_product(K.nnz)
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
    """Return the dot product a . b, computed in one thread: a second BLAS thread would cost more than it saves."""
    return float(np.einsum("i,i->", a, b))
