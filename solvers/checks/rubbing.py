"""What friction does to a surface, found once more: from the points of the rigid body that its nodes hold on to."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
LEAST = 1e-300


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
    """On nodes at x (n, 3), m, that hold on to places (n, 3): (n, 3), Pa, at most `most` (n,), towards these places.

    The part of their distance that lies in the plane of the surface, whose normal is n (n, 3): n x (d x n).
    """
    pull = spring * np.cross(n, np.cross(held - x, n))
    size = np.sqrt((pull**2).sum(axis=1))
    found: Floats = pull * np.minimum(1.0, most / np.maximum(size, LEAST))[:, None]
    return found
