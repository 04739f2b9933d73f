"""Sparse linear solvers, and the choice of the factorisation of a matrix.

With the method `auto`, a small symmetric matrix is factorised by banded Cholesky if it is positive definite with a
narrow band, since loading compiled kernels would take longer than they save. A larger one is factorised by this
project's multifrontal Cholesky, which continues as L S L^T at negative pivots. If that would take too long or too much
memory, conjugate gradients with multigrid are used, which need pyamg and rigid body modes. Without these, the factor is
computed in single precision, at half the memory. Large unsymmetric matrices are factorised by Pardiso if it is
installed, and all other matrices by SuperLU.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, Protocol

import numpy as np
from scipy import sparse

from softmark import resource_limits as memory
from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats
from softmark.solvers.runtime import parallel_compilation
from softmark.solvers.runtime.thread_limits import ALONE
from softmark.solvers.runtime.work_count import count_factorization, count_product
from softmark.solvers.sparse.banded_cholesky import NEUTRAL, NegativePivot, factorise_banded
from softmark.solvers.sparse.rigid_body_modes import Modes

if TYPE_CHECKING:
    from softmark.solvers.sparse.multigrid import Multigrid
    from softmark.solvers.sparse.pardiso import Pardiso
    from softmark.solvers.sparse.sparse_cholesky import Cholesky, Precision

Method = Literal["auto", "cholesky", "superlu", "pardiso", "multigrid"]

NAME, CHOLESKY = "SuperLU (scipy)", "multifrontal Cholesky"
SIGNED, SINGLE = "multifrontal L S L^T", "multifrontal Cholesky in single precision with conjugate gradients"
LARGE = 50_000  # entries from which Cholesky takes a fraction of SuperLU's time; loading its kernels takes 0.1 s
DISSECTED = 300_000  # entries from which an order by dissection may be tried: 8000 nodes with four neighbours each
VERY_LARGE = 3_000_000  # entries from which multigrid may be taken
SHARE = 0.6  # largest fraction of the free memory that a factor may take
LITTLE = 1e8  # bytes; smaller factors are not compared with the free memory
LONG = 2e6  # operations of a factorisation per unknown, from which multigrid takes less time
CLOSE = 1e-10  # relative residual at which iterations end
UNSTABLE = 1e-6  # relative residual above which a factor without pivoting is too inaccurate to be refined
FRESH = 30  # iterations within which those with a single-precision factor must converge
BESIDE = (  # Python code that the helper process runs
    "from softmark.solvers.runtime import kernel_cache; "
    "from softmark.solvers.linear.factorisations import warm_up; warm_up({});"
    " print(kernel_cache.count_compiled())"
)


class Singular(Exception):
    """Raised if the matrix has no usable factorisation."""


class Unsolved(Singular):
    """Raised if no method brings the residual below the tolerance; `residual` is the relative residual reached."""

    def __init__(self, residual: float, tolerance: float) -> None:
        super().__init__(f"the linear system is not solved: residual {residual:.1e}, tolerance {tolerance:.1e}")
        self.residual = residual


class NotInstalled(Singular):
    """Raised if the selected method needs a package that is not installed."""

    def __init__(self, method: str, package: str) -> None:
        super().__init__(f"{method} needs the package {package}: install softmark[fast]")


class TooLarge(Singular):
    """Raised if a factor needs more than the free memory and no iterative method can be used."""

    def __init__(self, needed: float, there: float, why: str) -> None:
        super().__init__(
            f"a factor of the stiffness matrix needs {needed / 1e9:.1f} GB, and {there / 1e9:.1f} GB are free; {why}"
        )


class Factor(Protocol):
    """Interface of a factorised matrix K, or of an iterative solver for K."""

    @property
    def name(self) -> str:
        """Name of the method and its implementation, for reports."""

    @property
    def negative_pivots(self) -> int | None:
        """Number of negative pivots, or None if unknown.

        For a symmetric matrix it equals the number of negative eigenvalues (Sylvester's law of inertia). It is unknown
        for iterative methods and in single precision.
        """

    @property
    def tolerance(self) -> float:
        """Relative residual of solutions; 0 if they are accurate to rounding."""

    @property
    def iterations(self) -> int:
        """Number of conjugate gradient iterations in the last solve; 0 for direct methods."""

    def solve(self, b: Floats) -> Floats:
        """Return the solution x of K x = b. Raises Unsolved if iterations do not reach `tolerance`."""


@dataclass(frozen=True)
class LuFactor:
    """LU factorisation K = L U with row and column permutations, by SuperLU."""

    lu: Any  # a scipy.sparse.linalg.SuperLU
    name: str = NAME
    tolerance: float = 0.0
    iterations: int = 0

    def solve(self, b: Floats) -> Floats:
        """Return the solution x of K x = b."""
        count_product(self.lu.nnz)
        with ALONE:
            return np.asarray(self.lu.solve(b))

    @property
    def negative_pivots(self) -> int | None:
        """Number of negative pivots; at least 1 if pivots lie off the diagonal, which proves K indefinite."""
        pivots = self.lu.U.diagonal()
        # a neutral direction, such as the plane in which a round column buckles, has a pivot of zero to rounding
        return int(np.sum(pivots < -NEUTRAL * np.abs(pivots).max())) or int(np.any(self.lu.perm_r != self.lu.perm_c))


@dataclass(frozen=True)
class DeferredFactor:
    """Solver for a symmetric K with a known negative eigenvalue; K is factorised only when needed."""

    K: sparse.csr_matrix
    name: str = NAME
    tolerance: float = 0.0
    iterations: int = 0

    @cached_property
    def factor(self) -> LuFactor:
        """LU factorisation of K, computed on first use. Raises Singular."""
        return _lu_factor(self.K, True)

    def solve(self, b: Floats) -> Floats:
        """Return the solution x of K x = b. Raises Singular."""
        return self.factor.solve(b)

    @property
    def negative_pivots(self) -> int | None:
        """Number of negative pivots of the LU factorisation. Raises Singular."""
        return self.factor.negative_pivots


@dataclass(frozen=True)
class CholeskyFactor:
    """Cholesky factorisation K = L L^T: every pivot is positive."""

    cholesky: Cholesky
    name: str = CHOLESKY
    negative_pivots: int | None = 0
    tolerance: float = 0.0
    iterations: int = 0

    def solve(self, b: Floats) -> Floats:
        """Return the solution x of K x = b."""
        return self.cholesky.solve(b)


@dataclass(frozen=True)
class SignedFactor:
    """Factor K = L S L^T, S = diag(+-1), of an indefinite K; solutions are refined once, as pivots may be small."""

    cholesky: Cholesky
    K: sparse.csr_matrix
    name: str = SIGNED
    tolerance: float = 0.0
    iterations: int = 0

    @property
    def negative_pivots(self) -> int | None:
        """Number of negative pivots."""
        return self.cholesky.negative_pivots

    def solve(self, b: Floats) -> Floats:
        """Return the solution x of K x = b."""
        x = self.cholesky.solve(b)
        return x + self.cholesky.solve(b - self.K @ x)


@dataclass
class RefinedFactor:
    """Single-precision Cholesky factor, used as preconditioner of a few conjugate gradient iterations."""

    cholesky: Cholesky
    K: sparse.csr_matrix
    name: str = SINGLE
    negative_pivots: int | None = None
    tolerance: float = CLOSE
    iterations: int = 0

    def solve(self, b: Floats) -> Floats:
        """Return x with |b - K x| <= tolerance |b|. Raises Unsolved."""
        from softmark.solvers.sparse.conjugate_gradients import conjugate_gradients

        size = float(np.linalg.norm(b))
        # single precision overflows where forces in N are far from one
        x, self.iterations, done = conjugate_gradients(self.K, b, self._solve_scaled, self.tolerance * size, FRESH)
        return x if done else _require_small_residual(self.K, x, b, self.tolerance)

    def _solve_scaled(self, r: Floats) -> Floats:
        """Return the single-precision solution for r, which is scaled to length one to avoid overflow."""
        size = float(np.linalg.norm(r))
        return size * self.cholesky.solve(r / size)


@dataclass(frozen=True)
class MultigridSolver:
    """Conjugate gradients with a multigrid preconditioner, and a fallback if the iterations do not converge."""

    multigrid: Multigrid
    K: sparse.csr_matrix
    name: str
    otherwise: Callable[[], Factor] | None = None
    negative_pivots: int | None = None
    tolerance: float = CLOSE

    @property
    def iterations(self) -> int:
        """Number of iterations in the last solve."""
        return self.multigrid.iterations

    def solve(self, b: Floats) -> Floats:
        """Return x with |b - K x| <= tolerance |b|. Raises Unsolved."""
        x, done = self.multigrid.solve(b, self.tolerance)
        if done:
            return x
        return self.otherwise().solve(b) if self.otherwise else _require_small_residual(self.K, x, b, self.tolerance)


def _require_small_residual(K: sparse.csr_matrix, x: Floats, b: Floats, tolerance: float) -> Floats:
    """Return x if its residual is within the tolerance or due to rounding only. Raises Unsolved."""
    size, residual = float(np.linalg.norm(b)), float(np.linalg.norm(b - K @ x))
    rounding = 8 * float(np.finfo(np.float64).eps) * float(np.linalg.norm(abs(K) @ np.abs(x)) + size)
    if not residual <= max(tolerance * size, min(rounding, 1e-8 * size)):
        raise Unsolved(residual / size if size else residual, tolerance)
    return x


# ------------------------------------------------------------------ choice of the solver


def factor(
    K: sparse.csr_matrix,
    symmetric: bool = True,
    method: Method = "auto",
    precision: Precision = "double",
    modes: Modes = None,
) -> Factor:
    """Return a solver for systems with K, by a `method` or by one that `auto` chooses.

    `precision` is that of a Cholesky factor; solutions are refined to double precision. `modes` are the rigid body
    modes of the unknowns (`sparse.rigid_body_modes`): multigrid needs them, and they also make large factors smaller.
    The analysis of a pattern is cached. Raises Singular if a pivot vanishes or an entry of K is not finite. Raises its
    subclasses NotInstalled and TooLarge if the method cannot be used, and Unsolved.
    """
    must_be_finite(K)
    if method == "auto":
        return _choose_factor(K, symmetric, precision, modes)
    if method == "superlu":
        return _lu_factor(K, symmetric)
    if method == "pardiso":
        return _pardiso_or_auto_factor(K, symmetric, precision, modes)
    if method == "multigrid":
        return _multigrid_solver(K, _evaluate_modes(modes))
    if method == "cholesky" and symmetric:
        return _cholesky_or_lu_factor(K, precision, modes)
    raise Singular("the matrix is not symmetric, which Cholesky factorization needs")


def must_be_finite(K: sparse.csr_matrix) -> None:
    """Raise Singular if an entry of the matrix is infinite or not a number."""
    if not np.all(np.isfinite(K.data)):
        raise Singular("the stiffness matrix contains numbers that are not finite")


def _evaluate_modes(modes: Modes) -> Floats | None:
    """Return the rigid body modes; if they are given as a function, call it."""
    return modes() if callable(modes) else modes


def _choose_factor(K: sparse.csr_matrix, symmetric: bool, precision: Precision, modes: Modes) -> Factor:
    """Return a factor by the method that `auto` chooses."""
    if K.nnz < LARGE:
        try:
            return (factorise_banded(K) if symmetric else None) or _lu_factor(K, symmetric)
        except NegativePivot:
            return DeferredFactor(K)
    if symmetric:
        return _symmetric_factor(K, precision, modes) or _lu_factor(K, symmetric)
    from softmark.solvers.sparse import pardiso

    return _pardiso_factor(K, symmetric, precision) if pardiso.is_installed() else _lu_factor(K, symmetric)


def _symmetric_factor(K: sparse.csr_matrix, precision: Precision, modes: Modes) -> Factor | None:
    """Return a solver for symmetric K, chosen by memory and time; None if no accurate factor of this kind exists."""
    from softmark.solvers.linear.symbolic_cache import cached_pattern
    from softmark.solvers.sparse import multigrid

    try:
        sketch = cached_pattern(K, modes).sketch
    except ValueError:
        return None
    fits = _fits_memory(sketch.bytes(8 if precision == "double" else 4))
    long = (1.0 if precision == "double" else 2.0) * LONG * K.shape[0]
    too_large = not fits or sketch.flops > long
    if too_large and multigrid.is_installed() and (motions := _evaluate_modes(modes)) is not None:
        return _multigrid_solver(K, motions, (lambda: _cholesky_or_lu_factor(K, precision, motions)) if fits else None)
    if not fits and _fits_memory(sketch.bytes(4)):
        precision = "single"
    return _cholesky_factor(K, precision, modes)


def _fits_memory(needed: float) -> bool:
    """Return whether a factor of `needed` bytes fits into the free memory; small ones are not checked, to save time."""
    return needed <= LITTLE or needed <= SHARE * memory.available_memory()


def _cholesky_or_lu_factor(K: sparse.csr_matrix, precision: Precision, modes: Modes) -> Factor:
    """Return a multifrontal Cholesky factor, or an LU factor if Cholesky fails. Raises Singular."""
    return _cholesky_factor(K, precision, modes) or _lu_factor(K, True)


def _cholesky_factor(K: sparse.csr_matrix, precision: Precision, modes: Modes) -> Factor | None:
    """Return a multifrontal factor; None if it is inaccurate or the pattern unsymmetric. Raises TooLarge."""
    from softmark.solvers.linear.symbolic_cache import cached_pattern
    from softmark.solvers.sparse.sparse_cholesky import Cholesky, Indefinite

    try:
        known = cached_pattern(K, modes)
        _require_memory(known.sketch.bytes(8 if precision == "double" else 4), modes)
        cholesky = Cholesky(known.plan(K), precision)
        cholesky.factorise(K.data, indefinite=precision == "double")
    except ValueError:
        return None
    except Indefinite:
        return None if precision == "double" else _cholesky_factor(K, "double", modes)
    if precision == "single":
        return RefinedFactor(cholesky, K)
    if cholesky.is_positive_definite:
        return CholeskyFactor(cholesky)
    return SignedFactor(cholesky, K) if _does_refinement_converge(cholesky, K) else None


def _require_memory(needed: float, modes: Modes) -> None:
    """Raise TooLarge if a factor of `needed` bytes would take more than the allowed fraction of the free memory."""
    if _fits_memory(needed):
        return
    from softmark.solvers.sparse import multigrid

    if not multigrid.is_installed():
        why = "install softmark[fast] to use the iterative solver of pyamg"
    else:
        why = "use a coarser mesh" if _evaluate_modes(modes) is None else "use `linear = multigrid`, or a coarser mesh"
    raise TooLarge(needed, memory.available_memory(), why)


def _does_refinement_converge(cholesky: Cholesky, K: sparse.csr_matrix) -> bool:
    """Return whether refinement converges with a factor whose entries may have grown for lack of pivoting."""
    b = np.random.default_rng(0).standard_normal(K.shape[0])
    residual = np.linalg.norm(b - K @ cholesky.solve(b))
    return bool(residual <= UNSTABLE * np.linalg.norm(b))


def _lu_factor(K: sparse.csr_matrix, symmetric: bool) -> LuFactor:
    """Return an LU factor by SuperLU, with columns in minimum-degree order. Raises Singular."""
    from scipy.sparse.linalg import splu  # takes 0.14 s, which is needless with our own factorisation

    # a symmetric matrix has equal CSR and CSC arrays: no conversion is needed
    columns = sparse.csc_matrix((K.data, K.indices, K.indptr), shape=K.shape) if symmetric else K.tocsc()
    try:
        with ALONE:
            lu = splu(columns, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    except RuntimeError as error:  # "Factor is exactly singular"
        raise Singular(str(error)) from error
    except MemoryError:
        raise Singular("SuperLU ran out of memory") from None
    count_factorization(float(lu.nnz) ** 2 / max(1, K.shape[0]))
    return LuFactor(lu)


def _multigrid_solver(
    K: sparse.csr_matrix, modes: Floats | None, otherwise: Callable[[], Factor] | None = None
) -> MultigridSolver:
    """Return a multigrid solver; `otherwise` creates a fallback if iterations do not converge. Raises NotInstalled."""
    from softmark.solvers.sparse import multigrid

    if not multigrid.is_installed():
        raise NotInstalled("multigrid", "pyamg")
    return MultigridSolver(multigrid.Multigrid(K, modes), K, multigrid.NAME, otherwise)


def _pardiso_or_auto_factor(K: sparse.csr_matrix, symmetric: bool, precision: Precision, modes: Modes) -> Factor:
    """Return a Pardiso factor, or one by `auto` if the MKL library is missing. Raises NotInstalled, Singular."""
    from softmark.solvers.sparse import pardiso

    if not pardiso.is_packaged():
        raise NotInstalled("Pardiso", "pypardiso")
    if pardiso.is_installed():
        return _pardiso_factor(K, symmetric, precision)
    return _choose_factor(K, symmetric, precision, modes)


def _pardiso_factor(K: sparse.csr_matrix, symmetric: bool, precision: Precision) -> Pardiso:
    """Return a Pardiso factor; a symmetric matrix is first tried as positive definite. Raises Singular."""
    from softmark.solvers.sparse import pardiso

    kinds = (pardiso.DEFINITE, pardiso.INDEFINITE) if symmetric else (pardiso.GENERAL,)
    for kind in kinds:
        try:
            return pardiso.Pardiso(K, kind)
        except pardiso.PardisoError as error:
            reason = error
    raise Singular(str(reason)) from reason


def condition(K: sparse.csr_matrix, factor: Factor) -> float:
    """Return a lower estimate of the condition number of K in the 1-norm, from its factor.

    The estimate is |S K S| |(S K S)^-1| with the scaling S = diag(|K_ii|^-1/2). Factorisation is invariant to such a
    scaling (van der Sluis 1969), and units cancel. The norm of the inverse is estimated by Hager's method (Hager 1984;
    Higham 1988, algorithm 4.1), in practice within a factor of three, with four or five solves. The factor of an
    unsymmetric matrix cannot solve the transposed system; the estimate is then still a lower bound. The result is
    infinite if a solution is not finite. Raises Unsolved.
    """
    n = K.shape[0]
    if n == 0:
        return 1.0
    diagonal = np.abs(K.diagonal()).astype(np.float64)
    s = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    size = float((s * (abs(K).T @ s)).max())
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        inverse = _estimate_inverse_norm(lambda b: factor.solve((b / s).astype(K.dtype)) / s, n)
    return size * inverse if np.isfinite(inverse) else float("inf")


def _estimate_inverse_norm(solve: Callable[[Floats], Floats], n: int) -> float:
    """Return a lower estimate of the 1-norm of an inverse matrix (n, n), applied by `solve` (Higham 1988)."""
    x, found, before = np.full(n, 1.0 / n), 0.0, np.zeros(n)
    for number in range(5):
        y = solve(x)
        size = float(np.abs(y).sum())
        if not np.isfinite(size):
            return size
        signs = np.where(y >= 0.0, 1.0, -1.0)
        done = number > 0 and (size <= found or np.array_equal(signs, before))
        found, before = max(found, size), signs
        if done:
            break
        z = solve(signs)
        most = int(np.argmax(np.abs(z)))
        if number and abs(z[most]) <= float(z @ x):
            break
        x = np.zeros(n)
        x[most] = 1.0
    slopes = (1.0 + np.arange(n) / max(1, n - 1)) * np.where(np.arange(n) % 2, -1.0, 1.0)
    return max(found, 2.0 * float(np.abs(solve(slopes)).sum()) / (3.0 * n))


@contextmanager
def warm_up_in_parallel(entries: int) -> Iterator[None]:
    """Load solvers as `warm_up` does, after the caller's block; a helper process compiles kernels meanwhile."""
    with parallel_compilation.helper_process(BESIDE.format(entries)) if entries >= LARGE else nullcontext():
        yield
    warm_up(entries)


def warm_up(entries: int) -> None:
    """Load the solvers for a matrix with this number of entries, so that loading is not part of timings."""
    if entries < LARGE:
        K = sparse.diags([-1.0, 2.0, -1.0], [-1, 0, 1], (9, 9), "csr")
        for known in (factorise_banded(K), _lu_factor(K, True)):
            if known is not None:
                known.solve(np.ones(9))  # the first solve is slow, too
        return
    for middle in (2.0, -2.0):  # a positive definite and an indefinite matrix
        diagonal = np.diag([2.0, middle, 2.0])
        K = sparse.csr_matrix(diagonal - np.diag([1.0, 1.0], 1) - np.diag([1.0, 1.0], -1))
        _cholesky_factor(K, "double", None)
    if entries >= DISSECTED:
        from softmark.solvers.sparse.ordering import warm_up as orders

        orders()
    if entries >= VERY_LARGE:
        from softmark.solvers.sparse import multigrid

        multigrid.warm_up()
