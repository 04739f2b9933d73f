"""Stress and strain recovered from solved meshes: orders, exact states, closed forms, and another code."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from equal_moduli import made

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.assembly.mixed_elements import mixed_energy
from softmark.solvers.energies.elastic_energy import Elastic
from softmark.solvers.energies.energy import Energy, VectorSpace
from softmark.solvers.energies.external_loads import DeadForces
from softmark.solvers.energies.mixed_displacement_pressure import DisplacementEnergy, MeanDilatation, MixedSolid
from softmark.solvers.linear.linear_solver import LinearSolverOptions
from softmark.solvers.materials import MATERIALS, Isotropic, law_for, mixed_for
from softmark.solvers.mesh import element_interpolation
from softmark.solvers.mesh.element_interpolation import integrate_cells
from softmark.solvers.mesh.mesh import Mesh, jacobians
from softmark.solvers.mesh.shapes import Box
from softmark.solvers.statics.static_equilibrium import Statics, equilibrium
from softmark.solvers.stress_recovery.multi_material_recovery import MultiMaterialStresses
from softmark.solvers.stress_recovery.sampling_point_stress import DeformedState, superconvergent_points
from softmark.solvers.stress_recovery.stress_field import Stresses
from softmark.solvers.stress_recovery.stress_measures import Tensors, extract_component, full_tensors
from tests.solvers import test_orders_solids as orders

POISSON, YOUNG, MU, LAM = orders.POISSON, orders.YOUNG, orders.MU, orders.LAM
KINDS = ("tet4", "tet10", "hex8", "hex20", "hex27")


def material(law: str = "linear_elastic", poisson: float = POISSON) -> Isotropic:
    return made(law, YOUNG, poisson)


def six(sigma: np.ndarray) -> np.ndarray:
    return np.stack([sigma[:, i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))], axis=1)


# ------------------------------------------------------------------ orders over manufactured solutions


def exact_stress(X: np.ndarray, law: str) -> np.ndarray:
    """Of the manufactured displacements (n, 6), written out: Hooke's, or tau/J of the neo-Hookean solid."""
    H = orders.slope(X)
    if law == "small":
        eps = 0.5 * (H + H.swapaxes(1, 2))
        return six(2 * MU * eps + LAM * np.trace(eps, axis1=1, axis2=2)[:, None, None] * np.eye(3))
    F = H + np.eye(3)
    J = np.linalg.det(F)[:, None, None]
    return six((MU * (F @ F.swapaxes(1, 2) - np.eye(3)) + LAM * np.log(J) * np.eye(3)) / J)


def solved(kind: str, way: str, law: str, n: int, poisson: float = POISSON) -> tuple[orders.Sampled, Stresses]:
    """The manufactured problem on a warped cube of n edges along each side; mixed ones at any Poisson's ratio."""
    points = orders.sampled(orders.warped(Box((1.0, 1.0, 1.0)).mesh(kind, 1.0 / n)))
    mesh, strain = points.mesh, "small" if law == "small" else "finite"
    own = material("linear_elastic" if law == "small" else "neo_hookean", poisson)
    fixed = np.flatnonzero(np.repeat(np.isin(np.arange(len(mesh.points)), mesh.facets), 3))
    load: Energy = DeadForces(points.nodal(getattr(orders, law)))
    parts, dofs = integrate_cells(mesh), mesh.points.size
    if way in ("full", "selective"):
        name = "linear_elastic" if law == "small" else "neo_hookean"
        energy = orders.energy(mesh, name, strain, way)
    else:
        split = mixed_for(own, strain)
        assert split is not None
        if way == "mixed":
            energy = mixed_energy(mesh, parts, split, own.shear_modulus)
            load, dofs = DisplacementEnergy(load, dofs), energy.dofs
        else:
            energy = MeanDilatation(mesh.cells, parts.dNdX, parts.w, split.shape, split.constraint, split.modulus)
    assembly = Assembly(dofs, fixed, [energy], [load])
    rest, to = np.zeros(dofs), np.zeros(len(fixed))
    spare = energy.spare[assembly.free] if isinstance(energy, MixedSolid) else None
    convex = law == "small" and spare is None
    task = Statics(assembly, VectorSpace(dofs), rest, fixed, to, convex=convex, linear=LinearSolverOptions(spare=spare))
    x = equilibrium(task).x
    pressures = energy.unit * x[energy.pressures] if isinstance(energy, MixedSolid) else None
    u = x[: mesh.points.size].reshape(-1, 3)
    return points, Stresses(DeformedState(mesh, own, strain, u, way, pressures))


