"""Limits on the number of threads of the linear algebra libraries."""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Callable
from functools import cache


class SingleThread:
    """Context manager that limits OpenBLAS to one thread in the whole process while any `with ALONE` block runs.

    Frontal matrices (the dense blocks of a sparse factorisation) are too small for more: on two processors a second
    thread triples the time, most of it spent waiting. BLAS libraries other than OpenBLAS have no such setting and are
    unaffected.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._inside = 0
        self._threads = 1

    def __enter__(self) -> None:
        get, put = _blas_thread_functions()
        with self._lock:
            self._inside += 1
            if self._inside == 1:
                self._threads = get()
                put(1)

    def __exit__(self, *failure: object) -> None:
        put = _blas_thread_functions()[1]
        with self._lock:
            self._inside -= 1
            if self._inside == 0:
                put(self._threads)


ALONE = SingleThread()


@cache
def _blas_thread_functions() -> tuple[Callable[[], int], Callable[[int], object]]:
    """Return the functions of the BLAS library that read and set its number of threads."""
    from softmark.solvers.runtime.scipy_submodules import import_submodule

    library = ctypes.CDLL(import_submodule("scipy.linalg.cython_blas").__file__)  # also finds the library linked to it
    for prefix in ("scipy_openblas", "openblas"):
        try:
            get, put = (getattr(library, f"{prefix}_{verb}_num_threads") for verb in ("get", "set"))
        except AttributeError:
            continue
        return get, put
    return lambda: 1, lambda number: None
