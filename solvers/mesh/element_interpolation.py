"""Interpolation by finite elements on a mesh: shape function gradients, and location of points in cells."""

from __future__ import annotations

import numpy as np

from softmark.records import dataclass
from softmark.solvers.elements.element import Element
from softmark.solvers.mesh.bounding_box_search import find_boxes_of_points
from softmark.solvers.mesh.mesh import Floats, Ints, Mesh
from softmark.solvers.mesh.nearest_points import build_point_search

Rule = tuple[Floats, Floats]  # local points (q, 3) and weights (q,)
BESIDE = 1e-9  # negative barycentric coordinates of this size are attributed to rounding
STILL = 1e-13  # change of local coordinates at which iterations end
OUT = 0.01  # in local coordinates: a point farther outside by the last step is not on a shared face
CHUNK = 32  # points whose distances to all cells are held at once


@dataclass(frozen=True)
class IntegrationPoints:
    """Shape functions and weights at the integration points of all cells.

    `dNdX` (m, q, a, 3) are gradients, 1/m, and `w` (m, q) the quadrature weights times det J, m^3. The shape functions
    `N` are (q, a) if all cells have the same local points, else (m, q, a).
    """

    dNdX: Floats
    w: Floats
    N: Floats

    def at_points(self, nodal: Floats) -> Floats:
        """Return values (m, q) at the integration points from values (m, a) at the nodes of cells."""
        found: Floats = nodal @ self.N.T if self.N.ndim == 2 else np.einsum("mqa,ma->mq", self.N, nodal)
        return found


def integrate_cells(mesh: Mesh, element: type[Element] | None = None, rule: Rule | None = None) -> IntegrationPoints:
    """Return shape functions and weights at integration points, with gradients in the undeformed position X.

    By default the element and the quadrature rule of the mesh are used, and the result is cached.
    """
    if element is None and rule is None:
        if integrate_cells not in mesh.selections:
            mesh.selections[integrate_cells] = integrate_cells(mesh, mesh.element)
        found: IntegrationPoints = mesh.selections[integrate_cells]
        return found
    element = element or mesh.element
    xi, weights = rule or element.quadrature()
    dN = element.gradient(xi)  # (q, a, 3)
    dXdxi = np.einsum("mai,qaj->mqij", mesh.points[mesh.cells], dN)
    dNdX = np.einsum("qaj,mqji->mqai", dN, np.linalg.inv(dXdxi))
    w = weights * np.linalg.det(dXdxi)
    return IntegrationPoints(np.ascontiguousarray(dNdX), w, element.shape(xi))


def mean_gradients(mesh: Mesh, revolved: bool = False) -> IntegrationPoints:
    """Return one integration point for each cell, with cell means of gradients and the volume of the cell.

    Like the gradient at the centre, the mean is exact for a displacement with constant gradient. Under constant stress
    the mean also gives the exact nodal forces, int dN_a/dX dV, whereas the gradient at the centre does so only in
    parallelepipeds. So cells of any shape pass the patch test. For a slice `revolved` about the y axis, gradients are
    means over whole rings, and shape functions are means over the slice.
    Source: Flanagan and Belytschko (1981), "A uniform strain hexahedron and quadrilateral with orthogonal hourglass
    control".
    """
    parts = integrate_cells(mesh)
    w, N = parts.w[:, None, :], np.broadcast_to(parts.N, parts.dNdX.shape[:3])
    ring = w * parts.at_points(mesh.points[mesh.cells, 0])[:, None, :] if revolved else w
    each = ring @ parts.dNdX.reshape(*parts.w.shape, -1) / ring.sum(axis=2, keepdims=True)
    dNdX = np.ascontiguousarray(each.reshape(len(w), 1, -1, 3))
    return IntegrationPoints(dNdX, w.sum(axis=2), w @ N / w.sum(axis=2, keepdims=True))


KEPT = (4, 64, 50_000)  # cached sets of points: always kept, at most kept, and largest total number of points


