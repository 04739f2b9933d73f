"""Points inside facets that keep clear as well as nodes do: a lattice of as many steps as they need.

Facets of eight nodes need their middle. A uniform pressure pulls at their corners, which nodes that can only be pushed
do not bear: they come off, and a body is softer by 1 to 1.5 % on any mesh (of the sphere in tests/shared/indented.py).
With the middle forces at nodes may have either sign, as those of quadratic elements do.

Rigid bodies that are sharper than the facets they touch go in between nodes: a finer lattice is cut by less than the
distance of its points.
"""

from __future__ import annotations

from dataclasses import fields
from functools import cached_property
from typing import Any

import numpy as np

from softmark.records import dataclass
from softmark.solvers.contact.skin import SAME, triangles
from softmark.solvers.contact.touching import Touching, node_areas
from softmark.solvers.elements.facets import FACETS
from softmark.solvers.energies.energy import Floats, Ints

MOST = 4  # parts between two nodes: what is sharper is met as if it were as blunt as that


@dataclass(frozen=True)
class Inner(Touching):
    """E = sum_p A_p phi(g(x_p)) over points x_p = sum_a N_pa x_a with `shares` N (p, a) of nodes `of` (p, a).

    `nodes` and X are still those of the surface, and forces are told of them; gaps, pressures and areas of the points.
    """

    of: Any = None  # (p, a) nodes
    shares: Any = None  # (p, a)
    at_rest: Any = None  # (p, 3) m

    @cached_property
    def carried(self) -> Ints:
        """Three degrees of freedom of each node of each point (p, 3 a)."""
        found: Ints = (3 * self.of[:, :, None] + np.arange(3)).reshape(len(self.of), -1)
        return found

    @property
    def stencils(self) -> Ints:
        """These."""
        return self.carried

    def places(self, x: Floats) -> Floats:
        """Where its points are (p, 3), m; of a slice in its plane."""
        u = np.asarray(x, dtype=np.float64)[self.carried].reshape(*self.of.shape, 3)
        found: Floats = self.at_rest + np.einsum("pa,pai->pi", self.shares, u)
        return found * (1.0, 1.0, 0.0) if self.flat else found

    @property
    def resting(self) -> Floats:
        """Where its points are at rest (p, 3), m."""
        found: Floats = self.at_rest
        return found

    @cached_property
    def _alone(self) -> tuple[Ints, Ints]:
        """Points that are nodes (k,), and which of the nodes these are (k,)."""
        points = np.flatnonzero(self.shares.max(axis=1) > 1.0 - SAME)
        own = self.of[points, self.shares[points].argmax(axis=1)]
        known = np.isin(own, self.nodes)
        return points[known], np.searchsorted(self.nodes, own[known])

    def nodal_gaps(self, x: Floats) -> Floats:
        """Of its nodes (m,), m: those of points that are nodes among them."""
        where = self.X + np.asarray(x, dtype=np.float64)[3 * self.nodes[:, None] + np.arange(3)]
        found = self.body.gap(self.seen(where * (1.0, 1.0, 0.0) if self.flat else where, x))
        points, which = self._alone
        found[which] = self.gaps(x)[points]
        return found

    def forces(self, x: Floats) -> Floats:
        """What the rigid body does to the nodes (m, 3), N: each point's, by its shares."""
        g = np.zeros(max(len(x), 3 * (int(self.nodes.max(initial=0)) + 1)))
        self.add_gradient(x, g)
        found: Floats = -g[3 * self.nodes[:, None] + np.arange(3)]
        return found

    def spread(self, push: Floats, g: Floats) -> None:
        """Add forces on its points (p, 3), N, to those on degrees of freedom (dofs,), by their shares."""
        np.add.at(g, self.carried, (self.shares[:, :, None] * push[:, None, :]).reshape(len(push), -1))

    def presses(self, x: Floats, nodes: int) -> Floats:
        """How hard it presses at all nodes (nodes,), N: on each point, by its shares."""
        found = np.zeros(nodes)
        np.add.at(found, self.of, self.shares * (self.A * self.pressures(x))[:, None])
        return found

    def coupled(self, points: Ints, blocks: Floats) -> Floats:
        """Stiffness at points as N_a N_b of it between their nodes (k, 3 a, 3 a), N/m."""
        N = self.shares[points]
        k = 3 * N.shape[1]
        found: Floats = (N[:, :, None, None, None] * (N[:, None, None, :, None] * blocks[:, None, :, None, :])).reshape(
            -1, k, k
        )
        return found


def inner(touching: Touching, points: Floats, facets: Ints, steps: int, depth: float = 0.0, still: Any = None) -> Inner:
    """The same contact, kept clear at a lattice of so many steps along each side of `facets` (f, a) of its surface.

    Points that only nodes carry that are `still` (nodes,) are left out.
    """
    kind = facets.shape[1]
    xi, parts = triangles(kind, steps)
    N = FACETS[kind].shape(xi)
    marks = np.random.default_rng(0).random((len(points), 2))  # two numbers that tell any point by its shares
    mark = np.einsum("la,fam->flm", N, marks[facets]).reshape(-1, 2)
    keys = np.round(mark / SAME).astype(np.int64)
    _, first, which = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    of, shares = facets[first // len(xi)], N[first % len(xi)]
    at_rest = np.einsum("pa,pai->pi", shares, points[of])
    split = which.reshape(len(facets), -1)[:, parts].reshape(-1, 3)
    _, areas = node_areas(at_rest, split, ((0, 1, 2),), depth)
    own = np.ones(len(of), dtype=np.bool_) if still is None else ((np.abs(shares) > SAME) & ~still[of]).any(axis=1)
    known = {f.name: getattr(touching, f.name) for f in fields(touching)} | {"A": areas[own]}
    return Inner(**known, of=of[own], shares=shares[own], at_rest=at_rest[own])
