"""Rods in motion: forces and tangents over rotation vectors, orders in time, momenta, spins and swings.

Truths: the numpy formulas of the rod at rest (others, see energies/incremental_rotation/moving_rod_kernels.py),
Euler's equations and the rod's own by scipy's DOP853, which share no integrator with the march, and the closed period
of a pendulum.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation
from tangents import differences, gradient, tangent

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.dynamics import INTEGRATORS
from softmark.solvers.dynamics.dynamic_problem import Dynamics, Rayleigh
from softmark.solvers.dynamics.integrator import Motion
from softmark.solvers.dynamics.rotational_inertia import RotationalInertia
from softmark.solvers.dynamics.time_integration import march
from softmark.solvers.dynamics.trajectory import Trajectory
from softmark.solvers.energies.energy import Energy
from softmark.solvers.energies.geometrically_exact_rod import RodElastic
from softmark.solvers.energies.incremental_rotation.moving_rod_loads import MovingRodMoments
from softmark.solvers.energies.incremental_rotation.moving_rods import (
    MovingRod,
    MovingRodForces,
    MovingRodLoad,
    RodChart,
)
from softmark.solvers.energies.rod_loads import EccentricRodForces, RodMoments
from softmark.solvers.energies.rod_rotation import exponential, product, rotation
from softmark.solvers.energies.rod_section import RodStiffness, circular
from softmark.solvers.energies.rod_state import chain_elements, rod_at_rest
from softmark.solvers.linear.banded_lu import BandedLuSolver

NONE = np.zeros(0, dtype=np.int64)
GUM = circular(4e-3, 1e6, 0.3)
RHO = 1000.0


def chart_of(problem: Dynamics) -> RodChart:
    assert problem.turning is not None
    chart = problem.turning.chart
    assert isinstance(chart, RodChart)
    return chart


def moving(rest: np.ndarray, stiffness: RodStiffness, mass: np.ndarray, J: np.ndarray, fixed: np.ndarray = NONE,
           forces: np.ndarray | None = None, **options: Any) -> Dynamics:  # fmt: skip
    """A rod with masses (n,) and moments of inertia (n, 3) at its nodes."""
    nodes = len(mass)
    chart = RodChart(rest)
    rod = MovingRod(chart, RodElastic(rest, chain_elements(nodes), stiffness))
    loads = [] if forces is None else [MovingRodForces(forces)]
    where = 6 * np.arange(nodes)[:, None] + np.arange(3, 6)
    M = np.concatenate([np.repeat(mass[:, None], 3, axis=1), J], axis=1).ravel()
    known: dict[str, Any] = {"tolerance": 1e-10, "velocity": np.zeros(6 * nodes), **options}
    return Dynamics(Assembly(6 * nodes, fixed, [rod], loads), M, np.zeros(6 * nodes), fixed=fixed, lagged=False,
                    linear=BandedLuSolver(), turning=RotationalInertia(chart, where, J), **known)  # fmt: skip


def gum(nodes: int, **options: Any) -> Dynamics:
    """A round rod along x, 0.2 m long."""
    rest = rod_at_rest(np.linspace([0.0, 0, 0], [0.2, 0, 0], nodes), up=np.array([0.0, 0.0, 1.0]))
    share = np.full(nodes, 0.2 / (nodes - 1))
    share[[0, -1]] /= 2
    line = RHO * np.array([GUM.area, GUM.I2 + GUM.I3, GUM.I2, GUM.I3])
    return moving(rest, GUM.stiffness, line[0] * share, share[:, None] * line[1:], **options)


# ------------------------------------------------------------------ forces


@pytest.mark.parametrize("size", [1e-3, 0.3, 1.0])
def test_forces_and_tangents_are_those_of_the_rod_at_rest(size: float) -> None:
    """Of a bent rod in a random state: forces to rounding; the symmetric part of the tangent is the Hessian, and all of
    it the derivative of the forces, by central differences (their error: 1e-6^2 of third derivatives, 1e-9)."""
    rng, n = np.random.default_rng(3), 5
    rest = rod_at_rest(np.cumsum(rng.normal(size=(n, 3)) * 0.3 + [1, 0, 0], axis=0))
    problem = moving(rest, RodStiffness(3.0, 1.1, 1.3, 0.7, 0.9, 0.5), np.ones(n), np.ones((n, 3)))
    rod, chart = problem.assembly.internal[0], chart_of(problem)
    assert isinstance(rod, MovingRod)
    chart.q0 = product(chart.q0, exponential(size * rng.normal(size=(n, 3))))
    x = size * rng.normal(size=6 * n)

    def forces(x: np.ndarray) -> np.ndarray:
        g = np.zeros(6 * n)
        rod.add_gradient(x, g)
        return g

    state, own = chart.state(x), np.zeros(6 * n)
    rod.elastic.add_gradient(state, own)
    np.testing.assert_allclose(forces(x), own, rtol=0, atol=1e-13)
    assert rod.value(x) == pytest.approx(rod.elastic.value(state), rel=1e-13)
    slots = (rod.stencils[:, :, None] * 6 * n + rod.stencils[:, None, :]).astype(np.int32)
    K, still, H = np.zeros((3, 36 * n * n))
    rod.add_hessian(x, K, slots)
    found = np.array([(forces(x + 1e-6 * d) - forces(x - 1e-6 * d)) / 2e-6 for d in np.eye(6 * n)]).T
    np.testing.assert_allclose(K.reshape(6 * n, -1), found, rtol=0, atol=2e-8)
    moved = x.copy()
    chart.rebase(x)
    moved.reshape(-1, 6)[:, 3:] = 0.0  # where turns count about the nodes' own axes
    rod.add_hessian(moved, still, slots)
    rod.elastic.add_hessian(state, H, slots)
    still = still.reshape(6 * n, -1)
    np.testing.assert_allclose(0.5 * (still + still.T), H.reshape(6 * n, -1), rtol=0, atol=1e-12)


class Arm(Energy):
    """A dead force f at the material point a beside a node: E = -f . R a."""

    def __init__(self, node: int, arm: np.ndarray, force: np.ndarray) -> None:
        self.node, self.arm, self.force = node, arm, force

    @property
    def conservative(self) -> bool:
        return True

    @property
    def stencils(self) -> np.ndarray:
        return np.array([[6 * self.node + 3, 6 * self.node + 4, 6 * self.node + 5]])

    def _own(self, x: np.ndarray) -> np.ndarray:
        return rotation(x.reshape(-1, 7)[self.node, 3:]).T @ self.force

    def value(self, x: np.ndarray) -> float:
        return -float(self._own(x) @ self.arm)

    def add_gradient(self, x: np.ndarray, g: np.ndarray, scale: float = 1.0) -> None:
        g.reshape(-1, 6)[self.node, 3:] -= scale * np.cross(self.arm, self._own(x))

    def add_hessian(
        self, x: np.ndarray, data: np.ndarray, slots: np.ndarray, scale: float = 1.0, projected: bool = False
    ) -> None:
        F, both = self._own(x), np.outer(self._own(x), self.arm)
        data[slots[0]] += scale * (F @ self.arm * np.eye(3) - 0.5 * (both + both.T))

    def rounding(self, x: np.ndarray) -> float:
        return 0.0


def test_the_tangent_of_a_load_that_turns_is_the_derivative_of_its_forces() -> None:
    """By central differences, of a force on an arm in a state that is turned far; the rod's own has no part in it."""
    rng, problem = np.random.default_rng(5), gum(3)
    chart = chart_of(problem)
    chart.q0 = product(chart.q0, exponential(rng.normal(size=(3, 3))))
    load, x = MovingRodLoad(chart, Arm(1, rng.normal(size=3), rng.normal(size=3))), rng.normal(size=18)
    found = differences(lambda y: gradient(load, y), x)
    np.testing.assert_allclose(tangent(load, x), found, rtol=0, atol=1e-8)


