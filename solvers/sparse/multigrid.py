"""Conjugate gradients with algebraic multigrid (pyamg), for systems whose factor would be too large."""

from __future__ import annotations

import warnings
from importlib.util import find_spec
from typing import Any

import numpy as np
from scipy import sparse

from softmark.solvers.energies.energy import Floats
from softmark.solvers.runtime.work_count import count_product
from softmark.solvers.sparse.conjugate_gradients import conjugate_gradients

NAME = "smoothed aggregation multigrid with conjugate gradients (pyamg)"
# largest number of aggregates of six unknowns on the coarsest level, which is factorised. A further level costs
# iterations: 240 000 unknowns with 70 aggregates took 22; 369 000 took 35 with levels of 105 and 3, else 22
COARSEST = 1000
# entries smaller than this fraction of the diagonals do not aggregate: 369 000 unknowns then take 15 iterations instead
# of 22, and 114 000 with a Poisson's ratio of 0.45 take 26 instead of 39
WEAK = 0.05
CYCLE = 10  # products with the matrix that cost as much as one multigrid cycle
BUDGET = 400  # largest number of iterations: a clamped beam of silicone with a Poisson's ratio of 0.49 needs 84

OPTIONS: dict[str, Any] = {
    "strength": ("symmetric", {"theta": WEAK}),
    "smooth": "jacobi",
    "improve_candidates": None,
    "presmoother": ("gauss_seidel", {"sweep": "symmetric"}),
    "postsmoother": ("gauss_seidel", {"sweep": "symmetric"}),
    "max_coarse": COARSEST,
    "coarse_solver": "splu",
}


def is_installed() -> bool:
    """Return whether the package pyamg is installed."""
    return find_spec("pyamg") is not None


def warm_up() -> None:
    """Import the package pyamg if it is installed, so that the import is not part of timings."""
    if is_installed():
        import pyamg  # noqa: F401


class Multigrid:
    """Conjugate gradients with a smoothed-aggregation multigrid preconditioner.

    All levels represent the rigid body modes `modes` (n, 6) exactly.
    Source: Vanek, Mandel and Brezina (1996).
    """

    def __init__(self, K: sparse.csr_matrix, modes: Floats | None) -> None:
        """Build the multigrid levels of K."""
        import pyamg

        self._K = K
        self.iterations = 0  # iterations in the last solve
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # pyamg warns of conversions and of its versions
            self._hierarchy = pyamg.smoothed_aggregation_solver(_to_node_blocks(K), B=modes, **OPTIONS)
        self._cycle = self._hierarchy.aspreconditioner(cycle="V")

    @property
    def sizes(self) -> list[int]:
        """Number of unknowns on each level."""
        return [level.A.shape[0] for level in self._hierarchy.levels]

    def solve(self, b: Floats, tolerance: float) -> tuple[Floats, bool]:
        """Return x, and whether |b - K x| <= tolerance |b| was reached."""
        goal = tolerance * float(np.linalg.norm(b))
        x, self.iterations, done = conjugate_gradients(self._K, b, self._cycle.matvec, goal, BUDGET)
        count_product(CYCLE * self._K.nnz * self.iterations)
        return x, done


def _to_node_blocks(K: sparse.csr_matrix) -> sparse.csr_matrix | sparse.bsr_matrix:
    """Return K in 3 x 3 blocks, one for each pair of nodes; K unchanged if some nodes are only partly fixed."""
    if K.shape[0] % 3 or np.any(np.diff(K.indptr[::3]) % 9):
        return K
    blocks = K.tobsr((3, 3))
    return blocks if blocks.data.size == K.nnz else K
