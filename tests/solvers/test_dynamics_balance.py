"""The balance of energy along a motion: what integrators lose is theirs, what they gain is said, and ends the march."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.dynamics import INTEGRATORS
from softmark.solvers.dynamics.bdf2 import BDF2
from softmark.solvers.dynamics.central_differences import CentralDifferences
from softmark.solvers.dynamics.dynamic_forces import DynamicForces
from softmark.solvers.dynamics.dynamic_problem import Dynamics, Rayleigh
from softmark.solvers.dynamics.energy_balance import GAIN, PATIENCE, EnergyAccount
from softmark.solvers.dynamics.generalized_alpha import GeneralizedAlpha
from softmark.solvers.dynamics.implicit_euler import ImplicitEuler
from softmark.solvers.dynamics.implicit_midpoint import Midpoint
from softmark.solvers.dynamics.integrator import Integrator, StepTooLong
from softmark.solvers.dynamics.load_amplitudes import Amplitude
from softmark.solvers.dynamics.mass_matrices import lumped_mass, mass_shapes_and_volumes
from softmark.solvers.dynamics.newmark import Newmark
from softmark.solvers.dynamics.time_integration import march
from softmark.solvers.dynamics.time_step_resolution import (
    amplification,
    find_resolution,
    lowest_excited_frequency,
    resolve_vibration,
)
from softmark.solvers.dynamics.trajectory import Diverged, MotionNotConverged, Trajectory
from softmark.solvers.dynamics.trapezoidal_rule import Trapezoidal
from softmark.solvers.energies.external_loads import DeadForces
from softmark.solvers.mesh.shapes import Box

NAMES = sorted(INTEGRATORS)
IMPLICIT = [name for name in NAMES if not INTEGRATORS[name].explicit]
NONE = np.zeros(0, dtype=np.int64)
Oscillators, States = Callable[..., Dynamics], Callable[[Trajectory], np.ndarray]


def made(name: str) -> Any:
    return INTEGRATORS[name]()


def dumbbell(spring: type[Any], integrator: Integrator, spin: float, stiffness: float = 1.0) -> Dynamics:
    """Two unit masses a unit apart, free, spinning about their middle."""
    points = np.array([[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0]])
    bond = spring(points, np.array([[0, 1]]), stiffness, 1.0)
    v = (spin * np.stack([-points[:, 1], points[:, 0], points[:, 2]], axis=1)).ravel()
    assembly = Assembly(6, NONE, [bond], [])
    return Dynamics(assembly, np.ones(6), np.zeros(6), v, integrator=integrator, tolerance=1e-11)


# ------------------------------------------------------------------ what balances


@pytest.mark.parametrize("name", NAMES)
def test_a_free_spinning_body(name: str, spring: type[Any]) -> None:
    """60 steps of 0.05 at w = 1, vibration at sqrt 2: errors of O(h^2); only the dissipative ones lose visibly."""
    found = march(dumbbell(spring, made(name), 1.0), 3.0, 0.05).balance
    assert not found.has_excessive_gain
    assert found.gain < 0.005  # (w h)^2 / 2 = 1e-3, and a few of these
    assert found.loss < (0.3 if name == "implicit_euler" else 0.01)


@pytest.mark.parametrize("name", NAMES)
def test_a_dropped_weight(name: str, quadratic: type[Any]) -> None:
    """A weight on a spring, let go: the load's work is exact, so all that is out of balance is the integrator's."""
    assembly = Assembly(1, NONE, [quadratic(np.eye(1))], [DeadForces(np.ones(1))])
    path = march(Dynamics(assembly, np.ones(1), np.zeros(1), np.zeros(1), integrator=made(name)), 6.0, 0.1)
    found = path.balance
    assert found.scale == pytest.approx(2.0, rel=0.5)  # it falls by twice the deflection at rest, which is 1
    assert found.gain < 0.01
    assert found.loss < (0.4 if name == "implicit_euler" else 0.01)


@pytest.mark.parametrize("name", IMPLICIT)
@pytest.mark.parametrize("step", [0.01, 1.0, 100.0])
def test_linear_vibrations_gain_nothing_at_any_step(name: str, step: float, oscillators: Oscillators) -> None:
    """Energies of linear problems are kept or lost, to the tolerance of the steps; but for the overshoot of
    generalised-alpha, whose velocities grow as w h in the first steps (Hilber and Hughes 1978) and come back."""
    found = march(oscillators(made(name)), 100 * step, step).balance
    assert found.gain < (0.05 if name == "generalized_alpha" and step < 2 else 1e-8) or name == "generalized_alpha"


@pytest.mark.parametrize("name", NAMES)
def test_a_support_that_moves_and_comes_back(name: str, spring: type[Any], sampled: Callable[..., Amplitude]) -> None:
    """A mass on a spring whose other end is moved by one length over a second, smoothly."""
    points = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    bond = spring(points, np.array([[0, 1]]), 40.0, 1.0)

    def course(t: float) -> float:
        return float(0.5 * (1.0 - np.cos(np.pi * np.clip(t, 0.0, 1.0))))

    problem = Dynamics(
        Assembly(6, np.arange(3), [bond], []), np.ones(6), np.zeros(6), np.zeros(6), np.arange(3),
        np.array([1.0, 0.0, 0.0]), sampled(course), integrator=made(name),
    )  # fmt: skip
    found = march(problem, 2.0, 0.02).balance
    assert found.scale > 1.0  # the support works against 40 N/m
    assert found.gain < 0.02
    assert not found.has_excessive_gain


# ------------------------------------------------------------------ what does not


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("name", NAMES)
def test_a_stiff_body_that_spins_too_fast_for_the_step_never_comes_out_as_converged_with_a_gain(
    name: str, spring: type[Any]
) -> None:
    """w h = 1 and vibrations of 45 to a radian: trapezoidal rules may blow up there (Simo and Tarnow 1992)."""
    problem = dumbbell(spring, made(name), 2.0, 1000.0)
    try:
        path = march(problem, 100.0, 0.5)
    except (MotionNotConverged, StepTooLong):
        return
    assert path.balance.gain <= GAIN
    assert np.all(np.isfinite(path.energies["drift"]))


def test_an_unstable_scheme_ends_with_its_gain_and_its_time(oscillators: Oscillators) -> None:
    """Newmark with beta = 0.1, gamma = 0.5 is unstable for w h > 2.58 = 1/sqrt(1/4 - 1/10) (Hughes 1987, 9.1).

    Below, its energy comes and goes by 1/(1 - 0.15 (w h)^2): by 18 % at w h = 1.
    """
    stable = march(oscillators(Newmark(beta=0.1)), 100.0, 1.0)
    assert stable.balance.gain < 0.18
    with pytest.raises(Diverged, match=r"at [\d.]+ s the energy has grown by .* the energy") as stopped:
        march(oscillators(Newmark(beta=0.1)), 270.0, 2.7)
    path = stopped.value.trajectory
    assert not path.complete
    assert path.balance.has_excessive_gain
    assert PATIENCE <= len(path.times) < 60
    assert all(np.all(np.isfinite(e)) for e in path.energies.values())


def test_a_march_that_ends_in_a_gain_has_diverged(oscillators: Oscillators) -> None:
    """However short: the last step is judged by itself."""
    with pytest.raises(Diverged):
        march(oscillators(Newmark(beta=0.1)), 5 * 4.0, 4.0)


def test_damping_that_swings_after_a_jump_is_a_doubt_and_no_divergence(
    quadratic: type[Any], sampled: Callable[..., Amplitude]
) -> None:
    """x'' + 5 w^2 x' + w^2 x = w for w = 1 and 100, a push of one step of 0.1 s: the slow one creeps back.

    After the push c the slow one is 0.1 (exp(r t) - exp(s t)) / (r - s), r and s = (-5 +- sqrt(21)) / 2, t from the
    push's middle; 1 % for steps of 0.1 s of a motion that lasts 5 s. The fast one is at rest within a step, and
    generalised-alpha swings about it by 0.8 a step: work of damping that the body never had, 146 times the load's.
    """
    assembly = Assembly(2, NONE, [quadratic(np.diag([1.0, 1e4]))], [DeadForces(np.array([1.0, 100.0]))])
    problem = Dynamics(
        assembly, np.ones(2), np.zeros(2), np.zeros(2), amplitudes=(sampled(lambda t: float(t < 0.1)),),
        integrator=GeneralizedAlpha(), damping=Rayleigh(beta=5.0), tolerance=1e-12,
    )  # fmt: skip
    path = march(problem, 6.0, 0.1)
    r, s = (-5.0 + np.sqrt(21.0)) / 2, (-5.0 - np.sqrt(21.0)) / 2
    right = 0.1 * (np.exp(r * 5.95) - np.exp(s * 5.95)) / (r - s)
    assert path.complete
    assert path.balance.has_excessive_gain
    assert path.observed[-1].x[0] == pytest.approx(right, rel=0.01)


def test_a_body_at_rest_is_not_judged_by_rounding(spring: type[Any]) -> None:
    points = np.array([[0.0, 0.0, 0.0], [0.3, 0.1, 0.7]])
    bond = spring(points, np.array([[0, 1]]), 1e9, float(np.linalg.norm(points[1])) * (1 + 1e-15))
    problem = Dynamics(
        Assembly(6, np.arange(3), [bond], []), np.ones(6), np.zeros(6), np.zeros(6), np.arange(3),
        integrator=Trapezoidal(),
    )  # fmt: skip
    assert not march(problem, 1.0, 0.01).balance.has_excessive_gain


def test_shares_of_a_balance() -> None:
    """A body of 4 J that a load brings 6 J: lost 1 J, then gained 2 J above that, of 10."""
    zero = np.zeros(3)
    energies = {
        "kinetic": np.array([4.0, 9.0, 11.0]), "strain": zero, "load_work": np.array([0.0, 6.0, 6.0]),
        "support_work": zero, "damping": zero, "drift": np.array([0.0, -1.0, 1.0]),
    }  # fmt: skip
    account = EnergyAccount()
    for i in range(3):
        account.add(float(i), {name: float(values[i]) for name, values in energies.items()})
    found = account.balance
    assert (found.scale, found.drift, found.loss) == (10.0, 0.1, 0.1)
    assert found.gain == pytest.approx(0.2)
    assert found.has_excessive_gain
    assert found.time == 2.0
    assert EnergyAccount().balance.facts["gained"] is False


# ------------------------------------------------------------------ six decades of steps


@pytest.mark.parametrize("name", NAMES)
def test_steps_over_six_decades_are_right_or_said_to_be_wrong(
    name: str, oscillators: Oscillators, states: States
) -> None:
    """cos t at the end of 3, and sin t: an error above 5 % of the swing is foretold, refused, or ends the march."""
    for step in np.logspace(-2.5, 3.5, 13):
        duration = max(3.0, 3 * step)
        problem = oscillators(made(name), damping=Rayleigh())
        try:
            path = march(problem, duration, float(step))
        except (MotionNotConverged, StepTooLong):
            assert step > 1.0
            continue
        x = states(path)
        assert np.all(np.isfinite(x))
        error = np.abs(x[-1] - [np.cos(duration), np.sin(duration)]).max()
        told = resolve_vibration(problem.integrator, problem.damping, 1.0, duration, float(step))
        assert told is not None
        assert error <= 0.06 or told.doubtful, (name, step, error)


@pytest.mark.parametrize("name", NAMES)
def test_a_cantilever_over_six_decades_of_steps(name: str, law: Any, elastic: Any) -> None:
    """Two hexahedra under their weight, against the modes of the same equations: the tip is right within 5 % of the
    fall, or the resolution says that it is not, or the march ends. Sixty steps, or as many as make five."""
    mesh = Box((2.0, 1.0, 1.0)).mesh("hex8", 1.0)
    wall = (3 * np.flatnonzero(mesh.points[:, 0] < 1e-9)[:, None] + np.arange(3)).ravel()
    N, w = mass_shapes_and_volumes(mesh.points, mesh.cells, mesh.element)
    mass = lumped_mass(mesh.cells, N, w, 1.0)
    pull = np.zeros(mass.size)
    pull[2::3] = -1e-4 * mass[2::3]
    assembly = Assembly(mass.size, wall, [elastic(mesh, law("small", 1.0, 0.3))], [DeadForces(pull)])
    rest = np.zeros(mass.size)
    problem = Dynamics(assembly, mass, rest, rest, wall, integrator=made(name), tolerance=1e-9)
    free = assembly.free
    root = np.sqrt(mass[free])
    squares, modes = np.linalg.eigh(assembly.tangent(rest, 1.0).toarray() / np.outer(root, root))
    omega, shares = np.sqrt(squares), modes.T @ (pull[free] / root)
    tip = np.flatnonzero(free == 3 * int(np.argmax(mesh.points.sum(axis=1))) + 2)[0]

    def exact(t: float) -> np.ndarray:
        return np.asarray(modes @ (shares / squares * (1.0 - np.cos(omega * t))) / root)[tip]

    fall = abs(exact(np.pi / omega[0]))
    for step in 2 * np.pi / omega[0] * np.logspace(-4, 2, 13):
        try:
            path = march(problem, 60 * step if step < 1.0 else 5 * step, float(step))
        except (MotionNotConverged, StepTooLong):
            continue
        end = path.times[-1]
        error = abs(path.observed[-1].x[free][tip] - exact(end)) / fall
        told = find_resolution(problem, mesh.points, end, float(step))
        assert told is not None
        assert told.period == pytest.approx(2 * np.pi / omega[0], rel=1e-3)
        assert error <= 0.05 or told.doubtful or path.balance.has_excessive_gain, (step * omega[0], error)


@pytest.mark.parametrize("integrator", [
    ImplicitEuler(), Trapezoidal(), Midpoint(), Newmark(), Newmark(0.3, 0.6), GeneralizedAlpha(), GeneralizedAlpha(0.0),
    BDF2(), CentralDifferences(safety=1.0),
], ids=repr)  # fmt: skip
@pytest.mark.parametrize("step", [0.1, 0.9])
def test_amplification_is_that_of_the_march(
    integrator: Any, step: float, oscillators: Oscillators, states: States
) -> None:
    """Far from the start x + i y turns by the principal eigenvalue alone: the others have faded or are not there."""
    x = states(march(oscillators(integrator), 40 * step, step))
    z = amplification(integrator, step)
    assert z is not None
    # x_(n+1) - 2 Re z x_n + |z|^2 x_(n-1) = 0
    left = x[32] - 2 * z.real * x[31] + abs(z) ** 2 * x[30]
    assert np.abs(left).max() < 1e-8 * np.abs(x[30:33]).max()


def test_the_lowest_loaded_mode_of_a_chain(quadratic: type[Any]) -> None:
    """Three masses between walls: w^2 = 2 - sqrt 2, 2, 2 + sqrt 2; an antisymmetric load excites the second alone."""
    K = np.array([[2.0, -1, 0], [-1, 2, -1], [0, -1, 2]])
    for load, square in ((np.array([0.0, 1, 0]), 2 - np.sqrt(2)), (np.array([1.0, 0, -1]), 2.0)):
        wall = np.array([3])  # a fourth degree of freedom that is held: the chain is no free body
        assembly = Assembly(4, wall, [quadratic(np.pad(K, (0, 1)))], [DeadForces(np.append(load, 0.0))])
        held = Dynamics(assembly, np.ones(4), np.zeros(4), np.zeros(4), wall)
        found = lowest_excited_frequency(DynamicForces(held), held, np.zeros((1, 3)))
        assert found == pytest.approx(np.sqrt(square), rel=1e-6)
