"""Vibration modes about an equilibrium: the lowest eigenpairs of K phi = w^2 M phi."""

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


class ModesNotFound(Exception):
    """Raised if modes are not found, or too many were requested; the message gives the reason."""


def lowest_modes(
    K: sparse.csr_matrix, M: sparse.csr_matrix, count: int, factorised: Callable[[], Factor]
) -> tuple[Floats, Floats]:
    """Return the squared frequencies w^2 (count,), (rad/s)^2, nearest to zero, and the modes (n, count).

    Frequencies are ascending, and modes Phi are scaled such that Phi^T M Phi = I. K is symmetric; an unstable one gives
    negative values. M is positive, or zero for unknowns without mass, such as pressures. Small systems are solved
    densely, large ones by Lanczos iteration on K^-1 M (Ericsson and Ruhe 1980), with the factorisation of K from
    `factorised`. Raises ModesNotFound, and the errors of the factorisation.
    """
    n, massive = K.shape[0], bool(np.all(M.diagonal() > 0.0))
    if massive and (n <= SMALL or count >= n // 2):
        found = dense.eigh(K.toarray(), M.toarray(), subset_by_index=(0, min(count, n) - 1))
        if count >= n // 2 or mode_residual(K, M, *found) <= CLOSE:  # else rounding of stiff modes dominates
            return found[0], found[1]
    if count >= n // 2:
        raise ModesNotFound(f"the model has too few unknowns for {count} modes")
    solve = factorised().solve
    inverse = LinearOperator((n, n), matvec=solve, dtype=np.float64)
    start = solve(M @ np.random.default_rng(0).standard_normal(n))
    try:
        values, modes = eigsh(K, count, M, sigma=0.0, OPinv=inverse, v0=start)
    except ArpackError as error:
        raise ModesNotFound(
            f"{count} modes were not found, since pressures may leave fewer: use a smaller mode number"
        ) from error
    order = np.argsort(values)
    return values[order], modes[:, order]


def mode_residual(K: sparse.csr_matrix, M: sparse.csr_matrix, values: Floats, modes: Floats) -> float:
    """Return the largest relative residual: |K phi - w^2 M phi| over the larger of |K phi| and |w^2 M phi|."""
    stiff, heavy = K @ modes, (M @ modes) * values
    sizes = np.maximum(np.linalg.norm(stiff, axis=0), np.linalg.norm(heavy, axis=0))
    return float(np.max(np.linalg.norm(stiff - heavy, axis=0) / sizes, initial=0.0))
