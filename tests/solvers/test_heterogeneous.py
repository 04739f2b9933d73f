"""Laws whose constants differ from point to point: at each point they are those of its constants, in every form."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from softmark.solvers.assembly.elastic_energy_factory import elastic_energy, elastic_parts
from softmark.solvers.energies.elastic_energy import Elastic
from softmark.solvers.energies.mixed_displacement_pressure import MeanDilatation
from softmark.solvers.materials import MATERIALS, damping_tangents_for, law_for, mixed_for, shear_and_volume_laws
from softmark.solvers.materials.heterogeneous import average_moduli, with_constants
from softmark.solvers.materials.plane_stress import Plate
from softmark.solvers.mesh.element_interpolation import integrate_cells
from softmark.solvers.mesh.shapes import Box
from softmark.solvers.model_reduction.cell_energies import restrict_to_cells

Floats = NDArray[np.float64]

RNG = np.random.default_rng(11)
CELLS, POINTS = 4, 2
E = RNG.uniform(1.0, 9.0, (CELLS, POINTS))
NU = RNG.uniform(0.0, 0.45, (CELLS, POINTS))
F = np.eye(3) + RNG.uniform(-0.15, 0.15, (CELLS * POINTS, 3, 3))
PAIRS = [(n, s) for n, m in MATERIALS.items() for s in ("small", "corotational", "finite")
         if "young" in m.varying and (s != "finite" or m(1.0, 0.3, 1.0).finite_law() is not None)]  # fmt: skip


def one_by_one(make: Any, name: str, strain: str, call: str) -> Floats:
    """What the law of each point by itself gives."""
    constants = zip(E.ravel(), NU.ravel(), strict=True)
    return np.concatenate([getattr(make(MATERIALS[name](e, nu, 1.0), strain), call)(F[i : i + 1])
                           for i, (e, nu) in enumerate(constants)])  # fmt: skip


def alike(a: Floats, b: Floats) -> None:
    """Equal to rounding: the same arithmetic in another order."""
    np.testing.assert_allclose(a, b, rtol=1e-12, atol=1e-12 * np.abs(b).max())


@pytest.mark.parametrize("call", ["psi", "P", "dPdF", "dPdF_projected"])
@pytest.mark.parametrize(("name", "strain"), PAIRS)
def test_every_point_has_its_own_constants(name: str, strain: str, call: str) -> None:
    """The whole law, its parts, the shape of elements with pressures, and what damps."""
    varying = MATERIALS[name](E, NU, 1.0)  # type: ignore[arg-type]
    alike(getattr(law_for(varying, strain), call)(F), one_by_one(law_for, name, strain, call))
    for i in range(2):
        parts = shear_and_volume_laws(varying, strain)
        assert parts is not None
        alike(
            getattr(parts[i], call)(F), one_by_one(lambda m, s, i=i: shear_and_volume_laws(m, s)[i], name, strain, call)
        )  # type: ignore[misc]
    mixed = mixed_for(varying, strain)
    assert mixed is not None
    alike(getattr(mixed.shape, call)(F), one_by_one(lambda m, s: mixed_for(m, s).shape, name, strain, call))  # type: ignore[union-attr]
    if strain != "small" and call == "dPdF_projected":
        drags = damping_tangents_for(varying, strain)
        assert drags is not None
        for i in range(2):
            alike(
                drags[i].dPdF_projected(F),
                one_by_one(lambda m, s, i=i: damping_tangents_for(m, s)[i], name, strain, call),
            )  # type: ignore[misc]


@pytest.mark.parametrize("call", ["psi", "P", "dPdF"])
def test_a_plate_opens_by_the_constants_of_each_point(call: str) -> None:
    plane = F.copy()
    plane[:, 2, :2] = plane[:, :2, 2] = 0.0
    solid = MATERIALS["neo_hookean"](E, NU, 1.0)  # type: ignore[arg-type]
    found = getattr(law_for(Plate.from_material(solid), "finite"), call)(plane)
    each = [
        getattr(law_for(Plate.from_material(MATERIALS["neo_hookean"](e, nu, 1.0)), "finite"), call)(plane[i : i + 1])
        for i, (e, nu) in enumerate(zip(E.ravel(), NU.ravel(), strict=True))
    ]
    alike(found, np.concatenate(each))


def test_many_points_are_handed_on_in_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    law = law_for(MATERIALS["neo_hookean"](E, NU, 1.0), "finite")  # type: ignore[arg-type]
    whole = law.dPdF(F)
    monkeypatch.setattr("softmark.solvers.materials.heterogeneous.BLOCK", 4)
    np.testing.assert_array_equal(law.dPdF(F), whole)
    with pytest.raises(ValueError, match="5 deformation gradients"):
        law.P(F[:5])


def test_a_cell_of_one_point_has_the_means_of_the_two_moduli() -> None:
    """What a law that is linear in them integrates to."""
    w = RNG.uniform(0.5, 1.0, E.shape)
    material = MATERIALS["neo_hookean"](E, NU, 1.0)  # type: ignore[arg-type]
    mean = average_moduli(material, w)
    for name in ("shear_modulus", "lame_lambda"):
        expected = (w * getattr(material, name)).sum(axis=1) / w.sum(axis=1)
        np.testing.assert_allclose(np.ravel(getattr(mean, name)), expected, rtol=1e-12)


def solid(kind: str, constant: bool) -> tuple[Any, Any, Any, Any]:
    """A block of cells, with constants that are the same everywhere, as numbers or as arrays, and as a material."""
    mesh = Box((2.0, 1.0, 1.0)).mesh(kind, 0.5)
    parts = integrate_cells(mesh)
    material: Any = MATERIALS["neo_hookean"](2.0, 0.4, 1.0)
    if not constant:
        ones = np.ones(parts.w.shape)
        material = with_constants(material, {"young": 2.0 * ones, "poisson": 0.4 * ones})
    x = 0.05 * np.random.default_rng(2).standard_normal(mesh.points.size) * 0.5
    return mesh, parts, material, x


@pytest.mark.parametrize(
    ("kind", "strain", "selective"),
    [("tet4", "corotational", False), ("tet4", "finite", False), ("tet10", "finite", False), ("hex8", "small", False),
     ("hex8", "finite", False), ("hex8", "finite", True), ("hex8", "corotational", True)],
)  # fmt: skip
def test_energies_of_equal_constants_are_those_of_one(kind: str, strain: str, selective: bool) -> None:
    """Energy, forces, tangent and drag: kernels of invariants, of tensors and of corotational tetrahedra."""
    found = []
    for constant in (True, False):
        mesh, parts, material, x = solid(kind, constant)
        elastic = Elastic(mesh.cells, parts.dNdX, parts.w, law_for(material, strain))
        energy = elastic_energy(mesh, elastic, material, strain, selective)
        found.append(numbers(energy, x))
    for a, b in zip(*found, strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-10, atol=1e-11 * np.abs(b).max())


def numbers(energy: Any, x: Floats) -> tuple[Floats, ...]:
    """Value, gradient, tangents and rounding of an energy."""
    g = np.zeros_like(x)
    energy.add_gradient(x, g)
    dofs = energy.stencils
    slots = np.arange(dofs.shape[0] * dofs.shape[1] ** 2).reshape(dofs.shape[0], dofs.shape[1], dofs.shape[1])
    K, P = np.zeros(slots.size), np.zeros(slots.size)
    energy.add_hessian(x, K, slots)
    energy.add_hessian(x, P, slots, 1.0, True)
    return np.array([energy.value(x)]), g, K, P


def test_means_of_the_volume_take_the_harmonic_mean_of_its_modulus() -> None:
    """V M/2 (mean g)^2 with M of each cell: of equal moduli the same, and of a cell it alone."""
    mesh, parts, material, x = solid("hex8", True)
    split = mixed_for(material, "finite")
    assert split is not None
    body = (mesh.cells, parts.dNdX, parts.w, split.shape, split.constraint)
    one = MeanDilatation(*body, split.modulus)
    each = MeanDilatation(*body, np.full(len(mesh.cells), split.modulus))
    for a, b in zip(numbers(one, x), numbers(each, x), strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-12, atol=1e-12 * np.abs(b).max())


def test_cells_that_are_taken_out_keep_their_constants() -> None:
    """As sampled cells of reduced models are: the energies of all cells, one by one, add up to that of all."""
    mesh, parts, material, x = solid("hex8", True)
    varying = with_constants(material, {"young": np.random.default_rng(4).uniform(1.0, 3.0, parts.w.shape)})
    elastic = Elastic(mesh.cells, parts.dNdX, parts.w, law_for(varying, "finite"))
    (energy,) = elastic_parts(mesh, elastic, varying, "finite")
    total = 0.0
    for cell in range(len(mesh.cells)):
        nodes = np.unique(mesh.cells[cell])
        fewer = restrict_to_cells(energy, np.array([cell]), np.ones(1), nodes)
        total += fewer.value(x.reshape(-1, 3)[nodes].ravel())
    assert total == pytest.approx(energy.value(x), rel=1e-12)
