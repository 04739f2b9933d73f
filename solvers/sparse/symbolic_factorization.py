"""Symbolic factorisation from the sparsity pattern only: elimination order, fronts, and positions of all entries."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from softmark.records import dataclass
from softmark.solvers.sparse import multifrontal_symbolic
from softmark.solvers.sparse.ordering import minimum_degree_orders, nested_dissection_order
from softmark.solvers.sparse.rigid_body_modes import positions_from_modes

Ints = NDArray[np.int64]
Places = NDArray[np.uint64]
Floats = NDArray[np.float64]
WASTE = 2.2  # memory / entries of the factor: 1.8 to 2.1 in beams of 20 000 to 100 000 unknowns
DISSECTED, LARGE = (
    8000,
    40_000,
)  # nodes from which nested dissection may need fewer operations than minimum degree, and always does
# largest number of columns, and the fraction of explicit zeros allowed in a merged front of this size
RELAXED = np.array([12, 48, 10**9]), np.array([0.8, 0.1, 0.05])


@dataclass(frozen=True)
class Symbolic:
    """Symbolic factorisation: fronts in postorder, and positions of all entries in memory.

    Fields have the names of the arguments of the compiled kernels.
    """

    size: int
    order: Ints  # (n,) the unknown that is eliminated k-th
    place: Ints  # (n,) inverse of `order`
    pivots: Ints  # (fronts,) number of pivots
    rows: Ints  # (fronts,) number of rows
    first: Ints  # first column of each front
    panel: Ints  # position in L at which the columns of a front start
    update: Ints  # position in U at which the update matrix of a front starts
    index_start: Ints
    index: Places  # rows below the pivots of all fronts, concatenated ...
    local: Places  # ... and their positions in the parent's front
    child_start: Ints
    children: Ints
    entry_start: Ints
    source: Places  # matrix entries that each front assembles ...
    target: Places  # ... and their positions in L
    factor_size: int
    stack_size: int

    @property
    def flops(self) -> float:
        """Number of multiplications and additions of one factorisation."""
        k, n = self.pivots.astype(float), self.rows.astype(float)
        m = n - k
        return float(np.sum(k**3 / 3 + k**2 * m + k * m**2))


def group_unknowns(K: sparse.csr_matrix) -> Ints:
    """Return the first unknown of each group of adjacent unknowns with equal pattern, shape (g + 1,).

    Such a group usually belongs to one mesh node. The last entry is the number of unknowns.
    """
    salt = np.random.default_rng(1).integers(1, 2**62, K.shape[0], dtype=np.int64)
    digest = np.add.reduceat(salt[K.indices], K.indptr[:-1].astype(np.int64))
    new = np.flatnonzero(np.diff(digest) != 0) + 1
    return np.concatenate([[0], new, [K.shape[0]]]).astype(np.int64)


def has_symmetric_pattern(K: sparse.csr_matrix) -> bool:
    """Return whether the pattern of K is sorted, symmetric and contains every diagonal entry."""
    if K.shape[0] != K.shape[1] or not K.has_sorted_indices:
        return False
    pattern = sparse.csr_matrix((np.ones(K.nnz), K.indices, K.indptr), shape=K.shape)
    turned = pattern.T.tocsr()
    same = np.array_equal(turned.indptr, K.indptr) and np.array_equal(turned.indices, K.indices)
    return same and bool(np.all(pattern.diagonal() != 0.0))


@dataclass(frozen=True)
class FactorEstimate:
    """Elimination order and elimination tree of the g nodes of a matrix, from which the cost of a factor follows.

    A node is a group of unknowns with equal pattern.
    """

    start: Ints  # (g + 1,) first unknown of each node
    graph: tuple[Ints, Ints]  # indptr and indices of the nodes' graph
    order: Ints  # (g,) the node that is eliminated k-th
    parent: Ints  # (g,) parents in the elimination tree
    counts: Ints  # (g,) entries in a factor column of each node
    weights: Ints  # (g,) number of unknowns of each node

    @property
    def entries(self) -> float:
        """Number of entries in the factor."""
        return float(self.counts @ self.weights)

    def bytes(self, real: int) -> float:
        """Return the memory of a factorisation, bytes: factor, explicit zeros and stack of update matrices.

        `real` is the number of bytes of a floating-point number.
        """
        return WASTE * real * self.entries

    @property
    def flops(self) -> float:
        """Number of multiplications and additions of one factorisation, without explicit zeros."""
        return float(self.counts.astype(float) ** 2 @ self.weights)


def analyse(K: sparse.csr_matrix, motions: Floats | None = None) -> Symbolic:
    """Return the symbolic factorisation for the pattern of K.

    `motions` (n, 6), the rigid body modes of the unknowns, provide node positions, by which large systems are
    dissected. Raises ValueError unless the pattern is symmetric with a full diagonal.
    """
    return plan_fronts(K, estimate_factor(K, motions))


def estimate_factor(K: sparse.csr_matrix, motions: Floats | None = None) -> FactorEstimate:
    """Return the elimination order with the fewest operations among several, and its elimination tree.

    Raises ValueError as `analyse` does.
    """
    if not has_symmetric_pattern(K):
        raise ValueError("the pattern of the matrix is not symmetric with a full diagonal")
    start = group_unknowns(K)
    graph, weights = _node_graph(K, start), np.diff(start)
    orders: list[Ints] = []
    if motions is None or len(weights) < LARGE:
        orders += minimum_degree_orders(*graph)
    if motions is not None and len(weights) >= DISSECTED:
        orders.append(nested_dissection_order(*graph, positions_from_modes(motions, start)))
    return min((_estimate_for_order(start, graph, order, weights) for order in orders), key=lambda found: found.flops)


def _estimate_for_order(start: Ints, graph: tuple[Ints, Ints], order: Ints, weights: Ints) -> FactorEstimate:
    """Return the elimination tree and the column counts for the elimination order `order` of a graph's nodes.

    `start` (g + 1,) is the first unknown of each node, and `weights` (g,) the number of its unknowns.
    """
    parent, counts = np.empty_like(order), np.empty_like(order)
    multifrontal_symbolic.build_elimination_tree(*graph, order, weights, parent, counts, np.full((11, len(order)), -1))
    return FactorEstimate(start, graph, order, parent, counts, weights[order])


def _node_graph(K: sparse.csr_matrix, start: Ints) -> tuple[Ints, Ints]:
    """Return the graph of the groups of unknowns that share a matrix entry, as CSR arrays without loops.

    `start` (g + 1,) is the first unknown of each group.
    """
    count = len(start) - 1
    member = np.repeat(np.arange(count), np.diff(start))
    representatives = K[start[:-1]]
    rows = np.repeat(np.arange(count), np.diff(representatives.indptr))
    near = member[representatives.indices]
    keep = (start[near] == representatives.indices) & (near != rows)
    indptr = np.concatenate([[0], np.cumsum(np.bincount(rows[keep], minlength=count))])
    return indptr.astype(np.int64), near[keep].astype(np.int64)


def plan_fronts(K: sparse.csr_matrix, sketched: FactorEstimate) -> Symbolic:
    """Return the fronts and the positions of all entries for the elimination order in an estimate."""
    begins = multifrontal_symbolic.merge_supernodes(sketched.parent, sketched.counts, sketched.weights, *RELAXED)
    count = len(begins) - 1
    offset = _cumulative_sums(sketched.weights)
    unknowns = _concatenate_ranges(sketched.start[sketched.order], sketched.weights)
    place = np.empty_like(unknowns)
    place[unknowns] = np.arange(len(unknowns))
    last = begins[1:] - 1
    first, pivots = offset[begins[:-1]], np.diff(offset[begins])
    below = sketched.counts[last] - sketched.weights[last]
    rows, panel, index_start = pivots + below, _cumulative_sums(pivots * (pivots + below)), _cumulative_sums(below)
    owner = np.repeat(np.arange(count), np.diff(begins))
    parents = np.where(sketched.parent[last] >= 0, owner[sketched.parent[last]], -1)
    index, local = (np.zeros(int(index_start[-1]), dtype=np.uint64) for _ in range(2))
    nodes = np.empty_like(sketched.order)
    nodes[sketched.order] = np.arange(len(nodes))
    tree = (*sketched.graph, sketched.order, nodes, owner, begins, offset, index_start, parents)
    multifrontal_symbolic.compute_front_structures(*tree, index_start.copy(), np.full(count, -1), index, local)
    source, target = (np.empty((K.nnz + K.shape[0]) // 2, dtype=np.uint64) for _ in range(2))
    entry_start, update = np.empty(count + 1, dtype=np.int64), np.empty(count, dtype=np.int64)
    arrays = (unknowns, place, first, pivots, rows, panel, index_start, index, source, target, entry_start)
    multifrontal_symbolic.assign_entries_to_fronts(
        K.indptr, K.indices, *arrays, np.zeros(len(unknowns), dtype=np.int64)
    )
    children = np.argsort(parents, kind="stable")
    return Symbolic(
        size=K.shape[0],
        order=unknowns,
        place=place,
        pivots=pivots,
        rows=rows,
        first=first,
        panel=panel[:-1],
        update=update,
        index_start=index_start,
        index=index,
        child_start=_cumulative_sums(np.bincount(parents[parents >= 0], minlength=count)),
        children=children[parents[children] >= 0],
        local=local,
        entry_start=entry_start,
        source=source,
        target=target,
        factor_size=int(panel[-1]),
        stack_size=multifrontal_symbolic.place_update_matrices(parents, below, update),
    )


def _cumulative_sums(lengths: Ints) -> Ints:
    """Return the cumulative sums of lengths, starting with 0, shape (k + 1,) for k lengths."""
    return np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64)


def _concatenate_ranges(first: Ints, lengths: Ints) -> Ints:
    """Return the ranges first[i], first[i] + 1, ... of lengths[i] integers, concatenated."""
    ends = np.cumsum(lengths)
    every: Ints = np.arange(ends[-1] if len(ends) else 0) + np.repeat(first - (ends - lengths), lengths)
    return every
