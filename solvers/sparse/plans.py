"""Plans of factorisations by pattern: each pattern is analysed once, as long as its arrays live."""

from __future__ import annotations

import threading
import weakref
from typing import Any

import numpy as np
from scipy import sparse

from softmark.solvers.sparse.symbolic import Symbolic, analyse

KEPT = 8  # patterns known at a time
_LOCK = threading.Lock()
# a weak reference to indptr, indices, the plan; the latest first
_KNOWN: list[tuple[Any, Any, Symbolic]] = []


def plan_of(K: sparse.csr_matrix) -> Symbolic:
    """The plan for matrices with the pattern of K. Raises ValueError where it is not symmetric with a full diagonal.

    A pattern is known by its two arrays, which nobody may change, or by equal ones, and forgotten with the array
    `indptr` of the matrix that was analysed: scipy hands that on from a pattern to its matrices, while each of these
    has its own view of the indices.
    """
    with _LOCK:
        for entry in _KNOWN:
            if _same(entry[0](), K.indptr) and _same(entry[1], K.indices):
                return entry[2]
    plan = analyse(K)
    with _LOCK:
        alive = [e for e in _KNOWN if e[0]() is not None]
        entry = (weakref.ref(K.indptr, _forget), K.indices, plan)
        _KNOWN[:] = [entry, *alive[: KEPT - 1]]
    return plan


def _same(known: Any, array: Any) -> bool:
    return known is array or (known is not None and np.array_equal(known, array))


def _forget(reference: Any) -> None:
    """Called when an array has died, at any time: an atomic change, and no lock that this thread may hold."""
    _KNOWN[:] = [e for e in _KNOWN if reference is not e[0]]
