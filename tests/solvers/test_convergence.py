"""Observed order of convergence by a manufactured solution: what no single number can show."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from softmark.solvers.elements.interpolation import integration
from softmark.solvers.energies.elastic import Elastic
from softmark.solvers.energies.loads import DeadForces
from softmark.solvers.materials import Law
from softmark.solvers.mesh.mesh import Mesh, jacobians
from softmark.solvers.mesh.shapes import Box
from softmark.solvers.statics import Statics, equilibrium

YOUNG = 1000.0
SIDES = np.array(
    [0.05, 0.1, -0.05]
)  # u = SIDES sin(pi X) sin(pi Y) sin(pi Z), zero on the surface of the unit cube


def exact(X: np.ndarray) -> np.ndarray:
    """u (n, 3)."""
    return np.asarray(np.sin(np.pi * X).prod(axis=1)[:, None] * SIDES)


def slope(X: np.ndarray) -> np.ndarray:
    """du_i/dX_J (n, 3, 3)."""
    s, c = np.sin(np.pi * X), np.pi * np.cos(np.pi * X)
    ds = np.stack(
        [c[:, 0] * s[:, 1] * s[:, 2], s[:, 0] * c[:, 1] * s[:, 2], s[:, 0] * s[:, 1] * c[:, 2]], axis=1
    )
    return SIDES[:, None] * ds[:, None, :]


def curvature(X: np.ndarray) -> np.ndarray:
    """d2u_k/dX_J dX_L (n, 3, 3, 3), by the product rule."""
    s, c = np.sin(np.pi * X), np.pi * np.cos(np.pi * X)
    H = np.empty((len(X), 3, 3))
    for J in range(3):
        for L in range(3):
            rest = [s[:, k] for k in range(3) if k not in (J, L)]
            pair = [-(np.pi**2) * s[:, J]] if J == L else [c[:, J], c[:, L]]
            H[:, J, L] = np.prod([*rest, *pair], axis=0)
    return SIDES[:, None, None] * H[:, None]


def body_force(law: Law, X: np.ndarray) -> np.ndarray:
    """b = -Div P = -dP_iJ/dF_kL d2u_k/dX_J dX_L, N per undeformed m^3 (n, 3)."""
    return -np.einsum("niJkL,nkJL->ni", law.dPdF(np.eye(3) + slope(X)), curvature(X))


# b at (0.25, 0.5, 0.3) for E = 1000, derived from the stresses by another route (symbolic differentiation)
TABLE = [
    ("small", 0.3, (794.3902, 1194.3503, -794.3902)),
    ("small", 0.49, (8462.1262, 10041.5787, -8462.1262)),
    ("st_venant_kirchhoff", 0.3, (1130.7342, 1377.6040, -758.4217)),
    ("st_venant_kirchhoff", 0.49, (11026.1860, 12451.8044, -9555.9141)),
    ("neo_hookean", 0.3, (605.8324, 1173.6124, -900.4762)),
    ("neo_hookean", 0.49, (5126.1017, 9594.4171, -10219.4068)),
]


@pytest.mark.parametrize(("name", "poisson", "force"), TABLE)
def test_body_force_is_that_of_the_table(
    name: str, poisson: float, force: tuple[float, ...], law: Callable[..., Law]
) -> None:
    """Four decimals are printed."""
    b = body_force(law(name, YOUNG, poisson), np.array([[0.25, 0.5, 0.3]]))
    np.testing.assert_allclose(b[0], force, atol=6e-5)


def quadrature(kind: str = "tet4", order: int = 4) -> tuple[np.ndarray, np.ndarray]:
    """Points (q, 3) and weights (q,): Gauss in a cube, for the unit tetrahedron folded (Duffy 1982)."""
    t, w = np.polynomial.legendre.leggauss(order)
    if kind == "hex8":
        cube = np.stack([x.ravel() for x in np.meshgrid(t, t, t)], axis=1)
        return cube, np.prod([x.ravel() for x in np.meshgrid(w, w, w)], axis=0)
    a, b, c = (x.ravel() for x in np.meshgrid((t + 1) / 2, (t + 1) / 2, (t + 1) / 2))
    wa, wb, wc = (x.ravel() / 2 for x in np.meshgrid(w, w, w))
    xi = np.stack([a, b * (1 - a), c * (1 - a) * (1 - b)], axis=1)
    return xi, wa * wb * wc * (1 - a) ** 2 * (1 - b)


XI, W = quadrature()


def places(mesh: Mesh) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Quadrature points (m, q, 3), weights (m, q) of all cells, and shape functions N (q, a)."""
    xi, w = quadrature(mesh.kind)
    N = mesh.element.shape(xi)
    return np.einsum("qa,mai->mqi", N, mesh.points[mesh.cells]), w * jacobians(mesh, xi), N


