"""A network in motion: its points turn, and the nodes of its members with them (solvers/dynamics/turning.py)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.interpreter.language.scene import Declared
from softmark.interpreter.models.beam.moving import MovingBeam
from softmark.interpreter.models.network.layout import Layout
from softmark.interpreter.models.network.shifts import Shifts
from softmark.interpreter.models.shared.motion import (
    course_of,
    integrator_of,
    must_be_followed,
    support_course,
    velocity,
)
from softmark.interpreter.problem.case import Case
from softmark.records import dataclass
from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.dynamics.problem import Dynamics, Rayleigh
from softmark.solvers.dynamics.turning import Turning
from softmark.solvers.energies.energy import Energy, Floats
from softmark.solvers.energies.rod import RodElastic, RodLoad
from softmark.solvers.energies.turning.joints import JointChart, JointedInMotion
from softmark.solvers.energies.turning.rods import DeadRodLoad, TurningRod
from softmark.solvers.linear.chains import ChainSolver

if TYPE_CHECKING:
    from collections.abc import Sequence

    from softmark.interpreter.models.shared.prepared import Prepared
    from softmark.solvers.statics.problem import Statics


@dataclass(frozen=True)
class MovingNetwork(MovingBeam):
    """A network in motion; its states are kept as positions and quaternions of all nodes (nodes * 7,)."""

    layout: Layout | None = None

    @property
    def _chart(self) -> Any:
        assert self.problem.turning is not None
        return self.problem.turning.chart

    def _shown(self, times: Floats, states: Floats) -> dict[str, Any]:
        """How points of members move, and where they end."""
        assert self.layout is not None
        shifts = [Shifts(self.layout, x) for x in states]

        def course(X: Floats) -> Floats:
            return np.array([shift(X) for shift in shifts])

        return {"course": course, "displacement": shifts[-1]}


def moving(
    static: Prepared, declared: Declared, case: Case, layout: Layout, elastic: RodElastic, problem: Statics,
    applied: Sequence[tuple[Declared, Energy]],
) -> MovingNetwork:  # fmt: skip
    """A network with its mass at the points; `applied` are loads on its nodes, and `problem` is that at rest."""
    analysis: Any = case.analysis
    must_be_followed(case, analysis)
    chart, count = JointChart(layout.rest, layout.joints), layout.count
    own = layout.mass().reshape(-1, 6)
    start = np.zeros((count, 6))
    start[:, :3] = velocity(analysis, layout.X, np.repeat(own[:, 0], 3)).reshape(-1, 3)
    start[:, 3:] = np.array(analysis.spin) @ layout.axes  # about the axes of the points
    loads = [DeadRodLoad(_at_points(layout, energy)) for _, energy in applied]
    where = 6 * np.arange(count)[:, None] + np.arange(3, 6)
    dynamics = Dynamics(
        Assembly(6 * count, problem.fixed, [JointedInMotion(TurningRod(chart.nodes, elastic), layout.joints)], loads),
        own.ravel(),
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
    return MovingNetwork(static, declared, analysis, dynamics, rest=layout.rest, layout=layout)


def _at_points(layout: Layout, energy: Energy) -> Floats:
    """Of dead forces on nodes those at the points (p, 3), N."""
    assert isinstance(energy, RodLoad)  # what turns sections in motion is refused
    found = np.zeros((layout.count, 3))
    np.add.at(found, layout.point, energy.forces)
    return found
