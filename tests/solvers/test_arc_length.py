"""Paths of equilibria past limit points, and loads at which bodies buckle: closed forms and ordinary equations."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from end_force import concentrated
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.energies.elastic_energy import Elastic, EnergySum
from softmark.solvers.energies.energy import VectorSpace
from softmark.solvers.energies.external_loads import DeadForces, FollowerPressure
from softmark.solvers.energies.geometrically_exact_rod import RodElastic
from softmark.solvers.energies.rod_section import circular
from softmark.solvers.energies.rod_state import RodChain, chain_elements, rod_at_rest
from softmark.solvers.energies.spring_energy import Springs
from softmark.solvers.linear import factorisations
from softmark.solvers.materials import MATERIALS, Law, shear_and_volume_laws
from softmark.solvers.mesh.element_interpolation import integrate_cells, mean_gradients
from softmark.solvers.mesh.mesh import Mesh
from softmark.solvers.mesh.shapes import Box
from softmark.solvers.statics.static_equilibrium import NotConverged, Statics, equilibrium
from softmark.solvers.statics.static_stability import critical_load, direct_newton

Maker = Callable[..., Law]
Energies = Callable[[Mesh, Law], Elastic]
Problems = Callable[..., Statics]


def limits(facts: dict[str, Any], kind: str = "limit point") -> list[float]:
    """The loads of what a path has found."""
    return [limit["load"] for limit in facts["limits"] if limit["kind"] == kind]


# ------------------------------------------------------------------ two bars that snap through

SPAN, RISE, k = 1.0, 0.2, 1.0
LENGTH = np.hypot(SPAN, RISE)
# two bars of stiffness k, half span b, height z = h - w: P = 2 k (L - l) z / l with l^2 = b^2 + z^2, greatest where
# l^3 = L b^2: P = 2 k (L^(2/3) - b^(2/3))^(3/2)
HIGHEST = 2 * k * (LENGTH ** (2 / 3) - SPAN ** (2 / 3)) ** 1.5


def truss(load: float, **options: Any) -> Statics:
    """Two bars from (+-SPAN, 0, 0) to (0, 0, RISE), the force `load` on top; the top slides along z."""
    D = np.array([[-SPAN, 0.0, RISE], [SPAN, 0.0, RISE]])
    bars = Springs(np.array([[0, 2], [1, 2]]), D, np.full(2, k))
    forces, fixed = np.zeros(9), np.array([0, 1, 2, 3, 4, 5, 6, 7])
    forces[8] = -load
    assembly = Assembly(9, fixed, [bars], [DeadForces(forces)])
    return Statics(assembly, VectorSpace(9), np.zeros(9), fixed, np.zeros(8), extent=2 * SPAN, bold=False, **options)


def test_a_truss_that_snaps_through_comes_to_full_load_on_its_other_side() -> None:
    # limits are bracketed to 2e-4 in the load's slope, which is of second order in the load
    found = equilibrium(truss(1.5 * HIGHEST, path="arc_length"))
    assert limits(found.facts) == pytest.approx([1 / 1.5, -1 / 1.5], rel=1e-5)

    def missing(z: float) -> float:
        return 2 * k * (LENGTH - np.hypot(SPAN, z)) * z / np.hypot(SPAN, z) - 1.5 * HIGHEST

    assert RISE + found.x[8] == pytest.approx(brentq(missing, -1.0, -0.2), rel=1e-7)
    assert found.stable
    counts = [point["negative_pivots"] for point in found.facts["path"]]
    assert counts[0] == counts[-1] == 0
    assert max(counts) == 1


def test_below_its_limit_the_path_leads_where_the_load_does() -> None:
    along, raised = (equilibrium(truss(0.9 * HIGHEST, path=path)) for path in ("arc_length", "load"))
    assert along.x[8] == pytest.approx(raised.x[8], rel=1e-7)
    assert not limits(along.facts)


# ------------------------------------------------------------------ a bar that softens under pressure


def squeezed(pressure: float, law: Maker, elastic: Energies, problem: Problems, **options: Any) -> Statics:
    """A unit cube of E = 1 and nu = 0 under a dead load on its face x = 1, its sides held."""
    corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]
    mesh = Mesh(np.array(corners, dtype=float), np.arange(8)[None], "hex8")
    held = np.ones(mesh.points.shape, dtype=bool)
    held[:, 0] = mesh.points[:, 0] < 1e-9
    forces = np.zeros_like(mesh.points)
    forces[mesh.points[:, 0] > 1 - 1e-9, 0] = -pressure / 4
    energy = elastic(mesh, law("st_venant_kirchhoff", 1.0, 0.0))
    return problem(
        mesh, energy, held, [DeadForces(forces.ravel())],
        sound=lambda x: bool(np.all(np.linalg.det(energy.F(x)) > 0)), extent=mesh.extent, **options,
    )  # fmt: skip


# St Venant-Kirchhoff, nu = 0: P = E l (l^2 - 1) / 2, least at l = 1/sqrt(3): -0.19245 E
SOFTEST = 1 / (3 * np.sqrt(3))


def test_a_bar_of_st_venant_and_kirchhoff_has_a_greatest_pressure(
    law: Maker, elastic: Energies, problem: Problems
) -> None:
    with pytest.raises(NotConverged, match=r"maximum of 83\.33 % \(limit point\).*inverted") as refused:
        equilibrium(squeezed(1.2 * SOFTEST, law, elastic, problem, path="arc_length"))
    assert limits(refused.value.facts) == pytest.approx([1 / 1.2], rel=1e-5)
    # the state at the limit: displacement 1 - 1/sqrt(3); the path's points lie on the curve, to its 1e-7
    for point in refused.value.facts["path"]:
        stretch = 1 - point["displacement"]
        assert point["load"] * 1.2 * SOFTEST == pytest.approx(stretch * (1 - stretch**2) / 2, abs=1e-6)


def test_raising_the_load_says_what_it_meets(law: Maker, elastic: Energies, problem: Problems) -> None:
    with pytest.raises(NotConverged, match=r"limit point.*`path = arc_length`") as refused:
        equilibrium(squeezed(1.2 * SOFTEST, law, elastic, problem, bold=False))
    # load steps end at 1e-3: 1 / 1.2 = 83.33 %
    reached = float(str(refused.value).split("raised to only ")[1].split(" %")[0])
    assert 83.1 < reached < 83.34


# ------------------------------------------------------------------ a thick sphere that is blown up


def shell(cells: int, layers: int) -> Mesh:
    """The octant of a sphere of radii 1 and 2 with x, y, z >= 0: hexahedra over three patches of its surface."""
    s = np.linspace(0.0, 1.0, cells + 1)
    # a corner at each axis, the middles of edges, and the middle of the octant
    axes = np.eye(3)
    middle = np.ones(3) / 3
    blocks, points = [], []
    radii = np.linspace(1.0, 2.0, layers + 1)
    for i in range(3):
        a, b, c = axes[i], axes[(i + 1) % 3], axes[(i + 2) % 3]
        corners = a, (a + b) / 2, middle, (a + c) / 2
        shares = [((1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v) for u in s for v in s]
        flat = np.array(shares) @ np.array(corners)
        ball = flat / np.linalg.norm(flat, axis=1, keepdims=True)
        start = sum(len(p) for p in points)
        points.append((radii[:, None, None] * ball).reshape(-1, 3))
        n, face = cells + 1, (cells + 1) ** 2
        for layer in range(layers):
            for u in range(cells):
                for v in range(cells):
                    square = np.array([u * n + v, (u + 1) * n + v, (u + 1) * n + v + 1, u * n + v + 1])
                    q = start + layer * face + square
                    blocks.append([*q, *(q + face)])
    whole = np.concatenate(points)
    _, first, number = np.unique(np.round(whole, 9), axis=0, return_index=True, return_inverse=True)
    return Mesh(whole[first], number.ravel()[np.array(blocks)], "hex8")


def compressible_sphere(stretch: float, material: Any) -> float:
    """Pressure inside at a stretch of the inner radius: r(R) by shooting for P_rR' = -2 (P_rR - P_tt) / R."""
    law = material

    def stress(slope: float, hoop: float) -> tuple[float, float]:
        F = np.diag([slope, hoop, hoop])[None]
        P = law.P(F)[0]
        return float(P[0, 0]), float(P[1, 1])

    def slope_of(radial: float, hoop: float) -> float:
        return float(brentq(lambda s: stress(s, hoop)[0] - radial, 1e-2, 5.0, xtol=1e-13))

    def end(radial: float) -> float:
        def rates(R: float, y: np.ndarray) -> list[float]:
            hoop = y[0] / R
            slope = slope_of(y[1], hoop)
            return [slope, -2 * (y[1] - stress(slope, hoop)[1]) / R]

        return float(solve_ivp(rates, (1.0, 2.0), [stretch, radial], rtol=1e-8, atol=1e-10).y[1, -1])

    radial = brentq(end, -6.0, -0.1, xtol=1e-9)
    return -radial / stretch**2  # nominal to true


