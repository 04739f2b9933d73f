"""Validation of meshes from files, before anything is computed on them.

A file may be readable and still define no body: its pieces may be separate along coincident nodes, be connected by an
edge only, or intersect. The error for a flaw gives the number of such flaws, the location of the first one and a
remedy.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softmark.solvers.elements import element_of
from softmark.solvers.mesh.jacobian_bounds import find_folded_cells, has_folded_corner
from softmark.solvers.mesh.mesh import Floats, Ints, Mesh, jacobians

COINCIDENT = 1e-6  # relative to the extent, at most a hundredth of the shortest edge: closer nodes coincide
ABSURD = 1e50  # m: cubes of larger coordinates overflow
FLAT = 1e-13  # relative to the cube of a cell's longest edge: smaller volumes are flat
INSIDE = 1e-3  # least barycentric coordinate of a point that is well inside a tetrahedron
PAIRS = 4_000_000  # largest number of point-cell pairs: meshes with more are not searched for overlaps


class UnreadableMesh(Exception):
    """Raised if a mesh file cannot be used; has an error `code`, a message about the problem and a `remedy`."""

    def __init__(self, message: str, code: str = "E403", remedy: str | None = None) -> None:
        super().__init__(message)
        self.code = code
        self.remedy = remedy


def format_position(point: Floats) -> str:
    """Return a position, m, as text in a suitable unit, such as `(12.5, 0, 3) mm`."""
    size = float(np.abs(point).max())
    factor, unit = (1e6, "um") if 0 < size < 1e-4 else (1e3, "mm") if size < 10 else (1.0, "m")
    return f"({', '.join(f'{factor * float(x):.4g}' for x in point)}) {unit}"


def drop_unused_points(points: Floats, cells: Ints) -> tuple[Floats, Ints, Ints]:
    """Return the points that cells use, the cells with new node numbers, and the old numbers of the points.

    Raises UnreadableMesh if there are no cells, or a cell refers to a point that does not exist.
    """
    wrong = (cells < 0) | (cells >= len(points))
    if wrong.any():
        cell = int(np.argmax(wrong.any(axis=1)))
        node = int(cells[cell][wrong[cell]][0])
        raise UnreadableMesh(
            f"a cell refers to a point that does not exist: cell {cell} refers to node {node}, but the file "
            f"has nodes 0 to {len(points) - 1} ({int(wrong.any(axis=1).sum())} of {len(cells)} cells do so)",
            "E561", "write the file again: it may be incomplete, or its nodes may be counted from one",
        )  # fmt: skip
    number, renumbered = np.unique(cells, return_inverse=True)
    points, cells = np.ascontiguousarray(points[number]), renumbered.reshape(cells.shape)
    _require_finite_coordinates(points, number)
    return points, cells, number


def _require_finite_coordinates(points: Floats, number: Ints) -> None:
    """Raise UnreadableMesh if a coordinate is not finite or too large to compute with."""
    with np.errstate(invalid="ignore"):
        bad = ~(np.abs(points) < ABSURD).all(axis=1)
    if not bad.any():
        return
    first = int(np.argmax(bad))
    told = ", ".join(f"{x:g}" for x in points[first])
    finite = np.isfinite(points[first]).all()
    what = "a coordinate is absurdly large" if finite else "a coordinate is not a finite number"
    raise UnreadableMesh(
        f"{what}: node {int(number[first])} lies at ({told}) m ({int(bad.sum())} of {len(points)} nodes)",
        "E562", "write the file again in the program that made the mesh",
    )  # fmt: skip


def validate(points: Floats, cells: Ints, kind: str, coincident: str = "refuse", pieces: str = "refuse") -> Mesh:
    """Return the mesh of one body with positive cell volumes. Raises UnreadableMesh.

    `coincident` is `refuse`, `merge` or `keep`, for nodes at the same position; `pieces` is `refuse` or `keep`, for
    pieces that share no nodes.
    """
    points, cells, number = drop_unused_points(points, cells)
    if coincident == "merge":
        points, cells = merge_coincident_nodes(points, cells)
    _refuse_duplicate_cells(points, cells, kind)
    cells = orient_cells(points, cells, kind)
    mesh = Mesh(points, cells, kind)
    if coincident == "refuse":
        _refuse_coincident_nodes(mesh, number)
    if pieces == "refuse":
        _require_one_piece(mesh)
    sides = facets_of_cells(mesh)
    _check_shared_faces(mesh, *sides)
    _refuse_hinge_connections(mesh, *sides[1:])
    _refuse_self_intersection(mesh)
    return mesh


# ------------------------------------------------------------------ cells


def _refuse_duplicate_cells(points: Floats, cells: Ints, kind: str) -> None:
    """Raise UnreadableMesh if a cell occurs twice, in any order of its nodes."""
    _, first, count = np.unique(np.sort(cells, axis=1), axis=0, return_inverse=True, return_counts=True)[:3]
    again = count[first.ravel()] > 1
    if not again.any():
        return
    one, family = int(np.argmax(again)), element_of(kind).family
    twin = int(np.flatnonzero(first.ravel() == first.ravel()[one])[1])
    raise UnreadableMesh(
        f"some of its cells occur twice: {int(again.sum())} of {len(cells)} {family}, the first are cells "
        f"{one} and {twin} at {format_position(points[cells[one]].mean(axis=0))}",
        "E563", "remove the duplicates: their material would be counted twice",
    )  # fmt: skip


def orient_cells(points: Floats, cells: Ints, kind: str) -> Ints:
    """Return cells with positive volume everywhere, inverted cells reordered. Raises UnreadableMesh."""
    corners = points[cells]
    longest = np.ptp(corners, axis=1).max(axis=1)  # (m,) m
    rounding = 8 * np.finfo(float).eps * np.abs(corners).max(axis=(1, 2))
    volumes = Mesh(points, cells, kind).volumes
    flat = np.abs(volumes) <= longest**2 * (FLAT * longest + rounding)
    _refuse_bad_cells(flat, points, cells, kind, "flat", "repair the mesh: a cell without volume cannot be computed")
    turned = volumes < 0
    cells = cells.copy()
    cells[turned] = cells[turned][:, np.array(element_of(kind).mirrored_nodes)]
    _refuse_folded_cells(Mesh(points, cells, kind), longest**2 * (FLAT * longest + rounding))
    return cells


def _refuse_folded_cells(mesh: Mesh, least: Floats) -> None:
    """Raise UnreadableMesh if a cell is inverted anywhere, also between the integration points.

    Hexahedra that are inverted at a corner are accepted if no integration point lies in the inverted region.
    """
    bad, where = find_folded_cells(mesh, least)
    kept = ~has_folded_corner(Mesh(mesh.points, mesh.cells[bad], mesh.kind))
    bad, where = bad[kept], where[kept]
    if not len(bad):
        return
    corners = mesh.points[mesh.cells[bad[0]]]
    place = mesh.element.shape(where[:1])[0] @ corners
    det = jacobians(Mesh(corners, np.arange(len(corners))[None], mesh.kind), where[:1])
    left, first = (
        float(det[0, 0]) / _mean_jacobian(mesh, bad[0]),
        f"cell {bad[0]} at {format_position(corners.mean(axis=0))}",
    )
    raise UnreadableMesh(
        f"{len(bad)} of its {len(mesh.cells)} {mesh.element.family} are folded, the first is {first}: near "
        f"{format_position(place)} its volume ratio is {left:.2g} of the mean",
        "E564", "repair the mesh, with straight edges or a finer mesh of the curve: part of such a cell is "
                "inverted",
    )  # fmt: skip


def _mean_jacobian(mesh: Mesh, cell: int) -> float:
    """Return the mean of det dX/dxi over a cell, m^3."""
    return float(abs(mesh.volumes[cell]) / mesh.element.volume)


def _refuse_bad_cells(bad: NDArray[np.bool_], points: Floats, cells: Ints, kind: str, what: str, remedy: str) -> None:
    """Raise UnreadableMesh if the mask `bad` (m,) marks a cell.

    `what` says in the message what is wrong with the cells, and `remedy` how to correct it.
    """
    if not bad.any():
        return
    first, family = int(np.argmax(bad)), element_of(kind).family
    which = f"{int(bad.sum())} of its {len(cells)} {family} {'are ' if what == 'flat' else ''}{what}"
    place = format_position(points[cells[first]].mean(axis=0))
    raise UnreadableMesh(f"{which}, the first is cell {first} at {place}", "E564", remedy)


# ------------------------------------------------------------------ coincident nodes


def shortest_edge(points: Floats, cells: Ints) -> float:
    """Return the least distance between two nodes of one cell, m, apart from coincident nodes."""
    corners = points[cells]
    i, j = np.triu_indices(cells.shape[1], 1)
    squares = np.sum((corners[:, i] - corners[:, j]) ** 2, axis=2)
    return float(np.sqrt(squares[squares > 0].min(initial=np.inf)))


def find_coincident_nodes(points: Floats, cells: Ints) -> Ints:
    """Return pairs (p, 2) of coincident nodes."""
    from scipy.spatial import cKDTree

    reach = min(COINCIDENT * float(np.linalg.norm(np.ptp(points, axis=0))), 1e-2 * shortest_edge(points, cells))
    pairs: Ints = cKDTree(points).query_pairs(reach, output_type="ndarray").astype(np.int64)
    return pairs[np.lexsort(pairs.T[::-1])]


def merge_coincident_nodes(points: Floats, cells: Ints) -> tuple[Floats, Ints]:
    """Return points and cells with coincident nodes merged into the first of them."""
    part = find_components(len(points), *find_coincident_nodes(points, cells).T)
    first = np.unique(part, return_index=True)[1]
    kept, renumbered = np.unique(first[part][cells], return_inverse=True)
    return points[kept], renumbered.reshape(cells.shape)


def _refuse_coincident_nodes(mesh: Mesh, number: Ints) -> None:
    """Raise UnreadableMesh if a mesh has coincident nodes, along which it looks connected but is not.

    `number` are the numbers of the nodes in the file.
    """
    pairs = find_coincident_nodes(mesh.points, mesh.cells)
    if len(pairs):
        raise coincident_nodes_error(mesh.points, pairs, number)


def coincident_nodes_error(points: Floats, pairs: Ints, number: Ints) -> UnreadableMesh:
    """Return the error for pairs (p, 2) of coincident points.

    `number` are the numbers of the points in the file.
    """
    a, b = (int(n) for n in number[pairs[0]])
    return UnreadableMesh(
        f"it is cut apart: {len(pairs)} pairs of its {len(points)} nodes lie at the same position, the "
        f"first are nodes {a} and {b} at {format_position(points[pairs[0, 0]])}",
        "E565", "write `coincident = merge` to join them, or `coincident = keep` for an intended slit",
    )  # fmt: skip


# ------------------------------------------------------------------ connections of cells


def find_components(count: int, rows: Ints, columns: Ints) -> Ints:
    """Return the connected component of each of `count` items, shape (count,).

    Item `rows[i]` is connected with item `columns[i]`.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    links = coo_matrix((np.ones(len(rows)), (rows, columns)), shape=(count, count))
    part: Ints = connected_components(links, directed=False)[1].astype(np.int64)
    return part


