"""Concentrated loads on rods in dynamics: moments that keep their direction in space, and tendons through guides.

These loads act at few nodes and cache their last evaluation. The general `MovingRodLoad` would take as long as all
other computations of a step, or twice that.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from softmark.records import dataclass
from softmark.solvers.energies.energy import Energy, Floats, Ints
from softmark.solvers.energies.incremental_rotation.moving_rods import RodChart
from softmark.solvers.energies.local_blocks import add_blocks, cross_matrix
from softmark.solvers.energies.rod_guides import SHORT, GuidedTendon
from softmark.solvers.energies.rod_loads import RodMoments
from softmark.solvers.energies.rod_rotation import rotation


@dataclass(frozen=True)
class MovingRodMoments(Energy):
    """Moments m fixed in space, on rod nodes, over the unknowns of a chart.

    `on` holds the moments and their nodes. About a node's own axes the moment is R^T m, with the tangent [R^T m]x
    d(rotation).
    """

    chart: RodChart
    on: RodMoments
    conservative: bool = False

    @property
    def stencils(self) -> Ints:
        """The three rotations of every node (k, 3)."""
        return self.on.stencils

    @cached_property
    def _nodes_with_moments(self) -> list[tuple[int, list[float]]]:
        return list(zip(self.on.nodes.tolist(), self.on.moments.tolist(), strict=True))

    def value(self, x: Floats) -> float:
        """Raise TypeError: a moment fixed in space has no potential, because its work depends on the path."""
        return self.on.value(x)

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Subtract the moments about the nodes' own axes, N m, from g."""
        q = self.chart.positions_and_rotations(x)[1]
        for node, m in self._nodes_with_moments:
            own = _to_own_axes(q[node].tolist(), m)
            for i in range(3):
                g[6 * node + 3 + i] -= scale * own[i]

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Add the tangent of the moments, unless `projected`: that tangent must stay definite."""
        if projected:
            return
        _, q, T = self.chart.positions_and_rotations(x)
        for (node, m), places in zip(self._nodes_with_moments, slots.tolist(), strict=True):
            a, b, c = _to_own_axes(q[node].tolist(), m)
            d, e, f = T[node].tolist()
            for j in range(3):
                turn = b * f[j] - c * e[j], c * d[j] - a * f[j], a * e[j] - b * d[j]
                for i in range(3):
                    if (place := places[i][j]) >= 0:  # negative: fixed
                        data[place] -= scale * turn[i]

    def rounding(self, x: Floats) -> float:
        """Return zero: the rounding error of this load is far below that of the rod."""
        return 0.0


def _to_own_axes(q: list[float], m: list[float]) -> tuple[float, float, float]:
    """Return a spatial vector m in the axes of a unit quaternion q = (w, u): m + 2 u x (u x m - w m)."""
    w, a, b, c = q
    x, y, z = m
    p, s, t = b * z - c * y - w * x, c * x - a * z - w * y, a * y - b * x - w * z
    return x + 2.0 * (b * t - c * s), y + 2.0 * (c * p - a * t), z + 2.0 * (a * s - b * p)


@dataclass(frozen=True)
class MovingGuidedTendon(Energy):
    """A tendon through guides, over the unknowns of a chart.

    At a guide p = x + R a, with a the arm from the node, the two adjacent chords exert the force f. Its moment about
    the section's own axes is a x R^T f. The tangent of this moment is [a]x [R^T f]x d(rotation), plus the part due to
    rotating chords.
    """

    chart: RodChart
    through: GuidedTendon
    conservative: bool = False

    @property
    def stencils(self) -> Ints:
        """Stencils of the tendon."""
        return self.through.stencils

    @cached_property
    def _guide_unknowns(self) -> Ints:
        """Indices of the unknowns of all guides (6 g,)."""
        found: Ints = (6 * self.through.nodes[:, None] + np.arange(6)).ravel()
        return found

    @cached_property
    def _arm_cross_matrices(self) -> Floats:
        """Cross-product matrices [a]x of the arms (g, 3, 3)."""
        return cross_matrix(self.through.arms)

    @cached_property
    def _chord_derivative_arrays(self) -> tuple[Floats, Floats]:
        """Two arrays (c, 3, 12) for the derivatives of a chord by its 12 unknowns, with their constant entries set.

        The entries for rotations change with the state and are overwritten in each evaluation.
        """
        one = np.zeros((len(self.through.nodes) - 1, 3, 12))
        one[:, :, :3], one[:, :, 6:9] = -np.eye(3), np.eye(3)
        return one, one.copy()

    @cached_property
    def _evaluation_cache(self) -> dict[bytes, tuple[Floats, ...]]:
        """Cache of the last evaluation; its key is the unknowns and the reference rotations."""
        return {}

    def _evaluate_tendon(self, x: Floats) -> tuple[Floats, ...]:
        """Return section rotations, chord directions and lengths, own-axis pulls and nodal forces, cached.

        The shapes are (g, 3, 3), (c, 3), (c,) in m, (g, 3) in N and (g, 6), for g guides and c chords.
        """
        at, q, _ = self.chart.positions_and_rotations(x)
        nodes, arms = self.through.nodes, self.through.arms
        own = q[nodes]
        key = x.tobytes() + own.tobytes()
        if (known := self._evaluation_cache.get(key)) is not None:
            return known
        R = rotation(own)
        p = at[nodes] + (R @ arms[:, :, None])[:, :, 0]
        r = p[1:] - p[:-1]
        size = np.maximum(np.sqrt((r * r).sum(axis=1)), SHORT)
        t = r / size[:, None]
        forces = np.zeros((len(nodes), 6))
        forces[:-1, :3] = -self.through.tension * t
        forces[1:, :3] += self.through.tension * t
        pulls = (forces[:, None, :3] @ R)[:, 0]
        forces[:, 3:] = (self._arm_cross_matrices @ pulls[:, :, None])[:, :, 0]
        self._evaluation_cache.clear()
        self._evaluation_cache[key] = found = (R, t, size, pulls, forces)
        return found

    def value(self, x: Floats) -> float:
        """Return the potential, zero in the undeformed state, J."""
        return self.through.value(self.chart.state(x))

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Subtract the tendon forces, N, and their moments about the nodes' own axes, N m, from g."""
        g += np.bincount(self._guide_unknowns, (scale * self._evaluate_tendon(x)[4]).ravel(), len(g))

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Add the tangent of the forces; if `projected`, the projected tangent of the static tendon energy."""
        if projected:
            self.through.add_hessian(self.chart.state(x), data, slots, scale, True)
            return
        R, t, size, pulls, _ = self._evaluate_tendon(x)
        T = self.chart.positions_and_rotations(x)[2][self.through.nodes]
        rows, columns = self._chord_derivative_arrays
        arm = R @ self._arm_cross_matrices
        turned = arm @ T
        rows[:, :, 3:6], rows[:, :, 9:] = arm[:-1], -arm[1:]
        columns[:, :, 3:6], columns[:, :, 9:] = turned[:-1], -turned[1:]
        stiff = (scale * self.through.tension / size)[:, None, None] * (np.eye(3) - t[:, :, None] * t[:, None])
        local = rows.swapaxes(1, 2) @ (stiff @ columns)
        own = self._arm_cross_matrices @ cross_matrix(scale * pulls) @ T
        local[:, 3:6, 3:6] += own[:-1]  # count a guide between two chords once
        local[-1, 9:, 9:] += own[-1]
        add_blocks(local, slots, data)

    def rounding(self, x: Floats) -> float:
        """Return zero: the rounding error of this load is far below that of the rod."""
        return 0.0
