"""Which factorisation is used, what is kept of a pattern, and how accurate Cholesky's is beside SuperLU's."""

from __future__ import annotations

import gc
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.linalg import splu

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.energies.elastic_energy import Elastic
from softmark.solvers.linear import factorisations, symbolic_cache
from softmark.solvers.linear.recycled_solves import LinearSolver
from softmark.solvers.materials import Law
from softmark.solvers.mesh.element_interpolation import integrate_cells
from softmark.solvers.mesh.mesh import Mesh
from softmark.solvers.mesh.shapes import Box
from softmark.solvers.runtime import thread_limits
from softmark.solvers.sparse import pardiso
from softmark.solvers.sparse.sparse_cholesky import Cholesky

Maker = Callable[..., Law]
NONE = np.zeros(0, dtype=np.int64)


def chain(n: int, shift: float = 0.1) -> sparse.csr_matrix:
    """Springs in a row, each held a little."""
    K = sparse.diags([-1.0, 2.0 + shift, -1.0], [-1, 0, 1], shape=(n, n)).tocsr()
    K.sort_indices()
    return K


def stiffness(law: Law, size: float = 1.0, free: bool = False, hard: float = 1.0) -> sparse.csr_matrix:
    """Of a block of 0.2 x 0.1 x 0.1 times `size` m, clamped at an end or free; half of it `hard` times as stiff."""
    mesh = Box((0.2, 0.1, 0.1)).mesh("tet4", 0.025)
    mesh = Mesh(mesh.points * size, mesh.cells)
    parts = integrate_cells(mesh)
    middle = mesh.points[:, 0].mean()
    w = parts.w * np.where(mesh.points[mesh.cells].mean(axis=1)[:, 0] > middle, hard, 1.0)[:, None]
    end = np.repeat(mesh.points[:, 0] <= mesh.points[:, 0].min() + 1e-9 * size, 3)
    fixed = NONE if free else np.flatnonzero(end)
    assembly = Assembly(mesh.points.size, fixed, [Elastic(mesh.cells, parts.dNdX, w, law)], [])
    return assembly.tangent(np.zeros(mesh.points.size), 1.0)


# ------------------------------------------------------------------ which one


