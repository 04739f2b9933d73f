"""Quadrilateral meshes of polygons: grids if the sides allow it, else triangles, each split into three.

Triangles are a Delaunay triangulation, refined by Ruppert (1995, J. Algorithms 18:548). A side with a point close to it
is halved, and a triangle that is too large or too thin gets a point at its circumcentre.
"""

from __future__ import annotations

import math

import numpy as np

from softmark.solvers.mesh.cell_counts import count_divisions
from softmark.solvers.mesh.conforming_planes import Cut, cuts_along
from softmark.solvers.mesh.files.triangle_proximity import edges_of_triangles
from softmark.solvers.mesh.mesh import Floats, Ints
from softmark.solvers.mesh.polygons import Corners, coordinate_range, edges, is_axis_parallel, turn_sines
from softmark.solvers.mesh.structured_meshes import PlaneMesh, grid, grid_between_lines, lines_through

LARGE = 1.0  # largest circumradius of a triangle, relative to the cell size
THIN = 1.3  # largest circumradius relative to the shortest edge: the least angle is then 22.6 degrees
SHORTEST = 0.2  # relative to the size and the shortest side: sides are halved to no less
ROUNDS, SMOOTHED = 60, 6


def mesh_polygon(corners: Corners, size: float, cuts: tuple[Cut, ...] = ()) -> PlaneMesh:
    """Return quadrilaterals with edges of about `size` (m) in a simple polygon with counter-clockwise corners.

    If all sides are parallel to the axes, grid lines also lie on the cuts of the polygon's coordinates, which are
    called `first` and `second`.
    """
    if is_axis_parallel(corners):
        return _rectilinear_grid(corners, size, cuts)
    if len(corners) == 4 and min(turn_sines(corners)) > 0.3:
        return _bilinear_grid(corners, size)
    return _split_into_quadrilaterals(*triangulate(corners, 2.0 * size))


# ------------------------------------------------------------------ grids


def _rectilinear_grid(corners: Corners, size: float, cuts: tuple[Cut, ...]) -> PlaneMesh:
    """Return the cells of a grid through all corners that lie inside the polygon."""
    (left, low), (right, high) = coordinate_range(corners)
    x = lines_through(left, right, size, [c[0] for c in corners], cuts_along(cuts, "first"))
    y = lines_through(low, high, size, [c[1] for c in corners], cuts_along(cuts, "second"))
    whole = grid_between_lines(x, y)
    middles = whole.points[whole.quads].mean(axis=1)
    used, cells = np.unique(whole.quads[is_inside(corners, middles)], return_inverse=True)
    return PlaneMesh(whole.points[used], cells.reshape(-1, 4).astype(np.int64), whole.colour[used])


def _bilinear_grid(corners: Corners, size: float) -> PlaneMesh:
    """Return a grid between the opposite sides of a quadrilateral."""
    a, b, c, d = (np.array(p) for p in corners)
    lengths = [math.dist(*side) for side in edges(corners)]
    whole = grid(count_divisions(max(lengths[0], lengths[2]), size), count_divisions(max(lengths[1], lengths[3]), size))
    s, t = whole.points.T[..., None]
    points = (1 - s) * (1 - t) * a + s * (1 - t) * b + s * t * c + (1 - s) * t * d
    return PlaneMesh(points, whole.quads, whole.colour)


# ------------------------------------------------------------------ triangles


def _split_into_quadrilaterals(points: Floats, cells: Ints) -> PlaneMesh:
    """Split each triangle into three quadrilaterals, from its centroid to the middles of its sides.

    Corners and centroids get one colour, middles of sides the other.
    """
    n = len(points)
    sides = np.sort(edges_of_triangles(cells), axis=1)
    pairs, number = np.unique(sides, axis=0, return_inverse=True)
    at = n + number.reshape(-1, 3)
    centre = n + len(pairs) + np.arange(len(cells))
    quads = np.stack([np.stack([cells[:, k], at[:, k], centre, at[:, k - 1]], axis=1) for k in range(3)], axis=1)
    every = np.concatenate([points, points[pairs].mean(axis=1), points[cells].mean(axis=1)])
    colour = np.concatenate([np.zeros(n), np.ones(len(pairs)), np.zeros(len(cells))]).astype(np.int64)
    return PlaneMesh(every, quads.reshape(-1, 4).astype(np.int64), colour)


