"""Courses between steps: the impulse of every step is exact, whatever the course, and integrators keep their order.

Right values are closed forms: impulses of a free body, and Duhamel's integral of an oscillator (Clough and Penzien
1993, sections 2-5 and 6-1).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad

from softmark.interpreter.vocabulary.amplitude_words import Pulse, Ramp, Sine, Smooth
from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.dynamics import INTEGRATORS
from softmark.solvers.dynamics.dynamic_problem import Dynamics
from softmark.solvers.dynamics.load_amplitudes import Amplitude
from softmark.solvers.dynamics.time_integration import march
from softmark.solvers.energies.external_loads import DeadForces

NAMES = sorted(INTEGRATORS)
NONE = np.zeros(0, dtype=np.int64)  # nothing is held
COURSES = [
    Pulse(start=0.0312, until=0.0318),  # between two steps of 10 ms
    Pulse(start=0.004, until=0.0971),
    Ramp(over=0.033, start=0.0123),
    Ramp(over=0.002, start=0.0413),
    Smooth(over=0.015, start=0.0177),
    Sine(frequency=99.0),
    Sine(frequency=7.0),
]


@pytest.mark.parametrize("course", COURSES)
def test_the_mean_is_the_integral(course: Amplitude) -> None:
    """Against adaptive quadrature between the kinks, to 1e-10 of the whole."""
    kinks = [0.0312, 0.0318, 0.004, 0.0571, 0.0123, 0.0453, 0.0413, 0.0433, 0.0177, 0.0327]
    for begin, end in ((0.0, 0.01), (0.03, 0.04), (0.011, 0.0431), (0.0, 0.09), (0.0315, 0.0316)):
        inside = [k for k in kinks if begin < k < end] or None
        right = quad(course.at, begin, end, points=inside, epsabs=1e-13, limit=500)[0] / (end - begin)
        assert course.mean(begin, end) == pytest.approx(right, abs=1e-10)


def free(name: str, course: Amplitude) -> Dynamics:
    """A mass of 2 kg under 3 N."""
    return Dynamics(
        Assembly(1, NONE, [], [DeadForces(np.array([3.0]))]), np.full(1, 2.0), np.zeros(1), np.zeros(1),
        amplitudes=(course,), integrator=INTEGRATORS[name](), tolerance=1e-12,
    )  # fmt: skip


@pytest.mark.parametrize("course", COURSES)
@pytest.mark.parametrize("name", NAMES)
def test_a_free_body_has_the_right_velocity_at_every_step(name: str, course: Amplitude) -> None:
    """v(t) = integral of f c(t) / m: to the Newton tolerance, for every integrator and whatever is between steps."""
    path = march(free(name, course), 0.1, 0.01)
    v = np.array([motion.v[0] for motion in path.observed])
    right = np.array([1.5 * t * course.mean(0.0, t) if t else 0.0 for t in path.times])
    np.testing.assert_allclose(v, right, atol=1e-9 * max(1e-3, np.abs(right).max()))


def oscillator(name: str, course: Amplitude, quadratic: type[Any], w: float = 1.0, unit: float = 1.0) -> Dynamics:
    """x'' + w^2 x = w^2 unit c(t)."""
    return Dynamics(
        Assembly(1, NONE, [quadratic(np.array([[w**2]]))], [DeadForces(np.array([w**2 * unit]))]), np.ones(1),
        np.zeros(1), np.zeros(1), amplitudes=(course,), integrator=INTEGRATORS[name](), tolerance=1e-12,
    )  # fmt: skip


def rectangular(t: float, begin: float, end: float) -> float:
    """Duhamel's integral of sin(t - s) over a rectangular pulse, w = 1."""
    b, e = min(t, begin), min(t, end)
    return float(np.cos(t - e) - np.cos(t - b))