def components_of_rows(numbers: Ints) -> Ints:
    """Return the connected component of each row of integers (n, k); rows that share an integer are connected."""
    count, each = numbers.shape
    part = find_components(count + int(numbers.max()) + 1, np.repeat(np.arange(count), each), count + numbers.ravel())
    return part[:count]


def _describe_pieces(mesh: Mesh, part: Ints) -> str:
    """Return text with the numbers of cells in the pieces of a mesh, and the location of the smallest piece.

    `part` (m,) is the piece of each cell.
    """
    sizes = np.sort(np.bincount(part))[::-1]
    least = int(np.argmin(np.bincount(part)))
    cell = int(np.argmax(part == least))
    listed = ", ".join(map(str, sizes[:4])) + (", ..." if len(sizes) > 4 else "")
    place = format_position(mesh.points[mesh.cells[cell]].mean(axis=0))
    return f"of {listed} cells; the smallest has cell {cell} at {place}"


def _pieces_of_nodes(mesh: Mesh) -> Ints:
    """Return the piece of each node (n,); the nodes of a cell belong to one piece."""
    width = mesh.cells.shape[1]
    return find_components(len(mesh.points), np.repeat(mesh.cells[:, 0], width - 1), mesh.cells[:, 1:].ravel())


def count_pieces(mesh: Mesh) -> int:
    """Return the number of pieces of a mesh that share no nodes."""
    return int(_pieces_of_nodes(mesh).max()) + 1


