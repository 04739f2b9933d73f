"""Elimination orders that keep a Cholesky factor sparse."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from softmark.solvers.runtime.scipy_submodules import import_submodule
from softmark.solvers.sparse.multifrontal_symbolic import dissect

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]
LEAF = 400  # nodes; smaller parts are not dissected further
# options to drop every entry of the factor: only the order is used
ORDER = {"ColPerm": "MMD_AT_PLUS_A", "SymmetricMode": True, "DiagPivotThresh": 0.0, "Equil": False}
DROP = {"ILU_DropTol": 1.0, "ILU_FillFactor": 1.0, "ILU_DropRule": "basic"}


def minimum_degree_orders(indptr: Ints, indices: Ints) -> list[Ints]:
    """Return two minimum-degree orders (n,) of the nodes of a symmetric graph without loops.

    Among nodes of equal degree the first in a numbering is eliminated, and this choice affects the number of operations
    by a third. One order uses the given numbering, which is better for lattices. The other uses a random numbering,
    which is better for tetrahedra.
    """
    graph = _graph_matrix(indptr, indices)
    return [minimum_degree(graph, np.arange(graph.shape[0])), minimum_degree(graph, _random_numbering(graph))]


def nested_dissection_order(indptr: Ints, indices: Ints, points: Floats) -> Ints:
    """Return a nested dissection order (n,) of a large graph: separators come last.

    `points` (n, 3) are the positions of the graph's nodes.
    """
    order = np.empty(len(indptr) - 1, dtype=np.int64)
    first = dissect(indptr, indices, points, LEAF, order)
    inside = order[:first].copy()
    graph = _graph_matrix(indptr, indices)[inside][:, inside]
    order[:first] = inside[minimum_degree(graph, _random_numbering(graph))]
    return order


def minimum_degree(graph: sparse.csr_matrix, begin: Ints) -> Ints:
    """Return a multiple minimum degree order (n,) of a graph, computed by SuperLU.

    `begin` (n,) is a numbering of the nodes; it decides between nodes of equal degree.
    Source: Liu (1985).
    """
    n = graph.shape[0]
    if n < 2:
        return np.arange(n)
    mixed = graph[begin][:, begin]
    # a diagonally dominant matrix with this graph, which needs no pivoting
    K = (sparse.diags(np.diff(mixed.indptr) + 1.0) - mixed).tocsc()
    K.sort_indices()
    superlu: Any = import_submodule("scipy.sparse.linalg._dsolve._superlu")
    arrays = K.data, K.indices.astype(np.intc), K.indptr.astype(np.intc)
    made, options = sparse.csc_matrix, ORDER | DROP
    factor = superlu.gstrf(n, K.nnz, *arrays, csc_construct_func=made, ilu=True, options=options)
    order = np.empty(n, dtype=np.int64)
    order[factor.perm_c] = begin
    return order


def _graph_matrix(indptr: Ints, indices: Ints) -> sparse.csr_matrix:
    """Return a graph, given by its CSR arrays, as a sparse matrix of ones."""
    return sparse.csr_matrix((np.ones(len(indices)), indices, indptr), shape=(len(indptr) - 1,) * 2)


def _random_numbering(graph: sparse.csr_matrix) -> Ints:
    """Return a random numbering (n,) of the nodes of a graph, always the same."""
    return np.random.default_rng(0).permutation(graph.shape[0])


def warm_up() -> None:
    """Load the compiled kernels of nested dissection, so that loading is not part of timings."""
    none = np.zeros(0, dtype=np.int64)
    dissect(np.zeros(2, dtype=np.int64), none, np.zeros((1, 3)), LEAF, np.zeros(1, dtype=np.int64))
