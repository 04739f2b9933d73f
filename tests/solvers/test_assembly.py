"""Assembly into a prepared pattern, and factorisation, against dense matrices."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy import sparse

from softmark.solvers.assembly import sparsity_patterns
from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.energies.elastic_energy import Elastic
from softmark.solvers.energies.external_loads import DeadForces, FollowerPressure
from softmark.solvers.linear import factorisations
from softmark.solvers.mesh.mesh import Mesh
from softmark.solvers.mesh.shapes import Box

MESH = Box((1.0, 0.6, 0.5)).mesh("tet4", 0.4)
FIXED = np.flatnonzero(np.repeat(MESH.points[:, 0] < 1e-9, 3))
X = np.random.default_rng(1).uniform(-0.05, 0.05, MESH.points.size)
NONE = np.zeros(0, dtype=np.int64)


@pytest.fixture
def energies(
    law: Callable[..., object], elastic: Callable[..., Elastic]
) -> tuple[Elastic, FollowerPressure, DeadForces]:
    f = np.random.default_rng(2).normal(size=X.size)
    return (
        elastic(MESH, law("neo_hookean")),
        FollowerPressure(MESH.points, MESH.faces[:9], 0.3),
        DeadForces(f),
    )


def dense(assembly: Assembly, x: np.ndarray, load: float) -> np.ndarray:
    """d gradient/dx by central differences: 1e-5^2 of the third derivative and 1e-16/1e-5 of round-off."""
    steps = 1e-5 * np.eye(x.size)
    return np.array([assembly.gradient(x + d, load) - assembly.gradient(x - d, load) for d in steps]).T / 2e-5


@pytest.mark.parametrize("fixed", [NONE, FIXED, FIXED[:1], np.arange(X.size - 1)], ids=["none", "face", "one", "most"])
def test_tangent_is_the_free_part_of_the_derivative(fixed: np.ndarray, energies: tuple) -> None:
    solid, pressure, dead = energies
    assembly = Assembly(X.size, fixed, [solid], [pressure, dead])
    K, free = assembly.tangent(X, 0.7), np.setdiff1d(np.arange(X.size), fixed)
    np.testing.assert_allclose(K.toarray(), dense(assembly, X, 0.7)[np.ix_(free, free)], atol=1e-8)
    assert K.has_canonical_format  # sorted, without duplicates: factorisation relies on it


def test_value_and_gradient_scale_loads_only(energies: tuple) -> None:
    solid, _, dead = energies
    assembly = Assembly(X.size, FIXED, [solid], [dead])
    assert assembly.value(X, 0.25) == pytest.approx(solid.value(X) + 0.25 * dead.value(X), rel=1e-14)
    g = np.zeros(X.size)
    solid.add_gradient(X, g)
    np.testing.assert_allclose(assembly.gradient(X, 0.25), g - 0.25 * dead.f, atol=1e-15)
    assert assembly.conservative


def test_follower_loads_are_never_asked_for_energy_without_load(energies: tuple) -> None:
    solid, pressure, _ = energies
    assembly = Assembly(X.size, FIXED, [solid], [pressure])
    assert not assembly.conservative
    assert assembly.value(X, 0.0) == solid.value(X)


def test_other_energies_on_the_same_stencils_share_the_pattern(
    energies: tuple, law: Callable[..., object], elastic: Callable[..., Elastic]
) -> None:
    solid, _, dead = energies
    assembly = Assembly(X.size, FIXED, [solid], [dead])
    twin = assembly.with_internal([elastic(MESH, law("corotational"))])
    assert twin.pattern is assembly.pattern
    fresh = Assembly(X.size, FIXED, twin.internal, [dead])
    np.testing.assert_array_equal(twin.tangent(X, 1.0).toarray(), fresh.tangent(X, 1.0).toarray())
    assert assembly.internal == (solid,)


def test_a_point_without_energy_leaves_an_empty_row(
    law: Callable[..., object], elastic: Callable[..., Elastic]
) -> None:
    """Its tangent is zero, which the factorisation then refuses by name rather than by numbers."""
    mesh = Mesh(np.concatenate((MESH.points, [[9.0, 9, 9]])), MESH.cells)
    assembly = Assembly(mesh.points.size, FIXED, [elastic(mesh, law("small"))], [])
    K = assembly.tangent(np.zeros(mesh.points.size), 1.0)
    assert K.shape == (mesh.points.size - len(FIXED),) * 2
    with pytest.raises(factorisations.Singular):
        factorisations.factor(K)


# ------------------------------------------------------------------ factorisation


def symmetric(seed: int, n: int = 40, negative: int = 0) -> np.ndarray:
    """A full symmetric matrix with that many negative eigenvalues, well away from zero."""
    rng = np.random.default_rng(seed)
    Q = np.linalg.qr(rng.normal(size=(n, n)))[0]
    return np.asarray((Q * np.where(np.arange(n) < negative, -1, 1) * rng.uniform(1, 10, n)) @ Q.T)


@pytest.mark.parametrize("negative", [0, 1, 2, 7, 39, 40])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_negative_pivots_are_negative_eigenvalues(negative: int, seed: int) -> None:
    """Sylvester's law of inertia; pivots on the diagonal, so solutions lose a few digits."""
    K, b = symmetric(seed, negative=negative), np.arange(40.0)
    factor = factorisations.factor(sparse.csr_matrix(K))
    assert factor.negative_pivots == negative
    np.testing.assert_allclose(K @ factor.solve(b), b, atol=1e-9)


