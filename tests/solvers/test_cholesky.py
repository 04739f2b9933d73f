"""Sparse Cholesky and the solver around it: against dense factors, other libraries' and the systems themselves."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse

from softmark.solvers.linear.factorisations import Singular, Unsolved, factor
from softmark.solvers.linear.recycled_solves import LinearSolver
from softmark.solvers.sparse.ordering import minimum_degree_orders
from softmark.solvers.sparse.sparse_cholesky import Cholesky, Indefinite
from softmark.solvers.sparse.symbolic_factorization import _estimate_for_order, analyse, estimate_factor


def grid(n: int, block: int = 1, shift: float = 0.1) -> sparse.csr_matrix:
    """The seven-point Laplacian of n^3 points plus a shift, each point with `block` coupled unknowns."""
    line = sparse.diags([-1.0, 2.0, -1.0], [-1, 0, 1], shape=(n, n))
    I = sparse.identity(n)
    A = sparse.kron(sparse.kron(line, I), I) + sparse.kron(sparse.kron(I, line), I)
    A = A + sparse.kron(sparse.kron(I, I), line) + shift * sparse.identity(n**3)
    coupled = np.eye(block) + 0.2 * np.ones((block, block))
    K = sparse.csr_matrix(sparse.kron(A, coupled))
    K.sort_indices()
    return K


def scattered(n: int, seed: int) -> sparse.csr_matrix:
    """A random pattern, by diagonal dominance positive definite; some unknowns are alone."""
    rng = np.random.default_rng(seed)
    i, j = rng.integers(0, n, (2, 2 * n))
    A = sparse.csr_matrix((rng.normal(size=2 * n), (i, j)), shape=(n, n))
    A = A + A.T
    K = sparse.csr_matrix(A + sparse.diags(1.0 + np.asarray(abs(A).sum(axis=1)).ravel()))
    K.sort_indices()
    return K


CASES = {
    "one": sparse.csr_matrix(np.array([[4.0]])),
    "diagonal": sparse.csr_matrix(sparse.diags(np.arange(1.0, 8.0))),
    "dense": sparse.csr_matrix(np.eye(30) + 0.5),
    "grid": grid(7),
    "blocks": grid(5, 3),
    "scattered": scattered(200, 1),
    "apart": sparse.csr_matrix(sparse.block_diag([grid(3), scattered(40, 2), np.eye(2)])),
}


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize(("precision", "tolerance"), [("double", 1e-13), ("single", 1e-5)])
def test_solves_systems(name: str, precision: str, tolerance: float) -> None:
    """Condition numbers are below 200, so the error is below 200 times some round-offs of 1e-16 or 6e-8."""
    K = CASES[name]
    x = np.random.default_rng(3).normal(size=K.shape[0])
    found = Cholesky.of(K, precision).solve(K @ x)  # type: ignore[arg-type]
    assert np.linalg.norm(found - x) <= tolerance * np.linalg.norm(x)


def test_memory_is_used_again_for_other_values() -> None:
    K = grid(5, 3)
    factorised = Cholesky(analyse(K))
    for scale in (1.0, 7.0):
        factorised.factorise(scale * K.data)
        b = np.arange(1.0, K.shape[0] + 1)
        np.testing.assert_allclose(scale * (K @ factorised.solve(b)), b, rtol=1e-11)


def test_the_order_is_a_permutation_that_saves_work() -> None:
    """In the natural order the band is n^2: n^3 columns of n^4 operations, 10^7; a third is easily had."""
    plan = analyse(grid(10))
    np.testing.assert_array_equal(np.sort(plan.order), np.arange(1000))
    assert plan.flops < 10**7 / 3


def tetrahedra(n: int) -> sparse.csr_matrix:
    """The pattern of a row of n x 5 x 5 boxes of six tetrahedra each, one unknown a node, as a definite matrix."""
    node = np.arange((n + 1) * 36).reshape(n + 1, 6, 6)
    corner = [node[i : n + i, j : 5 + j, k : 5 + k].ravel() for i, j, k in np.ndindex(2, 2, 2)]
    paths = [(0, 1, 3, 7), (0, 1, 5, 7), (0, 2, 3, 7), (0, 2, 6, 7), (0, 4, 5, 7), (0, 4, 6, 7)]
    cells = np.concatenate([np.stack([corner[c] for c in path], axis=1) for path in paths])
    rows, columns = np.repeat(cells, 4, axis=1).ravel(), np.tile(cells, (1, 4)).ravel()
    K = sparse.csr_matrix((np.ones(len(rows)), (rows, columns)))
    K.data[:] = -1.0
    K = sparse.csr_matrix(K + sparse.diags(np.diff(K.indptr) + 1.0))
    K.sort_indices()
    return K


def test_the_better_of_two_numberings_is_taken() -> None:
    """Lattices are ordered better from their own numbers, a row of tetrahedra by a tenth and more from others.

    Its 8.3e7 operations of three unknowns a node were those of the approximate degrees that were used before.
    """
    for K, own in ((grid(10), True), (tetrahedra(30), False)):
        found = estimate_factor(K)
        weights = np.diff(found.start)
        orders = minimum_degree_orders(*found.graph)
        costs = [_estimate_for_order(found.start, found.graph, order, weights).flops for order in orders]
        assert found.flops == min(costs)
        assert (costs[0] < costs[1]) == own
    assert 27.0 * min(costs) < 0.9 * 8.35e7


@pytest.mark.parametrize("where", [0, 17, 124])
def test_reports_what_is_not_positive_definite(where: int) -> None:
    K = grid(5)
    K[where, where] = -1.0
    with pytest.raises(Indefinite) as info:
        Cholesky.of(K)
    assert 0 <= info.value.pivots < 125


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_reports_what_is_not_finite(bad: float) -> None:
    K = grid(4)
    K[5, 5] = bad
    with pytest.raises(Indefinite):
        Cholesky.of(K)


@pytest.mark.parametrize("entry", [(0, 26), (4, 4)])
def test_needs_a_symmetric_pattern_with_a_diagonal(entry: tuple[int, int]) -> None:
    K = sparse.lil_matrix(grid(3))
    K[entry] = 0.0 if entry[0] == entry[1] else 1.0
    with pytest.raises(ValueError, match="symmetric"):
        analyse(K.tocsr())


# --------------------------------------------------------------- the solver


def residual(K: sparse.csr_matrix, x: np.ndarray, b: np.ndarray) -> float:
    return float(np.linalg.norm(K @ x - b) / np.linalg.norm(b))


@pytest.mark.parametrize("tolerance", [1e-4, 1e-8, 1e-13])
@pytest.mark.parametrize("name", CASES)
def test_solver_keeps_its_tolerance(name: str, tolerance: float) -> None:
    """What rounding leaves, about 1e-16 times the condition number of at most 200, is below every tolerance."""
    K = CASES[name]
    b = np.random.default_rng(4).normal(size=K.shape[0])
    solver = LinearSolver()
    assert residual(K, solver.solve(K, b, tolerance), b) <= tolerance
    assert solver.statistics.fallbacks == 0
    assert solver.statistics.residual <= tolerance


def test_solver_uses_an_old_factor_while_that_is_cheaper() -> None:
    """The matrix drifts by a thousandth each time: a factor of the first one serves for several."""
    K = grid(12, 3)
    b = np.ones(K.shape[0])
    solver = LinearSolver()
    drift = np.random.default_rng(5).uniform(0.0, 1e-3, K.shape[0])
    for _ in range(6):
        K.setdiag(K.diagonal() * (1.0 + drift))
        assert residual(K, solver.solve(K, b, 1e-8), b) <= 1e-8
    assert solver.statistics.analyses == 1
    assert solver.statistics.factorisations < 6
    assert solver.statistics.method == "conjugate gradients, earlier factor"


def test_solver_makes_a_new_factor_for_another_matrix() -> None:
    K = grid(8, 3)
    b = np.ones(K.shape[0])
    solver = LinearSolver()
    solver.solve(K, b, 1e-10)
    other = K.copy()
    other.setdiag(K.diagonal() * np.random.default_rng(6).uniform(1.0, 1e4, K.shape[0]))
    assert residual(other, solver.solve(other, b, 1e-10), b) <= 1e-10
    assert solver.statistics.factorisations == 2
    assert solver.statistics.analyses == 1


def test_solver_takes_another_pattern() -> None:
    solver = LinearSolver()
    for K in (grid(4), grid(5, 2), scattered(60, 3)):
        b = np.ones(K.shape[0])
        assert residual(K, solver.solve(K, b), b) <= 1e-10
    assert solver.statistics.analyses == 3


def test_indefinite_and_unsymmetric_matrices_are_solved_by_a_general_factor() -> None:
    K = grid(5)
    K[17, 17] = -3.0
    turned = sparse.csr_matrix(grid(4) + sparse.diags([0.5], [3], shape=(64, 64)))
    values = grid(4)
    values.data = values.data * np.random.default_rng(7).uniform(0.9, 1.1, values.nnz)
    for A in (K, turned, values):
        b = np.ones(A.shape[0])
        solver = LinearSolver()
        assert residual(A, solver.solve(A, b, 1e-10), b) <= 1e-10
    assert factor(K).negative_pivots == 1


def test_a_singular_matrix_is_never_called_solved() -> None:
    K = grid(3, shift=0.0)
    ends = sparse.csr_matrix(sparse.diags(np.asarray(K.sum(axis=1)).ravel()))
    laplace = sparse.csr_matrix(K - ends)  # rows sum to zero: constants are in its kernel
    b = np.ones(27)  # not orthogonal to them: there is no solution
    with pytest.raises((Unsolved, Singular)):
        LinearSolver().solve(laplace, b, 1e-8)


def test_nothing_to_solve() -> None:
    K = grid(3)
    np.testing.assert_array_equal(LinearSolver().solve(K, np.zeros(27)), np.zeros(27))


@pytest.mark.parametrize("seed", range(6))
def test_signed_factors_count_negative_eigenvalues(seed: int) -> None:
    """L S L^T of sparse matrices shifted into their spectrum, against the eigenvalues of the dense matrix.

    The shift is in the middle of a gap between two of them, wide enough for either to keep its sign in rounding.
    """
    K = grid(4, 3, 0.0) if seed % 2 else scattered(150, seed)
    w = np.linalg.eigvalsh(K.toarray())
    gaps = np.flatnonzero(np.diff(w) > 1e-3)
    at = gaps[np.random.default_rng(seed).integers(len(gaps))]
    shifted = sparse.csr_matrix(K - 0.5 * (w[at] + w[at + 1]) * sparse.identity(K.shape[0]))
    shifted.sort_indices()
    factor = Cholesky(analyse(shifted))
    factor.factorise(shifted.data, indefinite=True)
    assert factor.negative_pivots == at + 1 == np.sum(np.linalg.eigvalsh(shifted.toarray()) < 0)
    x = np.random.default_rng(seed).normal(size=K.shape[0])
    # eigenvalues as near as 5e-4 beside a norm of some 20, and pivots that nobody chose
    assert np.linalg.norm(factor.solve(shifted @ x) - x) <= 1e-7 * np.linalg.norm(x)


@pytest.mark.parametrize("scale", [1e-25, 1.0, 1e25])
def test_a_single_factor_is_refined_to_its_tolerance(scale: float) -> None:
    """By a few conjugate gradients, which the factor counts, also where numbers are near the limits of single ones."""
    K = grid(6, 3)
    b = scale * np.random.default_rng(1).normal(size=K.shape[0])
    found = factor(K, method="cholesky", precision="single")
    x = found.solve(b)
    assert np.linalg.norm(b - K @ x) <= found.tolerance * np.linalg.norm(b)
    assert 1 <= found.iterations <= 4
    assert found.negative_pivots is None
    assert factor(K, method="cholesky").iterations == 0
