"""Sparse linear solvers: chooses the factorisation of a matrix.

For few entries, where loading kernels would take longer than it gains, `auto` takes Cholesky's method within the band
of a positive definite chain (`sparse.banded_cholesky`), else SuperLU. For more it takes the multifrontal Cholesky of
this project, which continues as L S L^T at negative pivots. If its factor would take too long or too much memory, it
takes conjugate gradients with multigrid, which needs the rigid motions of the unknowns and pyamg; else a factor in
single precision, with half the memory, and conjugate gradients. Unsymmetric matrices go to Pardiso if it is installed
and worth its analysis, else to SuperLU.
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
SHARE = 0.6  # of the memory that is left: what a factor may take ...
LITTLE = 1e8  # ... and bytes that are not asked about
LONG = 2e6  # operations for each unknown of a factorisation, from which multigrid takes less time
CLOSE = 1e-10  # relative residual to which iterations go
UNSTABLE = 1e-6  # relative residual of a factor without a choice of pivots that is not worth refining
FRESH = 30  # iterations within which a factor in single precision must do
BESIDE = (  # what another process does
    "from softmark.solvers.runtime import kernel_cache; "
    "from softmark.solvers.linear.factorisations import warm; warm({});"
    " print(kernel_cache.count_compiled())"
)


class Singular(Exception):
    """Raised if the matrix has no usable factorisation."""


class Unsolved(Singular):
    """Raised if no method brings the residual below the tolerance; `residual` is the relative one reached."""

    def __init__(self, residual: float, tolerance: float) -> None:
        super().__init__(f"the linear system is not solved: residual {residual:.1e}, tolerance {tolerance:.1e}")
        self.residual = residual


class NotInstalled(Singular):
    """Raised if the selected method needs a package that is not installed."""

    def __init__(self, method: str, package: str) -> None:
        super().__init__(f"{method} needs the package {package}: install softmark[fast]")


class TooLarge(Singular):
    """Raised if a factor would exceed the memory, and no iterative method can be used."""

    def __init__(self, needed: float, there: float, why: str) -> None:
        super().__init__(
            f"a factor of the stiffness matrix needs {needed / 1e9:.1f} GB, and {there / 1e9:.1f} GB are free; {why}"
        )


class Factor(Protocol):
    """Factorised matrix, or a solver with the same interface."""

    @property
    def name(self) -> str:
        """Method and implementation, for reports."""

    @property
    def negative_pivots(self) -> int | None:
        """Number of negative pivots: for a symmetric matrix, its negative eigenvalues (Sylvester's law).

        None if unknown, as for iterative methods or single precision.
        """

    @property
    def tolerance(self) -> float:
        """Relative residual of `solve`; 0 means to rounding."""

    @property
    def iterations(self) -> int:
        """Number of conjugate gradient iterations in the last `solve`; 0 for direct methods."""

    def solve(self, b: Floats) -> Floats:
        """Return x with K x = b. Raises Unsolved if iterations do not reach `tolerance`."""


@dataclass(frozen=True)
class LuFactor:
    """LU factorisation K = L U with a permutation, by SuperLU."""

    lu: Any  # scipy.sparse.linalg.SuperLU
    name: str = NAME
    tolerance: float = 0.0
    iterations: int = 0

    def solve(self, b: Floats) -> Floats:
        """Return x with K x = b."""
        with ALONE:
            x: Floats = self.lu.solve(b)
        return x

    @property
    def negative_pivots(self) -> int | None:
        """Number of negative pivots; at least 1 for pivots off the diagonal, which make K indefinite."""
        elsewhere = np.any(self.lu.perm_r != self.lu.perm_c)
        pivots = self.lu.U.diagonal()
        # a neutral direction, such as the plane in which a round column bends, has a pivot of zero to rounding
        return int(np.sum(pivots < -NEUTRAL * np.abs(pivots).max())) or int(elsewhere)


@dataclass(frozen=True)
class DeferredFactor:
    """Symmetric K known to have a negative eigenvalue; it is factorised only if needed."""

    K: sparse.csr_matrix
    name: str = NAME
    tolerance: float = 0.0
    iterations: int = 0

    @cached_property
    def factor(self) -> LuFactor:
        """Factorisation, made on first use. Raises Singular."""
        return _lu_factor(self.K, True)

    def solve(self, b: Floats) -> Floats:
        """Return x with K x = b. Raises Singular."""
        return self.factor.solve(b)

    @property
    def negative_pivots(self) -> int | None:
        """Number of negative pivots. Raises Singular."""
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
        """Return x with K x = b."""
        return self.cholesky.solve(b)


@dataclass(frozen=True)
class SignedFactor:
    """Factorisation K = L S L^T, S = diag(+-1), in a sparse order: refined once, since pivots may be small."""

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
        """Return x with K x = b."""
        x = self.cholesky.solve(b)
        return x + self.cholesky.solve(b - self.K @ x)


@dataclass
class RefinedFactor:
    """Cholesky factor in single precision; mostly two or three conjugate gradient iterations remove its errors."""

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
        x, self.iterations, done = conjugate_gradients(self.K, b, self._scaled, self.tolerance * size, FRESH)
        return x if done else _accept_rounding(self.K, x, b, self.tolerance)

    def _scaled(self, r: Floats) -> Floats:
        """Return the solution of the single-precision factor for r, scaled against overflow."""
        size = float(np.linalg.norm(r))
        return size * self.cholesky.solve(r / size)


@dataclass(frozen=True)
class MultigridSolver:
    """Conjugate gradients with multigrid, and a fallback if they fail."""

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
        return self.otherwise().solve(b) if self.otherwise else _accept_rounding(self.K, x, b, self.tolerance)


def _accept_rounding(K: sparse.csr_matrix, x: Floats, b: Floats, tolerance: float) -> Floats:
    """Return x, if only rounding keeps it from its tolerance. Raises Unsolved."""
    size, residual = float(np.linalg.norm(b)), float(np.linalg.norm(b - K @ x))
    rounding = 8 * float(np.finfo(np.float64).eps) * float(np.linalg.norm(abs(K) @ np.abs(x)) + size)
    if not residual <= max(tolerance * size, min(rounding, 1e-8 * size)):
        raise Unsolved(residual / size if size else residual, tolerance)
    return x


# ------------------------------------------------------------------ which one


def factor(
    K: sparse.csr_matrix,
    symmetric: bool = True,
    method: Method = "auto",
    precision: Precision = "double",
    modes: Modes = None,
) -> Factor:
    """Return a solver for systems with K, by a suitable method or the one named.

    `precision` is that of a Cholesky factor; solutions are refined. `modes`, rigid motions from
    `sparse.rigid_body_modes`, are needed by multigrid, and make large factors smaller. The analysis of a pattern is
    cached (`linear.symbolic_cache`). Raises Singular if a pivot vanishes or the matrix has a number that is not finite,
    its subclasses NotInstalled and TooLarge if the method cannot be used, and Unsolved.
    """
    must_be_finite(K)
    if method == "auto":
        return _choose_factor(K, symmetric, precision, modes)
    if method == "superlu":
        return _lu_factor(K, symmetric)
    if method == "pardiso":
        return _requested_pardiso(K, symmetric, precision, modes)
    if method == "multigrid":
        return _multigrid_solver(K, _computed_modes(modes))
    if method == "cholesky" and symmetric:
        return _required_cholesky(K, precision, modes)
    raise Singular("the matrix is not symmetric, which Cholesky factorization needs")


def must_be_finite(K: sparse.csr_matrix) -> None:
    """Raise Singular if a matrix has a number that is not finite."""
    if not np.all(np.isfinite(K.data)):
        raise Singular("the stiffness matrix contains numbers that are not finite")


def _computed_modes(modes: Modes) -> Floats | None:
    """Return the rigid motions, computed if they are given as a function."""
    return modes() if callable(modes) else modes


def _choose_factor(K: sparse.csr_matrix, symmetric: bool, precision: Precision, modes: Modes) -> Factor:
    """Return the factor of the method that `auto` chooses."""
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
    """Return a factor by memory and estimated time; None if the pattern is unsymmetric or signed pivots fail."""
    from softmark.solvers.linear.symbolic_cache import cached_pattern
    from softmark.solvers.sparse import multigrid

    try:
        sketch = cached_pattern(K, modes).sketch
    except ValueError:
        return None
    fits = _fits_memory(sketch.bytes(8 if precision == "double" else 4))
    long = (1.0 if precision == "double" else 2.0) * LONG * K.shape[0]
    too_large = not fits or sketch.flops > long
    if too_large and multigrid.is_installed() and (motions := _computed_modes(modes)) is not None:
        return _multigrid_solver(K, motions, (lambda: _required_cholesky(K, precision, motions)) if fits else None)
    if not fits and _fits_memory(sketch.bytes(4)):
        precision = "single"
    return _cholesky_factor(K, precision, modes)


def _fits_memory(needed: float) -> bool:
    """Return whether a factor of `needed` bytes fits; small ones are not checked, to save time."""
    return needed <= LITTLE or needed <= SHARE * memory.available_memory()


def _required_cholesky(K: sparse.csr_matrix, precision: Precision, modes: Modes) -> Factor:
    """Return our Cholesky factor. Raises Singular if it does not exist."""
    return _cholesky_factor(K, precision, modes) or _lu_factor(K, True)


def _cholesky_factor(K: sparse.csr_matrix, precision: Precision, modes: Modes) -> Factor | None:
    """Return our factor; None if it is inaccurate without pivoting, or the pattern is unsymmetric. Raises TooLarge."""
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
    if cholesky.definite:
        return CholeskyFactor(cholesky)
    return SignedFactor(cholesky, K) if _is_accurate(cholesky, K) else None


def _require_memory(needed: float, modes: Modes) -> None:
    """Raise TooLarge if a factor would take more than its share of memory."""
    if _fits_memory(needed):
        return
    from softmark.solvers.sparse import multigrid

    if not multigrid.is_installed():
        why = "install softmark[fast] to use the iterative solver of pyamg"
    else:
        why = "use a coarser mesh" if _computed_modes(modes) is None else "use `linear = multigrid`, or a coarser mesh"
    raise TooLarge(needed, memory.available_memory(), why)


def _is_accurate(cholesky: Cholesky, K: sparse.csr_matrix) -> bool:
    """Return whether refinement converges: without pivoting, pivots may have grown."""
    b = np.random.default_rng(0).standard_normal(K.shape[0])
    residual = np.linalg.norm(b - K @ cholesky.solve(b))
    return bool(residual <= UNSTABLE * np.linalg.norm(b))


def _lu_factor(K: sparse.csr_matrix, symmetric: bool) -> LuFactor:
    """Return an LU factor, with a minimum-degree order for symmetric patterns. Raises Singular."""
    from scipy.sparse.linalg import splu  # 0.14 s that what our own factorisation solves need not wait for

    # a symmetric matrix read by columns is itself: no conversion
    columns = sparse.csc_matrix((K.data, K.indices, K.indptr), shape=K.shape) if symmetric else K.tocsc()
    try:
        with ALONE:
            lu = splu(columns, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    except RuntimeError as error:  # "Factor is exactly singular"
        raise Singular(str(error)) from error
    except MemoryError:
        raise Singular("SuperLU ran out of memory") from None
    return LuFactor(lu)


def _multigrid_solver(
    K: sparse.csr_matrix, modes: Floats | None, otherwise: Callable[[], Factor] | None = None
) -> MultigridSolver:
    """Return a multigrid solver with a fallback. Raises NotInstalled."""
    from softmark.solvers.sparse import multigrid

    if not multigrid.is_installed():
        raise NotInstalled("multigrid", "pyamg")
    return MultigridSolver(multigrid.Multigrid(K, modes), K, multigrid.NAME, otherwise)


def _requested_pardiso(K: sparse.csr_matrix, symmetric: bool, precision: Precision, modes: Modes) -> Factor:
    """Return a Pardiso factor; our own, with its own name, if the library is missing. Raises NotInstalled, Singular."""
    from softmark.solvers.sparse import pardiso

    if not pardiso.is_packaged():
        raise NotInstalled("Pardiso", "pypardiso")
    if pardiso.is_installed():
        return _pardiso_factor(K, symmetric, precision)
    return _choose_factor(K, symmetric, precision, modes)


def _pardiso_factor(K: sparse.csr_matrix, symmetric: bool, precision: Precision) -> Pardiso:
    """Return a Pardiso factor. Raises Singular."""
    from softmark.solvers.sparse import pardiso

    kinds = (pardiso.DEFINITE, pardiso.INDEFINITE) if symmetric else (pardiso.GENERAL,)
    for kind in kinds:
        try:
            return pardiso.Pardiso(K, kind)
        except pardiso.PardisoError as error:
            reason = error
    raise Singular(str(reason)) from reason


def condition(K: sparse.csr_matrix, factor: Factor) -> float:
    """Return an estimate, from below, of the condition number of a matrix in the 1-norm, from its factor.

    |S K S| |(S K S)^-1|, S = diag(|K_ii|^-1/2): factorisation is invariant to such a scaling (van der Sluis 1969), and
    units drop out. The norm of the inverse is by Hager's method (Hager 1984; Higham 1988, algorithm 4.1), within a
    factor of three in practice, with four or five solutions. For an unsymmetric matrix, whose factor does not solve
    with the transposed, it is still a lower bound. Infinite if a solution is not finite; raises Unsolved.
    """
    n = K.shape[0]
    if n == 0:
        return 1.0
    diagonal = np.abs(K.diagonal()).astype(np.float64)
    s = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    size = float((s * (abs(K).T @ s)).max())
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        inverse = _inverse_norm(lambda b: factor.solve((b / s).astype(K.dtype)) / s, n)
    return size * inverse if np.isfinite(inverse) else float("inf")


def _inverse_norm(solve: Callable[[Floats], Floats], n: int) -> float:
    """Return the 1-norm of the operator `solve` on vectors (n,), from below (Higham 1988, algorithm 4.1)."""
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
    """Load solvers as `warm`, in parallel with compilation in the block if another process can help."""
    with parallel_compilation.helper_process(BESIDE.format(entries)) if entries >= LARGE else nullcontext():
        yield
    warm_up(entries)


def warm_up(entries: int) -> None:
    """Load the solvers for a system with that many entries, outside any timing."""
    if entries < LARGE:
        K = sparse.diags([-1.0, 2.0, -1.0], [-1, 0, 1], (9, 9), "csr")
        for known in (factorise_banded(K), _lu_factor(K, True)):
            if known is not None:
                known.solve(np.ones(9))  # the first call of either is slow, too
        return
    for middle in (2.0, -2.0):  # definite and not
        diagonal = np.diag([2.0, middle, 2.0])
        K = sparse.csr_matrix(diagonal - np.diag([1.0, 1.0], 1) - np.diag([1.0, 1.0], -1))
        _cholesky_factor(K, "double", None)
    if entries >= DISSECTED:
        from softmark.solvers.sparse.ordering import warm_up as orders

        orders()
    if entries >= VERY_LARGE:
        from softmark.solvers.sparse import multigrid

        multigrid.warm_up()
