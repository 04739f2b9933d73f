"""Meshes of one eighth of a hollow sphere: what Lamé's solution is compared on."""

from __future__ import annotations

import numpy as np

from softmark.solvers.elements import element_of
from softmark.solvers.elements.reference_cells import Hexahedron
from softmark.solvers.mesh.cell_splitting import mesh_hexahedra, two_colour_points
from softmark.solvers.mesh.mesh import Floats, Ints, Mesh


def octant(inner: float, outer: float, along: int, through: int, kind: str) -> Mesh:
    """The part x, y, z >= 0 of a hollow sphere with radii `inner` and `outer` in m.

    Three patches meet at (1, 1, 1); each has `along` by `along` cells on the sphere and `through` across the wall, thin
    ones within. Ten-node tetrahedra are curved: their mid-edge nodes lie on the spheres of their corners.
    """
    directions, quads = _cap(along)
    radii = inner * (outer / inner) ** (np.arange(through + 1) / through)
    points = (radii[:, None, None] * directions).reshape(-1, 3)
    lower = quads[None] + len(directions) * np.arange(through)[:, None, None]
    cells = np.concatenate([lower, lower + len(directions)], axis=2).reshape(-1, 8)
    return _curved(
        mesh_hexahedra(points, cells, two_colour_points(Mesh(points, cells, Hexahedron.linear)), element_of(kind))
    )


def _cap(n: int) -> tuple[Floats, Ints]:
    """Unit vectors (p, 3) of a mesh of quadrilaterals (q, 4) on an eighth of the sphere, counter-clockwise outside."""
    s = np.arange(n + 1) / n
    u, v = (t.ravel() for t in np.meshgrid(s, s, indexing="ij"))
    patch = np.stack([np.ones_like(u), np.tan(0.25 * np.pi * u), np.tan(0.25 * np.pi * v)], axis=1)
    places = np.concatenate([np.roll(patch, turn, axis=1) for turn in range(3)])
    places /= np.linalg.norm(places, axis=1, keepdims=True)
    index = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    quads = np.stack([index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]], axis=-1).reshape(-1, 4)
    quads = np.concatenate([quads + len(patch) * turn for turn in range(3)])
    _, first, number = np.unique(np.round(places, 9) + 0.0, axis=0, return_index=True, return_inverse=True)
    return np.where(np.abs(places[first]) < 1e-12, 0.0, places[first]), number.ravel()[quads].astype(np.int64)


def _curved(mesh: Mesh) -> Mesh:
    """Mid-edge nodes moved out to the sphere of both their corners, where these lie on one."""
    r, points = np.linalg.norm(mesh.points, axis=1), mesh.points.copy()
    for node, ends in enumerate(mesh.element.between, mesh.element.corners):
        middle, around = mesh.cells[:, node], r[mesh.cells[:, list(ends)]]
        same = np.ptp(around, axis=1) < 1e-9 * around[:, 0]
        points[middle[same]] = mesh.points[middle[same]] * (around[:, 0] / r[middle])[same][:, None]
    return Mesh(points, mesh.cells, mesh.kind)