@pytest.mark.long
@pytest.mark.slow
def test_a_thick_sphere_is_blown_up_past_its_greatest_pressure() -> None:
    """nu = 0.45, so that linear hexahedra do without more than a centre for the volume; judged by shooting.

    Incompressible it would be 0.8138508 mu at a stretch of 1.75 and 0.8069266 mu at 2, with the maximum between.
    3 x 2 x 2 cells on the octant's surface and 4 through the wall: hoops are chords of 22.5 degrees, which lie up to
    1.9 % inside.
    """
    mu, nu = 1.0, 0.45
    material = MATERIALS["neo_hookean"](2 * mu * (1 + nu), nu, 1.0)
    shear, volume = shear_and_volume_laws(material, "finite")
    mesh = shell(2, 4)
    fine, centre = integrate_cells(mesh), mean_gradients(mesh)
    parts = Elastic(mesh.cells, fine.dNdX, fine.w, shear), Elastic(mesh.cells, centre.dNdX, centre.w, volume)
    inner = mesh.facets[np.all(np.linalg.norm(mesh.points[mesh.facets], axis=2) < 1.001, axis=1)]
    fixed = np.flatnonzero((np.abs(mesh.points) < 1e-9).ravel())
    pressure = FollowerPressure(mesh.points, inner, mu)
    assembly = Assembly(mesh.points.size, fixed, [EnergySum(parts)], [pressure], mesh.points)
    rest = np.zeros(mesh.points.size)
    problem = Statics(
        assembly, VectorSpace(len(rest)), rest, fixed, np.zeros(len(fixed)), extent=2.0, path="arc_length",
        sound=lambda x: bool(np.linalg.norm(x.reshape(-1, 3), axis=1).max() < 1.5),
    )  # fmt: skip
    with pytest.raises(NotConverged, match="limit point") as refused:
        equilibrium(problem)
    law = MATERIALS["neo_hookean"](2 * mu * (1 + nu), nu, 1.0).finite_law()
    curve = {a: compressible_sphere(a, law) for a in (1.25, 1.5, 1.75, 1.85, 2.0, 2.2)}
    assert limits(refused.value.facts) == pytest.approx([max(curve.values())], rel=0.03)
    path = refused.value.facts["path"]
    stretches, loads = (np.array([p[name] for p in path]) for name in ("displacement", "load"))
    for stretch in (1.25, 1.5, 1.75, 2.0, 2.2):
        assert np.interp(stretch - 1, stretches, loads) == pytest.approx(curve[stretch], rel=0.03)


