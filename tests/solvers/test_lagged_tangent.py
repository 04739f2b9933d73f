"""Steps with one lagged tangent against Newton's method, which is their judge; what is left to it; capped steps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.dynamics import INTEGRATORS
from softmark.solvers.dynamics.central_differences import CentralDifferences
from softmark.solvers.dynamics.dynamic_problem import Dynamics, Rayleigh
from softmark.solvers.dynamics.dynamic_system import DynamicSystem
from softmark.solvers.dynamics.lagged_tangent import AndersonAcceleration, BackwardDifferences
from softmark.solvers.dynamics.load_amplitudes import Amplitude
from softmark.solvers.dynamics.time_integration import march
from softmark.solvers.dynamics.trajectory import Trajectory
from softmark.solvers.energies.corotational_tets import CorotationalTets
from softmark.solvers.energies.elastic_energy import Elastic
from softmark.solvers.energies.external_loads import DeadForces, FollowerPressure
from softmark.solvers.materials.corotational import Corotational
from softmark.solvers.mesh.element_interpolation import integrate_cells
from softmark.solvers.mesh.mesh import Mesh
from softmark.solvers.mesh.shapes import Box

E, NU, RHO = 60e3, 0.45, 1070.0
LAW = Corotational(E / (2 * (1 + NU)), E * NU / ((1 + NU) * (1 - 2 * NU)))


@pytest.fixture(scope="module")
def mesh() -> Mesh:
    return Box((0.12, 0.02, 0.02)).mesh("tet4", 0.02)


def tets(mesh: Mesh, kind: type = CorotationalTets) -> CorotationalTets:
    parts = integrate_cells(mesh)
    made: CorotationalTets = kind(mesh.cells, parts.dNdX, parts.w, LAW)
    return made


def beam(mesh: Mesh, name: str = "implicit_euler", energy: object = None, **options: object) -> Dynamics:
    """A soft bar, clamped at one end and let go under its weight: it bends by more than a right angle."""
    nodal = np.bincount(mesh.cells.ravel(), np.repeat(0.25 * RHO * mesh.volumes, 4))
    mass, weight = np.repeat(nodal, 3), np.zeros(mesh.points.size)
    weight[2::3] = -9.81 * nodal
    fixed = np.flatnonzero(np.repeat(mesh.points[:, 0] < mesh.points[:, 0].min() + 1e-9, 3))
    loads = options.pop("loads", [DeadForces(weight)])
    assembly = Assembly(mesh.points.size, fixed, [energy or tets(mesh)], loads)  # type: ignore[list-item, arg-type]
    start = {"rest": np.zeros(mesh.points.size), "velocity": np.zeros(mesh.points.size)}
    known = {**start, "fixed": fixed, "integrator": INTEGRATORS[name](), **options}
    return Dynamics(assembly, mass, **known)  # type: ignore[arg-type]


def states(path: Trajectory) -> np.ndarray:
    return np.array([motion.x for motion in path.observed])


def agree(path: Trajectory, judge: Trajectory, tolerance: float) -> None:
    np.testing.assert_array_equal(path.times, judge.times)
    size = np.abs(states(judge)).max()
    np.testing.assert_allclose(states(path), states(judge), rtol=0, atol=tolerance * size)


# ------------------------------------------------------------------ it is Newton's trajectory

IMPLICIT = sorted(name for name, cls in INTEGRATORS.items() if not cls.explicit)


@pytest.mark.parametrize("name", IMPLICIT)
def test_trajectories_are_those_of_newton(name: str, mesh: Mesh) -> None:
    """Both leave 1e-8 of the forces in each of 50 steps; a force error of that size moves the bar by 1e-8, summed."""
    problem = beam(mesh, name, tolerance=1e-8)
    path, judge = march(problem, 0.5, 0.01), march(replace(problem, lagged=False), 0.5, 0.01)
    agree(path, judge, 1e-6)
    assert np.mean(path.lagged) > 0.9
    assert not judge.lagged.any()
    assert judge.fallbacks == 0
    for one in (path, judge):
        assert one.solved.all()
        assert one.residuals.max() <= 1e-8
    np.testing.assert_allclose(path.energies["strain"], judge.energies["strain"], rtol=1e-4, atol=1e-10)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["implicit_euler", "generalized_alpha", "midpoint"])
def test_with_damping_moving_supports_and_courses_of_loads(
    name: str, mesh: Mesh, sampled: Callable[..., Amplitude]
) -> None:
    """As above, for every term that an equation of a step may have."""
    problem = beam(mesh, name, tolerance=1e-8)
    problem = replace(
        problem,
        damping=Rayleigh(0.5, 1e-3),
        target=np.tile([0.0, 0.01, 0.0], len(problem.fixed) // 3),
        support_amplitude=sampled(lambda t: float(np.sin(20.0 * t))),
        amplitudes=(sampled(lambda t: 1.0 - 0.5 * float(np.cos(9.0 * t))),),
    )
    path, judge = march(problem, 0.3, 0.01), march(replace(problem, lagged=False), 0.3, 0.01)
    agree(path, judge, 1e-6)
    assert np.mean(path.lagged) > 0.8


def test_a_consistent_mass_and_a_last_step_that_is_shorter(mesh: Mesh) -> None:
    from softmark.solvers.dynamics.mass_matrices import consistent_mass, mass_shapes_and_volumes
    from softmark.solvers.elements.tet4 import Tet4

    N, w = mass_shapes_and_volumes(mesh.points, mesh.cells, Tet4)
    problem = replace(beam(mesh, "bdf2"), mass=consistent_mass(mesh.cells, N, w, RHO))
    path, judge = march(problem, 0.143, 0.01), march(replace(problem, lagged=False), 0.143, 0.01)
    agree(path, judge, 1e-6)
    assert path.steps[-1] == pytest.approx(0.003)
    assert path.lagged.all()


# ------------------------------------------------------------------ what is left to Newton's method


@dataclass(frozen=True)
class Wrong(CorotationalTets):
    """Offers lagged tangents that are of no use from some call on: indefinite ones, or far too stiff."""

    factor: float = -1.0
    after: int = 0
    calls: list[int] = field(default_factory=list)

    def add_both_lagged(
        self, x: np.ndarray, g: np.ndarray, data: np.ndarray, slots: np.ndarray, traces: np.ndarray
    ) -> None:
        self.calls.append(1)
        before = data.copy()
        super().add_both_lagged(x, g, data, slots, traces)
        if len(self.calls) > self.after:
            data[:] = before + self.factor * (data - before)


@pytest.mark.parametrize("factor", [-50.0, 1e4, np.nan])
def test_a_step_that_does_not_converge_is_taken_by_newton(factor: float, mesh: Mesh) -> None:
    """Indefinite, too stiff to converge, or not a number: no step is halved for it, and each attempt is counted."""
    parts = integrate_cells(mesh)
    energy = Wrong(mesh.cells, parts.dNdX, parts.w, LAW, factor=factor, after=5)
    path = march(beam(mesh, energy=energy), 0.2, 0.01)
    judge = march(beam(mesh, lagged=False), 0.2, 0.01)
    agree(path, judge, 1e-6)
    assert path.solved.all()
    assert not path.events
    assert path.fallbacks >= 1
    assert path.lagged[:5].all()
    assert not path.lagged[5:].any()
    assert path.fallbacks < 8  # attempts grow rare while they fail: after 1, 2, 4 ... steps


def test_an_unsound_state_is_left_to_newton_and_then_halved(mesh: Mesh) -> None:
    """What is refused once, in the third step, is asked of Newton's method before the step is halved."""
    asked: list[int] = []

    def sound(x: np.ndarray) -> bool:
        asked.append(1)
        return len(asked) not in (4, 7, 8)  # the start is judged first

    path = march(beam(mesh, sound=sound), 0.06, 0.01)
    assert list(path.lagged[:3]) == [True, True, False]
    assert path.fallbacks == 2
    assert len(path.events) <= 1
    assert path.complete


