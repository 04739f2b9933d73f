"""Elements with pressures: derivatives, patches, Lamé's sphere, the inf-sup value, and the incompressible limit."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from equal_moduli import made
from hollow_sphere_octant import octant
from inf_sup import inf_sup
from scipy import sparse
from scipy.sparse.linalg import spsolve

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.assembly.mixed_elements import mixed_energy
from softmark.solvers.elements import ELEMENTS
from softmark.solvers.energies.elastic_energy import Elastic
from softmark.solvers.energies.energy import Energy, Floats, VectorSpace
from softmark.solvers.energies.external_loads import DeadForces, FollowerPressure
from softmark.solvers.energies.mixed_displacement_pressure import DisplacementEnergy, MeanDilatation, MixedSolid
from softmark.solvers.linear.factorisations import factor
from softmark.solvers.linear.saddle_point import factor as saddle_factor
from softmark.solvers.materials import MATERIALS, law_for, mixed_for
from softmark.solvers.materials.isochoric_split import IsochoricMaterial
from softmark.solvers.mesh.cell_splitting import add_midside_nodes
from softmark.solvers.mesh.element_interpolation import integrate_cells
from softmark.solvers.mesh.mesh import Mesh
from softmark.solvers.mesh.pressure_interpolation import build_pressure_space
from softmark.solvers.mesh.shapes import Box
from softmark.solvers.statics.static_equilibrium import Equilibrium, LinearSolverOptions, Statics, equilibrium

FINITE = ("neo_hookean", "neo_hookean_isochoric", "st_venant_kirchhoff")


def material(name: str, poisson: float, young: float = 1.0) -> Any:
    """A material of density 1."""
    return made(name, young, poisson)


def formed(mesh: Mesh, form: str, what: Any, strain: str) -> Energy:
    """The energy of a formulation: displacement, mixed or mean_dilatation."""
    parts = integrate_cells(mesh)
    body = (mesh.cells, parts.dNdX, parts.w)
    if form == "displacement":
        return Elastic(*body, law_for(what, strain))
    split = mixed_for(what, strain)
    assert split is not None
    if form == "mixed":
        return mixed_energy(mesh, parts, split, what.shear_modulus)
    return MeanDilatation(*body, split.shape, split.constraint, split.modulus)


def solved(
    mesh: Mesh, form: str, what: Any, strain: str, f: Floats, fixed: Any, target: Any = None
) -> tuple[Floats, Equilibrium, Energy]:
    """Displacements (n, 3) under dead forces f, the equilibrium and its energy."""
    energy, n = formed(mesh, form, what, strain), mesh.points.size
    dofs = getattr(energy, "dofs", n)
    load: Any = DeadForces(f.ravel())
    assembly = Assembly(dofs, fixed, [energy], [load if dofs == n else DisplacementEnergy(load, n)])
    spare = energy.spare[assembly.free] if isinstance(energy, MixedSolid) else None
    twin = assembly.with_internal([formed(mesh, form, what, "corotational")]) if strain == "finite" else None
    goal = np.zeros(len(fixed)) if target is None else target
    problem = Statics(
        assembly, VectorSpace(dofs), np.zeros(dofs), fixed, goal, 1e-9, twin=twin, convex=strain == "small",
        extent=mesh.extent, linear=LinearSolverOptions(spare=spare),
    )  # fmt: skip
    found = equilibrium(problem)
    return found.x[:n].reshape(-1, 3), found, energy


def on(mesh: Mesh, axis: int, value: float) -> Any:
    """Nodes of a coordinate plane."""
    return np.flatnonzero(np.abs(mesh.points[:, axis] - value) < 1e-9)


def all_of(nodes: Any) -> Any:
    """All three degrees of freedom of nodes."""
    return (3 * nodes[:, None] + np.arange(3)).ravel()


# ------------------------------------------------------------------ derivatives


def distorted(kind: str) -> Mesh:
    """A small mesh whose cells are not alike; edges stay straight, which quadrature is exact for."""
    mesh = Box((1.0, 0.8, 0.6)).mesh(ELEMENTS[kind].linear, 0.5)
    shake = 0.04 * np.sin(37.0 * mesh.points[:, [1, 2, 0]] + mesh.points)
    return add_midside_nodes(Mesh(mesh.points + shake, mesh.cells, mesh.kind), ELEMENTS[kind])


FORMS = [(kind, form) for kind, element in ELEMENTS.items() for form in element.formulations[1:]]
CASES = [("small", "linear_elastic"), ("corotational", "linear_elastic"), *(("finite", name) for name in FINITE)]


@pytest.mark.parametrize(("strain", "law"), CASES)
@pytest.mark.parametrize(("kind", "form"), FORMS)
def test_forces_and_tangents_are_derivatives(kind: str, form: str, strain: str, law: str) -> None:
    """Against central differences of value and gradient, steps of 1e-6: errors of 1e-9 of the largest entry or so."""
    mesh = distorted(kind)
    energy = formed(mesh, form, material(law, 0.5 if form == "mixed" else 0.45), strain)
    dofs, rng = int(getattr(energy, "dofs", mesh.points.size)), np.random.default_rng(1)
    x = 0.03 * rng.standard_normal(dofs)
    assembly = Assembly(dofs, np.zeros(0, dtype=np.int64), [energy], [])
    g, K = assembly.gradient(x, 1.0), assembly.tangent(x, 1.0).toarray()
    assert np.allclose(K, K.T, atol=1e-12 * np.abs(K).max())
    for d in np.eye(dofs)[rng.choice(dofs, 6, replace=False)]:
        ends = [x + 1e-6 * d, x - 1e-6 * d]
        slope = (energy.value(ends[0]) - energy.value(ends[1])) / 2e-6
        assert g @ d == pytest.approx(slope, abs=1e-7 * np.abs(g).max())
        bent = (assembly.gradient(ends[0], 1.0) - assembly.gradient(ends[1], 1.0)) / 2e-6
        assert np.allclose(K @ d, bent, atol=1e-7 * np.abs(K).max())


def test_expected_pressures_leave_forces_alone() -> None:
    """What a step promises enters the tangent only; with the step of zero it is the tangent itself."""
    energy = formed(distorted("hex8"), "mean_dilatation", material("neo_hookean", 0.49), "finite")
    assert isinstance(energy, MeanDilatation)
    dofs = int(energy.stencils.max()) + 1
    x = 0.02 * np.random.default_rng(2).standard_normal(dofs)
    promised = energy.with_predicted_pressures(x, np.zeros(dofs))
    both = [Assembly(dofs, np.zeros(0, dtype=np.int64), [e], []) for e in (energy, promised)]
    K, expected = (a.tangent(x, 1.0).toarray() for a in both)
    assert np.allclose(K, expected, atol=1e-12 * np.abs(K).max())
    assert np.array_equal(*(a.gradient(x, 1.0) for a in both))


# ------------------------------------------------------------------ patches


@pytest.mark.parametrize("strain", ["small", "corotational", "finite"])
@pytest.mark.parametrize(("kind", "form"), FORMS)
def test_patch_of_uniform_strain(kind: str, form: str, strain: str) -> None:
    """Irons's patch test: boundary displacements A X make A X everywhere, to rounding, on distorted cells.

    A is without change of volume, nearly: in the measure of the strain, tr A = 0 or det = 1.
    """
    mesh = distorted(kind)
    nu = 0.4999  # held all around, an incompressible solid leaves a pressure open
    stretch = np.diag([1.1, 1.0 / 1.1, 1.0]) if strain == "finite" else np.diag([1.05, 0.96, 0.99])
    A = stretch - np.eye(3)
    surface = np.unique(mesh.facets)
    exact = mesh.points @ A.T
    target = exact[surface].ravel()
    what = material("neo_hookean", nu)
    u, _, _ = solved(mesh, form, what, strain, np.zeros_like(mesh.points), all_of(surface), target)
    assert np.abs(u - exact).max() <= 1e-9 * np.abs(exact).max()


@pytest.mark.parametrize(("strain", "across"), [("small", -0.05), ("corotational", -0.05), ("finite", 1.1**-0.5 - 1)])
@pytest.mark.parametrize("kind", [kind for kind, form in FORMS if form == "mixed"])
def test_patch_of_an_incompressible_bar(kind: str, strain: str, across: float) -> None:
    """A bar between rollers, pulled to 1.1: it thins by half of that, in finite strain by a root; p is uniform."""
    mesh = Box((1.0, 0.8, 0.6)).mesh(kind, 0.5)
    low = mesh.points.min(axis=0)
    ends = on(mesh, 0, mesh.points[:, 0].max())
    fixed = np.concatenate([3 * on(mesh, axis, low[axis]) + axis for axis in range(3)] + [3 * ends])
    target = np.concatenate([np.zeros(len(fixed) - len(ends)), np.full(len(ends), 0.1)])
    what = material("neo_hookean", 0.5)
    u, found, energy = solved(mesh, "mixed", what, strain, np.zeros_like(mesh.points), fixed, target)
    exact = (mesh.points - low) * np.array([0.1, across, across])
    assert np.abs(u - exact).max() <= 1e-9
    assert isinstance(energy, MixedSolid)
    p = energy.pressure(found.x)
    assert np.ptp(p) <= 1e-7 * np.abs(p).max()


# ------------------------------------------------------------------ Lamé's sphere


def lame(kind: str, form: str, n: int, nu: float) -> float:
    """Relative error of the displacements of an octant, radii 1 and 2 m, E = 1000 Pa, p = 1 Pa, over its nodes.

    u_r = p a^3 r / (E (b^3 - a^3)) [(1 - 2 nu) + (1 + nu) b^3 / (2 r^3)] (Lamé; Timoshenko and Goodier, article 142).
    """
    mesh = octant(1.0, 2.0, n, n, kind)
    r = np.linalg.norm(mesh.points, axis=1)
    exact = ((1 - 2 * nu) + (1 + nu) * 4 / r**3)[:, None] * mesh.points / 7000
    inside = mesh.facets[(np.abs(r[mesh.facets] - 1.0) < 1e-6).all(axis=1)]
    f = np.zeros(mesh.points.size)
    FollowerPressure(mesh.points, inside, 1.0).add_gradient(np.zeros_like(f), f)
    fixed = np.concatenate([3 * on(mesh, axis, 0.0) + axis for axis in range(3)])
    u, _, _ = solved(mesh, form, material("linear_elastic", nu, 1000.0), "small", -f, fixed)
    return float(np.linalg.norm(u - exact) / np.linalg.norm(exact))


@pytest.mark.parametrize(
    ("kind", "form", "n", "ratios"),
    [("tet10", "mixed", 2, (0.49999, 0.5)), ("hex8", "mixed", 4, (0.49999, 0.5)),
     ("hex20", "mixed", 2, (0.49999, 0.5)), ("hex27", "mixed", 2, (0.49999, 0.5)),
     ("hex8", "mean_dilatation", 4, (0.49999,))],
)  # fmt: skip
def test_no_locking_in_a_thick_sphere(kind: str, form: str, n: int, ratios: tuple[float, ...]) -> None:
    """At most twice the error that the same mesh has at nu = 0.3; the measured factors are 1.2 to 1.8."""
    usual = lame(kind, form, n, 0.3)
    assert usual < 0.02
    assert all(lame(kind, form, n, nu) <= 2.0 * usual for nu in ratios)


@pytest.mark.parametrize(("kind", "worst"), [("hex8", 0.9), ("tet4", 0.5)])
def test_displacements_alone_do_lock(kind: str, worst: float) -> None:
    """The same sphere shows what is meant: at nu = 0.49999 they lose half of it and more."""
    assert lame(kind, "displacement", 4, 0.49999) > worst


@pytest.mark.parametrize("kind", [kind for kind, element in ELEMENTS.items() if element.pressures == "corners"])
def test_linear_pressures_converge(kind: str) -> None:
    """Order 3 in displacements is optimal; from 2 to 4 cells, before its asymptotic range, 2.5 is asked."""
    coarse, fine = lame(kind, "mixed", 2, 0.5), lame(kind, "mixed", 4, 0.5)
    assert np.log2(coarse / fine) > 2.5


# ------------------------------------------------------------------ stability


def betas(kind: str, n: int) -> Floats:
    """Inf-sup values of a cube held on one face, n cells along an edge."""
    mesh = Box((1.0, 1.0, 1.0)).mesh(kind, 1.0 / n)
    return inf_sup(mesh, all_of(on(mesh, 0, mesh.points[:, 0].min())))


@pytest.mark.slow
@pytest.mark.long
def test_taylor_hood_is_stable() -> None:
    """Chapelle and Bathe (1993): beta settles, measured 0.54, 0.49, 0.51, 0.49; 0.4 leaves room for little less."""
    found = [betas("tet10", n) for n in (2, 3, 4, 6)]
    assert all(b[0] > 0.4 for b in found)


@pytest.mark.parametrize("kind", ["hex20", "hex27"])
def test_pressures_between_corners_of_quadratic_hexahedra_are_stable(kind: str) -> None:
    """beta settles: measured 0.39, 0.31, 0.38, 0.44, 0.38 of `hex20` for 2 to 6 cells; 0.71, 0.69, 0.68 of `hex27`."""
    assert all(betas(kind, n)[0] > 0.3 for n in (2, 3, 4))


def test_one_pressure_in_each_hexahedron_is_not() -> None:
    """Q1/P0 is known not to satisfy the condition (Boffi, Brezzi and Fortin 2013, section 8.6.3): beta falls with h.

    Measured 0.24, 0.12, 0.072 for 4, 6 and 8 cells. Its displacements are good all the same; pressures are not read.
    """
    found = [betas("hex8", n)[0] for n in (4, 6, 8)]
    assert all(a > 1.3 * b for a, b in pairwise(found))


def test_saddles_are_solved_to_rounding_and_know_their_signs() -> None:
    """As many negative pivots as pressures mean stable; refinement reaches 1e-12 where 1/K = 0."""
    mesh = distorted("tet10")
    energy = formed(mesh, "mixed", material("linear_elastic", 0.5), "small")
    assert isinstance(energy, MixedSolid)
    fixed = all_of(np.argsort(mesh.points[:, 0])[:12])
    assembly = Assembly(energy.dofs, fixed, [energy], [])
    K, spare = assembly.tangent(np.zeros(energy.dofs), 1.0), energy.spare[assembly.free]
    found = saddle_factor(K, spare, lambda A: factor(A))
    b = np.random.default_rng(0).standard_normal(K.shape[0])
    assert np.linalg.norm(b - K @ found.solve(b)) <= 1e-11 * np.linalg.norm(b)
    assert found.negative_pivots == 0
    signs = np.linalg.eigvalsh(K.toarray())
    assert int(np.sum(signs < 0)) == build_pressure_space(mesh).count
    turned = sparse.csr_matrix(K - 2.0 * abs(K).max() * sparse.diags((np.arange(K.shape[0]) == 0).astype(float)))
    assert saddle_factor(turned, spare, lambda A: factor(A)).negative_pivots == 1


# ------------------------------------------------------------------ limits and twins


@pytest.mark.parametrize("strain", ["small", "corotational", "finite"])
def test_the_limit_is_reached_continuously(strain: str) -> None:
    """u(nu) - u(0.5) goes with 0.5 - nu, since 1/K does: a tenth of it each time, to a per cent."""
    mesh = Box((0.1, 0.02, 0.02)).mesh("tet10", 0.01)
    f = np.zeros_like(mesh.points)
    f[on(mesh, 0, 0.1), 2] = -0.3
    fixed = all_of(on(mesh, 0, 0.0))
    gaps = (1e-3, 1e-4, 1e-5, 0.0)
    made = [material("neo_hookean", 0.5 - gap, 6e4) for gap in gaps]
    *near, limit = (solved(mesh, "mixed", what, strain, f / 100, fixed)[0] for what in made)
    away = [np.linalg.norm(u - limit) for u in near]
    assert all(a / b == pytest.approx(10.0, rel=0.02) for a, b in pairwise(away))


@pytest.mark.parametrize("strain", ["small", "corotational", "finite"])
def test_pressures_may_be_eliminated(strain: str) -> None:
    """Mixed hexahedra and their mean dilatation are one element: the same displacements, to the tolerance."""
    mesh = Box((0.1, 0.02, 0.02)).mesh("hex8", 0.01)
    f = np.zeros_like(mesh.points)
    f[on(mesh, 0, 0.1), 2] = -0.003
    fixed, what = all_of(on(mesh, 0, 0.0)), material("neo_hookean", 0.49, 6e4)
    u, v = (solved(mesh, form, what, strain, f, fixed)[0] for form in ("mixed", "mean_dilatation"))
    assert np.abs(u - v).max() <= 1e-8 * np.abs(u).max()


def test_bending_takes_few_steps_at_the_limit() -> None:
    """A large bend at nu = 0.5 and 0.4999999: pressures as unknowns keep Newton's steps few; the state is stable."""
    mesh = Box((0.1, 0.02, 0.02)).mesh("tet10", 0.01)
    f = np.zeros_like(mesh.points)
    f[on(mesh, 0, 0.1), 2] = -0.15 / len(on(mesh, 0, 0.1))
    for nu in (0.4999999, 0.5):
        what = material("neo_hookean", nu, 6e4)
        u, found, energy = solved(mesh, "mixed", what, "finite", f, all_of(on(mesh, 0, 0.0)))
        assert found.stable
        assert found.iterations <= 12
        assert u[:, 2].min() < -0.03
        assert isinstance(energy, MixedSolid)
        J = np.linalg.det(energy.F(found.x)).reshape(energy.w.shape)
        assert float(np.sum(energy.w * J)) == pytest.approx(float(energy.w.sum()), rel=1e-4)  # ln J, weakly


