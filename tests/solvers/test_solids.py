"""What every solid element must do under every law, each held against something outside the code."""

from __future__ import annotations

import numpy as np
import pytest

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.elements import ELEMENTS
from softmark.solvers.energies.elastic_energy import Elastic, EnergySum
from softmark.solvers.energies.energy import Energy, VectorSpace
from softmark.solvers.energies.external_loads import DeadForces
from softmark.solvers.materials import MATERIALS, law_for, shear_and_volume_laws
from softmark.solvers.mesh.cell_splitting import add_midside_nodes
from softmark.solvers.mesh.element_interpolation import integrate_cells, mean_gradients
from softmark.solvers.mesh.mesh import Mesh
from softmark.solvers.mesh.shapes import Box
from softmark.solvers.statics.static_equilibrium import Statics, equilibrium

LAWS = [
    ("linear_elastic", "small"),
    ("linear_elastic", "corotational"),
    ("neo_hookean", "finite"),
    ("neo_hookean_isochoric", "finite"),
    ("st_venant_kirchhoff", "finite"),
]
OBJECTIVE = [law for law in LAWS if law[1] != "small"]
NONE = np.zeros(0, dtype=np.int64)


KINDS = pytest.mark.parametrize("kind", ELEMENTS)

# MacNeal and Harder (1985), the distorted hexahedron inside the unit cube
INNER = [
    *((0.249, 0.342, 0.192), (0.826, 0.288, 0.288), (0.850, 0.649, 0.263), (0.273, 0.750, 0.230)),
    *((0.320, 0.186, 0.643), (0.677, 0.305, 0.683), (0.788, 0.693, 0.644), (0.165, 0.745, 0.702)),
]


def nested() -> Mesh:
    """The seven hexahedra of MacNeal and Harder: one inside, and one between each of its faces and the unit cube."""
    outer = [(x, y, z) for z in (0.0, 1.0) for x, y in ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))]
    facets = np.array(ELEMENTS["hex8"].facets)
    between = np.concatenate([8 + facets, facets], axis=1)  # from the inner face outward
    cells = np.concatenate([8 + np.arange(8)[None], between])
    return Mesh(np.array([*outer, *INNER]), cells, "hex8")


def cube(cells: int = 2, kind: str = "tet4") -> Mesh:
    """A unit cube whose inner points are moved, so that no cell is special."""
    mesh = Box((1.0, 1.0, 1.0)).mesh("tet4", 1.0 / cells)
    if ELEMENTS[kind].family == "hexahedra":
        mesh = Box((1.0, 1.0, 1.0)).mesh(kind, 1.0 / cells)
    points = mesh.points.copy()
    inner = np.all((points > 0.01) & (points < 0.99), axis=1)
    points[inner] += np.random.default_rng(1).uniform(-0.1, 0.1, (inner.sum(), 3)) / cells
    return add_midside_nodes(Mesh(points, mesh.cells, mesh.kind), ELEMENTS[kind])


def elastic(mesh: Mesh, law: tuple[str, str], young: float = 1.0, poisson: float = 0.25) -> Elastic:
    parts = integrate_cells(mesh)
    return Elastic(mesh.cells, parts.dNdX, parts.w, law_for(MATERIALS[law[0]](young, poisson, 1.0), law[1]))


def gradient(energy: Elastic, x: np.ndarray) -> np.ndarray:
    g = np.zeros_like(x)
    energy.add_gradient(x, g)
    return g


def stiffness(energy: Elastic, x: np.ndarray, projected: bool = False) -> np.ndarray:
    return Assembly(x.size, NONE, [energy], []).tangent(x, 1.0, projected).toarray()


def moved(mesh: Mesh, F: np.ndarray) -> np.ndarray:
    """Displacements (3 n,) of the homogeneous deformation x = F X."""
    return (mesh.points @ (F - np.eye(3)).T).ravel()


def turn(angle: float, axis: tuple[float, float, float] = (1.0, 2.0, 2.0)) -> np.ndarray:
    a = np.array(axis) / np.linalg.norm(axis)
    K = np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


