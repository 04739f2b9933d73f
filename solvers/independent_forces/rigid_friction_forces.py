"""What friction does to a surface, found once more: from the points of the rigid body that it holds on to."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
LEAST = 1e-300
SAME = 1e-8  # of shape functions: points that differ by less are one


def numbers(of: Ints, N: Floats, known: Ints, shares: Floats) -> Ints:
    """Which of known points, by nodes (k, a) and shares (k, a), those of nodes `of` (p, b), N (p, b), are (p,), or -1.

    Each is told by two sums of its shares, with numbers of nodes that no few of them have a relation between.
    """

    from scipy.spatial import cKDTree  # 0.1 s, and only friction needs it

    def marks(nodes: Ints, parts: Floats) -> Floats:
        found: Floats = np.stack([(parts * np.sin(w * (nodes + 1.0))).sum(axis=1) for w in (1.0, np.sqrt(2.0))], axis=1)
        return found

    far, at = cKDTree(marks(known, shares)).query(marks(of, N))
    return np.where(far < SAME, at, -1)


def taken(points: Floats, shift: Floats, rotation: Floats, through: Floats) -> Floats:
    """Where points (n, 3), m, of a rigid body are: turned by a vector, rad, around a point, then shifted.

    By the quaternion of half the angle: v + 2 w (q x v) + 2 q x (q x v).
    """
    v, angle = points - through, float(np.sqrt(np.sum(np.square(rotation))))
    w, q = np.cos(0.5 * angle), 0.5 * np.sinc(0.5 * angle / np.pi) * np.asarray(rotation)
    once = np.cross(q, v)
    found: Floats = through + v + 2.0 * (w * once + np.cross(q, once)) + shift
    return found


def traction(x: Floats, held: Floats, n: Floats, most: Floats, spring: float) -> Floats:
    """On points at x (n, 3), m, that hold on to places (n, 3): (n, 3), Pa, at most `most` (n,), towards these places.

    The part of their distance that lies in the plane of the surface, whose normal is n (n, 3): n x (d x n).
    """
    pull = spring * np.cross(n, np.cross(held - x, n))
    size = np.sqrt((pull**2).sum(axis=1))
    found: Floats = pull * np.minimum(1.0, most / np.maximum(size, LEAST))[:, None]
    return found
