"""Integration along straight lines through a mesh: crossings of cell faces, and quadrature points between them."""

from __future__ import annotations

import numpy as np

from softmark.solvers.mesh.mesh import Floats, Mesh

POINTS = 8  # Gauss points between two faces: exact for polynomials of degree 15, of which straight cells have 6
APART = 1e-12  # relative to the length: closer crossings are merged


def line_quadrature(mesh: Mesh, begin: Floats, end: Floats) -> tuple[Floats, Floats]:
    """Return points X (n, 3), m, and weights w (n,), m, for integrals over the line from `begin` to `end` (3,), m.

    The line is divided where it crosses cell faces, so that functions that are smooth in each cell are integrated
    accurately.
    """
    cuts = find_face_crossings(mesh, begin, end)
    x, w = np.polynomial.legendre.leggauss(POINTS)
    step = np.diff(cuts)
    s = (cuts[:-1, None] + 0.5 * step[:, None] * (x + 1.0)).ravel()
    weights: Floats = float(np.linalg.norm(end - begin)) * (0.5 * step[:, None] * w).ravel()
    return begin + s[:, None] * (end - begin), weights


def find_face_crossings(mesh: Mesh, begin: Floats, end: Floats) -> Floats:
    """Return where a line crosses the planes of nearby cell faces, as sorted fractions of its length (k,).

    The ends 0 and 1 are included. A quadrilateral face counts as two triangles, each with its plane. A plane may be
    crossed outside its face; such surplus crossings do no harm.
    """
    corners = _face_triangles(mesh)  # (t, 3, 3)
    a, way = corners[:, 0], end - begin
    n = np.cross(corners[:, 1] - a, corners[:, 2] - a)
    size, across = np.linalg.norm(n, axis=1), n @ way
    meets = np.abs(across) > APART * size * float(np.linalg.norm(way))
    s = np.einsum("ti,ti->t", n[meets], a[meets] - begin) / across[meets]
    low, high = corners[meets].min(axis=1), corners[meets].max(axis=1)
    margin = 0.1 * (high - low).max(axis=1, initial=0.0)[:, None]  # curved faces leave their corners' plane
    at = begin + s[:, None] * way
    near = np.all((at >= low - margin) & (at <= high + margin), axis=1) & (s > 0.0) & (s < 1.0)
    found = np.sort(s[near])
    kept = found[np.diff(found, prepend=0.0) > APART]
    return np.concatenate([[0.0], kept[kept < 1.0 - APART], [1.0]])


def _face_triangles(mesh: Mesh) -> Floats:
    """Return the corners (t, 3, 3), m, of triangles that make up the faces of all cells."""
    found = []
    for side in mesh.element.facets:
        face = side[: mesh.element.facet.corners]
        for i in range(1, len(face) - 1):
            found.append(mesh.points[mesh.cells[:, [face[0], face[i], face[i + 1]]]])
        if len(face) == 4:
            found.append(mesh.points[mesh.cells[:, [face[1], face[2], face[3]]]])
    return np.concatenate(found)
