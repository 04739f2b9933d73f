"""Jointed rods in dynamics: the unknowns are those of the joints (see rod_joints.py)."""

from __future__ import annotations

from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats
from softmark.solvers.energies.incremental_rotation.moving_rods import RodChart
from softmark.solvers.energies.rod_joints import JointedRods, Joints


class JointChart:
    """Rotation chart of the joints; their rotation vectors, in node axes, are those of the nodes."""

    def __init__(self, rest: Floats, joints: Joints) -> None:
        self.nodes, self.joints = RodChart(rest), joints

    def reset(self) -> None:
        """Set the reference rotations to those of the undeformed state."""
        self.nodes.reset()

    def state(self, x: Floats) -> Floats:
        """Return the state (nodes * 7,) of unknowns x (points * 6,)."""
        return self.nodes.state(self.joints.spread(x))

    def rebase(self, x: Floats) -> Floats:
        """Make x the reference and return the unknowns of the same state, whose rotation vectors are then zero."""
        self.nodes.rebase(self.joints.spread(x))
        new = x.reshape(-1, 6).copy()
        new[:, 3:] = 0.0
        return new.ravel()


@dataclass(frozen=True)
class MovingJointedRods(JointedRods):
    """An energy over the unknowns of the rod nodes, expressed in the unknowns of the joints."""

    def _state(self, x: Floats) -> Floats:
        """Return the unknowns of the nodes."""
        return self.joints.spread(x)
