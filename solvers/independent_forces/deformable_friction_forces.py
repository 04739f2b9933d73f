"""Independent forces of contact and friction between two deformable surfaces: barriers and friction springs.

The distances are computed by Gram's matrix. The barrier law and the distribution of forces to corners have formulas of
their own. A face is a triangle in space (d = 3) or a segment in a plane (d = 2).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
LEAST = 1e-300
FARTHER = 1e-2  # relative to the distance of the nearest face: a face that much farther has no friction
FLAT = 1e-12  # squared cosine between gap and normal: a face seen edge-on has no friction


def find_candidate_pairs(p: Floats, x: Floats, faces: Ints, reach: float) -> Ints:
    """Return pairs (c, 2) of points p (s, d) and faces (t, k) that may be closer to each other than `reach`, m.

    The faces are those of a surface with corners x (v, d), m.
    """
    middle = x[faces].mean(axis=1)
    size = float(np.linalg.norm(x[faces] - middle[:, None], axis=2).max(initial=0.0))
    each = cKDTree(middle).query_ball_point(p, reach + size)
    counts = [len(own) for own in each]
    flat = np.concatenate([np.array(own, dtype=np.int64) for own in each]) if any(counts) else np.zeros(0, np.int64)
    found: Ints = np.stack([np.repeat(np.arange(len(p)), counts), flat], axis=1)
    return found


def closest_points(p: Floats, t: Floats) -> Floats:
    """Return the point of each simplex t (c, k, d), inside or on its boundary, that is nearest to p (c, d): (c, d)."""
    k = t.shape[1]
    if k == 1:
        return t[:, 0]
    sides = t[:, 1:] - t[:, :1]
    gram = np.einsum("cai,cbi->cab", sides, sides)
    s = np.linalg.solve(gram, np.einsum("cai,ci->ca", sides, p - t[:, 0])[..., None])[..., 0]
    inside = (s >= 0.0).all(axis=1) & (s.sum(axis=1) <= 1.0)
    found: Floats = t[:, 0] + np.einsum("ca,cai->ci", s, sides)
    best = np.where(inside, 0.0, np.inf)
    for left_out in range(k):
        own = closest_points(p, np.delete(t, left_out, axis=1))
        far = np.linalg.norm(p - own, axis=1)
        nearer = far < best
        found[nearer], best = own[nearer], np.minimum(best, far)
    return found


def barrier_pressure(far: Floats, distance: float, stiffness: float) -> Floats:
    """Return the pressure of the barrier, Pa, at distances `far` (c,), m; zero beyond the barrier's `distance`, m."""
    s = np.minimum(far / distance, 1.0)
    found: Floats = stiffness * (2.0 * (1.0 - s**2) ** 2 / s - 8.0 * (1.0 - s**2) * s * np.log(s))
    return found


def contact_pressures(p: Floats, x: Floats, faces: Ints, pairs: Ints, distance: float, stiffness: float) -> Floats:
    """Return the contact pressure on each point p (s, d), Pa, from all faces in `pairs` (c, 2).

    Shared sides and corners of faces are not counted twice.
    """
    return contact_forces(p, x, faces, pairs, np.ones(len(p)), distance, stiffness)[0]


def contact_forces(
    p: Floats, x: Floats, faces: Ints, pairs: Ints, A: Floats, distance: float, stiffness: float
) -> tuple[Floats, Floats]:
    """Return the contact forces on points p (s, d) with areas A (s,), m^2, and the reactions on corners x (v, d), N.

    They are sums over all faces in `pairs` (c, 2), minus the contributions of shared sides and corners (Li et al. 2023,
    section 4).
    """
    found, back = np.zeros_like(p), np.zeros_like(x)
    for of, corners, count in _iterate_simplices(len(x), faces, pairs):
        some = count != 0.0
        of, corners, count = of[some], corners[some], count[some]
        foot = closest_points(p[of], x[corners])
        r = p[of] - foot
        far = np.linalg.norm(r, axis=1)
        f = (A[of] * count * barrier_pressure(far, distance, stiffness) / np.maximum(far, LEAST))[:, None] * r
        np.add.at(found, of, f)
        np.add.at(back, corners, -barycentric_coordinates(foot, x[corners])[:, :, None] * f[:, None])
    return found, back


