"""Signed distance to a closed triangle surface, from the closest point on it; the normal there gives the sign."""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np

from softmark.solvers.contact.signed_distance.distance_function import Look
from softmark.solvers.contact.signed_distance.triangle_tree import TriangleTree
from softmark.solvers.mesh.files.watertight_repair import normals, signed_volume
from softmark.solvers.mesh.mesh import Floats, Ints
from softmark.solvers.mesh.shape import Vector3

ON = 1e-12  # of the extent: what is as near is on the surface
FOLD = math.radians(30.0)  # triangles that meet at a larger angle meet at an edge; smaller ones stand for a curve


class TriangleSurface:
    """Closed triangle surface: points (n, 3), m, and outward triangles (t, 3).

    The sign is that of the angle with the normal of the closest face, edge or corner. The normal of a corner is the
    mean of those of its triangles, weighted by their angles there, so that the sign is right everywhere (Baerentzen and
    Aanaes 2005). The Hessian is that of the closest part: zero for a face, 1/d for an edge and a corner, even if the
    triangles approximate a curved surface.
    """

    def __init__(self, points: Floats, triangles: Ints) -> None:
        """Store points and triangles."""
        self.points, self.triangles = points, triangles

    @cached_property
    def corners(self) -> Floats:
        """Corners of each triangle (t, 3, 3), m."""
        found: Floats = self.points[self.triangles]
        return found

    @cached_property
    def faces(self) -> Floats:
        """Unit normals of triangles (t, 3)."""
        return normals(self.points, self.triangles)

    @cached_property
    def _extent(self) -> float:
        """Diagonal of its bounding box, m."""
        return float(np.linalg.norm(np.ptp(self.points, axis=0)))

    @cached_property
    def _tree(self) -> TriangleTree:
        """Search tree of its triangles."""
        return TriangleTree(self.corners)

    @cached_property
    def _edges(self) -> tuple[Floats, Ints]:
        """Sums of the normals at each edge (e, 3), and the edges of each triangle, the k-th starting at corner k (t,
        3).
        """
        ends = np.sort(self.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        _, number = np.unique(ends, axis=0, return_inverse=True)
        number = number.ravel()
        total = np.zeros((int(number.max()) + 1, 3))
        np.add.at(total, number, np.repeat(self.faces, 3, axis=0))
        return total, number.reshape(-1, 3)

    @cached_property
    def _tips(self) -> Floats:
        """Sums of triangle normals times their angles at each point (n, 3)."""
        total = np.zeros((len(self.points), 3))
        for k in range(3):
            a, b = (self.corners[:, (k + j) % 3] - self.corners[:, k] for j in (1, 2))
            angle = np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.einsum("ti,ti->t", a, b))
            np.add.at(total, self.triangles[:, k], angle[:, None] * self.faces)
        return total

    @cached_property
    def sharpest(self) -> float:
        """Least radius of curvature of its convex edges, m: 0 at a fold, else that of the curve that triangles
        approximate.
        """
        edges = self._edges[1].ravel()
        order = np.argsort(edges, kind="stable")
        one, other = order[0::2] // 3, order[1::2] // 3  # each edge has two triangles: it is closed
        away = self.corners.mean(axis=1)[other] - self.corners.mean(axis=1)[one]
        angle = np.arccos(np.clip(np.einsum("ei,ei->e", self.faces[one], self.faces[other]), -1.0, 1.0))
        convex = (np.einsum("ei,ei->e", away, self.faces[one]) < 0.0) & (angle > 1e-6)
        if not convex.any():
            return math.inf
        if angle[convex].max() > FOLD:
            return 0.0
        return float((np.linalg.norm(away, axis=1)[convex] / angle[convex]).min())

    @cached_property
    def centroid(self) -> Vector3:
        """Centroid of its volume, m."""
        middle = self.points.mean(axis=0)
        a, b, c = (self.corners[:, i] - middle for i in range(3))
        six = np.einsum("ti,ti->t", a, np.cross(b, c))
        x, y, z = (middle + six @ (a + b + c) / (24.0 * signed_volume(self.points, self.triangles))).tolist()
        return x, y, z

    def _closest(self, X: Floats) -> tuple[Ints, Floats, Floats]:
        """Return for points X (n, 3): closest triangle (n,), barycentric coordinates (n, 3), and vector from there (n,
        3), m.
        """
        t, share = self._tree.closest(X)
        return t, share, X - np.einsum("nk,nki->ni", share, self.corners[t])

    def _normal(self, t: Ints, share: Floats) -> Floats:
        """Return the unit normals of the closest face, edge or corner (n, 3)."""
        n = self.faces[t].copy()
        total, number = self._edges
        zero = share <= 0.0
        for k in range(3):
            edge = zero[:, (k + 2) % 3] & (zero.sum(axis=1) == 1)  # between the corners k and k + 1
            n[edge] = total[number[t[edge], k]]
            tip = zero[:, (k + 1) % 3] & zero[:, (k + 2) % 3]
            n[tip] = self._tips[self.triangles[t[tip], k]]
        found: Floats = n / np.maximum(np.linalg.norm(n, axis=1), 1e-300)[:, None]
        return found

    def gap(self, X: Floats) -> Floats:
        """Return the distance to the closest point, negative inside (n,), m."""
        t, share, off = self._closest(X)
        d = np.linalg.norm(off, axis=1)
        found: Floats = np.where(np.einsum("ni,ni->n", off, self._normal(t, share)) < 0.0, -d, d)
        return found

    def look(self, X: Floats) -> Look:
        """Return gap, normal and H: 0 near a face, s (1 - n n - e e) / d near an edge along e, s (1 - n n) / d near a
        corner.
        """
        t, share, off = self._closest(X)
        pseudo = self._normal(t, share)
        d = np.linalg.norm(off, axis=1)
        sign = np.where(np.einsum("ni,ni->n", off, pseudo) < 0.0, -1.0, 1.0)
        zero = share <= 0.0
        sharp = zero.any(axis=1) & (d > ON * self._extent)
        safe = np.where(sharp, d, 1.0)
        n = np.where(sharp[:, None], (sign / safe)[:, None] * off, pseudo)
        n /= np.linalg.norm(n, axis=1)[:, None]
        P = np.eye(3) - n[:, :, None] * n[:, None, :]
        for k in range(3):
            edge = np.flatnonzero(zero[:, (k + 2) % 3] & (zero.sum(axis=1) == 1))
            e = self.corners[t[edge], (k + 1) % 3] - self.corners[t[edge], k]
            e /= np.linalg.norm(e, axis=1)[:, None]
            P[edge] -= e[:, :, None] * e[:, None, :]
        return sign * d, n, np.where(sharp, sign / safe, 0.0)[:, None, None] * P