@dataclass(frozen=True)
class PointLocations:
    """Locations of points in a mesh: the nodes (n, a) of each point's cell and the shape functions `N` (n, a) there.

    `outside` (n,) is the approximate distance, m, of a point from its cell, and 0 inside. For plane faces it is the
    distance to the farthest of the face planes beyond which the point lies; for curved faces, to a point of the cell.
    """

    nodes: Ints
    N: Floats
    outside: Floats

    def interpolate(self, values: Floats) -> Floats:
        """Return values at the points (n, k) from values at the nodes (nodes, k)."""
        result: Floats = np.einsum("na,nak->nk", self.N, values[self.nodes])
        return result


def locate_points(mesh: Mesh, X: Floats) -> PointLocations:
    """Return the cell and the shape functions at each point X (n, 3), m, of the undeformed body.

    A point between a mesh and the curved surface in which it is inscribed gets the nearest cell and is extrapolated
    linearly, so the caller must check `outside`. A point on a face between two cells gets either cell. The most recent
    sets of points are cached with the mesh, because probes request their points repeatedly.
    """
    kept: list[tuple[Floats, PointLocations]] = mesh.selections.setdefault(locate_points, [])
    for number, (own, found) in enumerate(kept):
        if own.shape == X.shape and np.array_equal(own, X):
            kept.insert(0, kept.pop(number))
            return found
    found = _locate_in_tetrahedra(mesh, X) if mesh.element.constant else _locate_in_curved_cells(mesh, X)
    cache_locations(mesh, X, found)
    return found


def cache_locations(mesh: Mesh, X: Floats, found: PointLocations) -> None:
    """Cache the locations `found` of points X (n, 3), m, for later calls of `locate_points` on this mesh.

    The locations were found in this mesh, or in a larger mesh that contains the same cells.
    """
    kept: list[tuple[Floats, PointLocations]] = mesh.selections.setdefault(locate_points, [])
    kept.insert(0, (X.copy(), found))
    always, most, points = KEPT
    sizes = np.cumsum([len(own) for own, _ in kept])
    del kept[min(most, max(always, int(np.searchsorted(sizes, points, side="right")))) :]


# ------------------------------------------------------------------ four-node tetrahedra, in closed form


def _locate_in_tetrahedra(mesh: Mesh, X: Floats) -> PointLocations:
    """Return the locations of points X (n, 3), m, in a mesh of four-node tetrahedra."""
    a = mesh.points[mesh.cells[:, 0]]
    inverse = np.linalg.inv(np.stack([mesh.points[mesh.cells[:, i]] - a for i in (1, 2, 3)], axis=2))
    found = _most_interior_cells(mesh, X, a, inverse)
    N = _barycentric_coordinates(X, a, inverse, found)
    lost = np.flatnonzero(N.min(axis=1, initial=0.0) < -BESIDE)
    if len(lost):
        found[lost] = _nearest_cells(mesh, X[lost], a, inverse)
        N[lost] = _barycentric_coordinates(X[lost], a, inverse, found[lost])
    dN = inverse[found]  # (n, 3, 3): rows are the gradients of N_1, N_2, N_3
    dN = np.concatenate([-dN.sum(axis=1, keepdims=True), dN], axis=1)
    outside = np.maximum(0.0, (-N / np.linalg.norm(dN, axis=2)).max(axis=1, initial=0.0))  # to the farthest face plane
    outside[outside < 1e-9 * mesh.extent] = 0.0
    return PointLocations(mesh.cells[found], N, outside)


def _barycentric_coordinates(X: Floats, a: Floats, inverse: Floats, cell: Ints) -> Floats:
    """Return the barycentric coordinates (n, 4) of points X (n, 3), each in one tetrahedron `cell` (n,).

    `a` (m, 3) is the first corner of each tetrahedron of the mesh, and `inverse` (m, 3, 3) the inverse of its edge
    matrix.
    """
    xi = np.einsum("nij,nj->ni", inverse[cell], X - a[cell])
    return np.concatenate([1.0 - xi.sum(axis=1, keepdims=True), xi], axis=1)


