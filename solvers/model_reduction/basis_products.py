"""Products with the displacement fields V (n, r) of a reduced model, in one thread.

The products are too small to gain from more threads.
"""

from __future__ import annotations

from scipy.linalg import blas

from softmark.solvers.energies.energy import Floats
from softmark.solvers.runtime.thread_limits import ALONE


def expand(V: Floats, q: Floats) -> Floats:
    """Return the full displacements V q (n,) of the reduced unknowns q (r,)."""
    with ALONE:
        x: Floats = blas.dgemv(1.0, V.T, q, trans=1)
    return x


def project(V: Floats, f: Floats) -> Floats:
    """Return the generalised forces V^T f (r,) of the full forces f (n,)."""
    with ALONE:
        g: Floats = blas.dgemv(1.0, V.T, f)
    return g


def inner_products(V: Floats, W: Floats) -> Floats:
    """Return the matrix V^T W (r, s) of inner products between the columns of V (n, r) and W (n, s)."""
    with ALONE:
        block: Floats = blas.dgemm(1.0, V.T, W.T, trans_b=1)
    return block
