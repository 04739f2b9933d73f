"""Rods that share joints: nodes of several rods, each with its own frame, rigidly connected at points.

A rigid joint keeps the angles between the rods that meet there. Every rod has its own node at the joint, whose frame is
along the rod: the rotation of the node is q = q_point Q, with a constant rotation Q. A rotation vector phi of the
point, in the axes of the point, is the rotation vector Q^T phi of the node, in the axes of the node. This holds for
rotations of any size, because exp(phi) Q = Q exp(Q^T phi). So the unknowns of the nodes are linear in those of the
points, and one constant matrix maps energies, forces and tangents. `JointedRods` is any rod energy over the unknowns of
the points, in statics and in dynamics.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from softmark.records import dataclass
from softmark.solvers.energies.energy import Energy, Floats, Ints
from softmark.solvers.energies.local_blocks import add_blocks
from softmark.solvers.energies.rod_rotation import rotation


@dataclass(frozen=True)
class Joints:
    """Map from the nodes of rods to the points (joints) that the rods share.

    `point` (n,) is the index of the point to which each of the n nodes belongs. `turns` (n, 3, 3) is the undeformed
    frame of each node, with components in the axes of its point.
    """

    point: Ints
    turns: Floats

    @staticmethod
    def of(rest: Floats, point: Ints, axes: Floats) -> Joints:
        """Return the joints of undeformed rods, from the point to which each node belongs.

        `rest` (n * 7,) holds the position, m, and the unit quaternion of each of n nodes. `point` (n,) is the index of
        the point to which each node belongs. `axes` (p, 3, 3) holds an orthonormal basis for each of p points, as
        columns.
        """
        frames = rotation(rest.reshape(-1, 7)[:, 3:])
        return Joints(point, np.einsum("nki,nkj->nij", axes[point], frames))

    @cached_property
    def points(self) -> int:
        """Number of points."""
        return int(self.point.max()) + 1

    def node_increments(self, d: Floats) -> Floats:
        """Return the increments of the nodes (6 n,) from the increments d of the points (6 p,)."""
        own = d.reshape(-1, 6)[self.point]
        turned = np.einsum("nki,nk->ni", self.turns, own[:, 3:])
        return np.concatenate([own[:, :3], turned], axis=1).ravel()

    def forces_at_points(self, g: Floats) -> Floats:
        """Return the forces and moments at the points (6 p,) from the forces and moments g at the nodes (6 n,)."""
        own = g.reshape(-1, 6)
        both = np.concatenate([own[:, :3], np.einsum("nik,nk->ni", self.turns, own[:, 3:])], axis=1)
        found = np.zeros((self.points, 6))
        np.add.at(found, self.point, both)
        return found.ravel()

    def point_stencils_with_derivatives(self, stencils: Ints) -> tuple[Ints, Floats]:
        """Return stencils over unknowns of points, and the derivatives of node unknowns by these.

        The given stencils (m, k) number unknowns of nodes, and the result the corresponding unknowns of points. The
        derivatives have the shape (m, k, k). Raises ValueError if a stencil contains only part of a node's rotation.
        """
        node, part = stencils // 6, stencils % 6
        one = (node[:, :, None] == node[:, None, :]) & (part[:, :, None] // 3 == part[:, None, :] // 3)
        turns = part >= 3
        if not np.array_equal(one.sum(axis=2)[turns], np.full(int(turns.sum()), 3)):
            raise ValueError("a stencil contains only a part of the rotation of a node")
        Q = self.turns[node[:, :, None], part[:, None, :] % 3, part[:, :, None] % 3]
        same = (part[:, :, None] == part[:, None, :]).astype(np.float64)
        return 6 * self.point[node] + part, np.where(one, np.where(turns[:, :, None], Q, same), 0.0)


@dataclass(frozen=True)
class JointedRods(Energy):
    """Energy of a rod as a function of the displacements and rotations of its joint points, which all nodes follow.

    `energy` is the energy as a function of the nodes. In statics the state holds the positions and quaternions of all
    nodes, and only increments are those of the points.
    """

    energy: Energy
    joints: Joints

    @property
    def conservative(self) -> bool:
        """True if the rod energy is conservative."""
        return self.energy.conservative

    @cached_property
    def _stencils_with_derivatives(self) -> tuple[Ints, Floats]:
        return self.joints.point_stencils_with_derivatives(self.energy.stencils)

    @property
    def stencils(self) -> Ints:
        """Degrees of freedom of the points that each rod element couples, shape (m, k) for m elements."""
        return self._stencils_with_derivatives[0] if self.energy.stencils.size else self.energy.stencils

    def _state(self, x: Floats) -> Floats:
        """Return the state that the rod energy takes; in statics, this is x itself."""
        return x

    def value(self, x: Floats) -> float:
        """Return the rod energy, J."""
        return self.energy.value(self._state(x))

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Add the forces, N, and moments, N m, at the points, multiplied by `scale`, to g (6 p,)."""
        own = np.zeros(6 * len(self.joints.point))
        self.energy.add_gradient(self._state(x), own, scale)
        g += self.joints.forces_at_points(own)

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Add the Hessian B^T K B multiplied by `scale` to `data`.

        K is the Hessian of the rod energy by the unknowns of nodes, and B their derivative by the unknowns of points.
        """
        B = self._stencils_with_derivatives[1]
        local = np.zeros_like(B)
        self.energy.add_hessian(
            self._state(x), local.reshape(-1), np.arange(local.size).reshape(local.shape), scale, projected
        )
        add_blocks(B.swapaxes(1, 2) @ local @ B, slots, data)

    def rounding(self, x: Floats) -> float:
        """Return the rounding error of the rod forces, N."""
        return self.energy.rounding(self._state(x))