def _require_one_piece(mesh: Mesh) -> None:
    """Raise UnreadableMesh if a mesh has several unconnected pieces."""
    part = _pieces_of_nodes(mesh)
    count = int(part.max()) + 1
    if count > 1:
        raise UnreadableMesh(
            f"it consists of {count} parts that share no points, "
            f"{_describe_pieces(mesh, part[mesh.cells[:, 0]])}",
            "E566", "write each part to a file and declare a body for each, or write `pieces = keep` in "
                    "`mesh(...)`, with supports, contact or `tied(...)` for each piece",
        )  # fmt: skip


def facets_of_cells(mesh: Mesh) -> tuple[Ints, Ints, Ints]:
    """Return the corners of the facets of all cells, the cell of each, and a label that equal facets share.

    Shapes are (m s, c), (m s,) and (m s,) for m cells with s facets of c corners.
    """
    element = mesh.element
    own = np.array(element.facets)
    sides = mesh.cells[:, own].reshape(-1, own.shape[1])[:, : element.facet.corners]
    same: Ints = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True)[1].ravel().astype(np.int64)
    return sides, np.repeat(np.arange(len(mesh.cells)), len(own)), same


def _check_shared_faces(mesh: Mesh, sides: Ints, cell: Ints, same: Ints) -> None:
    """Raise UnreadableMesh if a face belongs to three cells, or to two cells on the same side of the face.

    The arguments are the results of `facets_of_cells`.
    """
    count = np.bincount(same)
    if (count > 2).any():
        face = int(np.argmax(count > 2))
        _raise_overlap_error(mesh, cell[same == face], sides[same == face][0], int((count > 2).sum()), "share a face")
    order = np.argsort(same, kind="stable")
    pair = order[np.isin(same[order], np.flatnonzero(count == 2))].reshape(-1, 2)
    alike = _facet_orientation_mask(sides[pair[:, 0]]) == _facet_orientation_mask(sides[pair[:, 1]])
    if alike.any():
        one = pair[int(np.argmax(alike))]
        _raise_overlap_error(
            mesh, cell[one], sides[one[0]], int(alike.sum()), "lie on the same side of their common face"
        )