# ------------------------------------------------------------------ columns


def column(load: float, segments: int, **options: Any) -> Statics:
    """A rod of length 1 and radius 0.01, clamped at x = 0, pushed along itself by `load` at its free end."""
    points = np.linspace(0.0, 1.0, segments + 1)[:, None] * [1.0, 0.0, 0.0]
    rest, fixed = rod_at_rest(points), np.arange(6)
    elastic = RodElastic(rest, chain_elements(segments + 1), circular(0.01, 1e6, 0.3).stiffness)
    push = concentrated(rest, segments, np.array([-load, 0.0, 0.0]))
    held = np.zeros((segments + 1, 3), dtype=bool)
    held[0] = True
    assembly = Assembly(6 * (segments + 1), fixed, [elastic], [push])
    return Statics(assembly, RodChain(rest, held), rest, fixed, np.zeros(6), bold=False, extent=1.0, **options)


EULER = np.pi**2 / 4 * 1e6 * np.pi * 1e-8 / 4  # N: pi^2 E I / (4 L^2)


@pytest.mark.parametrize("path", ["load", "arc_length"])
def test_a_column_says_where_it_buckles(path: str) -> None:
    # 40 segments: h^2 / (12 r^2) of midpoint curvature, (pi/2/40)^2 / 12 = 1.3e-4; squashed and sheared by P / EA and
    # P / kGA, 6.2e-5 and 1.8e-4 of the load: within 5e-4 in all. The bracket is 1e-3 wide, the guess in it far better.
    found = equilibrium(column(1.6 * EULER, 40, path=path))
    assert found.critical == pytest.approx(1 / 1.6, rel=1e-3)
    assert found.stable


