"""How many threads the linear algebra underneath may use."""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Callable
from functools import cache


class Alone:
    """One thread of OpenBLAS, process-wide, while any block `with ALONE` runs.

    The fronts are too small for more: on two processors a second thread costs three times the time, most of it
    spent in waiting. Other libraries, which have no such switch, are left as they are.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._inside = 0
        self._threads = 1

    def __enter__(self) -> None:
        get, put = _switches()
        with self._lock:
            self._inside += 1
            if self._inside == 1:
                self._threads = get()
                put(1)

    def __exit__(self, *failure: object) -> None:
        put = _switches()[1]
        with self._lock:
            self._inside -= 1
            if self._inside == 0:
                put(self._threads)


ALONE = Alone()


@cache
def _switches() -> tuple[Callable[[], int], Callable[[int], object]]:
    """How many threads the library uses, and how to set it."""
    from softmark.solvers.runtime.scipy_submodules import lone

    library = ctypes.CDLL(lone("scipy.linalg.cython_blas").__file__)  # finds what the module is linked with
    for prefix in ("scipy_openblas", "openblas"):
        try:
            get, put = (getattr(library, f"{prefix}_{verb}_num_threads") for verb in ("get", "set"))
        except AttributeError:
            continue
        return get, put
    return lambda: 1, lambda number: None
