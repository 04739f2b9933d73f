"""Observed orders of convergence of every solid element against the orders of theory, to 0.1.

Theory: displacements in L2 by h^(k + 1) and the energy norm of the error by h^k, k the order of the complete
polynomials of the element (REFERENCES 3.11; Strang and Fix 1973, section 3). Exact solutions, body forces, shape
functions and quadrature are written out here: nothing of them is the solver's.

Each number is the slope between two meshes fine enough for it; what was measured stands beside.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import pytest
from equal_moduli import made

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.energies.elastic_energy import Elastic, EnergySum
from softmark.solvers.energies.energy import Energy, VectorSpace
from softmark.solvers.energies.external_loads import DeadForces, FollowerPressure
from softmark.solvers.materials import Law, law_for, shear_and_volume_laws
from softmark.solvers.mesh.element_interpolation import integrate_cells, mean_gradients
from softmark.solvers.mesh.mesh import Mesh
from softmark.solvers.mesh.shapes import Box
from softmark.solvers.statics.static_equilibrium import Statics, equilibrium

Field = Callable[[np.ndarray], np.ndarray]
YOUNG, POISSON = 1000.0, 0.3
MU = YOUNG / (2 * (1 + POISSON))
LAM = YOUNG * POISSON / ((1 + POISSON) * (1 - 2 * POISSON))
TOLERANCE = 0.1  # of every order

# ------------------------------------------------------------------ shape functions, quadrature and norms

EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))  # of nodes 4 to 9, in the order of VTK
CORNERS = np.array([(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1), (-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)])


def middles(kind: str) -> np.ndarray:
    """Nodes of quadratic hexahedra: corners, then edges in the order of VTK, of `hex27` faces and the middle too."""
    rings = [(0, -1, -1), (1, 0, -1), (0, 1, -1), (-1, 0, -1), (0, -1, 1), (1, 0, 1), (0, 1, 1), (-1, 0, 1)]
    edges = [*rings, (-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
    faces = [(-1, 0, 0), (1, 0, 0), (0, -1, 0), (0, 1, 0), (0, 0, -1), (0, 0, 1), (0, 0, 0)]
    return np.array([*CORNERS.tolist(), *edges, *(faces if kind == "hex27" else [])], dtype=float)


MIDDLES = {kind: middles(kind) for kind in ("hex20", "hex27")}


def vandermonde(kind: str, xi: np.ndarray) -> np.ndarray:
    """Monomials up to squares in each coordinate; of serendipity with one square at most (q, a)."""
    powers = np.array([p for p in np.ndindex(3, 3, 3) if kind == "hex27" or p.count(2) <= 1])
    return np.asarray(np.prod(xi[:, None, :] ** powers, axis=2))


def shape(kind: str, xi: np.ndarray) -> np.ndarray:
    """N (q, a) at local points (q, 3), real or complex."""
    if kind == "hex8":
        return np.asarray(np.prod(1 + CORNERS * xi[:, None, :], axis=2) / 8)
    if kind in MIDDLES:
        return vandermonde(kind, xi) @ np.linalg.inv(vandermonde(kind, MIDDLES[kind]))
    L = np.concatenate([1 - xi.sum(axis=1, keepdims=True), xi], axis=1)
    if kind == "tet4":
        return L
    return np.concatenate([L * (2 * L - 1), np.stack([4 * L[:, a] * L[:, b] for a, b in EDGES], axis=1)], axis=1)


def shape_slope(kind: str, xi: np.ndarray) -> np.ndarray:
    """dN/dxi (q, a, 3) by a complex step, exact for polynomials."""
    return np.stack([shape(kind, xi + 1e-30j * e).imag / 1e-30 for e in np.eye(3)], axis=2)


def quadrature(kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Points (q, 3) and weights (q,): Gauss in a cube, for the unit tetrahedron folded (Duffy 1982)."""
    t, w = np.polynomial.legendre.leggauss(3 if kind in ("tet4", "hex8") else 4)
    if kind.startswith("hex"):
        cube = np.stack([x.ravel() for x in np.meshgrid(t, t, t)], axis=1)
        return cube, np.prod([x.ravel() for x in np.meshgrid(w, w, w)], axis=0)
    a, b, c = (x.ravel() for x in np.meshgrid((t + 1) / 2, (t + 1) / 2, (t + 1) / 2))
    wa, wb, wc = (x.ravel() / 2 for x in np.meshgrid(w, w, w))
    xi = np.stack([a, b * (1 - a), c * (1 - a) * (1 - b)], axis=1)
    return xi, wa * wb * wc * (1 - a) ** 2 * (1 - b)


