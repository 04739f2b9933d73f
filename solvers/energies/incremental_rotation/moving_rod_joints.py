"""Rods that share points, in motion: unknowns of the points, from which those of all nodes follow (rod_joints.py)."""

from __future__ import annotations

from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats
from softmark.solvers.energies.incremental_rotation.moving_rods import RodChart
from softmark.solvers.energies.rod_joints import Jointed, Joints


class JointChart:
    """A chart of the points: rotation vectors about their axes are those of the nodes about theirs, turned."""

    def __init__(self, rest: Floats, joints: Joints) -> None:
        self.nodes, self.joints = RodChart(rest), joints

    def reset(self) -> None:
        """Count from the undeformed state."""
        self.nodes.reset()

    def state(self, x: Floats) -> Floats:
        """The state (nodes * 7,) of unknowns x (points * 6,)."""
        return self.nodes.state(self.joints.spread(x))

    def rebase(self, x: Floats) -> Floats:
        """Count from the state x from now on; the unknowns of that state, whose rotation vectors are zero."""
        self.nodes.rebase(self.joints.spread(x))
        new = x.reshape(-1, 6).copy()
        new[:, 3:] = 0.0
        return new.ravel()


@dataclass(frozen=True)
class JointedInMotion(Jointed):
    """An energy over the unknowns of the nodes' chart, over those of the points."""

    def _state(self, x: Floats) -> Floats:
        """The unknowns of the nodes."""
        return self.joints.spread(x)
