"""The elastic energy of solids against closed forms, and where its derivatives are hardest to get right.

What every law must do on every mesh is in test_solids.py.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from equal_moduli import made

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.assembly.pressure_predictor import ElasticWithGivenPressures
from softmark.solvers.elements import ELEMENTS
from softmark.solvers.energies.elastic_energy import Elastic
from softmark.solvers.materials import MATERIALS, Law
from softmark.solvers.mesh.cell_splitting import mesh_hexahedra
from softmark.solvers.mesh.mesh import Mesh
from softmark.solvers.mesh.shapes import Box
from softmark.solvers.statics.static_equilibrium import NotConverged, Statics, equilibrium

Maker = Callable[..., Law]
Energies = Callable[[Mesh, Law], Elastic]
Problems = Callable[..., Statics]

FINITE = tuple(name for name in MATERIALS if made(name, 1.0, 0.3).finite_law())
LAWS = ("small", "corotational", *FINITE)
INSIDE_OUT = ("small", "corotational", "st_venant_kirchhoff")  # defined where J < 0
UNIT = Box((1.0, 1.0, 1.0))


def gradient(energy: Elastic, x: np.ndarray) -> np.ndarray:
    g = np.zeros_like(x)
    energy.add_gradient(x, g)
    return g


def stiffness(energy: Elastic, x: np.ndarray, projected: bool = False) -> np.ndarray:
    free = Assembly(x.size, np.zeros(0, dtype=np.int64), [energy], [])
    return np.asarray(free.tangent(x, 1.0, projected).toarray())


def assert_derivatives(energy: Elastic, x: np.ndarray, tolerance: float) -> None:
    """Value to gradient to Hessian by central differences of h = 1e-5: h^2 psi''' and 1e-16/h are 1e-10."""
    h = 1e-5
    steps = h * np.eye(x.size)
    g = np.array([energy.value(x + d) - energy.value(x - d) for d in steps]) / (2 * h)
    K = np.array([gradient(energy, x + d) - gradient(energy, x - d) for d in steps]) / (2 * h)
    np.testing.assert_allclose(gradient(energy, x), g, atol=tolerance * np.abs(g).max())
    np.testing.assert_allclose(stiffness(energy, x), K, atol=tolerance * np.abs(K).max())


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_derivatives_at_unit_scale(name: str, seed: int, law: Maker, elastic: Energies) -> None:
    """E = 1, edges of 1/2, a large stretch, a large turn and every point moved on its own."""
    mesh = UNIT.mesh("tet4", 1.0)
    rng = np.random.default_rng(seed)
    Q = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    Q *= np.sign(np.linalg.det(Q))
    F = Q @ np.diag(rng.uniform(0.7, 1.5, 3))
    x = (mesh.points @ (F - np.eye(3)).T + rng.uniform(-0.05, 0.05, mesh.points.shape)).ravel()
    energy = elastic(mesh, law(name))
    assert np.linalg.det(energy.F(x)).min() > 0.05
    assert_derivatives(energy, x, 1e-8)


@pytest.mark.parametrize("name", INSIDE_OUT)
def test_derivatives_of_cells_that_are_inside_out(name: str, law: Maker, elastic: Energies) -> None:
    """Mirrored and moved, away from s2 + s3 = 0, where the corotational rotation is not unique."""
    mesh = UNIT.mesh("tet4", 1.0)
    noise = np.random.default_rng(4).uniform(-0.1, 0.1, mesh.points.shape)
    x = (mesh.points * [0.4, 0.3, -1.9] + noise).ravel()
    energy = elastic(mesh, law(name))
    assert np.linalg.det(energy.F(x)).max() < 0
    assert_derivatives(energy, x, 1e-7)


@pytest.mark.parametrize("projected", [False, True])
@pytest.mark.parametrize("name", LAWS)
def test_kernels_against_einsum(name: str, projected: bool, law: Maker, elastic: Energies) -> None:
    """The slow clear sum over cells, K = sum w dN_a/dX_J A_iJkL dN_b/dX_L, as the judge: round-off."""
    mesh = UNIT.mesh("tet4", 0.4)
    x = np.random.default_rng(5).uniform(-0.05, 0.05, mesh.points.size)
    energy = elastic(mesh, law(name))
    F, (m, n) = energy.F(x), (len(mesh.cells), x.size)
    dN, w = energy.dNdX[:, 0], energy.w[:, 0]
    u = x.reshape(-1, 3)[mesh.cells]
    np.testing.assert_allclose(F, np.eye(3) + np.einsum("mai,maJ->miJ", u, dN), atol=1e-15)
    A = energy.law.dPdF_projected(F) if projected else energy.law.dPdF(F)
    blocks = np.einsum("m,maJ,miJkL,mbL->maibk", w, dN, A, dN).reshape(m, 12, 12)
    K = np.zeros((n, n))
    np.add.at(K, (energy.stencils[:, :, None], energy.stencils[:, None, :]), blocks)
    np.testing.assert_allclose(stiffness(energy, x, projected), K, atol=1e-14 * np.abs(K).max())
    forces = np.zeros((n // 3, 3))
    np.add.at(forces, mesh.cells, np.einsum("m,miJ,maJ->mai", w, energy.law.P(F), dN))
    np.testing.assert_allclose(gradient(energy, x), forces.ravel(), atol=1e-15 * np.abs(K).max())


# ------------------------------------------------------------------ patches and rotations

# MacNeal and Harder (1985), "A proposed standard set of problems": the inner points of the solid patch
INNER = [
    (0.249, 0.342, 0.192), (0.826, 0.288, 0.288), (0.850, 0.649, 0.263), (0.273, 0.750, 0.230),
    (0.320, 0.186, 0.643), (0.677, 0.305, 0.683), (0.788, 0.693, 0.644), (0.165, 0.745, 0.702),
]  # fmt: skip


def patch() -> Mesh:
    """The seven hexahedra of the patch, each split into five tetrahedra; points 0 to 7 are the corners."""
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    sides = np.array([[0, 1, 2, 3], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]])
    hexahedra = np.concatenate([np.concatenate([sides, sides + 8], axis=1), [np.arange(8, 16)]])
    colour = np.array([0, 1, 0, 1, 1, 0, 1, 0])
    points, colours = np.array([*corners, *INNER], dtype=float), np.concatenate([colour, 1 - colour])
    return mesh_hexahedra(points, hexahedra, colours, ELEMENTS["tet4"])


def on_the_patch(energy: Elastic, mesh: Mesh, F: np.ndarray, problem: Problems) -> np.ndarray:
    """The inner points (8, 3) when the corners follow x = F X."""
    to = mesh.points @ (F - np.eye(3)).T
    found = equilibrium(problem(mesh, energy, np.arange(16) < 8, to=to, tolerance=1e-12))
    return found.x.reshape(-1, 3) - to


def test_patch_of_macneal_and_harder(law: Maker, elastic: Energies, problem: Problems) -> None:
    """u = 1e-3 (2 x + y + z)/2 and cyclic, E = 1e6, nu = 0.25: stresses 2000 and 400 in every cell."""
    mesh = patch()
    assert mesh.volumes.min() > 0
    assert mesh.volumes.sum() == pytest.approx(1.0, rel=1e-14)
    energy = elastic(mesh, law("small", 1e6, 0.25))
    F = np.eye(3) + 0.5e-3 * (np.ones((3, 3)) + np.eye(3))
    error = on_the_patch(energy, mesh, F, problem)
    np.testing.assert_allclose(error, 0.0, atol=1e-15)  # F holds grad u next to 1
    to = mesh.points @ (F - np.eye(3)).T
    stress = energy.law.P(energy.F((to + error).ravel()))
    # strains of 1e-3 keep 13 digits next to the 1 of F
    np.testing.assert_allclose(stress, np.full((35, 3, 3), 400.0) + 1600 * np.eye(3), rtol=1e-11)


@pytest.mark.parametrize("name", ["corotational", *FINITE])
def test_patch_of_large_strain(name: str, law: Maker, elastic: Energies, problem: Problems) -> None:
    """diag(1.5, 0.8, 1) with shear, turned by 40 degrees: homogeneous in every cell, P that of one F."""
    mesh = patch()
    energy = elastic(mesh, law(name, 1e6, 0.25))
    c, s = np.cos(0.7), np.sin(0.7)
    F = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.array([[1.5, 0.2, 0], [0, 0.8, 0.1], [0, 0, 1]])
    error = on_the_patch(energy, mesh, F, problem)
    np.testing.assert_allclose(error, 0.0, atol=1e-10)
    x = mesh.points @ (F - np.eye(3)).T + error
    P = energy.law.P(energy.F(x.ravel()))
    exact = np.broadcast_to(energy.law.P(F[None]), P.shape)
    np.testing.assert_allclose(P, exact, atol=1e-9 * np.abs(exact).max())


@pytest.mark.parametrize(
    ("degrees", "strain"),
    [(1, -1.523e-4), (5, -3.805e-3), (10, -0.01519), (30, -0.13397), (45, -0.29289), (90, -1.0)],
)
def test_small_strain_shrinks_what_turns(degrees: float, strain: float, law: Maker, elastic: Energies) -> None:
    """eps_xx = eps_yy = cos(theta) - 1: the table holds four digits. With nu = 0, P_xx = E eps_xx."""
    mesh = UNIT.mesh("tet4", 0.5)
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    x = (mesh.points @ (np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) - np.eye(3)).T).ravel()
    energy = elastic(mesh, law("small", 1.0, 0.0))
    P = energy.law.P(energy.F(x))
    np.testing.assert_allclose(P[:, 0, 0], strain, rtol=4e-4)
    np.testing.assert_allclose(P[:, 1, 1], c - 1, atol=1e-14)
    np.testing.assert_allclose(P[:, 2, 2], 0.0, atol=1e-14)


# ------------------------------------------------------------------ from inside out back to rest


def released(mesh: Mesh, u: np.ndarray, poisson: float, law: Maker, elastic: Energies, problem: Problems) -> Statics:
    """A corotational cube without load, held at z = 0, that starts with its other points moved by u."""
    energy = elastic(mesh, law("corotational", 1.0, poisson))
    held = mesh.points[:, 2] < 1e-9

    def sound(x: np.ndarray) -> bool:
        return bool(np.all(np.linalg.det(energy.F(x)) > 0))

    start = np.where(held[:, None], 0.0, u).ravel()
    return problem(mesh, energy, held, rest=start, sound=sound, max_iterations=200)


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.45, 0.49])
@pytest.mark.parametrize("size", [1.0, 0.5, 0.3])
def test_a_mirrored_cube_returns(size: float, poisson: float, law: Maker, elastic: Energies, problem: Problems) -> None:
    """Every cell inside out, with s2 + s3 = 0 exactly, where the rotation of a cell is not unique."""
    mesh = UNIT.mesh("tet4", size)
    start = released(mesh, mesh.points * [0, 0, -2], poisson, law, elastic, problem)
    np.testing.assert_allclose(np.linalg.det(start.assembly.internal[0].F(start.rest)), -1.0, rtol=1e-12)
    assert np.abs(equilibrium(start).x).max() < 1e-8  # round-off of a cube of edge 1, and then some


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("seeds", [range(2), pytest.param(range(2, 50), marks=pytest.mark.slow)], ids=["few", "many"])
def test_scrambled_cubes_return(seeds: range, law: Maker, elastic: Energies, problem: Problems) -> None:
    """50 cubes whose free points start anywhere in the cube, half of the cells inside out: all return."""
    mesh = UNIT.mesh("tet4", 0.5)
    for seed in seeds:
        u = np.random.default_rng(seed).uniform(size=mesh.points.shape) - mesh.points
        found = equilibrium(released(mesh, u, 0.3, law, elastic, problem))
        assert np.abs(found.x).max() < 1e-8, seed


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize("count", [3, pytest.param(10, marks=pytest.mark.slow)])
def test_a_tangled_minimum_is_refused(count: int, law: Maker, elastic: Energies, problem: Problems) -> None:
    """Near incompressibility the energy has true minima with inverted cells: never returned as equilibria."""
    mesh = UNIT.mesh("tet4", 0.5)
    refused = 0
    for seed in range(count):
        u = np.random.default_rng(seed).uniform(size=mesh.points.shape) - mesh.points
        try:
            found = equilibrium(released(mesh, u, 0.49, law, elastic, problem))
        except NotConverged as failure:
            assert failure.reason.endswith("the equilibrium has inverted cells")  # noqa: PT017 - some return
            refused += 1
        else:
            assert np.abs(found.x).max() < 1e-8
    assert 0 < refused < count


# ------------------------------------------------------------------ laws of invariants, with and without tensors


class Tensors:
    """A law of which nothing is known but its tensors."""

    def __init__(self, law: Law) -> None:
        self.psi, self.P = law.psi, law.P
        self.dPdF, self.dPdF_projected = law.dPdF, law.dPdF_projected


@pytest.mark.parametrize("kind", ELEMENTS)
@pytest.mark.parametrize("name", ["neo_hookean", "neo_hookean_isochoric"])
@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.49])
def test_numbers_of_invariants_do_what_tensors_do(
    name: str, poisson: float, kind: str, law: Maker, elastic: Energies
) -> None:
    """Sums of some hundred terms in another order: 1e-13 of their sizes. Nodes are held in all, one or no directions.

    The energy is compared with that of unit strain, since what remains near rest is a difference.
    """
    mesh = Box((1.0, 0.6, 0.5)).mesh(kind, 0.25)
    rng = np.random.default_rng(5)
    stretch = np.diag([1.2, 0.9, 0.95]) + rng.uniform(-0.1, 0.1, (3, 3))
    x = (mesh.points @ (stretch - np.eye(3)).T + rng.uniform(-0.01, 0.01, mesh.points.shape)).ravel()
    own = law(name, 2.0, poisson)
    fixed = np.concatenate([np.arange(9), [12, 16, 20]])
    fast, plain = elastic(mesh, own), elastic(mesh, Tensors(own))  # type: ignore[arg-type]
    assert fast.value(x) == pytest.approx(plain.value(x), rel=1e-13)
    g = gradient(plain, x)
    np.testing.assert_allclose(gradient(fast, x), g, atol=1e-13 * np.abs(g).max())
    for projected in (False, True):
        both = [Assembly(x.size, fixed, [e], []).tangent(x, 0.7, projected).toarray() for e in (fast, plain)]
        np.testing.assert_allclose(*both, atol=1e-13 * np.abs(both[1]).max())


@pytest.mark.parametrize("name", ["neo_hookean", "neo_hookean_isochoric"])
def test_cells_inside_out_have_infinite_energy_without_tensors(name: str, law: Maker, elastic: Energies) -> None:
    """J = -0.2, and J = 0, without a warning."""
    mesh = UNIT.mesh("tet4", 1.0)
    for squeezed in (-0.2, 0.0):
        x = (mesh.points * [squeezed - 1.0, 0.0, 0.0]).ravel()
        energy = elastic(mesh, law(name))
        assert energy.value(x) == np.inf
        gradient(energy, x)
        stiffness(energy, x)


@pytest.mark.parametrize("name", ["neo_hookean", "neo_hookean_isochoric"])
def test_small_strains_keep_their_digits(name: str, law: Maker, elastic: Energies) -> None:
    """psi is eps : C : eps / 2 to first order in a strain of 1e-9, where F - I itself would have seven digits left."""
    mesh = UNIT.mesh("tet4", 1.0)
    H = 1e-9 * np.random.default_rng(1).uniform(-1.0, 1.0, (3, 3))
    small, x = 0.5 * (H + H.T), (mesh.points @ H.T).ravel()
    mu, lam = 0.5 / 1.3, 0.3 / (1.3 * 0.4)
    exact = mu * np.sum(small**2) + 0.5 * lam * np.trace(small) ** 2
    found = elastic(mesh, law(name)).value(x)
    # a difference of terms of 1e-9, each with an error of 1e-25, beside 1e-18
    assert found == pytest.approx(exact, rel=1e-6)


@pytest.mark.parametrize("name", ["neo_hookean", "neo_hookean_isochoric"])
def test_expected_pressures_do_what_they_do_to_tensors(name: str, elastic: Energies) -> None:
    """The tangent with the pressures that a step promises, and these: sums in another order."""
    mesh = Box((1.0, 0.6, 0.5)).mesh("tet4", 0.25)
    x, d = np.random.default_rng(6).uniform(-0.01, 0.01, (2, mesh.points.size))
    material = made(name, 2.0, 0.45)
    whole, parts = material.finite_law(), material.finite_parts()
    assert whole is not None
    assert parts is not None
    found = []
    for law, volume in ((whole, parts[1]), (Tensors(whole), Tensors(parts[1]))):
        plain = elastic(mesh, law)  # type: ignore[arg-type]
        mixed = ElasticWithGivenPressures(plain.cells, plain.dNdX, plain.w, plain.law, volume=volume)  # type: ignore[arg-type]
        then = mixed.with_predicted_pressures(x, d)
        found.append((then.expected, stiffness(then, x)))
    for fast, slow in zip(*found, strict=True):
        np.testing.assert_allclose(fast, slow, atol=1e-12 * np.abs(slow).max())
