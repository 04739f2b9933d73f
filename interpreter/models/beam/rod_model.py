"""Base class of prepared models of rods, whose states are positions and quaternions of nodes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from softmark.interpreter.models.procedures.dynamic_discretization import DisplacementField, MotionFields
from softmark.interpreter.models.shared.prepared_model import Meshless
from softmark.solvers.energies.energy import Floats

if TYPE_CHECKING:
    from softmark.solvers.dynamics.dynamic_problem import Dynamics
    from softmark.solvers.dynamics.integrator import Motion

NUDGE = 1e-6  # rad and m: a motion so small that it is linear in double precision


class RodModel(Meshless):
    """Prepared model of rods; in a dynamic problem, a chart of rotations gives positions and quaternions of nodes."""

    def displacement_field(self, x: Floats) -> DisplacementField:
        """Return the displacement field of a state x (nodes * 7,)."""
        raise NotImplementedError  # beams and frames override it

    def stored_state(self, problem: Dynamics, motion: Motion) -> Floats:
        """Return positions and quaternions of the nodes (nodes * 7,)."""
        assert problem.turning is not None
        return problem.turning.chart.state(motion.x)

    def motion_fields(self, times: Floats, states: Floats) -> MotionFields:
        """Return the displacement fields of states (t, nodes * 7)."""
        each = [self.displacement_field(x) for x in states]
        return MotionFields(lambda X: np.array([at_time(X) for at_time in each]), each[-1])

    def mode_field(self, problem: Dynamics, shape: Floats) -> DisplacementField:
        """Return the displacement field of a vibration mode `shape` (dofs,).

        It is computed by a finite difference, because points of a section rotate with it.
        """
        assert problem.turning is not None
        problem.turning.reset()
        small = NUDGE / (float(np.abs(shape).max(initial=0.0)) or 1.0)
        shift = self.displacement_field(problem.turning.chart.state(small * shape))
        return lambda X: np.asarray(shift(X)) / small