def test_moments_in_motion_are_those_at_rest() -> None:
    """On two nodes, in a state that is turned far: forces by the general way, the tangent that and central differences.

    To rounding, of moments of about 1.
    """
    rng, problem = np.random.default_rng(6), gum(4)
    chart = chart_of(problem)
    chart.q0 = product(chart.q0, exponential(rng.normal(size=(4, 3))))
    moments, x = RodMoments(np.array([1, 3]), rng.normal(size=(2, 3))), rng.normal(size=24)
    load, other = MovingRodMoments(chart, moments), MovingRodLoad(chart, moments)
    np.testing.assert_allclose(gradient(load, x), gradient(other, x), rtol=0, atol=1e-14)
    np.testing.assert_allclose(tangent(load, x), tangent(other, x), rtol=0, atol=1e-14)
    np.testing.assert_allclose(tangent(load, x), differences(lambda y: gradient(load, y), x), rtol=0, atol=1e-8)


def test_a_chain_solver_solves_what_is_not_symmetric() -> None:
    """To rounding, as numpy's dense solution; a matrix without one is said to have none."""
    rng, problem = np.random.default_rng(0), gum(6)
    K = problem.assembly.pattern.matrix(rng.normal(size=len(problem.assembly.pattern.indices)))
    b = rng.normal(size=36)
    np.testing.assert_allclose(BandedLuSolver().solve(K, b, 0.0), np.linalg.solve(K.toarray(), b), rtol=1e-8)
    with pytest.raises(Exception, match="zero"):
        BandedLuSolver().solve(problem.assembly.pattern.matrix(np.zeros(K.nnz)), b, 0.0)


