"""Integrators of dynamics on particles: the numbers that theory gives each of them, out of real marches."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from momenta import angular_momentum, linear_momentum
from scipy.integrate import solve_ivp
from scipy.sparse import csr_matrix

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.dynamics import INTEGRATORS, Integrator
from softmark.solvers.dynamics.central_differences import CentralDifferences
from softmark.solvers.dynamics.dynamic_problem import Dynamics, Rayleigh
from softmark.solvers.dynamics.generalized_alpha import GeneralizedAlpha
from softmark.solvers.dynamics.implicit_euler import ImplicitEuler
from softmark.solvers.dynamics.implicit_midpoint import Midpoint
from softmark.solvers.dynamics.integrator import StepTooLong
from softmark.solvers.dynamics.load_amplitudes import Amplitude
from softmark.solvers.dynamics.newmark import Newmark
from softmark.solvers.dynamics.time_integration import march
from softmark.solvers.dynamics.trajectory import Trajectory
from softmark.solvers.dynamics.trapezoidal_rule import Trapezoidal
from softmark.solvers.energies.external_loads import DeadForces

NAMES = sorted(INTEGRATORS)
NONE = np.zeros(0, dtype=np.int64)  # nothing is held
Oscillators, States = Callable[..., Dynamics], Callable[[Trajectory], np.ndarray]


def root(x: np.ndarray) -> complex:
    """z of x_n ~ Re(c z^n), from x (n, 2) = cosine and sine: x_(n+2) = 2 Re(z) x_(n+1) - |z|^2 x_n."""
    p, q = np.linalg.lstsq(np.stack([x[1:-1].ravel(), x[:-2].ravel()], axis=1), x[2:].ravel(), rcond=None)[0]
    return complex(p / 2, np.sqrt(-q - p**2 / 4))


# w h, then amplification per step and period ratio of each integrator: the characteristic roots of each method
# for x'' = -w^2 x, known to the digits shown (REFERENCES 3.10)
IDENTITY = {
    "implicit_euler": [(0.05, 0.998752, 1.000833), (0.1, 0.995037, 1.003324), (0.2, 0.980581, 1.013194),
                       (0.5, 0.894427, 1.078405), (1.0, 0.707107, 1.273240)],
    "trapezoidal": [(0.05, 1, 1.0002083), (0.1, 1, 1.0008328), (0.2, 1, 1.0033245), (0.5, 1, 1.0204970),
                    (1.0, 1, 1.0784052)],
    "central_differences": [(0.05, 1, 0.9998958), (0.1, 1, 0.9995830), (0.2, 1, 0.9983286), (0.5, 1, 0.9893927),
                            (1.0, 1, 0.9549297)],
    "bdf2": [(0.05, 0.9999984, 1.000831), (0.1, 0.9999756, 1.003300), (0.2, 0.9996363, 1.012835),
             (0.5, 0.9904014, 1.069350), (1.0, 0.9333211, 1.213890)],
    "generalized_alpha": [(0.05, 1.0, 1.000220), (0.1, 0.99999993, 1.000879), (0.2, 0.99999892, 1.003509),
                          (0.5, 0.99996011, 1.021624), (1.0, 0.99947461, 1.082603)],
}  # fmt: skip
IDENTITY["newmark"] = IDENTITY["midpoint"] = IDENTITY["trapezoidal"]  # the same in linear problems


@pytest.mark.parametrize(("name", "row"), [(name, row) for name in sorted(IDENTITY) for row in IDENTITY[name]])
def test_amplification_and_period(
    name: str, row: tuple[float, float, float], oscillators: Oscillators, states: States
) -> None:
    """Half a unit of the last digit of the table, 5e-7, and no more than 1e-6."""
    wh, amplification, period = row
    x = states(march(oscillators(INTEGRATORS[name]()), 100 * wh, wh))
    z = root(x[-30:])  # starting errors of BDF2 and generalised-alpha have died away by then
    assert abs(z) == pytest.approx(amplification, abs=6e-7)
    assert wh / np.angle(z) == pytest.approx(period, abs=6e-7)


def test_closed_forms_of_amplification(oscillators: Oscillators, states: States) -> None:
    """Backward Euler 1/sqrt(1 + (wh)^2), phase atan(wh); leapfrog 2 asin(wh/2): to the Newton tolerance."""
    z = root(states(march(oscillators(ImplicitEuler()), 30.0, 0.3)))
    assert z == pytest.approx(np.exp(1j * np.arctan(0.3)) / np.hypot(1.0, 0.3), abs=1e-11)
    z = root(states(march(oscillators(CentralDifferences()), 30.0, 0.3)))
    assert z == pytest.approx(np.exp(2j * np.arcsin(0.15)), abs=1e-11)


@pytest.mark.parametrize("radius", [0.0, 0.5, 0.8, 1.0])
def test_generalized_alpha_damps_fast_vibrations_by_its_spectral_radius(
    radius: float, oscillators: Oscillators, states: States
) -> None:
    """At w h = 1e4 the largest root is the spectral radius to O(1/(wh)^2) (Chung and Hulbert 1993, eq. 19).

    A double root makes x_n grow as n r^n, so ratios come near r with 1/n = 1/60.
    """
    x = states(march(oscillators(GeneralizedAlpha(radius)), 120e4, 1e4))[:, 0]
    assert abs(x[120]) ** (1 / 120) == pytest.approx(radius, abs=0.05) if radius else abs(x[-1]) < 1e-6


def test_explicit_steps_are_stable_up_to_their_limit(oscillators: Oscillators, states: States) -> None:
    """h w < 2: the exact limit of the leapfrog. Bounded just below, refused above with the critical step."""
    path = march(oscillators(CentralDifferences(safety=1.0)), 1999.0, 1.999)
    assert np.abs(states(path)).max() < 1.0 / np.sqrt(1 - 0.9995**2) + 1  # amplitude of the sampled ellipse
    with pytest.raises(StepTooLong) as refused:
        march(oscillators(CentralDifferences(safety=1.0)), 10.0, 2.001)
    assert refused.value.critical == pytest.approx(2.0, rel=1e-12)


# ------------------------------------------------------------------ energy and momentum


@pytest.mark.slow
@pytest.mark.long
def test_energy_of_a_linear_vibration(oscillators: Oscillators) -> None:
    """Conserved by the trapezoidal rule and midpoint to the Newton tolerance; lost as amplitude^2 by Euler.

    The leapfrog keeps x_n x_(n-1)-like quadratic: its energy oscillates by (wh)^2/4 at most, without drift.
    """
    h, n = 0.1, 200
    for integrator in (Trapezoidal(), Midpoint(), Newmark()):
        energies = march(oscillators(integrator), n * h, h).energies
        np.testing.assert_allclose(energies["kinetic"] + energies["strain"], 1.0, rtol=1e-11)
        np.testing.assert_allclose(energies["drift"], 0.0, atol=1e-11)
    energies = march(oscillators(ImplicitEuler()), n * h, h).energies
    total = energies["kinetic"] + energies["strain"]
    np.testing.assert_allclose(total, (1 + h**2) ** -np.arange(n + 1.0), rtol=1e-10)
    np.testing.assert_allclose(energies["drift"], total - 1.0, atol=1e-12)
    energies = march(oscillators(CentralDifferences()), n * h, h).energies
    assert np.abs(energies["drift"]).max() <= h**2 / 4 + 1e-12


@pytest.mark.slow
def test_work_of_a_step_load(states: States, quadratic: type[Any]) -> None:
    """A constant force f on a spring k at rest: x = f/k (1 - cos wt), load work f x, in balance at each time."""
    load = DeadForces(np.array([3.0]))
    problem = Dynamics(Assembly(1, NONE, [quadratic(np.array([[4.0]]))], [load]), np.ones(1), np.zeros(1), np.zeros(1))
    path = march(problem, 2.0, 1e-3)
    x = states(path)[:, 0]
    np.testing.assert_allclose(x, 0.75 * (1 - np.cos(2 * path.times)), atol=2e-6)  # period error (wh)^2/12
    np.testing.assert_allclose(path.energies["load_work"], 3 * x, atol=1e-12)
    np.testing.assert_allclose(path.energies["drift"], 0.0, atol=1e-10)  # rounding of 2000 steps


DUMBBELL = np.array([[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0]])
SPIN = 2.0


@pytest.fixture
def dumbbell(spring: type[Any]) -> Callable[[Integrator], Dynamics]:
    """Two particles of mass 1 on a spring, stretched so that they turn rigidly at SPIN, and drift along x and z.

    Centrifugal balance: k e = m w^2 (l + e)/2, hence e = 1/(2k/w^2 - 1) for l = m = 1.
    """
    e = 1.0 / (2 * 50.0 / SPIN**2 - 1)
    x = np.array([-e / 2, 0.0, 0.0, e / 2, 0.0, 0.0])
    v = np.array([0.0, -SPIN * (1 + e) / 2, 0.0, 0.0, SPIN * (1 + e) / 2, 0.0]) + np.tile([0.3, 0.0, 0.1], 2)
    own = Assembly(6, np.zeros(0, dtype=np.int64), [spring(DUMBBELL, np.array([[0, 1]]), 50.0, 1.0)], [])
    return lambda integrator: Dynamics(own, np.ones(6), x, v, integrator=integrator, tolerance=1e-13)


def momenta(problem: Dynamics, path: Trajectory) -> tuple[np.ndarray, np.ndarray]:
    """Linear (n, 3) and angular (n, 3) momentum along a path."""
    linear = [linear_momentum(problem.mass, m.v) for m in path.observed]
    angular = [angular_momentum(problem.mass, DUMBBELL + m.x.reshape(-1, 3), m.v) for m in path.observed]
    return np.array(linear), np.array(angular)


@pytest.mark.parametrize("name", NAMES)
def test_linear_momentum_of_a_free_body(name: str, dumbbell: Callable[[Integrator], Dynamics]) -> None:
    """Kept by every integrator: internal forces cancel, whatever the state. Rounding of 200 steps."""
    problem = dumbbell(INTEGRATORS[name]())
    linear, _ = momenta(problem, march(problem, 4.0, 0.02))
    np.testing.assert_allclose(linear, np.broadcast_to([0.6, 0.0, 0.2], linear.shape), atol=1e-11)


@pytest.mark.parametrize("name", ["midpoint", "central_differences"])
def test_angular_momentum_of_a_free_body(name: str, dumbbell: Callable[[Integrator], Dynamics]) -> None:
    """Kept by midpoint (Simo, Tarnow and Wong 1992) and leapfrog: to the Newton tolerance and rounding."""
    problem = dumbbell(INTEGRATORS[name]())
    _, angular = momenta(problem, march(problem, 4.0, 0.02))
    np.testing.assert_allclose(angular, np.broadcast_to(angular[0], angular.shape), atol=1e-11)


def test_backward_euler_brakes_a_spin_by_its_closed_form(dumbbell: Callable[[Integrator], Dynamics]) -> None:
    """x1 x M v1 - x0 x M v0 = h^2 v1 x g1 exactly, g = dE/dx; for rigid spin at w: a part (wh)^2 per step.

    From the scheme, x0 = x1 - h v1 and M v0 = M v1 + h g1. The identity holds to the Newton tolerance at each step.
    """
    problem, h = dumbbell(ImplicitEuler()), 0.02
    path = march(problem, 0.4, h)
    _, angular = momenta(problem, path)
    for before, after, motion in zip(angular[:-1], angular[1:], path.observed[1:], strict=True):
        g = np.zeros(6)
        problem.assembly.internal[0].add_gradient(motion.x, g)
        change = h**2 * np.cross(motion.v.reshape(-1, 3), g.reshape(-1, 3)).sum(axis=0)
        np.testing.assert_allclose(after - before, change, atol=1e-12)
    spin = angular[:, 2] / angular[0, 2]
    assert spin[-1] == pytest.approx((1 + (SPIN * h) ** 2) ** -20, rel=2e-3)  # the spring sags as the spin slows


def test_trapezoidal_rule_keeps_angular_momentum_to_second_order(dumbbell: Callable[[Integrator], Dynamics]) -> None:
    """Conjugate to midpoint: an error without drift that falls with h^2 (ratio 4 within 10 %)."""
    errors = []
    for h in (0.04, 0.02):
        problem = dumbbell(Trapezoidal())
        kicked = Dynamics(**{**vars(problem), "velocity": problem.velocity + np.eye(6)[3]})
        _, angular = momenta(kicked, march(kicked, 4.0, h))
        errors.append(np.abs(angular[:, 2] - angular[0, 2]).max())
    assert errors[1] > 1e-6
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)


# ------------------------------------------------------------------ damping, supports, loads in time


@pytest.mark.slow
@pytest.mark.parametrize("name", ["trapezoidal", "midpoint", "bdf2", "generalized_alpha", "central_differences"])
def test_rayleigh_damping_ratio(name: str, oscillators: Oscillators, states: States) -> None:
    """x = e^(-z w t) (cos wd t + z w/wd sin wd t), z = alpha/(2w) + beta w/2.

    At t = 5 periods are off by (wh)^2/12 or, BDF2, four times as much: 1e-5 and 4e-5 in x. The leapfrog's stiffness
    damping lags by half a step, as if the mass were smaller by beta w^2 h/2: 5 (beta h/4) = 3e-4.
    """
    alpha, beta, w, h = 0.1, 0.05, 1.0, 5e-3
    z = alpha / (2 * w) + beta * w / 2
    path = march(oscillators(INTEGRATORS[name](), damping=Rayleigh(alpha, beta)), 5.0, h)
    wd = w * np.sqrt(1 - z**2)
    expected = np.exp(-z * w * path.times) * (np.cos(wd * path.times) + z * w / wd * np.sin(wd * path.times))
    np.testing.assert_allclose(states(path)[:, 0], expected, atol=3e-4 if name == "central_differences" else 5e-5)
    total = path.energies["kinetic"] + path.energies["strain"]
    assert path.energies["damping"][-1] == pytest.approx(total[0] - total[-1], rel=1e-3)


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("name", NAMES)
def test_a_support_that_moves(
    name: str, states: States, quadratic: type[Any], sampled: Callable[..., Amplitude]
) -> None:
    """Base x_s = s sin(w t) under an oscillator of frequency w0 at rest:

    x = s w0/(w0^2 - w^2) (w0 sin wt - w sin w0 t). Errors O(h^2), O(h) for backward Euler.
    """
    w0, w, s, h = 2.0, 3.0, 0.1, 2e-3
    K = w0**2 * np.array([[1.0, -1.0], [-1.0, 1.0]])
    problem = Dynamics(
        Assembly(2, np.array([0]), [quadratic(K)], []), np.ones(2), np.zeros(2), np.zeros(2),
        np.array([0]), np.array([s]), sampled(lambda t: float(np.sin(w * t))), integrator=INTEGRATORS[name](),
    )  # fmt: skip
    path = march(problem, 2.0, h)
    x, t = states(path), path.times
    np.testing.assert_allclose(x[:, 0], s * np.sin(w * t), atol=1e-15)
    expected = s * w0 / (w0**2 - w**2) * (w0 * np.sin(w * t) - w * np.sin(w0 * t))
    np.testing.assert_allclose(x[:, 1], expected, atol=4e-3 if name == "implicit_euler" else 1e-5)
    assert np.abs(path.energies["support_work"]).max() > 0.01
    if name != "implicit_euler":
        np.testing.assert_allclose(path.energies["drift"], 0.0, atol=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        "trapezoidal",
        pytest.param("generalized_alpha", marks=pytest.mark.slow),
        pytest.param("central_differences", marks=pytest.mark.slow),
    ],
)
def test_damping_between_a_moving_support_and_the_body(
    name: str, states: States, quadratic: type[Any], sampled: Callable[..., Amplitude]
) -> None:
    """x'' = -alpha x' - beta w0^2 (x' - xs') - w0^2 (x - xs), by a Runge-Kutta method of order 8 (not this code).

    O(h^2) = 4e-6 of velocities and accelerations of the support; the leapfrog's stiffness damping lags by h/2.
    The energy that damping takes is the support's work less what the body has.
    """
    w0, w, s, h, alpha, beta = 2.0, 3.0, 0.1, 2e-3, 0.3, 0.1

    def rate(t: float, y: np.ndarray) -> list[float]:
        xs, vs = s * np.sin(w * t), s * w * np.cos(w * t)
        return [y[1], -alpha * y[1] - beta * w0**2 * (y[1] - vs) - w0**2 * (y[0] - xs)]

    K = w0**2 * np.array([[1.0, -1.0], [-1.0, 1.0]])
    problem = Dynamics(
        Assembly(2, np.array([0]), [quadratic(K)], []), np.ones(2), np.zeros(2), np.zeros(2),
        np.array([0]), np.array([s]), sampled(lambda t: float(np.sin(w * t))),
        damping=Rayleigh(alpha, beta), integrator=INTEGRATORS[name](),
    )  # fmt: skip
    path = march(problem, 4.0, h)
    exact = solve_ivp(rate, (0.0, 4.0), [0.0, 0.0], method="DOP853", rtol=1e-11, atol=1e-13).y[0, -1]
    assert states(path)[-1, 1] == pytest.approx(exact, abs=2e-4 if name == "central_differences" else 5e-6)
    np.testing.assert_allclose(path.energies["drift"], 0.0, atol=2e-4 if name == "central_differences" else 1e-5)
    assert path.energies["damping"][-1] > 0.01


@pytest.mark.long
@pytest.mark.slow
def test_each_load_has_its_own_course(states: States, sampled: Callable[..., Amplitude]) -> None:
    """x'' = 2 t + 3 cos t from rest: x = t^3/3 + 3 (1 - cos t). Error of the trapezoidal rule O(h^2)."""
    loads = [DeadForces(np.array([2.0])), DeadForces(np.array([3.0]))]
    problem = Dynamics(
        Assembly(1, NONE, [], loads), np.ones(1), np.zeros(1), np.zeros(1),
        amplitudes=(sampled(lambda t: t), sampled(lambda t: float(np.cos(t)))),
    )  # fmt: skip
    path = march(problem, 1.0, 1e-3)
    np.testing.assert_allclose(states(path)[:, 0], path.times**3 / 3 + 3 * (1 - np.cos(path.times)), atol=1e-6)


def test_a_mass_without_stiffness_beside_one_with(states: States, quadratic: type[Any]) -> None:
    """The pattern takes entries of the mass that no energy has: free fall, exact for the trapezoidal rule."""
    mass = np.array([[2.0, 0.0, 0.0], [0.0, 2.0, 1.0], [0.0, 1.0, 2.0]])
    assembly = Assembly(3, NONE, [quadratic(np.diag([1.0, 0, 0]))], [DeadForces(np.array([0.0, 3.0, 3.0]))])
    problem = Dynamics(assembly, csr_matrix(mass), np.zeros(3), np.zeros(3))
    x = states(march(problem, 1.0, 0.1))[-1]
    np.testing.assert_allclose(x, [0.0, 0.5, 0.5], atol=1e-12)  # M a = f with a = (0, 1, 1)


def test_an_explicit_step_is_halved_where_the_body_stiffens(spring: type[Any]) -> None:
    """k = 1 + 300 e^2 in tension: the critical step falls from 2 to about 2/sqrt(k) on the way."""
    points = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    spring = spring(points, np.array([[0, 1]]), 1.0, 1.0, cubic=100.0)
    v = np.array([0.0, 0.0, 0.0, 4.0, 0.0, 0.0])
    assembly = Assembly(6, np.arange(3), [spring], [])
    problem = Dynamics(assembly, np.ones(6), np.zeros(6), v, np.arange(3), integrator=CentralDifferences())
    path = march(problem, 2.0, 0.25)
    assert any("the critical step is now" in event.text for event in path.events)
    total = path.energies["kinetic"] + path.energies["strain"]
    # so near the limit a leapfrog keeps an energy that is not this one; beyond it, it gains without bound
    np.testing.assert_allclose(total, 8.0, rtol=0.35)
