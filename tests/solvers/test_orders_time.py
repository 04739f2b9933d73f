"""Observed orders in time of every integrator, to 0.1: backward Euler 1, all others 2.

Truths: the cosine and the sine of linear oscillators (REFERENCES 3.10), and an explicit Runge-Kutta method of order 8
for a pendulum of springs that stiffen. Neither shares anything with the integrators. Measured, linear and nonlinear:
backward Euler 0.996 and 0.996, BDF2 1.996 and 1.992, the others 2.000.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.dynamics import INTEGRATORS, Integrator
from softmark.solvers.dynamics.bdf2 import BDF2
from softmark.solvers.dynamics.dynamic_problem import Dynamics, Rayleigh
from softmark.solvers.dynamics.time_integration import march
from softmark.solvers.dynamics.trajectory import Trajectory
from softmark.solvers.dynamics.trapezoidal_rule import Trapezoidal
from softmark.solvers.energies.external_loads import DeadForces

NAMES = sorted(INTEGRATORS)
THEORY = {name: 1.0 if name == "implicit_euler" else 2.0 for name in NAMES}
TOLERANCE = 0.1  # of every order
Oscillators, States = Callable[..., Dynamics], Callable[[Trajectory], np.ndarray]

LINK = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
WEIGHT = DeadForces(np.tile([0.0, 0.0, -9.81], 3))
END = 0.8  # s


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("name", NAMES)
def test_order_of_a_linear_vibration(name: str, oscillators: Oscillators, states: States) -> None:
    """Positions and velocities at t = 2, where neither phase nor amplitude is at an extremum."""
    errors = []
    for h in (0.01, 0.005):
        end = march(oscillators(INTEGRATORS[name]()), 2.0, h).observed[-1]
        positions, velocities = [np.cos(2), np.sin(2)], [-np.sin(2), np.cos(2)]
        errors.append([np.linalg.norm(end.x - positions), np.linalg.norm(end.v - velocities)])
    orders = np.log2(np.divide(*errors))
    np.testing.assert_allclose(orders, THEORY[name], atol=TOLERANCE)


@pytest.fixture(scope="module")
def chain(spring: type[Any]) -> Any:
    """Springs that stiffen between three particles."""
    return spring(LINK, np.array([[0, 1], [1, 2]]), 40.0, 1.0, cubic=30.0)


@pytest.fixture(scope="module")
def swinging(chain: Any) -> Callable[..., Dynamics]:
    """A double pendulum of such springs, its first particle held, let go when level."""

    def make(integrator: Integrator, **options: Any) -> Dynamics:
        held, zero = np.arange(3), np.zeros(9)
        assembly = Assembly(9, held, [chain], [WEIGHT])
        return Dynamics(assembly, np.ones(9), zero, zero, held, integrator=integrator, tolerance=1e-12, **options)

    return make


@pytest.fixture(scope="module")
def exact(chain: Any) -> np.ndarray:
    """The state of the pendulum at END by an explicit Runge-Kutta method of order 8 (not this code) at 1e-12."""

    def rate(t: float, y: np.ndarray) -> np.ndarray:
        g = np.zeros(9)
        chain.add_gradient(y[:9], g)
        WEIGHT.add_gradient(y[:9], g)
        g[:3] = 0.0
        return np.concatenate([y[9:], -g])

    return solve_ivp(rate, (0.0, END), np.zeros(18), method="DOP853", rtol=1e-12, atol=1e-13).y[:9, -1]


QUICK = ("bdf2", "central_differences", "trapezoidal")
SOME = [name if name in QUICK else pytest.param(name, marks=pytest.mark.slow) for name in NAMES]


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("name", SOME)
def test_order_of_a_nonlinear_problem(name: str, swinging: Oscillators, exact: np.ndarray, states: States) -> None:
    coarse = 1 / 1000 if THEORY[name] == 1.0 else 1 / 400
    errors = [
        np.linalg.norm(states(march(swinging(INTEGRATORS[name]()), END, h))[-1] - exact) for h in (coarse, coarse / 2)
    ]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(THEORY[name], abs=TOLERANCE)


@pytest.mark.long
@pytest.mark.slow
def test_damping_keeps_the_second_order(swinging: Oscillators, states: States) -> None:
    """In a body that turns too, by its stiffness and by its mass; with the stiffness of each start it was O(h)."""
    orders = []
    for damping in (Rayleigh(beta=0.05), Rayleigh(alpha=1.0)):
        ends = [
            states(march(swinging(Trapezoidal(), damping=damping), END, h))[-1] for h in (1 / 200, 1 / 400, 1 / 800)
        ]
        orders.append(np.log2(np.linalg.norm(ends[1] - ends[0]) / np.linalg.norm(ends[2] - ends[1])))
    assert orders == pytest.approx([2.0, 2.0], abs=TOLERANCE)


@pytest.mark.slow
def test_bdf2_keeps_its_order_over_unequal_steps(swinging: Oscillators, exact: np.ndarray, states: States) -> None:
    """Steps halved in the middle of the way by a condition of soundness: still second order, within 0.2.

    Where the steps fall differs between the two runs, so that the errors are not those of one pattern of steps.
    """

    def error(h: float) -> float:
        seen = []

        def sound(x: np.ndarray) -> bool:
            seen.append(x)
            return len(seen) % 7 != 0  # every seventh attempt is refused

        path = march(swinging(BDF2(), sound=sound), END, h)
        assert path.events
        return float(np.linalg.norm(states(path)[-1] - exact))

    assert np.log2(error(1 / 400) / error(1 / 800)) == pytest.approx(2.0, abs=0.2)
