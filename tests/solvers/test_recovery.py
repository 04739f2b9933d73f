"""Back to rest from tangled states, by the hundred with those marked slow; tests/benchmarks/recovery.py has thousands.

A block that is clamped at one end and not loaded has one state of least energy, rest: whatever is claimed to be an
equilibrium must be within 1e-6 of the block's size of it. Newton's method ends where forces are below 1e-11 of those
of a strain of one, so that a right answer is at least a thousand times as near; other equilibria are a cell away.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from equal_moduli import made

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.energies.elastic_energy import Elastic, EnergySum
from softmark.solvers.energies.energy import Energy, VectorSpace
from softmark.solvers.energies.external_loads import DeadForces
from softmark.solvers.energies.spring_energy import Springs, stiffness_from_modulus
from softmark.solvers.materials import MATERIALS, law_for, shear_and_volume_laws
from softmark.solvers.materials.stable_neo_hookean import StableNeoHookean
from softmark.solvers.mesh.element_interpolation import integrate_cells, mean_gradients
from softmark.solvers.mesh.mesh import Mesh
from softmark.solvers.mesh.shapes import Box
from softmark.solvers.mesh.spring_edges import build_spring_network
from softmark.solvers.statics.perturbed_states import DISTURBANCES, PerturbedNodes, perturb, random_rotations
from softmark.solvers.statics.recovery_from_perturbation import PerturbedBody, find_inverted_cells, recover_equilibrium
from softmark.solvers.statics.static_equilibrium import NotConverged, Statics, equilibrium
from softmark.solvers.statics.static_problem import Equilibrium

NEAR = 1e-6


def seeds(few: int, all_of_them: int) -> pytest.MarkDecorator:
    """A few, and the rest as a test marked slow."""
    rest = pytest.param(range(few, all_of_them), marks=pytest.mark.slow)
    return pytest.mark.parametrize("seeds", [range(few), rest], ids=["few", "rest"])


SIZES = {"tet4": 0.5, "tet10": 1.0, "hex8": 0.5}


@cache
def block(kind: str) -> Mesh:
    return Box((1.0, 1.0, 2.0)).mesh(kind, SIZES[kind])


@cache
def cells(kind: str, law: str) -> Elastic:
    """Young's modulus 1 Pa, a Poisson's ratio of 0.3."""
    mesh = block(kind)
    parts = integrate_cells(mesh)
    if law == "corotational":
        known = law_for(MATERIALS["linear_elastic"](1.0, 0.3, 1.0), law)
    else:
        known = law_for(made(law, 1.0, 0.3), "finite")
    return Elastic(mesh.cells, parts.dNdX, parts.w, known)


def selective(law: str) -> EnergySum:
    mesh, full = block("hex8"), cells("hex8", law)
    middle = mean_gradients(mesh)
    parts = shear_and_volume_laws(made(law, 1.0, 0.3), "finite")
    assert parts is not None
    first = Elastic(full.cells, full.dNdX, full.w, parts[0])
    return EnergySum((first, Elastic(full.cells, middle.dNdX, middle.w, parts[1])))


def clamped(mesh: Mesh, energy: Energy, pull: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Statics:
    """Held at z = 0, the nodes at the other end pulled by a force each."""
    fixed = np.flatnonzero(np.repeat(mesh.points[:, 2] < 1e-9, 3))
    f = np.where(mesh.points[:, 2:] > 2.0 - 1e-9, np.array(pull), 0.0)
    loads = [DeadForces(f.ravel())] if any(pull) else []
    dofs = mesh.points.size
    assembly = Assembly(dofs, fixed, [energy], loads, mesh.points)
    held = np.zeros(len(fixed))
    return Statics(assembly, VectorSpace(dofs), np.zeros(dofs), fixed, held, extent=mesh.extent)


def tangle(problem: Statics, mesh: Mesh, elastic: Elastic, kind: str, seed: int, amount: float = 1.0) -> PerturbedBody:
    x = (perturb(kind, PerturbedNodes(mesh.points, mesh.cells, amount), seed) - mesh.points).ravel()
    x[problem.fixed] = 0.0
    return PerturbedBody(x, elastic, lambda y: find_inverted_cells(elastic, y), len(mesh.cells), seed)


def found(kind: str, law: str, disturbance: str, seed: int, amount: float = 1.0) -> Equilibrium:
    mesh, elastic = block(kind), cells(kind, law)
    problem = clamped(mesh, elastic)
    return recover_equilibrium(problem, tangle(problem, mesh, elastic, disturbance, seed, amount))


def asked(find: Callable[[], Equilibrium]) -> tuple[str, np.ndarray]:
    """Why there is no answer and no state, or the state and no words."""
    try:
        return "", find().x
    except NotConverged as no:
        return no.reason, np.full(3, np.inf)


def away(x: np.ndarray, mesh: Mesh) -> float:
    return float(np.abs(x).max() / mesh.extent)


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("amount", [1.0, 10.0])
@pytest.mark.parametrize("law", ["neo_hookean", "corotational", "stable_neo_hookean"])
@seeds(5, 20)
def test_scrambled_tetrahedra_find_back(law: str, amount: float, seeds: range) -> None:
    """Every vertex anywhere in the bounding box, and in one ten times as large."""
    for seed in seeds:
        end = found("tet4", law, "scrambled", seed, amount)
        assert away(end.x, block("tet4")) < NEAR, seed
        assert end.stable
        assert end.solved


@pytest.mark.parametrize("disturbance", [k for k in DISTURBANCES if k != "scrambled"])
@pytest.mark.parametrize("law", ["neo_hookean", "corotational"])
@seeds(3, 10)
def test_every_disturbance_of_tetrahedra(law: str, disturbance: str, seeds: range) -> None:
    for seed in seeds:
        assert away(found("tet4", law, disturbance, seed).x, block("tet4")) < NEAR, seed


@pytest.mark.parametrize("kind", ["tet10", "hex8"])
@pytest.mark.parametrize("disturbance", DISTURBANCES)
@seeds(1, 2)
def test_other_elements(kind: str, disturbance: str, seeds: range) -> None:
    for seed in seeds:
        for law in ("neo_hookean", "corotational"):
            assert away(found(kind, law, disturbance, seed).x, block(kind)) < NEAR, (law, seed)


@pytest.mark.slow
@pytest.mark.long
def test_selective_hexahedra() -> None:
    mesh, elastic = block("hex8"), cells("hex8", "neo_hookean")
    problem = clamped(mesh, selective("neo_hookean"))
    for seed in range(4):
        end = recover_equilibrium(problem, tangle(problem, mesh, elastic, "scrambled", seed))
        assert away(end.x, mesh) < NEAR


@pytest.mark.slow
def test_st_venant_kirchhoff_finds_back_or_names_its_inverted_cells() -> None:
    """Its energy of a reflected cell is that of rest, zero: where it ends there it must not call that rest."""
    for disturbance in DISTURBANCES:
        for seed in range(3):
            said, end = asked(lambda d=disturbance, s=seed: found("tet4", "st_venant_kirchhoff", d, s))
            assert "inverted" in said or "more energy" in said or away(end, block("tet4")) < NEAR


@pytest.mark.slow
def test_springs_say_that_they_are_folded() -> None:
    """A network that is mirrored at its clamped end is at rest and inside out: no spring is stretched."""
    mesh, elastic = block("tet4"), cells("tet4", "neo_hookean")
    net = build_spring_network(mesh)
    D = mesh.points[net.edges[:, 1]] - mesh.points[net.edges[:, 0]]
    energy = Springs(net.edges, D, stiffness_from_modulus(1.0, net.weight, np.linalg.norm(D, axis=1)))
    problem = clamped(mesh, energy)
    mirrored = np.zeros_like(mesh.points)
    mirrored[:, 2] = -2.0 * mesh.points[:, 2]
    assert energy.value(mirrored.ravel()) == pytest.approx(0.0, abs=1e-25)
    tangled = PerturbedBody(mirrored.ravel(), None, lambda y: find_inverted_cells(elastic, y), len(mesh.cells))
    with pytest.raises(NotConverged, match=r"cells remain inverted"):
        recover_equilibrium(problem, tangled)
    for seed in range(4):
        tangled = replace(tangle(problem, mesh, elastic, "scrambled", seed), cells=None)
        said, end = asked(lambda tangled=tangled: recover_equilibrium(problem, tangled))
        assert "cells remain inverted" in said or "more energy" in said or away(end, mesh) < NEAR


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("law", ["neo_hookean", "corotational"])
def test_under_load_the_equilibrium_is_that_without_the_disturbance(law: str) -> None:
    """Bent and stretched by a tenth of its length or so; both converge to 1e-8 of the load."""
    mesh, elastic = block("tet4"), cells("tet4", law)
    problem = clamped(mesh, elastic, (0.004, 0.0, 0.01))
    usual = equilibrium(problem).x
    assert away(usual, mesh) > 0.02
    for disturbance in DISTURBANCES:
        end = recover_equilibrium(problem, tangle(problem, mesh, elastic, disturbance, 1))
        assert away(end.x - usual, mesh) < NEAR, disturbance


def test_the_way_is_the_disturbed_state_s_own() -> None:
    """Another seed, another way: rest is never put in the place of what was given."""
    ways = [found("tet4", "neo_hookean", "scrambled", seed).history for seed in (1, 2)]
    assert ways[0][0].residual != ways[1][0].residual
    assert ways[0][0].residual > 0.1  # of unit strain: the first step starts far from rest


@pytest.mark.parametrize("kind", DISTURBANCES)
def test_disturbances(kind: str) -> None:
    """What each does to the cells, and that a seed repeats it."""
    mesh, elastic = block("tet4"), cells("tet4", "neo_hookean")
    body = PerturbedNodes(mesh.points, mesh.cells)
    places = perturb(kind, body, 3)
    assert np.array_equal(places, perturb(kind, body, 3))
    assert not np.array_equal(places, perturb(kind, body, 4))
    J = np.linalg.det(elastic.F((places - mesh.points).ravel()))
    expected: dict[str, Callable[[], bool]] = {
        "scrambled": lambda: bool((J < 0).any() and (places >= 0).all() and (places <= [1, 1, 2]).all()),
        "flattened": lambda: bool(np.abs(J).max() < 1e-12),
        "collapsed": lambda: bool(np.linalg.matrix_rank(places - places[0], tol=1e-9) <= 1),
        "inverted": lambda: bool(np.allclose(J, -1.0)),
        "spun": lambda: bool((J < 0).any()),
    }
    assert expected[kind]()


def test_random_turns_are_rotations() -> None:
    R = random_rotations(50, np.random.default_rng(0))
    assert np.allclose(R @ R.transpose(0, 2, 1), np.eye(3))
    assert np.allclose(np.linalg.det(R), 1.0)


def test_stable_neo_hookean_is_the_energy_of_the_paper() -> None:
    """Smith, de Goes and Kim (2018): mu/2 (I1 - 3) + lam/2 (J - a)^2 - mu/2 ln(I1 + 1), up to a constant.

    a = 1 + mu/lam - mu/(4 lam), mu = 4/3 and lam = lam' + 5/6 times the shear modulus of small strain.
    """
    law = StableNeoHookean(2.0, 0.3, 1.0)
    mu, lam = 4.0 / 3.0 * law.shear_modulus, law.lame_lambda + 5.0 / 6.0 * law.shear_modulus
    a = 1.0 + mu / lam - mu / (4.0 * lam)
    F = np.random.default_rng(0).standard_normal((20, 3, 3))
    F[0] = np.eye(3)
    I1, J = np.sum(F**2, axis=(1, 2)), np.linalg.det(F)
    psi = 0.5 * mu * (I1 - 3.0) + 0.5 * lam * (J - a) ** 2 - 0.5 * mu * np.log(I1 + 1.0)
    assert (J < 0).any()
    np.testing.assert_allclose(law.psi(F), psi - psi[0], atol=1e-12)  # rounding of numbers of order ten


def test_stable_neo_hookean_at_rest_is_hooke_s_law() -> None:
    """No stress, and the stiffness of small strain with the same two constants; both to rounding."""
    for poisson in (-0.9, 0.0, 0.3, 0.49):
        law, hooke = StableNeoHookean(1.0, poisson, 1.0), MATERIALS["linear_elastic"](1.0, poisson, 1.0)
        rest = np.eye(3)[None]
        assert np.abs(law.P(rest)).max() == 0.0
        np.testing.assert_allclose(law.dPdF(rest), law_for(hooke, "small").dPdF(rest), atol=1e-13 / (1 - 2 * poisson))