def errors(kind: str, way: str, law: str, n: int) -> np.ndarray:
    """L2 errors of the stresses of the cells, and of those recovered, relative to the stress."""
    points, found = solved(kind, way, law, n)
    shape, exact = (*points.w.shape, 6), exact_stress(points.X.reshape(-1, 3), law)
    nodal = found.at_nodes().six
    recovered = np.einsum("qa,mak->mqk", points.N, nodal[points.mesh.cells])
    raw = found.state.sampled(orders.quadrature(kind))[1]
    apart = [((s - exact.reshape(shape)) ** 2).sum(axis=2) for s in (raw, recovered, 0.0)]
    own, better, whole = (np.sqrt(np.sum(points.w * a)) for a in apart)
    return np.array([own / whole, better / whole])


# measured in warped cubes, orders of the cells' own stress and of what is recovered, and both errors on the finer mesh
ORDERS = [
    ("tet4", "full", "small", (8, 12)),
    ("tet4", "full", "neo_hookean", (8, 12)),
    ("hex8", "full", "small", (8, 12)),
    ("hex8", "full", "neo_hookean", (8, 12)),
    ("hex8", "selective", "small", (8, 12)),
    ("hex8", "mean_dilatation", "small", (8, 12)),
    ("hex8", "mean_dilatation", "neo_hookean", (8, 12)),
    ("hex8", "mixed", "small", (8, 12)),
    ("tet10", "full", "small", (6, 8)),
    ("tet10", "full", "neo_hookean", (6, 8)),
    ("tet10", "mixed", "small", (6, 8)),
    ("hex20", "full", "small", (6, 8)),
    ("hex20", "full", "neo_hookean", (6, 8)),
    ("hex20", "mixed", "small", (4, 6)),
    ("hex27", "full", "small", (4, 6)),
    ("hex27", "mixed", "small", (4, 6)),
]


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "way", "law", "edges"), ORDERS)
def test_order_of_recovered_stress(kind: str, way: str, law: str, edges: tuple[int, int]) -> None:
    """At least 1.5 of linear elements and 2.5 of quadratic ones, and nearer than what the cells have."""
    rows = [errors(kind, way, law, n) for n in edges]
    found = orders.slopes(rows, edges)[1]
    assert found >= (1.5 if kind in ("tet4", "hex8") else 2.5)
    assert rows[-1][1] < rows[-1][0]


# ------------------------------------------------------------------ states that are exact

TURN = np.linalg.qr(np.array([[0.3, -1.0, 0.2], [0.9, 0.4, -0.5], [0.1, 0.6, 0.8]]))[0]
TURN = TURN * np.sign(np.linalg.det(TURN))
STRETCH = np.array([[1.2, 0.1, 0.0], [0.1, 0.9, 0.05], [0.0, 0.05, 1.1]])


def affine(kind: str, law: str, strain: str, way: str, F: np.ndarray) -> Tensors:
    """A warped cube under one deformation gradient, looked at in some points."""
    mesh = orders.warped(Box((1.0, 1.0, 1.0)).mesh(kind, 0.5))
    state = DeformedState(mesh, material(law), strain, mesh.points @ (F - np.eye(3)).T, way)
    return Stresses(state).at(np.array([[0.5, 0.5, 0.5], [0.0, 0.0, 0.0], [0.31, 1.0, 0.77]]))