# ------------------------------------------------------------------ time


class Swell:
    """A course (1 - cos(pi t / T)) / 2, whose means are known; of 1 from the start for a `T` of 1e9 s."""

    def __init__(self, T: float) -> None:
        self.T = T

    def at(self, t: float) -> float:
        return 0.5 * (1.0 - np.cos(np.pi * t / self.T)) if self.T < 1e9 else 1.0

    def rate(self, t: float) -> float:
        return float(0.5 * np.pi / self.T * np.sin(np.pi * t / self.T))

    def mean(self, a: float, b: float) -> float:
        if self.T >= 1e9:
            return 1.0
        k = np.pi / self.T
        return float(0.5 - 0.5 * (np.sin(k * b) - np.sin(k * a)) / (k * (b - a)))


END = 0.02  # s


def let_go(**options: Any) -> Dynamics:
    """Clamped at one end, pushed at the other, and swaying and twisting at first without a jump at the clamp.

    Its sections turn against a hundred times their inertia, so that no mode is too fast for the steps.
    """
    n = 4
    forces = np.zeros((n, 3))
    forces[-1] = [0.01, 0.02, -0.03]
    v = np.zeros((n, 6))
    s = np.linspace(0.0, 1.0, n)
    v[:, 1], v[:, 3] = 2.0 * s**2, 30.0 * s
    rest = rod_at_rest(np.linspace([0.0, 0, 0], [0.2, 0, 0], n), up=np.array([0.0, 0.0, 1.0]))
    J = np.tile(100.0 * RHO * 0.07 * np.array([GUM.I2 + GUM.I3, GUM.I2, 1.5 * GUM.I3]), (n, 1))
    mass = np.full(n, RHO * 0.07 * GUM.area)
    return moving(rest, GUM.stiffness, mass, J, np.arange(6), forces, velocity=v.ravel(), **options)


