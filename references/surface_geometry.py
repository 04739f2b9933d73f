"""Geometry of triangulated surfaces: areas, normals, volumes, closest points and ray intersections.

Points are (n, 3) in m, triangles (t, 3) indices into them, counter-clockwise from outside. Closest points are exact: a
k-d tree only excludes triangles that cannot contain them.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Ints = NDArray[np.int64]
else:
    from softmark.references.lazy_imports import np

PAIRS = 500_000
"""Pairs of a query and a triangle that are looked at together: some 100 MB of temporary arrays."""

SLACK = 1e-12
"""Relative rounding of a distance, by which the search reaches further than it should need to."""


def area_vectors(points: Array, triangles: Ints) -> Array:
    """Return the area vector (b - a) x (c - a) / 2 of each triangle, (t, 3), m^2.

    It points along the outward normal, and its length is the area.
    """
    a, b, c = (points[triangles[:, i]] for i in range(3))
    return np.asarray(np.cross(b - a, c - a) / 2)


def areas(points: Array, triangles: Ints) -> Array:
    """Return the area of each triangle, (t,), m^2."""
    return np.asarray(np.linalg.norm(area_vectors(points, triangles), axis=1))


def unit_normals(points: Array, triangles: Ints) -> Array:
    """Return the outward unit normal of each triangle, (t, 3); zero for a triangle without area."""
    return _unit_vectors(area_vectors(points, triangles))


def vertex_normals(points: Array, triangles: Ints) -> Array:
    """Return the outward unit normal at each point, (n, 3): adjacent normals weighted by their angles at the point.

    Source: Baerentzen and Aanaes 2005, IEEE Transactions on Visualization and Computer Graphics 11:243.
    """
    corners = points[triangles]  # (t, 3, 3)
    normals = unit_normals(points, triangles)
    total = np.zeros_like(points)
    for i in range(3):
        e, f = (_unit_vectors(corners[:, (i + k) % 3] - corners[:, i]) for k in (1, 2))
        angle = np.arccos(np.clip(np.einsum("ti,ti->t", e, f), -1, 1))
        np.add.at(total, triangles[:, i], angle[:, None] * normals)
    return _unit_vectors(total)


def signed_volume(points: Array, triangles: Ints) -> float:
    """Return the volume inside a closed surface, m^3: the sum of a . (b x c) / 6 over its triangles.

    The volume is negative if the surface is inside out.
    """
    if len(triangles) == 0:
        return 0.0
    a, b, c = (points[triangles[:, i]] - points[triangles[0, 0]] for i in range(3))
    return float(np.einsum("ti,ti->", a, np.cross(b, c)) / 6)


def area_centroid(points: Array, triangles: Ints) -> Array:
    """Return the centroid of a surface, (3,), m."""
    weights = areas(points, triangles)
    return np.asarray(weights @ points[triangles].mean(axis=1) / weights.sum())


def count_open_edges(triangles: Ints) -> int:
    """Return the number of edges that do not belong to exactly two triangles with opposite directions."""
    if len(triangles) == 0:
        return 0
    a, b = (np.concatenate([triangles[:, (i + k) % 3] for i in range(3)]) for k in (0, 1))
    low, high = np.minimum(a, b), np.maximum(a, b)
    _, edge = np.unique(low * (int(triangles.max()) + 1) + high, return_inverse=True)
    forth, back = (np.bincount(edge[way], minlength=edge.max() + 1) for way in (a < b, a > b))
    return int(((forth != 1) | (back != 1)).sum())


def find_connected_parts(count: int, triangles: Ints) -> Ints:
    """Return for each triangle the number of its connected part, (t,); triangles that share a point are connected."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    edges = (np.repeat(triangles[:, 0], 2), triangles[:, 1:].ravel())
    links = coo_matrix((np.ones(len(edges[0])), edges), shape=(count, count))
    labels = connected_components(links, directed=False)[1]
    return np.asarray(labels[triangles[:, 0]], dtype=np.int64)


def drop_unused_points(points: Array, triangles: Ints) -> tuple[Array, Ints]:
    """Return the surface without points that no triangle uses."""
    kept, renumbered = np.unique(triangles, return_inverse=True)
    return points[kept], renumbered.reshape(triangles.shape).astype(np.int64)


def _unit_vectors(vectors: Array) -> Array:
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / np.where(lengths > 0, lengths, 1.0)


# ------------------------------------------------------------------ closest points