def test_a_column_below_its_load_costs_nothing_more() -> None:
    found = equilibrium(column(0.9 * EULER, 40))
    assert found.critical is None
    assert not any(i.phase == "critical load" for i in found.history)


def test_a_solid_column_buckles_near_the_load_of_euler(law: Maker, elastic: Energies, problem: Problems) -> None:
    """Quadratic tetrahedra, one or two across: bending stiffness within 2 %, squashed and sheared by less than 1 %."""
    width, height = 0.1, 0.05
    mesh = Box((1.0, width, height)).mesh("tet10", height)
    push = 1.5 * np.pi**2 / 4 * 1e6 * width * height**3 / 12 / (width * height)  # Pa
    facets = mesh.facets[(np.abs(mesh.points[:, 0] - 1) < 1e-9)[mesh.facets].all(axis=1)]
    traction = np.zeros(mesh.points.size)
    FollowerPressure(mesh.points, facets, push).add_gradient(np.zeros(mesh.points.size), traction)
    body = elastic(mesh, law("neo_hookean", 1e6, 0.0))
    held = mesh.points[:, 0] < 1e-9
    column = problem(mesh, body, held, [DeadForces(-traction)], extent=mesh.extent)
    straight = direct_newton(column, [], "straight").solve_by_full_steps(column.rest, 10)
    assert critical_load(column, [], straight) == pytest.approx(1 / 1.5, rel=0.03)


# ------------------------------------------------------------------ condition numbers


def test_a_condition_number_is_estimated_within_a_factor_of_three() -> None:
    # Higham 1988: the estimate is a lower bound, mostly exact; judged against the dense inverse of the scaled matrix
    random = np.random.default_rng(1)
    for size in (1, 5, 40):
        A = random.standard_normal((size, size))
        K = factorisations.sparse.csr_matrix(A @ A.T + 1e-6 * np.eye(size))
        s = 1 / np.sqrt(K.diagonal())
        exact = np.linalg.cond(s[:, None] * K.toarray() * s, 1)
        assert exact / 3 <= factorisations.condition(K, factorisations.factor(K)) <= exact * (1 + 1e-6)


def test_scaling_an_unknown_leaves_the_condition_number() -> None:
    K = np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 2.0]])
    S = np.diag([1e8, 1.0, 1e-6])
    plain, scaled = (factorisations.sparse.csr_matrix(A) for A in (K, S @ K @ S))
    found = [factorisations.condition(A, factorisations.factor(A)) for A in (plain, scaled)]
    assert found[0] == pytest.approx(found[1], rel=1e-9)