@pytest.mark.parametrize("name", NAMES)
def test_order_under_a_pulse_that_begins_and_ends_between_steps(name: str, quadratic: type[Any]) -> None:
    """A pulse from 0.3337 to 1.1113 at t = 2: orders to 0.35, for where it falls in its steps changes with them.

    Read at steps it is one of the first order for every integrator, with an error of up to a step of impulse.
    """
    course, errors = Pulse(start=0.3337, until=1.1113), []
    right = rectangular(2.0, 0.3337, 1.1113)
    steps = (0.08, 0.01)
    for h in steps:
        end = march(oscillator(name, course, quadratic), 2.0, h).observed[-1]
        errors.append(abs(end.x[0] - right))
    order = np.log(errors[0] / errors[1]) / np.log(steps[0] / steps[1])
    assert order > (1.0 if name == "implicit_euler" else 2.0) - 0.35
    if name != "implicit_euler":
        assert errors[0] < 0.25 * 0.08**2 * 4.0  # a quarter of (w h)^2 and a pulse's share


@pytest.mark.parametrize("name", NAMES)
def test_order_under_ramps_whose_kinks_are_between_steps(name: str, quadratic: type[Any]) -> None:
    """Ramp from 0.3337 over 0.777: x = ((t - a) - sin(t - a) - (t - b) + sin(t - b)) / 0.777 at t = 2."""
    a, b = 0.3337, 0.3337 + 0.777
    right = (b - a - np.sin(2.0 - a) + np.sin(2.0 - b)) / 0.777
    errors = []
    for h in (0.08, 0.01):
        end = march(oscillator(name, Ramp(over=0.777, start=a), quadratic), 2.0, h).observed[-1]
        errors.append(abs(end.x[0] - right))
    assert np.log(errors[0] / errors[1]) / np.log(8.0) > (0.7 if name == "implicit_euler" else 1.8)


@pytest.mark.parametrize("name", NAMES)
def test_a_short_pulse_is_its_impulse(name: str, quadratic: type[Any]) -> None:
    """6 ms between steps of 50 ms on an oscillator of 6.28 s: swing 0.006, to the damping of the integrator."""
    path = march(oscillator(name, Pulse(start=0.512, until=0.518), quadratic), 10.0, 0.05)
    swing = np.abs([motion.x[0] for motion in path.observed]).max()
    assert swing == pytest.approx(0.006, rel=0.06 if name == "implicit_euler" else 0.01)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("ratio", [0.3, 2.7])
def test_sine_below_and_above_the_frequency_of_an_oscillator(name: str, ratio: float, quadratic: type[Any]) -> None:
    """x = (sin(r t) - r sin t)/(1 - r^2), from rest; 40 steps to the shorter period."""
    h = 2 * np.pi / 40 / max(ratio, 1.0)
    path = march(oscillator(name, Sine(frequency=ratio / (2 * np.pi)), quadratic), 6.0, h)
    x = np.array([motion.x[0] for motion in path.observed])
    right = (np.sin(ratio * path.times) - ratio * np.sin(path.times)) / (1 - ratio**2)
    error = np.abs(x - right).max() / np.abs(right).max()
    assert error < (0.4 if name == "implicit_euler" else 0.02)


@pytest.mark.parametrize("name", NAMES)
def test_what_is_too_stiff_for_the_step_follows_a_smooth_course(name: str, quadratic: type[Any]) -> None:
    """w h = 40: the state is the static one under the load at that time, for integrators that damp such vibrations.

    c' h = 0.02 of the whole a step: a load that lags by half a step would be 0.01 off, and is of implicit Euler.
    """
    if name in ("central_differences", "trapezoidal", "newmark", "midpoint"):
        pytest.skip("explicit, or without damping of what is too fast")
    course = Ramp(over=1.0)
    path = march(oscillator(name, course, quadratic, w=2000.0), 1.0, 0.02)
    x = np.array([motion.x[0] for motion in path.observed])[25:]
    assert np.abs(x - path.times[25:]).max() < (0.0101 if name == "implicit_euler" else 1e-4)


def test_the_work_of_a_pulse_between_steps(quadratic: type[Any]) -> None:
    """It is the energy of what it leaves, (f dt)^2 / 2 m: nothing comes from nowhere."""
    path = march(oscillator("trapezoidal", Pulse(start=0.512, until=0.518), quadratic), 5.0, 0.05)
    assert path.energies["load_work"][-1] == pytest.approx(0.5 * 0.006**2, rel=0.01)
    assert np.abs(path.energies["drift"]).max() < 1e-6 * 0.006**2
