"""Solver for a sequence of linear systems with one sparsity pattern and similar values, which reuses factors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from softmark.solvers.energies.energy import Floats
from softmark.solvers.linear.factorisations import Unsolved, factor
from softmark.solvers.linear.symbolic_cache import cached_plan
from softmark.solvers.runtime.work_count import count_product
from softmark.solvers.sparse.sparse_cholesky import Cholesky, Indefinite, Precision

EPS = float(np.finfo(np.float64).eps)
FLOPS, ENTRIES = (
    2e10,
    1.5e9,
)  # per second: operations of a factorisation; entries of factor and matrix read by an iteration
FRESH = 12  # iterations within which those with a factor of the same matrix must converge
ROUGH = 1e-8  # relative residual that is not excused as rounding: the matrix is singular to rounding
FORGET = 16  # solves after which an old factor is tried again despite an earlier failure


@dataclass
class Statistics:
    """Counts of the solves and iterations of a LinearSolver, and the method and residual of its last solve."""

    solves: int = 0
    factorisations: int = 0
    iterations: int = 0  # conjugate gradient iterations; each solves once with the factor
    fallbacks: int = 0  # solves by a general factorisation
    analyses: int = 0
    indefinite: int = 0  # matrices found not to be positive definite
    method: str = ""
    residual: float = np.nan  # relative residual of the last solve


class LinearSolver:
    """Conjugate gradients for K x = b, preconditioned by a Cholesky factor of K or of an earlier matrix.

    With a single-precision factor of K, two or three iterations reduce the relative residual to 1e-10. The factor of a
    similar earlier matrix needs a few more. It is used as long as these iterations cost less than a new factorisation,
    estimated from counts of operations. Matrices that are not positive definite, or have an unsymmetric pattern, are
    factorised by `linear.factorisations.factor`. Every solution is checked: Unsolved is raised if |b - K x| exceeds
    `tolerance` |b|, unless the excess is due to rounding and below ROUGH |b|.
    """

    name = "multifrontal Cholesky with conjugate gradients"

    def __init__(self, precision: Precision = "single", reuse: bool = True) -> None:
        """Create a solver whose factors have this `precision`; `reuse` allows factors of earlier matrices."""
        self.statistics = Statistics()
        self._precision: Precision = precision
        self._reuse = reuse
        self._indptr = self._indices = np.zeros(0, dtype=np.int32)
        self._cholesky: Cholesky | None = None
        self._ready = False  # True if a factor of an earlier matrix is stored
        self._age = 0  # solves since that factor was made
        self._failed: dict[int, int] = {}  # age of a factor -> number of the solve in which it failed

    def solve(self, K: sparse.csr_matrix, b: Floats, tolerance: float = 1e-10) -> Floats:
        """Return x with |b - K x| <= tolerance |b|. Raises Unsolved and Singular."""
        self.statistics.solves += 1
        if not np.any(b):
            self._record_solve("nothing to solve", 0.0)
            return np.zeros_like(b)
        self._analyse_pattern(K)
        x = None if self._cholesky is None else self._solve_definite(K, b, tolerance)
        return self._solve_by_direct_factorisation(K, b, tolerance) if x is None else x

    def _analyse_pattern(self, K: sparse.csr_matrix) -> None:
        """Analyse the sparsity pattern of K if it differs from the pattern of the last matrix."""
        if self._is_last_pattern(K.indptr, K.indices):
            return
        self._indptr, self._indices = K.indptr, K.indices
        self._ready, self._failed = False, {}
        self.statistics.analyses += 1
        try:
            self._cholesky = Cholesky(cached_plan(K), self._precision)
        except ValueError:  # the pattern is not symmetric
            self._cholesky = None

    def _is_last_pattern(self, indptr: np.ndarray, indices: np.ndarray) -> bool:
        """Return whether a pattern (CSR arrays) equals the pattern of the last matrix."""
        if indptr is self._indptr and indices is self._indices:
            return True
        return np.array_equal(indptr, self._indptr) and np.array_equal(indices, self._indices)

    def _solve_definite(self, K: sparse.csr_matrix, b: Floats, tolerance: float) -> Floats | None:
        """Return the solution by preconditioned conjugate gradients; None if that fails.

        It fails if K is not positive definite or the iterations do not converge.
        """
        x = np.zeros_like(b)
        if self._is_old_factor_worthwhile():
            x, done = self._iterate_conjugate_gradients(K, b, x, tolerance, self._iteration_budget())
            if done:
                self._age += 1
                return self._check_residual("conjugate gradients, earlier factor", K, b, x, tolerance)
            self._failed[self._age] = self.statistics.solves
        if not self._refactorise(K):
            return None
        x, done = self._iterate_conjugate_gradients(K, b, x, tolerance, FRESH)
        if not done and self._cholesky is not None and self._cholesky.precision == "single":
            if not self._try_factorise(Cholesky(self._cholesky.plan, "double"), K):
                return None
            x, done = self._iterate_conjugate_gradients(K, b, np.zeros_like(b), tolerance, FRESH)
        return self._check_residual("conjugate gradients, own factor", K, b, x, tolerance) if done else None

    def _is_old_factor_worthwhile(self) -> bool:
        """Return whether the stored factor of an earlier matrix should be tried as preconditioner.

        It is not tried if a factor of the same age, in solves, failed within the last FORGET solves.
        """
        when = self._failed.get(self._age, -FORGET)
        return self._reuse and self._ready and self.statistics.solves - when >= FORGET

    def _iteration_budget(self) -> int:
        """Return the number of iterations that cost as much as half a factorisation."""
        cholesky = self._cholesky
        assert cholesky is not None
        plan = cholesky.plan
        return max(2, int(0.5 * plan.flops / FLOPS * ENTRIES / (2 * plan.factor_size + len(self._indices))))

    def _refactorise(self, K: sparse.csr_matrix) -> bool:
        """Factorise K, in double precision if single fails; return whether K is positive definite."""
        cholesky = self._cholesky
        assert cholesky is not None
        self._ready = False
        if self._try_factorise(cholesky, K):
            return True
        if cholesky.precision == "single" and self._try_factorise(Cholesky(cholesky.plan, "double"), K):
            return True
        self.statistics.indefinite += 1
        return False

    def _try_factorise(self, attempt: Cholesky, K: sparse.csr_matrix) -> bool:
        """Factorise K into the memory of the factor `attempt`; return whether K is positive definite.

        If it is, `attempt` becomes the stored factor.
        """
        self.statistics.factorisations += 1
        try:
            attempt.factorise(K.data)
        except Indefinite:
            return False
        self._cholesky, self._ready, self._age = attempt, True, 0
        return True

    def _iterate_conjugate_gradients(
        self, K: sparse.csr_matrix, b: Floats, x: Floats, tolerance: float, budget: int
    ) -> tuple[Floats, bool]:
        """Return x after conjugate gradient iterations that start from x, and whether it reached the tolerance.

        Iterations end after `budget` iterations. They end earlier if they converge too slowly to reach the tolerance
        within this number, or if a curvature is not positive.
        Source: Hestenes and Stiefel (1952).
        """
        cholesky = self._cholesky
        assert cholesky is not None
        goal = 0.9 * tolerance * float(np.linalg.norm(b))
        r = b - K @ x if x.any() else b.copy()
        first = size = float(np.linalg.norm(r))
        p, rz = np.zeros_like(b), 1.0
        for number in range(1, budget + 1):
            if size <= goal:
                return x, True
            count_product(K.nnz)
            z = cholesky.solve(r)
            rz, before = float(r @ z), rz
            p = z + (rz / before if number > 1 else 0.0) * p
            q = K @ p
            curvature = float(p @ q)
            self.statistics.iterations += 1
            if not (curvature > 0.0 and rz > 0.0):
                return x, False
            x = x + (rz / curvature) * p
            r -= (rz / curvature) * q
            size = float(np.linalg.norm(r))
            if number >= 3 and (size / first) ** (budget / number) > goal / first:
                return x, size <= goal
        return x, size <= goal

    def _solve_by_direct_factorisation(self, K: sparse.csr_matrix, b: Floats, tolerance: float) -> Floats:
        """Return the solution by a factorisation that works for any matrix, refined once."""
        self.statistics.fallbacks += 1
        symmetric = self._cholesky is not None and abs(K - K.T).max() <= 1e-12 * abs(K.data).max()
        lu = factor(K, symmetric=bool(symmetric))
        x = lu.solve(b)
        x += lu.solve(b - K @ x)
        return self._check_residual(lu.name, K, b, x, tolerance)

    def _check_residual(self, method: str, K: sparse.csr_matrix, b: Floats, x: Floats, tolerance: float) -> Floats:
        """Return x if its residual is small enough, and record the residual and the method. Raises Unsolved."""
        size = float(np.linalg.norm(b))
        residual = float(np.linalg.norm(b - K @ x))
        if not residual <= tolerance * size:
            rounding = 8 * EPS * float(np.linalg.norm(abs(K) @ np.abs(x)) + size)
            if not residual <= min(rounding, ROUGH * size):
                raise Unsolved(residual / size, tolerance)
        self._record_solve(method, residual / size)
        return x

    def _record_solve(self, method: str, residual: float) -> None:
        """Record the method and the relative residual of a solve."""
        self.statistics.method, self.statistics.residual = method, residual
