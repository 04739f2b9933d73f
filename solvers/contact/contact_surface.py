"""Contact surface of a mesh: fine triangles (or short lines for a slice) with sample points on the facets.

Each side of a facet is split into `parts` equal parts, and the corners of the resulting triangles move with the shape
functions of the facet. So every point of the surface is at X + M x for degrees of freedom x and a sparse matrix M, and
gradients and Hessians are transformed to the degrees of freedom by M^T.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from scipy import sparse

from softmark.records import dataclass
from softmark.solvers.contact.closest_face_points import nearest_pair_of_each, vectors_from_closest_points
from softmark.solvers.contact.surface_points import SAME
from softmark.solvers.elements.boundary_facets import FACETS
from softmark.solvers.mesh.mesh import Floats, Ints, Mesh
from softmark.solvers.mesh.plane_boundary import is_on_border


@dataclass(frozen=True)
class ContactSurface:
    """Contact surface: triangles (lines for a slice) for collision detection, and sample points for pressures.

    `X` (v, d), m, are positions at rest. The first rows are corners of `faces` (t, d), which are oriented outward; the
    last `points` rows are sample points inside the facets. Displacements of all rows are M x, with the sparse matrix
    `M` (d v, dofs). `patch` (v,) numbers the separate pieces of the body. `A` (points,), m^2, are the areas of the
    samples. `of` (points,) is the mesh facet of each sample, and `home` (t,) that of each face. For a slice d is 2 and
    faces are lines; areas are then those of the whole thickness, or of rings in an axisymmetric model.
    """

    X: Floats
    M: Any
    faces: Ints
    patch: Ints
    A: Floats
    of: Ints
    home: Ints

    @property
    def points(self) -> int:
        """Number of sample points."""
        return len(self.A)

    @property
    def corners(self) -> int:
        """Number of corners of the faces."""
        return len(self.X) - self.points

    @property
    def flat(self) -> bool:
        """True for the surface of a slice, whose faces are lines in the xy plane."""
        return bool(self.X.shape[1] == 2)

    @cached_property
    def own(self) -> Ints:
        """Number (points,) of the face on which each sample lies at rest."""
        order = np.argsort(self.home, kind="stable")
        first, last = (np.searchsorted(self.home[order], self.of, side) for side in ("left", "right"))
        sample = np.repeat(np.arange(self.points), last - first)
        face = order[np.concatenate([np.arange(a, b) for a, b in zip(first, last, strict=True)])]
        p, t = self.X[self.corners + sample], self.X[self.faces[face]]
        found: Ints = face[nearest_pair_of_each(sample, np.linalg.norm(vectors_from_closest_points(p, t), axis=1))]
        return found

    def places(self, x: Floats) -> Floats:
        """Return positions (v, d), m, of corners and samples in a state x.

        The first entries of x are nodal displacements, m.
        """
        found: Floats = self.X + (self.M @ np.asarray(x, dtype=np.float64)[: self.M.shape[1]]).reshape(self.X.shape)
        return found

    @property
    def edges(self) -> Ints:
        """Edges (e, 2) of the faces without duplicates; for a slice the faces themselves."""
        if self.flat:
            return self.faces
        both = np.sort(self.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        return np.unique(both, axis=0)


def build_contact_surface(
    mesh: Mesh, dofs: int, parts: int, where: Ints | None = None, flat: bool = False, depth: float = 0.0
) -> ContactSurface:
    """Return the contact surface of a mesh with `dofs` degrees of freedom, facet sides split into `parts`.

    Samples are placed on the facets `where` (s,), or on all facets by default. `flat` is true for a slice. For an
    axisymmetric model `depth` is the thickness of the slice, m, and areas are those of whole rings.
    """
    facets = np.flatnonzero(is_on_border(mesh.points, mesh.facets)) if flat else np.arange(len(mesh.facets))
    sampled = facets if where is None else np.intersect1d(facets, where)
    split = _subdivide_into_lines if flat else subdivide_facet
    nodes, N, faces, home = _build_corners_and_faces(mesh, facets, parts, split)
    of, inside, A = _build_sample_points(mesh, sampled, parts, flat)
    rows = sparse.vstack([N, inside]).tocsr()
    d = 2 if flat else 3
    X = rows @ mesh.points
    if depth:
        from softmark.solvers.energies.axisymmetric import circumference_in_slices

        A = A * circumference_in_slices(X[N.shape[0] :, 0], depth)
    M = sparse.kron(rows, sparse.eye(3, format="csr")[:d], format="csr")
    M = sparse.csr_matrix((M.data, M.indices, M.indptr), shape=(M.shape[0], dofs))
    M.eliminate_zeros()
    patch = number_mesh_pieces(mesh)[np.concatenate([nodes, mesh.facets[of, 0]])]
    return ContactSurface(np.ascontiguousarray(X[:, :d]), M, faces, patch, A, of, home)


def number_mesh_pieces(mesh: Mesh) -> Ints:
    """Return, for each node (n,), the number of the mesh piece it belongs to; pieces share no node."""
    from scipy.sparse.csgraph import connected_components

    first = np.repeat(mesh.cells[:, 0], mesh.cells.shape[1])
    n = len(mesh.points)
    joined = sparse.coo_matrix((np.ones(len(first)), (first, mesh.cells.ravel())), shape=(n, n))
    found: Ints = connected_components(joined, directed=False)[1].astype(np.int64)
    return found


def mask_nodes_after_first_piece(mesh: Mesh) -> Any:
    """Return a mask (n,) of the nodes of all mesh pieces except the first, or None for a mesh of one piece."""
    of = number_mesh_pieces(mesh)
    return of > 0 if of.any() else None


def subdivide_facet(nodes: int, parts: int) -> tuple[Floats, Ints]:
    """Return the triangles of a facet whose sides are split into `parts`: local corners (p, 2) and triangles (t, 3).

    `nodes` is the number of nodes of the facet. Triangles are counter-clockwise.
    """
    facet = FACETS[nodes]
    step = np.array([(i, j) for i in range(parts + 1) for j in range(parts + 1)])
    number = np.arange((parts + 1) ** 2).reshape(parts + 1, parts + 1)
    a, b, c, d = number[:-1, :-1].ravel(), number[1:, :-1].ravel(), number[1:, 1:].ravel(), number[:-1, 1:].ravel()
    if facet.square:
        return 2.0 * step / parts - 1.0, np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    faces = np.concatenate([np.stack([a, b, d], axis=1), np.stack([b, c, d], axis=1)])
    faces = faces[(step[faces].sum(axis=2) <= parts).all(axis=1)]
    used, small = np.unique(faces, return_inverse=True)
    return step[used] / parts, small.reshape(-1, 3)


def _subdivide_into_lines(nodes: int, parts: int) -> tuple[Floats, Ints]:
    """Return the lines of a facet of a slice, split into `parts`: local points (p, 2) and lines (t, 2).

    The lines run along the first local coordinate. Facets where this coordinate runs along z are found by
    `_runs_along_z`.
    """
    t = np.linspace(-1.0, 1.0, parts + 1)
    return np.stack([t, np.zeros(parts + 1)], axis=1), np.stack([np.arange(parts), np.arange(1, parts + 1)], axis=1)


def _runs_along_z(mesh: Mesh, facets: Ints) -> Any:
    """Return a mask (f,) of the facets of a slice whose first local coordinate runs along z."""
    z = mesh.points[mesh.facets[facets], 2]
    return np.abs(z[:, 1] - z[:, 0]) > 0.5 * np.ptp(z, axis=1)


def _slice_averaged_shape_functions(mesh: Mesh, facets: Ints, xi: Floats, flat: bool) -> Floats:
    """Return shape functions (f, p, k) of facets at local points xi (p, 2); for a slice, averaged over its thickness.

    Pressure on a slice is uniform through its thickness. Forces only at mid-thickness would bend facets of eight nodes.
    """
    facet = FACETS[mesh.facets.shape[1]]
    if not flat:
        return np.broadcast_to(facet.shape(xi), (len(facets), len(xi), facet.nodes)).copy()
    across, w = np.polynomial.legendre.leggauss(2)
    each = [np.stack([xi[:, 0], np.full(len(xi), s)], axis=1) for s in across]
    one, other = (0.5 * sum(wi * facet.shape(X[:, ::way]) for X, wi in zip(each, w, strict=True)) for way in (1, -1))
    found: Floats = np.where(_runs_along_z(mesh, facets)[:, None, None], other, one)
    return found


def _shape_function_matrix(mesh: Mesh, facets: Ints, N: Floats) -> Any:
    """Return shape functions N (f, p, k) of facets as a sparse matrix (f p, n) over all n nodes."""
    f, p, k = N.shape
    columns = np.repeat(mesh.facets[facets][:, None, :], p, axis=1)
    layout = (N.ravel(), columns.ravel(), np.arange(0, f * p * k + 1, k))
    found = sparse.csr_matrix(layout, shape=(f * p, len(mesh.points)))
    found.data[np.abs(found.data) < SAME] = 0.0
    found.eliminate_zeros()
    return found


def _build_corners_and_faces(mesh: Mesh, facets: Ints, parts: int, split: Any) -> tuple[Ints, Any, Ints, Ints]:
    """Return the corners and faces of the split facets, with corners shared by several facets merged.

    The result is: one mesh node near each corner (c,), sparse shape-function rows of the corners (c, n), faces (t, d),
    and the mesh facet of each face (t,).
    """
    xi, small = split(mesh.facets.shape[1], parts)
    flat = small.shape[1] == 2
    rows = _shape_function_matrix(mesh, facets, _slice_averaged_shape_functions(mesh, facets, xi, flat))
    mark = rows @ np.random.default_rng(0).random(
        (len(mesh.points), 2)
    )  # two random numbers per node identify a corner
    _, first, same = np.unique(np.round(mark / SAME).astype(np.int64), axis=0, return_index=True, return_inverse=True)
    faces = same.ravel()[(len(xi) * np.arange(len(facets)))[:, None, None] + small]
    if flat:
        other = _find_reversed_lines(mesh, facets, rows, xi)
        faces[other] = faces[other][:, :, ::-1]
    home = np.repeat(facets, len(small))
    nodes = mesh.facets[facets[first // len(xi)], 0]
    return nodes, rows[first], faces.reshape(-1, small.shape[1]), home


def _find_reversed_lines(mesh: Mesh, facets: Ints, rows: Any, xi: Floats) -> Any:
    """Return a mask (f,) of the lines of a slice that have the body on their right; these must be reversed."""
    ends = (rows @ mesh.points).reshape(len(facets), len(xi), 3)
    along = ends[:, -1] - ends[:, 0]
    c = mesh.points[mesh.facets[facets][:, :4]]
    out = np.cross(c[:, 2] - c[:, 0], c[:, 3] - c[:, 1])
    return along[:, 1] * out[:, 0] - along[:, 0] * out[:, 1] < 0.0


def _build_sample_points(mesh: Mesh, facets: Ints, parts: int, flat: bool) -> tuple[Ints, Any, Floats]:
    """Return the samples of facets: the facet (s,), the shape-function row (s, n) and the area (s,), m^2, of each.

    Samples are the Gauss points of the parts of facets. Half of the pressure on a facet acts on its own samples. The
    other half acts on its flat faces, through the samples of the other surface. Forces on flat faces are distributed to
    nodes by functions I N, which interpolate the shape functions N linearly on each part. So the samples get 2 N - I N,
    and the mean of both halves is N: a uniform pressure gives the right nodal forces. (With N for the samples the
    largest error of a patch test of quadratic cells was 3 %; now it is below 0.4 %.) The true curved facet lies midway
    between its samples and its flat faces.
    """
    k = mesh.facets.shape[1]
    facet = FACETS[k]
    if flat:
        t, w = np.polynomial.legendre.leggauss(2)
        line = np.linspace(-1.0, 1.0, parts + 1)
        half = 1.0 / parts
        xi = np.stack([((line[:-1] + half)[:, None] + half * t).ravel(), np.zeros(2 * parts)], axis=1)
        weights = np.tile(half * w, parts)
    else:
        xi, weights = _gauss_points_of_parts(k, parts)
    N = 2.0 * _slice_averaged_shape_functions(mesh, facets, xi, flat) - _piecewise_linear_shape_functions(
        mesh, facets, xi, parts, flat
    )
    G = np.broadcast_to(facet.gradient(xi), (len(facets), len(xi), k, 2)).copy()
    if flat:
        turned = _runs_along_z(mesh, facets)
        G[turned] = facet.gradient(xi[:, ::-1])
    t = np.einsum("fpkj,fki->jfpi", G, mesh.points[mesh.facets[facets]])
    area = np.linalg.norm(np.cross(t[0], t[1]), axis=2)
    if flat:
        area = 2.0 * area  # of the whole thickness: the other coordinate runs from -1 to 1
    return np.repeat(facets, len(xi)), _shape_function_matrix(mesh, facets, N), (area * weights).ravel()


def _piecewise_linear_shape_functions(mesh: Mesh, facets: Ints, xi: Floats, parts: int, flat: bool) -> Floats:
    """Return shape functions interpolated linearly on each part of a facet (f, p, k), at local points xi (p, 2)."""
    corners, small = (_subdivide_into_lines if flat else subdivide_facet)(mesh.facets.shape[1], parts)
    N = _slice_averaged_shape_functions(mesh, facets, corners, flat)
    if flat:
        at = 0.5 * parts * (xi[:, 0] + 1.0)
        part = np.minimum(at.astype(np.int64), parts - 1)
        shares = np.stack([1.0 - (at - part), at - part], axis=1)
    else:
        T = corners[small]
        way = np.linalg.inv(np.stack([T[:, 1] - T[:, 0], T[:, 2] - T[:, 0]], axis=2))
        b = np.einsum("tij,ptj->pti", way, xi[:, None] - T[:, 0])
        each = np.concatenate([1.0 - b.sum(axis=2, keepdims=True), b], axis=2)
        part = each.min(axis=2).argmax(axis=1)  # the part that contains the point
        shares = each[np.arange(len(xi)), part]
    found: Floats = np.einsum("pc,fpck->fpk", shares, N[:, small[part]])
    return found


def _gauss_points_of_parts(nodes: int, parts: int) -> tuple[Floats, Floats]:
    """Return the Gauss points of all parts of a facet: local points (p, 2) and weights (p,); three or four per part."""
    facet = FACETS[nodes]
    if facet.square:
        t, w = np.polynomial.legendre.leggauss(2)
        middles = (2.0 * np.arange(parts) + 1.0) / parts - 1.0
        line, each = (middles[:, None] + t / parts).ravel(), np.tile(w / parts, parts)
        grid = np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2)
        return grid, np.outer(each, each).ravel()
    corners, faces = subdivide_facet(nodes, parts)
    inner = np.array([[4.0, 1.0, 1.0], [1.0, 4.0, 1.0], [1.0, 1.0, 4.0]]) / 6.0
    found: Floats = np.einsum("qa,tai->tqi", inner, corners[faces]).reshape(-1, 2)
    return found, np.full(len(found), 0.5 / len(found))