def test_what_does_not_suit_goes_by_newton(mesh: Mesh) -> None:
    """Other energies, follower loads, explicit integrators, a scene that says so."""
    parts = integrate_cells(mesh)
    general = Elastic(mesh.cells, parts.dNdX, parts.w, LAW)
    follower = FollowerPressure(mesh.points, mesh.facets, 1.0)
    for problem in (
        beam(mesh, energy=general),
        beam(mesh, loads=[follower]),
        beam(mesh, lagged=False),
        replace(beam(mesh), integrator=CentralDifferences()),
    ):
        assert DynamicSystem(problem, 0.01).lagged is None
    assert DynamicSystem(beam(mesh), 0.01).lagged is not None


# ------------------------------------------------------------------ capped steps


def test_one_newton_iteration_is_the_linearly_implicit_step(mesh: Mesh) -> None:
    """(M/h^2 + K) (x1 - x0) = M v0/h - f(x0), Baraff and Witkin (1998), equation 6; by another solver, to 1e-9.

    The second step starts from a state under load and speed.
    """
    problem, h = beam(mesh, lagged=False, cap=1), 0.01
    path = march(problem, 2 * h, h)
    first, second = path.observed[1], path.observed[2]
    system = DynamicSystem(problem, h)
    K = system.forces.tangent(first.x, system.forces.factors(h))
    mass, free = problem.mass, system.forces.free
    r = mass * first.v / h - system.forces.at(first.x, system.forces.factors(h)).total  # type: ignore[operator]
    d = np.linalg.solve(K.toarray() + np.diag(mass[free]) / h**2, r[free])  # type: ignore[index]
    np.testing.assert_allclose((second.x - first.x)[free], d, rtol=0, atol=1e-9 * np.abs(d).max())
    assert not path.solved.any()
    assert path.residuals.min() > 1e-3
    np.testing.assert_array_equal(path.iterations, [1, 1])


