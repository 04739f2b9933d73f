"""Orders of elimination that keep the factor sparse."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softmark.solvers.sparse.fronts import dissect
from softmark.solvers.sparse.kernels import minimum_degree

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]
LEAF = 400  # nodes: smaller parts are not dissected further


def eliminate(indptr: Ints, indices: Ints, points: Floats | None = None) -> Ints:
    """Order (n,) of the nodes of a symmetric graph without loops; `points` (n, 3) say where they are.

    Minimum degree; in a large graph whose points are known, after the separators of a nested dissection are put last.
    """
    n = len(indptr) - 1
    order, last, first = np.empty(n, dtype=np.int64), np.zeros(n, dtype=np.bool_), n
    if points is not None and n > LEAF:
        first = dissect(indptr, indices, points, LEAF, order)
        last[order[first:]] = True
    lists = np.zeros((10, n + 1), dtype=np.int64)
    lists[:5] = -1
    flags = np.repeat([[True], [False]], n, axis=1)
    pool = np.empty(4 * len(indices) + 16 * n, dtype=np.int64)
    minimum_degree(indptr, indices.copy(), first, last, order, np.diff(indptr), lists, flags, pool)
    return order


def warm() -> None:
    """Load the kernels."""
    none = np.zeros(0, dtype=np.int64)
    dissect(np.zeros(2, dtype=np.int64), none, np.zeros((1, 3)), LEAF, np.zeros(1, dtype=np.int64))
