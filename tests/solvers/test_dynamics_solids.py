"""Dynamics of solids: vibrations, waves and free flight against closed forms, on small meshes of tetrahedra."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from momenta import angular_momentum, linear_momentum
from scipy.linalg import eigh, expm
from scipy.optimize import brentq
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import eigsh, spsolve

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.dynamics import INTEGRATORS, Integrator
from softmark.solvers.dynamics.central_differences import CentralDifferences
from softmark.solvers.dynamics.dynamic_problem import Dynamics
from softmark.solvers.dynamics.implicit_euler import ImplicitEuler
from softmark.solvers.dynamics.integrator import StepTooLong
from softmark.solvers.dynamics.load_amplitudes import Amplitude
from softmark.solvers.dynamics.mass_matrices import consistent_mass, lumped_mass, mass_shapes_and_volumes
from softmark.solvers.dynamics.time_integration import march
from softmark.solvers.dynamics.trajectory import Trajectory
from softmark.solvers.dynamics.trapezoidal_rule import Trapezoidal
from softmark.solvers.elements import ELEMENTS
from softmark.solvers.elements.tet4 import Tet4
from softmark.solvers.energies.elastic_energy import Elastic
from softmark.solvers.energies.energy import Energy
from softmark.solvers.energies.external_loads import DeadForces, FollowerPressure
from softmark.solvers.materials import Law
from softmark.solvers.mesh.mesh import Mesh
from softmark.solvers.mesh.shapes import Box

Maker = Callable[..., Law]
Energies = Callable[[Mesh, Law], Elastic]
NONE = np.zeros(0, dtype=np.int64)


def masses(mesh: Mesh, density: float) -> tuple[csr_matrix, np.ndarray]:
    """Consistent and lumped."""
    N, w = mass_shapes_and_volumes(mesh.points, mesh.cells, Tet4)
    return consistent_mass(mesh.cells, N, w, density), lumped_mass(mesh.cells, N, w, density)


def body(
    mesh: Mesh, energy: Elastic, density: float, integrator: Integrator,
    held: np.ndarray = NONE, loads: tuple[Energy, ...] = (), **options: object,
) -> Dynamics:  # fmt: skip
    """At rest and undeformed, with the mass that the integrator wants; `held` nodes."""
    fixed = (3 * held[:, None] + np.arange(3)).ravel()
    mass = masses(mesh, density)[1 if integrator.explicit else 0]
    at_rest = {"rest": np.zeros(mesh.points.size), "velocity": np.zeros(mesh.points.size)}
    assembly = Assembly(mesh.points.size, fixed, [energy], list(loads))
    return Dynamics(assembly, mass, **{**at_rest, **options}, fixed=fixed, integrator=integrator)  # type: ignore[arg-type]


def wall(mesh: Mesh) -> np.ndarray:
    return np.flatnonzero(mesh.points[:, 0] < 1e-9)


def states(path: Trajectory) -> np.ndarray:
    return np.array([motion.x for motion in path.observed])


# ------------------------------------------------------------------ mass


def test_mass_of_one_tetrahedron() -> None:
    """m/20 (1 + delta_ab) consistent and m/4 lumped (Zienkiewicz, Taylor and Zhu 2013, section 12.2). Round-off."""
    points = np.array([[0.0, 0, 0], [2, 0, 0], [0, 1, 0], [0, 0, 3]])
    mesh = Mesh(points, np.array([[0, 1, 2, 3]]))  # of volume 1
    consistent, lumped = masses(mesh, 20.0)
    np.testing.assert_allclose(consistent.toarray(), np.kron(np.ones((4, 4)) + np.eye(4), np.eye(3)), atol=1e-13)
    np.testing.assert_allclose(lumped, 5.0, rtol=1e-13)


@pytest.mark.parametrize("kind", sorted(ELEMENTS))
def test_momenta_of_rigid_motion(kind: str) -> None:
    """Spin w about the centre of a box a x b x c: L = m (a^2 + b^2) w / 12, exact with a consistent mass. Round-off.

    A lumped mass is positive and has the whole mass, whatever the element.
    """
    mesh = Box((3.0, 2.0, 1.0)).mesh(kind, 1.0)
    y = mesh.points - 0.5 * (mesh.points.min(axis=0) + mesh.points.max(axis=0))
    N, w = mass_shapes_and_volumes(mesh.points, mesh.cells, ELEMENTS[kind])
    consistent, lumped = consistent_mass(mesh.cells, N, w, 5.0), lumped_mass(mesh.cells, N, w, 5.0)
    turning = np.cross([0.0, 0.0, 0.7], y)
    v = (np.array([1.0, 0.0, 0.0]) + turning).ravel()
    np.testing.assert_allclose(linear_momentum(consistent, v), [30.0, 0, 0], atol=1e-11)
    spin = angular_momentum(consistent, y, turning.ravel())
    np.testing.assert_allclose(spin, [0.0, 0.0, 30.0 * 13 / 12 * 0.7], atol=1e-11)
    assert lumped.min() > 0
    assert lumped.sum() == pytest.approx(3 * 30.0, rel=1e-12)


# ------------------------------------------------------------------ vibrations


# amplification and period ratio at w h = 0.2 (REFERENCES 3.10)
AT_A_FIFTH = {
    "implicit_euler": (0.980581, 1.013194), "trapezoidal": (1.0, 1.0033245), "newmark": (1.0, 1.0033245),
    "midpoint": (1.0, 1.0033245), "central_differences": (1.0, 0.9983286), "bdf2": (0.9996363, 1.012835),
    "generalized_alpha": (0.99999892, 1.003509),
}  # fmt: skip


@pytest.mark.parametrize("name", sorted(AT_A_FIFTH))
def test_every_mode_of_a_solid_moves_as_one_oscillator(name: str, law: Maker, elastic: Energies) -> None:
    """All modes of a clamped block start at once; the one with w h = 0.2 has the roots of the table, to 1e-6.

    The leapfrog takes the fastest mode, since the others would make it unstable.
    """
    mesh = Box((2.0, 1.0, 1.0)).mesh("tet4", 0.5)
    problem = body(mesh, elastic(mesh, law("small")), 1.0, INTEGRATORS[name](), wall(mesh))
    free = problem.assembly.free
    K = problem.assembly.tangent(problem.rest, 1.0).toarray()
    M = np.diag(problem.mass[free]) if problem.mass.ndim == 1 else problem.mass.toarray()[np.ix_(free, free)]
    squares, modes = eigh(K, M)  # modes^T M modes = 1
    k = -1 if name == "central_differences" else 0
    h = 0.2 / np.sqrt(squares[k])
    rng = np.random.default_rng(3)
    x, v = np.zeros_like(problem.rest), np.zeros_like(problem.rest)
    x[free] = 1e-3 * modes @ rng.standard_normal(len(free))
    v[free] = 1e-3 * modes @ rng.standard_normal(len(free)) * np.sqrt(squares[k])
    path = march(replace(problem, rest=x, velocity=v, tolerance=1e-13), 100 * h, h)
    q = (states(path)[-40:, free] @ M @ modes)[:, k]
    p, s = np.linalg.lstsq(np.stack([q[1:-1], q[:-2]], axis=1), q[2:], rcond=None)[0]
    amplification, period = AT_A_FIFTH[name]
    assert np.sqrt(-s) == pytest.approx(amplification, abs=1e-6)
    assert 0.2 / np.arccos(p / 2 / np.sqrt(-s)) == pytest.approx(period, abs=1e-6)


def timoshenko(E: float, G: float, shear: float, A: float, I: float, density: float, L: float) -> float:
    """The lowest frequency of a cantilever, Hz: the zero of the transfer matrix's determinant.

    (w, phi, M, Q)' = B (w, phi, M, Q), clamped at 0, free at L (Timoshenko 1921).
    """

    def determinant(f: float) -> float:
        w2 = (2 * np.pi * f) ** 2
        B = np.array([
            [0, 1, 0, 1 / (shear * G * A)], [0, 0, 1 / (E * I), 0],
            [0, -density * I * w2, 0, -1], [-density * A * w2, 0, 0, 0],
        ])  # fmt: skip
        return float(np.linalg.det(expm(B * L)[2:, 2:]))

    bernoulli = 1.875104**2 / (2 * np.pi * L**2) * np.sqrt(E * I / (density * A))
    return float(brentq(determinant, 0.5 * bernoulli, 1.1 * bernoulli))


def test_timoshenko_frequency_of_the_seed_cylinder() -> None:
    """1.2223 Hz (REFERENCES 3.10), five digits: the judge of the next test is judged."""
    R = 0.019
    found = timoshenko(60e3, 60e3 / 2.98, 0.8994, np.pi * R**2, np.pi * R**4 / 4, 1070, 0.178)
    assert found == pytest.approx(1.2223, abs=5e-5)


@pytest.mark.slow
@pytest.mark.long
def test_frequency_of_a_cantilever(law: Maker, elastic: Energies) -> None:
    """A swinging beam of 1 x 0.2 x 0.2 m, 0.9908 Hz by Timoshenko's theory.

    Linear tetrahedra are too stiff in bending, by 24 % in frequency on the coarse mesh and 7 % on the fine one; the
    error falls with h^2, and what is left after Richardson's extrapolation, 2 %, is of the next order. The march
    must show the frequency of its own mesh, here the coarse one, to 1e-3: (wh)^2/12 = 1e-4 and the crossing of zero.
    """
    theory = timoshenko(1e6, 1e6 / 2.6, 5 / 6, 0.04, 0.2**4 / 12, 1000, 1.0)
    found = []
    for size in (0.1, 0.05):
        mesh = Box((1.0, 0.2, 0.2)).mesh("tet4", size)
        problem = body(mesh, elastic(mesh, law("small", 1e6, 0.3)), 1000, Trapezoidal(), wall(mesh))
        free = problem.assembly.free
        K, M = problem.assembly.tangent(problem.rest, 1.0), problem.mass[free][:, free]
        square, mode = eigsh(K, k=1, M=M, sigma=0, v0=np.ones(len(free)))
        found.append(float(np.sqrt(square[0])) / (2 * np.pi))
        if size == 0.1:
            x = np.zeros_like(problem.rest)
            x[free] = 1e-3 * mode[:, 0]
            T = 1 / found[0]
            q = states(march(replace(problem, rest=x), 0.8 * T, T / 200))[:, free] @ (M @ mode[:, 0])
    assert (4 * found[1] - found[0]) / 3 == pytest.approx(theory, rel=0.025)
    down, up = (np.flatnonzero(np.diff(np.sign(q)) == s)[0] for s in (-2, 2))
    crossing = [n + q[n] / (q[n] - q[n + 1]) for n in (down, up)]
    assert (crossing[1] - crossing[0]) / 200 == pytest.approx(0.5, rel=1e-3)


L, SIDE, P, E, RHO = 1.0, 0.1, 1.0, 1000.0, 10.0
PERIOD = 4 * L / np.sqrt(E / RHO)


@pytest.mark.parametrize("name", sorted(INTEGRATORS))
def test_step_load_on_a_clamped_bar(name: str, law: Maker, elastic: Energies) -> None:
    """Its end moves in a triangle 0 -> 2PL/EA -> 0 of period 4L/c (nu = 0; REFERENCES 3.10).

    20 cells along the bar round the corners off: 1 % of the peak in the mean square; backward Euler at 200
    steps per period damps the tenth part away.
    """
    mesh = Box((L, SIDE, SIDE)).mesh("tet4", 0.05)
    end = mesh.points[:, 0] > L - 1e-9
    corners = mesh.faces[np.all(end[mesh.faces], axis=1)]
    a, b, c = (mesh.points[corners[:, i]] for i in range(3))
    share = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    f = np.zeros_like(mesh.points)
    np.add.at(f[:, 0], corners, (P * share / share.sum() / 3)[:, None])
    load = DeadForces(f.ravel())
    problem = body(mesh, elastic(mesh, law("small", E, 0.0)), RHO, INTEGRATORS[name](), wall(mesh), (load,))
    path = march(problem, PERIOD, PERIOD / 200)
    u = states(path).reshape(len(path.times), -1, 3)[:, end, 0].mean(axis=1) / (2 * P * L / (E * SIDE**2))
    s = path.times / PERIOD
    triangle = np.minimum(2 * s, 2 - 2 * s)
    error = np.sqrt(np.mean((u - triangle) ** 2))
    assert error < (0.06 if name == "implicit_euler" else 0.01)
    assert u.max() == pytest.approx(1.0, abs=0.15 if name == "implicit_euler" else 0.03)
    assert np.all(path.iterations == (0 if name == "central_differences" else 1))


# ------------------------------------------------------------------ free flight


def spinning(name: str, law: Maker, elastic: Energies) -> tuple[Mesh, Dynamics]:
    """A soft free block that spins fast enough to stretch by some per cent, and drifts."""
    mesh = Box((1.0, 0.5, 0.5)).mesh("tet4", 0.25)
    y = mesh.points - mesh.points.mean(axis=0)
    v = np.array([0.5, 0.0, -0.2]) + np.cross([0.3, 0.2, 3.0], y)
    energy = elastic(mesh, law("neo_hookean", 500.0, 0.3))
    return mesh, body(mesh, energy, 1.0, INTEGRATORS[name](), velocity=v.ravel(), tolerance=1e-12)


@pytest.mark.parametrize("name", sorted(INTEGRATORS))
def test_momentum_of_a_free_spinning_block(name: str, law: Maker, elastic: Energies) -> None:
    """Linear momentum to round-off with all; angular with midpoint and leapfrog, and with none of the others.

    Backward Euler loses (wh)^2 = 9e-4 per step at w = 3, 4.5 % in 50 steps. Energy: within 1 % of the start for
    the rules without damping, falling all the time for backward Euler.
    """
    mesh, problem = spinning(name, law, elastic)
    h = 0.002 if name == "central_differences" else 0.01
    path = march(problem, 0.5, h)
    linear = np.array([linear_momentum(problem.mass, m.v) for m in path.observed])
    np.testing.assert_allclose(linear, np.broadcast_to(linear[0], linear.shape), atol=1e-11)
    y = [mesh.points + m.x.reshape(-1, 3) for m in path.observed]
    angular = np.array([angular_momentum(problem.mass, p, m.v) for p, m in zip(y, path.observed, strict=True)])
    off = np.abs(angular - angular[0]).max() / np.linalg.norm(angular[0])
    assert (off < 1e-10) == (name in ("midpoint", "central_differences"))
    assert off < (0.05 if name == "implicit_euler" else 2e-3)
    drift = path.energies["drift"] / path.energies["kinetic"][0]
    assert not path.events
    if name == "implicit_euler":
        assert np.all(np.diff(path.energies["drift"]) < 0)
    else:
        assert np.abs(drift).max() < 0.01


# ------------------------------------------------------------------ hard steps


def test_backward_euler_with_long_steps_comes_to_rest_in_equilibrium(law: Maker, elastic: Energies) -> None:
    """A soft beam let go under its weight, in steps of about two periods: after a while it hangs in equilibrium.

    Judged by the static residual: internal forces balance the weight to 1e-6 of it.
    """
    mesh = Box((1.0, 0.2, 0.2)).mesh("tet4", 0.1)
    energy = elastic(mesh, law("neo_hookean", 2e5, 0.3))
    weight = DeadForces((masses(mesh, 1000.0)[1].reshape(-1, 3) * [0.0, 0.0, -9.81]).ravel())
    problem = body(mesh, energy, 1000.0, ImplicitEuler(), wall(mesh), (weight,))
    path = march(problem, 60.0, 1.0)
    end = path.observed[-1]
    out = problem.assembly.gradient(end.x, 1.0)[problem.assembly.free]
    assert np.linalg.norm(out) < 1e-6 * np.linalg.norm(weight.f)
    tip = end.x.reshape(-1, 3)[mesh.points[:, 0] > 1 - 1e-9, 2].mean()
    assert tip < -0.3  # a large bend: the steps were hard
    assert np.all(np.isfinite(path.energies["strain"]))


def test_a_support_that_tears_through_the_body_halves_steps(
    law: Maker, elastic: Energies, sampled: Callable[..., Amplitude]
) -> None:
    """One end is driven by half the length in one step: cells cannot follow at once, the halved steps can."""
    mesh = Box((1.0, 0.5, 0.5)).mesh("tet4", 0.25)
    energy = elastic(mesh, law("neo_hookean", 1e3, 0.3))
    ends = np.flatnonzero((mesh.points[:, 0] < 1e-9) | (mesh.points[:, 0] > 1 - 1e-9))
    to = np.where(mesh.points[ends, :1] > 0.5, [[-0.5, 0.0, 0.0]], 0.0).ravel()
    problem = body(mesh, energy, 1.0, INTEGRATORS["bdf2"](), ends)
    problem = replace(problem, target=to, support_amplitude=sampled(lambda t: min(max(t / 0.02, 0.0), 1.0)))
    path = march(problem, 0.1, 0.02)
    assert path.complete
    assert np.linalg.det(energy.F(path.observed[-1].x)).min() > 0


def test_follower_pressure_has_its_own_tangent(
    law: Maker, elastic: Energies, sampled: Callable[..., Amplitude]
) -> None:
    """A rising pressure on one side of a beam that bends by it: quadratic convergence, no potential needed."""
    mesh = Box((1.0, 0.2, 0.2)).mesh("tet4", 0.1)
    top = np.all(mesh.points[mesh.faces][:, :, 2] > mesh.points[:, 2].max() - 1e-9, axis=1)
    pressure = FollowerPressure(mesh.points, mesh.faces[top], 1000.0)
    energy = elastic(mesh, law("neo_hookean", 1e6, 0.3))
    problem = body(
        mesh, energy, 1000.0, Trapezoidal(), wall(mesh), (pressure,), amplitudes=(sampled(lambda t: min(t, 1.0)),)
    )
    path = march(problem, 1.0, 0.05)
    assert path.complete
    assert path.iterations.max() <= 6
    assert np.abs(path.energies["drift"]).max() < 1e-3 * path.energies["load_work"].max()


def test_the_linear_solver_is_the_callers(law: Maker, elastic: Energies) -> None:
    """It sees one pattern all the way, and tolerances in (0, 1)."""

    @dataclass
    class Watching:
        patterns: set[bytes] = field(default_factory=set)
        tolerances: list[float] = field(default_factory=list)

        def solve(self, K: csr_matrix, b: np.ndarray, tolerance: float) -> np.ndarray:
            self.patterns.add(K.indptr.tobytes() + K.indices.tobytes())
            self.tolerances.append(tolerance)
            x: np.ndarray = spsolve(K.tocsc(), b)
            return x

    _, problem = spinning("trapezoidal", law, elastic)
    watching = Watching()
    path = march(replace(problem, linear=watching), 0.1, 0.02)
    assert len(watching.patterns) == 1
    assert len(watching.tolerances) == path.iterations.sum()
    assert all(0 < t < 1 for t in watching.tolerances)


def test_critical_step_of_a_solid(law: Maker, elastic: Energies) -> None:
    """2/w with w from a dense eigenvalue solver, to the accuracy of the Lanczos iteration, 1e-3."""
    mesh = Box((1.0, 0.5, 0.5)).mesh("tet4", 0.25)
    problem = body(mesh, elastic(mesh, law("small", 500.0)), 1.0, CentralDifferences(), wall(mesh))
    free = problem.assembly.free
    K = problem.assembly.tangent(problem.rest, 1.0).toarray()
    critical = 2 / np.sqrt(eigh(K, np.diag(problem.mass[free]), eigvals_only=True)[-1])
    with pytest.raises(StepTooLong) as refused:
        march(problem, 1.0, critical)
    assert refused.value.critical == pytest.approx(0.96 * critical, rel=1e-3)  # its safety
