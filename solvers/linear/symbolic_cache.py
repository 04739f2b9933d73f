"""Cache of symbolic factorisations: each sparsity pattern is analysed once, as long as its arrays exist.

A sparsity pattern consists of the arrays `indptr` and `indices` of a matrix.
"""

from __future__ import annotations

import threading
import weakref
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import sparse

from softmark.solvers.sparse.symbolic_factorization import FactorEstimate, Symbolic, estimate_factor, plan_fronts

if TYPE_CHECKING:
    from softmark.solvers.sparse.rigid_body_modes import Modes

KEPT = 8  # largest number of cached patterns
_LOCK = threading.Lock()


class KnownPattern:
    """Cached analysis of a sparsity pattern.

    `sketch` is the estimated cost of its factor. The symbolic factorisation is computed when it is first needed.
    """

    def __init__(self, found: FactorEstimate) -> None:
        """Store the estimate `found` of the factor's cost."""
        self.sketch = found
        self._plan: Symbolic | None = None

    def plan(self, K: sparse.csr_matrix) -> Symbolic:
        """Return the symbolic factorisation of the pattern; K is any matrix with this pattern."""
        if self._plan is None:
            self._plan = plan_fronts(K, self.sketch)
        return self._plan


# weak reference to indptr, the array indices, the analysis; the latest entry first
_KNOWN: list[tuple[Any, Any, KnownPattern]] = []


def cached_pattern(K: sparse.csr_matrix, motions: Modes = None) -> KnownPattern:
    """Return the cached analysis of the sparsity pattern of K; a new pattern is analysed first.

    `motions` are the rigid body modes of the unknowns. A pattern is identified by its arrays `indptr` and `indices`, or
    by arrays with equal numbers; the arrays must not be modified. The entry is removed together with the array `indptr`
    of the analysed matrix: scipy shares this array between a pattern and its matrices, while each matrix has its own
    view of the indices. Raises ValueError unless the pattern is symmetric with a full diagonal.
    """
    with _LOCK:
        for entry in _KNOWN:
            if _is_same_array(entry[0](), K.indptr) and _is_same_array(entry[1], K.indices):
                return entry[2]
    known = KnownPattern(estimate_factor(K, motions() if callable(motions) else motions))
    with _LOCK:
        alive = [e for e in _KNOWN if e[0]() is not None]
        entry = (weakref.ref(K.indptr, _remove_pattern), K.indices, known)
        _KNOWN[:] = [entry, *alive[: KEPT - 1]]
    return known


def cached_plan(K: sparse.csr_matrix, motions: Modes = None) -> Symbolic:
    """Return the symbolic factorisation for the pattern of K. Raises ValueError as `cached_pattern` does."""
    return cached_pattern(K, motions).plan(K)


def _is_same_array(known: Any, array: Any) -> bool:
    """Return whether `array` is the known array, or has equal numbers."""
    return known is array or (known is not None and np.array_equal(known, array))


def _remove_pattern(reference: Any) -> None:
    """Remove the entry of a pattern from the cache after its array was garbage-collected.

    This can happen at any time, so the list is replaced in one atomic step, without a lock.
    """
    _KNOWN[:] = [e for e in _KNOWN if reference is not e[0]]
