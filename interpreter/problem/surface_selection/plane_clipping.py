"""Exact cutting of flat triangles along planes."""

from __future__ import annotations

import numpy as np

from softmark.interpreter.problem.surface_selection.facet_patches import ConditionOnPatches, Floats, Ints


def cut_along_planes(asked: ConditionOnPatches, f: Ints, tri: Floats) -> tuple[Ints, Floats]:
    """Cut triangles (n, 3, 2) of affine facets f until no plane among the borders crosses any."""
    for b, border in enumerate(asked.condition.borders):
        if border.plane is not None:
            f, tri = _cut_along_plane(asked, b, f, tri)
    return f, tri


def _cut_along_plane(asked: ConditionOnPatches, b: int, f: Ints, tri: Floats) -> tuple[Ints, Floats]:
    d = asked.level(b, asked.patches.at(f, tri))
    d = np.where(np.abs(d) <= asked.slack[b], 0.0, d)
    crossed = (d.min(axis=1) < 0.0) & (d.max(axis=1) > 0.0) & ~asked.settled[f, b]
    if not crossed.any():
        return f, tri
    own, (o, p, q) = f[crossed], rotate_to_first(tri[crossed], odd_corner(d[crossed])).transpose(1, 0, 2)
    do, dp, dq = rotate_to_first(d[crossed], odd_corner(d[crossed])).T
    P, Q = (o + (do / (do - e))[:, None] * (end - o) for e, end in ((dp, p), (dq, q)))
    made = np.concatenate([np.stack(t, axis=1) for t in ((o, P, Q), (P, p, Q), (p, q, Q))])
    owners = np.tile(own, 3)
    real = np.abs(areas(made)) > 0.0
    return np.concatenate([f[~crossed], owners[real]]), np.concatenate([tri[~crossed], made[real]])


def odd_corner(d: Floats) -> Ints:
    """Return the corner (n,) whose level differs in sign from the two others, for levels d (n, 3) of both signs."""
    positive, negative = (d > 0.0).sum(axis=1), (d < 0.0).sum(axis=1)
    sign = np.where(positive == 1, 1.0, -1.0)
    found: Ints = np.argmax(sign[:, None] * d, axis=1)
    return np.where((positive == 1) | (negative == 1), found, 0)


def rotate_to_first(rows: Floats, corner: Ints) -> Floats:
    """Return rows (n, 3, ...) rotated so that the given corner (n,) comes first."""
    turned = (corner[:, None] + np.arange(3)) % 3
    found: Floats = rows[np.arange(len(rows))[:, None], turned]
    return found


def areas(tri: Floats) -> Floats:
    """Return signed areas (n,) of triangles (n, 3, 2) in local coordinates, negative if clockwise."""
    u, v = tri[:, 1] - tri[:, 0], tri[:, 2] - tri[:, 0]
    found: Floats = 0.5 * (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
    return found
