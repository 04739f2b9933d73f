"""Signed distances to shapes with flat sides: a half-space, a box along the coordinate axes, and a prism."""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np

from softmark.records import dataclass
from softmark.solvers.contact.signed_distance.distance_function import Look
from softmark.solvers.contact.signed_distance.polygon_distance import PolygonDistance
from softmark.solvers.mesh import polygons
from softmark.solvers.mesh.mesh import Floats
from softmark.solvers.mesh.shape import Vector3

AT = 1e-12  # of the size: points this near are on an edge


@dataclass(frozen=True)
class HalfSpaceGap:
    """Signed distance to a half-space: it lies behind a plane through `origin`, m, with the unit outward `normal`."""

    origin: Vector3
    normal: Vector3
    least_curvature_radius = math.inf
    centroid = None

    def gap(self, X: Floats) -> Floats:
        """Return the gaps (n,), m, at points X (n, 3), m: (X - origin) . normal."""
        far: Floats = (X - np.array(self.origin)) @ np.array(self.normal)
        return far

    def look(self, X: Floats) -> Look:
        """Return gaps (n,), m, constant normals (n, 3) and zero Hessians (n, 3, 3) at points X (n, 3), m."""
        return self.gap(X), np.tile(np.array(self.normal), (len(X), 1)), np.zeros((len(X), 3, 3))


@dataclass(frozen=True)
class BoxGap:
    """Signed distance to a box with edges along x, y and z, given by its centre and half edge lengths, m."""

    centroid: Vector3
    half: Vector3
    least_curvature_radius = 0.0

    def _distances_beyond_faces(self, X: Floats) -> tuple[Floats, Floats]:
        """Return distances (n, 3), m, of points X beyond the faces of the box, and the signs (n, 3) of these faces.

        Of two opposite faces the nearest counts. A distance is negative if the point is inside in this direction.
        """
        x = X - np.array(self.centroid)
        return np.abs(x) - np.array(self.half), np.where(x < 0.0, -1.0, 1.0)

    def gap(self, X: Floats) -> Floats:
        """Return the gaps (n,), m, at points X (n, 3), m; inside, the negative distance to the nearest face."""
        q = self._distances_beyond_faces(X)[0]
        far = np.linalg.norm(np.maximum(q, 0.0), axis=1)
        found: Floats = np.where(far > 0.0, far, q.max(axis=1))
        return found

    def look(self, X: Floats) -> Look:
        """Return gaps (n,), m, normals n (n, 3) and Hessians (n, 3, 3), 1/m, at points X (n, 3), m.

        At a distance d the Hessian is 0 near a face, (1 - n n - t t) / d near an edge along t, and (1 - n n) / d near a
        corner.
        """
        q, side = self._distances_beyond_faces(X)
        out = np.maximum(q, 0.0)
        d = np.linalg.norm(out, axis=1)
        off = d > AT * math.hypot(*self.half)
        face = np.eye(3)[np.argmax(q, axis=1)]
        safe = np.where(off, d, 1.0)
        n = np.where(off[:, None], out / safe[:, None], face)
        free = np.where(off[:, None], (q > 0.0) * 1.0, 0.0)
        H = (free[:, :, None] * np.eye(3) - n[:, :, None] * n[:, None, :] * off[:, None, None]) / safe[:, None, None]
        H *= side[:, :, None] * side[:, None, :]
        return np.where(d > 0.0, d, q.max(axis=1)), side * n, H


@dataclass(frozen=True)
class PrismGap:
    """Signed distance to a prism: a polygon, m, extruded along z from `base` to `base + height`, m.

    `order` lists the coordinate axes (0 to 2 for x to z) in space of the prism's own coordinates.
    """

    section: polygons.Corners
    base: float
    height: float
    order: tuple[int, int, int]
    least_curvature_radius = 0.0

    @cached_property
    def outline(self) -> PolygonDistance:
        """Signed distance to the polygon of the section."""
        return PolygonDistance(self.section)

    @property
    def centroid(self) -> Vector3:
        """Centroid of the prism, m."""
        own = (*polygons.centroid(self.section), self.base + 0.5 * self.height)
        x, y, z = (own[self.order.index(i)] for i in range(3))
        return x, y, z

    def _section_and_axial_coordinates(self, X: Floats) -> tuple[Floats, Floats]:
        """Return positions of points X in the section (n, 2), m, and along the prism from its middle (n,), m."""
        own = X[:, self.order]
        return own[:, :2], own[:, 2] - (self.base + 0.5 * self.height)

    def gap(self, X: Floats) -> Floats:
        """Return the gaps (n,), m, at points X (n, 3), m, from the distances to the section and to the ends."""
        p, z = self._section_and_axial_coordinates(X)
        return _intersection_distance(self.outline.gap(p), np.abs(z) - 0.5 * self.height)

    def look(self, X: Floats) -> Look:
        """Return gaps (n,), m, normals (n, 3) and Hessians (n, 3, 3), 1/m, at points X (n, 3), m.

        Normal and Hessian are those of the nearest side or end. For points beyond a side and an end they are those of
        the edge between both.
        """
        p, z = self._section_and_axial_coordinates(X)
        a, m, h = self.outline.look(p)
        b, up = np.abs(z) - 0.5 * self.height, np.where(z < 0.0, -1.0, 1.0)
        g = _intersection_distance(a, b)
        edge = (a > 0.0) & (b > 0.0) & (g > AT * self.outline.size)
        safe = np.where(edge, g, 1.0)
        ca, cb = np.where(edge, a / safe, a >= b), np.where(edge, b / safe, a < b)
        n = np.concatenate([ca[:, None] * m, (cb * up)[:, None]], axis=1)
        t = np.concatenate([np.stack([-m[:, 1], m[:, 0]], axis=1), np.zeros((len(X), 1))], axis=1)
        s = np.concatenate([cb[:, None] * m, (-ca * up)[:, None]], axis=1)
        H = (ca * h)[:, None, None] * t[:, :, None] * t[:, None, :]
        H += np.where(edge, 1.0 / safe, 0.0)[:, None, None] * s[:, :, None] * s[:, None, :]
        back = [self.order.index(i) for i in range(3)]
        return g, n[:, back], H[:, back][:, :, back]


def _intersection_distance(a: Floats, b: Floats) -> Floats:
    """Return the signed distance (n,), m, to the intersection of two sets, from the distances a and b (n,), m.

    The sets must be independent, such as the section and the height of a prism: outside both it is sqrt(a^2 + b^2).
    """
    return np.where((a > 0.0) & (b > 0.0), np.hypot(a, b), np.maximum(a, b))
