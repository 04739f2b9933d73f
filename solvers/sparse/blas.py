"""Calls of BLAS and LAPACK routines from compiled kernels, by their addresses in the library that scipy ships.

Kernels receive the addresses as an argument, because an address is valid only in one process and kernels are cached on
disk.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from llvmlite import ir  # type: ignore[import-untyped]
from numba import types
from numba.extending import get_cython_function_address, intrinsic
from numpy.typing import NDArray

from softmark.solvers.runtime.scipy_submodules import import_submodule

ROUTINES = (
    *(("lapack", "potrf"), ("blas", "trsm"), ("blas", "syrk")),
    *(("blas", "trsv"), ("blas", "gemv"), ("blas", "gemm")),
)
POTRF, TRSM, SYRK, TRSV, GEMV, GEMM = range(6)  # positions in the table of addresses


@cache
def routine_addresses(letter: str) -> NDArray[np.int64]:
    """Return the addresses of ROUTINES for the letter "d" (float64) or "s" (float32), shape (6,)."""
    for library in ("blas", "lapack"):
        import_submodule(f"scipy.linalg.cython_{library}")
    found = [get_cython_function_address(f"scipy.linalg.cython_{library}", letter + name) for library, name in ROUTINES]
    return np.array(found, dtype=np.int64)


def _call_c_function(typing: Any, address: Any, arguments: Any) -> Any:
    """Call the C function at `address`; `arguments` is a tuple of pointers given as integers."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        """Emit the LLVM instructions that call the C function."""
        pointer = ir.IntType(8).as_pointer()
        kind = ir.FunctionType(ir.VoidType(), [pointer] * len(arguments))
        function = builder.inttoptr(values[0], kind.as_pointer())
        pointers = [builder.inttoptr(builder.extract_value(values[1], i), pointer) for i in range(len(arguments))]
        builder.call(function, pointers)
        return context.get_dummy_value()

    return types.void(address, arguments), generate


call: Any = intrinsic(_call_c_function)