@pytest.mark.parametrize("kind", KINDS)
def test_a_patch_has_the_stress_of_its_law(kind: str) -> None:
    """Of a homogeneous deformation, to rounding, in corners too: a polynomial is fitted to what is constant."""
    for law, strain in (("linear_elastic", "small"), ("linear_elastic", "corotational"), ("neo_hookean", "finite")):
        F = TURN @ STRETCH if strain != "small" else np.eye(3) + 1e-3 * (STRETCH - np.eye(3)) @ TURN
        P = law_for(material(law), strain).P(F[None])[0]
        sigma = P if strain == "small" else P @ F.T / np.linalg.det(F)
        found = affine(kind, law, strain, "full", F)
        np.testing.assert_allclose(found.cauchy, np.broadcast_to(sigma, (3, 3, 3)), atol=1e-10 * np.abs(sigma).max())
        np.testing.assert_allclose(found.F, np.broadcast_to(F, (3, 3, 3)), atol=1e-12)
        np.testing.assert_allclose(found.nominal, np.broadcast_to(P, (3, 3, 3)), atol=1e-9 * np.abs(P).max())


@pytest.mark.parametrize("way", ["selective", "mean_dilatation"])
@pytest.mark.parametrize(("law", "strain"), [("linear_elastic", "corotational"), ("neo_hookean", "finite")])
def test_ways_to_keep_the_volume_agree_on_a_patch(way: str, law: str, strain: str) -> None:
    full_, other = (affine("hex8", law, strain, w, TURN @ STRETCH) for w in ("full", way))
    np.testing.assert_allclose(other.six, full_.six, atol=1e-9 * np.abs(full_.six).max())


def test_a_turn_turns_the_stress() -> None:
    """sigma(R U) = R sigma(U) R^T, and a rotation alone has none: not by small strains, which it is refused of."""
    still, turned = (affine("tet10", "neo_hookean", "finite", "full", F) for F in (STRETCH, TURN @ STRETCH))
    np.testing.assert_allclose(turned.cauchy, TURN @ still.cauchy @ TURN.T, atol=1e-9 * np.abs(still.cauchy).max())
    assert np.abs(affine("hex8", "linear_elastic", "corotational", "full", TURN).six).max() < 1e-10 * YOUNG


def test_one_layer_of_linear_hexahedra_bends() -> None:
    """Its centres lie in one plane: Gauss points tell the slope. u_x = -x z / R, E z / R of the fibres."""
    mesh = Box((1.0, 0.1, 0.1), (0.0, 0.0, -0.05)).mesh("hex8", 0.1)
    x, y, z = mesh.points.T
    nu, R = 0.0, 50.0
    u = np.stack([-x * z / R, nu * y * z / R, x**2 / (2 * R)], axis=1)
    found = Stresses(DeformedState(mesh, material(poisson=nu), "small", u))
    edge = found.at(np.array([[0.5, 0.05, 0.05], [0.5, 0.05, -0.05]])).cauchy[:, 0, 0]
    np.testing.assert_allclose(edge, [-YOUNG * 0.05 / R, YOUNG * 0.05 / R], rtol=1e-9)


# ------------------------------------------------------------------ numbers of tensors


def test_numbers_of_a_tensor() -> None:
    """Uniaxial and simple shear: von Mises s and sqrt(3) t; principal s, 0, 0 and t, 0, -t; pressure -s/3."""
    sigma = full_tensors(np.array([[3.0, 0, 0, 0, 0, 0], [0, 0, 0, 2.0, 0, 0]]))
    np.testing.assert_allclose(extract_component(sigma, "von_mises"), [3.0, 2.0 * 3**0.5])
    np.testing.assert_allclose(extract_component(sigma, "principal_1"), [3.0, 2.0])
    np.testing.assert_allclose(extract_component(sigma, "principal_3"), [0.0, -2.0], atol=1e-15)
    np.testing.assert_allclose(extract_component(sigma, "pressure"), [-1.0, 0.0])
    np.testing.assert_allclose(extract_component(sigma, "xy"), [0.0, 2.0])


