"""Compiled loops of the numeric multifrontal factorisation, on plain arrays."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from softmark.solvers.runtime.kernel_cache import kernel, kernel_part
from softmark.solvers.sparse.blas import GEMM, GEMV, POTRF, SYRK, TRSM, TRSV, call

Ints = NDArray[np.int64]
Places = NDArray[np.uint64]
Shorts = NDArray[np.int32]
Bytes = NDArray[np.uint8]
Values = NDArray[Any]  # float32 or float64
Floats = NDArray[np.float64]
BLOCK = 48  # columns that are factorised at a time without BLAS


@kernel
def factorise(
    begin: int, data: Floats, source: Places, target: Places, entry_start: Ints, pivots: Ints, rows: Ints, panel: Ints,
    child_start: Ints, children: Ints, update: Ints, index_start: Ints, local: Places, L: Values, U: Values, blas: Ints,
    letters: Bytes, numbers: Shorts, reals: Values, first: Ints, signs: Values | None, values: Values, work: Values,
) -> int:  # fmt: skip
    """Factorise all fronts in postorder; return 0, or 1 + the number of the first front that is not definite.

    The multifrontal Cholesky method is used (Duff and Reid 1983). Front s has pivots[s] columns of rows[s] rows at
    L[panel[s]:], stored column by column. Its update matrix, the lower triangle of the Schur complement, is at
    U[update[s]:]. Positions are unsigned integers, because signed indices would be tested for being negative.

    If `signs` (n,) is given, the factorisation is K = L S L^T, S = diag(+-1), in the same order. It starts at front
    `begin`, where the factorisation without signs stopped. S is written to `signs` and the pivots to `values` (n,).
    `work` has room for BLOCK columns, or for all columns below the pivots, of every front. If `signs` is None, this
    branch is not compiled.
    """
    for s in range(begin, len(pivots)):
        k, n, p = pivots[s], rows[s], panel[s]
        for t in range(p, p + n * k):
            L[t] = 0.0
        for t in range(np.uint64(entry_start[s]), np.uint64(entry_start[s + 1])):
            L[target[t]] += data[source[t]]
        for q in range(child_start[s], child_start[s + 1]):
            c = children[q]
            _add_update_matrix(U, update[c], rows[c] - pivots[c], np.int64(0), k, local, index_start[c], L, p, n)
        if signs is None or len(signs) == 0:
            good = _eliminate_definite(k, n, p, L, U, update[s], blas, letters, numbers, reals)
        else:
            good = _eliminate_signed(
                k, n, p, L, U, update[s], blas, letters, numbers, reals, first[s], signs, values, work
            )
        if not good:
            return s + 1
        if n > k:
            for q in range(child_start[s], child_start[s + 1]):
                c = children[q]
                _add_update_matrix(U, update[c], rows[c] - pivots[c], k, n, local, index_start[c], U, update[s], n - k)
    return 0


@kernel_part
def _eliminate_definite(
    k: int, n: int, p: int, L: Values, U: Values, update: int, blas: Ints, letters: Bytes, numbers: Shorts,
    reals: Values,
) -> bool:  # fmt: skip
    """Eliminate the pivots of one front by Cholesky; return whether they are all positive.

    The front has k pivots and n rows and is stored at L[p:]. Its update matrix is written to U[update:].
    """
    size = L.itemsize
    lower = letters.ctypes.data
    right, transposed, plain = lower + 1, lower + 2, lower + 3
    K = numbers.ctypes.data
    M, LD, INFO = K + 4, K + 8, K + 12
    one = reals.ctypes.data
    minus, zero = one + size, one + 2 * size
    at = L.ctypes.data + size * p
    numbers[0], numbers[1], numbers[2], numbers[3] = k, n - k, n, 0
    call(blas[POTRF], (lower, K, at, LD, INFO))
    if numbers[3] != 0:
        return False
    for j in range(k):  # LAPACK reports no error for numbers that are not finite
        if not L[p + j * n + j] < np.inf:
            return False
    if n > k:
        call(blas[TRSM], (right, lower, transposed, plain, M, K, one, at, LD, at + size * k, LD))
        to = U.ctypes.data + size * update
        call(blas[SYRK], (lower, plain, M, K, minus, at + size * k, LD, zero, to, M))
    return True


@kernel_part
def _eliminate_signed(
    k: int, n: int, p: int, L: Values, U: Values, update: int, blas: Ints, letters: Bytes, numbers: Shorts,
    reals: Values, first: int, signs: Values, values: Values, work: Values,
) -> bool:  # fmt: skip
    """Eliminate the pivots of one front with signs; return False if a pivot vanishes.

    The arguments are those of `_eliminate_definite`. The sign and the value of each pivot are stored in `signs` and
    `values`, beginning at position `first`.
    """
    size = L.itemsize
    lower = letters.ctypes.data
    right, transposed, plain = lower + 1, lower + 2, lower + 3
    R = numbers.ctypes.data
    B, C, N, D = R + 4, R + 8, R + 12, R + 16
    one = reals.ctypes.data
    minus, zero, two = one + size, one + 2 * size, one + 3 * size
    at = L.ctypes.data + size * p
    for begun in range(0, k, BLOCK):
        end = min(begun + BLOCK, k)
        for j in range(begun, end):
            pivot = L[p + j * n + j]
            if not (abs(pivot) > 0.0 and abs(pivot) < np.inf):
                return False
            sign = 1.0 if pivot > 0.0 else -1.0
            signs[first + j], values[first + j] = sign, pivot
            root = np.sqrt(abs(pivot))
            L[p + j * n + j] = root
            for i in range(j + 1, end):
                L[p + j * n + i] *= sign / root
            for c in range(j + 1, end):
                factor = sign * L[p + j * n + c]
                for i in range(c, end):
                    L[p + c * n + i] -= factor * L[p + j * n + i]
        numbers[0], numbers[1], numbers[2], numbers[3] = n - end, end - begun, k - end, n
        if n > end:
            panel = at + size * (begun * n + end)
            above = at + size * (begun * n + begun)
            call(blas[TRSM], (right, lower, transposed, plain, R, B, one, above, N, panel, N))
            for j in range(begun, end):
                sign = signs[first + j]
                for i in range(end, n):
                    L[p + j * n + i] *= sign
                for i in range(end, k):
                    work[(j - begun) * (k - end) + i - end] = sign * L[p + j * n + i]
            if k > end:
                to = at + size * (end * n + end)
                call(
                    blas[GEMM],
                    (plain, transposed, R, C, B, minus, panel, N, work.ctypes.data, C, one, to, N),
                )
    m = n - k
    if m > 0:
        to = U.ctypes.data + size * update
        numbers[0], numbers[1], numbers[3] = m, k, n
        call(blas[SYRK], (lower, plain, R, B, minus, at + size * k, N, zero, to, R))
        negative = 0
        for j in range(k):
            if signs[first + j] < 0.0:
                for i in range(m):
                    work[negative * m + i] = L[p + j * n + k + i]
                negative += 1
        if negative > 0:  # columns with negative sign were subtracted; they must be added
            numbers[4] = negative
            call(blas[SYRK], (lower, plain, R, D, two, work.ctypes.data, R, one, to, R))
    return True


@kernel_part
def _add_update_matrix(
    U: Values,
    source: int,
    m: int,
    lowest: int | np.int64,
    highest: int,
    local: Places,
    start: int,
    target: Values,
    base: int,
    height: int,
) -> None:
    """Add the update matrix of a child front to the columns `lowest` to `highest` - 1 of its parent's front.

    `U` holds it from the position `source`, with m rows. `local`, from the position `start`, are the rows of the
    child's entries in the parent's front. The columns are written to `target` from the position `base`, with `height`
    rows. If `lowest` > 0, `target` holds only the rows of the parent's front from `lowest` on, else all rows.
    """
    first = 0
    while first < m and local[start + first] < lowest:
        first += 1
    for j in range(first, m):
        column = np.int64(local[np.uint64(start + j)])
        if column >= highest:
            break
        to = np.uint64(base + (column - lowest) * height - lowest)
        at = np.uint64(source + j * m)
        for i in range(np.uint64(j), np.uint64(m)):
            target[to + local[np.uint64(start) + i]] += U[at + i]


@kernel
def substitute(
    pivots: Ints,
    rows: Ints,
    panel: Ints,
    first: Ints,
    index_start: Ints,
    index: Places,
    L: Values,
    x: Values,
    work: Values,
    blas: Ints,
    letters: Bytes,
    numbers: Shorts,
    reals: Values,
    signs: Values,
) -> None:
    """Solve with the factor L in place: x becomes (L L^T)^-1 x, with x in elimination order.

    If `signs` has n entries instead of none, the factor is L S L^T.
    """
    trsv, gemv = blas[TRSV], blas[GEMV]
    size = L.itemsize
    lower = letters.ctypes.data
    transposed, plain = lower + 2, lower + 3
    K = numbers.ctypes.data
    M, LD, ONE = K + 4, K + 8, K + 12
    one = reals.ctypes.data
    minus, zero = one + size, one + 2 * size
    numbers[3] = 1
    w = work.ctypes.data
    for s in range(len(pivots)):
        k, n = pivots[s], rows[s]
        numbers[0], numbers[1], numbers[2] = k, n - k, n
        at, to = L.ctypes.data + size * panel[s], x.ctypes.data + size * first[s]
        call(trsv, (lower, plain, plain, K, at, LD, to, ONE))
        if n > k:
            call(gemv, (plain, M, K, one, at + size * k, LD, to, ONE, zero, w, ONE))
            p = np.uint64(index_start[s])
            for i in range(np.uint64(n - k)):
                x[index[p + i]] -= work[i]
    for i in range(len(signs)):
        x[i] *= signs[i]
    for s in range(len(pivots) - 1, -1, -1):
        k, n = pivots[s], rows[s]
        numbers[0], numbers[1], numbers[2] = k, n - k, n
        at, to = L.ctypes.data + size * panel[s], x.ctypes.data + size * first[s]
        if n > k:
            p = np.uint64(index_start[s])
            for i in range(np.uint64(n - k)):
                work[i] = x[index[p + i]]
            call(gemv, (transposed, M, K, minus, at + size * k, LD, w, ONE, one, to, ONE))
        call(trsv, (lower, transposed, plain, K, at, LD, to, ONE))