def _facet_orientation_mask(sides: Ints) -> NDArray[np.bool_]:
    """Return the orientation of facets with corners (f, c) as a mask (f,), opposite for both sides of a face."""
    k, rows = sides.shape[1], np.arange(len(sides))
    least = np.argmin(sides, axis=1)
    turn: NDArray[np.bool_] = sides[rows, (least + 1) % k] < sides[rows, (least - 1) % k]
    return turn


def _raise_overlap_error(mesh: Mesh, cells: Ints, face: Ints, count: int, what: str) -> None:
    """Raise UnreadableMesh for cells that share a face in an invalid way."""
    named = ", ".join(map(str, cells[:-1])) + f" and {cells[-1]}"
    place = format_position(mesh.points[face].mean(axis=0))
    raise UnreadableMesh(
        f"cells {named} {what}, at {place} ({count} such face{'s' if count > 1 else ''})",
        "E567", "repair the mesh: a face must belong to one or two cells, one on each side",
    )  # fmt: skip


def _refuse_hinge_connections(mesh: Mesh, cell: Ints, same: Ints) -> None:
    """Raise UnreadableMesh if pieces are connected only by an edge or a node, about which they could rotate freely.

    `cell` and `same` are results of `facets_of_cells`.
    """
    order = np.argsort(same, kind="stable")
    inner = order[np.isin(same[order], np.flatnonzero(np.bincount(same) == 2))].reshape(-1, 2)
    part = find_components(len(mesh.cells), cell[inner[:, 0]], cell[inner[:, 1]])
    count = int(part.max()) + 1
    if count == count_pieces(mesh):
        return
    corners = mesh.cells[:, : len(set(np.array(mesh.element.facets)[:, : mesh.element.facet.corners].ravel()))]
    low, high = np.full(len(mesh.points), count), np.full(len(mesh.points), -1)
    np.minimum.at(low, corners, part[:, None])
    np.maximum.at(high, corners, part[:, None])
    joint = int(np.argmax(high > low))
    raise UnreadableMesh(
        f"it has {count} parts that share no face and are connected only at nodes or edges, such as node "
        f"{joint} at {format_position(mesh.points[joint])}: parts {_describe_pieces(mesh, part)}",
        "E568", "connect the parts at faces, or write each to a file and declare a body for each",
    )  # fmt: skip


