"""Bodies of revolution: gradients and tangents against finite differences, volumes against Pappus."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from equal_moduli import made

from softmark.solvers.assembly.elastic_energy_factory import elastic_parts
from softmark.solvers.assembly.mixed_elements import mixed_energy
from softmark.solvers.energies.axisymmetric import (
    AxisymmetricElastic,
    AxisymmetricPressure,
    hoop_terms_and_ring_volumes,
)
from softmark.solvers.energies.elastic_energy import Elastic
from softmark.solvers.energies.energy import Energy, Floats
from softmark.solvers.energies.mixed_displacement_pressure import MeanDilatation, MixedSolid
from softmark.solvers.independent_forces import solid_forces
from softmark.solvers.independent_forces.mixed_formulation_forces import MixedBody, split_law
from softmark.solvers.materials import MATERIALS, law_for, mixed_for
from softmark.solvers.materials.neo_hookean import NeoHookean
from softmark.solvers.mesh.element_interpolation import integrate_cells
from softmark.solvers.mesh.mesh import Mesh
from softmark.solvers.mesh.plane_regions import Quadrilateral, Slice
from softmark.solvers.stress_recovery.sampling_point_stress import DeformedState

DEPTH = 0.1
SECTION = Slice(Quadrilateral((0.2, 0.0, 0.0), (1.0, 0.1, 0.0), (1.2, 1.0, 0.0), (0.0, 0.9, 0.0)), DEPTH)
GEL = NeoHookean(young=1.0, poisson=0.3, density=1.0)


def revolved(kind: str, strain: str = "finite", size: float = 0.6) -> tuple[AxisymmetricElastic, Floats]:
    """The energy of a tapered ring, and its nodes (n, 3)."""
    mesh = SECTION.mesh(kind, size)
    parts = integrate_cells(mesh)
    elastic = Elastic(mesh.cells, parts.dNdX, parts.w, law_for(GEL, strain))
    return AxisymmetricElastic.of(elastic, parts.N, mesh.points, DEPTH), mesh.points


def bent(points: Floats) -> Floats:
    """A motion in the plane, of a fifth of the size, the same for all z."""
    x, y, _ = points.T
    return np.stack([0.2 * x * y + 0.1 * x, 0.1 * np.sin(x + y), 0.0 * x], axis=1).ravel()


def tangent(energy: Energy, x: Floats, projected: bool = False) -> Floats:
    """Dense (n, n)."""
    stencils, n = energy.stencils, len(x)
    slots = np.arange(stencils.shape[0] * stencils.shape[1] ** 2).reshape(*stencils.shape, stencils.shape[1])
    data = np.zeros(slots.size)
    energy.add_hessian(x, data, slots, 1.0, projected)
    K = np.zeros((n, n))
    np.add.at(K, (stencils[:, :, None], stencils[:, None, :]), data.reshape(slots.shape))
    return K


def gradient(energy: Energy, x: Floats) -> Floats:
    g = np.zeros_like(x)
    energy.add_gradient(x, g)
    return g


def differences(f: object, x: Floats, h: float = 1e-5) -> Floats:
    """df/dx by central differences: at unit scale they are right to h^2."""
    assert callable(f)
    steps = h * np.eye(len(x))
    return np.array([(np.asarray(f(x + d)) - np.asarray(f(x - d))) / (2 * h) for d in steps]).T


@pytest.mark.parametrize("strain", ["small", "corotational", "finite"])
def test_derivatives_of_the_energy(strain: str) -> None:
    """Against central differences, to 1e-7 of the largest; along z nothing pulls."""
    energy, points = revolved("hex8", strain)
    x = bent(points)
    g, K = gradient(energy, x), tangent(energy, x)
    across = np.arange(len(x)) % 3 == 2
    assert np.abs(g[across]).max() < 1e-14 * np.abs(g).max()
    assert differences(energy.value, x)[~across] == pytest.approx(g[~across], rel=0, abs=1e-7 * np.abs(g).max())
    by_steps = differences(lambda y: gradient(energy, y), x)
    assert by_steps == pytest.approx(K, rel=0, abs=1e-7 * np.abs(K).max())
    assert np.abs(K - K.T).max() < 1e-12 * np.abs(K).max()
    assert np.linalg.eigvalsh(tangent(energy, x, projected=True)).min() > -1e-10 * np.abs(K).max()


@pytest.mark.parametrize("kind", ["hex8", "hex20", "hex27"])
def test_derivatives_of_a_pressure_on_rings(kind: str) -> None:
    """Its tangent against central differences of its forces; whole rings, so the force along y is that on discs."""
    mesh = SECTION.mesh(kind, 0.6)
    inner = mesh.facets[(np.abs(mesh.points[mesh.facets] @ (0.9, 0.2, 0.0) - 0.18) < 1e-9).all(axis=1)]
    load = AxisymmetricPressure(mesh.points, inner, 3.0, depth=DEPTH)
    x = bent(mesh.points)
    K = tangent(load, x)
    assert differences(lambda y: gradient(load, y), x) == pytest.approx(K, rel=0, abs=1e-8 * np.abs(K).max())
    r = (mesh.points + x.reshape(-1, 3))[np.unique(inner), 0]
    force = -gradient(load, x).reshape(-1, 3)[:, 1].sum()
    assert abs(force) == pytest.approx(3.0 * np.pi * (r.max() ** 2 - r.min() ** 2), rel=1e-12)


@pytest.mark.parametrize("kind", ["hex8", "hex20", "hex27"])
def test_volumes_and_forces_found_again(kind: str) -> None:
    """Pappus's volume, 2 pi times the first moment of the section, and nodal forces by the formulas of the checks."""
    energy, points = revolved(kind)
    a, b, c, d = ((0.2, 0.0), (1.0, 0.1), (1.2, 1.0), (0.0, 0.9))
    moment = sum(
        (p[0] * q[1] - q[0] * p[1]) * (p[0] + q[0]) / 6.0 for p, q in ((a, b), (b, c), (c, d), (d, a))
    )  # of a polygon
    assert energy.w.sum() == pytest.approx(2 * np.pi * moment, rel=1e-12)
    law, x = energy.law, bent(points)
    body = solid_forces.CheckedBody(
        points, energy.cells, kind, x.reshape(-1, 3), (solid_forces.StressTerm(law.P),), 1.0, depth=DEPTH
    )
    f, _ = body.forces(energy.cells)
    assert f.ravel() == pytest.approx(gradient(energy, x), rel=0, abs=1e-13 * np.abs(f).max())


