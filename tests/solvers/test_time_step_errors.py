"""The estimated error of a time step against closed forms: sums of vibration modes of random linear systems.

The truth is computed here from the matrices, by scipy.linalg.eigh and the response of one damped vibration to a load
that acts at once, grows along a ramp or swings (Clough and Penzien 1993, sections 3-2, 4-2 and 6-1).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy import linalg

from softmark.interpreter.vocabulary.amplitude_words import Ramp, Sine
from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.dynamics import INTEGRATORS
from softmark.solvers.dynamics.dynamic_problem import Dynamics, Rayleigh
from softmark.solvers.dynamics.load_amplitudes import Constant
from softmark.solvers.dynamics.time_integration import march
from softmark.solvers.dynamics.time_step_error import estimate_step_error
from softmark.solvers.energies.external_loads import DeadForces
from softmark.solvers.model_reduction.projected_energy import DenseSolver, QuadraticEnergy

CASES, QUICK = 400, 80  # a case takes some 50 ms


def chain(rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness (3 n, 3 n), N/m, and masses (3 n,), kg, of a random chain: stiff along it and soft across."""
    stiff = 10 ** rng.uniform(1.5, 3) * np.array([10 ** rng.uniform(0, 3), 1.0, 10 ** rng.uniform(-1, 1)])
    K = np.zeros((3 * count, 3 * count))
    for i in range(count - 1):
        for axis in range(3):
            k, a, b = stiff[axis] * rng.uniform(0.5, 2), 3 * i + axis, 3 * (i + 1) + axis
            K[[a, b], [a, b]] += k
            K[a, b] -= k
            K[b, a] -= k
    coupling = rng.normal(size=(2, 3 * count)) * math.sqrt(0.02 * stiff[1])
    return K + coupling.T @ coupling, np.repeat(rng.uniform(0.5, 2, count), 3) * 10 ** rng.uniform(-2, 0)


