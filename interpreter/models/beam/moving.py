"""A beam in motion: its unknowns turn, see solvers/dynamics/turning.py."""

from __future__ import annotations

from dataclasses import field
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.interpreter.language.scene import Declared
from softmark.interpreter.models.shared.motion import (
    PreparedMotion,
    course_of,
    integrator_of,
    must_be_followed,
    support_course,
    velocity,
)
from softmark.interpreter.problem.case import Case
from softmark.interpreter.vocabulary.loads import Routed
from softmark.records import dataclass
from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.dynamics.problem import Dynamics, Rayleigh
from softmark.solvers.dynamics.turning import Turning
from softmark.solvers.energies.energy import Energy, Floats
from softmark.solvers.energies.rod import RodLoad
from softmark.solvers.energies.rod_rotation import rotation
from softmark.solvers.energies.rod_state import displacement_at
from softmark.solvers.energies.turning.rods import DeadRodLoad, RodChart, TurnedLoad, TurningRod
from softmark.solvers.linear.chains import ChainSolver

if TYPE_CHECKING:
    from collections.abc import Sequence

    from softmark.interpreter.models.shared.prepared import Prepared
    from softmark.solvers.dynamics.resolution import Resolution
    from softmark.solvers.dynamics.scheme import Motion
    from softmark.solvers.energies.rod import RodElastic
    from softmark.solvers.mesh.mesh import Mesh
    from softmark.solvers.statics.problem import Statics


@dataclass(frozen=True)
class MovingBeam(PreparedMotion):
    """A rod in motion; its states are kept as positions and quaternions (nodes * 7,)."""

    mesh: Mesh | None = None
    rest: Floats = field(default_factory=lambda: np.zeros(0))

    @property
    def _chart(self) -> RodChart:
        assert self.problem.turning is not None
        chart = self.problem.turning.chart
        assert isinstance(chart, RodChart)
        return chart

    def _state(self, motion: Motion) -> Floats:
        return self._chart.state(motion.x)

    def _resolution(self) -> Resolution | None:
        self._chart.reset()  # it is asked for at rest
        return super()._resolution()

    def _shown(self, times: Floats, states: Floats) -> dict[str, Any]:
        """How points around the axis move, and where they end: there is no mesh to show."""
        rest = self.rest

        def course(X: Floats) -> Floats:
            return np.array([displacement_at(x, rest, X) for x in states])

        return {"course": course, "displacement": lambda X: displacement_at(states[-1], rest, X)}

    def _mesh_facts(self) -> dict[str, Any]:
        return {}


def moving(
    static: Prepared, declared: Declared, case: Case, elastic: RodElastic, problem: Statics, mass: Floats,
    applied: Sequence[tuple[Declared, Energy]],
) -> MovingBeam:  # fmt: skip
    """A beam with its mass at the nodes (6 n,), kg and kg m^2, and each load by itself; `problem` is that at rest."""
    analysis: Any = case.analysis
    must_be_followed(case, analysis)
    chart, count = RodChart(elastic.rest), len(static.points)
    own = mass.reshape(-1, 6)
    start = np.zeros((count, 6))
    start[:, :3] = velocity(analysis, static.points, np.repeat(own[:, 0], 3)).reshape(-1, 3)
    start[:, 3:] = np.array(analysis.spin) @ rotation(elastic.rest.reshape(-1, 7)[:, 3:])  # about the nodes' own axes
    loads = [_in_motion(load, energy, chart) for load, energy in applied]
    where = 6 * np.arange(count)[:, None] + np.arange(3, 6)
    dynamics = Dynamics(
        Assembly(6 * count, problem.fixed, [TurningRod(chart, elastic)], loads),
        mass,
        np.zeros(6 * count),
        start.ravel(),
        problem.fixed,
        problem.target,
        support_course(case),
        tuple(course_of(load) for load, _ in applied),
        Rayleigh(analysis.damping_mass, analysis.damping_stiffness),
        integrator_of(analysis),
        analysis.tolerance,
        analysis.max_iterations,
        linear=ChainSolver(),
        lagged=False,
        turning=Turning(chart, where, np.ascontiguousarray(own[:, 3:])),
    )
    return MovingBeam(static, declared, analysis, dynamics, rest=elastic.rest)


def _in_motion(load: Declared, energy: Energy, chart: RodChart) -> Energy:
    """A load of the rod at rest."""
    if isinstance(energy, RodLoad):
        return DeadRodLoad(energy.forces)
    if isinstance(load.thing.action, Routed):
        from softmark.interpreter.models.beam.tendons import in_motion

        return in_motion(energy, chart)
    return TurnedLoad(chart, energy)
