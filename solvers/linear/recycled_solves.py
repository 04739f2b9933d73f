"""Solver for a sequence of linear systems with one pattern and similar values, which reuses factors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from softmark.solvers.energies.energy import Floats
from softmark.solvers.linear.factorisations import Unsolved, factor
from softmark.solvers.linear.symbolic_cache import cached_plan
from softmark.solvers.sparse.sparse_cholesky import Cholesky, Indefinite, Precision

EPS = float(np.finfo(np.float64).eps)
FLOPS, ENTRIES = (
    2e10,
    1.5e9,
)  # a second: of a factorisation; entries of factor and matrix passed in an iteration
FRESH = 12  # iterations within which a factor of this very matrix must do, else it is useless
ROUGH = 1e-8  # relative residual above which rounding is no excuse: the matrix is singular to its last digits
FORGET = 16  # solves after which a failure with an old factor is no reason any more


@dataclass
class Statistics:
    """Counts of a LinearSolver, and the method and residual of its last solve."""

    solves: int = 0
    factorisations: int = 0
    iterations: int = 0  # of conjugate gradients; each passes once through the factor
    fallbacks: int = 0  # solves that a general factorisation had to do
    analyses: int = 0
    indefinite: int = 0  # matrices found not to be positive definite
    method: str = ""
    residual: float = np.nan  # relative, of the last solve, against the matrix itself


class LinearSolver:
    """Conjugate gradient solver of K x = b with a Cholesky factor of this matrix or of an earlier one.

    With a single-precision factor of K itself, two or three iterations give 1e-10; with that of a similar matrix a few
    more, as long as they cost less than a new factorisation, by counts of operations. Matrices that are not positive
    definite, or with unsymmetric pattern, go to `linear.factorisations.factor`. Every x is checked: |b - K x| is at
    most `tolerance` |b|, or its rounding error if that is below ROUGH |b|; else Unsolved is raised.
    """

    name = "multifrontal Cholesky with conjugate gradients"

    def __init__(self, precision: Precision = "single", reuse: bool = True) -> None:
        self.statistics = Statistics()
        self._precision: Precision = precision
        self._reuse = reuse
        self._indptr = self._indices = np.zeros(0, dtype=np.int32)
        self._cholesky: Cholesky | None = None
        self._ready = False  # a factor of an earlier matrix is at hand
        self._age = 0  # solves since it was made
        self._failed: dict[int, int] = {}  # age of a factor: solve at which it did not do

    def solve(self, K: sparse.csr_matrix, b: Floats, tolerance: float = 1e-10) -> Floats:
        """Return x with |b - K x| <= tolerance |b|. Raises Unsolved, and Singular."""
        self.statistics.solves += 1
        if not np.any(b):
            self._note("nothing to solve", 0.0)
            return np.zeros_like(b)
        self._recognise(K)
        x = None if self._cholesky is None else self._definite(K, b, tolerance)
        return self._general(K, b, tolerance) if x is None else x

    def _recognise(self, K: sparse.csr_matrix) -> None:
        """Analyse the pattern, if it is not the last one."""
        if self._same(K.indptr, K.indices):
            return
        self._indptr, self._indices = K.indptr, K.indices
        self._ready, self._failed = False, {}
        self.statistics.analyses += 1
        try:
            self._cholesky = Cholesky(cached_plan(K), self._precision)
        except ValueError:  # the pattern is not symmetric
            self._cholesky = None

    def _same(self, indptr: np.ndarray, indices: np.ndarray) -> bool:
        """Return whether a pattern is the last one."""
        if indptr is self._indptr and indices is self._indices:
            return True
        return np.array_equal(indptr, self._indptr) and np.array_equal(indices, self._indices)

    def _definite(self, K: sparse.csr_matrix, b: Floats, tolerance: float) -> Floats | None:
        """Return x by conjugate gradients; None if K is not positive definite or they do not converge."""
        x = np.zeros_like(b)
        if self._worth_trying():
            x, done = self._iterate(K, b, x, tolerance, self._budget())
            if done:
                self._age += 1
                return self._checked("conjugate gradients, earlier factor", K, b, x, tolerance)
            self._failed[self._age] = self.statistics.solves
        if not self._refactorise(K):
            return None
        x, done = self._iterate(K, b, x, tolerance, FRESH)
        if not done and self._cholesky is not None and self._cholesky.precision == "single":
            if not self._factorised(Cholesky(self._cholesky.plan, "double"), K):
                return None
            x, done = self._iterate(K, b, np.zeros_like(b), tolerance, FRESH)
        return self._checked("conjugate gradients, own factor", K, b, x, tolerance) if done else None

    def _worth_trying(self) -> bool:
        """Return whether there is an earlier factor, and one of its age has not failed recently."""
        when = self._failed.get(self._age, -FORGET)
        return self._reuse and self._ready and self.statistics.solves - when >= FORGET

    def _budget(self) -> int:
        """Return the number of iterations that cost as much as half a factorisation."""
        cholesky = self._cholesky
        assert cholesky is not None
        plan = cholesky.plan
        return max(2, int(0.5 * plan.flops / FLOPS * ENTRIES / (2 * plan.factor_size + len(self._indices))))

    def _refactorise(self, K: sparse.csr_matrix) -> bool:
        """Factorise K, in double precision if needed; False if K is not positive definite."""
        cholesky = self._cholesky
        assert cholesky is not None
        self._ready = False
        if self._factorised(cholesky, K):
            return True
        if cholesky.precision == "single" and self._factorised(Cholesky(cholesky.plan, "double"), K):
            return True
        self.statistics.indefinite += 1
        return False

    def _factorised(self, attempt: Cholesky, K: sparse.csr_matrix) -> bool:
        """Return whether an attempt to factorise K succeeds."""
        self.statistics.factorisations += 1
        try:
            attempt.factorise(K.data)
        except Indefinite:
            return False
        self._cholesky, self._ready, self._age = attempt, True, 0
        return True

    def _iterate(
        self, K: sparse.csr_matrix, b: Floats, x: Floats, tolerance: float, budget: int
    ) -> tuple[Floats, bool]:
        """Return x by conjugate gradients (Hestenes and Stiefel 1952), and whether it reached the tolerance.

        They stop early if the rate so far is too slow for the budget, or the curvature is not positive.
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

    def _general(self, K: sparse.csr_matrix, b: Floats, tolerance: float) -> Floats:
        """Return x by a factorisation for any matrix, refined once."""
        self.statistics.fallbacks += 1
        symmetric = self._cholesky is not None and abs(K - K.T).max() <= 1e-12 * abs(K.data).max()
        lu = factor(K, symmetric=bool(symmetric))
        x = lu.solve(b)
        x += lu.solve(b - K @ x)
        return self._checked(lu.name, K, b, x, tolerance)

    def _checked(self, method: str, K: sparse.csr_matrix, b: Floats, x: Floats, tolerance: float) -> Floats:
        """Return x if it solves the system. Raises Unsolved."""
        size = float(np.linalg.norm(b))
        residual = float(np.linalg.norm(b - K @ x))
        if not residual <= tolerance * size:
            rounding = 8 * EPS * float(np.linalg.norm(abs(K) @ np.abs(x)) + size)
            if not residual <= min(rounding, ROUGH * size):
                raise Unsolved(residual / size, tolerance)
        self._note(method, residual / size)
        return x

    def _note(self, method: str, residual: float) -> None:
        """Record the method and residual of a solve."""
        self.statistics.method, self.statistics.residual = method, residual
