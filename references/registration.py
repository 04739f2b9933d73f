"""Rigid registration of one measurement to another, with the remaining distances.

    kabsch         points to corresponding points
    icp            points to a surface, each to its closest point
    face_to_face   a flat face to a flat face

Registration of a deformed shape to a model hides that part of the model's error that is a rigid motion. Register only
parts that do not deform: the glued face, or two reconstructions of one and the same state.
"""

from __future__ import annotations

import math
from dataclasses import field
from typing import TYPE_CHECKING

from softmark.records import dataclass
from softmark.references.measured_data import Residual
from softmark.references.surface_geometry import SurfaceSearch, area_centroid, area_vectors

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Ints = NDArray[np.int64]
else:
    from softmark.references.lazy_imports import np

STEPS = 100
TOLERANCE = 1e-12  # relative to the extent: size of the last step
GAIN = 1e-7  # relative to the sum of squares: gain of the last step
FIRST_DAMPING = 1e-3
LEAST_DAMPING = 1e-9  # keeps undetermined motions at zero


@dataclass(frozen=True)
class RigidMotion:
    """Rigid motion x -> R x + t."""

    rotation: Array = field(default_factory=lambda: np.eye(3))  # R (3, 3)
    shift: Array = field(default_factory=lambda: np.zeros(3))  # t (3,), m

    def __call__(self, points: Array) -> Array:
        """Return the moved points (n, 3), m."""
        return points @ self.rotation.T + self.shift

    def then(self, later: RigidMotion) -> RigidMotion:
        """Return this motion followed by `later`."""
        return RigidMotion(later.rotation @ self.rotation, later.rotation @ self.shift + later.shift)

    @property
    def angle(self) -> float:
        """Rotation angle, rad."""
        twice = np.array([self.rotation[2, 1] - self.rotation[1, 2], self.rotation[0, 2] - self.rotation[2, 0],
                          self.rotation[1, 0] - self.rotation[0, 1]])  # fmt: skip
        return math.atan2(float(np.linalg.norm(twice)), float(np.trace(self.rotation)) - 1)


@dataclass(frozen=True)
class Registration:
    """Result of a registration: the rigid motion, the remaining distances and the method."""

    motion: RigidMotion
    residual: Residual
    steps: int = 0
    converged: bool = True


def kabsch(source: Array, target: Array, weights: Array | None = None) -> Registration:
    """Return the rigid motion of points (n, 3) that minimises sum w |R x + t - y|^2, without reflection.

    Source: Kabsch 1976, Acta Crystallographica A32:922; Umeyama 1991, IEEE PAMI 13:376, for the sign.
    """
    w = np.ones(len(source)) if weights is None else weights
    mean_x, mean_y = (w @ p / w.sum() for p in (source, target))
    U, _, Vt = np.linalg.svd((target - mean_y).T @ (w[:, None] * (source - mean_x)))
    R = U @ np.diag([1.0, 1.0, np.sign(np.linalg.det(U) * np.linalg.det(Vt))]) @ Vt
    motion = RigidMotion(R, mean_y - R @ mean_x)
    return Registration(motion, Residual.of(np.linalg.norm(motion(source) - target, axis=1)))


def icp(points: Array, target: SurfaceSearch, start: RigidMotion | None = None, keep: float = 1.0) -> Registration:
    """Return the motion of points (n, 3) that minimises the sum of squares of their distances to a surface.

    Levenberg-Marquardt steps are applied to the distances, whose gradients are the directions from the closest points.
    A motion that the surface does not determine, such as that of a cylinder about its axis, stays unchanged. `keep` is
    the fraction of the points, the closest ones, that is registered; the residual is that of all points.
    Source: Chen and Medioni 1992, Image and Vision Computing 10:145; Fitzgibbon 2003, same journal 21:1145.
    """
    extent = float(np.ptp(target.points, axis=0).max())
    match = _Match.of(points, start or RigidMotion(), target, keep)
    damping, steps, settled = FIRST_DAMPING, 0, match.cost == 0
    while not settled and steps < STEPS:
        steps += 1
        trial = _Match.of(points, match.motion.then(match.step(extent, damping)), target, keep)
        moved = float(np.abs(trial.placed - match.placed).max())
        settled = moved <= TOLERANCE * extent
        if trial.cost < match.cost:
            settled |= match.cost - trial.cost <= GAIN * match.cost
            match, damping = trial, max(damping / 10, LEAST_DAMPING)
        else:
            damping *= 10
    return Registration(match.motion, Residual.of(match.distances), steps, settled)


