"""Compiled search for the closest point on triangles, in a tree of bounding boxes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softmark.solvers.runtime.kernel_cache import kernel, kernel_part

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]


@kernel
def find_closest_triangles(
    X: Floats, low: Floats, high: Floats, child: Ints, first: Ints, corners: Floats, best: Ints, share: Floats,
    stack: Ints, own: Floats,
) -> None:  # fmt: skip
    """Find the closest triangle to each point X (n, 3), m, and write the results to `best` and `share`.

    `best` (n,) gets the number of the triangle, and `share` (n, 3) the barycentric coordinates of the closest point.
    Node k of the tree has a box from low[k] to high[k], m, and the children child[k], child[k] + 1. A leaf has child[k]
    = 0 and the triangles first[k, 0] to first[k, 1] of `corners` (t, 3, 3), m. `stack` and `own` are work arrays:
    `stack` needs twice the depth of the tree, `own` three numbers.
    """
    for i in range(len(X)):
        far = np.inf
        top, stack[0] = 0, 0
        while top >= 0:
            node = stack[top]
            top -= 1
            if _squared_distance_to_box(X, i, low, high, node) >= far:
                continue
            near = child[node]
            if near == 0:
                for t in range(first[node, 0], first[node, 1]):
                    d = _squared_distance_to_triangle(X, i, corners, t, own)
                    if d < far:
                        far, best[i] = d, t
                        share[i, 0], share[i, 1], share[i, 2] = own[0], own[1], own[2]
                continue
            other = near + 1
            if _squared_distance_to_box(X, i, low, high, other) < _squared_distance_to_box(X, i, low, high, near):
                near, other = other, near
            stack[top + 1], stack[top + 2] = other, near
            top += 2


@kernel_part
def _squared_distance_to_box(X: Floats, i: int, low: Floats, high: Floats, node: int) -> float:
    """Return the squared distance, m^2, from point i of X to the box of a tree node."""
    total = 0.0
    for k in range(3):
        d = max(low[node, k] - X[i, k], X[i, k] - high[node, k], 0.0)
        total += d * d
    return total


@kernel_part
def _dot(a: Floats, b: Floats, c: Floats, d: Floats) -> float:
    """Return the scalar product (b - a) . (d - c) of vectors between points (3,)."""
    total: float = (b[0] - a[0]) * (d[0] - c[0]) + (b[1] - a[1]) * (d[1] - c[1]) + (b[2] - a[2]) * (d[2] - c[2])
    return total


@kernel_part
def _squared_distance_to_triangle(X: Floats, i: int, corners: Floats, t: int, own: Floats) -> float:
    """Return the squared distance, m^2, from point i of X to triangle t of `corners`.

    `own` gets the barycentric coordinates of the closest point, exactly 0 on a side. The function tests which region of
    the triangle plane the point projects to: corner, side or face.
    Source: Ericson, Real-Time Collision Detection, 5.1.5.
    """
    p, a, b, c = X[i], corners[t, 0], corners[t, 1], corners[t, 2]
    d1, d2 = _dot(a, b, a, p), _dot(a, c, a, p)
    d3, d4 = _dot(a, b, b, p), _dot(a, c, b, p)
    d5, d6 = _dot(a, b, c, p), _dot(a, c, c, p)
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    v = w = 0.0
    if d1 <= 0.0 and d2 <= 0.0:
        u = 1.0
    elif d3 >= 0.0 and d4 <= d3:
        u, v = 0.0, 1.0
    elif vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        v = d1 / (d1 - d3)
        u = 1.0 - v
    elif d6 >= 0.0 and d5 <= d6:
        u, w = 0.0, 1.0
    elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        w = d2 / (d2 - d6)
        u = 1.0 - w
    elif va <= 0.0 and d4 >= d3 and d5 >= d6:
        w = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        u, v = 0.0, 1.0 - w
    else:
        v, w = vb / (va + vb + vc), vc / (va + vb + vc)
        u = 1.0 - v - w
    own[0], own[1], own[2] = u, v, w
    total = 0.0
    for k in range(3):
        d = p[k] - u * a[k] - v * b[k] - w * c[k]
        total += d * d
    return total
