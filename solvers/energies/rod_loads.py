"""Loads on rod sections: forces at points off the rod axis, and moments that keep their direction in space.

Rotations are treated as in `rod_kinematics`. A tangent is the second derivative along geodesics, comparing parallel
gradients, so it is symmetric even out of equilibrium for any load with a potential. A moment fixed in space has no
potential under rotations about several axes (Argyris, Dunne and Scharpf 1978). Its tangent is skew: -[m]x / 2, with m
the moment in the material axes. The other half of -[m]x is in the tangent of the internal forces that balance the
moment.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from softmark.records import dataclass
from softmark.solvers.energies.energy import Energy, Floats, Ints
from softmark.solvers.energies.local_blocks import add_blocks, cross_matrix, project_semidefinite
from softmark.solvers.energies.rod_rotation import rotation


def _rotation_dofs(nodes: Ints) -> Ints:
    """Return the rotational degrees of freedom (k, 3) of nodes (k,)."""
    found: Ints = 6 * nodes[:, None] + np.arange(3, 6)
    return found


def _to_material_axes(x: Floats, nodes: Ints, vectors: Floats) -> Floats:
    """Rotate spatial vectors (k, 3) into the material axes of nodes (k,)."""
    found: Floats = np.einsum("kji,kj->ki", rotation(x.reshape(-1, 7)[nodes, 3:]), vectors)
    return found


@dataclass(frozen=True)
class EccentricRodForces(Energy):
    """Dead forces (k, 3), N, at points offset from `nodes` (k,) by `arms` (k, 3), m, in material axes.

    E = -sum of f . (x + R a), minus its value at rest, J. The arm a rotates with the section; the force f does not.
    """

    rest: Floats
    nodes: Ints
    arms: Floats
    forces: Floats
    conservative: bool = True

    @property
    def stencils(self) -> Ints:
        """The three rotations of every node (k, 3)."""
        return _rotation_dofs(self.nodes)

    def _loaded_points(self, x: Floats) -> Floats:
        """Return the current positions of the loaded points (k, 3), m."""
        nodes = x.reshape(-1, 7)[self.nodes]
        found: Floats = nodes[:, :3] + np.einsum("kij,kj->ki", rotation(nodes[:, 3:]), self.arms)
        return found

    def value(self, x: Floats) -> float:
        """Return the potential, zero in the undeformed state, J."""
        return -float(np.sum(self.forces * (self._loaded_points(x) - self._rest_positions)))

    @cached_property
    def _rest_positions(self) -> Floats:
        return self._loaded_points(self.rest)

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Subtract the forces, N, and their moments a x R^T f about the material axes, N m, from g."""
        nodes = g.reshape(-1, 6)
        np.add.at(nodes[:, :3], self.nodes, -scale * self.forces)
        moments = np.cross(self.arms, _to_material_axes(x, self.nodes, self.forces))
        np.add.at(nodes[:, 3:], self.nodes, -scale * moments)

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Add the Hessian (F . a) I - (F a^T + a F^T) / 2 with F = R^T f, the force in material axes.

        If `projected`, negative eigenvalues are set to zero.
        """
        F, a = _to_material_axes(x, self.nodes, self.forces), self.arms
        both = np.einsum("ki,kj->kij", F, a)
        local = np.einsum("ki,ki->k", F, a)[:, None, None] * np.eye(3) - 0.5 * (both + both.swapaxes(1, 2))
        if projected:
            local = project_semidefinite(local)
        add_blocks(scale * local, slots, data)

    def rounding(self, x: Floats) -> float:
        """Return zero: the rounding error of this load is far below that of the rod."""
        return 0.0


@dataclass(frozen=True)
class RodMoments(Energy):
    """Moments (k, 3), N m, on nodes (k,), with constant magnitude and direction in space."""

    nodes: Ints
    moments: Floats
    conservative: bool = False

    @property
    def stencils(self) -> Ints:
        """The three rotations of every node (k, 3)."""
        return _rotation_dofs(self.nodes)

    def value(self, x: Floats) -> float:
        """Raise TypeError: a moment fixed in space has no potential, because its work depends on the path."""
        raise TypeError("a moment that stays in space has no energy")

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Subtract the moments about the material axes, N m, from g."""
        np.add.at(g.reshape(-1, 6)[:, 3:], self.nodes, -scale * _to_material_axes(x, self.nodes, self.moments))

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Add the tangent -[m]x / 2, which is skew, unless `projected`: that tangent must stay definite."""
        if projected:
            return
        m = _to_material_axes(x, self.nodes, self.moments)
        add_blocks(-0.5 * scale * cross_matrix(m), slots, data)

    def rounding(self, x: Floats) -> float:
        """Return zero: the rounding error of this load is far below that of the rod."""
        return 0.0
