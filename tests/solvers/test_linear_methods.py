"""Each method against a dense solution, which of them is chosen, and what happens where one cannot be used."""

from __future__ import annotations

import gc
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import sparse

import softmark
from softmark import resource_limits as memory
from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.energies.elastic_energy import Elastic
from softmark.solvers.linear import factorisations, symbolic_cache
from softmark.solvers.materials import Law
from softmark.solvers.mesh.element_interpolation import integrate_cells
from softmark.solvers.mesh.shapes import Box
from softmark.solvers.sparse import multigrid, pardiso, symbolic_factorization
from softmark.solvers.sparse.rigid_body_modes import positions_from_modes, rigid_motions

Maker = Callable[..., Law]
PACKAGES = {"pardiso": "pypardiso", "multigrid": "pyamg"}


def block(law: Law, size: float = 0.05, held: tuple[int, ...] = (0, 1, 2)) -> Assembly:
    """A block of 0.2 x 0.1 x 0.1 m that is held at one end, in the directions given."""
    mesh = Box((0.2, 0.1, 0.1)).mesh("tet4", size)
    parts = integrate_cells(mesh)
    end = np.flatnonzero(mesh.points[:, 0] <= 1e-9)
    fixed = np.unique((3 * end[:, None] + np.array(held)).ravel())
    elastic = Elastic(mesh.cells, parts.dNdX, parts.w, law)
    return Assembly(mesh.points.size, fixed, [elastic], [], mesh.points)


def tangent(assembly: Assembly) -> sparse.csr_matrix:
    """At rest."""
    return assembly.tangent(np.zeros(assembly.dofs), 1.0)


@pytest.fixture(autouse=True)
def levels(monkeypatch: pytest.MonkeyPatch) -> None:
    """Multigrid has more than one level in small systems too, which it would solve by a factor."""
    monkeypatch.setitem(multigrid.OPTIONS, "max_coarse", 20)


def needs(method: str) -> None:
    """Skip where the method's package is not there, or finds no library."""
    if method in PACKAGES and not (pardiso if method == "pardiso" else multigrid).is_installed():
        pytest.skip(f"{PACKAGES[method]} is not there")


@pytest.mark.parametrize("method", ["superlu", "cholesky", "pardiso", "multigrid"])
@pytest.mark.parametrize("poisson", [0.3, 0.45])
def test_each_method_agrees_with_a_dense_solution(method: str, poisson: float, law: Maker) -> None:
    """The condition number is some 1e4: a residual of 1e-10 leaves an error below 1e-6, rounding one below 1e-11."""
    needs(method)
    assembly = block(law("small", 6e4, poisson))
    K = tangent(assembly)
    b = np.random.default_rng(1).normal(size=K.shape[0])
    factor = factorisations.factor(K, method=method, modes=assembly.rigid_body_modes)  # type: ignore[arg-type]  # a str
    x, exact = factor.solve(b), np.linalg.solve(K.toarray(), b)
    error = np.linalg.norm(x - exact) / np.linalg.norm(exact)
    assert error <= (1e-6 if factor.tolerance else 1e-11)
    assert np.linalg.norm(b - K @ x) <= max(factor.tolerance, 1e-11) * np.linalg.norm(b)
    assert factor.negative_pivots == (None if method == "multigrid" else 0)


def test_single_precision_is_refined(law: Maker) -> None:
    assembly = block(law("small", 6e4, 0.3))
    K = tangent(assembly)
    b = np.random.default_rng(1).normal(size=K.shape[0])
    for scale in (1e-30, 1.0, 1e30):  # single precision would overflow
        factor = factorisations.factor(K, method="cholesky", precision="single", modes=assembly.rigid_body_modes)
        assert factor.name == factorisations.SINGLE
        assert np.linalg.norm(scale * b - K @ factor.solve(scale * b)) <= 1e-10 * scale * np.linalg.norm(b)
    np.testing.assert_array_equal(factor.solve(0.0 * b), 0.0 * b)