def response(w: float, zeta: float, push: float, course: Any, speed: float, t: np.ndarray) -> np.ndarray:
    """q of q'' + 2 zeta w q' + w^2 q = push course(t), q(0) = 0, q'(0) = speed, in closed form."""
    s = zeta * w
    d = w * np.sqrt(1.0 - zeta**2 + 0.0j)  # imaginary where it is overdamped

    def waves(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """exp(-s t) cos(d t) and exp(-s t) sin(d t) / d."""
        one, other = np.exp((1j * d - s) * t), np.exp((-1j * d - s) * t)
        return np.real(0.5 * (one + other)), np.real((one - other) / (2j * d))

    def grown(t: np.ndarray) -> np.ndarray:
        """Under course(t) = t for t > 0."""
        t = np.maximum(t, 0.0)
        C, S = waves(t)
        return push / w**2 * (t - 2 * s / w**2 + 2 * s / w**2 * C + (2 * s**2 / w**2 - 1.0) * S)

    C, S = waves(t)
    free = speed * S
    if isinstance(course, Constant):
        return free + push / w**2 * (1.0 - C - s * S)
    if isinstance(course, Ramp):
        return free + (grown(t) - grown(t - course.over)) / course.over
    o = 2.0 * math.pi * course.frequency
    c = push / ((w**2 - o**2) ** 2 + (2 * s * o) ** 2)
    A, B = c * (w**2 - o**2), -c * 2 * s * o  # A sin + B cos
    return free + A * np.sin(o * t) + B * np.cos(o * t) - B * C - (s * B + o * A) * S


def case(seed: int) -> tuple[Dynamics, np.ndarray, float, float, np.ndarray, np.ndarray]:
    """A problem, its points, duration and step, its stiffness and its masses."""
    rng = np.random.default_rng([39, seed])
    count = int(rng.integers(3, 9))
    K, mass = chain(rng, count)
    fixed = np.arange(3)
    w = np.sqrt(linalg.eigh(K[3:, 3:], np.diag(mass[3:]), eigvals_only=True))
    slowest = 2.0 * math.pi / w[0]
    name = sorted(INTEGRATORS)[int(rng.integers(len(INTEGRATORS)))]
    own = {"spectral_radius": float(rng.uniform(0, 1))} if name == "generalized_alpha" else {}
    integrator = INTEGRATORS[name](**own)
    step = slowest / 10 ** rng.uniform(1.0, 2.2)
    if integrator.explicit:
        step = min(step, 0.7 * 2.0 / w[-1])
    duration = step * int(rng.integers(20, 150))
    forces = []
    for _ in range(int(rng.integers(1, 3))):
        pushed = np.append(True, rng.random(3 * count - 4) < 0.3)
        forces.append(DeadForces(np.append(np.zeros(3), rng.normal(size=3 * count - 3) * pushed)))
    amplitudes: list[Any] = []
    for _ in forces:
        over, frequency = float(rng.uniform(0.05, 1)) * slowest, float(rng.uniform(0.1, 2) / slowest)
        amplitudes.append([Constant(), Ramp(over=over), Sine(frequency=frequency)][int(rng.integers(3))])
    velocity = np.zeros(3 * count)
    if rng.random() < 0.3:
        velocity[3:] = rng.normal(size=3 * count - 3) * 0.1
    alpha = float(rng.choice([0.0, 0.1 * w[0]]))
    beta = float(rng.choice([0.0, 0.02 / w[0]])) if not integrator.explicit else 0.0
    problem = Dynamics(
        Assembly(3 * count, fixed, [QuadraticEnergy(K, 0.0)], forces),
        mass,
        np.zeros(3 * count),
        velocity,
        fixed,
        np.zeros(3),
        amplitudes=(*amplitudes,),
        damping=Rayleigh(alpha, beta),
        integrator=integrator,
        linear=DenseSolver(),
        lagged=False,
    )
    points = np.column_stack([np.arange(count), np.zeros((count, 2))]).astype(float)
    return problem, points, duration, step, K, mass


def exact(problem: Dynamics, K: np.ndarray, mass: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Displacements (t, dofs), m, as a sum of all modes."""
    squares, shapes = linalg.eigh(K[3:, 3:], np.diag(mass[3:]))
    u = np.zeros((len(times), len(mass)))
    for square, shape in zip(squares, shapes.T, strict=True):
        w = math.sqrt(square)
        zeta = 0.5 * (problem.damping.alpha / w + problem.damping.beta * w)
        start = shape @ (mass * problem.velocity)[3:]
        q = response(w, zeta, 0.0, Constant(), start, times)
        for load, course in zip(problem.assembly.loads, problem.amplitudes, strict=True):
            q = q + response(w, zeta, shape @ load.f[3:], course, 0.0, times)
        u[:, 3:] += np.outer(q, shape)
    return u


@pytest.mark.parametrize(
    "seed", [*range(QUICK), *(pytest.param(s, marks=pytest.mark.slow) for s in range(QUICK, CASES))]
)
def test_the_estimated_error_of_a_step_is_its_error(seed: int) -> None:
    """Every degree of freedom at every time within 2 % of the largest error, and 1e-6 of the motion.

    Courses are straight lines in quarters of a step: a sine bends by (w h / 4)^2 / 8. Ritz vectors are complete.
    """
    problem, points, duration, step, K, mass = case(seed)
    track = march(problem, duration, step)
    found = estimate_step_error(problem, points, duration, step)
    assert found is not None
    np.testing.assert_allclose(track.times, found.times, rtol=1e-9, atol=1e-12)
    u, right = np.array([m.x for m in track.observed]), exact(problem, K, mass, found.times)
    error, told = u - right, found.error @ found.shapes.T
    assert np.abs(error - told).max() <= 0.02 * np.abs(error).max() + 1e-6 * np.abs(right).max()