@pytest.fixture(scope="module")
def exact() -> tuple[np.ndarray, np.ndarray]:
    """Positions and rotations of its nodes (4, 7) and velocities (24,) at END, by DOP853 at 1e-9."""
    problem = let_go()
    rod, n = problem.assembly.internal[0], 4
    assert isinstance(rod, MovingRod)
    M = np.asarray(problem.mass).reshape(n, 6)

    def rate(t: float, y: np.ndarray) -> np.ndarray:
        state, v, g = y[: 7 * n].reshape(n, 7).copy(), y[7 * n :].reshape(n, 6), np.zeros(6 * n)
        spin = 0.5 * product(state[:, 3:], np.concatenate([np.zeros((n, 1)), v[:, 3:]], axis=1))
        state[:, 3:] /= np.linalg.norm(state[:, 3:], axis=1, keepdims=True)
        rod.elastic.add_gradient(state.ravel(), g)
        problem.assembly.loads[0].add_gradient(y[: 6 * n], g)
        g = g.reshape(n, 6)
        g[:, 3:] += np.cross(v[:, 3:], M[:, 3:] * v[:, 3:])
        a = -g / M
        a[0] = 0.0
        return np.concatenate([np.concatenate([v[:, :3], spin], axis=1).ravel(), a.ravel()])

    start = np.concatenate([rod.elastic.rest, problem.velocity])
    y = solve_ivp(rate, (0.0, END), start, method="DOP853", rtol=1e-9, atol=1e-11).y[:, -1]
    return y[: 7 * n].reshape(n, 7), y[7 * n :]


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("name", INTEGRATORS)
def test_order_in_time(name: str, exact: tuple[np.ndarray, np.ndarray]) -> None:
    """That of the integrator in a vector space, in places, rotations and velocities: 1 or 2, to 0.35 at these steps."""
    errors, small = [], INTEGRATORS[name].explicit or name == "implicit_euler"
    for h in (5e-5, 2.5e-5) if small else (2e-4, 1e-4):
        problem = let_go(integrator=INTEGRATORS[name]())
        chart = chart_of(problem)
        last = march(problem, END, h, lambda m, chart=chart: (chart.state(m.x).reshape(-1, 7), m.v)).observed[-1]
        turn = np.abs(rotation(last[0][:, 3:]) - rotation(exact[0][:, 3:])).max()
        errors.append([np.abs(last[0][:, :3] - exact[0][:, :3]).max(), turn, np.abs(last[1] - exact[1]).max()])
    orders = np.log2(np.divide(*errors))
    np.testing.assert_allclose(orders, 1.0 if name == "implicit_euler" else 2.0, atol=0.35)


TURN = np.array([0.5, -0.3, 0.6])  # rad, of the clamp about its own axes
MOMENT, ARM, PULL = np.array([1e-3, 2e-3, -1e-3]), np.array([0.0, 0.02, -0.01]), np.array([0.02, -0.01, 0.03])
SLOW = Swell(2.0 * END)


def loaded(**options: Any) -> Dynamics:
    """The same rod, its clamp turned on a course, its end under a moment and a force on an arm that grow."""
    problem = let_go(target=np.concatenate([np.zeros(3), TURN]), support_amplitude=SLOW, **options)
    chart, tip = chart_of(problem), np.array([3])
    loads: list[Energy] = [problem.assembly.loads[0], MovingRodLoad(chart, RodMoments(tip, MOMENT[None]))]
    loads.append(MovingRodLoad(chart, EccentricRodForces(chart.state(np.zeros(24)), tip, ARM[None], PULL[None])))
    assembly = Assembly(24, problem.fixed, list(problem.assembly.internal), loads)
    return replace(problem, assembly=assembly, amplitudes=(Swell(1e9), SLOW, SLOW))


@pytest.fixture(scope="module")
def exactly() -> tuple[np.ndarray, np.ndarray]:
    """Of `loaded`: positions and rotations (4, 7) and velocities (24,) at END; loads as vectors in space, by DOP853."""
    problem, n = let_go(), 4
    rod = problem.assembly.internal[0]
    assert isinstance(rod, MovingRod)
    M, rest = np.asarray(problem.mass).reshape(n, 6), rod.elastic.rest.reshape(n, 7)

    def rate(t: float, y: np.ndarray) -> np.ndarray:
        state, v, g = y[: 7 * n].reshape(n, 7).copy(), y[7 * n :].reshape(n, 6).copy(), np.zeros(6 * n)
        state[0, 3:] = product(rest[0, 3:], exponential(SLOW.at(t) * TURN))
        v[0, 3:] = SLOW.rate(t) * TURN
        spin = 0.5 * product(state[:, 3:], np.concatenate([np.zeros((n, 1)), v[:, 3:]], axis=1))
        state[:, 3:] /= np.linalg.norm(state[:, 3:], axis=1, keepdims=True)
        rod.elastic.add_gradient(state.ravel(), g)
        problem.assembly.loads[0].add_gradient(y[: 6 * n], g)
        R, g = Rotation.from_quat(state[3, 3:], scalar_first=True), g.reshape(n, 6)
        g[3, :3] -= SLOW.at(t) * PULL
        g[3, 3:] -= SLOW.at(t) * R.inv().apply(MOMENT + np.cross(R.apply(ARM), PULL))
        g[:, 3:] += np.cross(v[:, 3:], M[:, 3:] * v[:, 3:])
        a = -g / M
        a[0] = 0.0
        return np.concatenate([np.concatenate([v[:, :3], spin], axis=1).ravel(), a.ravel()])

    start = np.concatenate([rest.ravel(), problem.velocity])
    y = solve_ivp(rate, (0.0, END), start, method="DOP853", rtol=1e-9, atol=1e-11).y[:, -1]
    state, v = y[: 7 * n].reshape(n, 7), y[7 * n :]
    state[0, 3:], v[3:6] = product(rest[0, 3:], exponential(SLOW.at(END) * TURN)), SLOW.rate(END) * TURN
    return state, v