# ------------------------------------------------------------------ overlaps


def _refuse_self_intersection(mesh: Mesh) -> None:
    """Raise UnreadableMesh if the mesh intersects itself.

    A centre of a cell or a node of the surface must not lie well inside a cell with which it is not connected.
    """
    found = find_overlap(mesh)
    if found is None:
        return
    place, cell = format_position(found[0]), found[1]
    raise UnreadableMesh(
        f"it intersects itself: {place} lies inside cell {cell} and in another part of the mesh",
        "E569", "repair the mesh: the material there would be counted twice",
    )  # fmt: skip


def find_overlap(mesh: Mesh) -> tuple[Floats, int] | None:
    """Return a point where two unconnected cells overlap, and one of the two cells; None if none is found."""
    from scipy.spatial import cKDTree

    outer = np.unique(mesh.facets)
    touched = np.zeros(len(mesh.points), dtype=np.bool_)
    touched[outer] = True
    edge = np.flatnonzero(touched[mesh.cells].any(axis=1))
    corners = mesh.points[mesh.cells]
    middles = corners.mean(axis=1)
    queries = np.concatenate([mesh.points[outer], _interior_points(mesh, edge)])
    radii = np.linalg.norm(corners - middles[:, None], axis=2).max(axis=1)
    for cells in _group_cells_by_size(radii):
        tree = cKDTree(middles[cells])
        reach = float(radii[cells].max())
        near = tree.query_ball_point(queries, reach, return_length=True)
        if int(near.sum()) > PAIRS:
            continue
        lists = tree.query_ball_point(queries, reach)
        which = np.repeat(np.arange(len(queries)), near)
        of = cells[np.concatenate([np.asarray(x, dtype=np.int64) for x in lists]).astype(np.int64)]
        found = _find_intruding_point(mesh, queries, which, of, outer, edge)
        if found is not None:
            return found
    return None


def _interior_points(mesh: Mesh, cells: Ints) -> Floats:
    """Return an interior point of each cell, (k, 3), m, for the search of overlaps.

    The point lies on no face of the tetrahedra into which a coinciding cell is divided.
    """
    corners, N = mesh.points[mesh.cells[cells]], mesh.element.shape(np.array([mesh.element.inner]))[0]
    points: Floats = np.einsum("k,mki->mi", N, corners)
    return points


def _group_cells_by_size(radii: Floats) -> list[Ints]:
    """Return groups of cells of similar size, so that one large cell does not widen the search for all."""
    group = np.floor(np.log2(radii / radii.min())).astype(np.int64)
    return [np.flatnonzero(group == g) for g in np.unique(group)]


def _find_intruding_point(mesh: Mesh, queries: Floats, which: Ints, of: Ints, outer: Ints, edge: Ints
                  ) -> tuple[Floats, int] | None:  # fmt: skip
    """Return the first query point that lies inside a cell to which it is not connected, and that cell."""
    corners = mesh.points[mesh.cells]
    low, high = corners.min(axis=1)[of], corners.max(axis=1)[of]
    boxed = ((queries[which] > low) & (queries[which] < high)).all(axis=1)
    which, of = which[boxed], of[boxed]
    inside = np.zeros(len(of), dtype=np.bool_)
    for four in mesh.element.tetrahedra:
        a, b, c, d = (mesh.points[mesh.cells[of, i]] for i in four)
        frame = np.stack([b - a, c - a, d - a], axis=2)
        det = np.linalg.det(frame)
        sound = det > 0
        frame[~sound] = np.eye(3)
        share = np.linalg.solve(frame, (queries[which] - a)[:, :, None])[:, :, 0]
        inside |= sound & (share.min(axis=1) > INSIDE) & (share.sum(axis=1) < 1 - INSIDE)
    for i in np.flatnonzero(inside).tolist():
        q = int(which[i])
        nodes = {int(outer[q])} if q < len(outer) else set(mesh.cells[edge[q - len(outer)]].tolist())
        if q < len(outer):  # the cells around the node count as its own
            nodes = set(mesh.cells[(mesh.cells == outer[q]).any(axis=1)].ravel().tolist())
        if not nodes & set(mesh.cells[of[i]].tolist()):
            return queries[q], int(of[i])
    return None
