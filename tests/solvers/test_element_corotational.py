"""Corotational elasticity with one rotation for each cell: forces, exact tangent, and what it shares with the law."""

from __future__ import annotations

import numpy as np
import pytest

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.elements import ELEMENTS
from softmark.solvers.energies import element_corotational
from softmark.solvers.energies.elastic_energy import Elastic
from softmark.solvers.energies.element_corotational import ElementCorotational
from softmark.solvers.materials import MATERIALS, law_for
from softmark.solvers.materials.polar_decomposition import rotations
from softmark.solvers.mesh.element_interpolation import integrate_cells
from softmark.solvers.mesh.mesh import Mesh
from softmark.solvers.mesh.shapes import Box

KINDS = tuple(ELEMENTS)
EVERY = pytest.mark.parametrize("kind", KINDS)
MATERIAL = MATERIALS["linear_elastic"](1.0, 0.3, 1.0)


def block(kind: str) -> Mesh:
    return Box((1.0, 0.6, 0.5)).mesh(kind, 0.5)


def made(mesh: Mesh) -> ElementCorotational:
    parts = integrate_cells(mesh)
    A = law_for(MATERIAL, "small").dPdF(np.eye(3)[None])[0]
    K = element_corotational.element_stiffness(parts.dNdX, parts.w, A)
    return ElementCorotational(
        mesh.points, mesh.cells, element_corotational.mean_gradients(parts.dNdX, parts.w), K, rotations
    )


def forces(energy: ElementCorotational | Elastic, x: np.ndarray) -> np.ndarray:
    g = np.zeros_like(x)
    energy.add_gradient(x, g)
    return g


def turned(mesh: Mesh, noise: float) -> np.ndarray:
    """Displacements (3 n,) of a turn by 90 degrees about x = y = z, with every point moved a little."""
    R = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    moved = mesh.points @ R.T + noise * np.random.default_rng(1).uniform(-1, 1, mesh.points.shape)
    return (moved - mesh.points).ravel()


@EVERY
def test_a_turn_causes_no_force(kind: str) -> None:
    """By 120 degrees; round-off of forces that the linear model would have of order 1."""
    mesh = block(kind)
    np.testing.assert_allclose(forces(made(mesh), turned(mesh, 0.0)), 0.0, atol=1e-14)


@EVERY
def test_tangent_is_the_derivative_of_the_forces(kind: str) -> None:
    """Central differences of h = 1e-6 leave about 1e-10 of a stiffness of order 1."""
    mesh = block(kind)
    energy, x, h = made(mesh), turned(mesh, 0.03), 1e-6
    T = Assembly(x.size, np.zeros(0, dtype=np.int64), [energy], []).tangent(x, 1.0).toarray()
    some = np.arange(0, x.size, 7)
    steps = h * np.eye(x.size)[some]
    numeric = np.array([(forces(energy, x + d) - forces(energy, x - d)) / (2 * h) for d in steps]).T
    np.testing.assert_allclose(T[:, some], numeric, atol=2e-9)


def test_in_linear_tetrahedra_it_is_the_corotational_law() -> None:
    """One strain in each cell: R K (R^T x - X) and the derivative of psi(F) are the same force, to round-off."""
    mesh = block("tet4")
    parts, x = integrate_cells(mesh), turned(mesh, 0.03)
    law = Elastic(mesh.cells, parts.dNdX, parts.w, law_for(MATERIAL, "corotational"))
    np.testing.assert_allclose(forces(made(mesh), x), forces(law, x), atol=1e-14)
    assert made(mesh).value(x) == pytest.approx(law.value(x), rel=1e-12)


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "tet4"])
def test_in_other_cells_its_tangent_is_not_symmetric(kind: str) -> None:
    """No energy has these forces, and the class says so; the projected tangent is symmetric and semi-definite."""
    mesh = block(kind)
    energy, x = made(mesh), turned(mesh, 0.03)
    free = Assembly(x.size, np.zeros(0, dtype=np.int64), [energy], [])
    T, S = (free.tangent(x, 1.0, projected).toarray() for projected in (False, True))
    assert not energy.conservative
    assert np.abs(T - T.T).max() > 1e-4
    np.testing.assert_allclose(S, S.T, atol=1e-14)
    assert np.linalg.eigvalsh(S).min() > -1e-13
