"""BLAS and LAPACK inside compiled kernels, by address: the library that scipy brings, no wrapper in between.

Kernels receive a table of addresses as an argument, so that they can be kept on disk: an address is valid in one
process only.
"""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from llvmlite import ir  # type: ignore[import-untyped]
from numba import types
from numba.extending import get_cython_function_address, intrinsic
from numpy.typing import NDArray

ROUTINES = (("lapack", "potrf"), ("blas", "trsm"), ("blas", "syrk"), ("blas", "trsv"), ("blas", "gemv"))
POTRF, TRSM, SYRK, TRSV, GEMV = range(5)  # columns of the table


@cache
def table(letter: str) -> NDArray[np.int64]:
    """Addresses of ROUTINES for letter "d" (float64) or "s" (float32)."""
    found = [
        get_cython_function_address(f"scipy.linalg.cython_{library}", letter + name)
        for library, name in ROUTINES
    ]
    return np.array(found, dtype=np.int64)


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
    from scipy.linalg import cython_blas

    library = ctypes.CDLL(cython_blas.__file__)  # finds what the module is linked with
    for prefix in ("scipy_openblas", "openblas"):
        try:
            get, put = (getattr(library, f"{prefix}_{verb}_num_threads") for verb in ("get", "set"))
        except AttributeError:
            continue
        return get, put
    return lambda: 1, lambda number: None


def _call(typing: Any, address: Any, arguments: Any) -> Any:
    """Call the C function at `address`; all arguments are pointers, given as integers in a tuple."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        pointer = ir.IntType(8).as_pointer()
        kind = ir.FunctionType(ir.VoidType(), [pointer] * len(arguments))
        function = builder.inttoptr(values[0], kind.as_pointer())
        pointers = [
            builder.inttoptr(builder.extract_value(values[1], i), pointer) for i in range(len(arguments))
        ]
        builder.call(function, pointers)
        return context.get_dummy_value()

    return types.void(address, arguments), generate


call: Any = intrinsic(_call)