def held(kind: str, strain: str, material: Any = GEL, mixed: bool = False) -> tuple[Any, Floats]:
    """The tapered ring with pressures, or with one mean for each cell, and its nodes (n, 3)."""
    mesh = SECTION.mesh(kind, 0.6)
    parts, split = integrate_cells(mesh), mixed_for(material, strain)
    assert split is not None
    if mixed:
        made: Any = mixed_energy(mesh, parts, split, material.shear_modulus)
    else:
        made = MeanDilatation(mesh.cells, parts.dNdX, parts.w, split.shape, split.constraint, split.modulus)
    hoop, w = hoop_terms_and_ring_volumes(made, parts.N, mesh.points, DEPTH)
    return replace(made, w=w, hoop=hoop), mesh.points


def differentiated(energy: Any, x: Floats, across: Any) -> None:
    """Forces and stiffness are those of the value by central differences, to 1e-7 of the largest."""
    g, K = gradient(energy, x), tangent(energy, x)
    assert differences(energy.value, x)[~across] == pytest.approx(g[~across], rel=0, abs=1e-7 * np.abs(g).max())
    by_steps = differences(lambda y: gradient(energy, y), x)
    assert by_steps == pytest.approx(K, rel=0, abs=1e-7 * np.abs(K).max())
    assert np.abs(g[across]).max() < 1e-13 * np.abs(g).max()


@pytest.mark.parametrize("name", [name for name in MATERIALS if name != "linear_elastic"])
def test_derivatives_of_every_law_with_one_mean_in_each_cell(name: str) -> None:
    energy, points = held("hex8", "finite", made(name, 1.0, 0.45))
    x = bent(points)
    differentiated(energy, x, np.arange(len(x)) % 3 == 2)


