"""Largest penetration of a surface into a rigid body between its nodes, by subdivision up to a proven bound.

The gap is 1-Lipschitz. So no point of a triangle with the gap g at its centre has a gap below g - r, with r the
distance from the centre to the farthest corner. For a convex body the gap is also a convex function. Then no point has
a gap below g - 2 (h - g), with h the largest gap at a corner. If the centre is outside, no gap is below the gap to the
tangent plane at the body point nearest to the centre. On curved facets these bounds hold up to the bulge of the facet,
which is subtracted twice. Triangles that the bounds do not exclude are split into four.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from softmark.solvers.independent_forces.rigid_contact_forces import Distance

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
LEVELS = 9  # times that triangles are cut in four
COARSE = 3  # bound for bodies that are not convex
FINE = 1e-3  # relative accuracy of the depth
QUARTERS = np.array([(0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)])  # of corners and the middles of sides 01, 12, 20


def find_deepest_point(
    look: Distance, X: Floats, shapes: Callable[[Floats], Floats], triangles: Floats, convex: bool
) -> tuple[float, Floats]:
    """Return the least gap, m, of facets with nodes X (f, a, 3), m, to a rigid body, and its position (3,), m.

    If no gap is negative, the result is 0 at NaN. `look` returns gaps and normals at points, and `convex` says whether
    the body is convex. `shapes` returns the shape functions (q, a) at local points (q, 2) of a facet, which consists of
    `triangles` (t, 3, 2) in local coordinates.
    """
    facet = np.repeat(np.arange(len(X)), len(triangles))
    xi = np.tile(triangles, (len(X), 1, 1))
    best, place = 0.0, np.full(3, np.nan)
    for _ in range(LEVELS if convex else COARSE):
        if not len(xi):
            break
        four = np.concatenate([xi, xi.mean(axis=1, keepdims=True)], axis=1)
        N = shapes(four.reshape(-1, 2)).reshape(len(xi), 4, -1)
        x = np.einsum("tqa,tai->tqi", N, X[facet])
        g, n = (found.reshape(len(xi), 4, -1) for found in look(x.reshape(-1, 3)))
        least = np.unravel_index(np.argmin(g[..., 0]), g.shape[:2])
        if g[least][0] < best:
            best, place = float(g[least][0]), x[least]
        way, middle = x[:, :3] - x[:, 3:], g[:, 3, 0]
        reach = np.linalg.norm(way, axis=2).max(axis=1)
        bulge = np.linalg.norm(way.mean(axis=1), axis=1)
        if convex:
            reach = np.minimum(reach, 2.0 * (g[:, :3, 0].max(axis=1) - middle))
            plane = -np.einsum("tki,ti->tk", way, n[:, 3]).min(axis=1)
            reach = np.where(middle > 0.0, np.minimum(reach, plane), reach)
        open_ = middle - reach - 2.0 * bulge < (1.0 + FINE) * best
        xi, facet = xi[open_], np.repeat(facet[open_], len(QUARTERS))
        six = np.concatenate([xi, 0.5 * (xi + np.roll(xi, -1, axis=1))], axis=1)
        xi = six[:, QUARTERS].reshape(-1, 3, 2)
    return best, place