@pytest.mark.parametrize("lagged", [True, False])
def test_a_cap_is_kept_and_told(lagged: bool, mesh: Mesh) -> None:
    """What is not solved says so; residuals are those of the tolerance where it is; two iterations leave less."""
    left = []
    for cap in (1, 2):
        path = march(beam(mesh, lagged=lagged, cap=cap), 0.3, 0.01)
        assert path.complete
        assert path.iterations.max() <= cap
        assert not path.solved.all()
        np.testing.assert_array_equal(path.solved, path.residuals <= 1e-8)
        left.append(np.median(path.residuals))
    assert left[1] < left[0]
    with pytest.raises(ValueError, match="iteration limit must be at least one"):
        beam(mesh, cap=0)


def test_explicit_steps_leave_no_residual(mesh: Mesh) -> None:
    path = march(replace(beam(mesh), integrator=CentralDifferences()), 2e-4, 1e-4)
    assert path.solved.all()
    np.testing.assert_array_equal(path.residuals, 0.0)


# ------------------------------------------------------------------ its parts


def test_the_extrapolation_is_exact_for_polynomials() -> None:
    """Of degree four, with five states known and a sixth that shows it; round-off of differences of size 5^4."""
    states = BackwardDifferences(5, 2)
    x = [np.array([t**4 - t, 2.0 * t]) for t in range(8)]
    assert states.next(1.0) is None
    for t in range(7):
        states.add(x[t], float(t))
    found = states.next(1.0)
    assert found is not None
    np.testing.assert_allclose(found, x[7], rtol=1e-11)
    assert states.next(0.5) is None  # none at this distance


def test_a_change_of_the_step_begins_anew() -> None:
    """Two states at the new distance say nothing of the error of a line through them, three do."""
    states = BackwardDifferences(5, 1)
    for t in (0.0, 1.0, 2.0, 3.0, 3.5):
        states.add(np.array([t]), t)
    assert states.next(0.5) is None
    states.add(np.array([4.0]), 4.0)
    found = states.next(0.5)
    assert found is not None
    np.testing.assert_allclose(found, 4.5, rtol=1e-14)


def test_a_saw_is_not_extrapolated_by_high_orders() -> None:
    """Vibrations that change their sign each step: every higher order doubles the error, the lowest is taken."""
    states = BackwardDifferences(5, 1)
    for t in range(8):
        states.add(np.array([(-1.0) ** t]), float(t))
    np.testing.assert_allclose(states.next(1.0), -1.0)


def test_mixing_solves_a_linear_problem_of_two_unknowns() -> None:
    """Depth two: exact after three steps in two dimensions (Walker and Ni 2011, theorem 2.2), to rounding."""
    A, b = np.array([[1.0, 0.3], [-0.2, 0.6]]), np.array([1.0, 2.0])
    x, mixer = np.zeros(2), AndersonAcceleration()
    for _ in range(4):
        x = x + mixer.step(A @ x - b)
    np.testing.assert_allclose(A @ x, b, atol=1e-13)
    still = AndersonAcceleration()
    still.step(b)
    np.testing.assert_array_equal(still.step(b), -b)  # nothing has changed: a plain step