@dataclass(frozen=True)
class Sampled:
    """Quadrature points X (m, q, 3), weights w (m, q), N (q, a) and dN/dX (m, q, a, 3) of all cells of a mesh."""

    mesh: Mesh
    X: np.ndarray
    w: np.ndarray
    N: np.ndarray
    dNdX: np.ndarray

    def at(self, f: Field) -> np.ndarray:
        """A function of points (n, 3) at all of them."""
        values = f(self.X.reshape(-1, 3))
        return values.reshape(*self.w.shape, *values.shape[1:])

    def nodal(self, b: Field) -> np.ndarray:
        """Forces on nodes (3n,): the integral of N_a b."""
        f = np.zeros_like(self.mesh.points)
        np.add.at(f, self.mesh.cells, np.einsum("mq,qa,mqi->mai", self.w, self.N, self.at(b)))
        return f.ravel()

    def norms(self, x: np.ndarray, exact: Field, slope: Field) -> np.ndarray:
        """L2 norm of the error in displacements, and energy norm of the error in strains."""
        nodal = x.reshape(-1, 3)[self.mesh.cells]
        off = np.einsum("qa,mai->mqi", self.N, nodal) - self.at(exact)
        tilt = np.einsum("mai,mqaJ->mqiJ", nodal, self.dNdX) - self.at(slope)
        strain = 0.5 * (tilt + tilt.swapaxes(2, 3))
        density = 2 * MU * (strain**2).sum(axis=(2, 3)) + LAM * np.trace(strain, axis1=2, axis2=3) ** 2
        return np.sqrt([np.sum(self.w * (off**2).sum(axis=2)), np.sum(self.w * density)])


def sampled(mesh: Mesh) -> Sampled:
    xi, w = quadrature(mesh.kind)
    N, dN, corners = shape(mesh.kind, xi), shape_slope(mesh.kind, xi), mesh.points[mesh.cells]
    D = np.einsum("mai,qaj->mqij", corners, dN)
    X, dNdX = np.einsum("qa,mai->mqi", N, corners), np.einsum("qaj,mqji->mqai", dN, np.linalg.inv(D))
    return Sampled(mesh, X, w * np.linalg.det(D), N, dNdX)


def test_quadrature_of_the_test_itself() -> None:
    """Volumes 1/6 and 8; the integral of xi^2 eta zeta over the tetrahedron is 2!/7!."""
    xi, w = quadrature("tet10")
    assert quadrature("tet4")[1].sum() == pytest.approx(1 / 6, rel=1e-14)
    assert w.sum() == pytest.approx(1 / 6, rel=1e-14)
    assert w @ (xi[:, 0] ** 2 * xi[:, 1] * xi[:, 2]) == pytest.approx(2 / 5040, rel=1e-13)
    assert quadrature("hex8")[1].sum() == pytest.approx(8.0, rel=1e-14)


def energy(mesh: Mesh, material: str, strain: str, integrated: str) -> Energy:
    """The elastic energy, with lambda's part at the centres of the cells where it is integrated selectively."""
    own, parts = made(material, YOUNG, POISSON), integrate_cells(mesh)
    if integrated == "full":
        return Elastic(mesh.cells, parts.dNdX, parts.w, law_for(own, strain))
    laws, middle = shear_and_volume_laws(own, strain), mean_gradients(mesh)
    assert laws is not None
    shear = Elastic(mesh.cells, parts.dNdX, parts.w, laws[0])
    return EnergySum((shear, Elastic(mesh.cells, middle.dNdX, middle.w, laws[1])))


