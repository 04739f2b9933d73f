"""Surfaces of rigid bodies in space, their sections at z = 0, and their sharp edges.

A half-space is drawn as a plate below the deformable body, slightly wider than it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from softmark.interpreter.problem.probe_points import surface_triangles
from softmark.solvers.contact.signed_distance import gap_of
from softmark.solvers.mesh.rigid_shapes import HalfSpace
from softmark.solvers.mesh.shape import Swept, transverse
from softmark.solvers.mesh.shape_surfaces import triangulate_swept
from softmark.solvers.mesh.shapes import Box

if TYPE_CHECKING:
    from softmark.solvers.mesh.mesh import Floats, Ints
    from softmark.solvers.mesh.shape import Shape

WIDER, THICK = 0.25, 0.04  # relative to the body's diagonal: size of the plate drawn for a half-space
ROUND = 64, 24  # points around and along rigid bodies with an axis
SHORT = 1e-7  # relative to its size: closer points are merged
SHARP = 0.978  # cosine of 12 degrees from the mean normal: larger angles are sharp


def surface_in_space(shape: Shape, position: Floats) -> tuple[Floats, Ints]:
    """Return points (n, 3), m, and triangles (t, 3) of the surface of a rigid body at its declared position.

    `position` (k, 3), m, are points of the deformable body, near which a half-space is drawn.
    """
    if isinstance(shape, HalfSpace):
        return _half_space_plate(shape, position)
    return triangulate_swept(shape, *ROUND) if isinstance(shape, Swept) else surface_triangles(shape)


def _half_space_plate(shape: HalfSpace, position: Floats) -> tuple[Floats, Ints]:
    """Return the surface of a plate with one face on the plane of a half-space, near a body at points (n, 3), m."""
    normal = np.array(shape.normal)
    low, high = position.min(axis=0), position.max(axis=0)
    middle = 0.5 * (low + high)
    middle -= ((middle - np.array(shape.origin)) @ normal) * normal
    frame = np.array([*transverse(shape.normal), shape.normal])
    size = float(np.linalg.norm(high - low))
    wide, deep = (float(np.abs(row) @ (high - low)) + WIDER * size for row in frame[:2])
    thick = THICK * size
    X, triangles = triangulate_swept(Box((wide, deep, thick), (-0.5 * wide, -0.5 * deep, -thick)), 4, 1)
    return X @ frame + middle, triangles


def extruded_plane_section(
    X: Floats, triangles: Ints, shape: Shape, span: tuple[float, float], half: bool
) -> tuple[Floats, Ints]:
    """Return the section z = 0 of a shape's surface, extruded over a span of z, m; with `half` only the part x >= 0."""
    lines = _plane_section_lines(X, triangles)
    P, ends = _join_lines(_clip_lines_to_half_plane(lines) if half else lines, X)
    if len(P) < 3:
        return np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)
    flat, n = _triangulate(P, shape), len(P)
    points = np.concatenate([np.column_stack([P, np.full(n, z)]) for z in span])
    a, b = ends.T
    walls = [np.stack([a, b, b + n], axis=1), np.stack([a, b + n, a + n], axis=1)]
    return points, np.concatenate([flat[:, ::-1], flat + n, *walls])


def _plane_section_lines(X: Floats, triangles: Ints) -> Floats:
    """Return the lines (k, 2, 2), m, along which triangles cross z = 0, with the rigid body on their left."""
    corners = X[triangles]
    above = corners[..., 2] >= 0.0
    own = above.any(axis=1) & ~above.all(axis=1)
    corners, above = corners[own], above[own]
    alone = np.where(above.sum(axis=1) == 1, above.argmax(axis=1), (~above).argmax(axis=1))
    first, second, third = (np.take_along_axis(corners, ((alone + k) % 3)[:, None, None], 1)[:, 0] for k in range(3))
    lines = np.stack([_crossings_of_plane(first, second), _crossings_of_plane(first, third)], axis=1)
    turned = ~above[np.arange(len(alone)), alone]
    lines[turned] = lines[turned][:, ::-1]
    return lines


