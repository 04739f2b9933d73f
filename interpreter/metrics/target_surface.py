"""Target surface of a distance metric, and a test whether points lie inside or outside of it.

The distances are computed in `softmark.references.surface_geometry`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.references.surface_geometry import ClosestPoints, SurfaceSearch, unit_normals, vertex_normals

if TYPE_CHECKING:
    import numpy as np

    from softmark.interpreter.metrics.measurement import Floats, MetricInput
else:
    from softmark.solvers.runtime.lazy_modules import np

ROUNDING = 1e-9  # a smaller barycentric coordinate counts as zero: the point lies on an edge


def find_target_surface(seen: MetricInput) -> SurfaceSearch:
    """Return the target surface: a measured surface, or the surface of the probe as the reference deforms it.

    Raises Undefined if the reference has neither.
    """
    known = seen.known
    if known is not None and known.surface is not None:
        return SurfaceSearch(known.surface.points, known.surface.triangles)
    if known is None or known.u is None:
        raise Undefined("the reference has neither a measured surface nor displacements at this probe")
    if seen.triangles is None or not len(seen.triangles):
        raise Undefined("the reference gives displacements of the probe, and the probe is not a surface of triangles")
    return SurfaceSearch(seen.X + known.u, seen.triangles)


def side_of_surface(x: Floats, closest: ClosestPoints, target: SurfaceSearch) -> Floats:
    """Return 1 for points x (n, 3) outside a surface and -1 for points inside (n,), from their closest points.

    The side is the sign of (x - closest) . N, with N the normal of the face. On an edge N is the sum of both face
    normals, and at a corner the sum of all adjacent face normals, weighted by their angles. Any other normal fails at
    some corner.
    Source: Baerentzen and Aanaes 2005, IEEE Transactions on Visualization and Computer Graphics 11:243.
    """
    t, share = closest.triangles, _barycentric_coordinates(closest, target)
    N, zero = unit_normals(target.points, target.triangles[t]), share < ROUNDING  # (n, 3)
    edge, corner = zero.sum(axis=1) == 1, zero.sum(axis=1) == 2
    N[edge] = _edge_normals(target)[t[edge], zero[edge].argmax(axis=1)]
    nearest = target.triangles[t, share.argmax(axis=1)]
    N[corner] = vertex_normals(target.points, target.triangles)[nearest[corner]]
    return np.where(np.einsum("ni,ni->n", x - closest.points, N) < 0.0, -1.0, 1.0)


def _edge_normals(target: SurfaceSearch) -> Floats:
    """Return the sum of the two face normals at each edge (t, 3, 3); [:, i] is the edge opposite to corner i."""
    ends = np.sort(target.triangles[:, [[1, 2], [2, 0], [0, 1]]], axis=2).reshape(-1, 2)
    number = np.unique(ends, axis=0, return_inverse=True)[1].ravel()
    sums = np.zeros((number.max() + 1, 3))
    np.add.at(sums, number, np.repeat(unit_normals(target.points, target.triangles), 3, axis=0))
    return sums[number].reshape(-1, 3, 3)


def _barycentric_coordinates(closest: ClosestPoints, target: SurfaceSearch) -> Floats:
    """Return the barycentric coordinates of the closest points in their triangles (n, 3).

    In triangles without area all three are one third.
    """
    apart = target.points[target.triangles[closest.triangles]] - closest.points[:, None]  # (n, 3, 3)
    parts = np.stack([np.cross(apart[:, (i + 1) % 3], apart[:, (i + 2) % 3]) for i in range(3)], axis=1)
    whole = parts.sum(axis=1)  # twice the area vector
    size = np.einsum("ni,ni->n", whole, whole)
    flat = size == 0.0
    share: Floats = np.einsum("nki,ni->nk", parts, whole) / np.where(flat, 1.0, size)[:, None]
    share[flat] = 1.0 / 3.0
    return share