def test_strains_and_stretches() -> None:
    """Of F = R diag(2, 1/2, 1): Green 3/2 and -3/8, Biot 1 and -1/2, logarithmic ln 2 and -ln 2; J = 1."""
    H = (TURN @ np.diag([2.0, 0.5, 1.0]) - np.eye(3)).reshape(1, 9)
    found = Tensors(np.zeros((1, 6)), H, False)
    for measure, values in (("green", (1.5, -0.375)), ("biot", (1.0, -0.5)), ("logarithmic", (np.log(2), -np.log(2)))):
        np.testing.assert_allclose(np.diag(found.strain(measure)[0])[:2], values, atol=1e-12)
    for component, value in (("principal_1", 2.0), ("principal_3", 0.5), ("x", 2.0), ("y", 0.5), ("volume", 1.0)):
        np.testing.assert_allclose(found.stretches(component), value, rtol=1e-12)


# ------------------------------------------------------------------ closed forms


def ring(kind: str, n: int) -> tuple[Mesh, np.ndarray]:
    """The thick cylinder of radii 1 and 2 under unit pressure, solved in plane strain (tests of orders)."""
    mesh, _ = orders.quarter(kind, n, lambda t: 1 + t, False)
    return mesh, orders.lame(mesh.points)


@pytest.mark.parametrize(("kind", "rtol"), [("tet10", 0.02), ("hex8", 0.05), ("hex20", 0.01)])
def test_hoop_stress_of_a_thick_cylinder(kind: str, rtol: float) -> None:
    """REFERENCES 3.3: s_tt(1) = 5/3 and s_rr(1) = -1, from the nodal values of the exact displacements."""
    mesh, u = ring(kind, 8)
    found = (
        Stresses(DeformedState(mesh, material(), "small", u)).at(np.array([[1.0, 0.0, 0.1], [0.0, 1.0, 0.1]])).cauchy
    )
    np.testing.assert_allclose([found[0, 1, 1], found[1, 0, 0]], 5 / 3, rtol=rtol)
    np.testing.assert_allclose([found[0, 0, 0], found[1, 1, 1]], -1.0, atol=rtol * 5 / 3)


def test_stress_of_another_code() -> None:
    """scikit-fem's stress in the middle of four-node tetrahedra, of the same displacements."""
    skfem = pytest.importorskip("skfem")
    from skfem.helpers import sym_grad
    from skfem.models.elasticity import linear_stress

    mesh = Box((1.0, 1.0, 1.0)).mesh("tet4", 0.5)
    u = orders.exact(mesh.points)
    theirs = skfem.Basis(
        skfem.MeshTet(mesh.points.T, mesh.cells.T), skfem.ElementVector(skfem.ElementTetP1()), intorder=1
    )
    x = np.zeros(theirs.N)
    x[theirs.nodal_dofs] = u.T
    sigma = linear_stress(LAM, MU)(sym_grad(theirs.interpolate(x)))  # (3, 3, m, q)
    _, own, _ = DeformedState(mesh, material(), "small", u).sampled(superconvergent_points(mesh.element))
    expected = six(np.moveaxis(np.asarray(sigma)[..., 0], -1, 0))
    np.testing.assert_allclose(own[:, 0], expected, atol=1e-10 * np.abs(expected).max())


# ------------------------------------------------------------------ several materials

LAYERS = ((1.0, 0.1), (4.0, 0.4))  # moduli of Young in Pa, and Poisson's ratios


def jumping(X: np.ndarray, side: int) -> tuple[np.ndarray, np.ndarray]:
    """Displacements (n, 3) that are zero at x = 1/2, and stress (n, 3, 3) whose xx, xy and xz are continuous there.

    (x - 1/2) (p / (lam + 2 mu), q / mu, r / mu): yy, zz and all strains jump.
    """
    E, nu = LAYERS[side]
    mu, lam = E / (2 * (1 + nu)), E * nu / ((1 + nu) * (1 - 2 * nu))
    x, y, z = X.T
    s, size = x - 0.5, np.array([1 / (lam + 2 * mu), 1 / mu, 1 / mu])
    v = np.stack([np.sin(2 * y + x), np.cos(2 * z) * (1 + x), np.exp(y * z)], axis=1)
    H = np.zeros((len(X), 3, 3))
    H[:, :, 0] = v + s[:, None] * np.stack([np.cos(2 * y + x), np.cos(2 * z), 0 * x], axis=1)
    H[:, :, 1] = s[:, None] * np.stack([2 * np.cos(2 * y + x), 0 * x, z * np.exp(y * z)], axis=1)
    H[:, :, 2] = s[:, None] * np.stack([0 * x, -2 * np.sin(2 * z) * (1 + x), y * np.exp(y * z)], axis=1)
    H *= size[None, :, None]
    eps = 0.5 * (H + H.swapaxes(1, 2))
    return s[:, None] * v * size, 2 * mu * eps + lam * np.trace(eps, axis1=1, axis2=2)[:, None, None] * np.eye(3)


