"""Rods that share ends: the nodes of several rods, each with frames of its own, and the points at which they are one.

A rigid joint keeps the angles between the rods that meet there. Every rod brings a node of its own, whose frame lies
along it; q of a node is q_point Q with a rotation Q that never changes. A turn of the point by a vector phi about the
point's axes is one of the node by Q^T phi about the node's, for turns of any size, as exp(phi) Q = Q exp(Q^T phi):
what is unknown at nodes is linear in what is unknown at points, and energies, forces and tangents of rods carry over by
one constant matrix. `Jointed` is any energy of the rods over the unknowns of the points, at rest and in motion.
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
    """Which point each node is at (n,), and its frame at rest in the axes of the point (n, 3, 3)."""

    point: Ints
    turns: Floats

    @staticmethod
    def of(rest: Floats, point: Ints, axes: Floats) -> Joints:
        """The nodes of rods at rest (n * 7,), at points with `axes` (p, 3, 3), as columns, of their own."""
        frames = rotation(rest.reshape(-1, 7)[:, 3:])
        return Joints(point, np.einsum("nki,nkj->nij", axes[point], frames))

    @cached_property
    def points(self) -> int:
        """How many points there are."""
        return int(self.point.max()) + 1

    def spread(self, d: Floats) -> Floats:
        """Increments of the nodes (6 n,) from those of the points (6 p,)."""
        own = d.reshape(-1, 6)[self.point]
        turned = np.einsum("nki,nk->ni", self.turns, own[:, 3:])
        return np.concatenate([own[:, :3], turned], axis=1).ravel()

    def gathered(self, g: Floats) -> Floats:
        """Forces and moments at the points (6 p,) from those at the nodes (6 n,)."""
        own = g.reshape(-1, 6)
        both = np.concatenate([own[:, :3], np.einsum("nik,nk->ni", self.turns, own[:, 3:])], axis=1)
        found = np.zeros((self.points, 6))
        np.add.at(found, self.point, both)
        return found.ravel()

    def blocks(self, stencils: Ints) -> tuple[Ints, Floats]:
        """For stencils of nodes (m, k): those of the points, and d(node)/d(point) (m, k, k).

        Raises ValueError where a stencil has a rotation of a node in part.
        """
        node, part = stencils // 6, stencils % 6
        one = (node[:, :, None] == node[:, None, :]) & (part[:, :, None] // 3 == part[:, None, :] // 3)
        turns = part >= 3
        if not np.array_equal(one.sum(axis=2)[turns], np.full(int(turns.sum()), 3)):
            raise ValueError("a stencil of rods has whole rotations of nodes")
        Q = self.turns[node[:, :, None], part[:, None, :] % 3, part[:, :, None] % 3]
        same = (part[:, :, None] == part[:, None, :]).astype(np.float64)
        return 6 * self.point[node] + part, np.where(one, np.where(turns[:, :, None], Q, same), 0.0)


@dataclass(frozen=True)
class Jointed(Energy):
    """An `energy` of rods, over the unknowns of the points; a state is that of the nodes."""

    energy: Energy
    joints: Joints

    @property
    def conservative(self) -> bool:
        """As that of the rods."""
        return self.energy.conservative

    @cached_property
    def _blocks(self) -> tuple[Ints, Floats]:
        return self.joints.blocks(self.energy.stencils)

    @property
    def stencils(self) -> Ints:
        """Degrees of freedom of the points."""
        return self._blocks[0] if self.energy.stencils.size else self.energy.stencils

    def _state(self, x: Floats) -> Floats:
        """What the energy of the rods is of."""
        return x

    def value(self, x: Floats) -> float:
        """Of the rods, J."""
        return self.energy.value(self._state(x))

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Forces and moments at the points."""
        own = np.zeros(6 * len(self.joints.point))
        self.energy.add_gradient(self._state(x), own, scale)
        g += self.joints.gathered(own)

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """B^T K B, B as `Joints.blocks` has it."""
        B = self._blocks[1]
        local = np.zeros_like(B)
        self.energy.add_hessian(
            self._state(x), local.reshape(-1), np.arange(local.size).reshape(local.shape), scale, projected
        )
        add_blocks(B.swapaxes(1, 2) @ local @ B, slots, data)

    def rounding(self, x: Floats) -> float:
        """Of the rods, N."""
        return self.energy.rounding(self._state(x))
