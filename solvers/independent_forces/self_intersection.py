"""Self-intersection of a triangle surface, by segment-triangle tests independent of the contact algorithm.

For a slice through a body, the segments of its outline are tested. Surfaces that touch up to rounding do not intersect.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
PAIRS = 1 << 20  # at a time
ROUNDING = 1e-12  # relative to the products of lengths in a determinant


def find_intersections(X: Floats, faces: Ints) -> Ints:
    """Return pairs (p, 2) of faces that share no corner and intersect.

    The faces (t, d) are triangles in space, or segments in a plane, between points X (n, d), m.
    """
    near = _overlapping_boxes(X, faces)
    found = [_intersecting_pairs(X, faces, near[i : i + PAIRS]) for i in range(0, len(near), PAIRS)]
    return np.concatenate([near[:0], *found])


def _overlapping_boxes(X: Floats, faces: Ints) -> Ints:
    """Return pairs (p, 2) of faces without a common corner whose bounding boxes overlap."""
    corners = X[faces]
    low, high = corners.min(axis=1), corners.max(axis=1)
    middle, reach = 0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low, axis=1).max(initial=0.0))
    pairs: Ints = cKDTree(middle).query_pairs(2.0 * reach, output_type="ndarray").astype(np.int64)
    i, j = pairs.T
    over = np.all((low[i] <= high[j]) & (low[j] <= high[i]), axis=1)
    pairs = pairs[over]
    shared = (faces[pairs[:, 0]][:, :, None] == faces[pairs[:, 1]][:, None, :]).any(axis=(1, 2))
    found: Ints = pairs[~shared]
    return found


def _intersecting_pairs(X: Floats, faces: Ints, pairs: Ints) -> Ints:
    """Return the pairs (p, 2) of faces that intersect, among given pairs."""
    a, b = X[faces[pairs[:, 0]]], X[faces[pairs[:, 1]]]
    d = X.shape[1]
    if d == 2:
        crossed: Ints = pairs[_do_segments_cross(a, b)]
        return crossed
    met = np.zeros(len(pairs), dtype=np.bool_)
    for one, other in ((a, b), (b, a)):
        for k in range(3):
            met |= _do_segments_pierce(one[:, k], one[:, (k + 1) % 3], other)
    found: Ints = pairs[met]
    return found


def _do_segments_cross(a: Floats, b: Floats) -> Any:
    """Return for which pairs (p,) the segments a and b (p, 2, 2) cross.

    The ends of each segment must lie on both sides of the other.
    """
    one = _side_of_line(a[:, 0], a[:, 1], b[:, 0]) * _side_of_line(a[:, 0], a[:, 1], b[:, 1])
    other = _side_of_line(b[:, 0], b[:, 1], a[:, 0]) * _side_of_line(b[:, 0], b[:, 1], a[:, 1])
    return (one < 0) & (other < 0)


def _side_of_line(p: Floats, q: Floats, c: Floats) -> Floats:
    u, v = q - p, c - p
    return _sign_above_rounding(
        u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0], np.linalg.norm(u, axis=1) * np.linalg.norm(v, axis=1)
    )


def _do_segments_pierce(p: Floats, q: Floats, t: Floats) -> Any:
    """Return for which pairs (n,) the segment from p to q (n, 3) pierces the triangle t (n, 3, 3).

    The test uses the signs of five volumes.
    """
    ends = _volume_sign(t[:, 0], t[:, 1], t[:, 2], p) * _volume_sign(t[:, 0], t[:, 1], t[:, 2], q)
    round_ = [_volume_sign(p, q, t[:, k], t[:, (k + 1) % 3]) for k in range(3)]
    same = np.all([r > 0 for r in round_], axis=0) | np.all([r < 0 for r in round_], axis=0)
    return (ends < 0) & same


def _volume_sign(a: Floats, b: Floats, c: Floats, d: Floats) -> Floats:
    u, v, w = b - a, c - a, d - a
    sizes = np.linalg.norm(u, axis=1) * np.linalg.norm(v, axis=1) * np.linalg.norm(w, axis=1)
    return _sign_above_rounding(np.einsum("ij,ij->i", np.cross(u, v), w), sizes)


def _sign_above_rounding(value: Floats, size: Floats) -> Floats:
    """Return the sign of determinants (n,), zero if they may be rounding errors; `size` (n,) is their scale."""
    return np.where(np.abs(value) <= ROUNDING * size, 0.0, np.sign(value))