def test_large_definite_matrices_go_to_cholesky_and_others_to_superlu(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Every factor says what it is; n - 1 negative pivots would be n - 1 negative eigenvalues."""
    large, small = chain(factorisations.LARGE), sparse.csr_matrix(np.eye(12) + 1.0)
    b = np.ones(factorisations.LARGE)
    definite = factorisations.factor(large)
    assert (definite.name, definite.negative_pivots) == ("multifrontal Cholesky", 0)
    np.testing.assert_allclose(large @ definite.solve(b), b, rtol=1e-12)
    assert factorisations.factor(small).name == factorisations.NAME == "SuperLU (scipy)"
    monkeypatch.setattr(pardiso, "is_installed", lambda: False)
    assert factorisations.factor(large, symmetric=False).name == factorisations.NAME
    large[7, 7] = -1.0
    indefinite = factorisations.factor(large)
    assert (indefinite.name, indefinite.negative_pivots) == (factorisations.SIGNED, 1)
    np.testing.assert_allclose(large @ indefinite.solve(b), b, rtol=1e-12)
    lopsided = chain(factorisations.LARGE) + sparse.diags([1e-3], [40], shape=large.shape)
    lopsided = sparse.csr_matrix(lopsided)
    np.testing.assert_allclose(lopsided @ factorisations.factor(lopsided, symmetric=False).solve(b), b, rtol=1e-12)


def test_factors_of_one_pattern_do_not_share_their_numbers() -> None:
    K = chain(factorisations.LARGE)
    b = np.ones(factorisations.LARGE)
    first = factorisations.factor(K)
    x = first.solve(b)
    factorisations.factor(sparse.csr_matrix((3.0 * K.data, K.indices, K.indptr), shape=K.shape))
    np.testing.assert_array_equal(first.solve(b), x)


def test_numbers_that_are_not_finite_are_singular() -> None:
    for n in (50, factorisations.LARGE):
        K = chain(n)
        K.data[3] = np.nan
        with pytest.raises(factorisations.Singular, match="not finite"):
            factorisations.factor(K)
    with pytest.raises(factorisations.Singular):
        factorisations.factor(sparse.csr_matrix((4, 4)))


@pytest.mark.slow
@pytest.mark.long
def test_small_systems_load_no_kernels() -> None:
    code = (
        "import sys, numpy as np; from scipy import sparse; from softmark.solvers.linear.factorisations import factor;"
        "factor(sparse.identity(100, format='csr')).solve(np.ones(100));"
        "sys.exit('numba' in sys.modules or 'softmark.solvers.sparse.factorization_kernels' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


# ------------------------------------------------------------------ one analysis for a pattern


@pytest.fixture
def analyses(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Sizes of the patterns analysed."""
    sizes: list[int] = []
    true = symbolic_cache.estimate_factor

    def counted(K: sparse.csr_matrix, motions: Any = None) -> Any:
        sizes.append(K.shape[0])
        return true(K, motions)

    monkeypatch.setattr(symbolic_cache, "estimate_factor", counted)
    return sizes


def test_a_pattern_is_analysed_once(analyses: list[int], law: Maker) -> None:
    """As an assembly makes its matrices, and for an equal pattern in other arrays."""
    mesh = Box((0.2, 0.1, 0.1)).mesh("tet4", 0.05)
    parts = integrate_cells(mesh)
    assembly = Assembly(mesh.points.size, NONE, [Elastic(mesh.cells, parts.dNdX, parts.w, law("small"))], [])
    K = assembly.tangent(np.zeros(mesh.points.size), 1.0)
    plan = symbolic_cache.cached_plan(K)
    assert symbolic_cache.cached_plan(assembly.tangent(np.ones(mesh.points.size), 1.0)) is plan
    assert symbolic_cache.cached_plan(K.copy()) is plan
    assert analyses == [K.shape[0]]
    assert symbolic_cache.cached_plan(chain(K.shape[0])) is not plan


@pytest.mark.slow
def test_what_is_known_of_a_pattern_goes_with_it() -> None:
    gc.collect()
    before = len(symbolic_cache._KNOWN)
    kept = [chain(20 + i) for i in range(symbolic_cache.KEPT + 5)]
    for K in kept:
        symbolic_cache.cached_plan(K)
    assert len(symbolic_cache._KNOWN) == symbolic_cache.KEPT
    del K, kept
    gc.collect()
    assert len(symbolic_cache._KNOWN) <= before


def test_patterns_that_are_not_symmetric_are_not_kept() -> None:
    K = sparse.csr_matrix(np.array([[1.0, 2.0], [0.0, 1.0]]))
    before = len(symbolic_cache._KNOWN)
    with pytest.raises(ValueError, match="symmetric"):
        symbolic_cache.cached_plan(K)
    assert len(symbolic_cache._KNOWN) == before


# ------------------------------------------------------------------ accuracy

# Young's modulus, Poisson's ratio, how it is made
MATRICES: dict[str, tuple[float, float, dict[str, Any]]] = {
    "silicone": (6e4, 0.3, {}),
    "steel, micrometres": (2.1e11, 0.3, {"size": 1e-6}),
    "silicone, micrometres": (6e4, 0.49, {"size": 1e-6}),
    "nearly incompressible": (6e4, 0.4999, {}),
    "as good as incompressible": (6e4, 0.499999, {}),
    "soft and hard": (1e3, 0.3, {"hard": 1e8}),
    "afloat": (6e4, 0.3, {"free": True}),
}


def matrix(name: str, law: Maker) -> sparse.csr_matrix:
    young, poisson, made = MATRICES[name]
    K = stiffness(law("small", young, poisson), **made)
    if made.get("free"):  # held by a mass so small that its condition is 1e13
        K.setdiag(K.diagonal() + 1e-13 * K.diagonal().max())
    return K


def backward(K: sparse.csr_matrix, x: np.ndarray, b: np.ndarray) -> float:
    """|b - K x| / (|K| |x| + |b|) in the largest norm (Rigal and Gaches 1967)."""
    size = abs(K).sum(axis=1).max() * np.abs(x).max() + np.abs(b).max()
    return float(np.abs(b - K @ x).max() / size)


@pytest.mark.parametrize("name", MATRICES)
def test_cholesky_is_as_accurate_as_superlu(name: str, law: Maker) -> None:
    """Both are backward stable: some 1e-16 (Higham 2002, theorem 10.4), whatever the condition of the matrix.

    The bound there grows with the number of unknowns; in practice ten round-offs do.
    """
    K = matrix(name, law)
    b = K @ np.random.default_rng(2).normal(size=K.shape[0])
    ours = backward(K, Cholesky.of(K).solve(b), b)
    lu = splu(K.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    assert ours <= 10 * np.finfo(float).eps
    assert ours <= 3 * backward(K, lu.solve(b), b) + np.finfo(float).eps


@pytest.mark.parametrize("name", MATRICES)
def test_the_solver_meets_its_tolerance_on_bad_matrices(name: str, law: Maker) -> None:
    """A factor in single precision either does, with iterations, or gives way to one in double precision."""
    K = matrix(name, law)
    b = K @ np.random.default_rng(3).normal(size=K.shape[0])
    solver = LinearSolver()
    x = solver.solve(K, b, 1e-10)
    assert np.linalg.norm(K @ x - b) <= 1e-10 * np.linalg.norm(b)
    assert solver.statistics.fallbacks == 0


def test_blas_works_alone_and_gets_its_threads_back() -> None:
    libraries = thread_limits._blas_thread_functions()
    before = [get() for get, _ in libraries]
    for _, put in libraries:
        put(2)
    try:
        with thread_limits.ALONE:
            assert {get() for get, _ in libraries} == {1}
            with thread_limits.ALONE:
                Cholesky.of(chain(30))
                assert {get() for get, _ in libraries} == {1}
        assert {get() for get, _ in libraries} <= {1, 2}  # 1 where the library has but one
    finally:
        for (_, put), threads in zip(libraries, before, strict=True):
            put(threads)
    assert [get() for get, _ in libraries] == before


def test_products_of_numpy_and_of_scipy_use_one_thread() -> None:
    """A wheel of numpy brings a BLAS of its own beside that of scipy; both must obey."""
    if np.show_config("dicts")["Build Dependencies"]["blas"]["name"] != "scipy-openblas":
        pytest.skip("numpy is built with another BLAS")
    assert len(thread_limits._blas_thread_functions()) == 2
