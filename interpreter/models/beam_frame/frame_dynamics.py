"""Frames in dynamic analyses; nodes of members rotate with the points (solvers/dynamics/rotational_inertia.py)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.models.beam.beam_dynamics import rod_dynamics
from softmark.interpreter.models.beam_frame.frame_layout import Layout
from softmark.interpreter.problem.body_case import Case
from softmark.solvers.energies.energy import Energy, Floats
from softmark.solvers.energies.geometrically_exact_rod import RodElastic, RodForces
from softmark.solvers.energies.incremental_rotation.moving_rod_joints import JointChart, MovingJointedRods
from softmark.solvers.energies.incremental_rotation.moving_rods import MovingRod, MovingRodForces

if TYPE_CHECKING:
    from collections.abc import Sequence

    from softmark.solvers.dynamics.dynamic_problem import Dynamics
    from softmark.solvers.statics.static_problem import Statics


def frame_dynamics(
    case: Case, layout: Layout, elastic: RodElastic, static: Statics, applied: Sequence[tuple[Declared, Energy]]
) -> Dynamics:
    """Return the dynamic problem of a frame, with its mass lumped at the points. Raises Fault.

    `applied` are loads on the nodes, and `static` is the static problem.
    """
    chart = JointChart(layout.rest, layout.joints)
    rods = MovingJointedRods(MovingRod(chart.nodes, elastic), layout.joints)
    loads = [(load, MovingRodForces(_forces_at_points(layout, energy))) for load, energy in applied]
    return rod_dynamics(case, static, chart, rods, loads, layout.X, layout.axes, layout.mass())


def _forces_at_points(layout: Layout, energy: Energy) -> Floats:
    """Return the dead nodal forces of a load, summed at the points of the network (p, 3), N."""
    assert isinstance(energy, RodForces)  # validation refuses moments in dynamics
    found = np.zeros((layout.count, 3))
    np.add.at(found, layout.point_of_node, energy.forces)
    return found
