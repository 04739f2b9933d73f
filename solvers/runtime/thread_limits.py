"""Limits on the number of threads of the linear algebra libraries."""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Callable
from functools import cache

NAMES = tuple(f"{prefix}openblas_{{}}_num_threads{suffix}" for prefix in ("scipy_", "") for suffix in ("64_", ""))


class SingleThread:
    """Context manager that limits OpenBLAS to one thread in the whole process while any `with ALONE` block runs.

    Frontal matrices (the dense blocks of a sparse factorisation) and matrices of cells are too small for more: on two
    processors a second thread triples the time, most of it spent waiting. On a busy machine it waits for threads that
    are not running, and a product takes a hundred times as long. BLAS libraries other than OpenBLAS have no such
    setting and are unaffected.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._inside = 0
        self._threads: list[int] = []

    def __enter__(self) -> None:
        libraries = _blas_thread_functions()
        with self._lock:
            self._inside += 1
            if self._inside == 1:
                self._threads = [get() for get, _ in libraries]
                for _, put in libraries:
                    put(1)

    def __exit__(self, *failure: object) -> None:
        libraries = _blas_thread_functions()
        with self._lock:
            self._inside -= 1
            if self._inside == 0:
                for (_, put), threads in zip(libraries, self._threads, strict=True):
                    put(threads)


ALONE = SingleThread()


@cache
def _blas_thread_functions() -> list[tuple[Callable[[], int], Callable[[int], object]]]:
    """Return functions that read and set the number of threads of each OpenBLAS library: those of numpy and scipy."""
    import numpy as np

    from softmark.solvers.runtime.scipy_submodules import import_submodule

    found = []
    for module in (np.linalg._umath_linalg, import_submodule("scipy.linalg.cython_blas")):
        library = ctypes.CDLL(module.__file__)  # also finds the library linked to it
        for name in NAMES:
            get, put = (getattr(library, name.format(verb), None) for verb in ("get", "set"))
            if get is not None and put is not None:
                found.append((get, put))
                break
    return found