QUICK = ("midpoint",)


@pytest.mark.slow
@pytest.mark.parametrize("name", [n if n in QUICK else pytest.param(n, marks=pytest.mark.slow) for n in INTEGRATORS])
def test_order_in_time_of_loads_and_supports_that_turn(name: str, exactly: tuple[np.ndarray, np.ndarray]) -> None:
    """As without them; their work goes into the balance of energies, which closes better than in proportion to the
    step: but for implicit Euler, which takes a part of the energy in proportion to it."""
    errors, drifts, small = [], [], INTEGRATORS[name].explicit or name == "implicit_euler"
    for h in (5e-5, 2.5e-5) if small else (2e-4, 1e-4):
        problem = loaded(integrator=INTEGRATORS[name]())
        chart = chart_of(problem)
        track = march(problem, END, h, lambda m, chart=chart: (chart.state(m.x).reshape(-1, 7), m.v))
        last = track.observed[-1]
        turn = np.abs(rotation(last[0][:, 3:]) - rotation(exactly[0][:, 3:])).max()
        errors.append([np.abs(last[0][:, :3] - exactly[0][:, :3]).max(), turn, np.abs(last[1] - exactly[1]).max()])
        drifts.append(abs(track.energies["drift"][-1]) / track.balance.scale)
    orders = np.log2(np.divide(*errors))
    np.testing.assert_allclose(orders, 1.0 if name == "implicit_euler" else 2.0, atol=0.35)
    assert drifts[1] < (0.03 if name == "implicit_euler" else 1e-3)
    assert np.log2(drifts[0] / drifts[1]) > (0.65 if name == "implicit_euler" else 1.5)


# ------------------------------------------------------------------ what is kept


def momenta(problem: Dynamics, duration: float, step: float) -> tuple[np.ndarray, np.ndarray, Trajectory]:
    """Linear and angular momentum (t, 3) of a free rod."""
    chart, M = chart_of(problem), np.asarray(problem.mass).reshape(-1, 6)

    def seen(motion: Motion) -> np.ndarray:
        at, q, _ = chart.positions_and_rotations(motion.x)
        p = M * motion.v.reshape(-1, 6)
        turning = np.einsum("nij,nj->i", rotation(q), p[:, 3:])
        return np.array([p[:, :3].sum(axis=0), np.cross(at, p[:, :3]).sum(axis=0) + turning])

    track = march(problem, duration, step, seen)
    found = np.array(track.observed)
    return found[:, 0], found[:, 1], track


