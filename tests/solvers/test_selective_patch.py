"""Patch tests of selective integration over random irregular meshes, in space, in the plane and around an axis.

Nodes on the boundary take a displacement of constant gradient H; in equilibrium all others have it too, for the
stress is the same everywhere. So the forces on inner nodes vanish to rounding at that displacement, as tested. The
gradient at the centre in place of its mean leaves forces of 0.3 to 1.4 % of those of one cell.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from softmark.solvers.assembly.solids import elastic_energy
from softmark.solvers.energies.elastic import Elastic
from softmark.solvers.energies.revolved import Revolved
from softmark.solvers.materials import MATERIALS, law_for
from softmark.solvers.mesh.interpolation import integration, mean_gradients
from softmark.solvers.mesh.mesh import Mesh
from softmark.solvers.mesh.shapes import Box

DRAWN = 200
SAME = 1e-12  # of the force of one cell: rounding of sums over eight cells


def irregular(seed: int) -> Mesh:
    """27 hexahedra in a cube of three units, inner nodes moved by up to a fifth of a cell along each axis."""
    chance, mesh = np.random.default_rng(seed), Box((3.0, 3.0, 3.0)).mesh("hex8", 1.0)
    points = mesh.points * chance.uniform(0.3, 3.0, 3)
    inner = inside(mesh)
    points[inner] += chance.uniform(-0.2, 0.2, (inner.sum(), 3)) * (points.max(axis=0) / 3.0)
    return Mesh(points, mesh.cells, "hex8")


def inside(mesh: Mesh) -> Any:
    """Which nodes (n,) are on no face of the box."""
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    return np.all((mesh.points > low + 1e-9) & (mesh.points < high - 1e-9), axis=1)


@pytest.mark.parametrize("strain", ["small", "corotational", "finite"])
def test_forces_vanish_inside_a_constant_gradient(strain: str) -> None:
    material = MATERIALS["neo_hookean"](1.0, 0.45, 1.0)
    for seed in range(DRAWN):
        mesh, chance = irregular(seed), np.random.default_rng(seed)
        parts = integration(mesh)
        elastic = Elastic(mesh.cells, parts.dNdX, parts.w, law_for(material, strain))
        energy = elastic_energy(mesh, elastic, material, strain, selective=True)
        u, g = mesh.points @ (0.1 * chance.standard_normal((3, 3))).T, np.zeros(mesh.points.size)
        energy.add_gradient(np.ascontiguousarray(u).ravel(), g)
        forces = np.abs(g.reshape(-1, 3))
        assert forces[inside(mesh)].max() < SAME * forces.max()


def test_the_mean_gradient_has_the_volume_of_its_cell() -> None:
    for seed in range(DRAWN):
        mesh = irregular(seed)
        once, X = mean_gradients(mesh), mesh.points[mesh.cells]
        # sum_a X_a (x) int dN_a/dX dV is the volume times the unit tensor, by the theorem of divergence
        found = np.einsum("mai,maJ->miJ", X, once.dNdX[:, 0])
        assert found == pytest.approx(np.broadcast_to(np.eye(3), found.shape), abs=1e-13)
        assert once.w.sum() == pytest.approx(np.prod(np.ptp(mesh.points, axis=0)), rel=1e-13)


def test_rings_pass_it_too() -> None:
    """Equal stretch along x and around the axis, another along y: r = a R, y = b Y, of constant stress.

    Forces at inner nodes vanish, for a slice of one cell of depth in which nodes move within the plane.
    """
    material = MATERIALS["neo_hookean"](1.0, 0.45, 1.0)
    for seed in range(DRAWN):
        chance, flat = np.random.default_rng(seed), Box((3.0, 3.0, 1.0)).mesh("hex8", 1.0)
        points, low = flat.points.copy(), flat.points[:, 2] < 0.5
        inner = np.all((points[:, :2] > 1e-9) & (points[:, :2] < 3.0 - 1e-9), axis=1)
        shift = {tuple(np.round(p[:2], 6)): chance.uniform(-0.2, 0.2, 2) for p in points[inner & low]}
        for i in np.flatnonzero(inner):
            points[i, :2] += shift[tuple(np.round(flat.points[i, :2], 6))]
        points[:, 0] += chance.uniform(0.0, 3.0)
        mesh = Mesh(points, flat.cells, "hex8")
        parts = integration(mesh)
        elastic = Revolved.of(
            Elastic(mesh.cells, parts.dNdX, parts.w, law_for(material, "finite")), parts.N, mesh.points, 1.0
        )
        energy = elastic_energy(mesh, elastic, material, "finite", selective=True)
        a, b = chance.uniform(-0.1, 0.2, 2)
        u, g = points * [a, b, 0.0], np.zeros(points.size)
        energy.add_gradient(u.ravel(), g)
        forces = np.abs(g.reshape(-1, 3)[:, :2])
        assert forces[inner].max() < SAME * forces.max()
