"""Loads: totals and moments, follower pressure and its tangent, and bodies under pressure all around."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.optimize import brentq
from tangents import gradient, tangent

import softmark
from softmark.interpreter.models.fem.fem_builder import PreparedSolid
from softmark.interpreter.models.model_builders import build
from softmark.interpreter.models.shared.prepared_model import BuildContext
from softmark.interpreter.problem.body_case import case_of
from softmark.solvers.elements import ELEMENTS
from softmark.solvers.energies.elastic_energy import Elastic
from softmark.solvers.energies.external_loads import DeadForces, FollowerPressure
from softmark.solvers.materials import Law
from softmark.solvers.mesh.mesh import Mesh
from softmark.solvers.mesh.shapes import Box, Cylinder
from softmark.solvers.statics.static_equilibrium import Statics, equilibrium

SCENE = """
param L = 200 mm
material gel = linear_elastic(young = 60 kPa, poisson = 0.3, density = 1070 kg/m^3)
body beam = solid({shape}, gel)
support wall = fixed(beam, where = x <= 0 mm)
load one = {load}
model solid = fem(tet4, strain = small, size = 11 mm)
"""
BOX = "box(size = (L, 40 mm, 60 mm), origin = (0, -20, -30) mm)"
CYLINDER = "cylinder(length = L, radius = 20 mm)"


def prepared(shape: str, load: str, kind: str = "tet4", more: str = "") -> PreparedSolid:
    text = SCENE.format(shape=shape, load=load).replace("fem(tet4, strain = small", f"fem({kind}, strain = small{more}")
    scene = softmark.loads(text).scene
    return build(scene.declared["solid"], case_of(scene, "beam"), BuildContext())


def nodal_forces(model: PreparedSolid) -> np.ndarray:
    """Force on every node (n, 3), N: minus the gradient of the loads at rest."""
    g = np.zeros(model.mesh.points.size)
    for load in model.problem.assembly.loads:
        load.add_gradient(np.zeros_like(g), g)
    return -g.reshape(-1, 3)


def moment(points: np.ndarray, forces: np.ndarray) -> np.ndarray:
    return np.asarray(np.cross(points, forces).sum(axis=0))


@pytest.mark.parametrize("shape", [BOX, CYLINDER])
@pytest.mark.parametrize("kind", ELEMENTS)
@pytest.mark.parametrize("mass", ["consistent", "lumped"])
def test_gravity_is_the_weight_at_the_centroid(shape: str, kind: str, mass: str) -> None:
    """rho V g of the mesh, and its moment about the origin: the centroid is at (L/2, 0, 0). Round-off."""
    model = prepared(shape, "gravity(9.81 m/s^2, direction = (0, 3, -4))", kind, f", mass = {mass}")
    if kind == "tet10" and (shape, mass) == (CYLINDER, "lumped"):
        pytest.skip("volumes of curved cells by two quadratures differ")
    forces = nodal_forces(model)
    weight = 1070 * model.mesh.volumes.sum() * 9.81 * np.array([0, 0.6, -0.8])
    np.testing.assert_allclose(forces.sum(axis=0), weight, rtol=1e-12, atol=1e-15)
    exact = np.cross([0.1, 0.0, 0.0], weight)
    np.testing.assert_allclose(moment(model.mesh.points, forces), exact, rtol=1e-12, atol=1e-15)


def test_uniform_mass_is_the_same_on_every_node() -> None:
    """The whole weight, shared equally: SOFA's UniformMass."""
    forces = nodal_forces(prepared(BOX, "gravity(10 m/s^2)", "hex8", ", mass = uniform"))
    weight = 1070 * 0.2 * 0.04 * 0.06 * 10
    np.testing.assert_allclose(forces, np.tile([0, 0, -weight / len(forces)], (len(forces), 1)), rtol=1e-12)