def slopes(rows: Sequence[np.ndarray], edges: Sequence[int]) -> np.ndarray:
    """The orders of each column between the last two rows."""
    return np.asarray(np.log(rows[-2] / rows[-1]) / np.log(edges[-1] / edges[-2]))


# ------------------------------------------------------------------ a manufactured solution (REFERENCES 3.11)

SIDES = np.array([0.05, 0.1, -0.05])  # u = SIDES sin(pi X) sin(pi Y) sin(pi Z), zero on the surface of the unit cube


def exact(X: np.ndarray) -> np.ndarray:
    """u (n, 3)."""
    return np.asarray(np.sin(np.pi * X).prod(axis=1)[:, None] * SIDES)


def slope(X: np.ndarray) -> np.ndarray:
    """du_i/dX_J (n, 3, 3)."""
    s, c = np.sin(np.pi * X), np.pi * np.cos(np.pi * X)
    ds = np.stack([c[:, 0] * s[:, 1] * s[:, 2], s[:, 0] * c[:, 1] * s[:, 2], s[:, 0] * s[:, 1] * c[:, 2]], axis=1)
    return np.asarray(SIDES[:, None] * ds[:, None, :])


def curvature(X: np.ndarray) -> np.ndarray:
    """d2u_k/dX_J dX_L (n, 3, 3, 3), by the product rule."""
    s, c = np.sin(np.pi * X), np.pi * np.cos(np.pi * X)
    H = np.empty((len(X), 3, 3))
    for J in range(3):
        for L in range(3):
            rest = [s[:, k] for k in range(3) if k not in (J, L)]
            pair = [-(np.pi**2) * s[:, J]] if J == L else [c[:, J], c[:, L]]
            H[:, J, L] = np.prod([*rest, *pair], axis=0)
    return np.asarray(SIDES[:, None, None] * H[:, None])


def small(X: np.ndarray) -> np.ndarray:
    """b = -(lambda + mu) grad div u - mu lap u, N/m^3 (n, 3): Navier's equations."""
    H = curvature(X)
    return -(LAM + MU) * np.einsum("nkki->ni", H) - MU * np.einsum("niJJ->ni", H)


def neo_hookean(X: np.ndarray) -> np.ndarray:
    """b = -Div P, P = mu (F - F^-T) + lambda ln J F^-T, by dF^-1 = -F^-1 dF F^-1 and d ln J = tr(F^-1 dF)."""
    H, F = curvature(X), np.eye(3) + slope(X)
    G, volume = np.linalg.inv(F), np.log(np.linalg.det(F))
    turned = np.einsum("nJk,nkLJ,nLi->ni", G, H, G)  # -dF^-T_iJ/dX_J
    spread = np.einsum("nLk,nkLJ,nJi->ni", G, H, G)  # d ln J/dX_J F^-T_iJ
    return -(MU * np.einsum("niJJ->ni", H) + (MU - LAM * volume)[:, None] * turned + LAM * spread)


# b at (0.25, 0.5, 0.3) for E = 1000, by symbolic differentiation of the stresses; four decimals are printed
TABLE = [
    ("small", 0.3, (794.3902, 1194.3503, -794.3902)),
    ("small", 0.49, (8462.1262, 10041.5787, -8462.1262)),
    ("st_venant_kirchhoff", 0.3, (1130.7342, 1377.6040, -758.4217)),
    ("st_venant_kirchhoff", 0.49, (11026.1860, 12451.8044, -9555.9141)),
    ("neo_hookean", 0.3, (605.8324, 1173.6124, -900.4762)),
    ("neo_hookean", 0.49, (5126.1017, 9594.4171, -10219.4068)),
]


