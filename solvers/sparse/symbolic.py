"""What a factorisation can prepare from the pattern alone: order, fronts, and where every number goes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from softmark.solvers.sparse.order import eliminate

Ints = NDArray[np.int64]
Places = NDArray[np.uint64]
RELAXED = (
    (12, 0.8),
    (48, 0.1),
    (10**9, 0.05),
)  # columns up to: share of explicit zeros that a merger may have


@dataclass(frozen=True)
class Symbolic:
    """Fronts in postorder, with the places of all entries; arrays named as the kernels name them."""

    size: int
    order: Ints  # (n,) unknown eliminated k-th
    place: Ints  # (n,) its inverse
    pivots: Ints  # (fronts,)
    rows: Ints
    first: Ints  # first column of each front
    panel: Ints  # where its columns start in L
    update: Ints  # where its update matrix starts in U
    index_start: Ints
    index: Places  # rows below the pivots of every front, one after the other ...
    local: Places  # ... and where they are in the front of its parent
    child_start: Ints
    children: Ints
    entry_start: Ints
    source: Places  # entries of the matrix that belong to the front ...
    target: Places  # ... and their places in L
    factor_size: int
    stack_size: int

    @property
    def flops(self) -> float:
        """Multiplications and additions of one factorisation."""
        k, n = self.pivots.astype(float), self.rows.astype(float)
        m = n - k
        return float(np.sum(k**3 / 3 + k**2 * m + k * m**2))


def groups(K: sparse.csr_matrix) -> Ints:
    """Starts (g + 1,) of runs of neighbouring unknowns with one and the same pattern, such as those of a node."""
    salt = np.random.default_rng(1).integers(1, 2**62, K.shape[0], dtype=np.int64)
    digest = np.add.reduceat(salt[K.indices], K.indptr[:-1].astype(np.int64))
    new = np.flatnonzero(np.diff(digest) != 0) + 1
    return np.concatenate([[0], new, [K.shape[0]]]).astype(np.int64)


def symmetric(K: sparse.csr_matrix) -> bool:
    """Whether the pattern of K is sorted, symmetric and has every diagonal entry."""
    if K.shape[0] != K.shape[1] or not K.has_sorted_indices:
        return False
    pattern = sparse.csr_matrix((np.ones(K.nnz), K.indices, K.indptr), shape=K.shape)
    turned = pattern.T.tocsr()
    same = np.array_equal(turned.indptr, K.indptr) and np.array_equal(turned.indices, K.indices)
    return same and bool(np.all(pattern.diagonal() != 0.0))


def analyse(K: sparse.csr_matrix) -> Symbolic:
    """The plan for matrices with the pattern of K, symmetric with a full diagonal. Raises ValueError for others."""
    if not symmetric(K):
        raise ValueError("the pattern of the matrix is not symmetric with a full diagonal")
    start = groups(K)
    count = len(start) - 1
    member = np.repeat(np.arange(count), np.diff(start))
    representatives = K[start[:-1]]
    rows = np.repeat(np.arange(count), np.diff(representatives.indptr))
    keep = (start[member[representatives.indices]] == representatives.indices) & (
        member[representatives.indices] != rows
    )
    near = member[representatives.indices[keep]]
    graph = sparse.csr_matrix((np.ones(len(near)), (rows[keep], near)), shape=(count, count))
    graph.sort_indices()
    weights = np.diff(start)
    order = eliminate(graph.indptr.astype(np.int64), graph.indices.astype(np.int64), weights)
    columns, structure, parent, order = _tree(graph, order)
    fronts = _fronts(columns, structure, parent, weights[order])
    return _plan(K, start, order, fronts)


def _tree(graph: sparse.csr_matrix, order: Ints) -> tuple[Ints, list[Ints], Ints, Ints]:
    """Postordered elimination tree of nodes: sizes, structure below each node, parents, the order itself."""
    n = len(order)
    for again in (True, False):
        place = np.empty(n, dtype=np.int64)
        place[order] = np.arange(n)
        structure: list[Ints] = []
        parent = np.full(n, -1, dtype=np.int64)
        children: list[list[int]] = [[] for _ in range(n)]
        for k in range(n):
            i = order[k]
            near = place[graph.indices[graph.indptr[i] : graph.indptr[i + 1]]]
            parts = [near[near > k], *(structure[c][1:] for c in children[k])]
            below = np.unique(np.concatenate(parts))
            structure.append(below)
            if len(below):
                parent[k] = below[0]
                children[below[0]].append(k)
        if again:
            order = order[_postorder(parent, children)]
    return np.array([len(s) for s in structure]), structure, parent, order


def _postorder(parent: Ints, children: list[list[int]]) -> Ints:
    visited: list[int] = []
    stack = [int(r) for r in np.flatnonzero(parent < 0)]
    while stack:  # parents first, reversed at the end
        k = stack.pop()
        visited.append(k)
        stack.extend(children[k])
    return np.array(visited[::-1], dtype=np.int64)


@dataclass
class _Front:
    """Nodes first ... last - 1 eliminated together, and the nodes below."""

    first: int
    last: int
    below: Ints
    columns: int
    height: int  # unknowns below
    zeros: float
    parent: int = -1


def _fronts(counts: Ints, structure: list[Ints], parent: Ints, weights: Ints) -> list[_Front]:
    """Fundamental supernodes, then mergers of a front with its last child where few zeros result."""
    n = len(counts)
    number = np.bincount(parent[parent >= 0], minlength=n)
    stack: list[_Front] = []
    for k in range(n):
        w = int(weights[k])
        front = _Front(k, k + 1, structure[k], w, int(weights[structure[k]].sum()), 0.0)
        if stack and parent[k - 1] == k and number[k] == 1 and counts[k - 1] == counts[k] + 1:
            front = _merged(stack.pop(), front, exact=True)
        while stack and len(stack[-1].below) and front.first <= stack[-1].below[0] < front.last:
            other = _merged(stack[-1], front)
            if not _worthwhile(other):
                break
            stack.pop()
            front = other
        stack.append(front)
    return stack


def _merged(child: _Front, front: _Front, exact: bool = False) -> _Front:
    columns = child.columns + front.columns
    zeros = child.zeros + front.zeros
    if not exact:
        zeros += child.columns * (front.columns + front.height - child.height)
    return _Front(child.first, front.last, front.below, columns, front.height, zeros)


def _worthwhile(front: _Front) -> bool:
    size = front.columns * (front.columns + 1) / 2 + front.columns * front.height
    limit = next(share for columns, share in RELAXED if front.columns <= columns)
    return front.zeros <= limit * size


def _plan(K: sparse.csr_matrix, start: Ints, order: Ints, fronts: list[_Front]) -> Symbolic:
    """Numbers for everything, in unknowns."""
    weights = np.diff(start)[order]
    offset = np.concatenate([[0], np.cumsum(weights)])
    unknowns = _expand(start[order], weights)
    pivots = np.array([f.columns for f in fronts])
    rows = np.array([f.columns + f.height for f in fronts])
    below = [_expand(offset[f.below], weights[f.below]) for f in fronts]
    owner = np.repeat(np.arange(len(fronts)), [f.last - f.first for f in fronts])
    parent = np.array([owner[f.below[0]] if len(f.below) else -1 for f in fronts])
    first = np.array([offset[f.first] for f in fronts])
    panel = np.concatenate([[0], np.cumsum(pivots * rows)])
    children = np.argsort(parent, kind="stable")
    children = children[parent[children] >= 0]
    child_start = np.concatenate([[0], np.cumsum(np.bincount(parent[parent >= 0], minlength=len(fronts)))])
    local = [_local(below[c], first[p], pivots[p], below[p]) for c, p in enumerate(parent)]
    update, stack = _stack(parent, rows - pivots)
    source, target, entry_start = _entries(K, unknowns, first, pivots, rows, panel, below)
    return Symbolic(
        size=K.shape[0],
        order=unknowns,
        place=np.argsort(unknowns),
        pivots=pivots,
        rows=rows,
        first=first,
        panel=panel[:-1],
        update=update,
        index_start=_starts(below),
        index=np.concatenate(below).astype(np.uint64),
        child_start=child_start,
        children=children,
        local=np.concatenate(local).astype(np.uint64),
        entry_start=entry_start,
        source=source,
        target=target,
        factor_size=int(panel[-1]),
        stack_size=stack,
    )


def _starts(parts: list[Ints]) -> Ints:
    return np.concatenate([[0], np.cumsum([len(p) for p in parts])]).astype(np.int64)


def _expand(first: Ints, lengths: Ints) -> Ints:
    """first[i], first[i] + 1, ..., lengths[i] of them, for every i."""
    ends = np.cumsum(lengths)
    every: Ints = np.arange(ends[-1] if len(ends) else 0) + np.repeat(first - (ends - lengths), lengths)
    return every


def _local(below: Ints, first: int, pivots: int, target: Ints) -> Ints:
    """Rows of a child in the front of its parent."""
    rows: Ints = np.where(below < first + pivots, below - first, pivots + np.searchsorted(target, below))
    return rows


def _stack(parent: Ints, sizes: Ints) -> tuple[Ints, int]:
    """Places of the update matrices: two stacks, by the parity of the depth, so that none overwrites its children."""
    depth = np.zeros(len(parent), dtype=np.int64)
    for s in range(len(parent) - 1, -1, -1):
        depth[s] = depth[parent[s]] + 1 if parent[s] >= 0 else 0
    top, peak = [0, 0], [0, 0]
    place = np.zeros(len(parent), dtype=np.int64)
    held = np.zeros(len(parent), dtype=np.int64)  # first place of the children of a front
    seen = np.zeros(len(parent), dtype=bool)
    for s in range(len(parent)):
        side = depth[s] % 2
        if seen[s]:
            top[1 - side] = int(held[s])
        place[s] = top[side]
        p = parent[s]
        if p >= 0 and not seen[p]:
            held[p], seen[p] = top[side], True
        top[side] += int(sizes[s]) ** 2
        peak[side] = max(peak[side], top[side])
    place[depth % 2 == 1] += peak[0]
    return place, peak[0] + peak[1]


def _entries(
    K: sparse.csr_matrix,
    unknowns: Ints,
    first: Ints,
    pivots: Ints,
    rows: Ints,
    panel: Ints,
    below: list[Ints],
) -> tuple[Places, Places, Ints]:
    """Which entries of K each front assembles, and where in L they go."""
    place = np.empty(len(unknowns), dtype=np.int64)
    place[unknowns] = np.arange(len(unknowns))
    row = place[np.repeat(np.arange(K.shape[0]), np.diff(K.indptr))]
    column = place[K.indices]
    source = np.flatnonzero(row >= column)
    row, column = row[source], column[source]
    owner = np.searchsorted(first, column, side="right") - 1
    group = np.argsort(owner, kind="stable")
    source, row, column, owner = source[group], row[group], column[group], owner[group]
    entry_start = np.searchsorted(owner, np.arange(len(first) + 1))
    local = row - first[owner]
    for s in range(len(first)):
        part = slice(entry_start[s], entry_start[s + 1])
        outside = local[part] >= pivots[s]
        inner = local[part]
        inner[outside] = pivots[s] + np.searchsorted(below[s], row[part][outside])
    target = panel[owner] + (column - first[owner]) * rows[owner] + local
    return source.astype(np.uint64), target.astype(np.uint64), entry_start.astype(np.int64)