def test_negative_pivots_of_a_stiffness(energies: tuple) -> None:
    """A neo-Hookean box squeezed until it buckles: as many as its dense matrix has negative eigenvalues."""
    assembly = Assembly(X.size, FIXED, [energies[0]], [])
    x = (MESH.points * [-0.55, 0.2, 0.2]).ravel()
    K = assembly.tangent(x, 1.0)
    negative = int(np.sum(np.linalg.eigvalsh(K.toarray()) < 0))
    assert negative > 0
    assert factorisations.factor(K).negative_pivots == negative


def test_a_matrix_that_is_not_symmetric_is_solved(energies: tuple) -> None:
    solid, pressure, _ = energies
    K = Assembly(X.size, FIXED, [solid], [pressure]).tangent(X, 1.0)
    b = np.arange(float(K.shape[0]))
    assert np.abs(K - K.T).max() > 1e-3
    np.testing.assert_allclose(K @ factorisations.factor(K, symmetric=False).solve(b), b, atol=1e-10)


@pytest.mark.parametrize("bad", [0.0, np.nan, np.inf])
def test_what_cannot_be_factorised_is_singular(bad: float) -> None:
    K = np.eye(5)
    K[2, 2] = bad
    with pytest.raises(factorisations.Singular):
        factorisations.factor(sparse.csr_matrix(K))


# ------------------------------------------------------------------ patterns


def by_hand(size: int, number: np.ndarray, stencils: list[np.ndarray], values: list[np.ndarray]) -> sparse.csr_matrix:
    """Local matrices as triplets, which scipy sums."""
    rows, columns, entries = [], [], []
    for stencil, local in zip(stencils, values, strict=True):
        r, c = np.broadcast_arrays(number[stencil][:, :, None], number[stencil][:, None, :])
        keep = (r >= 0) & (c >= 0)
        rows.append(r[keep]), columns.append(c[keep]), entries.append(local[keep])
    triplets = (np.concatenate(entries), (np.concatenate(rows), np.concatenate(columns)))
    return sparse.csr_matrix(triplets, shape=(size, size))


@pytest.mark.parametrize("blocks", [False, True], ids=["single", "threes"])
@pytest.mark.parametrize("held", [0, 1, 25, 88])
def test_a_pattern_takes_every_entry_to_its_place(held: int, blocks: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Random stencils of two kinds, with unknowns held here and there, against scipy's own sums: the same triplets."""
    monkeypatch.setattr(sparsity_patterns, "PAIRS", 50)  # in several goes
    rng = np.random.default_rng(held)
    dofs, stencils = 90, []
    for count, wide in ((40, 4), (15, 2)):
        nodes = np.array([rng.permutation(30 if blocks else dofs)[:wide] for _ in range(count)])
        stencils.append((3 * nodes[:, :, None] + np.arange(3)).reshape(count, -1) if blocks else nodes)
    fixed = rng.permutation(dofs)[:held]
    free = np.setdiff1d(np.arange(dofs), fixed)
    number = np.full(dofs, -1)
    number[free] = np.arange(len(free))
    values = [rng.normal(size=(*s.shape, s.shape[1])) for s in stencils]
    pattern = sparsity_patterns.build_pattern(dofs, fixed, stencils)
    data = np.zeros(len(pattern.indices))
    for slots, local in zip(pattern.slots, values, strict=True):
        np.add.at(data, slots[slots >= 0], local[slots >= 0])
    K, exact = pattern.matrix(data), by_hand(len(free), number, stencils, values)
    assert K.has_canonical_format
    assert K.nnz == exact.nnz  # no place is made that no stencil touches
    np.testing.assert_allclose(K.toarray(), exact.toarray(), atol=1e-14 * 40)
