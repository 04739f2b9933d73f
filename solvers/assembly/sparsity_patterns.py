"""Sparsity pattern of a tangent, computed from the stencils of its energies with scipy.

A stencil is the list of degrees of freedom that one term of an energy couples, such as those of a cell. Degrees of
freedom that always occur together, such as the three of a node, form one block. This gives nine times fewer pairs to
look up, and less to sort.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from functools import cached_property
from hashlib import blake2b
from typing import Any
from weakref import WeakValueDictionary

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats, Ints

PAIRS = 1 << 19  # pairs of blocks processed at once: they fit into the processor's cache


@dataclass(frozen=True)
class Pattern:
    """CSR structure of the tangent over free degrees of freedom, and positions of each energy's entries in it.

    `slots` has for each energy the positions (n, k, k) of its local entries in the matrix values; -1 for fixed degrees
    of freedom.
    """

    size: int
    indptr: Any  # int32, or int64 if there are too many entries
    indices: Any
    slots: tuple[Any, ...]  # one array (n, k, k) per energy, -1 if the row or the column is fixed

    def matrix(self, data: Floats) -> sparse.csr_matrix:
        """Return the sparse matrix with the values `data` (nnz,) and this pattern."""
        made = copy(self._empty_matrix)  # scipy would check all indices of a new matrix
        made.data = data
        return made

    def places(self, number: Ints, stencils: Ints) -> Ints:
        """Return the positions (n, k, k) of the local entries of stencils (n, k) in the matrix values.

        The position is -1 for fixed degrees of freedom. `number` (dofs,) is the row of each degree of freedom, -1 if it
        is fixed. Raises ValueError for an entry that is not in the pattern.
        """
        rows = number[stencils]
        wanted = rows[:, :, None] * self.size + rows[:, None, :]
        found: Ints = np.minimum(np.searchsorted(self._entry_keys, wanted), len(self._entry_keys) - 1)
        held = (rows < 0)[:, :, None] | (rows < 0)[:, None, :]
        found[held] = -1
        if not np.array_equal(self._entry_keys[found[~held]], wanted[~held]):
            raise ValueError("the sparsity pattern lacks couplings of a stencil")
        return found

    @cached_property
    def _entry_keys(self) -> Ints:
        """Key of each matrix entry (nnz,): its row times the matrix size plus its column, in ascending order."""
        rows = np.repeat(np.arange(self.size), np.diff(self.indptr))
        found: Ints = rows * self.size + self.indices
        return found

    @cached_property
    def _empty_matrix(self) -> sparse.csr_matrix:
        """Sparse matrix of the pattern without values."""
        data = np.zeros(len(self.indices), dtype=np.bool_)
        made = sparse.csr_matrix((data, self.indices, self.indptr), shape=(self.size, self.size), copy=False)
        made.data = data[:0].copy()
        return made


@dataclass(frozen=True)
class _Blocks:
    """Blocks of degrees of freedom, with the neighbours of each block (itself included) and its free rows."""

    near: sparse.csr_matrix  # (count, count), neighbours; values number them 0, 1, 2, ...
    number: NDArray[Any]  # (count, width) row of each degree of freedom, -1 if it is fixed
    rank: NDArray[Any]  # (count, width) number of free degrees of freedom before it in its block
    before: NDArray[Any]  # (neighbours,) number of columns of a row before those of this neighbour

    @property
    def free(self) -> NDArray[Any]:
        """Number of free rows of each block (count,)."""
        free: NDArray[Any] = np.count_nonzero(self.number >= 0, axis=1)
        return free


_KNOWN: WeakValueDictionary[bytes, Pattern] = WeakValueDictionary()


def build_pattern(dofs: int, fixed: Ints, stencils: Sequence[Ints]) -> Pattern:
    """Return the sparsity pattern of all stencils over the degrees of freedom that are not `fixed`.

    Problems with equal stencils and supports, such as the states of one body, share one pattern, because the pattern
    takes most of the memory of a problem.
    """
    asked = blake2b(repr((dofs, fixed.shape, [s.shape for s in stencils])).encode())
    for own in (fixed, *stencils):
        asked.update(np.ascontiguousarray(own, dtype=np.int64).data)
    known = _KNOWN.get(asked.digest())
    if known is None:
        known = _KNOWN[asked.digest()] = _compute_pattern(dofs, fixed, stencils)
    return known


def _compute_pattern(dofs: int, fixed: Ints, stencils: Sequence[Ints]) -> Pattern:
    """Return the pattern of all stencils as `build_pattern` does, without looking for a shared one."""
    free = free_dofs(dofs, fixed)
    width = 3 if all(_is_in_triples(s) for s in stencils) else 1
    count = -(-dofs // width)
    number = np.full(count * width, -1, dtype=np.int64)
    number[free] = np.arange(len(free))
    members = [np.ascontiguousarray(s[:, ::width]) // width for s in stencils]
    blocks = _block_neighbours(members, number.reshape(count, width))
    indptr, indices = _csr_structure(blocks)
    slots = (
        _entry_positions(m, blocks, indptr).reshape(*s.shape, s.shape[1])
        for m, s in zip(members, stencils, strict=True)
    )
    return Pattern(len(free), indptr, indices, tuple(slots))


def free_dofs(dofs: int, fixed: Ints) -> Ints:
    """Return the numbers of the degrees of freedom that are not `fixed`, out of `dofs`."""
    free = np.ones(dofs, dtype=np.bool_)
    free[fixed] = False
    return np.flatnonzero(free)


def _is_in_triples(stencil: Ints) -> bool:
    """Return whether each stencil consists of triples 3 i, 3 i + 1, 3 i + 2 of degrees of freedom."""
    if stencil.shape[1] % 3:
        return False
    first = stencil[:, ::3]
    same = all(np.array_equal(first + c, stencil[:, c::3]) for c in (1, 2))
    return same and not np.any(first % 3)


def _block_neighbours(members: Sequence[Ints], number: NDArray[Any]) -> _Blocks:
    """Return the neighbours of each block of degrees of freedom: the blocks that share a stencil with it.

    They are the nonzeros of B^T B, where B is the incidence matrix (stencils, blocks). `members` are the blocks of each
    stencil, and `number` (blocks, width) the rows of their degrees of freedom, -1 if fixed.
    """
    none = [np.zeros(0, dtype=np.int64)]
    lengths = np.concatenate([np.full(len(m), m.shape[1]) for m in members] + none)
    flat = np.concatenate([m.ravel() for m in members] + none)
    layout = (np.ones(len(flat), dtype=np.bool_), flat, np.concatenate([[0], np.cumsum(lengths)]))
    incidence = sparse.csr_matrix(layout, shape=(len(lengths), len(number)))
    near = (incidence.T @ incidence).tocsr()
    near.sort_indices()
    place = sparse.csr_matrix((np.arange(near.nnz), near.indices, near.indptr), shape=near.shape)
    free = number >= 0
    up_to = np.concatenate([[0], np.cumsum(np.count_nonzero(free, axis=1)[near.indices])])
    before = up_to[:-1] - np.repeat(up_to[near.indptr[:-1]], np.diff(near.indptr))
    return _Blocks(place, number, np.cumsum(free, axis=1) - free, before)


def _csr_structure(blocks: _Blocks) -> tuple[Any, Any]:
    """Return the CSR arrays `indptr` and `indices` of the matrix over free degrees of freedom.

    All free rows of a block have the free columns of its neighbours.
    """
    near, free = blocks.near, blocks.free
    columns = blocks.number[near.indices].ravel()
    columns = columns[columns >= 0]
    ends = np.concatenate([[0], np.cumsum(free[near.indices])])[near.indptr]
    lengths = np.repeat(np.diff(ends), free)
    indptr = np.concatenate([[0], np.cumsum(lengths)])
    kind = np.int32 if indptr[-1] < np.iinfo(np.int32).max else np.int64
    shift = (np.repeat(ends[:-1], free) - indptr[:-1]).astype(kind)
    at = np.repeat(shift, lengths) + np.arange(indptr[-1], dtype=kind)
    return indptr.astype(kind), columns.astype(kind)[at]


def _entry_positions(members: Ints, blocks: _Blocks, indptr: Any) -> NDArray[Any]:
    """Return the positions (n, b, width, b, width) of local entries in the matrix values; -1 for fixed ones.

    `members` (n, b) are the blocks of each stencil, and `indptr` the row pointers of the matrix.
    """
    (n, b), width = members.shape, blocks.number.shape[1]
    slots = np.empty((n, b, width, b, width), dtype=indptr.dtype)
    starts = np.where(blocks.number >= 0, indptr[blocks.number], 0).astype(indptr.dtype)
    before, rank = blocks.before.astype(indptr.dtype), blocks.rank.astype(indptr.dtype)
    held = blocks.number < 0
    step = max(1, PAIRS // max(1, b * b))
    for first in range(0, n, step):
        m = members[first : first + step]
        pairs = np.broadcast_arrays(m[:, :, None], m[:, None, :])
        t = np.asarray(blocks.near[pairs[0].ravel(), pairs[1].ravel()]).reshape(-1, b, 1, b, 1)
        part = slots[first : first + step]
        np.add(starts[m][:, :, :, None, None], before[t], out=part)
        part += rank[m][:, None, None, :, :]
        if held[m].any():
            part[np.broadcast_to(held[m][:, :, :, None, None], part.shape)] = -1
            part[np.broadcast_to(held[m][:, None, None, :, :], part.shape)] = -1
    return slots
