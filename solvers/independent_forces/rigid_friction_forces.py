"""Independent friction forces of rigid bodies on a surface, from the anchor points on the rigid body."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
LEAST = 1e-300
SAME = 1e-8  # tolerance of shape functions: points that differ by less coincide


def match_points(of: Ints, N: Floats, known: Ints, shares: Floats) -> Ints:
    """Return the index (p,) of points, given by nodes `of` (p, b) and shares N (p, b), among known points, or -1.

    Points are identified by two sums of their shares, with node numbers mapped to values that no few of them relate.
    """

    from scipy.spatial import cKDTree  # 0.1 s, and only friction needs it

    def marks(nodes: Ints, parts: Floats) -> Floats:
        found: Floats = np.stack([(parts * np.sin(w * (nodes + 1.0))).sum(axis=1) for w in (1.0, np.sqrt(2.0))], axis=1)
        return found

    far, at = cKDTree(marks(known, shares)).query(marks(of, N))
    return np.where(far < SAME, at, -1)


def move_points(points: Floats, shift: Floats, rotation: Floats, through: Floats) -> Floats:
    """Return the positions of points (n, 3), m, of a rigid body rotated by a vector, rad, about a point, then shifted.

    It uses the quaternion of half the angle: v + 2 w (q x v) + 2 q x (q x v).

    By the quaternion of half the angle: v + 2 w (q x v) + 2 q x (q x v).
    """
    v, angle = points - through, float(np.sqrt(np.sum(np.square(rotation))))
    w, q = np.cos(0.5 * angle), 0.5 * np.sinc(0.5 * angle / np.pi) * np.asarray(rotation)
    once = np.cross(q, v)
    found: Floats = through + v + 2.0 * (w * once + np.cross(q, once)) + shift
    return found


def friction_traction(x: Floats, held: Floats, n: Floats, most: Floats, spring: float) -> Floats:
    """Return the traction (n, 3), Pa, on points x (n, 3), m, towards their anchors `held` (n, 3), limited to `most`
    (n,).

    It acts along the tangential part of their distance d, for a surface with normals n (n, 3): n x (d x n).
    """
    pull = spring * np.cross(n, np.cross(held - x, n))
    size = np.sqrt((pull**2).sum(axis=1))
    found: Floats = pull * np.minimum(1.0, most / np.maximum(size, LEAST))[:, None]
    return found
