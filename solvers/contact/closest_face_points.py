"""The nearest points of faces: of triangles, and of segments in the plane."""

from __future__ import annotations

import numpy as np

from softmark.solvers.energies.energy import Floats, Ints


def shares(p: Floats, t: Floats) -> Floats:
    """Shares (c, k) of the corners of faces t (c, k, d) in the points of them that are nearest to p (c, d)."""
    if t.shape[1] == 2:
        return _of_sides(p, t)
    found = _of_planes(p, t)
    out = np.flatnonzero((found < 0.0).any(axis=1))
    best = np.full(len(out), np.inf)
    for i, j in ((0, 1), (1, 2), (2, 0)):
        two = _of_sides(p[out], t[out][:, [i, j]])
        own = np.zeros((len(out), 3))
        own[:, [i, j]] = two
        far = np.linalg.norm(_from(own, p[out], t[out]), axis=1)
        nearer = far < best
        found[out[nearer]], best = own[nearer], np.minimum(far, best)
    return found


def away(p: Floats, t: Floats) -> Floats:
    """The ways (c, d), m, from the points of faces t (c, k, d) that are nearest to p (c, d) to these."""
    return _from(shares(p, t), p, t)


def least(of: Ints, far: Floats) -> Ints:
    """Of pairs of things `of` (c,) with others, so `far` (c,), the number of the nearest of each thing."""
    order = np.lexsort((far, of))
    found: Ints = order[np.unique(of[order], return_index=True)[1]]
    return found


def _from(shares: Floats, p: Floats, t: Floats) -> Floats:
    found: Floats = p - np.einsum("ca,cai->ci", shares, t)
    return found


def _of_sides(p: Floats, t: Floats) -> Floats:
    """Of segments (c, 2, d)."""
    a = t[:, 1] - t[:, 0]
    s = np.clip(np.einsum("ci,ci->c", p - t[:, 0], a) / np.einsum("ci,ci->c", a, a), 0.0, 1.0)
    return np.stack([1.0 - s, s], axis=1)


def _of_planes(p: Floats, t: Floats) -> Floats:
    """Of the planes of triangles (c, 3, 3)."""
    a, b, r = t[:, 1] - t[:, 0], t[:, 2] - t[:, 0], p - t[:, 0]
    n = np.cross(a, b)
    size = np.einsum("ci,ci->c", n, n)
    v = np.einsum("ci,ci->c", np.cross(r, b), n) / size
    w = np.einsum("ci,ci->c", np.cross(a, r), n) / size
    return np.stack([1.0 - v - w, v, w], axis=1)
