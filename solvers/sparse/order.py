"""Orders of elimination that keep the factor sparse."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softmark.solvers.sparse.kernels import minimum_degree

Ints = NDArray[np.int64]


def eliminate(indptr: Ints, indices: Ints, weights: Ints) -> Ints:
    """Order (n,) of the nodes of a symmetric graph without loops."""
    order = np.empty(len(indptr) - 1, dtype=np.int64)
    minimum_degree(indptr, indices, order)
    return order
