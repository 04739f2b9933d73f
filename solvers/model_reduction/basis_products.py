"""Products with the fields V (n, r) of a space, by one thread: they are too small for more, which would only wait."""

from __future__ import annotations

from scipy.linalg import blas

from softmark.solvers.energies.energy import Floats
from softmark.solvers.runtime.thread_limits import ALONE


def up(V: Floats, q: Floats) -> Floats:
    """V q (n,)."""
    with ALONE:
        x: Floats = blas.dgemv(1.0, V.T, q, trans=1)
    return x


def down(V: Floats, f: Floats) -> Floats:
    """V^T f (r,)."""
    with ALONE:
        g: Floats = blas.dgemv(1.0, V.T, f)
    return g


def inner(V: Floats, W: Floats) -> Floats:
    """V^T W (r, s)."""
    with ALONE:
        block: Floats = blas.dgemm(1.0, V.T, W.T, trans_b=1)
    return block
