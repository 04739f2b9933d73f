"""Reduced spaces and sampled cells: orthonormal fields, energies whose gradients are theirs, forces from few cells."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.dynamics.mass_matrices import consistent_mass, mass_shapes_and_volumes
from softmark.solvers.elements import ELEMENTS
from softmark.solvers.energies import element_corotational
from softmark.solvers.energies.corotational_tets import CorotationalTets
from softmark.solvers.energies.elastic_energy import Elastic, EnergySum
from softmark.solvers.energies.element_corotational import ElementCorotational
from softmark.solvers.energies.energy import Energy, VectorSpace
from softmark.solvers.energies.external_loads import DeadForces, FollowerPressure
from softmark.solvers.linear.factorisations import Singular, factor
from softmark.solvers.materials import MATERIALS, law_for
from softmark.solvers.materials.polar_decomposition import rotations
from softmark.solvers.mesh.element_interpolation import integrate_cells, mean_gradients
from softmark.solvers.mesh.mesh import Mesh
from softmark.solvers.mesh.shapes import Box
from softmark.solvers.model_reduction.cell_energies import (
    disconnect_cells,
    nodes_of_cells,
    restrict_to_cells,
    restrict_to_loaded_nodes,
)
from softmark.solvers.model_reduction.hyperreduction import fit_nonnegative, sample_cells
from softmark.solvers.model_reduction.projected_energy import DenseSolver, ProjectedEnergy, QuadraticEnergy
from softmark.solvers.model_reduction.reduced_basis import (
    modal_derivatives,
    orthonormalize,
    principal_fields,
    vibration_modes,
)
from softmark.solvers.statics.static_equilibrium import Statics, equilibrium

NONE = np.zeros(0, dtype=np.int64)
LAWS = ("small", "corotational", "neo_hookean")


def block(kind: str = "tet4") -> Mesh:
    return Box((2.0, 1.0, 1.0)).mesh(kind, 0.5)


def held(mesh: Mesh) -> np.ndarray:
    """Degrees of freedom of the end at the least x, which supports hold."""
    nodes = np.flatnonzero(mesh.points[:, 0] <= mesh.points[:, 0].min() + 1e-9)
    return (3 * nodes[:, None] + np.arange(3)).ravel()


def free(mesh: Mesh) -> np.ndarray:
    return np.setdiff1d(np.arange(mesh.points.size), held(mesh))


def mass(mesh: Mesh) -> sparse.csr_matrix:
    N, w = mass_shapes_and_volumes(mesh.points, mesh.cells, mesh.element)
    return consistent_mass(mesh.cells, N, w, 1.0, len(mesh.points)).tocsr()


def energies(mesh: Mesh) -> dict[str, Energy]:
    """Every kind of energy over cells."""
    parts, middle = integrate_cells(mesh), mean_gradients(mesh)
    soft = law_for(MATERIALS["linear_elastic"](1.0, 0.3, 1.0), "corotational")
    A = law_for(MATERIALS["linear_elastic"](1.0, 0.3, 1.0), "small").dPdF(np.eye(3)[None])[0]
    one = Elastic(mesh.cells, parts.dNdX, parts.w, soft)
    K, G = (
        element_corotational.element_stiffness(parts.dNdX, parts.w, A),
        element_corotational.mean_gradients(parts.dNdX, parts.w),
    )
    found: dict[str, Energy] = {
        "points": one,
        "together": EnergySum((one, Elastic(mesh.cells, middle.dNdX, middle.w, soft))),
        "turned cells": ElementCorotational(mesh.points, mesh.cells, G, K, rotations),
    }
    if mesh.kind == "tet4":
        found["tetrahedra"] = CorotationalTets(mesh.cells, parts.dNdX, parts.w, soft)
    return found


def gradient(energy: Energy, x: np.ndarray) -> np.ndarray:
    g = np.zeros_like(x)
    energy.add_gradient(x, g)
    return g


def stiffness(mesh: Mesh, energy: Energy) -> sparse.csr_matrix:
    return Assembly(mesh.points.size, held(mesh), [energy], []).tangent(np.zeros(mesh.points.size), 0.0)


def fields(mesh: Mesh, energy: Energy, count: int) -> np.ndarray:
    """The lowest modes over all degrees of freedom."""
    M = mass(mesh)[free(mesh)][:, free(mesh)]
    V = np.zeros((mesh.points.size, count))
    V[free(mesh)] = vibration_modes(stiffness(mesh, energy), M, count)[1]
    return V


# ------------------------------------------------------------------ the space


def test_fields_are_orthonormal_in_the_mass_and_dependent_ones_are_left_out() -> None:
    """Columns of size 1 in 60 unknowns: rounding is some 1e-15 of them, after the second pass."""
    random = np.random.default_rng(0)
    S = random.standard_normal((60, 8))
    S[:, 5] = S[:, 0] - 2.0 * S[:, 3]
    M = sparse.diags(random.uniform(0.1, 10.0, 60)).tocsr()
    Q, R = orthonormalize(S, M)
    assert Q.shape == (60, 7)
    np.testing.assert_allclose(Q.T @ (M @ Q), np.eye(7), atol=1e-13)
    np.testing.assert_allclose(Q @ R, S, atol=1e-13)


def test_principal_fields_hold_what_the_singular_values_say() -> None:
    """With the identity for a mass: the singular value decomposition of LAPACK, to rounding."""
    S = np.random.default_rng(1).standard_normal((30, 6)) * 10.0 ** -np.arange(6)
    s = np.linalg.svd(S, compute_uv=False)
    found = principal_fields(S, sparse.identity(30, format="csr"), 3, 0.0)
    assert found.captured == pytest.approx(np.sum(s[:3] ** 2) / np.sum(s**2), rel=1e-12)
    rest = S - found.V @ (found.V.T @ S)
    assert found.error == pytest.approx(np.max(np.linalg.norm(rest, axis=0) / np.linalg.norm(S, axis=0)), rel=1e-9)
    # the root mean square of what is left is the tolerance's: no more fields than that needs
    enough = principal_fields(S, sparse.identity(30, format="csr"), None, 1e-2)
    r = enough.V.shape[1]
    assert np.sum(s[r:] ** 2) <= 1e-4 * np.sum(s**2) < np.sum(s[r - 1 :] ** 2)


@pytest.mark.parametrize("size", [0.5, 0.25])
def test_modes_are_those_of_a_dense_solver(size: float) -> None:
    """Both ways of finding modes, against LAPACK on the whole matrices; Lanczos iteration stops at rounding."""
    mesh = Box((2.0, 1.0, 1.0)).mesh("tet4", size)
    energy = energies(mesh)["points"]
    K, M = stiffness(mesh, energy), mass(mesh)[free(mesh)][:, free(mesh)]
    omega, modes = vibration_modes(K, M, 5)
    exact = np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(M.toarray(), K.toarray())).real)[:5])
    np.testing.assert_allclose(omega, exact, rtol=1e-8)
    np.testing.assert_allclose(modes.T @ (M @ modes), np.eye(5), atol=1e-9)


def test_a_modal_derivative_is_the_second_derivative_of_the_response() -> None:
    """Static states under f = a K v bend as a v + a^2/2 theta, theta = -K^-1 D^2 g [v, v]: error of order a^3."""
    mesh = block()
    energy, at = energies(mesh)["tetrahedra"], free(mesh)
    K = stiffness(mesh, energy)
    v = fields(mesh, energy, 1)
    v /= np.abs(v).max()

    def inner(u: np.ndarray) -> np.ndarray:
        x = np.zeros(mesh.points.size)
        x[at] = u
        return gradient(energy, x)[at]

    theta = modal_derivatives(inner, factor(K).solve, v[at], 1.0)[:, 0]
    f = np.zeros(mesh.points.size)
    f[at] = K @ v[at, 0]
    errors = []
    for a in (0.02, 0.01):
        assembly = Assembly(f.size, held(mesh), [energy], [DeadForces(a * f)])
        x = equilibrium(Statics(assembly, VectorSpace(f.size), np.zeros(f.size), held(mesh), np.zeros(len(held(mesh)))))
        errors.append(np.linalg.norm(x.x[at] - a * v[at, 0] - 0.5 * a**2 * theta))
    assert errors[0] / errors[1] == pytest.approx(8.0, rel=0.1)  # the next order adds some a = 2 %


# ------------------------------------------------------------------ cells


@pytest.mark.parametrize("kind", ELEMENTS)
def test_cells_apart_add_up_and_all_cells_are_the_whole(kind: str) -> None:
    """The same sums in another order: rounding of forces of order 1e-2."""
    mesh = block(kind)
    x = 0.05 * np.random.default_rng(2).standard_normal(mesh.points.size)
    for energy in energies(mesh).values():
        cells = nodes_of_cells(energy)
        split = gradient(disconnect_cells(energy), x.reshape(-1, 3)[cells].ravel())
        total = np.zeros((len(mesh.points), 3))
        np.add.at(total, cells.ravel(), split.reshape(-1, 3))
        np.testing.assert_allclose(total.ravel(), gradient(energy, x), atol=1e-14)
        every = restrict_to_cells(energy, np.arange(len(cells)), np.ones(len(cells)), np.arange(len(mesh.points)))
        np.testing.assert_array_equal(gradient(every, x), gradient(energy, x))


@pytest.mark.parametrize("kind", ["tet4", "hex8"])
def test_a_part_is_the_weighted_sum_of_its_cells(kind: str) -> None:
    """Against the forces of the cells apart; rounding of forces of order 1e-2."""
    mesh = block(kind)
    x = 0.05 * np.random.default_rng(3).standard_normal(mesh.points.size)
    which, weights = np.array([1, 4, 6]), np.array([2.0, 0.5, 3.0])
    nodes = np.unique(mesh.cells[which])
    for energy in energies(mesh).values():
        split = gradient(disconnect_cells(energy), x.reshape(-1, 3)[mesh.cells].ravel()).reshape(*mesh.cells.shape, 3)
        total = np.zeros((len(mesh.points), 3))
        np.add.at(total, mesh.cells[which], weights[:, None, None] * split[which])
        some = restrict_to_cells(energy, which, weights, nodes)
        found = gradient(some, x.reshape(-1, 3)[nodes].ravel())
        np.testing.assert_allclose(found, total[nodes].ravel(), atol=1e-14)


def test_a_pressure_over_its_own_nodes_is_the_pressure() -> None:
    mesh = block()
    top = mesh.facets[(mesh.points[mesh.facets][:, :, 2] >= mesh.points[:, 2].max() - 1e-9).all(axis=1)]
    load = FollowerPressure(mesh.points, top, 3.0)
    x = 0.05 * np.random.default_rng(4).standard_normal(mesh.points.size)
    own, nodes = restrict_to_loaded_nodes(load)
    whole = gradient(load, x).reshape(-1, 3)
    np.testing.assert_allclose(gradient(own, x.reshape(-1, 3)[nodes].ravel()).reshape(-1, 3), whole[nodes], atol=1e-15)
    assert len(nodes) < len(mesh.points)


# ------------------------------------------------------------------ energies in the space


@pytest.mark.parametrize("name", ["points", "together", "tetrahedra"])
def test_a_projected_energy_has_its_gradient_and_its_tangent(name: str) -> None:
    """Central differences with h = 1e-5: h^2 = 1e-10 of numbers of order 1, rounding 1e-16 / h = 1e-11."""
    mesh = block()
    energy = energies(mesh)[name]
    V = fields(mesh, energy, 4)
    reduced = ProjectedEnergy(energy, V)
    assembly = Assembly(4, NONE, [reduced], [])
    q, h = np.array([0.05, -0.03, 0.02, 0.01]), 1e-5
    steps = h * np.eye(4)
    slopes = [(reduced.value(q + e) - reduced.value(q - e)) / (2 * h) for e in steps]
    np.testing.assert_allclose(assembly.gradient(q, 0.0), slopes, rtol=1e-7, atol=1e-9)
    rows = [(gradient(reduced, q + e) - gradient(reduced, q - e)) / (2 * h) for e in steps]
    np.testing.assert_allclose(assembly.tangent(q, 0.0).toarray(), rows, rtol=1e-6, atol=1e-8)


def test_a_space_of_all_unknowns_is_the_full_problem() -> None:
    """Both are solved to a residual of 1e-10; in the norm of displacements that is below 1e-8."""
    mesh = Box((2.0, 1.0, 1.0)).mesh("tet4", 1.0)
    energy = energies(mesh)["tetrahedra"]
    f = np.zeros_like(mesh.points)
    f[:, 2] = -2e-4
    load, n = DeadForces(f.ravel()), mesh.points.size
    zero = np.zeros(len(held(mesh)))
    full = equilibrium(Statics(Assembly(n, held(mesh), [energy], [load]), VectorSpace(n), np.zeros(n), held(mesh), zero,
                               1e-10))  # fmt: skip
    r = len(free(mesh))
    V = fields(mesh, energy, r)
    assembly = Assembly(r, NONE, [ProjectedEnergy(energy, V)], [DeadForces(load.f @ V)])
    found = equilibrium(Statics(assembly, VectorSpace(r), np.zeros(r), NONE, np.zeros(0), 1e-10))
    assert np.abs(full.x).max() > 1e-3
    np.testing.assert_allclose(V @ found.x, full.x, atol=1e-8 * np.abs(full.x).max())


def test_a_linear_body_is_its_small_matrix() -> None:
    """Energy, force and tangent of q K q / 2 by hand: K = [[2, 1], [1, 3]], q = (1, 2) give 9, (4, 7), K."""
    energy = QuadraticEnergy(np.array([[2.0, 1.0], [1.0, 3.0]]))
    q = np.array([1.0, 2.0])
    assert energy.value(q) == 9.0
    np.testing.assert_array_equal(gradient(energy, q), [4.0, 7.0])
    tangent = Assembly(2, NONE, [energy], []).tangent(q, 0.0).toarray()
    np.testing.assert_array_equal(tangent, energy.K)


def test_small_systems_are_solved_densely_and_singular_ones_refused() -> None:
    K = sparse.csr_matrix(np.array([[2.0, 1.0], [1.0, 3.0]]))
    np.testing.assert_allclose(DenseSolver().solve(K, np.array([4.0, 7.0]), 0.0), [1.0, 2.0], rtol=1e-15)
    with pytest.raises(Singular):
        DenseSolver().solve(sparse.csr_matrix(np.ones((2, 2))), np.ones(2), 0.0)


# ------------------------------------------------------------------ sampled cells


def test_weights_are_not_negative_and_meet_the_tolerance() -> None:
    """A random problem with a solution of positive weights, all 1; fewer columns than rows do for 5 %."""
    G = np.random.default_rng(5).uniform(-0.5, 1.0, (40, 300))
    b = G.sum(axis=1)
    for tolerance in (0.05, 1e-6):
        w, error = fit_nonnegative(G, b, tolerance)
        assert (w >= 0).all()
        assert np.linalg.norm(G @ w - b) <= tolerance * np.linalg.norm(b)
        assert error == pytest.approx(np.linalg.norm(G @ w - b) / np.linalg.norm(b), rel=1e-6, abs=1e-12)
        assert np.count_nonzero(w) <= 40  # as many as rows (Caratheodory)


def test_what_no_weights_can_give_is_told_by_its_error() -> None:
    """Both columns point away from b: nothing is chosen, and all of b is left."""
    w, error = fit_nonnegative(np.array([[-1.0, -2.0], [0.0, 1e-3]]), np.array([1.0, 0.0]), 1e-3)
    assert not w.any()
    assert error == 1.0


@pytest.mark.parametrize("kind", ["tet4", "hex8"])
@pytest.mark.parametrize("tolerance", [0.05, 0.005])
def test_sampled_cells_give_the_forces_of_all(kind: str, tolerance: float) -> None:
    """Forces in every training state, weighed as in `sample` by the stiffness there: root of blocks times tolerance."""
    mesh = Box((2.0, 1.0, 1.0)).mesh(kind, 0.25)
    energy = energies(mesh)["tetrahedra" if kind == "tet4" else "points"]
    V = fields(mesh, energy, 4)
    q = np.array([[0.1, 0.0, 0.02, 0.0], [0.2, 0.1, 0.03, 0.01]])
    found = sample_cells([energy], V, q @ V.T, mesh.extent, tolerance)
    assert (found.weights > 0).all()
    assert len(found.cells) < 0.2 * len(mesh.cells)
    assert found.error <= tolerance
    nodes = np.unique(mesh.cells[found.cells])
    rows = V.reshape(-1, 3, 4)[nodes].reshape(-1, 4)
    few = ProjectedEnergy(restrict_to_cells(energy, found.cells, found.weights, nodes), rows)
    all_cells = ProjectedEnergy(energy, V)
    exact, near = (Assembly(4, NONE, [e], []) for e in (all_cells, few))
    for state in q:
        K = exact.tangent(state, 0.0).toarray()
        off, size = (np.linalg.norm(np.linalg.solve(K, f)) for f in (
            near.gradient(state, 0.0) - exact.gradient(state, 0.0), exact.gradient(state, 0.0)))  # fmt: skip
        assert off <= np.sqrt(3.0) * tolerance * size * 1.001  # differences behind the fit are good to 1e-5
    # at rest the stiffness is close to that of all cells, so it is definite
    K0, near0 = exact.tangent(np.zeros(4), 0.0).toarray(), near.tangent(np.zeros(4), 0.0).toarray()
    ratios = np.linalg.eigvals(np.linalg.solve(K0, near0)).real
    assert np.abs(ratios - 1.0).max() <= np.sqrt(3.0 * 4.0) * tolerance * 1.001


@pytest.mark.parametrize("name", LAWS)
def test_a_training_state_is_found_again_from_few_cells(name: str, law: Callable[..., object]) -> None:
    """Tolerance 1 %: the state moves by about that, twice that for what the linear estimate leaves out."""
    mesh = Box((2.0, 1.0, 1.0)).mesh("hex8", 0.25)
    parts = integrate_cells(mesh)
    energy = Elastic(mesh.cells, parts.dNdX, parts.w, law(name))  # type: ignore[arg-type]
    V = fields(mesh, energy, 6)
    f = np.zeros_like(mesh.points)
    f[:, 2] = -1e-5
    load, r = DeadForces(f.ravel() @ V), V.shape[1]
    statics = Statics(
        Assembly(r, NONE, [ProjectedEnergy(energy, V)], [load]), VectorSpace(r), np.zeros(r), NONE, np.zeros(0)
    )
    exact = equilibrium(statics).x
    found = sample_cells([energy], V, (V @ exact)[None], mesh.extent, 0.01)
    nodes = np.unique(mesh.cells[found.cells])
    few = ProjectedEnergy(
        restrict_to_cells(energy, found.cells, found.weights, nodes), V.reshape(-1, 3, r)[nodes].reshape(-1, r)
    )
    near = equilibrium(replace(statics, assembly=Assembly(r, NONE, [few], [load]))).x
    assert np.linalg.norm(near - exact) <= 0.03 * np.linalg.norm(exact)
