"""Signed distance to a body of revolution, from the signed distance to its half-section.

The half-section lies in the plane of the axis and the point.
"""

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

AXIS = 1e-12  # of the size: points this near are on the axis


@dataclass(frozen=True)
class RevolvedGap:
    """Signed distance to a body of revolution around the unit vector `axis` through `origin`, m.

    The corners (r, z), m, of the half-section are in counter-clockwise order.
    """

    corners: Corners
    axis: Vector3
    origin: Vector3

    @cached_property
    def outline(self) -> PolygonDistance:
        """Signed distance to the polygon of the half-section."""
        return PolygonDistance(self.corners, around=True)

    @property
    def least_curvature_radius(self) -> float:
        """Smallest radius of curvature of convex edges of the body, m: 0 for corners of the half-section."""
        return 0.0 if self.outline.sharp else math.inf

    @cached_property
    def centroid(self) -> Vector3:
        """Centroid of the body, m: z = int r z dA / int r dA over the half-section."""
        return add_multiples(self.origin, (axial_centroid(self.corners), self.axis))

    def _half_plane_coordinates(self, X: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the coordinates (r, z) (n, 2), m, of points X (n, 3), m, in the half-plane of each.

        Also returned are the radial unit vectors (n, 3), and a mask (n,) of the points on the axis.
        """
        axis = np.array(self.axis)
        x = X - np.array(self.origin)
        z = x @ axis
        out = x - z[:, None] * axis
        r = np.sqrt(np.einsum("ni,ni->n", out, out))
        on = r <= AXIS * self.outline.size
        out = np.where(on[:, None], transverse(self.axis)[0], out / np.where(on, 1.0, r)[:, None])
        return np.stack([r, z], axis=1), out, on

    def gap(self, X: Floats) -> Floats:
        """Return the gaps (n,), m, at points X (n, 3), m."""
        axis = np.array(self.axis)
        x = X - np.array(self.origin)
        z = x @ axis
        r = np.linalg.norm(x - z[:, None] * axis, axis=1)
        return self.outline.gap(np.stack([r, z], axis=1))

    def look(self, X: Floats) -> Look:
        """Return gaps (n,), m, normals n (n, 3) and Hessians H (n, 3, 3), 1/m, at points X (n, 3), m.

        n = n_r e_r + n_z e_z and H = h t t + n_r / r e_phi e_phi, with the second derivative h of the half-section and
        the unit vector t perpendicular to n in its plane. On the axis n_r / r is replaced by its limit h, for a surface
        that is nearest at a tip or a flat part.
        """
        p, out, on = self._half_plane_coordinates(X)
        g, m, h = self.outline.look(p)
        axis = np.array(self.axis)
        n = m[:, :1] * out + m[:, 1:] * axis
        t = m[:, :1] * axis - m[:, 1:] * out
        phi = np.cross(axis, out)
        ring = np.where(on, h, m[:, 0] / np.where(on, 1.0, p[:, 0]))
        H = h[:, None, None] * t[:, :, None] * t[:, None, :] + ring[:, None, None] * phi[:, :, None] * phi[:, None, :]
        return g, n, H


def axial_centroid(corners: Corners) -> float:
    """Return the axial position, m, of the centroid of a body of revolution.

    The corners (r, z), m, are those of its half-section.
    """
    volume = moment = 0.0
    for (a, b), (c, d) in edges(corners):
        volume += (a * d - c * b) * (a + c) / 6.0
        moment += (a * d - c * b) * (2.0 * a * b + a * d + c * b + 2.0 * c * d) / 24.0
    return moment / volume
