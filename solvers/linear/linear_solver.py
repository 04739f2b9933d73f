"""Solvers of the linear systems in Newton's method: options of a model, and counts of solves and iterations."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import field, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from scipy import sparse

from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats
from softmark.solvers.linear import factorisations as linear
from softmark.solvers.linear import saddle_point
from softmark.solvers.linear.factorisations import Factor, Singular, Unsolved, factor
from softmark.solvers.sparse.rigid_body_modes import Modes

if TYPE_CHECKING:
    from softmark.solvers.linear.recycled_solves import LinearSolver
    from softmark.solvers.sparse.sparse_cholesky import Precision

Method = linear.Method | Literal["conjugate_gradients"]

# limits of the relative residual of a Newton step's linear system; bending converges last, and at 1e-1 hardly at all:
# the silicone beam then takes 42 Newton steps and 5089 iterations in all, but 6 and 2722 at 1e-4
LOOSEST, TIGHTEST = 1e-4, 1e-10
GAMMA = 0.9  # coefficient of Eisenstat and Walker's second choice
ENOUGH = 0.1  # fraction of Newton's tolerance: a smaller linear residual helps nothing
MOST = 20_000  # largest number of conjugate gradient iterations if there is no cap


@dataclass(frozen=True)
class LinearSolverOptions:
    """Options of the linear solver.

    `method` is a method of `linear.factorisations.factor`, or `conjugate_gradients` with a diagonal preconditioner.
    `cap` is the largest number of these iterations, converged or not. `reuse` keeps an earlier factor as a
    preconditioner as long as that costs less than a new factor. `modes` are the rigid body modes of the body. `spare`
    is the additional compliance of systems with pressure unknowns (see `linear.saddle_point`). These systems ignore
    `cap` and `reuse`, and use double precision. `halved` marks such systems as nearly symmetric, so that a factor of
    their symmetric part suffices.
    """

    method: Method = "auto"
    precision: Precision = "double"
    cap: int | None = None
    reuse: bool = False
    modes: Modes = None
    spare: Floats | None = field(default=None, compare=False)  # (n,) as in `saddle_point`; None without pressures
    halved: bool = False

    @property
    def iterative(self) -> bool:
        """True if systems are solved iteratively, to a tolerance that Newton's method chooses."""
        return self.reuse or self.method == "conjugate_gradients"


@dataclass
class LinearSystems:
    """Solver for all linear systems of one problem, which counts solves, factorisations and iterations."""

    choice: LinearSolverOptions = field(default_factory=LinearSolverOptions)
    name: str = linear.NAME
    solves: int = 0
    factorisations: int = 0
    iterations: int = 0  # conjugate gradient iterations
    capped: int = 0  # systems that did not converge within the cap
    _kept: LinearSolver | None = None

    def factor(self, K: sparse.csr_matrix, symmetric: bool, goal: float) -> Factor:
        """Return a solver for systems with K. Raises Singular.

        An iterative solver reduces the relative residual to `goal`.
        """
        self.solves += 1
        found: Any
        if self.choice.method == "conjugate_gradients":
            found = DiagonalConjugateGradients(self, K, goal, symmetric)
        elif self.choice.reuse and symmetric:
            found = ReusedFactor(self, K, goal)
        else:
            found = self._make_factor_by_method(K, symmetric)
        self.name = found.name
        made: Factor = found
        return made

    def direct(self, K: sparse.csr_matrix) -> Factor:
        """Return a direct factor of symmetric K that counts negative pivots, in double precision.

        It replaces iterative solvers and single precision, which count none.
        """
        if self.choice.reuse or self.choice.precision == "single":
            self.factorisations += 1
            return factor(K, modes=self.choice.modes)
        return self._make_factor_by_method(K, True)

    def _make_factor_by_method(self, K: sparse.csr_matrix, symmetric: bool) -> Factor:
        """Return a solver for K by the method in the options."""
        method: Any = self.choice.method
        self.factorisations += 1
        if self.choice.spare is not None:
            halved = self.choice.halved and not symmetric
            own = symmetric or halved
            return saddle_point.factor(K, self.choice.spare, lambda K: factor(K, own, method), halved)
        found = factor(K, symmetric, method, self.choice.precision, self.choice.modes)
        if isinstance(found, linear.RefinedFactor) and K.dtype == np.float32:
            return SinglePrecisionFactor(found)  # a float32 matrix gives no residual accurate enough to refine
        return CountedFactor(self, found) if found.tolerance else found

    def next_tolerance(self, residual: float, before: float, last: float, tolerance: float) -> float:
        """Return the relative residual to which the next linear system should be solved.

        It is 0.9 (residual / before)^2, with Newton's residual now (`residual`) and one step earlier (`before`). It is
        not far below the `last` goal as long as that was loose (Eisenstat and Walker 1996, choice 2), and never smaller
        than Newton's `tolerance` requires.
        """
        if not np.isfinite(before) or before == 0.0:
            return LOOSEST
        eta = GAMMA * (residual / before) ** 2
        if GAMMA * last**2 > 0.1:
            eta = max(eta, GAMMA * last**2)
        eta = max(min(eta, LOOSEST), ENOUGH * tolerance / residual if residual > 0 else LOOSEST)
        return float(np.clip(eta, TIGHTEST, LOOSEST))

    @property
    def facts(self) -> dict[str, Any]:
        """Name and counts of the linear solver, for the report."""
        known: dict[str, Any] = {"linear_solver": self.name, "factorisations": self.factorisations}
        if self.choice.iterative or self.iterations:
            known["linear_iterations"] = self.iterations
        if self.choice.cap is not None:
            known["linear_capped"] = self.capped
        return known


