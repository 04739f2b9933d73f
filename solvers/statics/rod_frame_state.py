"""State update of frames of rods in statics, like `energies/rod_state.py: RodChain` for one rod."""

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
    """Configuration space of rods that share points, in which stretch and shear change exactly to first order.

    Nodes that move along straight lines while elements rotate would stretch the elements in second order, as for one
    rod in `rod_state.RodChain`. So the points are corrected such that the axes of elements are l R(new) (Gamma + dGamma
    . d), with d the increment. The correction is found by least squares with weights 1 / l, and is exact for one rod.
    Where rods close a loop, the misfit is distributed in proportion to length. Fixed components move only by d.
    """

    rest: Floats  # rest state of the nodes (n * 7,)
    elements: Ints  # (e, 2) nodes
    joints: Joints
    held: NDArray[np.bool_]  # components of position of the points (p, 3)

    @property
    def dofs(self) -> int:
        """Number of degrees of freedom, six for each point."""
        return 6 * self.joints.points

    @cached_property
    def lengths(self) -> Floats:
        """Undeformed lengths (e,), m, of the elements."""
        return lengths(self.rest, self.elements)

    def move(self, x: Floats, d: Floats) -> Floats:
        """Return the state x after an increment d (dofs,), with positions corrected to second order."""
        step = self.joints.node_increments(d)
        moved = RodSpace(len(self.joints.point)).move(x, step)
        nodes, ends = moved.reshape(-1, 7), self.elements
        turns = ElementRotations.of(nodes[:, 3:], ends)
        axes = updated_axis_vectors(
            cached_elements(x, ends, self.lengths), step.reshape(-1, 6)[ends].reshape(-1, 12), turns
        )
        short = axes - (nodes[ends[:, 1], :3] - nodes[ends[:, 0], :3])
        nodes[:, :3] += self._position_corrections(short)[self.joints.point]
        cached_elements(moved, ends, self.lengths, turns)  # it will be needed
        return moved

    def has_rotation_jump(self, before: Floats, after: Floats) -> bool:
        """Return whether an element's relative rotation has changed by more than 180 degrees between two states."""
        return exceeds_half_turn(before, after, self.elements)

    @cached_property
    def _difference_matrix(self) -> sparse.csr_matrix:
        """Sparse matrix (e, p) that maps values at points to their differences along elements."""
        ends, count = self.joints.point[self.elements], len(self.elements)
        rows = np.repeat(np.arange(count), 2)
        return sparse.csr_matrix((np.tile([-1.0, 1.0], count), (rows, ends.ravel())), (count, self.joints.points))

    @cached_property
    def _correction_factors(self) -> list[tuple[Ints, Factor]]:
        """Movable points and the factorised correction equations, for each component of position."""
        D = self._difference_matrix
        whole, found = sparse.csr_matrix(D.T @ sparse.diags(1.0 / self.lengths) @ D), []
        for held in self.held.T:
            free = np.flatnonzero(~held if held.any() else np.arange(len(held)) > 0)
            found.append((free, factor(whole[free][:, free].tocsr(), symmetric=True)))
        return found

    def _position_corrections(self, short: Floats) -> Floats:
        """Return corrections (p, 3), m, of points for misfits `short` (e, 3), m, of the element axes."""
        found = np.zeros((self.joints.points, 3))
        b = self._difference_matrix.T @ (short / self.lengths[:, None])
        for c, (free, solver) in enumerate(self._correction_factors):
            if len(free):
                found[free, c] = solver.solve(b[free, c])
            if not self.held[:, c].any():
                found[:, c] -= found[:, c].mean()
        return found
