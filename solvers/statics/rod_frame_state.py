"""State update of frames of rods in statics: what `energies/rod_state.py: RodChain` does along one rod."""

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
    """State space of rods that share points: stretch and shear change only as the increment says.

    As in `rod_state.RodChain` for one rod: nodes that move along straight lines while elements rotate would stretch
    these in second order. So points are corrected such that elements have their axes l R(new) (Gamma + dGamma . d), by
    least squares with weights 1 / l, which is exact along one rod; where rods close a loop, the misfit is distributed
    in proportion to length. Fixed components move only by d.
    """

    rest: Floats  # of the nodes (n * 7,)
    elements: Ints  # (e, 2) nodes
    joints: Joints
    held: NDArray[np.bool_]  # components of position of the points (p, 3)

    @property
    def dofs(self) -> int:
        """Number of degrees of freedom, six for each point."""
        return 6 * self.joints.points

    @cached_property
    def lengths(self) -> Floats:
        """Undeformed lengths (e,), m."""
        return lengths(self.rest, self.elements)

    def move(self, x: Floats, d: Floats) -> Floats:
        """Return the state after an increment d, with positions corrected to second order."""
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
        """Return whether neighbouring nodes have turned past each other, as `rod_state.jumped`."""
        return exceeds_half_turn(before, after, self.elements)

    @cached_property
    def _differences(self) -> sparse.csr_matrix:
        """Matrix of differences of values at points along elements (e, p)."""
        ends, count = self.joints.point[self.elements], len(self.elements)
        rows = np.repeat(np.arange(count), 2)
        return sparse.csr_matrix((np.tile([-1.0, 1.0], count), (rows, ends.ravel())), (count, self.joints.points))

    @cached_property
    def _factors(self) -> list[tuple[Ints, Factor]]:
        """Movable points and factor of the correction equations, for each component of position."""
        D = self._differences
        whole, found = sparse.csr_matrix(D.T @ sparse.diags(1.0 / self.lengths) @ D), []
        for held in self.held.T:
            free = np.flatnonzero(~held if held.any() else np.arange(len(held)) > 0)
            found.append((free, factor(whole[free][:, free].tocsr(), symmetric=True)))
        return found

    def _moved_on(self, short: Floats) -> Floats:
        """Return corrections of points (p, 3), m, for misfits of element axes (e, 3), m."""
        found = np.zeros((self.joints.points, 3))
        b = self._differences.T @ (short / self.lengths[:, None])
        for c, (free, solver) in enumerate(self._factors):
            if len(free):
                found[free, c] = solver.solve(b[free, c])
            if not self.held[:, c].any():
                found[:, c] -= found[:, c].mean()
        return found
