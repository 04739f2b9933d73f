"""Banded LU solver for unsymmetric banded matrices, such as the tangents of a rod in motion."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats
from softmark.solvers.linear.factorisations import Singular, factor
from softmark.solvers.runtime.scipy_submodules import import_submodule
from softmark.solvers.runtime.work_count import count_factorization
from softmark.solvers.sparse.banded_cholesky import WIDEST


@dataclass(frozen=True)
class _Layout:
    """Band storage of a sparsity pattern in LAPACK's general band format.

    `indptr` identifies the pattern. `places` are the positions of the matrix entries in the band; `below` and `above`
    are the lower and upper bandwidths.
    """

    indptr: Any
    places: NDArray[Any]
    below: int
    above: int


class BandedLuSolver:
    """Solver for unsymmetric banded systems by Gaussian elimination with row pivoting (LAPACK's `gbsv`).

    SuperLU is used instead if the band is wide.
    """

    def __init__(self) -> None:
        """Create a solver without a stored band layout; the first solve computes it."""
        self._layout: _Layout | None = None
        self._solve = import_submodule("scipy.linalg._flapack").dgbsv

    def solve(self, K: sparse.csr_matrix, b: Floats, tolerance: float) -> Floats:
        """Return the solution x of K x = b, accurate to rounding; `tolerance` has no effect. Raises Singular."""
        layout = self._layout
        if layout is None or layout.indptr is not K.indptr:
            layout = self._layout = _band_layout(K)
        if layout.below + layout.above >= 2 * WIDEST:
            return factor(K, symmetric=False).solve(b)
        rows = 2 * layout.below + layout.above + 1
        band = np.zeros(K.shape[0] * rows)
        band[layout.places] = K.data
        if not np.isfinite(K.data.sum() + b.sum()):
            raise Singular("the matrix contains a number that is not finite")
        count_factorization(2 * K.shape[0] * rows * (layout.below + 1))
        _, _, x, info = self._solve(layout.below, layout.above, band.reshape(-1, rows).T, b, overwrite_ab=1)
        if info:
            raise Singular("a pivot is zero")
        found: Floats = x
        return found


def _band_layout(K: sparse.csr_matrix) -> _Layout:
    """Return the band layout of the pattern of K.

    The entry in row i and column j is stored in row below + above + i - j of column j; columns are contiguous.
    """
    columns = K.indices.astype(np.int64)
    rows = np.repeat(np.arange(K.shape[0]), np.diff(K.indptr))
    below, above = int((rows - columns).max(initial=0)), int((columns - rows).max(initial=0))
    places = columns * (2 * below + above + 1) + below + above + rows - columns
    return _Layout(K.indptr, places, below, above)