@pytest.mark.parametrize("strain", ["small", "corotational", "finite"])
def test_derivatives_with_pressures(strain: str) -> None:
    energy, points = held("hex8", strain, mixed=True)
    assert isinstance(energy, MixedSolid)
    x = np.concatenate([bent(points), 0.1 * np.arange(energy.dofs - points.size)])
    differentiated(energy, x, (np.arange(len(x)) % 3 == 2) & (np.arange(len(x)) < points.size))


@pytest.mark.parametrize("kind", ["hex8", "hex20", "hex27"])
@pytest.mark.parametrize("strain", ["small", "corotational", "finite"])
def test_forces_with_pressures_found_again(kind: str, strain: str) -> None:
    """By the formulas of the checks: nodal forces, and what the volumes of whole rings lack."""
    split = split_law(GEL, strain, GEL.young, GEL.poisson)
    assert split is not None
    energy, points = held(kind, strain, mixed=True)
    x = np.concatenate([bent(points), 0.1 * np.sin(np.arange(energy.dofs - points.size))])
    p = energy.unit * x[energy.pressures]
    body = MixedBody(points, energy.cells, kind, bent(points).reshape(-1, 3), split, GEL.shear_modulus, p, DEPTH)
    f, lacking, _ = body.forces()
    g = gradient(energy, x)
    assert f.ravel() == pytest.approx(g[: points.size], rel=0, abs=1e-12 * np.abs(f).max())
    assert lacking == pytest.approx(np.linalg.norm(g[points.size :]), rel=0.3)  # of other units: mean cells differ
    if kind == "hex8":
        means, _ = held(kind, strain)
        alone = MixedBody(
            points, energy.cells, kind, bent(points).reshape(-1, 3), split, GEL.shear_modulus, None, DEPTH
        )
        assert alone.forces()[0].ravel() == pytest.approx(
            gradient(means, bent(points)), rel=0, abs=1e-12 * np.abs(f).max()
        )


def test_selective_points_lie_on_rings_too() -> None:
    """The part of the volume, once per cell, has the mean deformation gradient and the volume of whole rings."""
    mesh = SECTION.mesh("hex8", 0.6)
    energy, points = revolved("hex8", "small")
    _, middle = elastic_parts(mesh, energy, GEL, "small", selective=True)
    assert isinstance(middle, AxisymmetricElastic)
    x = bent(points)
    share = energy.w / energy.w.sum(axis=1, keepdims=True)  # of whole rings
    mean = np.einsum("mq,mqij->mij", share, energy.F(x).reshape(*share.shape, 3, 3))
    assert middle.F(x) == pytest.approx(mean, rel=1e-13)
    assert middle.w.sum() == pytest.approx(energy.w.sum(), rel=1e-13)
    differentiated(middle, x, np.arange(len(x)) % 3 == 2)


def test_stress_where_constants_vary_is_of_the_means_over_whole_rings() -> None:
    """Integrated selectively, blown up by e, stress is 2 mu e of the point and 3 lam e of the cell as solved."""
    mesh, e = SECTION.mesh("hex8", 0.6), 1e-3

    def at_points(material: Any, mesh: Mesh, rule: Any) -> NeoHookean:
        r = mesh.points[mesh.cells, 0] @ mesh.element.shape(rule[0]).T
        return replace(GEL, young=1.0 + r**2)  # type: ignore[arg-type]

    parts, own = integrate_cells(mesh), at_points(None, mesh, mesh.element.quadrature())
    ring = AxisymmetricElastic.of(
        Elastic(mesh.cells, parts.dNdX, parts.w, law_for(own, "small")), parts.N, mesh.points, DEPTH
    )
    volume: Any = elastic_parts(mesh, ring, own, "small", True)[1].law
    state = DeformedState(
        mesh, own, "small", e * mesh.points * [1.0, 1.0, 0.0], "selective", revolved=True, at=at_points
    )
    _, sigma, _ = state.sampled(mesh.element.quadrature())
    expected = 2.0 * e * np.asarray(own.shear_modulus) + 3.0 * e * volume.law.lam
    assert sigma[..., :3] == pytest.approx(np.repeat(expected[..., None], 3, axis=2), rel=1e-12)
