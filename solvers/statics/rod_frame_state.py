"""How rods that share points move in statics: what `energies/rod_state.py: RodChain` does along one of them."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats, Ints
from softmark.solvers.energies.rod_joints import Joints
from softmark.solvers.energies.rod_kinematics import ElementRotations, cached_elements
from softmark.solvers.energies.rod_state import RodSpace, exceeds_half_turn, lengths, updated_axis_vectors
from softmark.solvers.linear.factorisations import Factor, factor


@dataclass(frozen=True)
class RodNetwork:
    """The motion of rods that share points, whose stretch and shear change as the increment says, and no more.

    What `rod_state.RodChain` does along one rod: nodes that move along straight lines while elements turn would stretch
    these in second order. Points are moved on so that elements have their axes l R(new) (Gamma + dGamma . d) as nearly
    as they can, by least squares with weights 1 / l, which along one rod is what `RodChain` does; where rods close a
    loop, what does not fit is shared by all of it in proportion to length. Held components move by d alone.
    """

    rest: Floats  # of the nodes (n * 7,)
    elements: Ints  # (e, 2) nodes
    joints: Joints
    held: NDArray[np.bool_]  # components of position of the points (p, 3)

    @property
    def dofs(self) -> int:
        """Six for each point."""
        return 6 * self.joints.points

    @cached_property
    def lengths(self) -> Floats:
        """Undeformed lengths (e,), m."""
        return lengths(self.rest, self.elements)

    def move(self, x: Floats, d: Floats) -> Floats:
        """The plain move, then positions corrected to second order in d."""
        step = self.joints.spread(d)
        moved = RodSpace(len(self.joints.point)).move(x, step)
        nodes, ends = moved.reshape(-1, 7), self.elements
        turns = ElementRotations.of(nodes[:, 3:], ends)
        axes = updated_axis_vectors(
            cached_elements(x, ends, self.lengths), step.reshape(-1, 6)[ends].reshape(-1, 12), turns
        )
        short = axes - (nodes[ends[:, 1], :3] - nodes[ends[:, 0], :3])
        nodes[:, :3] += self._moved_on(short)[self.joints.point]
        cached_elements(moved, ends, self.lengths, turns)  # it will be asked for
        return moved

    def jumped(self, before: Floats, after: Floats) -> bool:
        """As `rod_state.jumped` has it."""
        return exceeds_half_turn(before, after, self.elements)

    @cached_property
    def _differences(self) -> sparse.csr_matrix:
        """Of values at points along elements (e, p)."""
        ends, count = self.joints.point[self.elements], len(self.elements)
        rows = np.repeat(np.arange(count), 2)
        return sparse.csr_matrix((np.tile([-1.0, 1.0], count), (rows, ends.ravel())), (count, self.joints.points))

    @cached_property
    def _factors(self) -> list[tuple[Ints, Factor]]:
        """For each component of position the points that may move on, and the factor of their equations."""
        D = self._differences
        whole, found = sparse.csr_matrix(D.T @ sparse.diags(1.0 / self.lengths) @ D), []
        for held in self.held.T:
            free = np.flatnonzero(~held if held.any() else np.arange(len(held)) > 0)
            found.append((free, factor(whole[free][:, free].tocsr(), symmetric=True)))
        return found

    def _moved_on(self, short: Floats) -> Floats:
        """How far points move on (p, 3), m, for what axes are short of (e, 3), m."""
        found = np.zeros((self.joints.points, 3))
        b = self._differences.T @ (short / self.lengths[:, None])
        for c, (free, solver) in enumerate(self._factors):
            if len(free):
                found[free, c] = solver.solve(b[free, c])
            if not self.held[:, c].any():
                found[:, c] -= found[:, c].mean()
        return found
