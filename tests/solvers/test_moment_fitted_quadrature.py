"""Moments on rods and on faces, and forces on arms: derivatives, resultants, and an end moment in three dimensions."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.energies.energy import Floats
from softmark.solvers.energies.external_loads import FaceMoment
from softmark.solvers.energies.geometrically_exact_rod import RodElastic
from softmark.solvers.energies.rod_loads import EccentricRodForces, RodMoments
from softmark.solvers.energies.rod_rotation import rotation
from softmark.solvers.energies.rod_section import RodSection
from softmark.solvers.energies.rod_state import RodChain, RodSpace, chain_elements, rod_at_rest
from softmark.solvers.statics.static_equilibrium import Statics, equilibrium

SPACE = RodSpace(3)


def bent(rng: np.random.Generator) -> tuple[Floats, Floats]:
    """A rod of three nodes at rest, and one that is turned far."""
    rest = rod_at_rest(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]))
    return rest, SPACE.move(rest, rng.standard_normal(18))


def loads(rest: Floats, rng: np.random.Generator) -> list[Any]:
    arms = EccentricRodForces(rest, np.array([2, 1]), rng.standard_normal((2, 3)), rng.standard_normal((2, 3)))
    return [arms, RodMoments(np.array([2, 1]), rng.standard_normal((2, 3)))]


def tangent(energy: Any, x: Floats, dofs: int, projected: bool = False) -> Floats:
    assembly = Assembly(dofs, np.zeros(0, dtype=np.int64), [], [energy])
    return np.asarray(assembly.tangent(x, 1.0, projected).toarray())


def gradient(energy: Any, x: Floats, dofs: int) -> Floats:
    g = np.zeros(dofs)
    energy.add_gradient(x, g)
    return g


@pytest.mark.parametrize("which", [0, 1])
def test_the_tangent_on_a_rod_is_the_change_of_its_forces(which: int) -> None:
    """Gradients in the axes of the node: g(x exp phi) = g + K phi + g x phi / 2 (parallel transport), to eps^2."""
    rng = np.random.default_rng(1)
    rest, x = bent(rng)
    energy = loads(rest, rng)[which]
    g, K = gradient(energy, x, 18), tangent(energy, x, 18)
    for _ in range(3):
        d = rng.standard_normal(18)
        eps = 1e-6
        change = (gradient(energy, SPACE.move(x, eps * d), 18) - gradient(energy, SPACE.move(x, -eps * d), 18)) / 2e-6
        carried = np.zeros((3, 6))
        carried[:, 3:] = 0.5 * np.cross(g.reshape(3, 6)[:, 3:], d.reshape(3, 6)[:, 3:])
        assert change == pytest.approx(K @ d + carried.ravel(), abs=1e-8)


def test_a_force_on_an_arm_has_an_energy_and_a_moment_has_none() -> None:
    rng = np.random.default_rng(2)
    rest, x = bent(rng)
    arms, moments = loads(rest, rng)
    d = rng.standard_normal(18)
    slope = (arms.value(SPACE.move(x, 1e-6 * d)) - arms.value(SPACE.move(x, -1e-6 * d))) / 2e-6
    assert slope == pytest.approx(gradient(arms, x, 18) @ d, abs=1e-8)
    assert arms.value(rest) == 0.0
    K = tangent(arms, x, 18)
    assert pytest.approx(K.T, abs=1e-14) == K
    assert np.linalg.eigvalsh(tangent(arms, x, 18, projected=True)).min() > -1e-14
    K = tangent(moments, x, 18)
    assert pytest.approx(-K.T, abs=1e-14) == K
    assert not tangent(moments, x, 18, projected=True).any()
    with pytest.raises(TypeError, match="no energy"):
        moments.value(x)


def helix(moment: Floats, C: Floats, length: float) -> tuple[Floats, Floats]:
    """The end of a rod that carries a moment of fixed direction and no force: x' = R e1, R' = R [C^-1 R^T m]x.

    An initial value problem, for the moment is the same all along: Runge and Kutta's method of eighth order.
    """
    from scipy.integrate import solve_ivp

    def slope(s: float, y: Floats) -> Floats:
        R = y[3:].reshape(3, 3)
        k = R.T @ moment / C
        K = np.array([[0.0, -k[2], k[1]], [k[2], 0.0, -k[0]], [-k[1], k[0], 0.0]])
        return np.concatenate([R[:, 0], (R @ K).ravel()])

    start = np.concatenate([np.zeros(3), np.eye(3).ravel()])
    found = solve_ivp(slope, (0.0, length), start, method="DOP853", rtol=1e-12, atol=1e-14)
    return found.y[:3, -1], found.y[3:, -1].reshape(3, 3)


def test_an_end_moment_in_three_dimensions_is_that_of_an_initial_value_problem() -> None:
    """Bent about two axes and twisted by 1.2, 2 and 1 rad or so: of second order in the segments, in few steps.

    Newton's method is quadratic with the skew tangent: each residual is three squares of the last, or less.
    """
    section = RodSection(1e-2, 2e-5, 1e-5, 1.5e-5, 1.0, 1.0, 1e6, 4e5)
    stiffness = section.stiffness
    C = stiffness.diagonal[3:]
    moment = np.array([6.0, 40.0, 10.0])
    x, R = helix(moment, C, 1.0)
    errors = []
    for segments in (16, 32):
        points = np.linspace(0.0, 1.0, segments + 1)[:, None] * np.array([1.0, 0.0, 0.0])
        rest, fixed = rod_at_rest(points, np.array([0.0, 0.0, 1.0])), np.arange(6)
        held = np.zeros((segments + 1, 3), dtype=np.bool_)
        held[0] = True
        end = RodMoments(np.array([segments]), moment[None])
        elastic = RodElastic(rest, chain_elements(segments + 1), stiffness)
        assembly = Assembly(6 * (segments + 1), fixed, [elastic], [end])
        found = equilibrium(Statics(assembly, RodChain(rest, held), rest, fixed, np.zeros(6), bold=False))
        node = found.x.reshape(-1, 7)[-1]
        errors.append([np.linalg.norm(node[:3] - x), np.linalg.norm(rotation(node[None, 3:])[0] - R)])
        last = [i.residual for i in found.history if i.residual < 0.1]
        assert all(b <= 3.0 * a**2 + 1e-8 for a, b in pairwise(last)), last
        assert len(found.history) < 12
    ratio = np.array(errors[0]) / errors[1]
    assert (ratio > 3.5).all()
    assert (ratio < 4.5).all()
    assert max(errors[1]) < 5e-3


def face(rng: np.random.Generator) -> tuple[FaceMoment, Floats]:
    """Six nodes with products of a matrix that is definite, two nodes beside, and a state far from rest."""
    A = rng.standard_normal((6, 6))
    energy = FaceMoment(
        rng.standard_normal((8, 3)), np.array([0, 2, 3, 5, 6, 7]), A @ A.T + np.eye(6), np.array([1.0, -2.0, 0.5])
    )
    return energy, rng.standard_normal(24)


def test_a_moment_on_a_face_is_exact_in_every_state() -> None:
    rng = np.random.default_rng(3)
    energy, u = face(rng)
    for x in (u, np.zeros(24), 5.0 * u):
        f = -gradient(energy, x, 24).reshape(8, 3)
        places = energy.points + x.reshape(8, 3)
        assert f.sum(axis=0) == pytest.approx(np.zeros(3), abs=1e-12)
        assert np.cross(places, f).sum(axis=0) == pytest.approx(energy.moment, abs=1e-12)
        assert not f[[1, 4]].any()


def test_the_tangent_of_a_moment_on_a_face() -> None:
    rng = np.random.default_rng(4)
    energy, u = face(rng)
    K = tangent(energy, u, 24)
    for _ in range(3):
        d = rng.standard_normal(24)
        change = (gradient(energy, u + 1e-6 * d, 24) - gradient(energy, u - 1e-6 * d, 24)) / 2e-6
        assert change == pytest.approx(K @ d, abs=1e-7)
    assert not tangent(energy, u, 24, projected=True).any()
    with pytest.raises(TypeError, match="no energy"):
        energy.value(u)
