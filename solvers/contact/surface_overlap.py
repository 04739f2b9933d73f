"""Overlap of the facets of two surfaces whose meshes do not match, by exact clipping of polygons.

Facets with straight sides are split into triangles. Two triangles are intersected in the plane of the first (Sutherland
and Hodgman 1974). Each piece of the intersection gets Gauss points, with local coordinates on both facets. Curved
facets are clipped as triangles between their nodes, and the Gauss points are then projected along the normals onto the
curved facets.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from softmark.records import dataclass
from softmark.solvers.elements.boundary_facets import FACETS, Tri6
from softmark.solvers.mesh.mesh import Floats, Ints, Mesh

FACING = -0.5  # largest scalar product of the unit normals of facets that face each other
NOTHING = 1e-10  # of a triangle's area: smaller overlaps are ignored
ROUNDS = 8  # of Newton's method for a point on a curved facet


@dataclass(frozen=True)
class FacetOverlaps:
    """Integration points (p,) of the overlap of two surfaces, on the facets `first` and `second` (p,).

    `xi` and `eta` (p, 2) are the local coordinates on both facets. `A` (p,), m^2, are the areas of the points, and `X`
    (p, 3), m, their positions on the first facet at rest.
    """

    first: Ints
    second: Ints
    xi: Floats  # (p, 2)
    eta: Floats  # (p, 2)
    A: Floats
    X: Floats
    gaps: Floats  # (p,) distance between the two facets at the points, m


def find_overlaps(mesh: Mesh, one: Ints, other: Ints, reach: float) -> FacetOverlaps:
    """Return the overlaps of facets `one` and `other` (k,) that are within a distance `reach`, m, of each other."""
    a, b = _split_into_triangles(mesh, one), _split_into_triangles(mesh, other)
    first, second = _candidate_pairs(a[0], b[0], reach)
    corners, at = _intersect_triangles(a[0][first], b[0][second])
    first, second = a[1][first[at]], b[1][second[at]]
    E = corners[:, 1:] - corners[:, :1]
    area = 0.5 * np.linalg.norm(np.cross(E[:, 0], E[:, 1]), axis=1)
    xi, w = Tri6.quadrature()
    N = np.concatenate([1.0 - xi.sum(axis=1, keepdims=True), xi], axis=1)
    X = np.einsum("qa,pai->pqi", N, corners).reshape(-1, 3)
    A = np.outer(area, 2.0 * w).ravel()
    first, second = np.repeat(first, len(w)), np.repeat(second, len(w))
    places = _project_to_facets(mesh, first, X), _project_to_facets(mesh, second, X)
    here, there = (_facet_point_positions(mesh, facets, xi) for facets, xi in zip((first, second), places, strict=True))
    return FacetOverlaps(first, second, *places, A, here, np.linalg.norm(here - there, axis=1))


def _split_into_triangles(mesh: Mesh, which: Ints) -> tuple[Floats, Ints]:
    """Return flat triangles (t, 3, 3), m, that cover the facets `which` of a mesh, and the facet of each (t,)."""
    split = np.array(mesh.element.facet.triangles)
    triangles = mesh.points[mesh.facets[which][:, split]].reshape(-1, 3, 3)
    return triangles, np.repeat(which, len(split))


def _candidate_pairs(a: Floats, b: Floats, reach: float) -> tuple[Ints, Ints]:
    """Return pairs of triangles of a (t, 3, 3) and b (u, 3, 3) that may overlap, as two arrays of indices (p,).

    The triangles of such a pair face each other and are within a distance `reach`, m.
    """
    middles = [t.mean(axis=1) for t in (a, b)]
    sizes = [np.linalg.norm(t - m[:, None], axis=2).max(axis=1) for t, m in zip((a, b), middles, strict=True)]
    most = float(sizes[0].max() + sizes[1].max()) + reach
    found = cKDTree(middles[0]).query_ball_tree(cKDTree(middles[1]), most)
    first = np.repeat(np.arange(len(a)), [len(f) for f in found])
    second = np.array([j for f in found for j in f], dtype=np.int64)
    n = [_triangle_normals(t) for t in (a, b)]
    facing = np.einsum("ij,ij->i", n[0][first], n[1][second]) < FACING
    off = np.einsum("ij,ij->i", middles[1][second] - middles[0][first], n[0][first])
    between = np.linalg.norm(middles[1][second] - middles[0][first], axis=1)
    kept = facing & (np.abs(off) < reach) & (between < sizes[0][first] + sizes[1][second] + reach)
    return first[kept], second[kept]


def _triangle_normals(t: Floats) -> Floats:
    """Return the unit normals (t, 3) of triangles with corners t (t, 3, 3)."""
    n = np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0])
    found: Floats = n / np.linalg.norm(n, axis=1, keepdims=True)
    return found


def _intersect_triangles(a: Floats, b: Floats) -> tuple[Floats, Ints]:
    """Return the intersections of pairs of triangles a and b (p, 3, 3), m, in the plane of a.

    They are split into triangles (t, 3, 3), m, returned with the number of the pair of each (t,).
    """
    n = _triangle_normals(a)
    u = a[:, 1] - a[:, 0]
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    v = np.cross(n, u)
    axes = np.stack([u, v], axis=1)  # (p, 2, 3)
    flat_a, flat_b = (np.einsum("pij,pkj->pki", axes, t - a[:, :1]) for t in (a, b))
    flat_b = flat_b[:, ::-1]  # the triangles face each other
    found, of = [], []
    for number, (one, other) in enumerate(zip(flat_a, flat_b, strict=True)):
        polygon = _clip_polygon(other, one)
        for k in range(1, len(polygon) - 1):
            piece = np.array([polygon[0], polygon[k], polygon[k + 1]])
            if abs(_doubled_area(*piece)) > NOTHING * abs(_doubled_area(*one)):
                found.append(piece)
                of.append(number)
    at = np.array(of, dtype=np.int64)
    flat = np.array(found).reshape(-1, 3, 2)
    return a[at, :1] + np.einsum("pij,pki->pkj", axes[at], flat), at


def _clip_polygon(polygon: Any, window: Any) -> list[Any]:
    """Return a polygon clipped to the triangle `window`, both counter-clockwise in the plane."""
    left = list(polygon)
    for i in range(3):
        p, q = window[i], window[(i + 1) % 3]
        sides = [_doubled_area(p, q, c) for c in left]
        kept = []
        for k, (c, s) in enumerate(zip(left, sides, strict=True)):
            before, s_before = left[k - 1], sides[k - 1]
            if s * s_before < 0.0:
                kept.append(before + (c - before) * (s_before / (s_before - s)))
            if s >= 0.0:
                kept.append(c)
        left = kept
    return left


def _doubled_area(p: Any, q: Any, c: Any) -> float:
    """Return twice the signed area of the triangle p, q, c in the plane."""
    return float((q[0] - p[0]) * (c[1] - p[1]) - (q[1] - p[1]) * (c[0] - p[0]))


def _facet_point_positions(mesh: Mesh, facets: Ints, xi: Floats) -> Floats:
    """Return the positions (p, 3), m, of points with local coordinates xi (p, 2) on facets (p,) at rest."""
    found: Floats = np.einsum("pa,pai->pi", FACETS[mesh.facets.shape[1]].shape(xi), mesh.points[mesh.facets[facets]])
    return found


def _project_to_facets(mesh: Mesh, facets: Ints, X: Floats) -> Floats:
    """Return the local coordinates (p, 2) of the points on facets (p,) that are closest to X (p, 3), m.

    They are found by the Gauss-Newton method.
    """
    facet = FACETS[mesh.facets.shape[1]]
    nodes = mesh.points[mesh.facets[facets]]
    xi = np.tile(np.array(facet.centre), (len(X), 1))
    for _ in range(ROUNDS):
        r = X - np.einsum("pa,pai->pi", facet.shape(xi), nodes)
        t = np.einsum("paj,pai->pji", facet.gradient(xi), nodes)
        step = np.linalg.solve(np.einsum("pji,pki->pjk", t, t), np.einsum("pji,pi->pj", t, r)[..., None])[..., 0]
        xi = xi + step
        if float(np.abs(step).max(initial=0.0)) < 1e-14:
            break
    return xi