@dataclass(frozen=True)
class ClosestPoints:
    """Closest points on a surface for a set of query points, with distances and triangles."""

    points: Array  # (n, 3), m
    distances: Array  # (n,), m
    triangles: Ints  # (n,): where they lie


@dataclass(frozen=True)
class SurfaceSearch:
    """Surface prepared for many closest-point queries. It has at least one triangle."""

    points: Array  # (n, 3), m
    triangles: Ints  # (t, 3)

    def closest(self, queries: Array) -> ClosestPoints:
        """Return the exact closest points on the surface for the query points (n, 3), m."""
        found = ClosestPoints(np.empty_like(queries), np.empty(len(queries)), np.empty(len(queries), dtype=np.int64))
        bound = self._distance_bound(queries)
        for chunk in self._query_batches(queries, bound):
            which, triangle = self._candidate_pairs(queries[chunk], bound[chunk])
            points = closest_in_triangles(queries[chunk][which], self.points[self.triangles[triangle]])
            distances = np.linalg.norm(points - queries[chunk][which], axis=1)
            best = _first_minimum(which, distances, chunk.stop - chunk.start)
            found.points[chunk], found.distances[chunk] = points[best], distances[best]
            found.triangles[chunk] = triangle[best]
        return found

    def _distance_bound(self, queries: Array) -> Array:
        """Return the distance of each query point (n,), m, to the triangle with the nearest centre, as upper bound."""
        nearest = self._centre_tree.query(queries)[1]
        points = closest_in_triangles(queries, self.points[self.triangles[nearest]])
        distances = np.linalg.norm(points - queries, axis=1)
        scale = np.abs(queries).max(initial=0.0) + np.abs(self.points).max()
        return np.asarray(distances * (1 + SLACK) + SLACK * scale)

    def _query_batches(self, queries: Array, bound: Array) -> Iterator[slice]:
        """Yield slices of the points `queries` (n, 3), m, each with about PAIRS candidate triangles in total.

        Candidates of a point are the triangles within its distance `bound` (n,), m. A slice has at least one point.
        """
        counts = sum(
            np.asarray(tree.query_ball_point(queries, bound + radius, return_length=True))
            for tree, _, radius in self._size_groups
        )
        group = np.cumsum(counts) // PAIRS
        edges = [0, *(np.flatnonzero(np.diff(group)) + 1).tolist(), len(queries)]
        return (slice(a, b) for a, b in pairwise(edges) if b > a)

    def _candidate_pairs(self, queries: Array, bound: Array) -> tuple[Ints, Ints]:
        """Return pairs (p,) of a query and a triangle whose bounding ball is within the query's distance bound."""
        which, triangle = [], []
        for tree, members, radius in self._size_groups:
            near = tree.query_ball_point(queries, bound + radius)
            which.append(np.repeat(np.arange(len(queries)), [len(n) for n in near]))
            triangle.append(members[np.concatenate(near).astype(np.int64)])
        q, t = np.concatenate(which), np.concatenate(triangle)
        gap = np.linalg.norm(queries[q] - self._triangle_centres[t], axis=1) - self._bounding_radii[t]
        near_enough = gap <= bound[q]
        return q[near_enough], t[near_enough]

    @cached_property
    def _triangle_centres(self) -> Array:
        return np.asarray(self.points[self.triangles].mean(axis=1))

    @cached_property
    def _bounding_radii(self) -> Array:
        """Radius of the bounding ball of each triangle about its centre, (t,), m."""
        apart = self.points[self.triangles] - self._triangle_centres[:, None]
        return np.asarray(np.linalg.norm(apart, axis=2).max(axis=1) * (1 + SLACK))

    @cached_property
    def _centre_tree(self) -> Any:
        from scipy.spatial import cKDTree

        return cKDTree(self._triangle_centres)

    @cached_property
    def _size_groups(self) -> list[tuple[Any, Ints, float]]:
        """Triangles grouped by size: for each group a k-d tree of centres, the triangle numbers and the largest radius.

        One large triangle among small ones would otherwise widen every search.
        """
        from scipy.spatial import cKDTree

        octave = np.round(np.log2(np.maximum(self._bounding_radii, 1e-300)))
        groups = [np.flatnonzero(octave == o) for o in np.unique(octave)]
        return [(cKDTree(self._triangle_centres[g]), g, float(self._bounding_radii[g].max())) for g in groups]