@dataclass(frozen=True)
class _Match:
    """Moved points and their closest points on the target."""

    motion: RigidMotion
    placed: Array  # (n, 3)
    goals: Array  # (n, 3)
    directions: Array  # (n, 3): the gradient of each distance
    distances: Array  # (n,)
    kept: NDArray[np.bool_]  # (n,)
    cost: float

    @classmethod
    def of(cls, points: Array, motion: RigidMotion, target: SurfaceSearch, keep: float) -> _Match:
        placed = motion(points)
        found = target.closest(placed)
        normals = area_vectors(target.points, target.triangles[found.triangles])
        away = placed - found.points
        flat = found.distances <= 1e-9 * np.ptp(target.points, axis=0).max()
        along = np.where(flat[:, None], normals, away)
        along = along / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-300)
        kept = found.distances <= np.quantile(found.distances, keep)
        cost = float((found.distances[kept] ** 2).sum())
        return cls(motion, placed, found.points, along, found.distances, kept, cost)

    def step(self, extent: float, damping: float) -> RigidMotion:
        """Return the motion that makes the distances zero to first order, reduced by `damping`.

        `extent` is the size of the point set, m.
        """
        x, n = self.placed[self.kept], self.directions[self.kept]
        middle = x.mean(axis=0)
        J = np.hstack([np.cross((x - middle) / extent, n), n])  # (m, 6): of a turn times extent, of a shift
        r = np.einsum("mi,mi->m", n, x - self.goals[self.kept])
        K = J.T @ J
        change = -np.linalg.solve(K + damping * np.trace(K) * np.eye(6), J.T @ r)
        R = rotation_matrix(change[:3] / extent)
        return RigidMotion(R, middle + change[3:] - R @ middle)


def rotation_matrix(omega: Array) -> Array:
    """Return the matrix (3, 3) of a rotation by |omega| rad about omega (3,). Source: Rodrigues 1840."""
    angle = float(np.linalg.norm(omega))
    if angle == 0:
        return np.eye(3)
    K = np.cross(np.eye(3), omega / angle)  # K x = axis cross x
    return np.eye(3) + math.sin(angle) * K + (1 - math.cos(angle)) * (K @ K)


def shortest_rotation(a: Array, b: Array) -> Array:
    """Return the matrix (3, 3) of the smallest rotation of the unit vector a (3,) to b (3,), which is not -a."""
    axis, cosine = np.cross(a, b), float(a @ b)
    sine = float(np.linalg.norm(axis))
    return rotation_matrix(axis / sine * math.atan2(sine, cosine)) if sine > 0 else np.eye(3)


def face_to_face(points: Array, triangles: Ints, onto: Array, onto_triangles: Ints) -> Registration:
    """Return the motion of a flat face onto a flat face: mean normal to mean normal, centroid to centroid.

    The motion does not rotate about the normal, because this angle is undetermined for two discs. The residual is the
    distance of the face's points from the target plane: it measures flatness, not the position of the rim.
    """
    normals = [area_vectors(p, t).sum(axis=0) for p, t in ((points, triangles), (onto, onto_triangles))]
    a, b = (n / np.linalg.norm(n) for n in normals)
    R = shortest_rotation(a, b)
    goal = area_centroid(onto, onto_triangles)
    motion = RigidMotion(R, goal - R @ area_centroid(points, triangles))
    placed = motion(points[np.unique(triangles)])
    return Registration(motion, Residual.of((placed - goal) @ b))
