"""Cholesky's method within a band: for chains, such as the nodes of a rod in order, whose neighbours are near.

A tangent of a rod has 11 diagonals beside the main one. Its factor fills nothing else, so that there is no order to
look for: LAPACK's `pbtrf` takes a tenth of what a method for any sparse matrix takes.
"""

from __future__ import annotations

import threading
import weakref
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg.lapack import dpbtrf, dpbtrs

from softmark.solvers.energies.energy import Floats
from softmark.solvers.threads import ALONE

NAME = "banded Cholesky (LAPACK)"
KEPT = 8  # patterns known at a time
_LOCK = threading.Lock()


@dataclass(frozen=True)
class Banded:
    """K = U^T U, U within the band of K: every pivot is positive."""

    band: Floats  # of U (diagonals, n), as LAPACK stores it
    name: str = NAME
    negative_pivots: int | None = 0
    tolerance: float = 0.0
    iterations: int = 0

    def solve(self, b: Floats) -> Floats:
        """x with K x = b."""
        with ALONE:
            x, _ = dpbtrs(self.band, b)
        found: Floats = x
        return found


@dataclass(frozen=True)
class _Band:
    """Where the entries of a pattern stand in the band."""

    shape: tuple[int, int]  # (diagonals, n)
    entries: NDArray[Any]  # those of the upper triangle among the data
    places: NDArray[Any]  # of each in the band, columns one after the other


# a weak reference to indptr, indices, the band or None where the pattern is no chain; the latest first
_KNOWN: list[tuple[Any, Any, _Band | None]] = []


def banded(K: sparse.csr_matrix) -> Banded | None:
    """The factor of a symmetric matrix; None where its band is not narrow, or it is not positive definite."""
    band = None if K.dtype != np.float64 else _band_of(K)
    if band is None:
        return None
    filled = np.zeros(band.shape[0] * band.shape[1])
    filled[band.places] = K.data[band.entries]
    with ALONE:
        factor, info = dpbtrf(filled.reshape(band.shape[::-1]).T, overwrite_ab=1)
    return None if info else Banded(factor)


def _band_of(K: sparse.csr_matrix) -> _Band | None:
    """What is known of the pattern of K: by its two arrays, which nobody may change, as in `plans`."""
    for entry in _KNOWN:
        if entry[0]() is K.indptr and (entry[1] is K.indices or np.array_equal(entry[1], K.indices)):
            return entry[2]
    band = _found(K)
    with _LOCK:
        alive = [e for e in _KNOWN if e[0]() is not None]
        _KNOWN[:] = [(weakref.ref(K.indptr), K.indices, band), *alive[: KEPT - 1]]
    return band


def _found(K: sparse.csr_matrix) -> _Band | None:
    """None where the band has as many entries as the whole matrix, or more, or where an entry stands twice."""
    n, columns = K.shape[0], K.indices.astype(np.int64)
    rows = np.repeat(np.arange(n), np.diff(K.indptr))
    above = int((columns - rows).max(initial=0))
    if n * (above + 1) >= K.nnz or not K.has_canonical_format:
        return None
    entries = np.flatnonzero(columns >= rows)
    places = columns[entries] * (above + 1) + above + rows[entries] - columns[entries]
    return _Band((above + 1, n), entries, places)
