"""Patch tests of selective integration over random irregular meshes, in space, in the plane and around an axis.

Nodes on the boundary take a displacement of constant gradient H; in equilibrium all others have it too, for the
stress is the same everywhere. So the forces on inner nodes vanish to rounding at that displacement, as tested. The
gradient at the centre in place of its mean leaves forces of 0.3 to 1.4 % of those of one cell.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.assembly.elastic_energy_factory import elastic_energy
from softmark.solvers.elements.hex8 import Hex8
from softmark.solvers.energies.axisymmetric import AxisymmetricElastic
from softmark.solvers.energies.elastic_energy import Elastic
from softmark.solvers.energies.energy import Energy, VectorSpace
from softmark.solvers.energies.external_loads import DeadForces
from softmark.solvers.materials import MATERIALS, law_for
from softmark.solvers.mesh.element_interpolation import integrate_cells, mean_gradients
from softmark.solvers.mesh.mesh import Mesh
from softmark.solvers.mesh.shapes import Box
from softmark.solvers.statics.static_equilibrium import Statics, equilibrium

# random meshes: a quick test has the first of them, a slow one all others
DRAWN = [range(30), pytest.param(range(30, 200), marks=pytest.mark.slow)]
SAME = 1e-12  # of the force of one cell: rounding of sums over eight cells


@cache
def block(height: float) -> Mesh:
    """Cells of about a unit in a square of three units."""
    return Box((3.0, 3.0, height)).mesh("hex8", 1.0)


def irregular(seed: int) -> Mesh:
    """48 hexahedra in a block, inner nodes moved by up to a fifth of a cell along each axis."""
    chance, mesh = np.random.default_rng(seed), block(3.0)
    points = mesh.points * chance.uniform(0.3, 3.0, 3)
    inner = inside(mesh)
    points[inner] += chance.uniform(-0.2, 0.2, (inner.sum(), 3)) * (points.max(axis=0) / 3.0)
    return Mesh(points, mesh.cells, "hex8")


def inside(mesh: Mesh) -> Any:
    """Return which nodes (n,) are on no face of the box."""
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    return np.all((mesh.points > low + 1e-9) & (mesh.points < high - 1e-9), axis=1)


def selective(mesh: Mesh, strain: str, poisson: float = 0.45) -> Energy:
    """The selectively integrated energy of neo-Hookean cells, E = 1 Pa; at small strain Hooke's law."""
    material, parts = MATERIALS["neo_hookean"](1.0, poisson, 1.0), integrate_cells(mesh)
    elastic = Elastic(mesh.cells, parts.dNdX, parts.w, law_for(material, strain))
    return elastic_energy(mesh, elastic, material, strain, selective=True)


@pytest.mark.parametrize("seeds", DRAWN)
@pytest.mark.parametrize("strain", ["small", "corotational", "finite"])
def test_forces_vanish_inside_a_constant_gradient(strain: str, seeds: range) -> None:
    for seed in seeds:
        mesh, chance = irregular(seed), np.random.default_rng(seed)
        energy = selective(mesh, strain)
        u, g = mesh.points @ (0.1 * chance.standard_normal((3, 3))).T, np.zeros(mesh.points.size)
        energy.add_gradient(np.ascontiguousarray(u).ravel(), g)
        forces = np.abs(g.reshape(-1, 3))
        assert forces[inside(mesh)].max() < SAME * forces.max()


@pytest.mark.parametrize("seeds", DRAWN)
def test_the_mean_gradient_has_the_volume_of_its_cell(seeds: range) -> None:
    for seed in seeds:
        mesh = irregular(seed)
        once, X = mean_gradients(mesh), mesh.points[mesh.cells]
        # sum_a X_a (x) int dN_a/dX dV is the volume times the unit tensor, by the theorem of divergence
        found = np.einsum("mai,maJ->miJ", X, once.dNdX[:, 0])
        assert found == pytest.approx(np.broadcast_to(np.eye(3), found.shape), abs=1e-13)
        assert once.w.sum() == pytest.approx(np.prod(np.ptp(mesh.points, axis=0)), rel=1e-13)