def _nearest_cells(mesh: Mesh, X: Floats, a: Floats, inverse: Floats) -> Ints:
    """Return the boundary cell nearest to each point X (n, 3), m, outside the mesh, shape (n,).

    Among equally near cells, the one whose smallest barycentric coordinate at X is largest is returned. Only boundary
    facets within the distance of the nearest boundary corner are searched. `a` and `inverse` are those of
    `_barycentric_coordinates`.
    """
    corners = mesh.points[mesh.facets]  # (f, 3, 3)
    middles = corners.mean(axis=1)
    radius = float(np.sqrt(((corners - middles[:, None]) ** 2).sum(axis=2).max()))
    near = build_point_search(mesh.points[np.unique(mesh.facets)], len(X))
    reach = near.distance(X) + radius
    owners, best = mesh.facet_cells, np.empty(len(X), dtype=np.int64)
    around = build_point_search(middles, len(X))
    for start in range(0, len(X), 64 * CHUNK):
        some = slice(start, start + 64 * CHUNK)
        which, facet = around.within(X[some], reach[some] * (1.0 + 1e-9))
        points, cell = X[some][which], owners[facet]
        gap = _distance_to_triangles(points, corners[facet])
        least = np.full(len(X[some]), np.inf)
        np.minimum.at(least, which, gap)
        tied = np.flatnonzero(gap <= least[which] + 1e-12 * mesh.extent)
        inside = _barycentric_coordinates(points[tied], a, inverse, cell[tied]).min(axis=1)
        order = tied[np.lexsort((cell[tied], -inside, which[tied]))]
        best[some] = cell[order[np.unique(which[order], return_index=True)[1]]]
    return best


def _distance_to_triangles(X: Floats, corners: Floats) -> Floats:
    """Return the distance (p,), m, between each point X (p, 3) and one triangle, with corners (p, 3, 3)."""
    from_corner = X[:, None] - corners  # (p, 3, 3)
    along = np.roll(corners, -1, axis=1) - corners
    part = np.einsum("pki,pki->pk", from_corner, along) / np.einsum("pki,pki->pk", along, along)
    beside = from_corner - np.clip(part, 0.0, 1.0)[:, :, None] * along
    squares = np.einsum("pki,pki->pk", beside, beside).min(axis=1)
    normal = np.cross(along[:, 0], along[:, 1])
    within = np.einsum("pki,pki->pk", np.cross(normal[:, None], along), from_corner).min(axis=1) >= 0.0
    height = np.einsum("pi,pi->p", normal, from_corner[:, 0]) ** 2 / np.einsum("pi,pi->p", normal, normal)
    distance: Floats = np.sqrt(np.where(within, np.minimum(height, squares), squares))
    return distance


def _most_interior_cells(mesh: Mesh, X: Floats, a: Floats, inverse: Floats) -> Ints:
    """Return for each point X (n, 3) the cell in which its smallest barycentric coordinate is largest, shape (n,).

    Only cells whose bounding box contains the point are considered; the cell that contains the point is among them. A
    point in no box gets an arbitrary cell.
    """
    corners, slack = mesh.points[mesh.cells], 10.0 * BESIDE * mesh.extent
    which, cell = find_boxes_of_points(corners.min(axis=1) - slack, corners.max(axis=1) + slack, X)
    best = np.zeros(len(X), dtype=np.int64)
    least = _barycentric_coordinates(X[which], a, inverse, cell).min(axis=1, initial=np.inf)
    order = np.lexsort((cell, -least, which))
    found, first = np.unique(which[order], return_index=True)
    best[found] = cell[order[first]]
    return best


# ------------------------------------------------------------------ other cells, by Newton's method


def _locate_in_curved_cells(mesh: Mesh, X: Floats) -> PointLocations:
    """Return the locations of points X (n, 3), m, in a mesh of cells other than four-node tetrahedra."""
    which, cell = _candidate_cells(mesh, X)
    xi = _find_local_coordinates(mesh, which, X[which], cell)
    element, corners = mesh.element, mesh.points[mesh.cells[cell]]  # (p, a, 3)
    inner = element.clip(xi)
    N = element.shape(inner)
    gap = np.linalg.norm(X[which] - np.einsum("pa,pai->pi", N, corners), axis=1)
    gap[gap < 1e-9 * mesh.extent] = 0.0
    order = np.lexsort((cell, gap, which))
    chosen = order[np.unique(which[order], return_index=True)[1]]
    return PointLocations(
        mesh.cells[cell[chosen]], _extrapolated_shape_functions(mesh, X, cell[chosen], inner[chosen]), gap[chosen]
    )


