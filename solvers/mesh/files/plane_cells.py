"""Plane cells of a file as a slice one cell thick: triangles become wedges, and quadrilaterals hexahedra.

Groups of cells and of edges are kept; an edge becomes the side of the slice above it. To add a type of cell: add a line
to SLICED.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from softmark.solvers.elements import element_of
from softmark.solvers.elements.reference_cells import Tetrahedron
from softmark.solvers.mesh import mesh_groups
from softmark.solvers.mesh.cell_splitting import add_midside_nodes, orient_positively
from softmark.solvers.mesh.files import named_groups
from softmark.solvers.mesh.files.mesh_reader import KINDS, OTHERS, convert_cells, parse, points_in_metres
from softmark.solvers.mesh.files.mesh_validation import (
    UnreadableMesh,
    coincident_nodes_error,
    drop_unused_points,
    find_coincident_nodes,
    format_position,
    merge_coincident_nodes,
    validate,
)
from softmark.solvers.mesh.mesh import Floats, Ints, Mesh
from softmark.solvers.mesh.mesh_group import Group

SLICED = {"triangle": "wedge6", "triangle6": "wedge15", "quad": "hex8", "quad8": "hex20", "quad9": "hex27"}
CORNERS = {"triangle": 3, "quad": 4}  # by how the names of meshio begin
OF_THE_PLANE = {"wedges": "triangles", "hexahedra": "quadrilaterals"}
EDGES = frozenset({"line", "line3", "line4"})
ENDINGS = frozenset({".msh", ".vtu", ".vtk"})
OFF = 1e-9  # relative to the extent: tolerance of z = 0
NO_REGION = "E579"


def read_slice(path: str, unit: float, coincident: str = "refuse") -> Mesh:
    """Return the plane cells of a file, all of one type, as a slice around z = 0, m. Raises UnreadableMesh.

    The slice is about as thick as the cells are wide. Clockwise cells are reversed. The named groups are included.
    `coincident` is `refuse`, `merge` or `keep`, for nodes at the same position. `unit` is the file's unit of length in
    m.
    """
    data = _parse_plane_file(Path(path))
    kind = _single_plane_cell_type(data)
    points, cells, number = drop_unused_points(
        points_in_metres(data, unit),
        np.concatenate([b.data for b in data.cells if b.type == kind]).astype(np.int64, order="C"),
    )
    _require_plane(points, number)
    edges = _edge_blocks(data)
    points, cells, ends = _treat_coincident_nodes(points, cells, number, [own for _, own in edges], coincident)
    cells = _orient_cells(points, cells, _corner_count(kind))
    mesh = _build_slice(points, cells, kind)
    return replace(
        mesh,
        groups=_named_groups_of_slice(data, kind, mesh, cells, dict(zip((n for n, _ in edges), ends, strict=True))),
    )


def extrude_cells(points: Floats, cells: Ints, kind: str) -> Mesh:
    """Return the slice of plane cells (m, a) over points (n, 3), m. Raises UnreadableMesh.

    The order of the cells is kept. `kind` is meshio's name of the cell type. Clockwise cells are reversed.
    """
    known, own, number = drop_unused_points(points, cells)
    _require_plane(known, number)
    return _build_slice(known, _orient_cells(known, own, _corner_count(kind)), kind)


def convert_slice(mesh: Mesh, kind: str) -> Mesh:
    """Return a slice from a file with its cells converted to the element `kind`. Raises UnreadableMesh."""
    if kind == Tetrahedron.linear:
        return _split_slice_into_tetrahedra(mesh)
    if (own := mesh.element.family) != (other := element_of(kind).family):
        raise UnreadableMesh(
            f"it has {OF_THE_PLANE[own]}, but the model needs {OF_THE_PLANE.get(other, other)}", NO_REGION,
            "use `tri3` or `tri6` for triangles, and `quad4`, `quad8` or `quad9` for quadrilaterals",
        )  # fmt: skip
    return convert_cells(mesh, kind, "")


def _corner_count(kind: str) -> int:
    return next(many for name, many in CORNERS.items() if kind.startswith(name))


def _parse_plane_file(path: Path) -> Any:
    """Return the file as read by meshio. Raises UnreadableMesh."""
    if path.suffix.lower() not in ENDINGS:
        raise UnreadableMesh(
            f"plane cells cannot be read from `{path.suffix or path.name}` files", NO_REGION,
            "convert it to .msh (Gmsh 2 or 4.1), .vtu or .vtk, and name that file",
        )  # fmt: skip
    return parse(path)


def _single_plane_cell_type(data: Any) -> str:
    """Return meshio's name of the only type of plane cell in a file.

    Raises UnreadableMesh if there is none, or several.
    """
    there = {block.type for block in data.cells if len(block.data)}
    if solids := sorted(there & (KINDS.keys() | OTHERS)):
        raise UnreadableMesh(
            f"it has solid cells ({', '.join(solids)}), but the body is a slice of a plane region", NO_REGION,
            "name a file of triangles or quadrilaterals with z = 0; for a solid body write "
            "`solid(mesh(...), ...)`",
        )  # fmt: skip
    flat = sorted(name for name in there if name.startswith(tuple(CORNERS)))
    if not flat:
        kinds = ", ".join(sorted(there)) or "none"
        raise UnreadableMesh(f"it has no triangles and no quadrilaterals (its cells: {kinds})", NO_REGION,
                             "write the plane mesh of the region, at z = 0, with its cells")  # fmt: skip
    if len(flat) > 1:
        raise UnreadableMesh(f"it has plane cells of several kinds ({', '.join(flat)})", NO_REGION,
                             "use one kind of cells: only triangles, or only quadrilaterals")  # fmt: skip
    if flat[0] not in SLICED:
        raise UnreadableMesh(f"there is no element for its cells ({flat[0]})", NO_REGION,
                             f"supported cells: {', '.join(SLICED)}")  # fmt: skip
    return str(flat[0])


def _require_plane(points: Floats, number: Ints) -> None:
    """Raise UnreadableMesh if points (n, 3) lie off the plane z = 0; `number` are their numbers in the file."""
    off = np.abs(points[:, 2]) > OFF * float(np.linalg.norm(np.ptp(points, axis=0)))
    if not off.any():
        return
    first = int(np.argmax(off))
    raise UnreadableMesh(
        f"{int(off.sum())} of its {len(points)} nodes lie off the plane z = 0, the first is node {number[first]} at "
        f"{format_position(points[first])}",
        NO_REGION, "write the region in the x-y plane, z = 0; a curved surface is not a plane body",
    )  # fmt: skip


def _edge_blocks(data: Any) -> list[tuple[int, Ints]]:
    """Return the edges (e, 2) of each block of a file, with the number of the block."""
    return [(i, block.data[:, :2].astype(np.int64)) for i, block in enumerate(data.cells) if block.type in EDGES]


def _treat_coincident_nodes(points: Floats, cells: Ints, number: Ints, edges: list[Ints], coincident: str
           ) -> tuple[Floats, Ints, list[Ints]]:  # fmt: skip
    """Return points, cells and edges, with coincident nodes refused, merged or kept. Raises UnreadableMesh.

    The given edges refer to points by their `number` in the file, the returned ones by their new numbers. Ends of edges
    that belong to no cell become -1.
    """
    now = np.full(max([int(number.max()), *(int(e.max(initial=0)) for e in edges)]) + 1, -1)
    now[number] = np.arange(len(number))
    pairs = find_coincident_nodes(points, cells) if coincident != "keep" else np.zeros((0, 2), dtype=np.int64)
    if len(pairs) and coincident == "refuse":
        raise coincident_nodes_error(points, pairs, number)
    if len(pairs):
        same = merge_coincident_nodes(points, np.arange(len(points))[:, None])[1][:, 0]
        points, cells = merge_coincident_nodes(points, cells)
        now[number] = same
    return points, cells, [np.where(own < 0, -1, now[np.maximum(own, 0)]) for own in edges]


def _orient_cells(points: Floats, cells: Ints, corners: int) -> Ints:
    """Return cells (m, a) with their first `corners` nodes in counter-clockwise order."""
    own = points[cells[:, :corners], :2]
    # relative to a corner, to avoid cancellation far from the origin
    x, y = np.moveaxis(own - own[:, :1], 2, 0)
    area = (x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)).sum(axis=1)
    back = [0, *range(corners - 1, 0, -1), *range(2 * corners - 1, corners - 1, -1), *range(2 * corners, 9)]
    over = area < 0.0
    cells = cells.copy()
    cells[over] = cells[over][:, back[: cells.shape[1]]]
    return cells


def _build_slice(points: Floats, cells: Ints, kind: str) -> Mesh:
    """Return the validated slice of plane cells (m, a) of a type. Raises UnreadableMesh."""
    c, n, element = _corner_count(kind), len(points), element_of(SLICED[kind])
    half = 0.5 * float(np.linalg.norm(np.ptp(points, axis=0))) / max(1.0, np.sqrt(len(cells)))
    layers = np.concatenate([points, points])
    layers[:, 2] = np.repeat((-half, half), n)
    mesh = Mesh(layers, np.concatenate([cells[:, :c], cells[:, :c] + n], axis=1), element.linear)
    if element.name != element.linear:
        mesh = add_midside_nodes(mesh, element)  # separate points
        for k, ends in enumerate(element.between):
            below = tuple(sorted({corner % c for corner in ends}))
            if len(below) > 1:  # as in the file, since sides may be curved
                own = 2 * c if len(below) == c else c + (below[0] if below[1] == below[0] + 1 else c - 1)
                mesh.points[mesh.cells[:, element.corners + k], :2] = points[cells[:, own], :2]
    try:
        return validate(mesh.points, mesh.cells, mesh.kind, "keep")
    except UnreadableMesh as wrong:
        said = str(wrong)
        for ours, theirs in OF_THE_PLANE.items():
            said = said.replace(ours, theirs)
        raise UnreadableMesh(said, wrong.code, wrong.remedy) from wrong


def _named_groups_of_slice(data: Any, kind: str, mesh: Mesh, cells: Ints, edges: dict[int, Ints]) -> dict[str, Group]:
    """Return the named groups of a file: cells, and sides of the slice above edges.

    `edges` are the edges (e, 2) of each block of the file. If a name has both cells and edges, the group of sides is
    called `NAME:edges`.
    """
    c, element, found = mesh.element.corners // 2, mesh.element, {}
    first = [sum(len(b.data) for b in data.cells[:i] if b.type == kind) for i in range(len(data.cells))]
    for name, masks in named_groups.group_masks(data, (2, 1)):
        of = [first[i] + np.flatnonzero(m) for i, m in enumerate(masks) if data.cells[i].type == kind]
        on = [own[np.asarray(masks[i], dtype=np.bool_)] for i, own in edges.items()]
        members, sides = np.concatenate(of), np.concatenate([*on, np.zeros((0, 2), dtype=np.int64)])
        if len(members) or not len(sides):
            found[name] = Group("cells", members.astype(np.int64))
        if len(sides):
            found[f"{name}{named_groups.EDGES}" if len(members) else name] = _sides_above_edges(
                mesh, cells[:, :c], sides, element
            )
    return found


def _sides_above_edges(mesh: Mesh, cells: Ints, edges: Ints, element: Any) -> Group:
    """Return the group of the sides of a slice above edges (e, 2) of its plane cells (m, c)."""
    n = int(cells.max()) + 1
    known = edges[(edges >= 0).all(axis=1) & (edges < n).all(axis=1)]
    both = np.concatenate([cells, cells + n], axis=1)
    members, none = mesh_groups.find_faces_by_corners(both, element, np.concatenate([known, known + n], axis=1))
    own = Group("faces", members, 0, none + len(edges) - len(known))
    there = int(mesh_groups.facets_in(replace(mesh, groups={"": own}), "").sum())
    return replace(own, inside=len(members) - there)


def _split_slice_into_tetrahedra(mesh: Mesh) -> Mesh:
    """Return tetrahedra with matching faces made from a slice, for probes of volumes.

    Diagonals start at the node with the lower number.
    """
    c = mesh.element.corners // 2
    low = mesh.cells[:, [(0, k, k + 1) for k in range(1, c - 1)]]  # (m, c - 2, 3)
    high = mesh.cells[:, [(c, c + k, c + k + 1) for k in range(1, c - 1)]]
    order = np.argsort(low, axis=2)
    six = np.concatenate([np.take_along_axis(a, order, axis=2) for a in (low, high)], axis=2)
    cells = six[:, :, np.array(((0, 1, 2, 5), (0, 1, 5, 4), (0, 4, 5, 3)))].reshape(-1, 4)
    element = element_of(Tetrahedron.linear)
    return mesh_groups.transfer_groups_to_split(
        mesh, Mesh(mesh.points, orient_positively(mesh.points, cells, element), element.name)
    )