@pytest.mark.parametrize("law", LAWS)
def test_derivatives_against_finite_differences(law: tuple[str, str]) -> None:
    # at unit scale (E = 1, size 1), where nothing hides behind a large modulus; central differences with h = 1e-5
    # leave h^2 = 1e-10 of the third derivative and 1e-16 / h = 1e-11 of rounding
    mesh = cube(1)
    energy = elastic(mesh, law)
    rng = np.random.default_rng(2)
    x = moved(mesh, turn(1.2) @ np.diag([1.3, 0.8, 1.1])) + rng.uniform(-0.03, 0.03, mesh.points.size)
    g, K, h = gradient(energy, x), stiffness(energy, x), 1e-5
    steps = np.eye(x.size) * h
    numeric_g = np.array([(energy.value(x + s) - energy.value(x - s)) / (2 * h) for s in steps])
    numeric_K = np.array([(gradient(energy, x + s) - gradient(energy, x - s)) / (2 * h) for s in steps])
    np.testing.assert_allclose(g, numeric_g, atol=2e-9)
    np.testing.assert_allclose(K, numeric_K, atol=1e-8)
    np.testing.assert_allclose(K, K.T, atol=1e-15)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("kind", [*ELEMENTS, "nested"])
def test_patch_of_small_strain(law: tuple[str, str], kind: str) -> None:
    # MacNeal and Harder (1985): u = 1e-3 (2x + y + z)/2 and cyclic, E = 1e6, nu = 0.25: sxx = 2000, sxy = 400. A
    # thousandth of strain makes the nonlinear laws differ from the linear by that part of themselves
    mesh = nested() if kind == "nested" else cube(3 if kind == "tet4" else 2, kind)
    energy = elastic(mesh, law, 1e6)
    H = 1e-3 * np.array([[2, 1, 1], [1, 2, 1], [1, 1, 2]]) / 2
    x = held_on_the_surface(mesh, energy, np.eye(3) + H)
    np.testing.assert_allclose(x, moved(mesh, np.eye(3) + H), atol=1e-13)
    stress = energy.law.P(energy.F(x))
    nonlinear = 1e-12 if law[1] == "small" else 8.0
    np.testing.assert_allclose(
        stress,
        np.broadcast_to([[2000, 400, 400], [400, 2000, 400], [400, 400, 2000]], stress.shape),
        atol=max(nonlinear, 1e-7),
    )


@pytest.mark.parametrize("law", OBJECTIVE)
@KINDS
def test_patch_of_large_strain(law: tuple[str, str], kind: str) -> None:
    # a homogeneous deformation is an equilibrium on any mesh: the inner points return to it to round-off
    mesh = cube(2, kind)
    energy = elastic(mesh, law)
    F = turn(0.4) @ np.array([[1.15, 0.1, 0.0], [0.0, 0.9, 0.05], [0.0, 0.0, 1.05]])
    x = held_on_the_surface(mesh, energy, F)
    np.testing.assert_allclose(x, moved(mesh, F), atol=1e-9)


def held_on_the_surface(mesh: Mesh, energy: Elastic, F: np.ndarray) -> np.ndarray:
    """Equilibrium with the surface moved by F, the inside free and started at rest."""
    fixed = (3 * np.unique(mesh.facets)[:, None] + np.arange(3)).ravel()
    assembly = Assembly(mesh.points.size, fixed, [energy], [])
    problem = Statics(
        assembly,
        VectorSpace(mesh.points.size),
        np.zeros(mesh.points.size),
        fixed,
        moved(mesh, F)[fixed],
        1e-11,
    )
    return equilibrium(problem).x


@pytest.mark.parametrize("law", LAWS)
@KINDS
def test_six_rigid_modes(law: tuple[str, str], kind: str) -> None:
    # a free body at rest resists everything but three translations and three rotations
    mesh = cube(2 if kind == "tet4" else 1, kind)
    values = np.linalg.eigvalsh(stiffness(elastic(mesh, law), np.zeros(mesh.points.size)))
    assert np.sum(np.abs(values) < 1e-12 * values[-1]) == 6
    assert values[6] > 1e-3 * values[-1]
    assert values[0] > -1e-14 * values[-1]


@pytest.mark.parametrize("law", OBJECTIVE)
@pytest.mark.parametrize("angle", [0.5 * np.pi, np.pi, 3.0])
@KINDS
def test_rotation_gives_no_force(law: tuple[str, str], angle: float, kind: str) -> None:
    mesh = cube(2, kind)
    energy = elastic(mesh, law)
    x = moved(mesh, turn(angle))
    assert np.abs(gradient(energy, x)).max() < 1e-14
    assert abs(energy.value(x)) < 1e-14


def test_rotation_strains_the_linear_model() -> None:
    # eps = cos(theta) - 1 in the plane of the turn: -1 at 90 degrees, psi = (2 mu + 2 lambda) for two such strains,
    # mu = lambda = 0.4 for E = 1, nu = 0.25
    mesh = cube(2)
    energy = elastic(mesh, ("linear_elastic", "small"))
    assert energy.value(moved(mesh, turn(np.pi / 2, (0, 0, 1)))) == pytest.approx(2 * 0.4 + 2 * 0.4, rel=1e-12)