def test_body_forces_are_those_of_the_table() -> None:
    forces = {"small": small, "neo_hookean": neo_hookean}
    for name, poisson, table in TABLE:
        if name in forces and poisson == POISSON:
            np.testing.assert_allclose(forces[name](np.array([[0.25, 0.5, 0.3]]))[0], table, atol=6e-5)


@pytest.mark.parametrize(("name", "poisson", "table"), TABLE)
def test_laws_have_the_divergence_of_the_table(
    name: str, poisson: float, table: tuple[float, ...], law: Callable[..., Law]
) -> None:
    """b = -dP_iJ/dF_kL d2u_k/dX_J dX_L with the moduli of the solver's own laws."""
    X = np.array([[0.25, 0.5, 0.3]])
    b = -np.einsum("niJkL,nkJL->ni", law(name, YOUNG, poisson).dPdF(np.eye(3) + slope(X)), curvature(X))
    np.testing.assert_allclose(b[0], table, atol=6e-5)


def warped(mesh: Mesh) -> Mesh:
    """All nodes moved smoothly within the cube, so that no two cells are alike and faces of hexahedra are not flat."""
    s, c = np.sin(np.pi * mesh.points), np.cos(np.pi * mesh.points)
    bump = s.prod(axis=1)[:, None] * np.array([0.07, -0.07, 0.05])
    return Mesh(mesh.points + bump + 0.04 * s * np.roll(c, 1, axis=1), mesh.cells, mesh.kind)


def manufactured(kind: str, integrated: str, law: str, family: str, n: int) -> np.ndarray:
    """Norms of the errors on a cube with n edges along each side."""
    mesh = Box((1.0, 1.0, 1.0)).mesh(kind, 1.0 / n)
    points = sampled(mesh if family == "uniform" else warped(mesh))
    mesh, linear = points.mesh, law == "small"
    fixed = np.flatnonzero(np.repeat(np.isin(np.arange(len(mesh.points)), mesh.facets), 3))
    loads = [DeadForces(points.nodal(small if linear else neo_hookean))]
    own = energy(mesh, "linear_elastic" if linear else "neo_hookean", "small" if linear else "finite", integrated)
    assembly = Assembly(mesh.points.size, fixed, [own], loads)
    twin = None if linear else assembly.with_internal([energy(mesh, "linear_elastic", "corotational", integrated)])
    rest, to = np.zeros(mesh.points.size), np.zeros(len(fixed))
    task = Statics(assembly, VectorSpace(len(rest)), rest, fixed, to, twin=twin, convex=linear)
    return points.norms(equilibrium(task).x, exact, slope)


# measured, L2 and energy: uniform small, uniform finite, warped small, warped finite
ELEMENTS = [
    ("tet4", "full", (8, 12), (2.0, 1.0)),  # 2.006 0.997, 2.009 0.996, 1.995 0.994, 1.999 0.994
    ("hex8", "full", (8, 12), (2.0, 1.0)),  # 1.993 1.000, 1.991 1.000, 1.962 0.992, 1.950 0.992
    ("hex8", "selective", (8, 12), (2.0, 1.0)),  # 2.002 1.002, 2.004 1.003, 1.978 0.995, 1.974 0.996
    ("tet10", "full", (6, 8), (3.0, 2.0)),  # 2.949 1.972, 2.948 1.973, 2.929 1.957, 2.925 1.957
    ("hex20", "full", (6, 8), (3.0, 2.0)),  # 3.019 2.038, 3.019 2.038, 3.067 2.072, 3.074 2.073
    ("hex27", "full", (4, 6), (3.0, 2.0)),  # 3.009 1.995, 3.011 1.996, 2.993 1.977, 2.998 1.978
]


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("family", [pytest.param("uniform", marks=pytest.mark.slow), "warped"])
@pytest.mark.parametrize("law", ["small", "neo_hookean"])
@pytest.mark.parametrize(("kind", "integrated", "edges", "order"), ELEMENTS)
def test_order_of_a_manufactured_solution(
    kind: str, integrated: str, edges: tuple[int, int], order: tuple[float, float], law: str, family: str
) -> None:
    rows = [manufactured(kind, integrated, law, family, n) for n in edges]
    np.testing.assert_allclose(slopes(rows, edges), order, atol=TOLERANCE)


