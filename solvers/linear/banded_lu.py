"""Banded LU solver for unsymmetric systems of chains, such as the tangents of a rod in motion."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats
from softmark.solvers.linear.factorisations import Singular, factor
from softmark.solvers.runtime.scipy_submodules import import_submodule
from softmark.solvers.sparse.banded_cholesky import WIDEST


@dataclass(frozen=True)
class _Layout:
    """Positions of the entries of a pattern in LAPACK's general band, and its lower and upper widths."""

    indptr: Any
    places: NDArray[Any]
    below: int
    above: int


class ChainSolver:
    """Gaussian elimination with row pivoting within the band (LAPACK's `gbsv`); SuperLU if the band is wide."""

    def __init__(self) -> None:
        """Start without a known pattern."""
        self._layout: _Layout | None = None
        self._solve = import_submodule("scipy.linalg._flapack").dgbsv

    def solve(self, K: sparse.csr_matrix, b: Floats, tolerance: float) -> Floats:
        """Return x with K x = b to rounding. Raises Singular."""
        layout = self._layout
        if layout is None or layout.indptr is not K.indptr:
            layout = self._layout = _layout(K)
        if layout.below + layout.above >= 2 * WIDEST:
            return factor(K, symmetric=False).solve(b)
        rows = 2 * layout.below + layout.above + 1
        band = np.zeros(K.shape[0] * rows)
        band[layout.places] = K.data
        if not np.isfinite(K.data.sum() + b.sum()):
            raise Singular("the matrix contains a number that is not finite")
        _, _, x, info = self._solve(layout.below, layout.above, band.reshape(-1, rows).T, b, overwrite_ab=1)
        if info:
            raise Singular("a pivot is zero")
        found: Floats = x
        return found


def _layout(K: sparse.csr_matrix) -> _Layout:
    """Return the band layout: entry i, j is in row below + above + i - j of column j, column by column."""
    columns = K.indices.astype(np.int64)
    rows = np.repeat(np.arange(K.shape[0]), np.diff(K.indptr))
    below, above = int((rows - columns).max(initial=0)), int((columns - rows).max(initial=0))
    places = columns * (2 * below + above + 1) + below + above + rows - columns
    return _Layout(K.indptr, places, below, above)
