"""Material points of a surface, at nodes or between them, and points added in front of planes of a rigid body."""

from __future__ import annotations

import numpy as np

from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats, Ints

SAME = 1e-9  # of shape functions: what is less is nothing


@dataclass(frozen=True)
class SurfacePoints:
    """Points x_p = sum_a N_pa x_a: `shares` N (p, a) of nodes `of` (p, a), at rest X (p, 3), m, areas A (p,), m^2."""

    of: Ints
    shares: Floats
    X: Floats
    A: Floats

    def __len__(self) -> int:
        return len(self.A)

    def some(self, which: Ints) -> SurfacePoints:
        """Return the selected points (k,)."""
        return SurfacePoints(self.of[which], self.shares[which], self.X[which], self.A[which])

    def and_(self, others: SurfacePoints) -> SurfacePoints:
        """Return these points followed by others; missing nodes repeat the first with zero weight."""
        width = max(self.of.shape[1], others.of.shape[1])
        of = [np.hstack([p.of, np.repeat(p.of[:, :1], width - p.of.shape[1], axis=1)]) for p in (self, others)]
        shares = [np.pad(p.shares, ((0, 0), (0, width - p.shares.shape[1]))) for p in (self, others)]
        X, A = np.concatenate([self.X, others.X]), np.concatenate([self.A, others.A])
        return SurfacePoints(np.concatenate(of), np.concatenate(shares), X, A)


@dataclass(frozen=True)
class AddedContactPoints:
    """Added points kept in front of planes of a rigid body, with normals n (p, 3), through c (p, 3), m, in the body
    frame.

    Each is the deepest point of the surface part with number `which` (p,), at local coordinates t (p, 2). `ways` (p, 2,
    2) are the coordinates before, and the step from there to the deepest point.
    """

    points: SurfacePoints
    which: Ints
    t: Floats
    ways: Floats
    c: Floats
    n: Floats

    def __len__(self) -> int:
        return len(self.which)

    def some(self, which: Ints) -> AddedContactPoints:
        """Return the selected points (k,)."""
        return AddedContactPoints(
            self.points.some(which), self.which[which], self.t[which], self.ways[which], self.c[which], self.n[which]
        )