@pytest.mark.parametrize("law", LAWS)
def test_projected_tangent_is_definite(law: tuple[str, str]) -> None:
    mesh = cube(1)
    x = moved(mesh, turn(0.7) @ np.diag([0.6, 0.7, 0.8]))  # compressed, so that the exact tangent is not
    values = np.linalg.eigvalsh(stiffness(elastic(mesh, law), x, projected=True))
    assert values[0] > -1e-12


def returning(mesh: Mesh, start: np.ndarray, fixed: np.ndarray) -> np.ndarray:
    """The corotational equilibrium without loads that is found from a start."""
    energy = elastic(mesh, ("linear_elastic", "corotational"), poisson=0.3)
    dofs = mesh.points.size

    def sound(x: np.ndarray) -> bool:
        return bool(np.all(np.linalg.det(energy.F(x)) > 0))

    problem = Statics(
        Assembly(dofs, fixed, [energy], []),
        VectorSpace(dofs),
        start,
        fixed,
        np.zeros(len(fixed)),
        max_iterations=200,
        sound=sound,
    )
    return equilibrium(problem).x


def test_inverted_cube_recovers() -> None:
    # every free point mirrored through the held face: all cells inside out
    mesh = cube(2)
    fixed = (3 * np.nonzero(mesh.points[:, 2] < 1e-9)[0][:, None] + np.arange(3)).ravel()
    start = np.zeros_like(mesh.points)
    start[:, 2] = -2.0 * mesh.points[:, 2]
    assert np.abs(returning(mesh, start.ravel(), fixed)).max() < 1e-7


@pytest.mark.parametrize("seed", range(10))
def test_scrambled_cube_recovers(seed: int) -> None:
    mesh = cube(2)
    fixed = (3 * np.nonzero(mesh.points[:, 2] < 1e-9)[0][:, None] + np.arange(3)).ravel()
    start = np.random.default_rng(seed).uniform(0, 1, mesh.points.shape) - mesh.points
    start.ravel()[fixed] = 0.0
    assert np.abs(returning(mesh, start.ravel(), fixed)).max() < 1e-7


# ------------------------------------------------------------------ locking


def bent(selective: bool, poisson: float) -> float:
    """Tip deflection of a cantilever of hexahedra, 1 x 0.1 x 0.1 with E = 1e6, under a shear force of 1 on its end."""
    mesh, material = Box((1.0, 0.1, 0.1)).mesh("hex8", 1 / 60), MATERIALS["linear_elastic"](1e6, poisson, 1.0)
    parts, middle = integrate_cells(mesh), mean_gradients(mesh)
    energy: Energy = Elastic(mesh.cells, parts.dNdX, parts.w, law_for(material, "small"))
    split = shear_and_volume_laws(material, "small")
    if selective and split is not None:
        shear = Elastic(mesh.cells, parts.dNdX, parts.w, split[0])
        energy = EnergySum((shear, Elastic(mesh.cells, middle.dNdX, middle.w, split[1])))
    f = np.zeros_like(mesh.points)
    f[:, 2] = (mesh.points[:, 0] > 1 - 1e-9) / np.sum(mesh.points[:, 0] > 1 - 1e-9)
    fixed = (3 * np.nonzero(mesh.points[:, 0] < 1e-9)[0][:, None] + np.arange(3)).ravel()
    assembly = Assembly(f.size, fixed, [energy], [DeadForces(f.ravel())])
    problem = Statics(assembly, VectorSpace(f.size), np.zeros(f.size), fixed, np.zeros(len(fixed)), convex=True)
    u = equilibrium(problem).x.reshape(-1, 3)
    return float(u[mesh.points[:, 0] > 1 - 1e-9, 2].mean())


@pytest.mark.slow
def test_selective_integration_does_not_lock() -> None:
    # Timoshenko: P L^3/(3 E I) + P L/(kappa G A) = 0.04 + 2.4e-4 (1 + nu). Six cells across bend 1.5 to 3.1 % less
    # (parasitic shear, h^2; the clamp, which beam theory lacks), no less towards nu = 1/2; in full integration 55 %
    for poisson in (0.3, 0.49, 0.499, 0.4999):
        exact = 0.04 + 2.4e-4 * (1 + poisson)
        assert bent(True, poisson) == pytest.approx(exact, rel=0.035)
    assert bent(False, 0.3) == pytest.approx(0.0403, rel=0.035)
    assert bent(False, 0.4999) < 0.5 * 0.04036
