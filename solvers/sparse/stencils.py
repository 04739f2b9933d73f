"""Compiled loops that make the pattern of a matrix from the stencils of energies."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from softmark.solvers.jit import kernel

Ints = NDArray[np.int64]
Shorts = NDArray[np.int32]
AnyInts = NDArray[Any]  # int32, or int64 where a matrix has too many entries


@kernel
def neighbours(starts: Ints, members: Ints, block_count: int) -> tuple[Ints, Shorts]:
    """Blocks that share a stencil with each block, itself included, in order: where they start, and which.

    `members[starts[e]:starts[e + 1]]` are the blocks of stencil e.
    """
    touching = np.zeros(block_count + 1, np.int64)
    for block in members:
        touching[block + 1] += 1
    for block in range(block_count):
        touching[block + 1] += touching[block]
    stencil = np.empty(len(members), np.int32)
    filled = touching[:-1].copy()
    for e in range(len(starts) - 1):
        for t in range(starts[e], starts[e + 1]):
            stencil[filled[members[t]]] = e
            filled[members[t]] += 1
    mark = np.full(block_count, -1, np.int32)
    begin = np.zeros(block_count + 1, np.int64)
    near, used = np.empty(16 * block_count + 1024, np.int32), 0
    for i in range(block_count):
        if used + block_count > len(near):  # a block has at most all for neighbours
            larger = np.empty(used + used // 2 + 2 * block_count, np.int32)
            larger[:used] = near[:used]
            near = larger
        for t in range(touching[i], touching[i + 1]):
            for q in range(starts[stencil[t]], starts[stencil[t] + 1]):
                j = members[q]
                if mark[j] != i:
                    mark[j] = i
                    near[used] = j
                    used += 1
        begin[i + 1] = used
        near[begin[i] : used] = np.sort(near[begin[i] : used])
    return begin, near[:used].copy()


@kernel
def columns(
    begin: Ints, near: Shorts, number: Ints, width: int, indptr: AnyInts, indices: AnyInts, before: Shorts
) -> None:
    """Columns of every free row, and for each neighbour of a block how many columns come `before` its own.

    `number` (dofs,) is the row of each degree of freedom, -1 where it is held; a block is `width` of these.
    """
    at = 0
    for i in range(len(begin) - 1):
        count = 0
        for t in range(begin[i], begin[i + 1]):
            before[t] = count
            for d in range(width):
                count += number[width * near[t] + d] >= 0
        for c in range(width):
            row = number[width * i + c]
            if row < 0:
                continue
            for t in range(begin[i], begin[i + 1]):
                for d in range(width):
                    column = number[width * near[t] + d]
                    if column >= 0:
                        indices[at] = column
                        at += 1
            indptr[row + 1] = at


@kernel
def slots(
    blocks: Ints, begin: Ints, near: Shorts, before: Shorts, number: Ints, width: int, indptr: AnyInts,
    places: AnyInts,
) -> None:  # fmt: skip
    """Where entries of local matrices go (n, k, k), -1 where a row or column is held; `blocks` (n, k / width)."""
    for e in range(blocks.shape[0]):
        for a in range(blocks.shape[1]):
            i = blocks[e, a]
            for b in range(blocks.shape[1]):
                j = blocks[e, b]
                low, high = begin[i], begin[i + 1]
                while high - low > 1:
                    middle = (low + high) // 2
                    if near[middle] <= j:
                        low = middle
                    else:
                        high = middle
                for c in range(width):
                    row = number[width * i + c]
                    offset = indptr[row] + before[low] if row >= 0 else -1
                    for d in range(width):
                        free = row >= 0 and number[width * j + d] >= 0
                        places[e, width * a + c, width * b + d] = offset if free else -1
                        offset += free
