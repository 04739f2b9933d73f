"""Distorted meshes for robustness studies: a generated mesh whose worst cell gets a given quality.

The quality of a cell is its mean ratio, 1 for a regular tetrahedron or a cube and 0 for a flat cell. In a tetrahedron
it is 12 (3 V)^(2/3) over the sum of squared edges, which equals 3 det(S)^(2/3) / |S|^2 for the map S from the regular
tetrahedron. In a hexahedron it is the least of 3 det(J)^(2/3) / |J|^2 over the corners, with J the three edges at a
corner. Ten-node tetrahedra are measured by their corners.
Source: Liu and Joe (1994); Knupp (2001), SIAM J. Sci. Comput. 23(1).
"""

from __future__ import annotations

import numpy as np

from softmark.solvers.mesh.mesh import Floats, Mesh, jacobians

SEED = 20  # seed of the random directions
FLAT = 1e-9  # sine of the angle up to which facets form one plane
HALVINGS = 120  # bisections of the amplitude, to the last digit


class QualityTooLow(Exception):
    """Raised if the undistorted mesh already has a cell of lower quality than requested.

    The message is the quality of that cell.
    """


def cell_qualities(mesh: Mesh) -> Floats:
    """Return the mean-ratio quality of every cell (m,): 1 at best, 0 or below if a cell is flat or inverted."""
    element = mesh.element
    found = element.mean_ratio_quality(mesh.points[mesh.cells[:, : element.corners]])
    if not element.warps:
        return found
    folded = (jacobians(mesh, element.quadrature()[0]) <= 0.0).any(axis=1)
    return np.where(folded, np.minimum(found, 0.0), found)


def worst_cell(mesh: Mesh) -> tuple[float, int]:
    """Return the lowest quality of a cell, and the number of that cell."""
    found = cell_qualities(mesh)
    cell = int(np.argmin(found))
    return float(found[cell]), cell


def distort(mesh: Mesh, quality: float) -> Mesh:
    """Return the mesh with randomly moved nodes, such that its worst cell has the given `quality`, between 0 and 1.

    Inner nodes move in any direction, nodes on plane parts of the boundary in that plane, and nodes on straight edges
    along the edge. Other nodes stay, so that the body and its volume do not change. Mid-edge nodes move by the mean of
    the edge's ends. All moves are proportional to one amplitude, found by bisection; no cell is inverted at smaller
    amplitudes. The random numbers are reproducible. Raises QualityTooLow.
    """
    before = worst_cell(mesh)[0]
    if before < quality:
        raise QualityTooLow(f"{before:.3g}")
    ways = _random_directions(mesh)
    low, high = 0.0, 1e-3
    while worst_cell(move_nodes(mesh, ways, high))[0] > quality and high < 1e6:
        low, high = high, 1.25 * high
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if worst_cell(move_nodes(mesh, ways, middle))[0] >= quality:
            low = middle
        else:
            high = middle
    return move_nodes(mesh, ways, low)


def move_nodes(mesh: Mesh, ways: Floats, amplitude: float) -> Mesh:
    """Return the mesh with each node moved by `amplitude` (a factor) times its vector in `ways` (n, 3), m."""
    return Mesh(mesh.points + amplitude * ways, mesh.cells, mesh.kind, mesh.skin, mesh.groups)


def _random_directions(mesh: Mesh) -> Floats:
    """Return a random vector for each node (n, 3), m, no longer than its edges, and tangential on the boundary."""
    rng = np.random.default_rng(SEED)
    ways = rng.uniform(-1.0, 1.0, mesh.points.shape) * _shortest_edges(mesh)[:, None]
    normals = _corner_facet_normals(mesh)
    for node, found in normals.items():
        ways[node] = _tangential_component(ways[node], found)
    for node, corners in enumerate(mesh.element.between, mesh.element.corners):
        ways[mesh.cells[:, node]] = ways[mesh.cells[:, list(corners)]].mean(axis=1)
    return ways


def _shortest_edges(mesh: Mesh) -> Floats:
    """Return the distance between each node and the nearest other corner of its cells, m, shape (n,)."""
    reach = np.full(len(mesh.points), np.inf)
    i, j = np.triu_indices(mesh.element.corners, 1)
    a, b = mesh.cells[:, i].ravel(), mesh.cells[:, j].ravel()
    length = np.linalg.norm(mesh.points[a] - mesh.points[b], axis=1)
    np.minimum.at(reach, a, length)
    np.minimum.at(reach, b, length)
    return np.where(np.isfinite(reach), reach, 0.0)


def _corner_facet_normals(mesh: Mesh) -> dict[int, list[Floats]]:
    """Return for each boundary corner the distinct unit normals of the triangles around it, by node number."""
    found: dict[int, list[Floats]] = {}
    triangles = mesh.facets[:, np.array(mesh.element.facet.halves)].reshape(-1, 3)
    a, b, c = (mesh.points[triangles[:, k]] for k in range(3))
    n = np.cross(b - a, c - a)
    n /= np.maximum(np.linalg.norm(n, axis=1, keepdims=True), 1e-300)
    for triangle, normal in zip(triangles.tolist(), n, strict=True):
        for node in triangle:
            known = found.setdefault(node, [])
            if all(np.linalg.norm(np.cross(normal, other)) > FLAT for other in known):
                known.append(normal)
    return found


def _tangential_component(way: Floats, normals: list[Floats]) -> Floats:
    """Return the component of a vector (3,) tangential to the boundary at a node with the given facet normals.

    For one normal it lies in the facet's plane, for two along the edge, and for more it is zero.
    """
    if len(normals) == 1:
        return way - (way @ normals[0]) * normals[0]
    if len(normals) > 2:
        return np.zeros(3)
    edge = np.cross(normals[0], normals[1])
    edge /= np.linalg.norm(edge)
    along: Floats = (way @ edge) * edge
    return along
