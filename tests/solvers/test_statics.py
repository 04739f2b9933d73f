"""Static equilibria: closed forms of homogeneous states, refusals, and what makes a hard problem converge."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from softmark.solvers.energies.elastic_energy import Elastic
from softmark.solvers.energies.external_loads import DeadForces, FollowerPressure
from softmark.solvers.linear import factorisations as linear
from softmark.solvers.linear.linear_solver import LinearSolverOptions, LinearSystems
from softmark.solvers.materials import Law
from softmark.solvers.mesh.mesh import Mesh
from softmark.solvers.mesh.shapes import Box, Cylinder
from softmark.solvers.sparse import pardiso
from softmark.solvers.statics.static_equilibrium import Equilibrium, NotConverged, Statics, equilibrium
from softmark.solvers.statics.static_newton import Newton

Maker = Callable[..., Law]
Energies = Callable[[Mesh, Law], Elastic]
Problems = Callable[..., Statics]
Weights = Callable[[Mesh, tuple[float, float, float]], DeadForces]

CUBE = Box((1.0, 1.0, 1.0)).mesh("tet4", 0.5)
BEAM = Cylinder(0.178, 0.019).mesh("tet4", 0.012)
WALL = BEAM.points[:, 0] < 1e-9
LAWS = ("small", "corotational", "neo_hookean", "neo_hookean_isochoric", "st_venant_kirchhoff")


def upright(energy: Elastic) -> Callable[[np.ndarray], bool]:
    """No cell is inside out."""
    return lambda x: bool(np.all(np.linalg.det(energy.F(x)) > 0))


def with_twin(problem: Statics, law: Law) -> Statics:
    """The problem with a corotational start, as a model of finite strain has it."""
    twins = [replace(e, law=law) for e in problem.assembly.internal]
    return replace(problem, twin=problem.assembly.with_internal(twins))


# ------------------------------------------------------------------ homogeneous states


def stretched(energy: Elastic, stretch: float, problem: Problems, **options: object) -> Equilibrium:
    """The cube pulled to x = stretch between planes that let it slide, its sides free."""
    held = np.abs(CUBE.points) < 1e-9
    held[:, 0] |= CUBE.points[:, 0] > 1 - 1e-9
    to = CUBE.points * [stretch - 1, 0, 0]
    return equilibrium(problem(CUBE, energy, held, to=to, tolerance=1e-11, sound=upright(energy), **options))


def pull(energy: Elastic, x: np.ndarray) -> float:
    """Force on the face x = 1 of the unit cube: the nominal stress P, Pa."""
    g = np.zeros_like(x)
    energy.add_gradient(x, g)
    return float(g.reshape(-1, 3)[CUBE.points[:, 0] > 1 - 1e-9, 0].sum())


# Uniaxial stress, E = 60 kPa: law, nu and stretch to nominal stress (Pa) and lateral stretch t. Not from this
# code: mu (t^2 - 1) + lam ln(l t^2) = 0 and P = (mu (l^2 - 1) + lam ln J)/l, and the like from the
# isochoric energy mu/2 (J^(-2/3) I1 - 3) + K/2 (J - 1)^2.
LOG, ISO = "neo_hookean", "neo_hookean_isochoric"
UNIAXIAL = [
    (LOG, 0.3, 0.7, -24313.825, 1.107935), (LOG, 0.3, 1.5, 22696.811, 0.880175),
    (LOG, 0.3, 2.0, 38804.680, 0.798078), (LOG, 0.45, 0.7, -26036.326, 1.170853),
    (LOG, 0.45, 1.5, 21516.861, 0.830679), (LOG, 0.49, 0.9, -6681.211, 1.052925),
    (LOG, 0.49, 1.5, 21192.540, 0.819241), (LOG, 0.49, 2.0, 35183.800, 0.710687),
    (ISO, 0.3, 0.7, -26732.962, 1.104472), (ISO, 0.3, 1.5, 20303.830, 0.884338),
    (ISO, 0.45, 1.5, 20709.658, 0.836397), (ISO, 0.49, 0.7, -26850.212, 1.191455),
    (ISO, 0.49, 1.5, 21014.306, 0.820731), (ISO, 0.49, 2.0, 34602.863, 0.715038),
]  # fmt: skip


@pytest.mark.parametrize(("name", "poisson", "stretch", "stress", "lateral"), UNIAXIAL)
def test_uniaxial_stretch_of_neo_hookean(
    name: str, poisson: float, stretch: float, stress: float, lateral: float,
    law: Maker, elastic: Energies, problem: Problems,
) -> None:  # fmt: skip
    """The table holds eight digits of the stress and six of the stretch."""
    energy = elastic(CUBE, law(name, 60e3, poisson))
    found = stretched(energy, stretch, problem)
    assert pull(energy, found.x) == pytest.approx(stress, rel=1e-6)
    F = energy.F(found.x)
    np.testing.assert_allclose(F[:, 1, 1], lateral, atol=1e-6)
    np.testing.assert_allclose(F[:, 2, 2], lateral, atol=1e-6)


@pytest.mark.parametrize("stretch", [0.7, 1.5, 3.0])
def test_uniaxial_stretch_of_corotational(stretch: float, law: Maker, elastic: Energies, problem: Problems) -> None:
    """Stress linear in stretch: P/E = l - 1, lateral stretch 1 - nu (l - 1). Round-off."""
    energy = elastic(CUBE, law("corotational", 60e3, 0.3))
    found = stretched(energy, stretch, problem)
    assert pull(energy, found.x) / 60e3 == pytest.approx(stretch - 1, rel=1e-10)
    np.testing.assert_allclose(energy.F(found.x)[:, 1, 1], 1 - 0.3 * (stretch - 1), rtol=1e-10)


@pytest.mark.parametrize(
    ("stretch", "stress"), [(0.8, -0.144), (0.9, -0.0855), (1.1, 0.1155), (1.3, 0.4485), (1.5, 0.9375)]
)
def test_uniaxial_stretch_of_st_venant_kirchhoff(
    stretch: float, stress: float, law: Maker, elastic: Energies, problem: Problems
) -> None:
    """P/E = l (l^2 - 1)/2, exact decimals."""
    energy = elastic(CUBE, law("st_venant_kirchhoff", 1.0, 0.3))
    assert pull(energy, stretched(energy, stretch, problem).x) == pytest.approx(stress, rel=1e-9)


# ------------------------------------------------------------------ what converged means


def sagging(name: str, gravity: float, law: Maker, elastic: Energies, problem: Problems, weight: Weights) -> Statics:
    """The silicone beam under a part of its weight."""
    energy = elastic(BEAM, law(name, 60e3, 0.49))
    load = weight(BEAM, (0.0, 0.0, -1070 * gravity))
    sag = problem(BEAM, energy, WALL, [load], sound=upright(energy))
    return with_twin(sag, law("corotational", 60e3, 0.49)) if name not in ("small", "corotational") else sag


@pytest.mark.parametrize("name", LAWS)
def test_the_residual_is_what_it_says(
    name: str, law: Maker, elastic: Energies, problem: Problems, weight: Weights
) -> None:
    """Forces summed here by einsum, over the free points, relative to the larger of load and reactions."""
    sag = sagging(name, 9.81, law, elastic, problem, weight)
    if name == "small":
        sag = replace(sag, sound=lambda x: True)  # small strains turn cells inside out in such a bend
    found = equilibrium(sag)
    energy = sag.assembly.internal[0]
    P = energy.law.P(energy.F(found.x))
    f = np.zeros_like(BEAM.points)
    np.add.at(f, BEAM.cells, np.einsum("m,miJ,maJ->mai", energy.w[:, 0], P, energy.dNdX[:, 0]))
    load = sag.assembly.loads[0].f
    balance = f.ravel() - load
    free = ~np.repeat(WALL, 3)
    relative = np.linalg.norm(balance[free]) / max(np.linalg.norm(load), np.linalg.norm(balance[~free]))
    assert relative < 1e-8
    assert found.criterion == "residual"
    assert found.residual == pytest.approx(relative, rel=0.1, abs=1e-13)
    # reactions carry the weight
    np.testing.assert_allclose(balance.reshape(-1, 3)[WALL].sum(axis=0), -load.reshape(-1, 3).sum(axis=0), atol=1e-7)


@pytest.mark.parametrize("bold", [True, False])
@pytest.mark.parametrize("name", LAWS[1:])
def test_both_ways_find_the_same_equilibrium(
    name: str, bold: bool, law: Maker, elastic: Energies, problem: Problems, weight: Weights
) -> None:
    """By whole steps and by decreasing energy: forces to 1e-8, displacements to 1e-7 and less."""
    sag = sagging(name, 9.81, law, elastic, problem, weight)
    tight = equilibrium(replace(sag, tolerance=1e-11)).x
    np.testing.assert_allclose(equilibrium(replace(sag, bold=bold)).x, tight, atol=1e-7 * np.abs(tight).max())


@pytest.mark.parametrize("name", LAWS)
def test_no_load_leaves_the_body_at_rest(name: str, law: Maker, elastic: Energies, problem: Problems) -> None:
    found = equilibrium(problem(BEAM, elastic(BEAM, law(name, 60e3, 0.49)), WALL))
    np.testing.assert_array_equal(found.x, 0.0)
    assert found.iterations == 0


@pytest.mark.parametrize("name", LAWS)
def test_a_support_that_moves_takes_the_body_along(name: str, law: Maker, elastic: Energies, problem: Problems) -> None:
    """No force at all: the one that the support would exert on a body that stays behind is the scale."""
    by = np.array([0.01, 0.02, -0.003])
    found = equilibrium(problem(BEAM, elastic(BEAM, law(name, 60e3, 0.49)), WALL, to=by))
    np.testing.assert_allclose(found.x.reshape(-1, 3), np.broadcast_to(by, BEAM.points.shape), atol=1e-13)


@pytest.mark.parametrize("gravity", [1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize("name", LAWS)
def test_a_tiny_load_gives_the_linear_answer(
    name: str, gravity: float, law: Maker, elastic: Energies, problem: Problems, weight: Weights
) -> None:
    """Strains down to 1e-12, of which F keeps four digits next to 1: rounding must not pass for failure."""
    linear = equilibrium(sagging("small", 1.0, law, elastic, problem, weight)).x * gravity
    found = equilibrium(sagging(name, gravity, law, elastic, problem, weight))
    # quadratic terms are the slope at the tip, 0.1 g; rounding 1e-16 of strains of 1e-3 g
    tolerance = (2 * gravity + 1e-13 / gravity) if name != "small" else 1e-13 / gravity
    np.testing.assert_allclose(found.x, linear, atol=(tolerance + 1e-8) * np.abs(linear).max())
    assert found.iterations < 8


@pytest.mark.parametrize("young", [1e-6, 1.0, 1e12])
def test_units_do_not_matter(young: float, law: Maker, elastic: Energies, problem: Problems, weight: Weights) -> None:
    """The same ratio of weight to stiffness is the same shape, to the tolerance, in as many iterations."""
    found = []
    for E in (60e3, young):
        load = weight(BEAM, (0.0, 0.0, -1070 * 9.81 * E / 60e3))
        found.append(equilibrium(problem(BEAM, elastic(BEAM, law("corotational", E, 0.49)), WALL, [load])))
    assert found[0].iterations == found[1].iterations
    np.testing.assert_allclose(found[1].x, found[0].x, atol=1e-8)


# ------------------------------------------------------------------ hard and hopeless problems


def squeezed(part: float, law: Maker, elastic: Energies, problem: Problems) -> Statics:
    """A St Venant-Kirchhoff cube, nu = 0, under a dead pressure of `part` times its modulus."""
    energy = elastic(CUBE, law("st_venant_kirchhoff", 1.0, 0.0))
    far = CUBE.faces[(CUBE.points[CUBE.faces][:, :, 0] > 1 - 1e-9).all(axis=1)]
    f = np.zeros_like(CUBE.points)
    np.add.at(f, far, np.array([-part / (3 * len(far)), 0, 0]))
    held = np.abs(CUBE.points) < 1e-9
    pressed = problem(CUBE, energy, held, [DeadForces(f.ravel())], sound=upright(energy))
    return with_twin(pressed, law("corotational", 1.0, 0.0))


def test_st_venant_kirchhoff_holds_up_to_its_limit_point(law: Maker, elastic: Energies, problem: Problems) -> None:
    """P/E = l (l^2 - 1)/2 is least, -0.19245, at l = 1/sqrt(3): -0.19 is carried at the root above it."""
    stretch = float(max(np.roots([1, 0, -1, 2 * 0.19]).real))
    hold = squeezed(0.19, law, elastic, problem)
    F = hold.assembly.internal[0].F(equilibrium(hold).x)
    np.testing.assert_allclose(F[:, 0, 0], stretch, atol=1e-6)


@pytest.mark.parametrize("part", [0.2, 0.25, 1.0])
def test_a_hopeless_problem_is_refused_with_its_history(
    part: float, law: Maker, elastic: Energies, problem: Problems
) -> None:
    """Past the limit point the only equilibria have their cells inside out."""
    with pytest.raises(NotConverged) as caught:
        equilibrium(squeezed(part, law, elastic, problem))
    assert "inverted" in caught.value.reason or "load could be raised" in caught.value.reason
    history = caught.value.history
    assert len(history) > 3
    assert {step.phase for step in history} >= {"corotational start", "careful"}
    assert all(np.isfinite(step.residual) and step.length > 0 for step in history)


def test_too_few_iterations_are_said(law: Maker, elastic: Energies, problem: Problems, weight: Weights) -> None:
    sag = sagging("corotational", 9.81, law, elastic, problem, weight)
    with pytest.raises(NotConverged) as caught:
        equilibrium(replace(sag, bold=False, max_iterations=1))
    assert "did not converge within 1 iterations" in caught.value.reason
    assert caught.value.history[0].number == 0
    assert {step.phase for step in caught.value.history} == {"careful"}


def test_the_load_comes_in_steps_where_whole_ones_fail(law: Maker, elastic: Energies, problem: Problems) -> None:
    """A clamped cube pulled to ten times its length; each phase is told to the watcher as it happens."""
    held = (CUBE.points[:, 0] < 1e-9) | (CUBE.points[:, 0] > 1 - 1e-9)
    energy, told = elastic(CUBE, law("neo_hookean")), []
    pulled = problem(CUBE, energy, held, to=CUBE.points * [9, 0, 0], sound=upright(energy), watch=told.append)
    found = equilibrium(with_twin(pulled, law("corotational")))
    assert found.load_steps > 1
    assert found.residual <= 1e-8
    assert tuple(told) == found.history
    loads = [step.load for step in found.history if step.phase == "careful"]
    assert min(loads) < 1.0 == loads[-1]
    np.testing.assert_allclose(found.x.reshape(-1, 3)[held, 0], 9 * CUBE.points[held, 0])


@dataclass(frozen=True)
class Sabotaged:
    """A law whose answers are not numbers where |F - I| exceeds a limit."""

    law: Law
    limit: float
    broken: tuple[str, ...]

    def _spoilt(self, name: str, F: np.ndarray) -> np.ndarray:
        value = np.array(getattr(self.law, name)(F))
        if name.removesuffix("_projected") in self.broken:
            value[np.linalg.norm(F - np.eye(3), axis=(1, 2)) > self.limit] = np.nan
        return value

    def psi(self, F: np.ndarray) -> np.ndarray:
        return self._spoilt("psi", F)

    def P(self, F: np.ndarray) -> np.ndarray:
        return self._spoilt("P", F)

    def dPdF(self, F: np.ndarray) -> np.ndarray:
        return self._spoilt("dPdF", F)

    def dPdF_projected(self, F: np.ndarray) -> np.ndarray:
        return self._spoilt("dPdF_projected", F)


@pytest.mark.parametrize("bold", [True, False])
@pytest.mark.parametrize("limit", [-1.0, 1e-3, pytest.param(0.1, marks=pytest.mark.slow)])
@pytest.mark.parametrize("broken", [("psi",), ("P",), ("dPdF",), ("psi", "P", "dPdF")])
def test_what_is_not_a_number_is_never_returned(
    bold: bool,
    limit: float,
    broken: tuple[str, ...],
    law: Maker,
    elastic: Energies,
    problem: Problems,
    weight: Weights,
) -> None:
    """A bend with strains beyond each limit: refused, or found where what is broken was not needed."""
    spoilt = Sabotaged(law("neo_hookean", 60e3, 0.3), limit, broken)
    load = weight(BEAM, (0.0, 0.0, -1070 * 9.81))
    try:
        found = equilibrium(problem(BEAM, elastic(BEAM, spoilt), WALL, [load], bold=bold, max_iterations=20))
    except NotConverged:
        return
    assert np.all(np.isfinite(found.x))
    assert found.residual <= 1e-8


# ------------------------------------------------------------------ stability


def column(gravity: float, name: str, law: Maker, elastic: Energies, problem: Problems, weight: Weights) -> Statics:
    """The beam standing on its wall: its weight presses along -x, and nothing pushes it sideways."""
    energy = elastic(BEAM, law(name, 60e3, 0.3))
    stand = problem(BEAM, energy, WALL, [weight(BEAM, (-1070 * gravity, 0.0, 0.0))], sound=upright(energy))
    return with_twin(stand, law("corotational", 60e3, 0.3)) if name != "corotational" else stand


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("bold", [True, False])
@pytest.mark.parametrize("name", ["corotational", "neo_hookean"])
def test_a_column_stands_below_its_buckling_load_and_leans_above(
    name: str, bold: bool, law: Maker, elastic: Energies, problem: Problems, weight: Weights
) -> None:
    """Greenhill (1881): a column buckles at q L^3/EI = 7.837, here 7.03 m/s^2; the mesh is a bit stiffer."""
    greenhill = 7.837 * 60e3 * 0.019**2 / 4 / (1070 * 0.178**3)
    assert greenhill == pytest.approx(7.03, abs=0.01)
    for part, leans in ((0.5, False), (1.5, True)):
        stand = replace(column(part * greenhill, name, law, elastic, problem, weight), bold=bold, max_iterations=100)
        found = equilibrium(stand)
        sideways = np.abs(found.x.reshape(-1, 3)[:, 1:]).max()
        assert sideways > 0.05 if leans else sideways < 1e-3
        assert ("aside" in {step.phase for step in found.history}) == leans
        eigenvalues = np.linalg.eigvalsh(stand.assembly.tangent(found.x, 1.0).toarray())
        assert eigenvalues[0] > 0


@pytest.mark.parametrize("method", ["auto", "superlu", "cholesky", "pardiso", "multigrid", "conjugate_gradients"])
@pytest.mark.parametrize("fine", [False, True])
def test_follower_loads_are_judged_by_the_symmetric_part_whatever_solved_the_steps(
    fine: bool, method: Any, law: Maker, elastic: Energies, problem: Problems, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Pardiso's factor of a tangent that is not symmetric knows no pivots; `auto` takes it for large matrices."""
    if (fine or method == "pardiso") and not pardiso.is_installed():
        pytest.skip("pypardiso is not there")
    monkeypatch.setattr(linear, "LARGE", 0 if fine else linear.LARGE)
    top = CUBE.facets[(CUBE.points[CUBE.facets][:, :, 2] > 1 - 1e-9).all(axis=1)]
    for pressure, young, known in ((0.05, 1.0, True), (-0.05, 1.0, True), (0.05, -1.0, None)):
        load = FollowerPressure(CUBE.points, top, pressure)
        pressed = problem(CUBE, elastic(CUBE, law("corotational", young)), CUBE.points[:, 2] < 1e-9, [load])
        newton = Newton(pressed, [], LinearSystems(LinearSolverOptions(method)))
        newton.last = linear.factor(pressed.assembly.tangent(pressed.rest, 1.0), False)
        assert (newton.last.negative_pivots is None) == fine
        before = newton.last
        blind = method in ("multigrid", "conjugate_gradients")
        assert newton.is_tangent_definite(pressed.rest) is (None if blind else known)
        assert newton.last is before  # of which condition and rounding are told


# ------------------------------------------------------------------ what nothing resists


@pytest.mark.parametrize("slender", [20.0, 100.0])
def test_a_slender_part_that_is_clamped_is_held(
    slender: float, elastic: Energies, problem: Problems, law: Maker
) -> None:
    """It resists bending by (h/L)^3 and less of its stiffness along, which is not nothing; on rollers nothing does."""
    from softmark.solvers.statics.static_stability import loose_motion

    mesh = Box((slender, 1.0, 1.0)).mesh("hex8", 1.0)
    clamped = np.zeros_like(mesh.points, dtype=bool)
    clamped[mesh.points[:, 0] < 1e-9] = True
    rolling = clamped.copy()
    rolling[:, 0] = False
    assert loose_motion(problem(mesh, elastic(mesh, law("small")), clamped)) is None
    assert loose_motion(problem(mesh, elastic(mesh, law("small")), rolling)) is not None