@pytest.mark.parametrize("seeds", DRAWN)
def test_rings_pass_it_too(seeds: range) -> None:
    """Equal stretch along x and around the axis, another along y: r = a R, y = b Y, of constant stress.

    Forces at inner nodes vanish, for a slice of one cell of depth in which nodes move within the plane.
    """
    material = MATERIALS["neo_hookean"](1.0, 0.45, 1.0)
    for seed in seeds:
        chance, flat = np.random.default_rng(seed), block(1.0)
        points, low = flat.points.copy(), flat.points[:, 2] < 0.5
        inner = np.all((points[:, :2] > 1e-9) & (points[:, :2] < 3.0 - 1e-9), axis=1)
        shift = {tuple(np.round(p[:2], 6)): chance.uniform(-0.2, 0.2, 2) for p in points[inner & low]}
        for i in np.flatnonzero(inner):
            points[i, :2] += shift[tuple(np.round(flat.points[i, :2], 6))]
        points[:, 0] += chance.uniform(0.0, 3.0)
        mesh = Mesh(points, flat.cells, "hex8")
        parts = integrate_cells(mesh)
        elastic = AxisymmetricElastic.of(
            Elastic(mesh.cells, parts.dNdX, parts.w, law_for(material, "finite")), parts.N, mesh.points, 1.0
        )
        energy = elastic_energy(mesh, elastic, material, "finite", selective=True)
        a, b = chance.uniform(-0.1, 0.2, 2)
        u, g = points * [a, b, 0.0], np.zeros(points.size)
        energy.add_gradient(u.ravel(), g)
        forces = np.abs(g.reshape(-1, 3)[:, :2])
        assert forces[inner].max() < SAME * forces.max()


@pytest.mark.parametrize("strain", ["small", "corotational", "finite"])
def test_forces_and_stiffness_are_derivatives_of_the_energy(strain: str) -> None:
    """Central differences along random directions, at random states: steps of 1e-5 of a cell leave errors of 1e-8."""
    chance = np.random.default_rng(1)
    for seed in range(3):
        mesh = irregular(seed)
        n = mesh.points.size
        energy, u = selective(mesh, strain), 0.05 * chance.standard_normal(n)
        whole = Assembly(n, np.zeros(0, dtype=np.int64), [energy], [])
        K = whole.tangent(u, 1.0)
        assert abs(K - K.T).max() < SAME * abs(K).max()
        for _ in range(3):
            v = 1e-5 * chance.standard_normal(n)
            rise = energy.value(u + v) - energy.value(u - v)
            assert rise == pytest.approx(
                2.0 * whole.gradient(u, 1.0) @ v, rel=1e-6, abs=1e-7 * float(np.linalg.norm(v))
            )
            turn = whole.gradient(u + v, 1.0) - whole.gradient(u - v, 1.0)
            assert turn == pytest.approx(2.0 * (K @ v), abs=1e-7 * np.abs(turn).max())


@pytest.mark.parametrize("poisson", [0.3, 0.49, 0.4999])
def test_small_strain_is_that_of_divergences_projected_by_scikit_fem(poisson: float) -> None:
    """An irregular block, clamped below, pulled aside above; to the rounding of lam / mu = 5000."""
    sk, helpers = pytest.importorskip("skfem"), pytest.importorskip("skfem.helpers")
    mesh, f = irregular(3), np.zeros((100, 3))
    z, lam, mu = mesh.points[:, 2], poisson / ((1 + poisson) * (1 - 2 * poisson)), 0.5 / (1 + poisson)
    f[z > z.max() - 1e-9] = [0.001, 0.0, -0.002]
    fixed = (3 * np.flatnonzero(z < 1e-9)[:, None] + np.arange(3)).ravel()
    assembly = Assembly(f.size, fixed, [selective(mesh, "small", poisson)], [DeadForces(f.ravel())])
    start, still = np.zeros(f.size), np.zeros(len(fixed))
    found = equilibrium(Statics(assembly, VectorSpace(f.size), start, fixed, still, convex=True)).x.reshape(-1, 3)

    order = np.argmax(Hex8.shape(2.0 * sk.MeshHex().p.T - 1.0), axis=1)  # of corners there
    vectors = sk.Basis(
        sk.MeshHex(mesh.points.T.copy(), mesh.cells[:, order].T.copy()), sk.ElementVector(sk.ElementHex1()), intorder=3
    )
    constants = vectors.with_element(sk.ElementHex0())
    strain, div = helpers.sym_grad, helpers.div
    A = sk.BilinearForm(lambda u, v, _: 2.0 * mu * helpers.ddot(strain(u), strain(v))).assemble(vectors)
    B = sk.BilinearForm(lambda u, q, _: div(u) * q).assemble(vectors, constants)
    V = sk.BilinearForm(lambda p, q, _: p * q).assemble(constants).diagonal()
    dofs, loads = vectors.nodal_dofs.T, np.zeros(f.size)
    loads[dofs] = f
    K = (A + B.T @ (B.multiply((lam / V)[:, None]))).tocsc()
    right = sk.solve(*sk.condense(K, loads, D=dofs.ravel()[fixed]))[dofs]
    assert found == pytest.approx(right, abs=1e-9 * np.abs(right).max())
