"""Products with the fields V (n, r) of a reduced space, in one thread: they are too small to gain from more."""

from __future__ import annotations

from scipy.linalg import blas

from softmark.solvers.energies.energy import Floats
from softmark.solvers.runtime.thread_limits import ALONE


def expand(V: Floats, q: Floats) -> Floats:
    """Return V q (n,)."""
    with ALONE:
        x: Floats = blas.dgemv(1.0, V.T, q, trans=1)
    return x


def project(V: Floats, f: Floats) -> Floats:
    """Return V^T f (r,)."""
    with ALONE:
        g: Floats = blas.dgemv(1.0, V.T, f)
    return g


def inner_products(V: Floats, W: Floats) -> Floats:
    """Return V^T W (r, s)."""
    with ALONE:
        block: Floats = blas.dgemm(1.0, V.T, W.T, trans_b=1)
    return block
