"""Signed distances of a core minus a radius: spheres and rounded shapes, exact everywhere."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from softmark.records import dataclass
from softmark.solvers.contact.signed_distance.distance_function import Gap, Look
from softmark.solvers.mesh.mesh import Floats
from softmark.solvers.mesh.shape import Vector3

AT = 1e-12  # of the radius: what is as near is the centre


@dataclass(frozen=True)
class BallGap:
    """Ball of a `radius` around a centre, m, without a concentric hollow of radius `inner`."""

    radius: float
    centroid: Vector3
    inner: float = 0.0

    @property
    def sharpest(self) -> float:
        """Radius, m."""
        return self.radius

    def _from_centre(self, X: Floats) -> tuple[Floats, Floats]:
        """Return vectors from the centre to points X, and their lengths, m."""
        x = X - np.array(self.centroid)
        return x, np.sqrt(np.einsum("ni,ni->n", x, x))

    def _outer(self, r: Floats) -> NDArray[np.bool_]:
        """Return a mask of the points (n,) that are nearer to the outer surface than to the hollow."""
        found: NDArray[np.bool_] = 2.0 * r >= (self.radius + self.inner if self.inner else 0.0)
        return found

    def gap(self, X: Floats) -> Floats:
        """Return |X - c| - R; nearer to a hollow its radius - |X - c|."""
        r = self._from_centre(X)[1]
        return np.where(self._outer(r), r - self.radius, self.inner - r)

    def look(self, X: Floats) -> Look:
        """Return gap, n = (X - c) / r, H = (1 - n n) / r; at the centre n is along z and H zero."""
        x, r = self._from_centre(X)
        at = r <= AT * self.radius
        r, n = np.where(at, 0.0, r), np.where(at[:, None], [0.0, 0.0, 1.0], x / np.where(at, 1.0, r)[:, None])
        outer = self._outer(r)
        sign = np.where(outer, 1.0, -1.0)
        H = transverse_projection(n) * np.where(at, 0.0, sign / np.where(at, 1.0, r))[:, None, None]
        return np.where(outer, r - self.radius, self.inner - r), sign[:, None] * n, H


def transverse_projection(n: Floats) -> Floats:
    """Return the projections 1 - n n (n, 3, 3) across unit vectors (n, 3)."""
    found: Floats = np.eye(3) - n[:, :, None] * n[:, None, :]
    return found


@dataclass(frozen=True)
class RoundedGap:
    """All points within `radius` of a convex core, m: the gap is that of the core minus the radius, also inside."""

    core: Gap
    radius: float
    centroid: Vector3 | None

    @property
    def sharpest(self) -> float:
        """Least radius of curvature, m."""
        return self.core.sharpest + self.radius if math.isfinite(self.core.sharpest) else math.inf

    def gap(self, X: Floats) -> Floats:
        """Return the gap of the core minus the radius."""
        return self.core.gap(X) - self.radius

    def look(self, X: Floats) -> Look:
        """Return the gap of the core minus the radius, with its normal and Hessian."""
        g, n, H = self.core.look(X)
        return g - self.radius, n, H