def body_force(X: np.ndarray, side: int) -> np.ndarray:
    """-div sigma (n, 3), by central differences."""
    h = 1e-5
    slopes = [(jumping(X + h * e, side)[1] - jumping(X - h * e, side)[1])[:, :, j] for j, e in enumerate(np.eye(3))]
    found: np.ndarray = -np.sum(slopes, axis=0) / (2 * h)
    return found


def layered(kind: str, n: int) -> tuple[Mesh, np.ndarray, MultiMaterialStresses]:
    """A cube of two materials that meet at x = 1/2, solved with their displacements on its surface."""
    mesh = Box((1.0, 1.0, 1.0)).mesh(kind, 1.0 / n)
    owners = (mesh.points[mesh.cells].mean(axis=1)[:, 0] > 0.5).astype(np.int64)
    fixed = np.flatnonzero(np.repeat(np.isin(np.arange(len(mesh.points)), mesh.facets), 3))
    outer, parts = mesh.points[:, 0] > 0.5, integrate_cells(mesh)
    u = np.where(outer[:, None], jumping(mesh.points, 1)[0], jumping(mesh.points, 0)[0])
    xi, weights = mesh.element.mass_quadrature()
    N, w = mesh.element.shape(xi), jacobians(mesh, xi) * weights
    X = np.einsum("qa,mai->mqi", N, mesh.points[mesh.cells])
    f = np.stack([body_force(X[m], int(side)) for m, side in enumerate(owners)])
    nodal = np.zeros_like(mesh.points)
    np.add.at(nodal, mesh.cells, np.einsum("mq,qa,mqi->mai", w, N, f))
    materials = tuple(MATERIALS["linear_elastic"](E, nu, 1.0) for E, nu in LAYERS)
    energies = [
        Elastic(mesh.cells[own], parts.dNdX[own], parts.w[own], law_for(materials[side], "small"))
        for side, own in ((side, np.flatnonzero(owners == side)) for side in (0, 1))
    ]
    dofs = mesh.points.size
    assembly = Assembly(dofs, fixed, energies, [DeadForces(nodal.ravel())])
    task = Statics(assembly, VectorSpace(dofs), np.zeros(dofs), fixed, u.ravel()[fixed], convex=True)
    x = equilibrium(task).x.reshape(-1, 3)
    return mesh, owners, MultiMaterialStresses.of(DeformedState(mesh, materials[0], "small", x), materials, owners)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "edges"), [("tet4", (8, 12)), ("hex8", (8, 12)), ("tet10", (4, 6)), ("hex20", (4, 6))]
)
def test_order_of_stress_recovered_in_each_of_two_materials(kind: str, edges: tuple[int, int]) -> None:
    """At least 1.5 of linear elements and 2.5 of quadratic ones, as in one material; across both it is none at all."""
    rows = []
    for n in edges:
        mesh, owners, found = layered(kind, n)
        xi, weights = mesh.element.mass_quadrature()
        w = jacobians(mesh, xi) * weights
        X = np.einsum("qa,mai->mqi", mesh.element.shape(xi), mesh.points[mesh.cells])
        exact = np.stack([six(jumping(X[m], int(side))[1]) for m, side in enumerate(owners)]).reshape(-1, 6)
        whole = Stresses(found.state)  # as if all were of one material, which it is not
        errors = [np.sqrt(w.ravel() @ ((s.at(X.reshape(-1, 3)).six - exact) ** 2).sum(axis=1)) for s in (found, whole)]
        rows.append(errors)
        assert errors[0] < 0.5 * errors[1]
    order = np.log(rows[0][0] / rows[1][0]) / np.log(edges[1] / edges[0])
    assert order >= (1.5 if kind in ("tet4", "hex8") else 2.5), (order, rows)


