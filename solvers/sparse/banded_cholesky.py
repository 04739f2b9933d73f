"""Banded Cholesky factorisation of symmetric matrices with a narrow band, such as the tangent of a rod.

With the nodes numbered along the rod, its tangent has 11 diagonals above the main diagonal. The factor has no entries
outside this band, so no ordering is needed: LAPACK's `pbtrf` takes a tenth of the time of a general sparse method.
"""

from __future__ import annotations

import threading
import weakref
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from softmark.solvers.energies.energy import Floats
from softmark.solvers.runtime.scipy_submodules import import_submodule
from softmark.solvers.runtime.work_count import count_factorization, count_product

NAME = "banded Cholesky (LAPACK)"
WIDEST = 32  # diagonals; LAPACK factorises narrower bands column by column, without threads
KEPT = 8  # largest number of cached patterns
NEUTRAL = 1e-13  # fraction of the largest pivot: the sign of smaller pivots is rounding
_LOCK = threading.Lock()


@cache
def _lapack() -> Any:
    """Return scipy's module of LAPACK functions."""
    return import_submodule("scipy.linalg._flapack")


class NegativePivot(Exception):
    """Raised if a pivot is negative beyond rounding, so that the matrix has a negative eigenvalue."""


@dataclass(frozen=True)
class BandedCholesky:
    """Banded Cholesky factor K = U^T U, with U in the band of K; every pivot is positive."""

    band: Floats  # (diagonals, n) U in LAPACK's band storage
    name: str = NAME
    negative_pivots: int | None = 0
    tolerance: float = 0.0
    iterations: int = 0

    def solve(self, b: Floats) -> Floats:
        """Return the solution x of K x = b."""
        count_product(2 * self.band.size)
        found: Floats = _lapack().dpbtrs(self.band, b)[0]
        return found


@dataclass(frozen=True)
class _Band:
    """Band storage of a sparsity pattern: its `shape`, and the number of a matrix entry for each band position."""

    shape: tuple[int, int]  # (n, diagonals)
    entries: NDArray[Any]  # number of the matrix entry at each band position, column by column; nnz if none


# weak reference to indptr, the array indices, the band (None if too wide); the latest entry first
_KNOWN: list[tuple[Any, Any, _Band | None]] = []


def factorise_banded(K: sparse.csr_matrix) -> BandedCholesky | None:
    """Return the banded factor of a symmetric matrix; None if the band is wide or a pivot vanishes to rounding.

    Raises NegativePivot for a negative pivot. LAPACK stops at the first pivot that is not positive and leaves its value
    in the band, since a band this narrow is factorised column by column.
    """
    band = None if K.dtype != np.float64 else _cached_band(K)
    if band is None:
        return None
    filled = np.append(K.data, 0.0).take(band.entries)
    count_factorization(band.shape[0] * band.shape[1] ** 2)
    factor, info = _lapack().dpbtrf(filled.reshape(band.shape).T, overwrite_ab=1)
    if not info:
        return BandedCholesky(factor)
    pivots = factor[-1, :info]
    if pivots[-1] < -NEUTRAL * np.max(pivots[:-1] ** 2, initial=-pivots[-1]):
        raise NegativePivot
    return None


def _cached_band(K: sparse.csr_matrix) -> _Band | None:
    """Return the cached band storage of the pattern of K; None if a banded factor is not worthwhile.

    A pattern is identified by its two arrays, as in `linear.symbolic_cache`.
    """
    for entry in _KNOWN:
        if entry[0]() is K.indptr and (entry[1] is K.indices or np.array_equal(entry[1], K.indices)):
            return entry[2]
    band = _find_band(K)
    with _LOCK:
        alive = [e for e in _KNOWN if e[0]() is not None]
        _KNOWN[:] = [(weakref.ref(K.indptr), K.indices, band), *alive[: KEPT - 1]]
    return band


def _find_band(K: sparse.csr_matrix) -> _Band | None:
    """Return the band storage of the pattern of K; None if a banded factor is not worthwhile.

    It is not worthwhile if the band is wide or has at least as many entries as the matrix, or if the pattern has
    duplicate entries.
    """
    n, columns = K.shape[0], K.indices.astype(np.int64)
    rows = np.repeat(np.arange(n), np.diff(K.indptr))
    above = int((columns - rows).max(initial=0))
    if above >= WIDEST or n * (above + 1) >= K.nnz or not K.has_canonical_format:
        return None
    upper = np.flatnonzero(columns >= rows)
    entries = np.full(n * (above + 1), K.nnz)
    entries[columns[upper] * (above + 1) + above + rows[upper] - columns[upper]] = upper
    return _Band((n, above + 1), entries)