def consistent(mesh: Mesh, law: Law) -> DeadForces:
    """Nodal forces: the integral of N_a b."""
    X, w, N = places(mesh)
    b = body_force(law, X.reshape(-1, 3)).reshape(X.shape)
    f = np.zeros_like(mesh.points)
    np.add.at(f, mesh.cells, np.einsum("mq,qa,mqi->mai", w, N, b))
    return DeadForces(f.ravel())


def errors(mesh: Mesh, x: np.ndarray) -> tuple[float, float]:
    """Norms of the error of u (L2) and of its gradient (H1 seminorm)."""
    X, w, N = places(mesh)
    nodal = x.reshape(-1, 3)[mesh.cells]
    off = np.einsum("qa,mai->mqi", N, nodal) - exact(X.reshape(-1, 3)).reshape(X.shape)
    dNdX = integration(mesh, rule=quadrature(mesh.kind)).dNdX
    tilt = np.einsum("mai,mqaJ->mqiJ", nodal, dNdX) - slope(X.reshape(-1, 3)).reshape(*X.shape, 3)
    return float(np.sqrt(np.sum(w * (off**2).sum(-1)))), float(np.sqrt(np.sum(w * (tilt**2).sum((-2, -1)))))


def solved(
    n: int,
    name: str,
    law: Callable[..., Law],
    elastic: Callable[..., Elastic],
    problem: Callable[..., Statics],
    kind: str = "tet4",
) -> tuple[float, float]:
    """Errors on a cube with n edges along each side."""
    mesh, own = Box((1.0, 1.0, 1.0)).mesh(kind, 1.0 / n), law(name, YOUNG, 0.3)
    surface = np.isin(np.arange(len(mesh.points)), mesh.facets)
    energy = elastic(mesh, own)
    task = problem(mesh, energy, surface, [consistent(mesh, own)])
    if name != "small":
        twin = elastic(mesh, law("corotational", YOUNG, 0.3))
        task = replace(task, twin=task.assembly.with_internal([twin]))
    return errors(mesh, equilibrium(task).x)


@pytest.mark.parametrize("name", ["small", "neo_hookean"])
def test_linear_tetrahedra_converge_with_their_order(
    name: str, law: Callable[..., Law], elastic: Callable[..., Elastic], problem: Callable[..., Statics]
) -> None:
    """h^2 in displacements and h in strains, from each mesh to the next, up to the next power of h."""
    edges = np.array([4, 8, 14])
    found = np.array([solved(int(n), name, law, elastic, problem) for n in edges])
    orders = -np.diff(np.log(found), axis=0) / np.diff(np.log(edges))[:, None]
    np.testing.assert_allclose(orders[-1], [2.0, 1.0], atol=0.1)
    np.testing.assert_allclose(orders[:, 0], 2.0, atol=0.15)
    np.testing.assert_allclose(orders[:, 1], 1.0, atol=0.1)


@pytest.mark.parametrize(
    ("kind", "edges", "order", "slack"),
    [("hex8", (4, 8, 12), 2.0, 0.1), ("tet10", (2, 4, 6), 3.0, 0.15)],
)
def test_other_elements_converge_with_their_order(
    kind: str, edges: tuple[int, ...], order: float, slack: float,
    law: Callable[..., Law], elastic: Callable[..., Elastic], problem: Callable[..., Statics],
) -> None:  # fmt: skip
    """h^2 and h for trilinear, h^3 and h^2 for quadratic shape functions, on the last two meshes."""
    found = np.array([solved(n, "small", law, elastic, problem, kind) for n in edges[-2:]])
    rate = -np.diff(np.log(found), axis=0)[0] / np.log(edges[-1] / edges[-2])
    np.testing.assert_allclose(rate, [order, order - 1], atol=slack)


def test_quadrature_of_the_test_itself() -> None:
    """Volume 1/6, and the integral of xi^2 eta zeta, 2!/7!."""
    assert W.sum() == pytest.approx(1 / 6, rel=1e-14)
    assert W @ (XI[:, 0] ** 2 * XI[:, 1] * XI[:, 2]) == pytest.approx(2 / 5040, rel=1e-13)