def _first_minimum(which: Ints, values: Array, count: int) -> Ints:
    """Return the index of the first smallest value in each of `count` groups, (count,); `which` are the groups."""
    least = np.full(count, np.inf)
    np.minimum.at(least, which, values)
    candidates = np.flatnonzero(values == least[which])[::-1]
    first = np.empty(count, dtype=np.int64)
    first[which[candidates]] = candidates  # of several assignments the last one stays
    return first


def closest_in_triangles(p: Array, corners: Array) -> Array:
    """Return the points (n, 3) of triangles with corners (n, 3, 3) that are closest to p (n, 3).

    Source: Ericson 2005, Real-Time Collision Detection, section 5.1.5 (regions of Voronoi).
    """
    a, ab, ac = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    d1, d2, d3, d4, d5, d6 = (np.einsum("ni,ni->n", edge, p - corners[:, i]) for i in range(3) for edge in (ab, ac))
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    zero, one = np.zeros_like(d1), np.ones_like(d1)
    regions = [
        (d1 <= 0) & (d2 <= 0),  # a
        (d3 >= 0) & (d4 <= d3),  # b
        (vc <= 0) & (d1 >= 0) & (d3 <= 0),  # edge ab
        (d6 >= 0) & (d5 <= d6),  # c
        (vb <= 0) & (d2 >= 0) & (d6 <= 0),  # edge ac
        (va <= 0) & (d4 >= d3) & (d5 >= d6),  # edge bc
    ]
    on_bc = _safe_fraction(d4 - d3, (d4 - d3) + (d5 - d6))
    inside = va + vb + vc
    v = np.select(regions, [zero, one, _safe_fraction(d1, d1 - d3), zero, zero, 1 - on_bc], _safe_fraction(vb, inside))
    w = np.select(regions, [zero, zero, zero, one, _safe_fraction(d2, d2 - d6), on_bc], _safe_fraction(vc, inside))
    return np.asarray(a + v[:, None] * ab + np.minimum(w, 1 - v)[:, None] * ac)


def _safe_fraction(part: Array, whole: Array) -> Array:
    """Return part / whole limited to the range from 0 to 1, and 0 where whole is 0 (a triangle without area)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(whole != 0, part / np.where(whole != 0, whole, 1.0), 0.0)
    return np.clip(share, 0.0, 1.0)


# ------------------------------------------------------------------ rays


def ray_distances(origins: Array, directions: Array, points: Array, triangles: Ints) -> Array:
    """Return the distances (n,) along rays to their first intersection with a surface; inf without one.

    Distances are in units of the lengths of `directions`. A hit at the origin itself counts as zero.
    Source: Moeller and Trumbore 1997, J. Graphics Tools 2:21.
    """
    a = points[triangles[:, 0]]
    ab, ac = points[triangles[:, 1]] - a, points[triangles[:, 2]] - a
    rows = max(1, PAIRS // max(1, len(triangles)))
    found = [
        _ray_block_distances(origins[i : i + rows], directions[i : i + rows], a, ab, ac)
        for i in range(0, len(origins), rows)
    ]
    return np.concatenate(found) if found else np.zeros(0)


def _ray_block_distances(o: Array, d: Array, a: Array, ab: Array, ac: Array) -> Array:
    h = np.cross(d[:, None], ac)  # (n, t, 3)
    determinant = np.einsum("nti,ti->nt", h, ab)
    scale = np.linalg.norm(h, axis=2) * np.linalg.norm(ab, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        s = o[:, None] - a
        v = np.einsum("nti,nti->nt", h, s) / determinant
        q = np.cross(s, ab)
        w = np.einsum("nti,ni->nt", q, d) / determinant
        t = np.einsum("nti,ti->nt", q, ac) / determinant
        edge = 1e-9  # of the triangle: rays along an edge meet one of its two triangles at least
        hit = (np.abs(determinant) > 1e-14 * scale) & (v >= -edge) & (w >= -edge) & (v + w <= 1 + edge)
    return np.asarray(np.where(hit & (t >= -1e-12), np.maximum(t, 0), np.inf).min(axis=1, initial=np.inf))


def normal_distances(origins: Array, normals: Array, points: Array, triangles: Ints) -> Array:
    """Return the signed distances (n,), m, from origins to a surface along unit normals, in either direction.

    The nearer of both intersections counts. Distances are inf without an intersection.
    """
    out, back = (ray_distances(origins, sign * normals, points, triangles) for sign in (1.0, -1.0))
    return np.where(out <= back, out, -back)