def _join_lines(lines: Floats, X: Floats) -> tuple[Floats, Ints]:
    """Return the distinct points (n, 2), m, of lines (k, 2, 2), m, and the numbers of their end points (k, 2).

    X are the points of the surface, which give the tolerance.
    """
    small = SHORT * float(np.ptp(X, axis=0).max())
    P, ends = np.unique((lines.reshape(-1, 2) / small).round(), axis=0, return_inverse=True)
    ends = ends.reshape(-1, 2)
    return P * small, ends[ends[:, 0] != ends[:, 1]]


def _crossings_of_plane(a: Floats, b: Floats) -> Floats:
    """Return where lines from a to b (k, 3) cross z = 0 (k, 2), m."""
    share = (a[:, 2] / (a[:, 2] - b[:, 2]))[:, None]
    found: Floats = ((1.0 - share) * a + share * b)[:, :2]
    return found


def _clip_lines_to_half_plane(lines: Floats) -> Floats:
    """Return the parts with x >= 0 of lines (k, 2, 2), m."""
    lines = lines[(lines[..., 0] > 0.0).any(axis=1)]
    a, b = lines[:, 0], lines[:, 1]
    for end, other in ((a, b), (b, a)):
        out = end[:, 0] < 0.0
        share = end[out, :1] / (end[out, :1] - other[out, :1])
        end[out] += share * (other[out] - end[out])
    return lines


def _triangulate(P: Floats, shape: Shape) -> Ints:
    """Return triangles (t, 3), counter-clockwise, of a shape's section with points P (n, 2), m, on its border."""
    from scipy.spatial import Delaunay

    flat: Ints = Delaunay(P).simplices.astype(np.int64)
    u, v = P[flat[:, 1]] - P[flat[:, 0]], P[flat[:, 2]] - P[flat[:, 0]]
    area = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    flat[area < 0.0] = flat[area < 0.0][:, ::-1]
    if shape.convex:
        return flat
    middle = P[flat].mean(axis=1)
    gap = gap_of(shape)
    assert gap is not None  # refused when the scene is checked
    return flat[gap.gap(np.column_stack([middle, np.zeros(len(flat))])) < 0.0]


def sharp_points(X: Floats, triangles: Ints) -> Floats:
    """Return points (n, 3), m, on the convex edges, tips and corners of a closed surface."""
    corners = X[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    away = np.repeat(corners.mean(axis=1), 3, axis=0) - corners.reshape(-1, 3)
    return _points_at_convex_angles(X, triangles.ravel(), np.repeat(normals, 3, axis=0), away)


def sharp_points_in_section(X: Floats, triangles: Ints) -> Floats:
    """Return points (n, 3), m, with z = 0 at convex corners of the section of a closed surface."""
    P, ends = _join_lines(_plane_section_lines(X, triangles), X)
    if not len(ends):
        return np.zeros((0, 3))
    way = P[ends[:, 1]] - P[ends[:, 0]]
    normals = np.stack([way[:, 1], -way[:, 0], 0.0 * way[:, 0]], axis=1) / np.linalg.norm(way, axis=1, keepdims=True)
    points = np.column_stack([P, np.zeros(len(P))])
    away = (points[ends].mean(axis=1)[:, None] - points[ends]).reshape(-1, 3)
    return _points_at_convex_angles(points, ends.ravel(), np.repeat(normals, 2, axis=0), away)


def _points_at_convex_angles(X: Floats, at: Ints, normals: Floats, away: Floats) -> Floats:
    """Return the points of X (n, 3), m, at which the normals of adjoining items differ by a convex angle.

    `at` (k,) are the points of the items, `normals` (k, 3) their normals, `away` (k, 3) directions from the point into
    each item.
    """
    mean = np.stack([np.bincount(at, column, len(X)) for column in normals.T], axis=1)
    mean = mean / np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-300)
    least, behind = np.ones(len(X)), np.bincount(at, np.einsum("ki,ki->k", away, mean[at]), len(X))
    np.minimum.at(least, at, np.einsum("ki,ki->k", normals, mean[at]))
    return X[(least < SHARP) & (behind < 0.0)]
