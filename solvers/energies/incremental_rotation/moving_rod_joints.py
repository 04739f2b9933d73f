"""Jointed rods in dynamics, whose unknowns are those of the joints (see rod_joints.py)."""

from __future__ import annotations

from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats
from softmark.solvers.energies.incremental_rotation.moving_rods import RodChart
from softmark.solvers.energies.rod_joints import JointedRods, Joints


class JointChart:
    """Rotation chart of the joints: reference rotations from which their rotation vectors are counted.

    The rotation vector of a joint, expressed in the axes of a rod node, is the rotation vector of that node.
    """

    def __init__(self, rest: Floats, joints: Joints) -> None:
        self.nodes, self.joints = RodChart(rest), joints

    def reset(self) -> None:
        """Set the reference rotations to those of the undeformed state."""
        self.nodes.reset()

    def state(self, x: Floats) -> Floats:
        """Return the state (nodes * 7,) of the rod nodes for unknowns x (points * 6,) of the joints."""
        return self.nodes.state(self.joints.node_increments(x))

    def rebase(self, x: Floats) -> Floats:
        """Make the rotations in state x the reference rotations, and return x with zero rotation vectors."""
        self.nodes.rebase(self.joints.node_increments(x))
        new = x.reshape(-1, 6).copy()
        new[:, 3:] = 0.0
        return new.ravel()


@dataclass(frozen=True)
class MovingJointedRods(JointedRods):
    """A rod energy in dynamics, expressed in the unknowns of the joints instead of those of the rod nodes."""

    def _state(self, x: Floats) -> Floats:
        """Return the unknowns of the rod nodes (6 n,) for unknowns x (6 p,) of the joints."""
        return self.joints.node_increments(x)