def test_each_side_of_a_border_has_its_own_stress() -> None:
    """A laminate stretched alike: E eps in each material to rounding, up to the border, and beyond it at once."""
    mesh = Box((1.0, 1.0, 1.0)).mesh("hex8", 0.25)
    owners = (mesh.points[mesh.cells].mean(axis=1)[:, 1] > 0.5).astype(np.int64)
    materials = tuple(MATERIALS["linear_elastic"](E, 0.0, 1.0) for E in (2.0, 10.0))
    found = MultiMaterialStresses.of(
        DeformedState(mesh, materials[0], "small", mesh.points * [0.1, 0.0, 0.0]), materials, owners
    )
    X = np.array([[0.3, 0.5 - 1e-6, 0.4], [0.3, 0.5 + 1e-6, 0.4], [0.3, 0.5, 0.4]])
    np.testing.assert_allclose(found.at(X).cauchy[:, 0, 0], [0.2, 1.0, 1.0], rtol=1e-12)  # on it that of the stiffer
    assert found.count_interface_points(X) == 1
    np.testing.assert_allclose(found.unresolved(X), 0.0, atol=1e-12)
    nodes = found.at_nodes().cauchy[:, 0, 0]
    np.testing.assert_allclose(nodes, np.where(mesh.points[:, 1] < 0.49, 0.2, 1.0), rtol=1e-12)
    np.testing.assert_allclose(found.usual[:2], [np.sqrt(0.5 * (0.2**2 + 1.0)), 0.1], rtol=1e-9)


def test_cells_whose_nodes_are_all_on_borders_have_a_stress_of_their_own() -> None:
    """A core one cell thick: every node of it is one of the skins too, and no point within it is."""
    mesh = Box((1.0, 1.0, 1.0)).mesh("hex8", 1.0 / 3.0)
    middle = mesh.points[mesh.cells].mean(axis=1)[:, 1]
    lines = np.unique(np.round(mesh.points[:, 1], 9))
    owners = ((middle > lines[1]) & (middle < lines[2])).astype(np.int64)
    materials = tuple(MATERIALS["linear_elastic"](E, 0.0, 1.0) for E in (2.0, 10.0))
    found = MultiMaterialStresses.of(
        DeformedState(mesh, materials[0], "small", mesh.points * [0.1, 0.0, 0.0]), materials, owners
    )
    y = np.array([0.5 * lines[1], lines[1], 0.5 * (lines[1] + lines[2]), lines[2], 0.99])
    X = np.stack([np.full(5, 0.3), y, np.full(5, 0.4)])
    np.testing.assert_allclose(found.at(X.T.copy()).cauchy[:, 0, 0], [0.2, 1.0, 1.0, 1.0, 0.2], rtol=1e-12)
    assert found.count_interface_points(X.T.copy()) == 2


def test_all_nodes_after_those_of_one_material_have_a_stress() -> None:
    """One cell of each material: once the nodes of one were asked for, what is left of the mesh is not its own."""
    points = np.array([[x, y, z] for x in range(3) for y in range(2) for z in range(2)], dtype=float)
    cells = np.array([[0, 4, 6, 2, 1, 5, 7, 3], [4, 8, 10, 6, 5, 9, 11, 7]])
    mesh = Mesh(points, cells, "hex8")
    materials = tuple(MATERIALS["linear_elastic"](E, 0.0, 1.0) for E in (2.0, 10.0))
    found = MultiMaterialStresses.of(
        DeformedState(mesh, materials[0], "small", points * [0.1, 0.0, 0.0]), materials, np.array([0, 1])
    )
    found.at(np.array([[1.5, 0.5, 0.5]]))
    nodes = found.at_nodes().cauchy[:, 0, 0]
    np.testing.assert_allclose(nodes, np.where(points[:, 0] < 0.5, 0.2, 1.0), rtol=1e-12)