@pytest.mark.parametrize("method", ["superlu", "cholesky", "pardiso"])
@pytest.mark.parametrize("negative", [2, 3, 17])
def test_negative_pivots_are_counted(method: str, negative: int, law: Maker) -> None:
    """Sylvester's law, against dense eigenvalues; what is lost by pivots that are not chosen is refined.

    Not one: the block bends alike in two directions, and its two lowest eigenvalues are equal.
    """
    needs(method)
    K = tangent(block(law("small", 6e4, 0.3)))
    shift = np.sort(np.linalg.eigvalsh(K.toarray()))[negative - 1 : negative + 1].mean()
    K = sparse.csr_matrix(K - shift * sparse.identity(K.shape[0]))
    factor = factorisations.factor(K, method=method)  # type: ignore[arg-type]
    assert factor.negative_pivots == negative
    b = np.random.default_rng(1).normal(size=K.shape[0])
    np.testing.assert_allclose(K @ factor.solve(b), b, atol=1e-8)


@pytest.mark.parametrize("method", ["superlu", "pardiso"])
def test_a_matrix_that_is_not_symmetric(method: str, law: Maker) -> None:
    needs(method)
    K = tangent(block(law("small", 6e4, 0.3)))
    K.data *= np.random.default_rng(1).uniform(0.9, 1.1, K.nnz)
    b = np.ones(K.shape[0])
    factor = factorisations.factor(K, symmetric=False, method=method)  # type: ignore[arg-type]
    x = np.linalg.solve(K.toarray(), b)
    np.testing.assert_allclose(factor.solve(b), x, atol=1e-9 * np.abs(x).max())
    with pytest.raises(factorisations.Singular, match="not symmetric"):
        factorisations.factor(K, symmetric=False, method="cholesky")


@pytest.mark.parametrize("method", ["superlu", "cholesky"])
def test_a_row_of_zeros_is_singular(method: str) -> None:
    K = sparse.csr_matrix(np.diag([1.0, 0.0, 2.0]) + 0.0)
    K = sparse.csr_matrix((np.array([1.0, 0.0, 2.0]), [0, 1, 2], [0, 1, 2, 3]), shape=(3, 3))
    with pytest.raises(factorisations.Singular):
        factorisations.factor(K, method=method)  # type: ignore[arg-type]


def test_iterations_that_do_not_get_there_say_so(monkeypatch: pytest.MonkeyPatch, law: Maker) -> None:
    needs("multigrid")
    monkeypatch.setattr(multigrid, "BUDGET", 2)
    assembly = block(law("small", 6e4, 0.3), 0.025)
    factor = factorisations.factor(tangent(assembly), method="multigrid", modes=assembly.rigid_body_modes)
    with pytest.raises(factorisations.Unsolved, match="residual"):
        factor.solve(np.ones(len(assembly.free)))


# ------------------------------------------------------------------ which one


