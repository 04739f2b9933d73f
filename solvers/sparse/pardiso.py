"""Interface to Intel's MKL Pardiso; the package pypardiso locates the library."""

from __future__ import annotations

import ctypes
import weakref
from functools import cache
from importlib.util import find_spec
from typing import Any

import numpy as np
from scipy import sparse

from softmark.solvers.energies.energy import Floats
from softmark.solvers.runtime.work_count import count_product

NAME = "MKL Pardiso (pypardiso)"
DEFINITE, INDEFINITE, GENERAL = 2, -2, 11  # Pardiso's numbers of real matrix types
FILL = 30  # typical entries of the factor, for each entry of the matrix
ANALYSE, FACTORISE, SOLVE, RELEASE = 11, 22, 33, -1  # Pardiso's numbers of phases


class PardisoError(Exception):
    """Raised if Pardiso returns an error code."""

    def __init__(self, code: int) -> None:
        super().__init__(f"Pardiso's error {code}")
        self.code = code


def is_packaged() -> bool:
    """Return whether the package pypardiso is installed; the MKL library itself may be missing."""
    return find_spec("pypardiso") is not None


def is_installed() -> bool:
    """Return whether the package pypardiso is installed and finds the MKL library."""
    return is_packaged() and not missing_reason()


@cache
def missing_reason() -> str:
    """Return why the installed package pypardiso cannot be used; "" if it can."""
    try:
        _pardiso_function()
    except (ImportError, OSError, AttributeError) as error:  # of the import, the library, the routine
        return str(error).partition(". ")[0].rstrip(".") or type(error).__name__
    return ""


@cache
def _pardiso_function() -> Any:
    """Return the C function `pardiso` of the MKL library."""
    from pypardiso import PyPardisoSolver

    # load the library again, so that the package's settings for its own calls stay unchanged
    routine = ctypes.CDLL(PyPardisoSolver().libmkl._name).pardiso
    routine.restype = None
    return routine


def _release_factor(handle: Any, kind: int, size: int) -> None:
    """Free the memory that the library holds for a factor.

    `handle` identifies the factor, `kind` is the matrix type and `size` the number of unknowns.
    """
    nothing, none = np.zeros(1), np.zeros(64, np.int32)
    _call_pardiso(handle, kind, RELEASE, size, nothing, none, none, none, nothing, nothing)


def _call_pardiso(
    handle: Any,
    kind: int,
    phase: int,
    n: int,
    data: Any,
    indptr: Any,
    indices: Any,
    settings: Any,
    b: Any,
    x: Any,
) -> None:
    """Call the library once, for one `phase` of the solution. Raises PardisoError."""
    error = ctypes.c_int32(0)
    one, silent = ctypes.c_int32(1), ctypes.c_int32(0)
    arrays = [ctypes.c_void_p(a.ctypes.data) for a in (data, indptr, indices)]
    _pardiso_function()(
        ctypes.c_void_p(handle.ctypes.data), ctypes.byref(one), ctypes.byref(one), ctypes.byref(ctypes.c_int32(kind)),
        ctypes.byref(ctypes.c_int32(phase)), ctypes.byref(ctypes.c_int32(n)), *arrays, None, ctypes.byref(one),
        ctypes.c_void_p(settings.ctypes.data), ctypes.byref(silent), ctypes.c_void_p(b.ctypes.data),
        ctypes.c_void_p(x.ctypes.data), ctypes.byref(error),
    )  # fmt: skip
    if error.value:
        raise PardisoError(error.value)


class Pardiso:
    """Pardiso factor of K, with the interface of `linear.factorisations.Factor`.

    The factor is L L^T for a positive definite, L D L^T for a symmetric and L U for a general matrix.
    """

    name = NAME
    tolerance = 0.0
    iterations = 0

    def __init__(self, K: sparse.csr_matrix, kind: int, single: bool = False) -> None:
        """Factorise K of the matrix type `kind`, in single precision if `single`. Raises PardisoError."""
        part = K if kind == GENERAL else sparse.triu(K, format="csr")
        part.sort_indices()
        self._kind, self._n = kind, K.shape[0]
        self._real: Any = np.float32 if single else np.float64
        self._matrix = (
            part.data.astype(self._real),
            part.indptr.astype(np.int32),
            part.indices.astype(np.int32),
        )
        self._handle = np.zeros(64, dtype=np.int64)
        self._settings = np.zeros(64, dtype=np.int32)
        chosen = {1: 1, 2: 2, 8: 2, 10: 13 if kind == GENERAL else 8, 21: 1, 28: int(single), 35: 1}
        chosen |= {11: 1, 13: 1} if kind == GENERAL else {}
        for place, value in chosen.items():
            self._settings[place - 1] = value
        self._end = weakref.finalize(self, _release_factor, self._handle, kind, self._n)
        for phase in (ANALYSE, FACTORISE):
            self._run_phase(phase, np.zeros(self._n))

    def _run_phase(self, phase: int, b: Floats) -> Floats:
        """Run one phase of the library with the right-hand side b, and return the solution x."""
        count_product(FILL * len(self._matrix[0]))
        b = np.ascontiguousarray(b, dtype=self._real)
        x = np.zeros_like(b)
        _call_pardiso(self._handle, self._kind, phase, self._n, *self._matrix, self._settings, b, x)
        return x.astype(np.float64, copy=False)

    @property
    def negative_pivots(self) -> int | None:
        """Number of negative pivots; None for a matrix that was not declared symmetric."""
        return None if self._kind == GENERAL else int(self._settings[22]) if self._kind == INDEFINITE else 0

    def solve(self, b: Floats) -> Floats:
        """Return the solution x of K x = b."""
        return self._run_phase(SOLVE, b)
