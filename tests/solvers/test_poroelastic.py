"""Porous solids full of fluid, over plain arrays: derivatives, balances, and the same by the formulas of the checks."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.assembly.taylor_hood import poroelastic_energy
from softmark.solvers.energies.energy import Floats
from softmark.solvers.energies.poroelastic import PoreFluid, PoroelasticSolid
from softmark.solvers.independent_forces.poroelastic_equations import PoroelasticBody
from softmark.solvers.materials import law_for
from softmark.solvers.materials.biphasic import Biphasic
from softmark.solvers.materials.neo_hookean import NeoHookean
from softmark.solvers.materials.volumetric_constraints import Dilatation, VolumeRatio
from softmark.solvers.mesh.element_interpolation import integrate_cells
from softmark.solvers.mesh.mesh import Mesh
from softmark.solvers.mesh.shapes import Box

SKELETON = NeoHookean(young=2.0, poisson=0.2, density=1.0)
GEL: Any = Biphasic(SKELETON, permeability=0.7, exponent=2.0, stiffening=1.5, solid=0.2)


def made(kind: str, turns: bool) -> tuple[Mesh, PoroelasticSolid]:
    """A cube of few cells, all constants about one, in the middle of a step."""
    mesh = Box((1.0, 1.0, 1.0)).mesh(kind, 1.0)
    pair = (law_for(GEL, "finite"), VolumeRatio()) if turns else (law_for(GEL, "small"), Dilatation())
    energy = poroelastic_energy(mesh, integrate_cells(mesh), pair, 0.8, GEL, turns)
    count = energy.dofs - 3 * energy.nodes
    return mesh, replace(energy, span=0.3, owed=np.linspace(-0.1, 0.2, count))


def state(energy: PoroelasticSolid, size: float = 0.02) -> Floats:
    """Somewhere near rest."""
    found: Floats = size * np.random.default_rng(1).standard_normal(energy.dofs)
    return found


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("turns", [False, True])
@pytest.mark.parametrize("kind", ["tet10", "hex20"])
def test_the_matrix_is_the_derivative_of_what_is_out_of_balance(kind: str, turns: bool) -> None:
    """To 1e-8 of its largest entry: central differences at unit scale. It is symmetric where K stays."""
    _, energy = made(kind, turns)
    assembly, x = Assembly(energy.dofs, np.zeros(0, dtype=np.int64), [energy], []), state(energy)
    K = assembly.tangent(x, 1.0).toarray()
    columns = np.eye(energy.dofs) * 1e-6
    slopes = [(assembly.gradient(x + d, 1.0) - assembly.gradient(x - d, 1.0)) / 2e-6 for d in columns]
    np.testing.assert_allclose(K, np.transpose(slopes), atol=1e-8 * np.abs(K).max())
    apart = np.abs(K - K.T).max() / np.abs(K).max()
    assert apart > 1e-3 if turns else apart < 1e-14


@pytest.mark.parametrize("turns", [False, True])
def test_flow_makes_no_fluid_and_heats(turns: bool) -> None:
    _, energy = made("tet10", turns)
    x = state(energy)
    assert abs(energy.inflow(x).sum()) < 1e-13 * np.abs(energy.inflow(x)).sum()
    assert energy.dissipated_power(x) > 0.0
    assert (
        energy.dissipated_power(np.concatenate([x[: 3 * energy.nodes], np.full(energy.dofs - 3 * energy.nodes, 0.1)]))
        < 1e-25
    )


@pytest.mark.parametrize("turns", [False, True])
@pytest.mark.parametrize("kind", ["tet10", "hex20", "hex27"])
def test_the_checks_find_the_same_in_the_deformed_body(kind: str, turns: bool) -> None:
    """Volumes and flows of each corner, and the forces of the fluid, to rounding: 1e-12 of the largest."""
    mesh, energy = made(kind, turns)
    x = state(energy)
    u = x[: 3 * energy.nodes].reshape(-1, 3)
    own = PoroelasticBody(mesh.points, mesh.cells, kind, -energy.unit * x[energy.pressures],
                 GEL.permeable if turns else lambda J: np.full_like(J, GEL.permeability), not turns)  # fmt: skip
    count = energy.pressures.shape[1]
    corners = np.zeros(energy.dofs - 3 * energy.nodes, dtype=np.int64)
    corners[energy.pressures - 3 * energy.nodes] = mesh.cells[:, :count]
    for found, there in ((energy.volumes(x), own.volumes(u)), (energy.inflow(x), own.flow(u))):
        np.testing.assert_allclose(there[corners], found, atol=1e-12 * np.abs(found).max())
    solid = Assembly(energy.dofs, np.zeros(0, dtype=np.int64), [energy], []).gradient(x, 1.0)
    dry = np.concatenate([x[: 3 * energy.nodes], np.zeros(energy.dofs - 3 * energy.nodes)])
    alone = Assembly(energy.dofs, np.zeros(0, dtype=np.int64), [energy], []).gradient(dry, 1.0)
    f = (solid - alone)[: 3 * energy.nodes].reshape(-1, 3)
    np.testing.assert_allclose(own.forces(u)[0], f, atol=1e-12 * np.abs(f).max())


def test_pores_account_for_what_leaves() -> None:
    """Of any states whatever: what has changed and what has left add up, for free pressures keep what they lack."""
    _, energy = made("tet10", True)
    pores = PoreFluid.at_rest(
        replace(energy, span=0.0, owed=None), np.ones(energy.dofs - 3 * energy.nodes, dtype=np.bool_)
    )
    for number, h in enumerate((0.0, 0.1, 0.2414, 0.1, 0.2414)):
        pores = pores.history_after_step(state(energy, 0.01 * (number + 1)), h)
    assert pores.stage is None
    assert pores.moved > 0.0
    assert pores.fluid_balance_error < 1e-12
    assert pores.dissipated > 0.0


def test_no_state_closes_the_pores() -> None:
    _, energy = made("hex20", True)
    x = np.zeros(energy.dofs)
    x[2 : 3 * energy.nodes : 3] = -0.85 * made("hex20", True)[0].points[:, 2]
    assert energy.value(x) == np.inf
    x[2 : 3 * energy.nodes : 3] *= 0.75 / 0.85
    assert np.isfinite(energy.value(x))
