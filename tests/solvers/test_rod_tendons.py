"""Tendons of rods: derivatives, the circle that a straight one bends a rod to, what adds up to nothing, and motion.

Truths: finite differences of their lengths, and closed forms.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from tangents import differences, gradient, tangent

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.dynamics import INTEGRATORS
from softmark.solvers.dynamics.dynamic_problem import Dynamics, Rayleigh
from softmark.solvers.dynamics.integrator import Motion
from softmark.solvers.dynamics.rotational_inertia import RotationalInertia
from softmark.solvers.dynamics.time_integration import march
from softmark.solvers.energies.geometrically_exact_rod import RodElastic
from softmark.solvers.energies.incremental_rotation.moving_rod_loads import MovingGuidedTendon
from softmark.solvers.energies.incremental_rotation.moving_rod_tendons import MovingRodTendons
from softmark.solvers.energies.incremental_rotation.moving_rods import MovingRod, RodChart
from softmark.solvers.energies.local_blocks import RodElementEnergy
from softmark.solvers.energies.rod_guides import GuidedTendon
from softmark.solvers.energies.rod_rotation import exponential, product, rotation
from softmark.solvers.energies.rod_section import circular
from softmark.solvers.energies.rod_state import RodChain, RodSpace, chain_elements, rod_at_rest
from softmark.solvers.energies.rod_tendons import RodTendons
from softmark.solvers.linear.banded_lu import BandedLuSolver
from softmark.solvers.statics.static_equilibrium import Statics, equilibrium

Made = Callable[[], tuple[RodElementEnergy, np.ndarray]]
L, GUM = 0.2, circular(4e-3, 1e6, 0.3)


def straight(nodes: int) -> np.ndarray:
    return rod_at_rest(np.linspace([0.0, 0, 0], [L, 0, 0], nodes), up=np.array([0.0, 0.0, 1.0]))


def winding(rest: np.ndarray, tension: float, radius: float = 0.01, turns: float = 0.0) -> RodTendons:
    """One over all of a rod of unit elements, around its axis."""
    m = rest.size // 7 - 1
    w = 2.0 * np.pi * turns / L
    s = (np.arange(m) + 0.5) * L / m
    arms = radius * np.stack([0 * s, np.sin(w * s), np.cos(w * s)], axis=1)
    slopes = radius * w * np.stack([0 * s, np.cos(w * s), -np.sin(w * s)], axis=1)
    return RodTendons(rest, chain_elements(m + 1), arms[None], slopes[None], np.ones((1, m)), np.array([tension]))


def anyhow() -> tuple[RodTendons, np.ndarray]:
    """Two tendons of unit size, one over a part, and a rod in a random state."""
    rng, n = np.random.default_rng(7), 4
    rest = rod_at_rest(np.cumsum(rng.normal(size=(n, 3)) * 0.2 + [1, 0, 0], axis=0))
    arms, slopes = rng.normal(size=(2, 2, n - 1, 3)) * [0.0, 0.5, 0.5]
    shares = np.array([[1.0, 1.0, 1.0], [0.0, 0.7, 1.0]])
    tendons = RodTendons(rest, chain_elements(n), arms, slopes, shares, np.array([1.3, 0.6]))
    return tendons, RodSpace(n).move(rest, 0.4 * rng.normal(size=6 * n))


def guided() -> tuple[GuidedTendon, np.ndarray]:
    """One of unit size through three guides, the first and the last two nodes of a rod in a random state."""
    tendons, x = anyhow()
    arms = np.random.default_rng(3).normal(size=(3, 3))
    return GuidedTendon(tendons.rest, np.array([0, 2, 3]), arms, 1.3), x


@pytest.mark.parametrize("made", [anyhow, guided])
def test_forces_and_tangent_are_the_derivatives_of_the_length(made: Made) -> None:
    """Along geodesics, by central differences: 1e-5^2 of third derivatives, and rounding of 1e-16 / 1e-5, is 1e-9."""
    tendons, x = made()
    n, h = x.size // 7 * 6, 1e-5
    space, g, K = RodSpace(x.size // 7), np.zeros(n), np.zeros(n * n)
    tendons.add_gradient(x, g)
    tendons.add_hessian(x, K, tendons.stencils[:, :, None] * n + tendons.stencils[:, None, :])

    def value(d: np.ndarray) -> float:
        return tendons.value(space.move(x, d))

    slope = np.array([(value(h * d) - value(-h * d)) / (2 * h) for d in np.eye(n)])
    np.testing.assert_allclose(g, slope, rtol=0, atol=1e-8)
    rng, K = np.random.default_rng(1), K.reshape(n, n)
    np.testing.assert_allclose(K, K.T, rtol=0, atol=1e-12)
    for d in rng.normal(size=(5, n)):
        second = (value(1e-4 * d) - 2 * value(0 * d) + value(-1e-4 * d)) / 1e-8
        assert d @ K @ d == pytest.approx(second, rel=1e-5, abs=1e-5)
    assert np.linalg.eigvalsh(_projected(tendons, x)).min() > -1e-12


def _projected(tendons: RodElementEnergy, x: np.ndarray) -> np.ndarray:
    n = x.size // 7 * 6
    K = np.zeros(n * n)
    tendons.add_hessian(x, K, tendons.stencils[:, :, None] * n + tendons.stencils[:, None, :], 1.0, True)
    return K.reshape(n, n)


@pytest.mark.parametrize("made", [anyhow, guided])
def test_what_a_tendon_does_adds_up_to_nothing(made: Made) -> None:
    """Forces, and moments in space about any point: its ends and its guides are in the rod."""
    tendons, x = made()
    g = np.zeros(x.size // 7 * 6)
    tendons.add_gradient(x, g)
    f, nodes = g.reshape(-1, 6), x.reshape(-1, 7)
    own = np.einsum("nij,nj->ni", rotation(nodes[:, 3:]), f[:, 3:])
    np.testing.assert_allclose(f[:, :3].sum(axis=0), 0.0, atol=1e-14)
    np.testing.assert_allclose((own + np.cross(nodes[:, :3], f[:, :3])).sum(axis=0), 0.0, atol=1e-14)


@pytest.mark.parametrize("circles", [0.1, *(pytest.param(n, marks=pytest.mark.slow) for n in (1.0, 2.5))])
def test_a_straight_tendon_bends_a_rod_to_a_circle(circles: float) -> None:
    """Curvature T d / E I and stretch 1 - T / E A all along, which one point in each element has exactly.

    The solution has a tolerance of 1e-8, hence 1e-7 of strains.
    """
    rest, d = straight(21), 0.01
    T = circles * 2 * np.pi / L * 1e6 * GUM.I2 / d
    elastic = RodElastic(rest, chain_elements(21), GUM.stiffness)
    held = np.zeros((21, 3), dtype=bool)
    held[0] = True
    assembly = Assembly(126, np.arange(6), [elastic], [winding(rest, T, d)])
    found = equilibrium(Statics(assembly, RodChain(rest, held), rest, np.arange(6), np.zeros(6), bold=False, extent=L))
    strains = elastic.strains(found.x)
    exact = np.array([-T / (1e6 * GUM.area), 0, 0, 0, -T * d / (1e6 * GUM.I2), 0.0])
    np.testing.assert_allclose(strains, np.tile(exact, (20, 1)), atol=1e-7 * np.abs(exact).max())


def moving(nodes: int, fixed: np.ndarray, tension: float, name: str) -> Dynamics:
    rest = straight(nodes)
    chart = RodChart(rest)
    share = np.full(nodes, L / (nodes - 1))
    share[[0, -1]] /= 2
    line = 1000.0 * np.array([GUM.area, GUM.I2 + GUM.I3, GUM.I2, GUM.I3])
    M = np.outer(share, line[[0, 0, 0, 1, 2, 3]])
    rod = MovingRod(chart, RodElastic(rest, chain_elements(nodes), GUM.stiffness))
    load = MovingRodTendons(chart, winding(rest, tension, 0.01, 0.5))
    where = 6 * np.arange(nodes)[:, None] + np.arange(3, 6)
    return Dynamics(Assembly(6 * nodes, fixed, [rod], [load]), M.ravel(), np.zeros(6 * nodes), np.zeros(6 * nodes),
                    fixed, integrator=INTEGRATORS[name](), lagged=False, linear=BandedLuSolver(), tolerance=1e-10,
                    turning=RotationalInertia(chart, where, np.ascontiguousarray(M[:, 3:])))  # fmt: skip


def chart_of(problem: Dynamics) -> RodChart:
    assert problem.turning is not None
    assert isinstance(problem.turning.chart, RodChart)
    return problem.turning.chart


@pytest.mark.parametrize(("made", "moving"), [(anyhow, MovingRodTendons), (guided, MovingGuidedTendon)])
def test_the_tangent_in_motion_is_the_derivative_of_the_forces(made: Made, moving: Any) -> None:
    """By central differences over the unknowns of a chart that is turned far; forces and energy as at rest."""
    tendons, _ = made()
    chart, rng = RodChart(tendons.rest), np.random.default_rng(2)
    chart.q0 = product(chart.q0, exponential(rng.normal(size=(4, 3))))
    load, x = moving(chart, tendons), 0.5 * rng.normal(size=24)
    found = differences(lambda y: gradient(load, y), x)
    own = np.zeros(24)
    tendons.add_gradient(chart.state(x), own)
    np.testing.assert_allclose(gradient(load, x), own, rtol=0, atol=1e-13)
    assert load.value(x) == pytest.approx(tendons.value(chart.state(x)), rel=1e-12)
    np.testing.assert_allclose(tangent(load, x), found, rtol=0, atol=1e-8)
    before = gradient(load, x)
    x = chart.rebase(x)
    np.testing.assert_allclose(gradient(load, x), before, rtol=0, atol=1e-12)  # counted from there, it is the same
    chart.reset()
    tendons.add_gradient(chart.state(x), own := np.zeros(24))
    np.testing.assert_allclose(gradient(load, x), own, rtol=0, atol=1e-13)  # and another for the same unknowns


QUICK = ("midpoint",)


@pytest.mark.slow
@pytest.mark.parametrize("name", [n if n in QUICK else pytest.param(n, marks=pytest.mark.slow) for n in INTEGRATORS])
def test_a_free_rod_is_not_moved_by_its_tendon(name: str) -> None:
    """Pulled at once it bends, twists and vibrates: momentum stays nothing by every integrator, angular momentum by
    midpoint (to rounding, of what its parts have) and energies balance: of what the tendon brings, tension by way."""
    problem = moving(9, np.zeros(0, dtype=np.int64), 0.02, name)
    chart, M = chart_of(problem), np.asarray(problem.mass).reshape(-1, 6)
    step, duration = (1e-4, 0.03) if INTEGRATORS[name].explicit else (1e-3, 0.1)

    def momenta(motion: Motion) -> np.ndarray:
        at, q, _ = chart.positions_and_rotations(motion.x)
        p = M * motion.v.reshape(-1, 6)
        each = np.cross(at, p[:, :3]) + np.einsum("nij,nj->ni", rotation(q), p[:, 3:])
        return np.array([p[:, :3].sum(axis=0), each.sum(axis=0), [np.abs(p).max(), np.abs(each).max(), 0.0]])

    track = march(problem, duration, step, momenta)
    linear, angular, size = np.array(track.observed).swapaxes(0, 1)
    assert np.abs(linear).max() < 1e-11 * size[:, 0].max()
    off = np.abs(angular).max() / size[:, 1].max()
    assert off < (1e-9 if name == "midpoint" else 0.05)
    pulled = track.energies["load_work"][-1]
    assert pulled > 0.0
    assert np.abs(track.energies["drift"]).max() < (0.6 if name in ("implicit_euler", "bdf2") else 0.02) * pulled


@pytest.mark.slow
def test_it_comes_to_rest_where_statics_finds_it() -> None:
    """Damped, from a tension that acts at once; to 1e-6 of the length."""
    problem = replace(moving(9, np.arange(6), 0.05, "bdf2"), damping=Rayleigh(alpha=11.0))
    chart = chart_of(problem)
    end = march(problem, 3.0, 0.05, lambda m: chart.state(m.x)).observed[-1]
    rest = straight(9)
    held = np.zeros((9, 3), dtype=bool)
    held[0] = True
    assembly = Assembly(
        54, np.arange(6), [RodElastic(rest, chain_elements(9), GUM.stiffness)], [winding(rest, 0.05, 0.01, 0.5)]
    )
    found = equilibrium(Statics(assembly, RodChain(rest, held), rest, np.arange(6), np.zeros(6), bold=False, extent=L))
    assert np.abs(found.x - rest).max() > 0.02
    np.testing.assert_allclose(end.reshape(-1, 7)[:, :3], found.x.reshape(-1, 7)[:, :3], atol=1e-6 * L)
