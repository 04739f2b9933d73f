"""Material points of a surface, at nodes or between them, and contact points added to rigid contact."""

from __future__ import annotations

import numpy as np

from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats, Ints

SAME = 1e-9  # of shape functions: smaller values count as zero


@dataclass(frozen=True)
class SurfacePoints:
    """Points x_p = sum_a N_pa x_a of a surface, with shape functions `shares` N (p, a) of the nodes `of` (p, a).

    At rest they are at X (p, 3), m; their areas are A (p,), m^2.
    """

    of: Ints
    shares: Floats
    X: Floats
    A: Floats

    def __len__(self) -> int:
        return len(self.A)

    def select_points(self, which: Ints) -> SurfacePoints:
        """Return the selected points, with the indices `which` (k,)."""
        return SurfacePoints(self.of[which], self.shares[which], self.X[which], self.A[which])

    def concatenate(self, others: SurfacePoints) -> SurfacePoints:
        """Return these points followed by others.

        If one set has fewer nodes per point, the first node is repeated with zero weight.
        """
        width = max(self.of.shape[1], others.of.shape[1])
        of = [np.hstack([p.of, np.repeat(p.of[:, :1], width - p.of.shape[1], axis=1)]) for p in (self, others)]
        shares = [np.pad(p.shares, ((0, 0), (0, width - p.shares.shape[1]))) for p in (self, others)]
        X, A = np.concatenate([self.X, others.X]), np.concatenate([self.A, others.A])
        return SurfacePoints(np.concatenate(of), np.concatenate(shares), X, A)


@dataclass(frozen=True)
class AddedContactPoints:
    """Contact points added during a solution, each kept in front of a plane fixed to the rigid body.

    The planes have normals n (p, 3) and contain the points c (p, 3), m, both in the body frame. Each contact point is
    the deepest point of the facet region with the number `which` (p,), at local coordinates t (p, 2). `ways` (p, 2, 2)
    has the coordinates in the last round, and the step from there to the deepest point.
    """

    points: SurfacePoints
    which: Ints
    t: Floats
    ways: Floats
    c: Floats
    n: Floats

    def __len__(self) -> int:
        return len(self.which)

    def select_points(self, which: Ints) -> AddedContactPoints:
        """Return the selected points, with the indices `which` (k,)."""
        return AddedContactPoints(
            self.points.select_points(which),
            self.which[which],
            self.t[which],
            self.ways[which],
            self.c[which],
            self.n[which],
        )
