"""Beams in dynamic analyses, with rotations among the unknowns (solvers/dynamics/rotational_inertia.py)."""

from __future__ import annotations

from dataclasses import field
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.models.shared.solid_dynamics import (
    PreparedMotion,
    amplitude_of,
    check_amplitudes,
    initial_velocities,
    integrator_of,
    support_amplitude,
)
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.vocabulary.loads.tendon import TendonLoad
from softmark.interpreter.vocabulary.loads.torque import MomentLoad as Torque
from softmark.records import dataclass
from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.dynamics.dynamic_problem import Dynamics, Rayleigh
from softmark.solvers.dynamics.rotational_inertia import RotationalInertia, RotationChart
from softmark.solvers.energies.energy import Energy, Floats
from softmark.solvers.energies.geometrically_exact_rod import RodForces
from softmark.solvers.energies.incremental_rotation.moving_rods import (
    MovingRod,
    MovingRodForces,
    MovingRodLoad,
    RodChart,
)
from softmark.solvers.energies.rod_rotation import rotation
from softmark.solvers.energies.rod_state import displacement_at
from softmark.solvers.linear.banded_lu import BandedLuSolver

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from softmark.interpreter.models.shared.prepared_model import Prepared
    from softmark.solvers.dynamics.integrator import Motion
    from softmark.solvers.dynamics.time_step_error import StepError
    from softmark.solvers.dynamics.time_step_resolution import Resolution
    from softmark.solvers.energies.geometrically_exact_rod import RodElastic
    from softmark.solvers.mesh.mesh import Mesh
    from softmark.solvers.statics.static_problem import Statics

NUDGE = 1e-6  # rad and m: a motion so small that it is linear in double precision


@dataclass(frozen=True)
class MovingBeam(PreparedMotion):
    """Dynamic analysis of a rod; states are stored as positions and quaternions (nodes * 7,)."""

    mesh: Mesh | None = None
    rest: Floats = field(default_factory=lambda: np.zeros(0))

    @property
    def _turning(self) -> RotationalInertia:
        """Rotational inertia of the sections in the dynamic problem."""
        assert self.problem.turning is not None
        return self.problem.turning

    def _state(self, motion: Motion) -> Floats:
        """Return positions and quaternions of the nodes (nodes * 7,)."""
        return self._turning.chart.state(motion.x)

    def _resolution(self) -> Resolution | None:
        """Return how well the time step resolves the slowest vibration."""
        self._turning.reset()  # frequencies are those about rest
        return super()._resolution()

    def _step_error(self) -> StepError | None:
        """Return the time-step error of small vibrations, as a sum over vibration modes; None if it is unknown."""
        self._turning.reset()
        return super()._step_error()

    def _mode_field(self, shape: Floats) -> Callable[[Floats], Floats]:
        """Return the displacement field of a vibration mode `shape` (dofs,).

        It is computed by a finite difference, because points of a section rotate with it.
        """
        size = float(np.abs(shape).max(initial=0.0)) or 1.0
        self._turning.reset()
        small = NUDGE / size
        shift = self._displacement_field(self._turning.chart.state(small * shape))
        return lambda X: np.asarray(shift(X)) / small

    def _displacement_field(self, x: Floats) -> Callable[[Floats], Floats]:
        """Return the displacement field, a function of points (n, 3), m, of a state x (nodes * 7,)."""
        rest = self.rest
        return lambda X: displacement_at(x, rest, X)

    def _solution_fields(self, times: Floats, states: Floats) -> dict[str, Any]:
        """Return the solution fields `course` and `displacement` (at the end); beams have no mesh."""
        shifts = [self._displacement_field(x) for x in states]

        def course(X: Floats) -> Floats:
            """Return displacements (t, n, 3), m, of material points X (n, 3), m."""
            return np.array([shift(X) for shift in shifts])

        return {"course": course, "displacement": shifts[-1]}

    def _mesh_facts(self) -> dict[str, Any]:
        """Return an empty report of the mesh, because beams have none."""
        return {}


def build_beam_dynamics(
    static: Prepared, declared: Declared, case: Case, elastic: RodElastic, problem: Statics, mass: Floats,
    applied: Sequence[tuple[Declared, Energy]],
) -> MovingBeam:  # fmt: skip
    """Return the dynamic analysis of a beam from its static `problem`, its mass and its loads.

    `mass` (6 n,), kg and kg m^2, is that of the nodes; `applied` has each load separately.
    """
    chart = RodChart(elastic.rest)
    loads = [(load, _load_on_rotational_unknowns(load, energy, chart)) for load, energy in applied]
    axes = rotation(elastic.rest.reshape(-1, 7)[:, 3:])
    found = dynamics(case, problem, chart, MovingRod(chart, elastic), loads, static.points, axes, mass)
    analysis: Any = case.analysis
    return MovingBeam(static, declared, analysis, found, rest=elastic.rest)


def dynamics(
    case: Case,
    problem: Statics,
    chart: RotationChart,
    rods: Energy,
    loads: Sequence[tuple[Declared, Energy]],
    X: Floats,
    axes: Floats,
    mass: Floats,
) -> Dynamics:
    """Return the dynamic problem of `rods`, with rotations as unknowns (`chart`). Raises Fault.

    Nodes at X (n, 3), m, rotate about the columns of `axes` (n, 3, 3). `mass` (6 n,) are their masses and moments
    of inertia, kg and kg m^2. `problem` is the static problem.
    """
    analysis: Any = case.analysis
    check_amplitudes(case, analysis)
    count, own = len(X), mass.reshape(-1, 6)
    start = np.zeros((count, 6))
    start[:, :3] = initial_velocities(analysis, X, np.repeat(own[:, 0], 3)).reshape(-1, 3)
    start[:, 3:] = np.array(analysis.spin) @ axes
    where = 6 * np.arange(count)[:, None] + np.arange(3, 6)
    return Dynamics(
        Assembly(6 * count, problem.fixed, [rods], [energy for _, energy in loads]),
        mass,
        np.zeros(6 * count),
        start.ravel(),
        problem.fixed,
        problem.target,
        support_amplitude(case),
        tuple(amplitude_of(load) for load, _ in loads),
        Rayleigh(analysis.damping_mass, analysis.damping_stiffness),
        integrator_of(analysis),
        analysis.tolerance,
        analysis.max_iterations,
        linear=BandedLuSolver(),
        lagged=False,
        turning=RotationalInertia(chart, where, np.ascontiguousarray(own[:, 3:])),
    )


def _load_on_rotational_unknowns(load: Declared, energy: Energy, chart: RodChart) -> Energy:
    """Return a load of the static rod as a load in terms of rotational unknowns."""
    if isinstance(energy, RodForces):
        return MovingRodForces(energy.forces)
    if isinstance(load.thing.action, TendonLoad):
        from softmark.interpreter.models.beam.beam_tendons import tendon_in_rotational_unknowns

        return tendon_in_rotational_unknowns(energy, chart)
    if isinstance(load.thing.action, Torque):
        from softmark.solvers.energies.incremental_rotation.moving_rod_loads import MovingRodMoments
        from softmark.solvers.energies.rod_loads import RodMoments

        assert isinstance(energy, RodMoments)
        return MovingRodMoments(chart, energy)
    return MovingRodLoad(chart, energy)
