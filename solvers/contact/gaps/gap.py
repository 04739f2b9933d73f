"""What may be asked of the gap to a rigid shape, and of any gap: its cut by a plane, and how far points may move.

Where a gap has no gradient, which is on sharp edges and tips themselves and inside at equal distance from two parts of
the surface, `look` gives the normal of one of them (of an edge or a tip, one between those of its faces) and a Hessian
of zero there: values are finite everywhere. Next to a sharp edge, at a distance d, the Hessian is 1/d, as it is.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from softmark.records import dataclass
from softmark.solvers.mesh.mesh import Floats
from softmark.solvers.mesh.shape import Vector3

Look = tuple[Floats, Floats, Floats]  # gap (n,) in m, normal (n, 3), Hessian (n, 3, 3) in 1/m
NEVER = 1e-300  # m: what moves by less does not move
STEPS = 32  # of a march; one straight onto a flat face takes two
SPARE = 0.01  # of the gap to be kept: a march ends that has no more left


class Gap(Protocol):
    """The signed distance to the surface of a rigid shape: exact everywhere, so that |g(X) - g(Y)| <= |X - Y|."""

    @property
    def sharpest(self) -> float:
        """Least radius of curvature of its convex edges, m: 0 of a sharp one, inf where all is flat or hollow."""

    @property
    def centroid(self) -> Vector3 | None:
        """The middle of its volume, m; None of one without end."""

    def gap(self, X: Floats) -> Floats:
        """From points X (n, 3), m, to its surface (n,), m: positive outside, negative inside."""

    def look(self, X: Floats) -> Look:
        """At points X (n, 3), m: the gap, its gradient, which is the outward normal, and its Hessian."""


@dataclass(frozen=True)
class Flat:
    """A gap as plane problems see it: at z = 0, with neither gradient nor curvature along z.

    It is the distance in the plane where the shape looks the same from both sides of it; of another it is less.
    """

    whole: Gap

    @property
    def sharpest(self) -> float:
        """Least radius of curvature of its convex edges, m."""
        return self.whole.sharpest

    @property
    def centroid(self) -> Vector3 | None:
        """The middle of its volume, m."""
        return self.whole.centroid

    def gap(self, X: Floats) -> Floats:
        """From points (n, 2), or (n, 3) of which z does not count, m, to the surface in the plane (n,), m."""
        return self.whole.gap(_in_plane(X))

    def look(self, X: Floats) -> Look:
        """At such points: the gap, its normal and its Hessian, whose components along z are zero."""
        g, n, H = self.whole.look(_in_plane(X))
        n[:, 2], H[:, 2], H[:, :, 2] = 0.0, 0.0, 0.0
        return g, n, H


def flat(gap: Gap) -> Flat:
    """The gap at z = 0, for plane problems and for bodies of revolution."""
    return Flat(gap)


def _in_plane(X: Floats) -> Floats:
    """Points (n, 3) with z = 0."""
    return np.column_stack([X[:, 0], X[:, 1], np.zeros(len(X))])


def reach(gap: Gap, X: Floats) -> Floats:
    """How far each of points X (n, 3), m, may move in any direction without a touch (n,), m: its gap, if it has one."""
    far: Floats = np.maximum(gap.gap(X), 0.0)
    return far


def bound(gap: Gap, X: Floats, step: Floats, keep: float = 0.1) -> float:
    """A share of a step (n, 3), m, of points X (n, 3), m, up to which each keeps `keep` of its gap all the way.

    Marches along the step by what the gap allows, for it is 1-Lipschitz (sphere tracing, Hart 1996): never too far, and
    too short only where a point slides along the surface. 1 if nothing is in the way; 0 if a point has no gap.
    """
    far, g = np.linalg.norm(step, axis=1), gap.gap(X)
    least, own = keep * g, np.flatnonzero(far > NEVER)
    share = np.where(far > NEVER, 0.0, 1.0)
    for _ in range(STEPS):
        spare = np.maximum(g[own] - least[own], 0.0)
        share[own] = np.minimum(share[own] + spare / far[own], 1.0)
        own = own[(spare > SPARE * np.abs(least[own])) & (share[own] < 1.0)]
        if not own.size:
            break
        g[own] = gap.gap(X[own] + share[own, None] * step[own])
    return float(share.min(initial=1.0))
