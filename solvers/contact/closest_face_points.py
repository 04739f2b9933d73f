"""Closest points on faces: triangles in space, or line segments in the plane."""

from __future__ import annotations

import numpy as np

from softmark.solvers.energies.energy import Floats, Ints


def closest_point_weights(p: Floats, t: Floats) -> Floats:
    """Return the shape functions (c, k) of face corners, evaluated at the closest point on each face.

    `p` (c, d), m, are the points and `t` (c, k, d), m, the corners of one face for each point.
    """
    if t.shape[1] == 2:
        return _closest_segment_weights(p, t)
    found = _projected_barycentric_coordinates(p, t)
    out = np.flatnonzero((found < 0.0).any(axis=1))
    best = np.full(len(out), np.inf)
    for i, j in ((0, 1), (1, 2), (2, 0)):
        two = _closest_segment_weights(p[out], t[out][:, [i, j]])
        own = np.zeros((len(out), 3))
        own[:, [i, j]] = two
        far = np.linalg.norm(_vectors_from_face_points(own, p[out], t[out]), axis=1)
        nearer = far < best
        found[out[nearer]], best = own[nearer], np.minimum(far, best)
    return found


def vectors_from_closest_points(p: Floats, t: Floats) -> Floats:
    """Return the vectors (c, d), m, from the closest points on faces t (c, k, d) to the points p (c, d)."""
    return _vectors_from_face_points(closest_point_weights(p, t), p, t)


def nearest_pair_of_each(of: Ints, far: Floats) -> Ints:
    """Return, for each point, the index of its pair with the smallest distance.

    `of` (c,) is the number of the point in each pair, and `far` (c,) the distance of each pair, m.
    """
    order = np.lexsort((far, of))
    found: Ints = order[np.unique(of[order], return_index=True)[1]]
    return found


def _vectors_from_face_points(shares: Floats, p: Floats, t: Floats) -> Floats:
    """Return the vectors (c, d), m, from points on faces t (c, k, d) to the points p (c, d).

    `shares` (c, k) are the shape functions of the face corners at the points on the faces.
    """
    found: Floats = p - np.einsum("ca,cai->ci", shares, t)
    return found


def _closest_segment_weights(p: Floats, t: Floats) -> Floats:
    """Return the shape functions (c, 2) of the ends of segments t (c, 2, d) at the points closest to p (c, d)."""
    a = t[:, 1] - t[:, 0]
    s = np.clip(np.einsum("ci,ci->c", p - t[:, 0], a) / np.einsum("ci,ci->c", a, a), 0.0, 1.0)
    return np.stack([1.0 - s, s], axis=1)


def _projected_barycentric_coordinates(p: Floats, t: Floats) -> Floats:
    """Return barycentric coordinates (c, 3) of points p (c, 3) projected onto planes of triangles t (c, 3, 3)."""
    a, b, r = t[:, 1] - t[:, 0], t[:, 2] - t[:, 0], p - t[:, 0]
    n = np.cross(a, b)
    size = np.einsum("ci,ci->c", n, n)
    v = np.einsum("ci,ci->c", np.cross(r, b), n) / size
    w = np.einsum("ci,ci->c", np.cross(a, r), n) / size
    return np.stack([1.0 - v - w, v, w], axis=1)