# ------------------------------------------------------------------ curved geometry (REFERENCES 3.3), plane strain


def lame(X: np.ndarray) -> np.ndarray:
    """A thick cylinder of radii 1 and 2 under unit pressure inside: u_r = (1 + nu)/E/3 ((1 - 2 nu) r + 4 / r)."""
    r = np.hypot(X[:, 0], X[:, 1])
    u = (1 + POISSON) / YOUNG / 3 * ((1 - 2 * POISSON) * r + 4 / r)
    return np.stack([u * X[:, 0] / r, u * X[:, 1] / r, 0 * r], axis=1)


def kirsch(X: np.ndarray) -> np.ndarray:
    """A hole of radius 1 in a plate under unit tension along x (Kirsch 1898), kappa = 3 - 4 nu."""
    k, r, angle = 3 - 4 * POISSON, np.hypot(X[:, 0], X[:, 1]), np.arctan2(X[:, 1], X[:, 0])
    c = np.cos(2 * angle)
    u = (r * ((k - 1) / 2 + c) + (1 + (1 + k) * c) / r - c / r**3) / (4 * MU)
    v = -(r + (k - 1) / r + 1 / r**3) * np.sin(2 * angle) / (4 * MU)
    cos, sin = np.cos(angle), np.sin(angle)
    return np.stack([u * cos - v * sin, u * sin + v * cos, 0 * r], axis=1)


def differences(f: Field) -> Field:
    """The gradient by central differences: good to 1e-9, errors here are above 1e-5."""
    return lambda X: np.stack([(f(X + 1e-5 * e) - f(X - 1e-5 * e)) / 2e-5 for e in np.eye(3)], axis=2)


def test_exact_solutions_on_curved_bodies() -> None:
    """REFERENCES 3.3: u(1) = 1.906667e-3 of the cylinder; the plate's equilibrium and free hole by differences."""
    assert lame(np.array([[1.0, 0.0, 0.0]]))[0, 0] == pytest.approx(1.906667e-3, abs=5e-10)
    angle = np.linspace(0, np.pi / 2, 7)
    X = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    H = differences(kirsch)(X)
    strain = 0.5 * (H + H.swapaxes(1, 2))
    stress = 2 * MU * strain + LAM * np.trace(strain, axis1=1, axis2=2)[:, None, None] * np.eye(3)
    np.testing.assert_allclose(np.einsum("nij,nj->ni", stress, X), 0.0, atol=1e-7)
    hoop = np.stack([-np.sin(angle), np.cos(angle), 0 * angle], axis=1)
    found = np.einsum("ni,nij,nj->n", hoop, stress, hoop)
    np.testing.assert_allclose(found, 1 - 2 * np.cos(2 * angle), atol=1e-6)  # -1 at 0 and 3 at 90 degrees


def quarter(kind: str, n: int, radii: Callable[[np.ndarray], np.ndarray], straight: bool) -> tuple[Mesh, np.ndarray]:
    """A quarter of a ring with n cells along and around, two through its thickness, and the square it was bent from.

    Quadratic cells have their mid-edge nodes on the circles, or in the middle of straight edges.
    """
    flat = Box((1.0, 1.0, 2 / n)).mesh(kind, 1 / n)
    r, angle = radii(flat.points[:, 0]), np.pi / 2 * flat.points[:, 1]
    points = np.stack([r * np.cos(angle), r * np.sin(angle), flat.points[:, 2]], axis=1)
    if straight:
        for k, (a, b) in enumerate(EDGES):
            points[flat.cells[:, 4 + k]] = (points[flat.cells[:, a]] + points[flat.cells[:, b]]) / 2
    return Mesh(points, flat.cells, kind), flat.points