def test_points_of_several_probes_are_found_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nine sets of points asked in turn, in two layers: each is found once in the whole mesh, and in no layer again.

    Before, four sets were kept, so that a fifth probe made all of them be looked for again by every metric, three times
    in a body of two materials. What is on the border is looked for in
    the layer as well that the cell is not of.
    """
    counted: list[int] = []
    searched = element_interpolation._locate_in_curved_cells

    def counting(mesh: Mesh, X: np.ndarray) -> Any:
        counted.append(len(X))
        return searched(mesh, X)

    monkeypatch.setattr(element_interpolation, "_locate_in_curved_cells", counting)
    mesh = Box((1.0, 1.0, 1.0)).mesh("hex8", 0.25)
    owners = (mesh.points[mesh.cells].mean(axis=1)[:, 1] > 0.5).astype(np.int64)
    materials = tuple(MATERIALS["linear_elastic"](E, 0.0, 1.0) for E in (2.0, 10.0))
    found = MultiMaterialStresses.of(
        DeformedState(mesh, materials[0], "small", mesh.points * [0.1, 0.0, 0.0]), materials, owners
    )
    rng = np.random.default_rng(5)
    sets = [rng.uniform(0.01, 0.49, (k + 1, 3)) for k in range(9)]
    for k in (1, 3, 5, 7):
        sets[k][:, 1] += 0.5
    sets[4][:3, 1] += 0.5  # some in each
    for _ in range(3):
        for k, X in enumerate(sets):
            expected = np.where(X[:, 1] < 0.5, 0.2, 1.0)
            np.testing.assert_allclose(found.at(X).cauchy[:, 0, 0], expected, rtol=1e-12, err_msg=str(k))
            found.unresolved(X)
    assert counted == list(range(1, 10))
    at_the_border = np.array([[0.3, 0.5, 0.4], [0.2, 0.3, 0.2]])
    found.at(at_the_border)
    assert sorted(counted[9:]) == [1, 2]


def test_many_points_do_not_stay(monkeypatch: pytest.MonkeyPatch) -> None:
    """At most 64 sets, and so many points of all but the last four together."""
    monkeypatch.setattr(element_interpolation, "KEPT", (4, 64, 500))
    mesh = Box((1.0, 1.0, 1.0)).mesh("tet4", 0.5)
    rng = np.random.default_rng(6)
    for _ in range(70):
        element_interpolation.locate_points(mesh, rng.random((3, 3)))
    kept = mesh.selections[element_interpolation.locate_points]
    assert len(kept) == 64
    for _ in range(6):
        element_interpolation.locate_points(mesh, rng.random((200, 3)))
    assert [len(X) for X, _ in kept] == [200] * 4


def test_a_step_moves_a_state_once() -> None:
    """All metrics ask for the same state next to it, whose recovery is shared."""
    mesh = Box((1.0, 1.0, 1.0)).mesh("hex8", 0.5)
    material = MATERIALS["linear_elastic"](2.0, 0.0, 1.0)
    state = DeformedState(mesh, material, "small", mesh.points * [0.1, 0.0, 0.0])
    steps = [mesh.points * [0.2, 0.0, 0.0], mesh.points * [0.3, 0.0, 0.0]]
    for found in (
        Stresses(state),
        MultiMaterialStresses.of(state, (material,), np.zeros(len(mesh.cells), dtype=np.int64)),
    ):
        assert found.moved(steps[0]) is found.moved(steps[0])
        for step, stress in zip(steps, (0.6, 0.8), strict=True):
            np.testing.assert_allclose(found.moved(step).at(mesh.points[:3]).cauchy[:, 0, 0], stress, rtol=1e-12)
        np.testing.assert_allclose(found.at(mesh.points[:3]).cauchy[:, 0, 0], 0.2, rtol=1e-12)