def test_a_bonded_disc_is_as_stiff_as_gent_and_lindley_say() -> None:
    """E_a = E (1 + 2 S^2), S = R/2H (Gent and Lindley 1959): parabolic profiles, an estimate; 10 % is its accuracy."""
    from softmark.solvers.mesh.shapes import Cylinder

    R, H, E = 0.025, 0.012, 1e5
    mesh = Cylinder(H, R, (0.0, 0.0, 1.0)).mesh("tet10", 0.006)
    low, high = on(mesh, 2, 0.0), on(mesh, 2, H)
    fixed, target = all_of(np.concatenate([low, high])), np.zeros((len(low) + len(high), 3))
    target[len(low) :, 2] = -1e-3 * H
    nothing = np.zeros_like(mesh.points)
    what = material("linear_elastic", 0.5, E)
    _, found, energy = solved(mesh, "mixed", what, "small", nothing, fixed, target.ravel())
    g = np.zeros(len(found.x))
    energy.add_gradient(found.x, g)
    stress = -g[3 * high + 2].sum() / (np.pi * R**2) / 1e-3
    assert stress / E == pytest.approx(1.0 + 2.0 * (R / (2.0 * H)) ** 2, rel=0.1)


# ------------------------------------------------------------------ another program


def test_against_taylor_hood_of_scikit_fem() -> None:
    """scikit-fem's P2/P1 on the same straight tetrahedra, nu = 0.5: the same displacements to 1e-8.

    a(u, v) = 2 mu dev eps : dev eps, b = p div v, weight along -z; another basis, quadrature, assembly and solver.
    """
    skfem = pytest.importorskip("skfem")
    mesh = Box((1.0, 0.5, 0.5)).mesh("tet10", 0.25)
    linear = Box((1.0, 0.5, 0.5)).mesh("tet4", 0.25)
    theirs = skfem.MeshTet(linear.points.T, linear.cells.T)
    rule = {"intorder": 4}
    basis = skfem.Basis(theirs, skfem.ElementVector(skfem.ElementTetP2()), **rule)
    scalars = basis.with_element(skfem.ElementTetP1())
    from skfem.helpers import ddot, div, sym_grad

    @skfem.BilinearForm
    def stiffness(u: Any, v: Any, _: Any) -> Any:
        return 2.0 * (ddot(sym_grad(u), sym_grad(v)) - div(u) * div(v) / 3.0)

    @skfem.BilinearForm
    def volume(u: Any, q: Any, _: Any) -> Any:
        return q * div(u)

    @skfem.LinearForm
    def weight(v: Any, _: Any) -> Any:
        return -v[2]

    A, B, b = stiffness.assemble(basis), volume.assemble(basis, scalars), weight.assemble(basis)
    K = sparse.bmat([[A, B.T], [B, None]], format="csr")
    held = np.flatnonzero(np.abs(basis.doflocs[0] - mesh.points[:, 0].min()) < 1e-9)
    free = np.setdiff1d(np.arange(K.shape[0]), held)
    y = np.zeros(K.shape[0])
    y[free] = spsolve(K[free][:, free].tocsc(), np.concatenate([b, np.zeros(B.shape[0])])[free])
    u, _, _ = solved(
        mesh, "mixed", material("linear_elastic", 0.5, 3.0), "small", own_weight(mesh),
        all_of(on(mesh, 0, mesh.points[:, 0].min())),
    )  # fmt: skip
    for axis in range(3):  # degrees of freedom of scikit-fem by their places
        own = np.flatnonzero(np.arange(basis.N) % 3 == axis)
        order = {tuple(np.round(basis.doflocs[:, k], 9)): y[k] for k in own}
        found = np.array([order[tuple(np.round(X, 9))] for X in mesh.points])
        assert np.abs(found - u[:, axis]).max() <= 1e-8 * np.abs(u).max()


