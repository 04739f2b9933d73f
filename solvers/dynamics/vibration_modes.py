"""Small vibrations about an equilibrium: the lowest of K phi = w^2 M phi."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy import linalg as dense
from scipy import sparse
from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh

from softmark.solvers.energies.energy import Floats
from softmark.solvers.linear.factorisations import Factor

SMALL = 300  # unknowns up to which all modes are found at once
CLOSE = 1e-6  # relative residual of a mode: its frequency is then right to some 1e-12


class NotSettled(Exception):
    """The modes were not found, or too many were asked for; the text says which."""


def lowest(
    K: sparse.csr_matrix, M: sparse.csr_matrix, count: int, factorised: Callable[[], Factor]
) -> tuple[Floats, Floats]:
    """w^2 (count,), (rad/s)^2, nearest to zero in rising order, and modes (n, count) with Phi^T M Phi = I.

    K is symmetric, and one that is unstable has values below zero; M is positive, or zero for unknowns without mass,
    such as pressures. All modes at once in small systems; else Lanczos iteration on K^-1 M (Ericsson and Ruhe 1980),
    with K `factorised`. Raises NotSettled, and what a factor raises.
    """
    n, massive = K.shape[0], bool(np.all(M.diagonal() > 0.0))
    if massive and (n <= SMALL or count >= n // 2):
        found = dense.eigh(K.toarray(), M.toarray(), subset_by_index=(0, min(count, n) - 1))
        if count >= n // 2 or unsettled(K, M, *found) <= CLOSE:  # else the stiffest of K is all that is seen of it
            return found[0], found[1]
    if count >= n // 2:
        raise NotSettled(f"there are too few unknowns for {count} modes")
    solve = factorised().solve
    inverse = LinearOperator((n, n), matvec=solve, dtype=np.float64)
    start = solve(M @ np.random.default_rng(0).standard_normal(n))
    try:
        values, modes = eigsh(K, count, M, sigma=0.0, OPinv=inverse, v0=start)
    except ArpackError as error:
        raise NotSettled(f"{count} modes were not found: pressures may leave fewer, ask for a lower one") from error
    order = np.argsort(values)
    return values[order], modes[:, order]


def unsettled(K: sparse.csr_matrix, M: sparse.csr_matrix, values: Floats, modes: Floats) -> float:
    """The largest |K phi - w^2 M phi| over |K phi| or, where that is more, |w^2 M phi|."""
    stiff, heavy = K @ modes, (M @ modes) * values
    sizes = np.maximum(np.linalg.norm(stiff, axis=0), np.linalg.norm(heavy, axis=0))
    return float(np.max(np.linalg.norm(stiff - heavy, axis=0) / sizes, initial=0.0))