def triangulate(corners: Corners, size: float) -> tuple[Floats, Ints]:
    """Return points (n, 2), m, and triangles (t, 3), counter-clockwise, with edges of about `size` (m)."""
    border, sides = _border_points(corners, size)
    points = np.concatenate([border, _inner_lattice_points(corners, border, sides, size)])
    shortest = min(math.dist(*side) for side in edges(corners))
    least = SHORTEST * min(size, shortest)
    for _ in range(ROUNDS):
        cells = _delaunay_triangles(points, corners)
        split = _encroached_sides(points, sides, cells, least)
        new, more = _refinement_points(points, sides, cells, size, least) if not split.any() else (points[:0], split)
        if not len(new) and not more.any():
            break
        points, sides = _split_sides(points, sides, more)
        points = np.concatenate([points, new])
    return _smooth_inner_points(points, sides, corners)


def _border_points(corners: Corners, size: float) -> tuple[Floats, Ints]:
    """Return points (n, 2), m, along the sides of the polygon, and the pairs of points (s, 2) that are edges."""
    found: list[Floats] = []
    for a, b in edges(corners):
        n = count_divisions(math.dist(a, b), size)
        t = np.arange(n)[:, None] / n
        found.append((1.0 - t) * np.array(a) + t * np.array(b))
    points = np.concatenate(found)
    i = np.arange(len(points))
    return points, np.stack([i, np.roll(i, -1)], axis=1)


def _inner_lattice_points(corners: Corners, border: Floats, sides: Ints, size: float) -> Floats:
    """Return the points of an equilateral lattice that lie inside the polygon and not near its border."""
    (left, low), (right, high) = coordinate_range(corners)
    rows = np.arange(low, high, size * math.sqrt(0.75))
    columns = np.arange(left, right + size, size)
    x, y = np.meshgrid(columns, rows)
    x = x - 0.5 * size * (np.arange(len(rows)) % 2)[:, None]
    points = np.stack([x.ravel(), y.ravel()], axis=1)
    points = points[is_inside(corners, points)]
    far = _distance_to_sides(points, border[sides]) > 0.55 * size
    found: Floats = points[far]
    return found


def _distance_to_sides(points: Floats, sides: Floats) -> Floats:
    """Return the distance (n,), m, between points (n, 2) and the nearest of the sides (s, 2, 2)."""
    best = np.full(len(points), np.inf)
    for a, b in sides:
        d = b - a
        t = np.clip((points - a) @ d / (d @ d), 0.0, 1.0)
        best = np.minimum(best, np.linalg.norm(points - a - t[:, None] * d, axis=1))
    return best


def is_inside(corners: Corners, points: Floats) -> np.ndarray:
    """Return a mask (n,) of the points (n, 2) inside a polygon.

    A ray from an inside point to the right crosses the sides an odd number of times.
    """
    found = np.zeros(len(points), dtype=np.bool_)
    x, y = points.T
    for (a, b), (c, d) in edges(corners):
        if b != d:
            found ^= ((b > y) != (d > y)) & (x < a + (y - b) / (d - b) * (c - a))
    return found


def _delaunay_triangles(points: Floats, corners: Corners) -> Ints:
    """Return the Delaunay triangles in a polygon (t, 3), counter-clockwise."""
    from scipy.spatial import Delaunay

    cells = Delaunay(points).simplices.astype(np.int64)
    area = _triangle_areas(points, cells)
    cells[area < 0.0] = cells[area < 0.0][:, [0, 2, 1]]
    sound = np.abs(area) > 1e-12 * float(np.abs(area).max())
    cells = cells[sound]
    found: Ints = cells[is_inside(corners, points[cells].mean(axis=1))]
    return found


def _triangle_areas(points: Floats, cells: Ints) -> Floats:
    a, b, c = (points[cells[:, k]] for k in range(3))
    found: Floats = 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
    return found


def _encroached_sides(points: Floats, sides: Ints, cells: Ints, least: float) -> np.ndarray:
    """Return a mask (s,) of the border edges that must be halved.

    A border edge must be halved if it is no edge of a triangle. It must also be halved if it is longer than 2 `least`
    (m) and its diametral circle contains the opposite corner of its triangle.
    """
    n = len(points)
    own = np.sort(edges_of_triangles(cells), axis=1) @ [n, 1]
    opposite = cells[:, [2, 0, 1]].ravel()
    order = np.argsort(own)
    keys = np.sort(sides, axis=1) @ [n, 1]
    at = np.minimum(np.searchsorted(own[order], keys), len(own) - 1)
    there = own[order][at] == keys
    a, b = points[sides[:, 0]], points[sides[:, 1]]
    apex = points[opposite[order][at]]
    inner = np.einsum("si,si->s", apex - a, apex - b) < 0.0
    long = np.linalg.norm(b - a, axis=1) > 2.0 * least
    found: np.ndarray = ~there | (inner & long)
    return found


