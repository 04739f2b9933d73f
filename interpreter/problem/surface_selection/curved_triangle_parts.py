"""Parts of triangles behind curved borders, integrated along rays after cutting until each border is simple.

A border is simple in a triangle that it crosses once, with slopes of one sign along every ray from a corner. The part
is then the set of ray segments before or behind the border: there is one root on every ray, with Gauss points on both
sides. The error falls faster than any power of the number of points; two rules estimate it. Bounds of levels and slopes
over whole triangles guarantee that no feature lies between the points, as Saye 2015 does for boxes. The remaining area
where borders meet is reported.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache

import numpy as np

from softmark.interpreter.problem.surface_selection.facet_patches import (
    BorderBounds,
    ConditionOnPatches,
    Floats,
    Ints,
    Mask,
)
from softmark.interpreter.problem.surface_selection.plane_clipping import areas, odd_corner, rotate_to_first

DEPTH = 18  # largest number of halvings of a facet
MOST = 60_000  # largest number of triangles; beyond it a border is not followed
RAYS = (8, 12)  # rays of two rules: the second is used, the first gives the error
EXACT = 1e-12  # relative to a facet's local area: tolerance of two rules
ALONG = 6  # Gauss points on each side of a border
INSIDE = (8, 8, 8, 8, 5, 5, 5, 5, 3)  # along each side of a triangle of so many halvings: an error of order 2 n


@dataclass
class FacetQuadraturePoints:
    """Quadrature points over parts of facets: facets (k,), local points (k, 2), weights (k,) in local area."""

    f: list[Ints] = field(default_factory=list)
    xi: list[Floats] = field(default_factory=list)
    w: list[Floats] = field(default_factory=list)
    left: list[tuple[Ints, Floats, Floats]] = field(default_factory=list)  # facets, places and areas not decided

    def add(self, f: Ints, xi: Floats, w: Floats) -> None:
        """Add points xi (n, q, 2) with weights (n, q) of facets f (n,)."""
        self.f.append(np.repeat(f, w.shape[1]))
        self.xi.append(xi.reshape(-1, 2))
        self.w.append(w.ravel())

    def triangles(self, f: Ints, tri: Floats, depth: int) -> None:
        """Add quadrature points of whole triangles (n, 3, 2) of facets f (n,), after `depth` halvings."""
        n = INSIDE[min(depth, len(INSIDE) - 1)]
        s, t, w = _ray_quadrature(n, n)
        ends = tri[:, 1, None] + t[:, None] * (tri[:, 2] - tri[:, 1])[:, None]
        self.add(f, tri[:, :1] + s[:, None] * (ends - tri[:, :1]), 2.0 * np.abs(areas(tri))[:, None] * s * w)


@cache
def _gauss(n: int) -> tuple[Floats, Floats]:
    x, w = np.polynomial.legendre.leggauss(n)
    return 0.5 * (x + 1.0), 0.5 * w


@cache
def _ray_quadrature(along: int, across: int) -> tuple[Floats, Floats, Floats]:
    (s, u), (t, v) = _gauss(along), _gauss(across)
    return np.tile(s, across), np.repeat(t, along), np.outer(v, u).ravel()


def add_selected_parts(asked: ConditionOnPatches, f: Ints, tri: Floats, points: FacetQuadraturePoints) -> None:
    """Add the selected parts of triangles (n, 3, 2) of facets f (n,) to `points`."""
    for depth in range(DEPTH + 1):
        looked = asked.look(f, tri)
        plain = ~looked.crossed.any(axis=0)
        _add_selected_triangles(asked, f[plain], tri[plain], points, depth)
        simple = np.zeros(len(f), dtype=np.bool_)
        once = looked.crossed.sum(axis=0) == 1
        for b in range(len(looked.values)):
            some = np.flatnonzero(once & looked.crossed[b])
            if len(some):
                touched = some[_meets_side_only(asked, looked, b, some, f, tri)]
                _add_selected_triangles(asked, f[touched], tri[touched], points, depth)
                simple[touched] = True
                some = np.setdiff1d(some, touched)
                corner, fit = _cut_off_corner(looked, b, some, asked.slack[b])
                done = _integrate_rays(
                    asked, b, f[some[fit]], rotate_to_first(tri[some[fit]], corner[fit]), points, depth
                )
                simple[some[fit]] = done
        rest = ~(plain | simple)
        f, tri = f[rest], tri[rest]
        if not len(f) or depth == DEPTH or 4 * len(f) > MOST:
            break
        f, tri = np.repeat(f, 4), _divide_into_four(tri)
    _add_selected_triangles(asked, f, tri, points, depth)
    if len(f):
        points.left.append((f, tri.mean(axis=1), np.abs(areas(tri))))


def _add_selected_triangles(
    asked: ConditionOnPatches, f: Ints, tri: Floats, points: FacetQuadraturePoints, depth: int
) -> None:
    if len(f):
        inside = asked.holds(f, asked.patches.at(f, tri.mean(axis=1, keepdims=True))[:, 0])
        points.triangles(f[inside], tri[inside], depth)


def _divide_into_four(tri: Floats) -> Floats:
    a, b, c = (tri[:, i] for i in range(3))
    ab, bc, ca = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)
    four = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return np.stack([np.stack(t, axis=1) for t in four], axis=1).reshape(-1, 3, 2)


def _cut_off_corner(looked: BorderBounds, b: int, some: Ints, slack: float) -> tuple[Ints, Mask]:
    """Return which corner border b cuts off each triangle in `some`, and a mask of the triangles without other cuts."""
    v = looked.values[b][some]
    v = np.where(np.abs(v) <= slack, 0.0, v)
    low, high = (side[:, some] for side in looked.slopes[b])
    corner = odd_corner(v)
    sign = np.sign(v[np.arange(len(v)), corner])
    turned = [np.stack([side[(corner + i) % 3, np.arange(len(v))] for i in range(3)]) for side in (low, high)]
    least = np.where(sign > 0, turned[0], -turned[1])  # of sign times level
    most = np.where(sign > 0, turned[1], -turned[0])
    v = sign[:, None] * rotate_to_first(v, corner)
    both = (v[:, 0] > 0.0) & (v[:, 1] <= 0.0) & (v[:, 2] <= 0.0) & (v[:, 1] + v[:, 2] < 0.0)
    falling = (most[0] < 0.0) & (least[2] > 0.0)  # from the corner along 01, and along 20 towards it
    one_way = (least[1] > 0.0) | (most[1] < 0.0)
    beyond = np.minimum(v[:, 1] + np.maximum(most[1], 0.0), v[:, 2] + np.maximum(-least[1], 0.0))
    return corner, both & falling & (one_way | (beyond <= slack))


def _meets_side_only(asked: ConditionOnPatches, looked: BorderBounds, b: int, some: Ints, f: Ints, tri: Floats) -> Mask:
    """Return a mask of the triangles that border b touches only along a side."""
    v = looked.values[b][some]
    v = np.where(np.abs(v) <= asked.slack[b], 0.0, v)
    off = np.argmax(np.abs(v), axis=1)
    found: Mask = (v == 0.0).sum(axis=1) == 2
    if not found.any():
        return found
    sign, row = np.sign(v[np.arange(len(v)), off]), np.arange(len(v))
    least, most = (side[:, some] for side in looked.slopes[b])
    out, back = (off % 3, row), ((off + 2) % 3, row)
    away = np.where(sign > 0, most[out], -least[out]) < 0.0
    home = np.where(sign > 0, least[back], -most[back]) > 0.0
    start, end = (rotate_to_first(tri[some], off)[:, i, None] for i in (1, 2))
    side = start + np.linspace(0.1, 0.9, 5)[:, None] * (end - start)
    on = np.abs(asked.level(b, asked.patches.at(f[some], side))).max(axis=1) <= asked.slack[b]
    found &= away & home & on
    return found


def _integrate_rays(
    asked: ConditionOnPatches, b: int, f: Ints, tri: Floats, points: FacetQuadraturePoints, depth: int
) -> Mask:
    """Add quadrature points of the selected parts of n triangles; return a mask (n,) of successes.

    Border number b separates the first corner of each triangle `tri` (n, 3, 2) from the other two corners. `f` (n,) are
    the facets that contain the triangles, and `depth` the number of halvings so far. A triangle fails if the areas by
    two quadrature rules differ too much, unless it is halved as far as possible.
    """
    if not len(f):
        return np.zeros(0, dtype=np.bool_)
    t = np.concatenate([_gauss(n)[0] for n in RAYS])
    start, ends = tri[:, :1], tri[:, 1, None] + t[:, None] * (tri[:, 2] - tri[:, 1])[:, None]
    way = ends - start

    def level(rows: Ints, s: Floats) -> Floats:
        return asked.level(b, asked.patches.at(f[rows], start[rows] + s[:, :, None] * way[rows]))

    s = _roots(level, len(f), len(t))
    twice = 2.0 * np.abs(areas(tri))
    few, many = s[:, : RAYS[0]], s[:, RAYS[0] :]
    apart = 0.5 * twice * np.abs(few**2 @ _gauss(RAYS[0])[1] - many**2 @ _gauss(RAYS[1])[1])
    fine = (apart <= EXACT) | (depth == DEPTH)
    f, start, ends, s, twice = f[fine], start[fine], ends[fine, RAYS[0] :], many[fine], twice[fine]
    points.left.append((f, tri[fine].mean(axis=1), apart[fine]))
    x, w = _gauss(ALONG)
    for from_, to in ((np.zeros_like(s), s), (s, np.ones_like(s))):
        r = from_[:, :, None] + (to - from_)[:, :, None] * x  # (n, rays, along)
        xi = start[:, :, None] + r[..., None] * (ends - start)[:, :, None]
        weights = twice[:, None, None] * (_gauss(RAYS[1])[1][:, None] * w) * r * (to - from_)[:, :, None]
        xi, weights = xi.reshape(len(f), RAYS[1] * ALONG, 2), weights.reshape(len(f), RAYS[1] * ALONG)
        row, longest = np.arange(len(f)), np.argmax(to - from_, axis=1)
        half = 0.5 * (from_ + to)[row, longest][:, None]
        middle = start[:, 0] + half * (ends[row, longest] - start[:, 0])
        inside = asked.holds(f, asked.patches.at(f, middle[:, None])[:, 0]) & ((to - from_).max(axis=1) > 0.0)
        points.add(f[inside], xi[inside], weights[inside])
    return fine


def _roots(level: Callable[[Ints, Floats], Floats], n: int, m: int) -> Floats:
    """Return the roots (n, m) of levels along rays s in [0, 1], by the Illinois method; 1 without a root.

    `level` is evaluated for some rows at a time; rows whose rays have all converged are skipped.
    """
    found, rows = np.ones((n, m)), np.arange(n)
    a, b = np.zeros((n, m)), np.ones((n, m))
    fa, fb = np.array(level(rows, a)), np.array(level(rows, b))
    fb = np.where(np.sign(fa) * np.sign(fb) > 0.0, 0.0, fb)
    x = b
    for _ in range(100):
        flat = fb - fa
        new = np.where(flat == 0.0, x, (a * fb - b * fa) / np.where(flat == 0.0, 1.0, flat))
        new = np.where(fb == 0.0, b, np.clip(new, np.minimum(a, b), np.maximum(a, b)))
        going = np.any(np.abs(new - x) > 1e-15, axis=1) & np.any(fb != 0.0, axis=1)
        found[rows] = new
        if not going.any():
            break
        rows, a, b, fa, fb, x = (own[going] for own in (rows, a, b, fa, fb, new))
        fx = np.where(fb == 0.0, 0.0, level(rows, x))
        over_ = np.sign(fx) * np.sign(fb) < 0.0
        a, fa = np.where(over_, b, a), np.where(over_, fb, 0.5 * fa)
        b, fb = x, fx
    return found
