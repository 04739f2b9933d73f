"""Forces found again: the independent formulas agree with those that solve, for every element, strain and load."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from equal_moduli import CONSTANTS as OWN
from equal_moduli import made

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.assembly.mixed_elements import mixed_energy
from softmark.solvers.elements import CELLS, ELEMENTS
from softmark.solvers.energies import element_corotational
from softmark.solvers.energies.elastic_energy import Elastic
from softmark.solvers.energies.element_corotational import ElementCorotational
from softmark.solvers.energies.external_loads import FollowerPressure
from softmark.solvers.energies.geometrically_exact_rod import RodElastic
from softmark.solvers.energies.mixed_displacement_pressure import MeanDilatation
from softmark.solvers.energies.rod_rotation import rotation
from softmark.solvers.energies.rod_section import RodStiffness
from softmark.solvers.energies.rod_state import RodSpace, chain_elements, rod_at_rest
from softmark.solvers.energies.spring_energy import Springs
from softmark.solvers.independent_forces import mass_forces, solid_forces
from softmark.solvers.independent_forces.mixed_formulation_forces import MixedBody, split_law
from softmark.solvers.independent_forces.rod_forces import CheckedRod, exponential, left_jacobian, rotation_vector
from softmark.solvers.independent_forces.stress_by_differences import EnergyStress
from softmark.solvers.materials import MATERIALS, NeoHookean, law_for, mixed_for, shear_and_volume_laws
from softmark.solvers.materials.polar_decomposition import rotations
from softmark.solvers.mesh.element_interpolation import integrate_cells, mean_gradients
from softmark.solvers.mesh.mesh import Mesh
from softmark.solvers.mesh.shapes import Cylinder

KINDS = tuple(ELEMENTS)
GEL = NeoHookean(young=1.0, poisson=0.3, density=1.0)
MU, LAM = 1.0 / 2.6, 0.3 / (1.3 * 0.4)
# two codes that add up the same numbers in another order: a few hundred terms of size one
SAME = 1e-11


@pytest.fixture(scope="module", params=KINDS)
def mesh(request: pytest.FixtureRequest) -> Mesh:
    """A short cylinder: cells of many shapes, curved ones where the element can be."""
    return Cylinder(length=1.0, radius=0.4).mesh(request.param, 0.35)


def bent(mesh: Mesh) -> np.ndarray:
    """Displacements (n, 3) with a turn of about 40 degrees and strains of some per cent, no cell inside out."""
    X = mesh.points
    R = exponential(np.array([[0.2, 0.5, -0.4]]))[0]
    u = X @ R.T - X + 0.03 * np.sin(2.0 * X[:, [1, 2, 0]])
    return np.asarray(u + 0.002 * np.random.default_rng(1).standard_normal(X.shape))


@pytest.mark.parametrize("kind", [*CELLS])
def test_shape_functions_are_those_of_the_elements(kind: str) -> None:
    xi = np.random.default_rng(0).random((5, 3)) / 3.0
    assert solid_forces.node_positions(kind) == pytest.approx(CELLS[kind].places())
    assert solid_forces.shape_functions(kind, xi) == pytest.approx(CELLS[kind].shape(xi), abs=1e-13)
    assert solid_forces.shape_derivatives(kind, xi) == pytest.approx(CELLS[kind].gradient(xi), abs=1e-13)
    (own, w), (known, v) = (
        solid_forces.quadrature_rule(kind),
        CELLS[kind].quadrature(),
    )  # points of the same polynomials, in any order
    assert w @ own**2 == pytest.approx(v @ known**2, abs=1e-13)
    assert len(w) == len(v)


def test_rotations_are_the_nearest_ones_flat_and_inverted_too() -> None:
    F = np.random.default_rng(0).standard_normal((200, 3, 3))
    F[0], F[1] = np.eye(3), np.diag([1.0, 1.0, -0.5])
    R = solid_forces.polar_rotation(F)
    assert R @ R.transpose(0, 2, 1) == pytest.approx(np.broadcast_to(np.eye(3), R.shape), abs=1e-13)
    assert np.linalg.det(R) == pytest.approx(1.0)
    U, s, Vt = np.linalg.svd(F)  # the largest trace of R^T F is s1 + s2 +- s3 (Kabsch 1976)
    most = s[:, 0] + s[:, 1] + s[:, 2] * np.linalg.det(U) * np.linalg.det(Vt)
    assert np.einsum("nij,nij->n", R, F) == pytest.approx(most, abs=1e-12)


@pytest.mark.parametrize("strain", ["small", "corotational", "finite"])
@pytest.mark.parametrize("selective", [False, True])
def test_forces_within_solids(mesh: Mesh, strain: str, selective: bool) -> None:
    u = bent(mesh)
    law = {"small": solid_forces.small_strain_stress, "corotational": solid_forces.corotational_stress}.get(strain)
    terms: Any = (
        (solid_forces.StressTerm(EnergyStress(GEL.psi)),) if law is None else (solid_forces.StressTerm(law(MU, LAM)),)
    )
    parts = integrate_cells(mesh)
    energies = [Elastic(mesh.cells, parts.dNdX, parts.w, law_for(GEL, strain))]
    if selective:
        if "selective" not in mesh.element.integrations:
            pytest.skip("of linear hexahedra")
        shear, volume = shear_and_volume_laws(GEL, strain) or ()
        middle = mean_gradients(mesh)
        energies = [Elastic(mesh.cells, parts.dNdX, parts.w, shear), Elastic(mesh.cells, middle.dNdX, middle.w, volume)]
        two = (EnergyStress(shear.psi), EnergyStress(volume.psi)) if law is None else (law(MU, 0.0), law(0.0, LAM))
        terms = (solid_forces.StressTerm(two[0]), solid_forces.StressTerm(two[1], mean=True))
    g = Assembly(u.size, np.zeros(0, dtype=np.int64), energies, []).gradient(u.ravel(), 1.0)
    found, noise = solid_forces.CheckedBody(mesh.points, mesh.cells, mesh.kind, u, terms, 1.0).forces(mesh.cells)
    assert np.abs(found.ravel() - g).max() < SAME * np.abs(g).max()
    assert 0.0 < noise < 1e-12


def test_forces_with_one_rotation_for_each_cell(mesh: Mesh) -> None:
    u, parts, rest = bent(mesh), integrate_cells(mesh), np.eye(3)[None]
    law = law_for(GEL, "small")
    K = element_corotational.element_stiffness(parts.dNdX, parts.w, law.dPdF(rest)[0])
    energy = ElementCorotational(
        mesh.points, mesh.cells, element_corotational.mean_gradients(parts.dNdX, parts.w), K, rotations
    )
    g = np.zeros(u.size)
    energy.add_gradient(u.ravel(), g)
    term = solid_forces.StressTerm(solid_forces.small_strain_stress(MU, LAM))
    found, _ = solid_forces.CheckedBody(
        mesh.points, mesh.cells, mesh.kind, u, (term,), 1.0, rotated_measure=True
    ).forces(mesh.cells)
    assert np.abs(found.ravel() - g).max() < SAME * np.abs(g).max()


LAWS = [(n, "finite") for n in MATERIALS if mixed_for(made(n, 1.0, 0.3), "finite") is not None]
LAWS += [("neo_hookean", "small"), ("neo_hookean", "corotational")]


def pressed(mesh: Mesh, u: np.ndarray, law: str, strain: str, nu: float, own: np.ndarray | None) -> MixedBody:
    material = made(law, 1.0, nu)
    split = split_law(material, strain, 1.0, nu)
    assert split is not None
    return MixedBody(mesh.points, mesh.cells, mesh.kind, u, split, 0.5 / (1.0 + nu), own)


@pytest.mark.parametrize(("law", "strain"), LAWS)
@pytest.mark.parametrize("nu", [0.1, 0.2, 0.3, 0.5])
def test_forces_and_volumes_with_pressures(mesh: Mesh, law: str, strain: str, nu: float) -> None:
    """Any pressures, not those of an equilibrium."""
    if mesh.element.pressures is None:
        pytest.skip("has no pressures")
    material, u = made(law, 1.0, nu), bent(mesh)
    theirs = mixed_for(material, strain)
    assert theirs is not None
    energy = mixed_energy(mesh, integrate_cells(mesh), theirs, 0.5 / (1.0 + nu))
    x = np.concatenate([u.ravel(), 0.1 * np.random.default_rng(2).standard_normal(energy.dofs - u.size)])
    g = np.zeros(energy.dofs)
    energy.add_gradient(x, g)
    found, lacking, noise = pressed(mesh, u, law, strain, nu, energy.unit * x[energy.pressures]).forces()
    assert np.abs(found.ravel() - g[: u.size]).max() < SAME * np.abs(g).max()
    assert lacking == pytest.approx(np.linalg.norm(g[u.size :]), rel=SAME)
    assert 0.0 < noise < 1e-12


@pytest.mark.parametrize(("law", "strain"), LAWS)
def test_forces_of_the_mean_dilatation(law: str, strain: str) -> None:
    mesh = Cylinder(length=1.0, radius=0.4).mesh("hex8", 0.35)
    material, u, parts = made(law, 1.0, 0.45), bent(mesh), integrate_cells(mesh)
    theirs = mixed_for(material, strain)
    assert theirs is not None
    g, body = np.zeros(u.size), (mesh.cells, parts.dNdX, parts.w)
    energy = MeanDilatation(*body, theirs.shape, theirs.constraint, theirs.modulus)
    energy.add_gradient(u.ravel(), g)
    found, lacking, _ = pressed(mesh, u, law, strain, 0.45, None).forces()
    assert np.abs(found.ravel() - g).max() < SAME * np.abs(g).max()
    assert lacking == 0.0


MEASURES: dict[str, Any] = {
    "neo_hookean": lambda F: np.log(np.linalg.det(F)),
    "neo_hookean_isochoric": lambda F: np.linalg.det(F) - 1.0,
    "st_venant_kirchhoff": lambda F: 0.5 * (np.einsum("nij,nij->n", F, F) - 3.0),
    "stable_neo_hookean": lambda F: np.linalg.det(F) - 1.0,
    **dict.fromkeys(OWN, lambda F: np.linalg.det(F) - 1.0),
    "small": lambda F: np.trace(F, axis1=1, axis2=2) - 3.0,
    "corotational": lambda F: np.linalg.svd(F)[1].sum(axis=1) - 3.0,  # singular values, where det F > 0
}


def test_a_measure_of_volume_is_known_of_every_law_that_comes_apart() -> None:
    assert MEASURES.keys() - {"small", "corotational"} == {law for law, strain in LAWS if strain == "finite"}


@pytest.mark.parametrize(("law", "strain"), LAWS)
@pytest.mark.parametrize("mean", [True, False])
def test_forces_are_the_slope_of_an_energy_written_anew(law: str, strain: str, mean: bool) -> None:
    """The whole law less M/2 g^2 at each point; M/2 times the squared mean of g, or p g - p^2 / 2M, in each cell.

    M is the modulus that the documentation states: lam = 1.5 mu at nu = 0.3, less the mu / 3 that stays.
    """
    X = 0.5 * solid_forces.node_positions("hex8")
    points = np.concatenate([X, X[4:] + np.array([0.1, 0.0, 1.1])])
    cells = np.array([[0, 1, 2, 3, 4, 5, 6, 7], [4, 5, 6, 7, 8, 9, 10, 11]])
    K = 1.0 / (3.0 * 0.4) if strain != "finite" else (1.5 - 1.0 / 3.0) / 2.6
    mesh, own = Mesh(points, cells, "hex8"), np.array([[0.07], [-0.04]])
    whole = law_for(made(law, 1.0, 0.3), strain)
    measure = MEASURES[law if strain == "finite" else strain]
    xi, weights = solid_forces.quadrature_rule("hex8")
    dNdX, det = solid_forces.gradients(points, cells, "hex8", xi)

    def energy(u: np.ndarray) -> float:
        F = np.einsum("mai,mqaJ->mqiJ", u[cells], dNdX).reshape(-1, 3, 3) + np.eye(3)
        w, g = weights * det, measure(F).reshape(det.shape)
        total = (w * (whole.psi(F).reshape(w.shape) - 0.5 * K * g**2)).sum()
        if mean:
            V = w.sum(axis=1)
            return float(total + (0.5 * K * V * ((w * g).sum(axis=1) / V) ** 2).sum())
        return float(total + (w * (own * g - 0.5 * own**2 / K)).sum())

    u, found = bent(mesh), np.zeros_like(points)
    h = 1e-5  # of central differences: h^2 and eps / h leave about 1e-10 of energies of size one
    for n, i in np.ndindex(*u.shape):
        d = np.zeros_like(u)
        d[n, i] = h
        found[n, i] = (energy(u + d) - energy(u - d)) / (2.0 * h)
    forces, _, _ = pressed(mesh, u, law, strain, 0.3, None if mean else own).forces()
    assert np.abs(forces - found).max() < 1e-8 * max(1.0, np.abs(found).max())


def test_a_material_of_which_no_formula_is_known_is_left_alone() -> None:
    assert split_law(object(), "finite", 1.0, 0.3) is None


def test_pressure_on_the_deformed_surface(mesh: Mesh) -> None:
    u, g = bent(mesh), np.zeros(mesh.points.size)
    FollowerPressure(mesh.points, mesh.facets, 2.0).add_gradient(u.ravel(), g)
    found = solid_forces.surface_forces(mesh.points + u, mesh.facets, lambda dA: -2.0 * dA)
    assert np.abs(found.ravel() + g).max() < SAME * np.abs(g).max()
    assert found.sum(axis=0) == pytest.approx(np.zeros(3), abs=1e-12)  # a closed surface


@pytest.mark.parametrize("how", ["consistent", "lumped", "uniform"])
def test_weight(mesh: Mesh, how: str) -> None:
    from softmark.interpreter.models.shared.load_setup import nodal_mass

    own = mass_forces.nodal_masses(mesh.points, mesh.cells, mesh.kind, 3.0, how, len(mesh.points))
    theirs = nodal_mass(mesh, integrate_cells(mesh), 3.0, how)  # type: ignore[arg-type]
    assert own == pytest.approx(theirs, abs=1e-13)


def test_springs(mesh: Mesh) -> None:
    edges = np.unique(np.sort(mesh.cells[:, :2], axis=1), axis=0)
    k, u, g = np.linspace(1.0, 2.0, len(edges)), bent(mesh), np.zeros(mesh.points.size)
    Springs(edges, mesh.points[edges[:, 1]] - mesh.points[edges[:, 0]], k).add_gradient(u.ravel(), g)
    found, _ = solid_forces.spring_forces(mesh.points, edges, k, u)
    assert np.abs(found.ravel() - g).max() < SAME * np.abs(g).max()


def test_cells_inside_out_are_seen_at_their_nodes_too() -> None:
    points = solid_forces.node_positions("hex8") * 0.5
    u = np.zeros((8, 3))
    u[6] = -0.4  # towards the middle: det F is positive at the eight Gauss points and not at the corner
    mesh = Mesh(points, np.arange(8)[None], "hex8")
    parts = integrate_cells(mesh)
    inner = np.linalg.det(Elastic(mesh.cells, parts.dNdX, parts.w, law_for(GEL, "finite")).F(u.ravel()))
    least, strain = solid_forces.CheckedBody(points, mesh.cells, "hex8", u, (), 1.0).volumes()
    assert inner.min() > 0.0 > least[0]
    assert strain[0] > 0.1


def test_a_sample_of_a_large_mesh_has_whole_nodes() -> None:
    mesh = Cylinder(length=1.0, radius=0.4).mesh("tet4", 0.1)
    u, term = bent(mesh), solid_forces.StressTerm(solid_forces.small_strain_stress(MU, LAM))
    body = solid_forces.CheckedBody(mesh.points, mesh.cells, "tet4", u, (term,), 1.0)
    chosen, cells = solid_forces.sample_nodes(
        len(mesh.points), mesh.cells, solid_forces.MANY
    )  # as if it were very large
    assert chosen is not None
    whole, part = body.forces(mesh.cells)[0], body.forces(cells)[0]
    assert part[chosen] == pytest.approx(whole[chosen], abs=1e-14)


def test_forces_of_rods() -> None:
    """The gradient of the quaternion rod, in space and not about its own axes, for a rod bent and twisted at random."""
    n, rng = 6, np.random.default_rng(3)
    rest = rod_at_rest(np.linspace([0, 0, 0], [1.0, 0, 0], n), np.array([0.0, 0.0, 1.0]))
    x = RodSpace(n).move(rest, 0.3 * rng.standard_normal(6 * n))
    C = RodStiffness(50.0, 20.0, 30.0, 0.5, 1.0, 2.0)
    g = np.zeros(6 * n)
    RodElastic(rest, chain_elements(n), C).add_gradient(x, g)
    R = rotation(x.reshape(-1, 7)[:, 3:])
    space = g.reshape(n, 6).copy()
    space[:, 3:] = np.einsum("nij,nj->ni", R, space[:, 3:])
    found, _ = CheckedRod(x.reshape(-1, 7)[:, :3], R, np.full(n - 1, 0.2), C.diagonal).forces()
    assert np.abs(found - space).max() < SAME * np.abs(space).max()


def test_rotation_vectors() -> None:
    theta = np.random.default_rng(0).uniform(-1.0, 1.0, (50, 3)) * np.logspace(-9, 0.2, 50)[:, None]
    assert rotation_vector(exponential(theta)) == pytest.approx(theta, rel=1e-9, abs=1e-16)
    d = 1e-6 * np.ones((50, 3))  # central differences of the exponential: exact to 1e-12 / 1e-6
    step = rotation_vector(exponential(theta + d) @ exponential(theta - d).transpose(0, 2, 1))
    assert np.einsum("nij,nj->ni", left_jacobian(theta), 2.0 * d) == pytest.approx(step, abs=1e-11)