def _iterate_simplices(v: int, faces: Ints, pairs: Ints) -> Iterator[tuple[Any, Any, Any]]:
    """Yield points (c,), the corners (c, k) of simplices, and multiplicities (c,): for faces, for sides, for corners.

    `v` is the number of all corners of the surface.
    """
    k = faces.shape[1]
    corners = faces[pairs[:, 1]]
    yield pairs[:, 0], corners, np.ones(len(pairs))
    met = np.repeat(pairs[:, 0], k), corners.ravel()
    of, share = np.zeros(0, dtype=np.int64), np.zeros(0)
    if k == 3:
        ends = np.sort(np.stack([corners, np.roll(corners, -1, axis=1)], axis=2), axis=2).reshape(-1, 2)
        rows = np.column_stack([np.repeat(pairs[:, 0], 3), ends])
        sides, count = np.unique(rows, axis=0, return_counts=True)
        yield sides[:, 0], sides[:, 1:], 1.0 - count
        of = np.repeat(sides[:, 0], 2) * v + sides[:, 1:].ravel()
        share = np.repeat(count - 1.0, 2)
    keys, back = np.unique(np.concatenate([met[0] * v + met[1], of]), return_inverse=True)
    each = np.concatenate([-np.ones(len(pairs) * k), share])
    yield keys // v, (keys % v)[:, None], 1.0 + np.bincount(back, each)


def barycentric_coordinates(foot: Floats, t: Floats) -> Floats:
    """Return the barycentric coordinates (c, k) of points `foot` (c, d) in simplices t (c, k, d)."""
    if t.shape[1] == 1:
        return np.ones((len(t), 1))
    sides = t[:, 1:] - t[:, :1]
    gram = np.einsum("cai,cbi->cab", sides, sides)
    s = np.linalg.solve(gram, np.einsum("cai,ci->ca", sides, foot - t[:, 0])[..., None])[..., 0]
    return np.concatenate([1.0 - s.sum(axis=1, keepdims=True), s], axis=1)


def friction_forces(
    p: Floats, x: Floats, faces: Ints, pairs: Ints, pull: Floats, most: Floats
) -> tuple[Floats, Floats]:
    """Return the friction forces on points p (s, d) and corners x (v, d), N, from springs with limited forces.

    `pull` (s, d) are the spring forces and `most` (s,) their limits, N. The reaction acts on the faces nearest to the
    point, at the position of the point, without a net moment. For this the corners also receive forces c r along the
    gap vector r. Their coefficients c have the sum 0 and, except for a part along r, sum c x = f, so that they balance
    the moment of the friction force f about the face.
    """
    size = np.linalg.norm(pull, axis=1)
    f = -pull * np.minimum(1.0, most / np.maximum(size, LEAST))[:, None]
    on = np.zeros_like(x)
    pairs = pairs[size[pairs[:, 0]] > 0.0]
    t = x[faces[pairs[:, 1]]]
    r = p[pairs[:, 0]] - closest_points(p[pairs[:, 0]], t)
    for number, weight in enumerate(_friction_shares(pairs[:, 0], r, t).tolist()):
        if not weight:
            continue
        one, corners = pairs[number, 0], faces[pairs[number, 1]]
        y, gap, k, d = x[corners], r[number], len(corners), x.shape[1]
        A = np.zeros((d + 1, k + 1))
        A[:d, :k], A[d, :k], A[:d, k] = y.T, 1.0, gap / np.linalg.norm(gap)
        share = np.linalg.solve(A, np.append(p[one] - gap, 1.0))[:k]
        c = np.linalg.solve(A, np.append(f[one], 0.0))[:k]
        np.add.at(on, corners, weight * (np.outer(c, gap) - np.outer(share, f[one])))
    return f, on


def normals(t: Floats) -> Floats:
    """Return the unit normals (c, d) of faces t (c, d, d)."""
    a = t[:, 1] - t[:, 0]
    n = np.cross(a, t[:, 2] - t[:, 0]) if t.shape[1] == 3 else a[:, ::-1] * (1.0, -1.0)
    found: Floats = n / np.sqrt((n**2).sum(axis=1))[:, None]
    return found


def _friction_shares(of: Ints, r: Floats, t: Floats) -> Floats:
    """Return the fraction of the friction of a point that the face of each pair takes (c,).

    `of` (c,) is the point of each pair, `r` (c, d), m, the gap to the face, and `t` (c, d, d), m, the face. A fraction
    is proportional to the squared cosine between gap and normal; it falls to zero linearly where a face is one percent
    farther than the nearest face.
    """
    far, cosine = np.sqrt((r**2).sum(axis=1)), (r * normals(t)).sum(axis=1)
    shares = np.zeros(len(of))
    for one in np.unique(of):
        own = np.flatnonzero(of == one)
        near = far[own].min()
        excess = (far[own] - near) / (FARTHER * near)
        share = (cosine[own] / far[own]) ** 2 * np.clip(1.0 - excess, 0.0, 1.0)
        share[share < FLAT] = 0.0
        if not share.any():
            share[np.argmin(far[own])] = 1.0
        shares[own] = share / share.sum()
    return shares
