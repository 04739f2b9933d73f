"""Signed distances to spheres and rounded shapes, exact everywhere: the distance to a core minus a radius."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from softmark.records import dataclass
from softmark.solvers.contact.signed_distance.distance_function import Gap, Look
from softmark.solvers.mesh.mesh import Floats
from softmark.solvers.mesh.shape import Vector3

AT = 1e-12  # of the radius: points this near are at the centre


@dataclass(frozen=True)
class BallGap:
    """Signed distance to a ball of a `radius` around a centre, m, with a concentric hollow of radius `inner`, m."""

    radius: float
    centroid: Vector3
    inner: float = 0.0

    @property
    def least_curvature_radius(self) -> float:
        """Smallest radius of curvature of the convex surface, m: the outer radius."""
        return self.radius

    def _vectors_from_centre(self, X: Floats) -> tuple[Floats, Floats]:
        """Return vectors (n, 3), m, from the centre to points X (n, 3), m, and their lengths (n,), m."""
        x = X - np.array(self.centroid)
        return x, np.sqrt(np.einsum("ni,ni->n", x, x))

    def _is_nearer_to_outside(self, r: Floats) -> NDArray[np.bool_]:
        """Return a mask (n,) of the points at radii r (n,), m, that are nearer to the outside than to the hollow."""
        found: NDArray[np.bool_] = 2.0 * r >= (self.radius + self.inner if self.inner else 0.0)
        return found

    def gap(self, X: Floats) -> Floats:
        """Return the gaps (n,), m, at points X (n, 3), m: |X - c| - R, or near the hollow its radius minus |X - c|."""
        r = self._vectors_from_centre(X)[1]
        return np.where(self._is_nearer_to_outside(r), r - self.radius, self.inner - r)

    def look(self, X: Floats) -> Look:
        """Return gaps (n,), m, normals n (n, 3) and Hessians (n, 3, 3), 1/m, at points X (n, 3), m.

        At a distance r from the centre c, n = (X - c) / r and the Hessian is (1 - n n) / r. At the centre n is along z
        and the Hessian is zero.
        """
        x, r = self._vectors_from_centre(X)
        at = r <= AT * self.radius
        r, n = np.where(at, 0.0, r), np.where(at[:, None], [0.0, 0.0, 1.0], x / np.where(at, 1.0, r)[:, None])
        outer = self._is_nearer_to_outside(r)
        sign = np.where(outer, 1.0, -1.0)
        H = transverse_projection(n) * np.where(at, 0.0, sign / np.where(at, 1.0, r))[:, None, None]
        return np.where(outer, r - self.radius, self.inner - r), sign[:, None] * n, H


def transverse_projection(n: Floats) -> Floats:
    """Return the projections 1 - n n (n, 3, 3) onto the planes perpendicular to unit vectors n (n, 3)."""
    found: Floats = np.eye(3) - n[:, :, None] * n[:, None, :]
    return found


@dataclass(frozen=True)
class RoundedGap:
    """Signed distance to the convex shape of all points within `radius`, m, of a convex core.

    It is the signed distance to the core minus the radius, and exact inside the shape too.
    """

    core: Gap
    radius: float
    centroid: Vector3 | None

    @property
    def least_curvature_radius(self) -> float:
        """Smallest radius of curvature of the surface, m."""
        return (
            self.core.least_curvature_radius + self.radius
            if math.isfinite(self.core.least_curvature_radius)
            else math.inf
        )

    def gap(self, X: Floats) -> Floats:
        """Return the gaps (n,), m, at points X (n, 3), m: those of the core minus the radius."""
        return self.core.gap(X) - self.radius

    def look(self, X: Floats) -> Look:
        """Return gaps (n,), m, normals (n, 3) and Hessians (n, 3, 3), 1/m, at points X (n, 3), m."""
        g, n, H = self.core.look(X)
        return g - self.radius, n, H