# In the plate, steps grow with the radius: with equal steps quadratic tetrahedra come to 2.89 and 1.86 from 8 to 12
# cells, not yet to their order. In the ring, steps are equal: growing ones make the map of the square conformal, and
# Lame's displacements, anti-conformal, were then one order better than theory (4 and 3 with quadratic tetrahedra).
FIELDS = {"lame": (lame, lambda t: 1 + t), "kirsch": (kirsch, lambda t: 3.0**t)}


def bent(problem: str, kind: str, integrated: str, n: int, straight: bool = False) -> np.ndarray:
    """Relative errors of the ring under pressure, or of the plate under the exact displacements of its rim."""
    field, radii = FIELDS[problem]
    mesh, square = quarter(kind, n, radii, straight)
    low, high = np.abs(square) < 1e-9, np.abs(square - [1.0, 1.0, 2 / n]) < 1e-9
    held = np.stack([high[:, 1], low[:, 1], low[:, 2] | high[:, 2]], axis=1)  # symmetry, plane strain
    held |= high[:, :1] & (problem == "kirsch")
    fixed, rest = np.flatnonzero(held), np.zeros(mesh.points.size)
    loads = []
    if problem == "lame":
        g = np.zeros_like(rest)
        inside = mesh.facets[low[:, 0][mesh.facets].all(axis=1)]
        FollowerPressure(mesh.points, inside, 1.0).add_gradient(rest, g)
        loads = [DeadForces(-g)]
    to = field(mesh.points).ravel()[fixed]
    to[~np.repeat(high[:, 0] & (problem == "kirsch"), 3)[fixed]] = 0.0
    assembly = Assembly(len(rest), fixed, [energy(mesh, "linear_elastic", "small", integrated)], loads)
    x = equilibrium(Statics(assembly, VectorSpace(len(rest)), rest, fixed, to, convex=True)).x
    points = sampled(mesh)
    return points.norms(x, field, differences(field)) / points.norms(rest, field, differences(field))


# measured, L2 and energy: lame, kirsch
CURVED = [
    ("tet4", "full", (12, 16), (2.0, 1.0)),  # 1.993 0.998, 1.945 0.980
    ("hex8", "full", (12, 16), (2.0, 1.0)),  # 1.997 1.001, 1.991 0.998
    ("hex8", "selective", (12, 16), (2.0, 1.0)),  # 1.998 1.001, 1.996 0.998
    ("tet10", "full", (8, 12), (3.0, 2.0)),  # 2.965 1.960, 3.003 1.956
    ("hex20", "full", (8, 12), (3.0, 2.0)),  # 3.012 1.988, 3.005 2.004
    ("hex27", "full", (8, 12), (3.0, 2.0)),  # 3.011 1.987, 3.002 1.988
]


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("problem", ["lame", pytest.param("kirsch", marks=pytest.mark.slow)])
@pytest.mark.parametrize(("kind", "integrated", "edges", "order"), CURVED)
def test_order_on_curved_bodies(
    problem: str, kind: str, integrated: str, edges: tuple[int, int], order: tuple[float, float]
) -> None:
    rows = [bent(problem, kind, integrated, n) for n in edges]
    np.testing.assert_allclose(slopes(rows, edges), order, atol=TOLERANCE)


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize("problem", ["lame", pytest.param("kirsch", marks=pytest.mark.slow)])
def test_straight_edges_limit_quadratic_tetrahedra(problem: str) -> None:
    """The chords lie h^2 within the circle: order 2 in displacements, and in strains at least 3/2 by theory.

    Measured: 2.006 and 1.82 for the cylinder, 2.062 and 1.94 for the plate; meshes this coarse do not come down to
    3/2, so only the bound is tested. Source: Strang and Fix 1973, section 4.4.
    """
    edges = (12, 20)
    rows = [bent(problem, "tet10", "full", n, straight=True) for n in edges]
    found = slopes(rows, edges)
    assert found[0] == pytest.approx(2.0, abs=TOLERANCE)
    assert 1.5 <= found[1] <= 2.1
    assert np.all(rows[0] > bent(problem, "tet10", "full", edges[0]))
