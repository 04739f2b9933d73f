"""Proximity of triangles: self-intersections of a surface, and closest points on it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from softmark.solvers.mesh.mesh import Floats, Ints

AT_ONCE = 2_000_000  # pairs of a point and a triangle processed at once
TOUCH = 1e-9  # relative to an edge: tolerance below which an edge only touches a triangle


def find_near_triangles(places: Floats, reach: Floats, corners: Floats) -> Iterator[tuple[Ints, Ints]]:
    """Yield pairs of a place and a triangle whose bounding balls overlap, as two arrays.

    `places` (n, 3) are centres of balls with the radii `reach` (n,); triangles have `corners` (t, 3, 3).
    """
    from scipy.spatial import cKDTree

    middles = corners.mean(axis=1)
    radii = np.linalg.norm(corners - middles[:, None], axis=2).max(axis=1)
    octave = np.round(np.log2(np.maximum(radii, 1e-300)))
    for group in (np.flatnonzero(octave == o) for o in np.unique(octave)):
        tree, r = cKDTree(middles[group]), reach + float(radii[group].max())
        number = np.cumsum(tree.query_ball_point(places, r, return_length=True)) // AT_ONCE
        for part in range(int(number[-1]) + 1) if len(number) else ():
            own = np.flatnonzero(number == part)
            lists = tree.query_ball_point(places[own], r[own])
            which = np.repeat(own, [len(found) for found in lists])
            if len(which):
                yield which, group[np.concatenate(lists).astype(np.int64)]


def edges_of_triangles(triangles: Ints) -> Ints:
    """Return the two points of each edge of triangles (t, 3), in the order of the triangles, shape (3 t, 2)."""
    return triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)


def find_intersecting_triangles(points: Floats, triangles: Ints) -> NDArray[np.bool_]:
    """Return a mask (t,) of the triangles that intersect another triangle.

    Triangles with a common point are not compared, because neighbours touch.
    Source: Moeller and Trumbore (1997).
    """
    ends, of = np.unique(np.sort(edges_of_triangles(triangles), axis=1), axis=0, return_inverse=True)
    of = of.reshape(-1, 3)
    X, edge = points[triangles], points[ends]
    half = 0.5 * np.linalg.norm(edge[:, 1] - edge[:, 0], axis=1)
    pierced, through = np.zeros(len(triangles), dtype=bool), np.zeros(len(ends), dtype=bool)
    for e, t in find_near_triangles(edge.mean(axis=1), half, X):
        apart = (ends[e][:, :, None] != triangles[t][:, None, :]).all(axis=(1, 2))
        e, t = e[apart], t[apart]
        meet = _do_edges_pierce_triangles(edge[e], X[t])
        pierced[t[meet]] = True
        through[e[meet]] = True
    return pierced | through[of].any(axis=1)


def _do_edges_pierce_triangles(edge: Floats, X: Floats) -> NDArray[np.bool_]:
    """Return whether each edge (n, 2, 3) passes through the interior of its triangle (n, 3, 3), a mask (n,)."""
    d, ab, ac, o = edge[:, 1] - edge[:, 0], X[:, 1] - X[:, 0], X[:, 2] - X[:, 0], edge[:, 0] - X[:, 0]
    h, q = np.cross(d, ac), np.cross(o, ab)
    det = np.einsum("ni,ni->n", ab, h)
    size = np.linalg.norm(ab, axis=1) * np.linalg.norm(h, axis=1)
    sound = np.abs(det) > 1e-12 * size
    det = np.where(sound, det, 1.0)
    u, v, s = (np.einsum("ni,ni->n", p, r) / det for p, r in ((o, h), (d, q), (ac, q)))
    found: NDArray[np.bool_] = (
        sound & (np.minimum(u, v) > TOUCH) & (u + v < 1.0 - TOUCH) & (s > TOUCH) & (s < 1.0 - TOUCH)
    )
    return found


def closest_points(places: Floats, points: Floats, triangles: Ints, reach: float) -> tuple[Floats, Floats]:
    """Return the points (n, 3) of a surface closest to `places` (n, 3), m, and their distances (n,), m.

    A place farther from the surface than `reach` (m) gets the distance inf.
    """
    X = points[triangles]
    best, far = places.copy(), np.full(len(places), np.inf)
    for which, t in find_near_triangles(places, np.full(len(places), reach), X):
        found = _closest_in_triangle(places[which], X[t])
        away = np.linalg.norm(found - places[which], axis=1)
        order = np.lexsort((away, which))
        first = order[np.unique(which[order], return_index=True)[1]]
        nearer = first[away[first] < far[which[first]]]
        best[which[nearer]], far[which[nearer]] = found[nearer], away[nearer]
    far[far > reach] = np.inf
    return best, far


def _closest_in_triangle(p: Floats, X: Floats) -> Floats:
    """Return the point of each triangle X (n, 3, 3) closest to p (n, 3): its projection, or a point of an edge."""
    best: Floats
    a, ab, ac = X[:, 0], X[:, 1] - X[:, 0], X[:, 2] - X[:, 0]
    gram = np.stack([np.einsum("ni,ni->n", q, r) for q, r in ((ab, ab), (ab, ac), (ac, ac))])
    right = np.stack([np.einsum("ni,ni->n", q, p - a) for q in (ab, ac)])
    det = gram[0] * gram[2] - gram[1] ** 2
    sound = det > 1e-24 * gram[0] * gram[2]
    det = np.where(sound, det, 1.0)
    v, w = (gram[2] * right[0] - gram[1] * right[1]) / det, (gram[0] * right[1] - gram[1] * right[0]) / det
    within = sound & (v >= 0.0) & (w >= 0.0) & (v + w <= 1.0)
    best = a + v[:, None] * ab + w[:, None] * ac
    far = np.where(within, -1.0, np.inf)
    for i in range(3):
        q, d = X[:, i], X[:, (i + 1) % 3] - X[:, i]
        length = np.einsum("ni,ni->n", d, d)
        s = np.clip(np.einsum("ni,ni->n", d, p - q) / np.where(length > 0.0, length, 1.0), 0.0, 1.0)
        there = q + s[:, None] * d
        away = np.linalg.norm(there - p, axis=1)
        nearer = away < far
        best[nearer], far[nearer] = there[nearer], away[nearer]
    return best
