"""Independent contact forces of rigid bodies on a surface: distances, pressure law and areas by other formulas.

The solver uses signed distances with Hessians, one class for each shape. Here the distance is that to the nearest point
of the rigid body, found by projection, and the normal is along the line from that point. Both are exact outside the
body, where a surface in contact should be. Inside, only the sign and an approximate size are given. Solids made of a
polygon use its winding number, closed surfaces the solid angle seen from a point (van Oosterom and Strackee 1983, "The
solid angle of a plane triangle").
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Distance = Callable[[Floats], tuple[Floats, Floats]]  # points (n, 3), m -> gaps (n,), m, and outward normals (n, 3)
Section = Callable[[Floats, Floats], tuple[Floats, Floats, Floats]]  # a, b (n,) -> gap, and its slopes along a and b

PAIRS = 4_000_000  # points times triangles at a time
MOST = 400_000_000  # largest number of these; with more, no independent check is made
LEAST = 1e-300


def half_space_distance(origin: Floats, normal: Floats) -> Distance:
    """Return the distance function of the half-space behind a plane: n . (x - o)."""
    n = np.asarray(normal, dtype=np.float64) / np.sqrt(np.sum(np.square(normal)))
    return lambda x: (x @ n - float(np.dot(origin, n)), np.tile(n, (len(x), 1)))


def ball_distance(centre: Floats, radius: float) -> Distance:
    """Return the distance function of a ball: |x - c| - R."""

    def look(x: Floats) -> tuple[Floats, Floats]:
        off = x - np.asarray(centre)
        r = np.sqrt((off**2).sum(axis=1))
        return r - radius, off / np.maximum(r, LEAST)[:, None]

    return look


def hollow_ball_distance(centre: Floats, radius: float, inner: float) -> Distance:
    """Return the distance function of a spherical shell with outer and inner radius, m.

    A point in the hollow is nearest to the inner wall.
    """
    outer = ball_distance(centre, radius)

    def look(x: Floats) -> tuple[Floats, Floats]:
        g, n = outer(x)
        within = inner - (g + radius)
        return np.where(within > g, within, g), np.where((within > g)[:, None], -n, n)

    return look


def box_distance(low: Floats, high: Floats, rounding: float = 0.0) -> Distance:
    """Return the distance function of a box between corners, m, with rounded edges.

    The nearest point is found by clamping each coordinate.
    """
    a, b = np.asarray(low) + rounding, np.asarray(high) - rounding

    def look(x: Floats) -> tuple[Floats, Floats]:
        return _rounded_gap_and_normal(x, np.clip(x, a, b), np.minimum(x - a, b - x).min(axis=1), rounding)

    return look


def _rounded_gap_and_normal(x: Floats, nearest: Floats, deep: Floats, by: float) -> tuple[Floats, Floats]:
    """Return gaps and normals at points x of a body whose core is rounded by the radius `by`, m.

    `nearest` are the nearest points of the core, and `deep` is the depth of points inside the core, m.
    """
    off = x - nearest
    far = np.sqrt((off**2).sum(axis=1))
    out = off / np.maximum(far, LEAST)[:, None]
    return np.where(far > 0.0, far, -deep) - by, out


def polygon_distance(corners: Floats, rounding: float = 0.0, mirrored: bool = False) -> Section:
    """Return the distance function in a plane of a polygon with corners (c, 2), m, and `rounding`, m.

    Points are complex numbers. The nearest point of each side from a to b is a + t (b - a), with t = Re((p - a) / (b -
    a)) clamped to [0, 1]. A point is inside if the sides wind once around it. If `mirrored`, the polygon is half of a
    section, and sides on the axis are no surface.
    """
    z = np.asarray(corners) @ np.array([1.0, 1.0j])
    start, end = z, np.roll(z, -1)
    if mirrored:
        wall = np.abs(start.real) + np.abs(end.real) > 0.0
        start, end = start[wall], end[wall]

    def winds(p: Floats) -> Floats:
        with np.errstate(divide="ignore", invalid="ignore"):
            found: Floats = np.nansum(np.angle((end - p) / (start - p)), axis=1)
        return found

    def look(a: Floats, b: Floats) -> tuple[Floats, Floats, Floats]:
        p = (a + 1.0j * b)[:, None]
        way = end - start
        off = p - (start + np.clip(((p - start) / way).real, 0.0, 1.0) * way)
        far = np.abs(off)
        own = np.arange(len(a)), far.argmin(axis=1)
        turns = winds(p) + (winds(-p.conj()) if mirrored else 0.0)
        sign = np.where(np.abs(turns) > np.pi, -1.0, 1.0)
        out = sign * off[own] / np.maximum(far[own], LEAST)
        return sign * far[own] - rounding, out.real, out.imag

    return look


def revolved_distance(section: Section, origin: Floats, axis: Floats) -> Distance:
    """Return the distance function of the body of revolution of a half-section in (r, z).

    z is measured from `origin` along `axis`.
    """
    e = np.asarray(axis, dtype=np.float64) / np.sqrt(np.sum(np.square(axis)))

    def look(x: Floats) -> tuple[Floats, Floats]:
        off = x - np.asarray(origin)
        z = off @ e
        across = off - z[:, None] * e
        r = np.sqrt((across**2).sum(axis=1))
        g, a, b = section(r, z)
        return g, (a / np.maximum(r, LEAST))[:, None] * across + b[:, None] * e

    return look


def prism_distance(section: Section, order: tuple[int, int, int], low: float, high: float) -> Distance:
    """Return the distance function of a polygon extruded along a coordinate axis from `low` to `high`, m.

    `order` lists the two coordinates of the plane of the polygon, then the coordinate of the extrusion.
    """
    i, j, k = order

    def look(x: Floats) -> tuple[Floats, Floats]:
        g, a, b = section(x[:, i], x[:, j])
        beyond = np.maximum(low - x[:, k], x[:, k] - high)
        side, end = np.maximum(g, 0.0), np.maximum(beyond, 0.0)
        far = np.hypot(side, end)
        n = np.zeros_like(x)
        weight = side / np.maximum(far, LEAST)
        n[:, i], n[:, j] = weight * a, weight * b
        n[:, k] = end / np.maximum(far, LEAST) * np.where(x[:, k] > high, 1.0, -1.0)
        return np.where(far > 0.0, far, np.maximum(g, beyond)), n

    return look


def closed_surface_distance(points: Floats, triangles: Ints) -> Distance:
    """Return the distance function of the volume inside a closed surface, by testing every triangle.

    The nearest point of a triangle is on its plane if it is inside all three sides, and otherwise on a side. Raises
    ValueError for too many triangles.
    """
    X = points[triangles]

    def look(x: Floats) -> tuple[Floats, Floats]:
        if len(x) * len(X) > MOST:
            raise ValueError("the surface of the rigid body has too many triangles for an independent check")
        g, n = np.empty(len(x)), np.empty_like(x)
        step = max(1, PAIRS // len(X))
        for at in range(0, len(x), step):
            some = x[at : at + step]
            off, far = _nearest_surface_vectors(some, X)
            sign = np.where(np.abs(solid_angle(some, X)) > 2.0 * np.pi, -1.0, 1.0)
            g[at : at + step] = sign * far
            n[at : at + step] = sign[:, None] * off / np.maximum(far, LEAST)[:, None]
        return g, n

    return look


def _nearest_surface_vectors(x: Floats, X: Floats) -> tuple[Floats, Floats]:
    """Return vectors (n, 3) from the nearest points of triangles X (t, 3, 3) to x (n, 3), and distances (n,), m."""
    best, far = np.zeros_like(x), np.full(len(x), np.inf)
    rows = np.arange(len(x))

    def take(off: Floats, allowed: NDArray[np.bool_] | bool = True) -> None:
        square = np.where(allowed, (off**2).sum(axis=2), np.inf)
        own = square.argmin(axis=1)
        nearer = square[rows, own] < far
        far[nearer], best[nearer] = square[rows, own][nearer], off[rows, own][nearer]

    normal = np.cross(X[:, 1] - X[:, 0], X[:, 2] - X[:, 0])
    normal = normal / np.maximum(np.sqrt((normal**2).sum(axis=1)), LEAST)[:, None]
    height = x @ normal.T - (X[:, 0] * normal).sum(axis=1)
    within = np.ones(height.shape, dtype=np.bool_)
    for k in range(3):
        a, way = X[:, k], X[:, (k + 1) % 3] - X[:, k]
        inward = np.cross(normal, way)
        within &= x @ inward.T - (a * inward).sum(axis=1) >= 0.0
        t = (x @ way.T - (a * way).sum(axis=1)) / np.maximum((way**2).sum(axis=1), LEAST)
        take(x[:, None] - a - np.clip(t, 0.0, 1.0)[..., None] * way)
    take(height[..., None] * normal, within)
    return best, np.sqrt(far)


def solid_angle(x: Floats, X: Floats, on: float = 0.0) -> Floats:
    """Return the solid angle of a closed surface of triangles X (t, 3, 3), seen from points (n,): 4 pi from inside.

    Triangles whose planes contain the point contribute nothing; `on` is the sine of the tolerated angle.
    """
    a, b, c = (X[None, :, i] - x[:, None] for i in range(3))
    p, q, r = (np.sqrt((v**2).sum(axis=2)) for v in (a, b, c))
    triple = (a * np.cross(b, c)).sum(axis=2)
    below = p * q * r + (a * b).sum(axis=2) * r + (b * c).sum(axis=2) * p + (c * a).sum(axis=2) * q
    seen = np.abs(triple) > on * p * q * r
    found: Floats = 2.0 * np.where(seen, np.arctan2(triple, below), 0.0).sum(axis=1)
    return found


# ------------------------------------------------------------------ where it is


def moved_distance(distance: Distance, shift: Floats, rotation: Floats, through: Floats) -> Distance:
    """Return the distance function of a body rotated about the point `through`, by a vector, rad, and then shifted, m.

    Points are transformed to the body's frame by the unit quaternion (cos(angle / 2), sin(angle / 2) axis).
    """
    angle = float(np.sqrt(np.sum(np.square(rotation))))
    w = np.cos(0.5 * angle)
    x, y, z = np.asarray(rotation) / angle * np.sin(0.5 * angle) if angle else np.zeros(3)
    Q = np.array(
        [
            [w * w + x * x - y * y - z * z, 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), w * w - x * x + y * y - z * z, 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), w * w - x * x - y * y + z * z],
        ]
    )

    def look(X: Floats) -> tuple[Floats, Floats]:
        g, n = distance((X - shift - through) @ Q + through)
        return g, n @ Q.T

    return look


# ------------------------------------------------------------------ what it does


def barrier_pressure(g: Floats, distance: float, stiffness: float, bend: float) -> tuple[Floats, Floats]:
    """Return the barrier pressure at gaps g (n,), m, in Pa, and its slope, Pa/m: k s^2 / (1 - s), s = (d - g) / d.

    It continues linearly below the gap `bend`, m. Written with the relative gap c = 1 - s: k (1 / c - 2 + c).
    """
    c = np.clip(g / distance, 1.0 - bend, 1.0)
    beyond = np.maximum(1.0 - bend - g / distance, 0.0)
    slope = 1.0 / c**2 - 1.0
    return stiffness * (1.0 / c - 2.0 + c + slope * beyond), stiffness * slope / distance


def nodal_areas(points: Floats, triangles: Ints, depth: float) -> Floats:
    """Return the area of each node (n,), m^2: integrals of linear shape functions over flat triangles (t, 3).

    The quadrature points are the middles of sides. If `depth`, m, is given, the areas are those of whole rings around
    the y axis. The integrands are then of second degree, which the rule integrates exactly.
    """
    X = points[triangles]
    side = [np.sqrt(((X[:, (k + 1) % 3] - X[:, k]) ** 2).sum(axis=1)) for k in range(3)]
    a, b, c = np.sort(np.stack(side), axis=0)[::-1]  # Heron's formula as Kahan orders it
    area = 0.25 * np.sqrt(np.maximum((a + (b + c)) * (c - (a - b)) * (c + (a - b)) * (a + (b - c)), 0.0))
    found = np.zeros(len(points))
    for k in range(3):
        ends = triangles[:, k], triangles[:, (k + 1) % 3]
        around = np.pi / depth * (points[ends[0], 0] + points[ends[1], 0]) if depth else 1.0
        for end in ends:
            np.add.at(found, end, area * around / 6.0)
    return found


def facet_lattice_triangles(square: bool, steps: int) -> Ints:
    """Return triangles (t, 3) between the lattice points of a facet that is divided into `steps` along its sides.

    Lattice points are numbered with the second local coordinate varying fastest.
    """
    rows = [[(i, j) for j in range(steps + 1 if square else steps + 1 - i)] for i in range(steps + 1)]
    number = {place: k for k, place in enumerate(place for row in rows for place in row)}
    found = []
    for i, j in number:
        right, up, both = ((i + a, j + b) for a, b in ((1, 0), (0, 1), (1, 1)))
        if square and both in number:
            found += [[(i, j), right, both], [(i, j), both, up]]
        elif not square and right in number:
            found += [[(i, j), right, up]] + ([[right, both, up]] if both in number else [])
    return np.array([[number[place] for place in three] for three in found])
