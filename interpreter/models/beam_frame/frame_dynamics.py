"""Frames in dynamic analyses; nodes of members rotate with the points (solvers/dynamics/rotational_inertia.py)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.models.beam.beam_dynamics import MovingBeam, dynamics
from softmark.interpreter.models.beam_frame.frame_displacements import FrameDisplacementField
from softmark.interpreter.models.beam_frame.frame_layout import Layout
from softmark.interpreter.problem.body_case import Case
from softmark.records import dataclass
from softmark.solvers.energies.energy import Energy, Floats
from softmark.solvers.energies.geometrically_exact_rod import RodElastic, RodForces
from softmark.solvers.energies.incremental_rotation.moving_rod_joints import JointChart, MovingJointedRods
from softmark.solvers.energies.incremental_rotation.moving_rods import MovingRod, MovingRodForces

if TYPE_CHECKING:
    from collections.abc import Sequence

    from softmark.interpreter.models.shared.prepared_model import Prepared
    from softmark.solvers.statics.static_problem import Statics


@dataclass(frozen=True)
class MovingNetwork(MovingBeam):
    """Dynamic analysis of a frame; states are stored as positions and quaternions of all nodes (nodes * 7,)."""

    layout: Layout | None = None

    def _displacement_field(self, x: Floats) -> FrameDisplacementField:
        """Return the displacement field of the frame in a state x (nodes * 7,)."""
        assert self.layout is not None
        return FrameDisplacementField(self.layout, x)


def build_frame_dynamics(
    static: Prepared, declared: Declared, case: Case, layout: Layout, elastic: RodElastic, problem: Statics,
    applied: Sequence[tuple[Declared, Energy]],
) -> MovingNetwork:  # fmt: skip
    """Return the dynamic analysis of a frame, with its mass lumped at the points.

    `applied` are loads on the nodes, and `problem` is the static problem.
    """
    chart = JointChart(layout.rest, layout.joints)
    rods = MovingJointedRods(MovingRod(chart.nodes, elastic), layout.joints)
    loads = [(load, MovingRodForces(_forces_at_points(layout, energy))) for load, energy in applied]
    found = dynamics(case, problem, chart, rods, loads, layout.X, layout.axes, layout.mass())
    analysis: Any = case.analysis
    return MovingNetwork(static, declared, analysis, found, layout=layout)


def _forces_at_points(layout: Layout, energy: Energy) -> Floats:
    """Return the dead nodal forces of a load, summed at the points of the network (p, 3), N."""
    assert isinstance(energy, RodForces)  # validation refuses moments in dynamics
    found = np.zeros((layout.count, 3))
    np.add.at(found, layout.point_of_node, energy.forces)
    return found