@pytest.mark.parametrize("name", INTEGRATORS)
def test_momenta_of_a_free_rod_that_spins_and_bends(name: str) -> None:
    """Linear momentum by every integrator, to rounding; angular momentum by midpoint likewise (Simo and Wong 1991), by
    the others of second order to a part (w h)^2 of this spin and its bending, by implicit Euler less."""
    n, w = 9, np.array([3.0, 6.0, 10.0])
    problem = gum(n, integrator=INTEGRATORS[name]())
    v, X = np.zeros((n, 6)), chart_of(problem).X
    v[:, :3] = np.cross(w, X - X.mean(axis=0))
    v[:, 2] += 0.2 + 0.3 * np.sin(np.linspace(0.0, np.pi, n))
    v[:, 3:] = w
    step, duration = (1e-4, 0.04) if INTEGRATORS[name].explicit else (1e-3, 0.2)
    linear, angular, track = momenta(replace(problem, velocity=v.ravel()), duration, step)
    np.testing.assert_allclose(linear, np.tile(linear[0], (len(linear), 1)), atol=1e-12 * np.abs(linear[0]).max())
    off = np.linalg.norm(angular - angular[0], axis=1).max() / np.linalg.norm(angular[0])
    assert off < {"midpoint": 1e-10, "implicit_euler": 0.03}.get(name, 1e-3)
    energy = track.energies["kinetic"] + track.energies["strain"]
    assert np.ptp(energy) < (0.1 if name in ("implicit_euler", "bdf2") else 0.01) * energy[0]


@pytest.mark.slow
def test_free_sections_spin_as_euler_says_and_keep_their_energy() -> None:
    """Two sections without a rod between them, three different moments of inertia: angular momentum and energy to
    rounding over 20 turns by midpoint, rotations that stay rotations, and Euler's equations by DOP853 to O(h^2):
    a quarter of the error at half the step, to a twentieth."""
    J, w = np.array([[1.0, 2.0, 3.0], [3.0, 1.0, 2.0]]), np.array([[0.3, 5.0, 0.4], [2.0, 4.0, 1.0]])
    rest = rod_at_rest(np.array([[0.0, 0, 0], [1.0, 0, 0]]))
    v = np.zeros((2, 6))
    v[:, 3:] = w
    R0 = rotation(rest.reshape(-1, 7)[:, 3:])
    errors = []
    truth = []
    for k in range(2):

        def rate(t: float, y: np.ndarray, j: np.ndarray = J[k]) -> np.ndarray:
            spin = product(y[:4], np.concatenate([[0.0], y[4:]])) / 2
            return np.concatenate([spin, -np.cross(y[4:], j * y[4:]) / j])

        start = np.concatenate([[1.0, 0, 0, 0], w[k]])
        end = solve_ivp(rate, (0.0, 2.0), start, method="DOP853", rtol=1e-12, atol=1e-12).y[:4, -1]
        truth.append(R0[k] @ Rotation.from_quat(end, scalar_first=True).as_matrix())
    for h in (0.02, 0.01):
        problem = moving(rest, RodStiffness(*[0.0] * 6), np.ones(2), J, velocity=v.ravel(),
                         integrator=INTEGRATORS["midpoint"](), tolerance=1e-12)  # fmt: skip
        _, angular, track = momenta(problem, 2.0, h)
        R = rotation(chart_of(problem).q0)
        np.testing.assert_allclose(R @ R.swapaxes(1, 2), np.tile(np.eye(3), (2, 1, 1)), atol=1e-14)
        np.testing.assert_allclose(angular, np.tile(angular[0], (len(angular), 1)), atol=1e-10)
        assert np.ptp(track.energies["kinetic"]) < 1e-10 * track.energies["kinetic"][0]
        errors.append(np.abs(R - np.array(truth)).max())
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.05)


def test_period_of_a_pendulum_that_swings_by_ninety_degrees() -> None:
    """T / T0 = 2 K(sin 45 deg) / pi = 1.180341; a stiff rod on a hinge, masses at its nodes, midpoint at 500 steps to a
    period: it lengthens by about (w h)^2 / 12 = 1.3e-5, and the rod's own bending by less (1 GPa)."""
    n = 3
    mass, J = np.array([0.1, 0.2, 0.1]), np.tile([1e-4, 2e-4, 2e-4], (n, 1))
    rest = rod_at_rest(np.linspace([0.0, 0, 0], [0.2, 0, 0], n), up=np.array([0.0, 0.0, 1.0]))
    arm = np.linspace(0.0, 0.2, n)
    weight = np.outer(mass, [0.0, 0.0, -9.81])
    T0 = 2 * np.pi * np.sqrt((mass @ arm**2 + J[:, 1].sum()) / (9.81 * mass @ arm))
    problem = moving(rest, circular(0.02, 1e9, 0.3).stiffness, mass, J, fixed=np.array([0, 1, 2, 3, 5]), forces=weight,
                     integrator=INTEGRATORS["midpoint"]())  # fmt: skip
    h = T0 / 500
    track = march(problem, 0.32 * T0, h, lambda m: m.x[-6] + 0.2)
    x = np.array(track.observed)
    below = int(np.argmax(x < 0.0))  # a quarter of a period, when it hangs
    quarter = track.times[below] - h * x[below] / (x[below] - x[below - 1])
    assert 4 * quarter / T0 == pytest.approx(1.180341, rel=1e-4)


