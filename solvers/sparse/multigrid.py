"""Conjugate gradients with algebraic multigrid (pyamg), for systems whose factor would be too large."""

from __future__ import annotations

import warnings
from importlib.util import find_spec
from typing import Any

import numpy as np
from scipy import sparse

from softmark.solvers.energies.energy import Floats
from softmark.solvers.sparse.conjugate_gradients import conjugate_gradients

NAME = "smoothed aggregation multigrid with conjugate gradients (pyamg)"
# aggregates, of six unknowns each, that are solved by a factor; a level below them costs iterations: 240 000 unknowns
# that ended with 70 aggregates took 22, 369 000 that went on from 105 to 3 took 35, and 22 without that level
COARSEST = 1000
# entries below this part of their diagonals' do not aggregate: 369 000 unknowns then take 15 iterations and not 22, and
# 114 000 with a Poisson's ratio of 0.45 26 and not 39
WEAK = 0.05
BUDGET = 400  # iterations: a clamped beam of silicone with a Poisson's ratio of 0.49 needs 84

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
    """Return whether the package is installed."""
    return find_spec("pyamg") is not None


def warm_up() -> None:
    """Import the package, if it is installed."""
    if is_installed():
        import pyamg  # noqa: F401


class Multigrid:
    """Smoothed aggregation (Vanek, Mandel and Brezina 1996) that keeps rigid motions `modes` (n, 6) on all levels."""

    def __init__(self, K: sparse.csr_matrix, modes: Floats | None) -> None:
        import pyamg

        self._K = K
        self.iterations = 0  # of the last solve
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # it warns of conversions and of its own versions
            self._hierarchy = pyamg.smoothed_aggregation_solver(_in_node_blocks(K), B=modes, **OPTIONS)
        self._cycle = self._hierarchy.aspreconditioner(cycle="V")

    @property
    def sizes(self) -> list[int]:
        """Number of unknowns of each level."""
        return [level.A.shape[0] for level in self._hierarchy.levels]

    def solve(self, b: Floats, tolerance: float) -> tuple[Floats, bool]:
        """Return x with |b - K x| <= tolerance |b|, and whether that was reached."""
        goal = tolerance * float(np.linalg.norm(b))
        x, self.iterations, done = conjugate_gradients(self._K, b, self._cycle.matvec, goal, BUDGET)
        return x, done


def _in_node_blocks(K: sparse.csr_matrix) -> sparse.csr_matrix | sparse.bsr_matrix:
    """Return K in blocks of a node's three unknowns, unless some nodes are partly fixed."""
    if K.shape[0] % 3 or np.any(np.diff(K.indptr[::3]) % 9):
        return K
    blocks = K.tobsr((3, 3))
    return blocks if blocks.data.size == K.nnz else K
