"""Points inside facets that keep clear as well, for rigid bodies that are sharper than the mesh they touch.

Where nodes alone keep clear, a corner or an edge goes in between them. Here every flat triangle of the surface is split
into a lattice of n x n, whose points are where linear shape functions put them: positive shares of its three corners.
Between those points a facet is cut by less than their distance.
"""

from __future__ import annotations

from dataclasses import fields
from functools import cached_property
from typing import Any

import numpy as np

from softmark.records import dataclass
from softmark.solvers.contact.touching import Touching, node_areas
from softmark.solvers.energies.energy import Floats, Ints

MOST = 4  # parts of an edge of a triangle: sharper ones are met as if they were as blunt as that


@dataclass(frozen=True)
class Inner(Touching):
    """E = sum_p A_p phi(g(x_p)) over points x_p = sum_a N_pa x_a with `shares` N (p, 3) of nodes `corners` (p, 3).

    `nodes` and X are still those of the surface, and forces are told of them; gaps, pressures and areas of the points.
    """

    corners: Any = None  # (p, 3) nodes
    shares: Any = None  # (p, 3)
    at_rest: Any = None  # (p, 3) m

    @cached_property
    def stencils(self) -> Ints:
        """Nine degrees of freedom of each point (p, 9)."""
        found: Ints = (3 * self.corners[:, :, None] + np.arange(3)).reshape(-1, 9)
        return found

    def places(self, x: Floats) -> Floats:
        """Where its points are (p, 3), m; of a slice in its plane."""
        u = np.asarray(x, dtype=np.float64)[self.stencils].reshape(-1, 3, 3)
        found: Floats = self.at_rest + np.einsum("pa,pai->pi", self.shares, u)
        return found * (1.0, 1.0, 0.0) if self.flat else found

    def forces(self, x: Floats) -> Floats:
        """What the rigid body does to the nodes (m, 3), N: each point's, by its shares."""
        g = np.zeros(max(len(x), 3 * (int(self.nodes.max(initial=0)) + 1)))
        self.add_gradient(x, g)
        found: Floats = -g[3 * self.nodes[:, None] + np.arange(3)]
        return found

    def spread(self, push: Floats, g: Floats) -> None:
        """Add forces on its points (p, 3), N, to those on degrees of freedom (dofs,), by their shares."""
        np.add.at(g, self.stencils, (self.shares[:, :, None] * push[:, None, :]).reshape(-1, 9))

    def presses(self, x: Floats, nodes: int) -> Floats:
        """How hard it presses at all nodes (nodes,), N: on each point, by its shares."""
        found = np.zeros(nodes)
        np.add.at(found, self.corners, self.shares * (self.A * self.pressures(x))[:, None])
        return found

    def coupled(self, points: Ints, blocks: Floats) -> Floats:
        """Stiffness at points as N_a N_b of it between their corners (k, 9, 9), N/m."""
        N = self.shares[points]
        found: Floats = np.einsum("pa,pb,pij->paibj", N, N, blocks).reshape(-1, 9, 9)
        return found


def inner(touching: Touching, points: Floats, triangles: Ints, n: int, depth: float = 0.0, still: Any = None) -> Inner:
    """The same contact, kept clear at a lattice of n x n on each of `triangles` (t, 3) of its surface.

    Points that only nodes carry that are `still` (nodes,) are left out.
    """
    shares, parts = _lattice(n)
    numbers = np.where(shares > 0, triangles[:, None, :], -1)  # (t, l, 3): corners without a share do not count
    counts = np.broadcast_to(shares, numbers.shape)
    order = np.argsort(numbers, axis=2)
    keys = np.concatenate([np.take_along_axis(numbers, order, 2), np.take_along_axis(counts, order, 2)], axis=2)
    each, which = np.unique(keys.reshape(-1, 6), axis=0, return_inverse=True)
    which = which.reshape(len(triangles), -1)
    corners, N = np.maximum(each[:, :3], each[:, 2:3] * (each[:, :3] < 0)), each[:, 3:] / n
    at_rest = np.einsum("pa,pai->pi", N, points[corners])
    _, areas = node_areas(at_rest, which[:, parts].reshape(-1, 3), ((0, 1, 2),), depth)
    own = np.ones(len(N), dtype=np.bool_) if still is None else (N * ~still[corners]).sum(axis=1) > 0.0
    known = {f.name: getattr(touching, f.name) for f in fields(touching)} | {"A": areas[own]}
    return Inner(**known, corners=corners[own], shares=N[own], at_rest=at_rest[own])


def _lattice(n: int) -> tuple[Ints, Ints]:
    """Points of a triangle as n-fold shares of its corners (l, 3), and the parts that they split it into (n^2, 3)."""
    places = [(i, j) for i in range(n + 1) for j in range(n + 1 - i)]
    number = {place: k for k, place in enumerate(places)}
    up = [[(i, j), (i + 1, j), (i, j + 1)] for i in range(n) for j in range(n - i)]
    down = [[(i + 1, j), (i + 1, j + 1), (i, j + 1)] for i in range(n) for j in range(n - 1 - i)]
    parts = np.array([[number[place] for place in part] for part in (*up, *down)], dtype=np.int64)
    return np.array([(n - i - j, i, j) for i, j in places], dtype=np.int64), parts
