"""Rigid motion of a body from its declared position, and the signed distance to the moved body."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from softmark.records import dataclass
from softmark.solvers.contact.signed_distance.distance_function import Gap, Look
from softmark.solvers.energies.local_blocks import cross_matrix
from softmark.solvers.mesh.mesh import Floats
from softmark.solvers.mesh.shape import Vector3

ZERO: Vector3 = (0.0, 0.0, 0.0)


def rotation_from_vector(w: Floats) -> Floats:
    """Return the rotation matrix (3, 3) of a rotation vector (3,), rad: Rodrigues' formula."""
    angle = float(np.linalg.norm(w))
    k = cross_matrix(w) / (angle or 1.0)
    Q: Floats = np.eye(3) + np.sin(angle) * k + 2.0 * np.sin(0.5 * angle) ** 2 * (k @ k)
    return Q


@dataclass(frozen=True)
class RigidMotion:
    """Rigid motion of a body: its points X move to x = c + Q (X - c) + shift.

    `rotation` (3,), rad, is the rotation vector of Q, `about` the point c, m, and `shift` a translation, m.
    """

    shift: Vector3 = ZERO
    rotation: Vector3 = ZERO
    about: Vector3 = ZERO

    @cached_property
    def rotation_matrix(self) -> Floats | None:
        """Rotation matrix Q (3, 3); None for a motion without rotation."""
        return rotation_from_vector(np.array(self.rotation)) if any(self.rotation) else None

    def at(self, share: float) -> RigidMotion:
        """Return the motion at a fraction `share` of its path, with the same axis of rotation."""
        a, b, c = (share * s for s in self.shift)
        p, q, r = (share * w for w in self.rotation)
        return RigidMotion((a, b, c), (p, q, r), self.about)

    def moved(self, X: Floats) -> Floats:
        """Return the positions (n, 3), m, of body points declared at X (n, 3), m."""
        c, s = np.array(self.about), np.array(self.shift)
        found: Floats = X + s if self.rotation_matrix is None else (X - c) @ self.rotation_matrix.T + (c + s)
        return found

    def back(self, x: Floats) -> Floats:
        """Return the declared positions (n, 3), m, of body points that are now at x (n, 3), m."""
        c, s = np.array(self.about), np.array(self.shift)
        found: Floats = x - s if self.rotation_matrix is None else (x - (c + s)) @ self.rotation_matrix + c
        return found


@dataclass(frozen=True)
class MovedGap:
    """Signed distance to a body that has moved rigidly."""

    own: Gap
    pose: RigidMotion

    @property
    def least_curvature_radius(self) -> float:
        """Smallest radius of curvature of convex edges of the body, m."""
        return self.own.least_curvature_radius

    @property
    def centroid(self) -> Vector3 | None:
        """Centroid of the body in its present position, m; None for an infinite body."""
        if self.own.centroid is None:
            return None
        x, y, z = self.pose.moved(np.array([self.own.centroid]))[0].tolist()
        return x, y, z

    def gap(self, X: Floats) -> Floats:
        """Return the gaps (n,), m, at points X (n, 3), m: those of the unmoved body at `back(X)`."""
        return self.own.gap(self.pose.back(X))

    def look(self, X: Floats) -> Look:
        """Return gaps (n,), m, normals n (n, 3) and Hessians H (n, 3, 3), 1/m, at points X (n, 3), m.

        From the values n0, H0 of the unmoved body, n = Q n0 and H = Q H0 Q^T.
        """
        g, n, H = self.own.look(self.pose.back(X))
        Q = self.pose.rotation_matrix
        return (g, n, H) if Q is None else (g, n @ Q.T, Q @ H @ Q.T)


def gap_as_declared(body: Gap) -> Gap:
    """Return the signed distance to a rigid body in its declared position."""
    return body.own if isinstance(body, MovedGap) else body