@pytest.mark.parametrize("kind", ["alpha", "beta"])
def test_damping_of_a_small_vibration(kind: str) -> None:
    """A clamped rod in Bernoulli's first mode, w = 1.8751^2 ...: its swing falls by exp(-2 pi zeta) in a period, with
    zeta = a / 2w or b w / 2 = 0.05, to the 1 % by which w differs and the mode is not alone."""
    w = 1.8751**2 / 0.2**2 * np.sqrt(1e6 * GUM.I2 / (RHO * GUM.area))
    damping = Rayleigh(alpha=0.1 * w) if kind == "alpha" else Rayleigh(beta=0.1 / w)
    n = 9
    s = np.linspace(0.0, 1.0, n)
    v, b = np.zeros((n, 6)), 1.8751
    v[:, 2] = np.cosh(b * s) - np.cos(b * s) - 0.7341 * (np.sinh(b * s) - np.sin(b * s))
    problem = gum(n, fixed=np.arange(6), velocity=1e-3 * v.ravel(), damping=damping,
                  integrator=INTEGRATORS["trapezoidal"]())  # fmt: skip
    T = 2 * np.pi / w
    swing = np.array(march(problem, 1.4 * T, T / 50, lambda m: m.x[-4]).observed)
    first, second = swing[:30].max(), swing[45:].max()
    assert second / first == pytest.approx(np.exp(-2 * np.pi * 0.05), rel=0.02)


@pytest.mark.parametrize("name", [n if n in QUICK else pytest.param(n, marks=pytest.mark.slow) for n in INTEGRATORS])
def test_a_free_rod_takes_the_impulse_of_what_turns_it(name: str) -> None:
    """A moment in space and a force on an arm that grow: linear momentum is the integral of the force by every
    integrator, to rounding; angular momentum by midpoint that of the moments in the middles of its steps, where the
    moment by itself is exact, and by the others of second order near it; energies balance."""
    problem = gum(9, integrator=INTEGRATORS[name]())
    chart, course, tip = chart_of(problem), Swell(0.1), np.array([8])
    rest = chart.state(np.zeros(54))
    loads: list[Energy] = [MovingRodLoad(chart, RodMoments(tip, 0.1 * MOMENT[None]))]
    loads.append(MovingRodLoad(chart, EccentricRodForces(rest, tip, ARM[None], 0.1 * PULL[None])))
    step, duration = (1e-4, 0.02) if INTEGRATORS[name].explicit else (1e-3, 0.05)

    def by(loads: list[Energy]) -> tuple[np.ndarray, np.ndarray, Trajectory]:
        assembly = Assembly(54, NONE, list(problem.assembly.internal), loads)
        return momenta(replace(problem, assembly=assembly, amplitudes=(course,) * len(loads)), duration, step)

    linear, angular, track = by(loads)
    impulse = np.array([t * course.mean(0.0, t) if t else 0.0 for t in track.times])
    np.testing.assert_allclose(linear, 0.1 * impulse[:, None] * PULL, atol=1e-11 * np.abs(linear).max())
    off = np.abs(by(loads[:1])[1] - 0.1 * impulse[:, None] * MOMENT).max() / np.abs(angular).max()
    assert off < {"midpoint": 1e-10, "implicit_euler": 0.1}.get(name, 0.01)
    drift = np.abs(track.energies["drift"]).max() / track.balance.scale
    assert drift < {"implicit_euler": 0.2, "bdf2": 0.05}.get(name, 0.01)