@pytest.mark.parametrize("kind", ELEMENTS)
def test_traction_is_a_force_at_the_middle_of_its_face(kind: str) -> None:
    """Area 40 mm x 60 mm, at (L, 0, 0). Round-off."""
    model = prepared(BOX, "traction(beam, where = x >= L, vector = (100, 20, -300) Pa)", kind)
    forces = nodal_forces(model)
    total = 0.04 * 0.06 * np.array([100.0, 20, -300])
    np.testing.assert_allclose(forces.sum(axis=0), total, rtol=1e-12)
    exact = np.cross([0.2, 0, 0], total)
    np.testing.assert_allclose(moment(model.mesh.points, forces), exact, rtol=1e-12, atol=1e-15)
    assert np.all(forces[model.mesh.points[:, 0] < 0.199] == 0.0)


@pytest.mark.parametrize(
    ("where", "normal", "area", "middle"),
    [
        ("x >= L", (1, 0, 0), 0.04 * 0.06, (0.2, 0, 0)),
        ("y >= 20 mm", (0, 1, 0), 0.2 * 0.06, (0.1, 0.02, 0)),
        ("z <= -30 mm", (0, 0, -1), 0.2 * 0.04, (0.1, 0, -0.03)),
    ],
)
def test_pressure_pushes_inward(where: str, normal: tuple[int, ...], area: float, middle: tuple[float, ...]) -> None:
    """-p A n at the middle of the face. Round-off."""
    model = prepared(BOX, f"pressure(beam, where = {where}, magnitude = 250 Pa)")
    forces, total = nodal_forces(model), -250 * area * np.array(normal)
    np.testing.assert_allclose(forces.sum(axis=0), total, rtol=1e-12, atol=1e-13)
    exact = np.cross(middle, total)
    np.testing.assert_allclose(moment(model.mesh.points, forces), exact, rtol=1e-12, atol=1e-14)


# ------------------------------------------------------------------ energies of loads


def test_dead_forces_are_the_derivative_of_their_potential() -> None:
    f, x = np.random.default_rng(1).normal(size=(2, 12))
    load = DeadForces(f)
    assert load.value(x) == pytest.approx(-f @ x, rel=1e-15)
    np.testing.assert_array_equal(gradient(load, x, 0.5), -0.5 * f)
    assert load.stencils.shape == (0, 0)


KINDS = pytest.mark.parametrize("kind", ELEMENTS)


def pressed(
    where: Callable[[np.ndarray], np.ndarray] | None = None, kind: str = "tet4"
) -> tuple[Mesh, FollowerPressure, np.ndarray]:
    """A bent and stretched box under 1.7 Pa on all faces, or on those chosen by their middles."""
    mesh = Box((1.0, 0.6, 0.5)).mesh(kind, 0.4)
    faces = mesh.facets
    if where is not None:
        faces = faces[where(mesh.points[faces].mean(axis=1))]
    x = np.random.default_rng(2).uniform(-0.2, 0.2, mesh.points.size)
    return mesh, FollowerPressure(mesh.points, faces, 1.7), x


@pytest.mark.parametrize("closed", [True, False])
@KINDS
def test_tangent_of_pressure_against_finite_differences(closed: bool, kind: str) -> None:
    """Forces are quadratic in x: central differences are exact but for round-off, 1e-16/1e-4."""
    _, load, x = pressed(None if closed else lambda X: X[:, 2] > 0.49, kind)
    steps = 1e-4 * np.eye(x.size)
    K = np.array([gradient(load, x + d, 0.8) - gradient(load, x - d, 0.8) for d in steps]).T / 2e-4
    np.testing.assert_allclose(tangent(load, x, 0.8), K, atol=1e-11)
    # Bonet and Wood (2008), section 9.5: symmetric on a closed surface, not on one with a free edge
    symmetric = np.abs(K - K.T).max() < 1e-10
    assert symmetric == closed
    np.testing.assert_array_equal(tangent(load, x, projected=True), 0.0)


@KINDS
def test_pressure_on_a_closed_surface_has_no_resultant(kind: str) -> None:
    """Neither force nor moment, however the body is deformed: round-off."""
    mesh, load, x = pressed(kind=kind)
    forces = gradient(load, x).reshape(-1, 3)
    np.testing.assert_allclose(forces.sum(axis=0), 0.0, atol=4e-15)
    np.testing.assert_allclose(moment(mesh.points + x.reshape(-1, 3), forces), 0.0, atol=4e-15)