@pytest.fixture
def large(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every matrix counts as large."""
    monkeypatch.setattr(factorisations, "LARGE", 0)


@pytest.mark.usefixtures("large")
def test_multigrid_takes_over_where_a_factor_takes_longer(monkeypatch: pytest.MonkeyPatch, law: Maker) -> None:
    needs("multigrid")
    assembly = block(law("small", 6e4, 0.3))
    K = tangent(assembly)
    assert factorisations.factor(K, modes=assembly.rigid_body_modes).name == factorisations.CHOLESKY
    monkeypatch.setattr(factorisations, "LONG", 0.0)
    factor = factorisations.factor(K, modes=assembly.rigid_body_modes)
    assert factor.name == multigrid.NAME
    assert factorisations.factor(K).name == factorisations.CHOLESKY  # nobody knows how the body moves
    monkeypatch.setattr(multigrid, "BUDGET", 1)  # and what does not converge is factorised
    b = np.ones(K.shape[0])
    np.testing.assert_allclose(K @ factor.solve(b), b, atol=1e-10)
    monkeypatch.setattr(multigrid, "is_installed", lambda: False)
    assert factorisations.factor(K, modes=assembly.rigid_body_modes).name == factorisations.CHOLESKY


@pytest.mark.usefixtures("large")
def test_no_factor_is_begun_that_memory_does_not_hold(monkeypatch: pytest.MonkeyPatch, law: Maker) -> None:
    """By how much is left: double precision, single, multigrid or a clear refusal."""
    assembly = block(law("small", 6e4, 0.3))
    K = tangent(assembly)
    double = symbolic_cache.cached_pattern(K).sketch.bytes(8) / factorisations.SHARE
    monkeypatch.setattr(factorisations, "LITTLE", 0.0)  # which memory is not asked for
    monkeypatch.setattr(multigrid, "is_installed", lambda: False)
    for left, name in ((1.1 * double, factorisations.CHOLESKY), (0.6 * double, factorisations.SINGLE)):
        monkeypatch.setattr(memory, "available_memory", lambda left=left: left)
        assert factorisations.factor(K, modes=assembly.rigid_body_modes).name == name
    monkeypatch.setattr(memory, "available_memory", lambda: 0.4 * double)
    with pytest.raises(factorisations.TooLarge, match=r"softmark\[fast\]"):
        factorisations.factor(K, modes=assembly.rigid_body_modes)
    monkeypatch.undo()
    needs("multigrid")
    monkeypatch.setattr(factorisations, "LARGE", 0)
    monkeypatch.setattr(factorisations, "LITTLE", 0.0)
    monkeypatch.setattr(memory, "available_memory", lambda: 0.4 * double)
    assert factorisations.factor(K, modes=assembly.rigid_body_modes).name == multigrid.NAME
    with pytest.raises(factorisations.TooLarge, match="use `linear = multigrid`"):
        factorisations.factor(K, method="cholesky", modes=assembly.rigid_body_modes)


@pytest.mark.parametrize("method", PACKAGES)
def test_what_is_not_installed_is_named(method: str, monkeypatch: pytest.MonkeyPatch, law: Maker) -> None:
    monkeypatch.setattr(multigrid, "is_installed", lambda: False)
    monkeypatch.setattr(pardiso, "is_packaged", lambda: False)
    with pytest.raises(factorisations.NotInstalled, match=PACKAGES[method]):
        factorisations.factor(tangent(block(law("small", 6e4, 0.3))), method=method)  # type: ignore[arg-type]


STUB = """
def missing():
    raise ImportError("Shared library mkl_rt not found. Use environment variable PYPARDISO_MKL_RT to provide a path.")

class PyPardisoSolver:
    def __init__(self):
        missing()
"""


@pytest.fixture(params=["at its import", "later", "in its library"])
def unfound(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[None]:
    """A package pypardiso that does not find its library, or one of its kind without the routine."""
    library = "ctypes.CDLL(None)" if sys.platform != "win32" else "None"
    works = f"""
import ctypes

class PyPardisoSolver:
    def __init__(self):
        self.libmkl = {library}
        self.libmkl._name = "no such library"
"""
    source = works if request.param == "in its library" else STUB
    (tmp_path / "pypardiso.py").write_text(source + ("\nmissing()\n" if request.param == "at its import" else ""))
    gc.collect()  # factors that others have left, which the library itself must release
    monkeypatch.delitem(sys.modules, "pypardiso", raising=False)
    monkeypatch.syspath_prepend(str(tmp_path))
    for found in (pardiso.missing_reason, pardiso._pardiso_function):
        found.cache_clear()
    yield
    sys.modules.pop("pypardiso", None)
    for found in (pardiso.missing_reason, pardiso._pardiso_function):
        found.cache_clear()


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.usefixtures("unfound")
@pytest.mark.parametrize("symmetric", [True, False])
def test_pardiso_without_its_library_gives_way(symmetric: bool, law: Maker, monkeypatch: pytest.MonkeyPatch) -> None:
    """Asked for or not: K x = b is solved to 1e-12 by a factor that has its own name."""
    monkeypatch.setattr(factorisations, "LARGE", 0)
    K = tangent(block(law("small", 6e4, 0.3)))
    b = np.linspace(1.0, 2.0, K.shape[0])
    for method in ("pardiso", "auto"):
        made = factorisations.factor(K, symmetric, method)  # type: ignore[arg-type]
        assert made.name != pardiso.NAME
        assert np.linalg.norm(K @ made.solve(b) - b) <= 1e-12 * np.linalg.norm(b)


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.usefixtures("unfound")
def test_a_model_without_pardisos_library_says_what_solved_it() -> None:
    """It ended in an ImportError."""
    report = softmark.loads("""
        material gel = linear_elastic(young = 6 MPa, poisson = 0.3, density = 1000 kg/m^3)
        body bar = solid(box(size = (20, 10, 10) mm), gel)
        support wall = fixed(bar, where = x <= 0 mm)
        load weight = gravity(9.81 m/s^2)
        model cells = fem(hex8, strain = small, size = 5 mm, linear = pardiso)
        probe tip = point(bar, at = (20, 10, 10) mm)
    """).run()
    found = report.models["cells"]
    assert found.status == "converged"
    assert found.message is not None
    assert "was not found" in found.message
    assert str(found.solve["linear_solver"]) in found.message


def test_what_memory_there_is() -> None:
    """More than a page, less than a petabyte, or unknown."""
    assert 4096 < memory.available_memory() < 1e15 or memory.available_memory() == float("inf")


# ------------------------------------------------------------------ motions and dissection


def test_rigid_motions_cause_no_force(law: Maker) -> None:
    """Of a free body, K R = 0 to rounding of the largest entries."""
    mesh = Box((0.2, 0.1, 0.1), (3.0, 1.0, 2.0)).mesh("tet4", 0.05)
    parts = integrate_cells(mesh)
    elastic = Elastic(mesh.cells, parts.dNdX, parts.w, law("small", 6e4, 0.3))
    assembly = Assembly(mesh.points.size, np.zeros(0, np.int64), [elastic], [], mesh.points)
    motions: Any = assembly.rigid_body_modes()
    assert np.abs(tangent(assembly) @ motions).max() <= 1e-12 * abs(tangent(assembly)).max()
    assert np.linalg.matrix_rank(motions) == 6


@pytest.mark.parametrize("held", [(), (0,), (0, 2)])
def test_places_are_read_from_motions(held: tuple[int, ...]) -> None:
    """Up to the scale, wherever the unknowns that a node has left tell them: with one left, one coordinate is lost."""
    points = np.random.default_rng(1).uniform(-1, 1, (9, 3))
    points -= points.mean(axis=0)
    free = np.setdiff1d(np.arange(27), 3 * 4 + np.array(held, dtype=int))
    start = np.concatenate([[0], np.cumsum(np.bincount(free // 3, minlength=9))])
    found = positions_from_modes(rigid_motions(points, free), start) * np.abs(points).max()
    expected = points.copy()
    if len(held) == 2:
        expected[4, 1] = 0.0
    np.testing.assert_allclose(found, expected, atol=1e-14)


def test_a_dissected_system_is_solved(monkeypatch: pytest.MonkeyPatch, law: Maker) -> None:
    """The order changes rounding alone; separators come last, so that the halves do not touch."""
    monkeypatch.setattr(symbolic_factorization, "DISSECTED", 0)
    monkeypatch.setattr(symbolic_factorization, "LARGE", 0)
    monkeypatch.setattr("softmark.solvers.sparse.ordering.LEAF", 30)
    assembly = block(law("small", 6e4, 0.3), 0.025)
    K = tangent(assembly)
    plan = symbolic_factorization.analyse(K, assembly.rigid_body_modes())
    np.testing.assert_array_equal(np.sort(plan.order), np.arange(K.shape[0]))
    b = np.random.default_rng(1).normal(size=K.shape[0])
    x = factorisations.factor(K, method="cholesky", modes=assembly.rigid_body_modes).solve(b)
    np.testing.assert_allclose(K @ x, b, atol=1e-10)


@pytest.mark.parametrize("held", [(0, 1, 2), (0,)], ids=["clamped", "one direction"])
def test_multigrid_on_some_thousand_unknowns(held: tuple[int, ...], law: Maker) -> None:
    """Blocks of three unknowns, or single ones where nodes are held in part; some ten iterations, not hundreds."""
    needs("multigrid")
    assembly = block(law("small", 6e4, 0.3), 0.0125, held)
    K = tangent(assembly)
    if held == (0,):  # it may slide and turn: held by a little mass
        K.setdiag(K.diagonal() + 1e-3 * K.diagonal().mean())
    factor: Any = factorisations.factor(K, method="multigrid", modes=assembly.rigid_body_modes)
    b = np.ones(K.shape[0])
    assert np.linalg.norm(K @ factor.solve(b) - b) <= 1e-9 * np.linalg.norm(b)
    assert factor.multigrid.iterations <= 60
