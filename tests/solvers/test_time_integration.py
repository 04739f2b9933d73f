"""The march through time: steps that fail, what is refused, what is told of cost."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from scipy.sparse import identity

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.dynamics import INTEGRATORS
from softmark.solvers.dynamics.central_differences import CentralDifferences
from softmark.solvers.dynamics.dynamic_problem import Dynamics
from softmark.solvers.dynamics.implicit_euler import ImplicitEuler
from softmark.solvers.dynamics.load_amplitudes import Constant
from softmark.solvers.dynamics.time_integration import march
from softmark.solvers.dynamics.trajectory import MotionNotConverged, Trajectory, summarize_timing
from softmark.solvers.dynamics.trapezoidal_rule import Trapezoidal
from softmark.solvers.energies.external_loads import DeadForces
from softmark.solvers.statics import static_equilibrium

NAMES = sorted(INTEGRATORS)
NONE = np.zeros(0, dtype=np.int64)  # nothing is held
Oscillators, States = Callable[..., Dynamics], Callable[[Trajectory], np.ndarray]


# ------------------------------------------------------------------ steps that fail


def test_a_step_that_fails_is_halved_and_grows_back(oscillators: Oscillators, states: States) -> None:
    """The third step fails at three lengths; what follows doubles wherever it meets the coarser grid again."""
    attempts: list[float] = []

    def sound(x: np.ndarray) -> bool:
        attempts.append(float(x[0]))
        return not 4 <= len(attempts) <= 6  # the third step fails three times (the start is judged too)

    path = march(oscillators(Trapezoidal(), sound=sound), 1.0, 0.1)
    assert path.complete
    assert [round(e.time, 12) for e in path.events] == [0.2, 0.2, 0.2]
    assert path.events[0].text == "step halved to 0.05 s: cells are inverted"
    np.testing.assert_allclose(path.steps[:6], [0.1, 0.1, 0.0125, 0.0125, 0.025, 0.05], rtol=1e-12)
    assert path.times[-1] == pytest.approx(1.0, abs=1e-15)
    np.testing.assert_allclose(states(path)[-1], [np.cos(1), np.sin(1)], atol=1e-3)  # (wh)^2/12 = 8e-4


def test_a_march_that_cannot_go_on_keeps_what_it_has(oscillators: Oscillators, states: States) -> None:
    problem = oscillators(ImplicitEuler(), sound=lambda x: bool(x[1] < 0.45))
    with pytest.raises(
        MotionNotConverged, match=r"no convergence at 0\.\d+ s even with steps of 0\.0015\d* s"
    ) as stopped:
        march(oscillators(ImplicitEuler(), sound=problem.sound, shortest=2.0**-6), 2.0, 0.1)
    path = stopped.value.trajectory
    assert not path.complete
    assert len(path.times) == len(path.observed) == len(path.wall) + 1 == len(path.energies["drift"])
    assert 0.44 < states(path)[-1, 1] < 0.45
    assert stopped.value.iterations
    assert isinstance(stopped.value, static_equilibrium.NotConverged)  # one family


def test_nothing_that_is_not_finite_comes_out(states: States, quadratic: type[Any]) -> None:
    @dataclass(frozen=True)
    class Cliff(quadratic):
        def add_gradient(self, x: np.ndarray, g: np.ndarray, scale: float = 1.0) -> None:
            g += np.where(np.abs(x) > 0.5, np.nan, scale * x)

    assembly = Assembly(1, NONE, [Cliff(np.eye(1))], [])
    for name in NAMES:
        problem = Dynamics(
            assembly, np.ones(1), np.zeros(1), np.ones(1), integrator=INTEGRATORS[name](), shortest=2.0**-3
        )
        with pytest.raises(MotionNotConverged) as stopped:
            march(problem, 2.0, 0.05)
        path = stopped.value.trajectory
        assert len(path.times) > 5
        assert np.all(np.isfinite(states(path)))
        assert all(np.all(np.isfinite(e)) for e in path.energies.values())


# ------------------------------------------------------------------ what is refused, what it costs


def test_parts_that_do_not_fit_are_refused(oscillators: Oscillators, quadratic: type[Any]) -> None:
    assembly = Assembly(2, NONE, [quadratic(np.eye(2))], [DeadForces(np.ones(2))])
    with pytest.raises(ValueError, match="2 amplitudes for 1 loads"):
        Dynamics(assembly, np.ones(2), np.zeros(2), np.zeros(2), amplitudes=(Constant(), Constant()))
    with pytest.raises(ValueError, match="1 targets for 0 supports"):
        Dynamics(assembly, np.ones(2), np.zeros(2), np.zeros(2), target=np.ones(1))
    with pytest.raises(ValueError, match="mass of shape"):
        Dynamics(assembly, np.ones(3), np.zeros(2), np.zeros(2))
    with pytest.raises(ValueError, match="lumped mass"):
        Dynamics(assembly, identity(2, format="csr"), np.zeros(2), np.zeros(2), integrator=CentralDifferences())
    with pytest.raises(ValueError, match="positive"):
        march(oscillators(Trapezoidal()), 1.0, 0.0)


def test_cost_of_steps_is_told(oscillators: Oscillators) -> None:
    path = march(oscillators(Trapezoidal()), 1.0, 0.3)
    np.testing.assert_allclose(path.steps, [0.3, 0.3, 0.3, 0.1], rtol=1e-12)
    assert len(path.wall) == len(path.cpu) == len(path.iterations) == 4
    assert np.all(path.iterations == 1)  # a linear problem
    told = summarize_timing(np.arange(101.0))
    assert (told.median, told.p95, told.p99, told.worst) == (50.0, 95.0, 99.0, 100.0)


def test_integrators_are_read_without_numpy() -> None:
    """The vocabulary of scenes comes from these classes, and reading a scene must stay fast."""
    code = "import sys, softmark.solvers.dynamics; sys.exit('numpy' in sys.modules or 'scipy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
