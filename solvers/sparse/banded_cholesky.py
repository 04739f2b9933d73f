"""Banded Cholesky factorisation for chains, such as the nodes of a rod in order.

A rod tangent has 11 diagonals beside the main one, and its factor fills nothing else, so that no ordering is needed:
LAPACK's `pbtrf` takes a tenth of the time of a general sparse method.
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

NAME = "banded Cholesky (LAPACK)"
WIDEST = 32  # diagonals up to which LAPACK goes column by column: nothing that threads could share
KEPT = 8  # patterns known at a time
NEUTRAL = 1e-13  # of the largest pivot: smaller ones have no sign
_LOCK = threading.Lock()


@cache
def _lapack() -> Any:
    """Return the module of LAPACK functions in scipy."""
    return import_submodule("scipy.linalg._flapack")


class NegativePivot(Exception):
    """Raised if a pivot is negative beyond rounding: the matrix has a negative eigenvalue."""


@dataclass(frozen=True)
class BandedCholesky:
    """Banded Cholesky factor K = U^T U, U within the band of K: every pivot is positive."""

    band: Floats  # of U (diagonals, n), as LAPACK stores it
    name: str = NAME
    negative_pivots: int | None = 0
    tolerance: float = 0.0
    iterations: int = 0

    def solve(self, b: Floats) -> Floats:
        """Return x with K x = b."""
        found: Floats = _lapack().dpbtrs(self.band, b)[0]
        return found


@dataclass(frozen=True)
class _Band:
    """Positions of the entries of a pattern in the band."""

    shape: tuple[int, int]  # (n, diagonals)
    entries: NDArray[Any]  # for each place of the band, column by column, which of the data; one behind the last: none


# a weak reference to indptr, indices, the band or None where the pattern is no chain; the latest first
_KNOWN: list[tuple[Any, Any, _Band | None]] = []


def factorise_banded(K: sparse.csr_matrix) -> BandedCholesky | None:
    """Return the factor of a symmetric matrix; None if its band is wide, or a pivot vanishes to rounding.

    Raises NegativePivot for a negative pivot. LAPACK stops at the first one that is not positive, and leaves it in
    place:
    bands this narrow are factorised column by column.
    """
    band = None if K.dtype != np.float64 else _band_of(K)
    if band is None:
        return None
    filled = np.append(K.data, 0.0).take(band.entries)
    factor, info = _lapack().dpbtrf(filled.reshape(band.shape).T, overwrite_ab=1)
    if not info:
        return BandedCholesky(factor)
    pivots = factor[-1, :info]
    if pivots[-1] < -NEUTRAL * np.max(pivots[:-1] ** 2, initial=-pivots[-1]):
        raise NegativePivot
    return None


def _band_of(K: sparse.csr_matrix) -> _Band | None:
    """Return the cached band of the pattern of K, identified by its two arrays, as in `linear.symbolic_cache`."""
    for entry in _KNOWN:
        if entry[0]() is K.indptr and (entry[1] is K.indices or np.array_equal(entry[1], K.indices)):
            return entry[2]
    band = _find_band(K)
    with _LOCK:
        alive = [e for e in _KNOWN if e[0]() is not None]
        _KNOWN[:] = [(weakref.ref(K.indptr), K.indices, band), *alive[: KEPT - 1]]
    return band


def _find_band(K: sparse.csr_matrix) -> _Band | None:
    """Return the band of a pattern; None if it is wide, as full as the whole matrix, or has duplicate entries."""
    n, columns = K.shape[0], K.indices.astype(np.int64)
    rows = np.repeat(np.arange(n), np.diff(K.indptr))
    above = int((columns - rows).max(initial=0))
    if above >= WIDEST or n * (above + 1) >= K.nnz or not K.has_canonical_format:
        return None
    upper = np.flatnonzero(columns >= rows)
    entries = np.full(n * (above + 1), K.nnz)
    entries[columns[upper] * (above + 1) + above + rows[upper] - columns[upper]] = upper
    return _Band((n, above + 1), entries)