def own_weight(mesh: Mesh) -> Floats:
    """Consistent forces of a body force of -1 N/m^3 along z, by the quadrature of mass."""
    from softmark.solvers.dynamics.mass_matrices import mass_shapes_and_volumes

    N, w = mass_shapes_and_volumes(mesh.points, mesh.cells, mesh.element)
    f = np.zeros_like(mesh.points)
    np.add.at(f[:, 2], mesh.cells, -(w @ N))
    return f


# ------------------------------------------------------------------ materials


@pytest.mark.parametrize("name", MATERIALS)
def test_an_incompressible_material_has_no_nan(name: str) -> None:
    """nu = 0.5: mu = E/3, 1/K = 0, lam and K infinite; the parts of a law without volume keep their zeros."""
    rubber = material(name, 0.5, 3.0)
    assert rubber.incompressible
    assert rubber.shear_modulus == pytest.approx(1.0, rel=1e-15)
    assert rubber.pressure_modulus == np.inf
    assert rubber.lame_lambda == np.inf == rubber.bulk_modulus
    parts = rubber.finite_parts()
    if parts is not None and isinstance(rubber, IsochoricMaterial):  # it keeps 5 mu/3 of K
        stiff = parts[0].dPdF(np.eye(3)[None])[0]
        assert np.trace(stiff.reshape(9, 9)[::4, ::4] @ np.ones((3, 3))) == pytest.approx(9.0 * 5.0 / 3.0)
    elif parts is not None:
        assert parts[0].lame_lambda == 0.0  # type: ignore[attr-defined]


@pytest.mark.parametrize(("strain", "law"), [*CASES, ("finite", "stable_neo_hookean")])
@pytest.mark.parametrize("poisson", [-0.5, 0.0, 0.2, 0.4])  # where a pressure takes K, K, mu and lam - mu
def test_a_split_law_is_the_law(strain: str, law: str, poisson: float) -> None:
    """psi_shape + M/2 g^2 = psi, and the same of P, for random F near rest: to rounding."""
    what = material(law, poisson)
    split, whole = mixed_for(what, strain), law_for(what, strain)
    assert split is not None
    F = np.eye(3) + 0.2 * np.random.default_rng(3).standard_normal((20, 3, 3))
    F = F[np.linalg.det(F) > 0.2]
    M, g, G = split.modulus, split.constraint.value(F), split.constraint.gradient(F)
    assert M * split.compliance == 1.0
    assert np.allclose(split.shape.psi(F) + 0.5 * M * g**2, whole.psi(F), rtol=1e-10)
    assert np.allclose(split.shape.P(F) + (M * g)[:, None, None] * G, whole.P(F), atol=1e-11)
