"""Signed distance to a closed triangle surface, from the closest point; the normal there gives the sign."""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np

from softmark.solvers.contact.signed_distance.distance_function import Look
from softmark.solvers.contact.signed_distance.triangle_tree import TriangleTree
from softmark.solvers.mesh.files.watertight_repair import normals, signed_volume
from softmark.solvers.mesh.mesh import Floats, Ints
from softmark.solvers.mesh.shape import Vector3

ON = 1e-12  # of the extent: points this near are on the surface
FOLD = math.radians(30.0)  # larger angles between triangles are edges; smaller ones approximate a curved surface


class TriangleSurface:
    """Signed distance to a closed triangle surface with points (n, 3), m, and outward triangles (t, 3).

    The sign is that of the scalar product of the vector from the closest point and the normal of the closest face, edge
    or corner. The normal of a corner is the mean of the normals of its triangles, weighted with their angles there.
    With these weights the sign is right everywhere (Baerentzen and Aanaes 2005). The Hessian is that of the closest
    face (zero), edge or corner (1/d at a distance d), even if the triangles approximate a curved surface.
    """

    def __init__(self, points: Floats, triangles: Ints) -> None:
        """Store the points (n, 3), m, and the triangles (t, 3)."""
        self.points, self.triangles = points, triangles

    @cached_property
    def corners(self) -> Floats:
        """Positions of the corners of each triangle (t, 3, 3), m."""
        found: Floats = self.points[self.triangles]
        return found

    @cached_property
    def faces(self) -> Floats:
        """Unit normals (t, 3) of the triangles."""
        return normals(self.points, self.triangles)

    @cached_property
    def _bounding_box_diagonal(self) -> float:
        """Diagonal of the bounding box of the surface, m."""
        return float(np.linalg.norm(np.ptp(self.points, axis=0)))

    @cached_property
    def _triangle_tree(self) -> TriangleTree:
        """Search tree of the triangles."""
        return TriangleTree(self.corners)

    @cached_property
    def _edge_normals_and_numbers(self) -> tuple[Floats, Ints]:
        """Sums (e, 3) of the two normals at each edge, and the numbers (t, 3) of the edges of each triangle.

        Edge k of a triangle starts at its corner k.
        """
        ends = np.sort(self.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        _, number = np.unique(ends, axis=0, return_inverse=True)
        number = number.ravel()
        total = np.zeros((int(number.max()) + 1, 3))
        np.add.at(total, number, np.repeat(self.faces, 3, axis=0))
        return total, number.reshape(-1, 3)

    @cached_property
    def _corner_normals(self) -> Floats:
        """Sums (n, 3), at each point, of the normals of its triangles times their angles at the point."""
        total = np.zeros((len(self.points), 3))
        for k in range(3):
            a, b = (self.corners[:, (k + j) % 3] - self.corners[:, k] for j in (1, 2))
            angle = np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.einsum("ti,ti->t", a, b))
            np.add.at(total, self.triangles[:, k], angle[:, None] * self.faces)
        return total

    @cached_property
    def least_curvature_radius(self) -> float:
        """Smallest radius of curvature of convex edges of the surface, m.

        It is 0 at a sharp fold. Elsewhere it is the radius of the curve that the triangles approximate.
        """
        edges = self._edge_normals_and_numbers[1].ravel()
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
        """Centroid of the volume inside the surface, m."""
        middle = self.points.mean(axis=0)
        a, b, c = (self.corners[:, i] - middle for i in range(3))
        six = np.einsum("ti,ti->t", a, np.cross(b, c))
        x, y, z = (middle + six @ (a + b + c) / (24.0 * signed_volume(self.points, self.triangles))).tolist()
        return x, y, z

    def _find_closest_triangles(self, X: Floats) -> tuple[Ints, Floats, Floats]:
        """Return the closest triangle (n,) to each point X (n, 3), m, and the closest point on it.

        The closest point is given by barycentric coordinates (n, 3), and by the vector (n, 3), m, from it to X.
        """
        t, share = self._triangle_tree.closest(X)
        return t, share, X - np.einsum("nk,nki->ni", share, self.corners[t])

    def _pseudonormals(self, t: Ints, share: Floats) -> Floats:
        """Return the unit normals (n, 3) of the closest face, edge or corner.

        t (n,) are the closest triangles, and `share` (n, 3) the barycentric coordinates of the closest points.
        """
        n = self.faces[t].copy()
        total, number = self._edge_normals_and_numbers
        zero = share <= 0.0
        for k in range(3):
            edge = zero[:, (k + 2) % 3] & (zero.sum(axis=1) == 1)  # between the corners k and k + 1
            n[edge] = total[number[t[edge], k]]
            tip = zero[:, (k + 1) % 3] & zero[:, (k + 2) % 3]
            n[tip] = self._corner_normals[self.triangles[t[tip], k]]
        found: Floats = n / np.maximum(np.linalg.norm(n, axis=1), 1e-300)[:, None]
        return found

    def gap(self, X: Floats) -> Floats:
        """Return the gaps (n,), m, at points X (n, 3), m: negative inside the surface."""
        t, share, off = self._find_closest_triangles(X)
        d = np.linalg.norm(off, axis=1)
        found: Floats = np.where(np.einsum("ni,ni->n", off, self._pseudonormals(t, share)) < 0.0, -d, d)
        return found

    def look(self, X: Floats) -> Look:
        """Return gaps (n,), m, normals n (n, 3) and Hessians (n, 3, 3), 1/m, at points X (n, 3), m.

        At a distance d, with s the sign of the gap, the Hessian is 0 near a face, s (1 - n n - e e) / d near an edge
        along e, and s (1 - n n) / d near a corner.
        """
        t, share, off = self._find_closest_triangles(X)
        pseudo = self._pseudonormals(t, share)
        d = np.linalg.norm(off, axis=1)
        sign = np.where(np.einsum("ni,ni->n", off, pseudo) < 0.0, -1.0, 1.0)
        zero = share <= 0.0
        sharp = zero.any(axis=1) & (d > ON * self._bounding_box_diagonal)
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