def warm_up(choice: LinearSolverOptions, kind: Any) -> None:
    """Load the kernels of the selected solver for matrices of the number type `kind`, so that loading is not timed."""
    K = sparse.csr_matrix(np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 2.0]], dtype=kind))
    method: Method = "cholesky" if choice.method == "auto" else choice.method
    with suppress(Singular):  # the real solve reports the error
        systems = LinearSystems(replace(choice, method=method, modes=None, spare=None))
        systems.factor(K, True, TIGHTEST).solve(np.ones(3, dtype=kind))


@dataclass(frozen=True)
class CountedFactor:
    """Iterative solver whose iterations are added to the counter of `systems`."""

    systems: LinearSystems
    factor: Factor

    @property
    def name(self) -> str:
        """Name of the method."""
        return self.factor.name

    @property
    def negative_pivots(self) -> int | None:
        """Number of negative pivots; None if the solver does not know it."""
        return self.factor.negative_pivots

    @property
    def tolerance(self) -> float:
        """Relative residual of solutions."""
        return self.factor.tolerance

    @property
    def iterations(self) -> int:
        """Number of iterations in the last solve."""
        return self.factor.iterations

    def solve(self, b: Floats) -> Floats:
        """Return x with |b - K x| <= tolerance |b|. Raises Unsolved."""
        x = self.factor.solve(b)
        self.systems.iterations += self.factor.iterations
        return x


@dataclass(frozen=True)
class SinglePrecisionFactor:
    """Cholesky factor in single precision without refinement.

    Right-hand sides are scaled to length one, because single precision overflows sooner.
    """

    refined: linear.RefinedFactor
    name: str = "multifrontal Cholesky in single precision"
    negative_pivots: int | None = None  # positive pivots in single precision prove nothing
    tolerance: float = 0.0
    iterations: int = 0

    def solve(self, b: Floats) -> Floats:
        """Return the solution x of K x = b, to single-precision rounding."""
        size = float(np.linalg.norm(b))
        return size * self.refined.cholesky.solve(b / size) if size > 0.0 else b


@dataclass
class DiagonalConjugateGradients:
    """Conjugate gradients with the diagonal of K as preconditioner (Hestenes and Stiefel 1952).

    If the curvature along a search direction is not positive, the iterations stop with the present x. It is still a
    descent direction, as in truncated Newton methods (Steihaug 1983).
    """

    systems: LinearSystems
    K: sparse.csr_matrix
    tolerance: float
    symmetric: bool
    name: str = "conjugate gradients, diagonal preconditioner"
    negative_pivots: int | None = None  # 1 once a direction of negative curvature was met
    iterations: int = 0  # iterations in the last solve

    def solve(self, b: Floats) -> Floats:
        """Return x with |b - K x| <= tolerance |b|, or x after `cap` iterations. Raises Singular."""
        if not self.symmetric:
            raise Singular("conjugate gradients need a symmetric matrix")
        linear.must_be_finite(self.K)
        cap = self.systems.choice.cap
        x, done, residual = self._iterate_conjugate_gradients(b, MOST if cap is None else cap)
        if done or self.negative_pivots:
            return x
        if cap is None:
            raise Unsolved(residual, self.tolerance)
        self.systems.capped += 1
        return x

    def _iterate_conjugate_gradients(self, b: Floats, most: int) -> tuple[Floats, bool, float]:
        """Return x after at most `most` iterations, whether they converged, and the relative residual."""
        K, size = self.K, float(np.linalg.norm(b))
        diagonal = np.abs(K.diagonal())
        M = np.where(diagonal > 0, diagonal, 1.0)
        x, r, p, rz = np.zeros_like(b), b.copy(), np.zeros_like(b), 1.0
        left, self.iterations = size, 0
        for number in range(most):
            if left <= self.tolerance * size:
                return x, True, left / size if size else 0.0
            z = r / M
            rz, before = float(r @ z), rz
            p = z + (rz / before if number else 0.0) * p
            q = K @ p
            curvature = float(p @ q)
            self.systems.iterations += 1
            self.iterations += 1
            if curvature <= 0.0:
                self.negative_pivots = 1
                return (x if number else z), False, left / size
            x += (rz / curvature) * p
            r -= (rz / curvature) * q
            left = float(np.linalg.norm(r))
        return x, left <= self.tolerance * size, left / size if size else 0.0


@dataclass
class ReusedFactor:
    """Conjugate gradients with a Cholesky preconditioner: a factor of this matrix or of an earlier one.

    The factor that costs less is used.
    """

    systems: LinearSystems
    K: sparse.csr_matrix
    tolerance: float
    negative_pivots: int | None = None  # 1 if K is not positive definite, else unknown
    iterations: int = 0  # iterations in the last solve

    @property
    def name(self) -> str:
        """Name of the method."""
        return self._recycling_solver.name

    @property
    def _recycling_solver(self) -> LinearSolver:
        """Linear solver that stores the factor of an earlier matrix."""
        from softmark.solvers.linear.recycled_solves import LinearSolver

        if self.systems._kept is None:
            self.systems._kept = LinearSolver()
        return self.systems._kept

    def solve(self, b: Floats) -> Floats:
        """Return x with |b - K x| <= tolerance |b|. Raises Singular."""
        linear.must_be_finite(self.K)
        done = self._recycling_solver.statistics
        before = done.indefinite, done.iterations, done.factorisations + done.fallbacks
        x = self._recycling_solver.solve(self.K, b, self.tolerance)
        self.iterations = done.iterations - before[1]
        self.systems.iterations += self.iterations
        self.systems.factorisations += done.factorisations + done.fallbacks - before[2]
        if done.indefinite > before[0]:
            self.negative_pivots = 1
        return x
