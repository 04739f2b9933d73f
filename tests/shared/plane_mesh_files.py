"""Mesh files of plane cells, written from the slices that shapes are meshed with."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import meshio
import numpy as np

from softmark.solvers.mesh.plane_regions import PlaneRegion

KINDS = {"tri3": "triangle", "tri6": "triangle6", "quad4": "quad", "quad8": "quad8", "quad9": "quad9"}
TYPES = {"triangle": 2, "triangle6": 9, "quad": 3, "quad8": 16, "quad9": 10, "line": 1}


def plane_cells(region: PlaneRegion, element: str, size: float) -> tuple[Any, Any]:
    """Points (n, 3) with z = 0, m, and cells (m, a) in meshio's order, their nodes in an order of chance."""
    made = region.mesh(element, size)
    own, c = made.element, made.element.corners // 2
    between = [set(ends) for ends in own.between]
    wanted = [{k, (k + 1) % c} for k in range(c)] if own.nodes > own.corners else []
    wanted += [set(range(c))] if element == "quad9" else []
    cells = made.cells[:, [*range(c), *(own.corners + between.index(ends) for ends in wanted)]]
    used, cells = np.unique(cells, return_inverse=True)
    order = np.random.default_rng(7).permutation(len(used))
    points = np.empty((len(used), 3))
    points[order] = made.points[used] * (1.0, 1.0, 0.0)
    return points, order[cells.reshape(len(made.cells), -1)]


def clockwise(cells: Any, corners: int) -> Any:
    """The same cells (m, a) turned over."""
    middles = range(2 * corners - 1, corners - 1, -1)
    return cells[:, [0, *range(corners - 1, 0, -1), *middles, *range(2 * corners, 9)][: cells.shape[1]]]


def outline(points: Any, cells: Any, corners: int) -> Any:
    """Edges (e, 2) that one cell has alone."""
    edges = np.concatenate([cells[:, [k, (k + 1) % corners]] for k in range(corners)])
    _, first, count = np.unique(np.sort(edges, axis=1), axis=0, return_index=True, return_counts=True)
    return edges[first[count == 1]]


def write(path: Path, points: Any, kind: str, cells: Any, groups: dict[str, Any], edges: dict[str, Any]) -> str:
    """A file in the format of its ending: `groups` are masks of cells (m,), `edges` (e, 2) by name.

    `.4.msh` is Gmsh's format 4.1, any other `.msh` its format 2; VTU and VTK have the numbers 1, 2, ... of groups in an
    array `part`, those of edges after those of cells.
    """
    edges = {name: own for name, own in edges.items() if len(own)}
    number = {name: i for i, name in enumerate([*groups, *edges], start=1)}
    tags = np.zeros(len(cells), dtype=np.int64)
    for name, mask in groups.items():
        tags[mask] = number[name]
    blocks = [(kind, cells), *(("line", own) for own in edges.values())]
    data = [tags, *(np.full(len(own), number[name]) for name, own in edges.items())]
    if path.name.endswith(".4.msh"):
        path.write_text(_gmsh4(points, blocks, data, {n: (2 if n in groups else 1, k) for n, k in number.items()}))
        return str(path)
    if path.suffix == ".msh":
        fields = {name: np.array([k, 2 if name in groups else 1]) for name, k in number.items()}
        mesh = meshio.Mesh(points, blocks, cell_data={"gmsh:physical": data, "gmsh:geometrical": data},
                           field_data=fields)  # fmt: skip
        meshio.write(path, mesh, "gmsh22", binary=False)
    else:
        meshio.write(path, meshio.Mesh(points, blocks, cell_data={"part": data}))
    return str(path)


def _gmsh4(points: Any, blocks: Any, data: Any, names: dict[str, tuple[int, int]]) -> str:
    """Format 4.1, in which cells belong to entities and these to physical groups."""
    apart = [
        (1 if kind == "line" else 2, int(tag), kind, cells[own == tag])
        for (kind, cells), own in zip(blocks, data, strict=True)
        for tag in np.unique(own)
    ]
    box = "0 0 0 1 1 0"
    curves = [f"{i} {box} 1 {tag} 0" for i, (dim, tag, _, _) in enumerate(apart, start=1) if dim == 1]
    faces = [f"{i} {box} {f'1 {tag}' if tag else 0} 0" for i, (dim, tag, *_) in enumerate(apart, start=1) if dim == 2]
    total, lines, at = sum(len(cells) for *_, cells in apart), [], 0
    for i, (dim, _, kind, cells) in enumerate(apart, start=1):
        lines.append(f"{dim} {i} {TYPES[kind]} {len(cells)}")
        lines += [" ".join(map(str, (at + k, *(row + 1)))) for k, row in enumerate(cells, start=1)]
        at += len(cells)
    n = len(points)
    return "\n".join([
        "$MeshFormat", "4.1 0 8", "$EndMeshFormat", "$PhysicalNames", str(len(names)),
        *(f'{dim} {tag} "{name}"' for name, (dim, tag) in names.items()), "$EndPhysicalNames",
        "$Entities", f"0 {len(curves)} {len(faces)} 0", *curves, *faces, "$EndEntities",
        "$Nodes", f"1 {n} 1 {n}", f"2 {len(apart) and 1} 0 {n}", *(str(k + 1) for k in range(n)),
        *(" ".join(repr(float(x)) for x in row) for row in points), "$EndNodes",
        "$Elements", f"{len(apart)} {total} 1 {total}", *lines, "$EndElements", "",
    ])  # fmt: skip
