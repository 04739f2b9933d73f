"""Beams in dynamic analyses, with rotations among the unknowns (solvers/dynamics/rotational_inertia.py)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.models.procedures.case_amplitudes import amplitude_of
from softmark.interpreter.models.procedures.dynamic_problem_setup import dynamic_problem_of, initial_velocities
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.vocabulary.loads.tendon import TendonLoad
from softmark.interpreter.vocabulary.loads.torque import MomentLoad as Torque
from softmark.solvers.assembly.assembly import Assembly
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
from softmark.solvers.linear.banded_lu import BandedLuSolver

if TYPE_CHECKING:
    from collections.abc import Sequence

    from softmark.solvers.dynamics.dynamic_problem import Dynamics
    from softmark.solvers.energies.geometrically_exact_rod import RodElastic
    from softmark.solvers.statics.static_problem import Statics


def beam_dynamics(
    case: Case, elastic: RodElastic, static: Statics, mass: Floats, applied: Sequence[tuple[Declared, Energy]]
) -> Dynamics:
    """Return the dynamic problem of a beam from its static problem, its mass and its loads. Raises Fault.

    `mass` (6 n,), kg and kg m^2, is that of the nodes; `applied` has each load separately.
    """
    chart, rest = RodChart(elastic.rest), elastic.rest.reshape(-1, 7)
    loads = [(load, _load_on_rotational_unknowns(load, energy, chart)) for load, energy in applied]
    return rod_dynamics(case, static, chart, MovingRod(chart, elastic), loads, rest[:, :3], rotation(rest[:, 3:]), mass)


def rod_dynamics(
    case: Case,
    static: Statics,
    chart: RotationChart,
    rods: Energy,
    loads: Sequence[tuple[Declared, Energy]],
    X: Floats,
    axes: Floats,
    mass: Floats,
) -> Dynamics:
    """Return the dynamic problem of `rods`, with rotations as unknowns (`chart`). Raises Fault.

    Nodes at X (n, 3), m, rotate about the columns of `axes` (n, 3, 3). `mass` (6 n,) are their masses and moments
    of inertia, kg and kg m^2. `static` is the static problem.
    """
    analysis: Any = case.analysis
    count, own = len(X), mass.reshape(-1, 6)
    start = np.zeros((count, 6))
    start[:, :3] = initial_velocities(analysis, X, np.repeat(own[:, 0], 3)).reshape(-1, 3)
    start[:, 3:] = np.array(analysis.spin) @ axes
    where = 6 * np.arange(count)[:, None] + np.arange(3, 6)
    return dynamic_problem_of(
        case,
        Assembly(6 * count, static.fixed, [rods], [energy for _, energy in loads]),
        mass,
        start.ravel(),
        static,
        tuple(amplitude_of(load) for load, _ in loads),
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
