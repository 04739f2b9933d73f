"""Independent friction forces of rigid bodies on a surface, from the anchor points on the rigid body."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
LEAST = 1e-300
SAME = 1e-8  # tolerance of shape functions: points that differ by less coincide


def match_points(of: Ints, N: Floats, known: Ints, shares: Floats) -> Ints:
    """Return the index among known points of each point (p,), or -1 if it is not among them.

    A point is given by nodes `of` (p, b) and shape functions N (p, b), and known points by `known` and `shares` in the
    same way. Points are identified by two weighted sums of their shape functions; the weights of nodes are unrelated
    numbers, so that different points have different sums.
    """

    from scipy.spatial import cKDTree  # 0.1 s, and only friction needs it

    def marks(nodes: Ints, parts: Floats) -> Floats:
        found: Floats = np.stack([(parts * np.sin(w * (nodes + 1.0))).sum(axis=1) for w in (1.0, np.sqrt(2.0))], axis=1)
        return found

    far, at = cKDTree(marks(known, shares)).query(marks(of, N))
    return np.where(far < SAME, at, -1)


def move_points(points: Floats, shift: Floats, rotation: Floats, through: Floats) -> Floats:
    """Return the positions of points (n, 3), m, of a rigid body that is rotated about a point and then shifted, m.

    `rotation` is the rotation vector, rad, and `through` the point. The formula uses the quaternion (w, q) of half the
    angle: v + 2 w (q x v) + 2 q x (q x v).
    """
    v, angle = points - through, float(np.sqrt(np.sum(np.square(rotation))))
    w, q = np.cos(0.5 * angle), 0.5 * np.sinc(0.5 * angle / np.pi) * np.asarray(rotation)
    once = np.cross(q, v)
    found: Floats = through + v + 2.0 * (w * once + np.cross(q, once)) + shift
    return found


def friction_traction(x: Floats, held: Floats, n: Floats, most: Floats, spring: float) -> Floats:
    """Return the friction traction (n, 3), Pa, on points x (n, 3), m, that pulls them towards their anchors.

    `held` (n, 3), m, are the anchors, `spring` the stiffness, Pa/m, and `most` (n,), Pa, the largest traction. It acts
    along the tangential part n x (d x n) of the vector d to the anchor, with n (n, 3) the surface normals.
    """
    pull = spring * np.cross(n, np.cross(held - x, n))
    size = np.sqrt((pull**2).sum(axis=1))
    found: Floats = pull * np.minimum(1.0, most / np.maximum(size, LEAST))[:, None]
    return found
