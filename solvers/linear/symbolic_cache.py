"""Plans of factorisations by pattern: each pattern is analysed once, as long as its arrays live."""

from __future__ import annotations

import threading
import weakref
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import sparse

from softmark.solvers.sparse.symbolic_factorization import Sketch, Symbolic, plan, sketch

if TYPE_CHECKING:
    from softmark.solvers.sparse.rigid_body_modes import Modes

KEPT = 8  # patterns known at a time
_LOCK = threading.Lock()


class KnownPattern:
    """What is known of a pattern: what its factor costs and, once it is needed, the plan."""

    def __init__(self, found: Sketch) -> None:
        self.sketch = found
        self._plan: Symbolic | None = None

    def plan(self, K: sparse.csr_matrix) -> Symbolic:
        """The plan for K, which has the pattern."""
        if self._plan is None:
            self._plan = plan(K, self.sketch)
        return self._plan


# a weak reference to indptr, indices, what is known; the latest first
_KNOWN: list[tuple[Any, Any, KnownPattern]] = []


def known_of(K: sparse.csr_matrix, motions: Modes = None) -> KnownPattern:
    """What is known of the pattern of K. Raises ValueError where it is not symmetric with a full diagonal.

    A pattern is known by its two arrays, which nobody may change, or by equal ones, and forgotten with the array
    `indptr` of the matrix that was analysed: scipy hands that on from a pattern to its matrices, while each of these
    has its own view of the indices.
    """
    with _LOCK:
        for entry in _KNOWN:
            if _same(entry[0](), K.indptr) and _same(entry[1], K.indices):
                return entry[2]
    known = KnownPattern(sketch(K, motions() if callable(motions) else motions))
    with _LOCK:
        alive = [e for e in _KNOWN if e[0]() is not None]
        entry = (weakref.ref(K.indptr, _forget), K.indices, known)
        _KNOWN[:] = [entry, *alive[: KEPT - 1]]
    return known


def plan_of(K: sparse.csr_matrix, motions: Modes = None) -> Symbolic:
    """The plan for matrices with the pattern of K. Raises ValueError as `known_of` does."""
    return known_of(K, motions).plan(K)


def _same(known: Any, array: Any) -> bool:
    return known is array or (known is not None and np.array_equal(known, array))


def _forget(reference: Any) -> None:
    """Called when an array has died, at any time: an atomic change, and no lock that this thread may hold."""
    _KNOWN[:] = [e for e in _KNOWN if reference is not e[0]]