@pytest.mark.parametrize("kind", ["tet4", "hex8"])  # their quadrature is exact for the volume of any cell
def test_pressure_on_a_closed_surface_does_the_work_of_its_volume(kind: str) -> None:
    """The forces are minus the derivative of p V: exact for central differences of a cubic up to h^2."""
    mesh, load, x = pressed(kind=kind)

    def work(x: np.ndarray) -> float:
        return load.p * float(Mesh(mesh.points + x.reshape(-1, 3), mesh.cells, kind).volumes.sum())

    steps = 1e-5 * np.eye(x.size)
    numeric = np.array([work(x + d) - work(x - d) for d in steps]) / 2e-5
    np.testing.assert_allclose(gradient(load, x), numeric, atol=1e-9)


def test_follower_load_has_no_energy() -> None:
    _, load, x = pressed()
    with pytest.raises(TypeError):
        load.value(x)
    assert not load.conservative


# ------------------------------------------------------------------ pressure all around


def held_at_three_points(mesh: Mesh) -> np.ndarray:
    """Components (n, 3) that take the rigid motions and nothing else: the body may shrink towards point 0."""
    points = mesh.points - mesh.points[0]
    along = int(np.argmax(np.where(np.linalg.norm(points[:, 1:], axis=1) < 1e-9, points[:, 0], -1)))
    across = int(np.argmax(np.where(np.abs(points[:, [0, 2]]).max(axis=1) < 1e-9, points[:, 1], -1)))
    held = np.zeros(mesh.points.shape, dtype=bool)
    held[0], held[along, 1:], held[across, 2] = True, True, True
    return held


def shrunk(law: Law, mesh: Mesh, p: float, elastic: Callable[..., Elastic], problem: Callable[..., Statics]) -> float:
    """The stretch of a body under pressure p all around, which must be the same everywhere."""
    load = FollowerPressure(mesh.points, mesh.faces, p)
    found = equilibrium(problem(mesh, elastic(mesh, law), held_at_three_points(mesh), [load], tolerance=1e-11))
    F = elastic(mesh, law).F(found.x)
    stretch = float(F[:, 0, 0].mean())
    np.testing.assert_allclose(F, np.broadcast_to(stretch * np.eye(3), F.shape), atol=1e-10)
    return stretch


BODIES = pytest.mark.parametrize(
    "mesh", [Box((1.0, 1.0, 1.0)).mesh("tet4", 0.5), Cylinder(2.0, 0.5, (0, 0, 1)).mesh("tet4", 0.5)]
)


@BODIES
def test_small_strain_under_pressure_all_around(
    mesh: Mesh, law: Callable[..., Law], elastic: Callable[..., Elastic], problem: Callable[..., Statics]
) -> None:
    """3 K (s - 1) = -p s^2, s^2 the area that the pressure follows: eps = -p/3K to first order. K = 5/6."""
    K = 1 / (3 * (1 - 0.6))
    for p in (1e-3, 0.2):
        exact = brentq(lambda s, p=p: 3 * K * (s - 1) + p * s**2, 0.5, 1.0, xtol=1e-15)
        assert shrunk(law("small"), mesh, p, elastic, problem) == pytest.approx(exact, abs=1e-11)
    assert exact == pytest.approx(1 - p / (3 * K), abs=0.02)


@BODIES
@pytest.mark.parametrize("p", [-0.1, 0.5, 2.0])
def test_neo_hookean_under_pressure_all_around(
    mesh: Mesh,
    p: float,
    law: Callable[..., Law],
    elastic: Callable[..., Elastic],
    problem: Callable[..., Statics],
) -> None:
    """mu (s - 1/s) + 3 lam ln(s)/s = -p s^2, solved here; mu = 1/2.6, lam = 0.3/0.52 for E = 1, nu = 0.3."""
    mu, lam = 1 / 2.6, 0.3 / (1.3 * 0.4)
    exact = brentq(lambda s: mu * (s - 1 / s) + 3 * lam * np.log(s) / s + p * s**2, 0.1, 1.1, xtol=1e-15)
    assert shrunk(law("neo_hookean"), mesh, p, elastic, problem) == pytest.approx(exact, abs=1e-10)
