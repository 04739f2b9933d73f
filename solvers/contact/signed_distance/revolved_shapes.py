"""Signed distance to a body of revolution, from that to its half-section in the plane of the axis and the point."""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np

from softmark.records import dataclass
from softmark.solvers.contact.signed_distance.distance_function import Look
from softmark.solvers.contact.signed_distance.polygon_distance import PolygonDistance
from softmark.solvers.mesh.mesh import Floats
from softmark.solvers.mesh.polygons import Corners, edges
from softmark.solvers.mesh.shape import Vector3, add_multiples, transverse

AXIS = 1e-12  # of its size: what is as near is on the axis


@dataclass(frozen=True)
class RevolvedGap:
    """Body of revolution: corners (r, z), counter-clockwise, m, around the unit vector `axis` through `origin`, m."""

    corners: Corners
    axis: Vector3
    origin: Vector3

    @cached_property
    def outline(self) -> PolygonDistance:
        """Polygon of its half-section."""
        return PolygonDistance(self.corners, around=True)

    @property
    def sharpest(self) -> float:
        """Least radius of curvature of its convex edges, m: 0 for corners."""
        return 0.0 if self.outline.sharp else math.inf

    @cached_property
    def centroid(self) -> Vector3:
        """Centroid of its volume, m: z = int r z dA / int r dA over the half-section."""
        return add_multiples(self.origin, (axial_centroid(self.corners), self.axis))

    def _own(self, X: Floats) -> tuple[Floats, Floats, Floats]:
        """Return radius and axial position (n, 2), m, the radial unit vector (n, 3), and a mask of the axis."""
        axis = np.array(self.axis)
        x = X - np.array(self.origin)
        z = x @ axis
        out = x - z[:, None] * axis
        r = np.sqrt(np.einsum("ni,ni->n", out, out))
        on = r <= AXIS * self.outline.size
        out = np.where(on[:, None], transverse(self.axis)[0], out / np.where(on, 1.0, r)[:, None])
        return np.stack([r, z], axis=1), out, on

    def gap(self, X: Floats) -> Floats:
        """Return the gap to the half-section."""
        axis = np.array(self.axis)
        x = X - np.array(self.origin)
        z = x @ axis
        r = np.linalg.norm(x - z[:, None] * axis, axis=1)
        return self.outline.gap(np.stack([r, z], axis=1))

    def look(self, X: Floats) -> Look:
        """Return gap, n = n_r e_r + n_z e_z, H = h t t + n_r / r e_phi e_phi, with t across n in the half-plane.

        On the axis n_r / r is h, its limit where the surface is nearest at a tip or flat.
        """
        p, out, on = self._own(X)
        g, m, h = self.outline.look(p)
        axis = np.array(self.axis)
        n = m[:, :1] * out + m[:, 1:] * axis
        t = m[:, :1] * axis - m[:, 1:] * out
        phi = np.cross(axis, out)
        ring = np.where(on, h, m[:, 0] / np.where(on, 1.0, p[:, 0]))
        H = h[:, None, None] * t[:, :, None] * t[:, None, :] + ring[:, None, None] * phi[:, :, None] * phi[:, None, :]
        return g, n, H


def axial_centroid(corners: Corners) -> float:
    """Return the axial position of the centroid of the volume that corners (r, z) enclose around the axis, m."""
    volume = moment = 0.0
    for (a, b), (c, d) in edges(corners):
        volume += (a * d - c * b) * (a + c) / 6.0
        moment += (a * d - c * b) * (2.0 * a * b + a * d + c * b + 2.0 * c * d) / 24.0
    return moment / volume