def _extrapolated_shape_functions(mesh: Mesh, X: Floats, cell: Ints, xi: Floats) -> Floats:
    """Return the shape functions (n, a) of a cell at each point X (n, 3), m, linearly extrapolated from `xi` (n, 3).

    `xi` is the local point nearest to X, and `cell` (n,) the cell. The result is N(xi) + dN/dxi . d with the remaining
    local distance d to X, which is zero inside the cell.
    """
    N, dN = mesh.element.shape(xi), mesh.element.gradient(xi)
    corners = mesh.points[mesh.cells[cell]]
    J = np.einsum("pai,paj->pij", corners, dN)
    rest = _newton_steps(J, X - np.einsum("pa,pai->pi", N, corners))
    values: Floats = N + np.einsum("paj,pj->pa", dN, rest)
    return values


def _candidate_cells(mesh: Mesh, X: Floats, nearest: int = 12) -> tuple[Ints, Ints]:
    """Return pairs of a point and a candidate cell, as two arrays (p,).

    Candidates are the cells whose bounding box contains the point, or else those with the nearest boxes.
    """
    corners = mesh.points[mesh.cells]
    low, high = corners.min(axis=1), corners.max(axis=1)
    # an edge of a curved cell can leave the box of its nodes
    slack = 0.05 * (high - low).max(axis=1, keepdims=True)
    low, high = low - slack, high + slack
    which, cells = find_boxes_of_points(low, high, X)
    lost = np.setdiff1d(np.arange(len(X)), which)
    point, near = _nearest_boxes(low, high, X[lost], min(nearest, len(low)))
    return np.concatenate([which, lost[point]]), np.concatenate([cells, near])


def _nearest_boxes(low: Floats, high: Floats, X: Floats, count: int) -> tuple[Ints, Ints]:
    """Return pairs of each point X (n, 3) and the `count` boxes nearest to it, as two arrays (n count,)."""
    bounds = [(np.ascontiguousarray(low[:, i]), np.ascontiguousarray(high[:, i])) for i in range(3)]
    found = np.zeros((len(X), count), dtype=np.int64)
    for start in range(0, len(X), CHUNK):
        away = np.zeros((len(X[start : start + CHUNK]), len(low)))  # (c, m)
        for (lowest, highest), x in zip(bounds, X[start : start + CHUNK].T[:, :, None], strict=True):
            gap = np.maximum(lowest - x, x - highest)
            away += np.maximum(gap, 0.0, out=gap)
        found[start : start + CHUNK] = np.argpartition(away, count - 1, axis=1)[:, :count]
    return np.repeat(np.arange(len(X)), count), found.ravel()


def _newton_steps(J: Floats, rest: Floats) -> Floats:
    """Return the solutions (p, 3) of J s = rest, the shortest ones where a cell is collapsed to an edge or point."""
    try:
        return np.asarray(np.linalg.solve(J, rest[:, :, None])[:, :, 0])
    except np.linalg.LinAlgError:
        return np.asarray((np.linalg.pinv(J) @ rest[:, :, None])[:, :, 0])


def _find_local_coordinates(mesh: Mesh, which: Ints, X: Floats, cell: Ints) -> Floats:
    """Return the local coordinates xi (p, 3) of points X (p, 3), m, in cells (p,), by projected Newton steps.

    For a point outside its cell, the result is the local point of the cell nearest to X. Iterations for a pair of a
    point and a cell end when the local point no longer moves, or when it leaves the cell and another cell contains the
    point. `which` (p,) is the number of the point in each pair.
    """
    element = mesh.element
    result = np.tile(np.array(element.centre), (len(X), 1))
    moving, held = np.arange(len(X)), np.zeros(int(which.max(initial=-1)) + 1, dtype=bool)
    for _ in range(20):
        xi, corners = result[moving], mesh.points[mesh.cells[cell[moving]]]  # (p, a, 3)
        N, dN = element.shape(xi), element.gradient(xi)
        J = np.einsum("pai,paj->pij", corners, dN)
        rest = X[moving] - np.einsum("pa,pai->pi", N, corners)
        wanted = xi + _newton_steps(J, rest)
        moved = result[moving] = element.clip(wanted)
        settled, without = np.abs(moved - xi).max(axis=1) < STILL, np.abs(moved - wanted).max(axis=1)
        held[which[moving[settled & (without < STILL)]]] = True
        moving = moving[~(settled | (held[which[moving]] & (without > OUT)))]
        if not len(moving):
            break
    return result
