"""Points of a surface that go with its material, at nodes and between them, and planes that they keep clear of."""

from __future__ import annotations

import numpy as np

from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats, Ints

SAME = 1e-9  # of shape functions: what is less is nothing


@dataclass(frozen=True)
class Points:
    """x_p = sum_a N_pa x_a, `shares` N (p, a) of nodes `of` (p, a), at rest X (p, 3), m, for areas A (p,), m^2."""

    of: Ints
    shares: Floats
    X: Floats
    A: Floats

    def __len__(self) -> int:
        return len(self.A)

    def some(self, which: Ints) -> Points:
        """Those at some places (k,) of it."""
        return Points(self.of[which], self.shares[which], self.X[which], self.A[which])

    def and_(self, others: Points) -> Points:
        """With others after them; who has fewer nodes gets the first once more, with no share."""
        width = max(self.of.shape[1], others.of.shape[1])
        of = [np.hstack([p.of, np.repeat(p.of[:, :1], width - p.of.shape[1], axis=1)]) for p in (self, others)]
        shares = [np.pad(p.shares, ((0, 0), (0, width - p.shares.shape[1]))) for p in (self, others)]
        X, A = np.concatenate([self.X, others.X]), np.concatenate([self.A, others.A])
        return Points(np.concatenate(of), np.concatenate(shares), X, A)


@dataclass(frozen=True)
class Joined:
    """Points kept in front of planes of a rigid body, with normals n (p, 3), through c (p, 3), m, as it sees them.

    `which` (p,) are numbers of the parts of the surface that they are the deepest points of, and t (p, 2) their places
    on these; `ways` (p, 2, 2) are how these came about: the place before, and how far from there the deepest point was.
    """

    points: Points
    which: Ints
    t: Floats
    ways: Floats
    c: Floats
    n: Floats

    def __len__(self) -> int:
        return len(self.which)

    def some(self, which: Ints) -> Joined:
        """Those at some places (k,) of it."""
        return Joined(
            self.points.some(which), self.which[which], self.t[which], self.ways[which], self.c[which], self.n[which]
        )