def _refinement_points(
    points: Floats, sides: Ints, cells: Ints, size: float, least: float
) -> tuple[Floats, np.ndarray]:
    """Return new points at circumcentres of bad triangles, and a mask (s,) of the border edges to be halved instead.

    Bad triangles are too large or too thin. The new points have some distance from each other. A border edge is halved
    if a circumcentre would lie in its diametral circle.
    """
    X = points[cells]
    edge = np.linalg.norm(X - np.roll(X, 1, axis=1), axis=2)
    radius = edge.prod(axis=1) / (4.0 * _triangle_areas(points, cells))
    shortest = edge.min(axis=1)
    bad = (radius > LARGE * size) | ((radius > THIN * shortest) & (shortest > least))
    centre = _circumcentres(X[bad])
    order = np.argsort(-radius[bad])
    a, b = points[sides[:, 0]], points[sides[:, 1]]
    split = np.zeros(len(sides), dtype=np.bool_)
    kept: list[tuple[Floats, float]] = []
    long = np.linalg.norm(b - a, axis=1) > 2.0 * least
    for i in order.tolist():
        c, r = centre[i], radius[bad][i]
        near = np.einsum("si,si->s", c - a, c - b) < 0.0
        if near.any():
            split |= near & long
        elif all(math.dist(c, k) > 0.7 * max(r, s) for k, s in kept):
            kept.append((c, r))
    new = np.array([k for k, _ in kept]).reshape(-1, 2)
    return new, split


def _circumcentres(X: Floats) -> Floats:
    """Return the circumcentres (t, 2) of triangles X (t, 3, 2)."""
    b, c = X[:, 1] - X[:, 0], X[:, 2] - X[:, 0]
    d = 2.0 * (b[:, 0] * c[:, 1] - b[:, 1] * c[:, 0])
    bb, cc = (b**2).sum(axis=1), (c**2).sum(axis=1)
    u = np.stack([c[:, 1] * bb - b[:, 1] * cc, b[:, 0] * cc - c[:, 0] * bb], axis=1)
    found: Floats = X[:, 0] + u / d[:, None]
    return found


def _split_sides(points: Floats, sides: Ints, which: np.ndarray) -> tuple[Floats, Ints]:
    """Split the sides marked in `which` at their middle."""
    own = sides[which]
    new = len(points) + np.arange(len(own))
    halves = np.concatenate([np.stack([own[:, 0], new], axis=1), np.stack([new, own[:, 1]], axis=1)])
    return np.concatenate([points, points[own].mean(axis=1)]), np.concatenate([sides[~which], halves])


def _smooth_inner_points(points: Floats, sides: Ints, corners: Corners) -> tuple[Floats, Ints]:
    """Move inner points to the mean of their neighbours, as long as the worst triangle does not become worse."""
    cells = _delaunay_triangles(points, corners)
    free = np.ones(len(points), dtype=np.bool_)
    free[sides] = False
    for _ in range(SMOOTHED):
        pairs = np.unique(np.sort(edges_of_triangles(cells), axis=1), axis=0)
        total, count = np.zeros_like(points), np.zeros(len(points))
        for i, j in (pairs.T, pairs.T[::-1]):
            np.add.at(total, i, points[j])
            np.add.at(count, i, 1.0)
        moved = np.where((free & (count > 0))[:, None], total / np.maximum(count, 1.0)[:, None], points)
        again = _delaunay_triangles(moved, corners)
        if _encroached_sides(moved, sides, again, np.inf).any() or _worst_quality(moved, again) < _worst_quality(
            points, cells
        ):
            break
        points, cells = moved, again
    used, number = np.unique(cells, return_inverse=True)
    return points[used], number.reshape(-1, 3).astype(np.int64)


def _worst_quality(points: Floats, cells: Ints) -> float:
    """Return the lowest triangle quality: 4 sqrt(3) times the area over the sum of squared edges, 1 at best."""
    X = points[cells]
    squares = ((X - np.roll(X, 1, axis=1)) ** 2).sum(axis=(1, 2))
    return float((4.0 * math.sqrt(3.0) * _triangle_areas(points, cells) / squares).min())
