"""Meshes from files, through meshio; Gmsh's first format, which meshio does not know, is read here."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np

from softmark.solvers.elements import ELEMENTS
from softmark.solvers.mesh import gmsh1
from softmark.solvers.mesh.mesh import Floats, Ints, Mesh, jacobians, surface
from softmark.solvers.mesh.splits import SPLITS, NotTwoColourable, quadratic

UNENDING = frozenset({"ansys", "tecplot"})  # meshio's readers of these never return from a truncated file

KINDS = {"tetra": "tet4", "tetra10": "tet10", "hexahedron": "hex8"}  # meshio's word -> ours
NAMES = {"tet4": "four-node tetrahedra", "tet10": "ten-node tetrahedra", "hex8": "hexahedra"}
OTHERS = frozenset({"wedge", "pyramid", "hexahedron20", "hexahedron27"})
OTHERS |= {"wedge15", "wedge18", "pyramid13", "pyramid14"}
FACETS = {"triangle": ((0, 1, 2),), "quad": ((0, 1, 2), (0, 2, 3))}


class Unreadable(Exception):
    """A mesh file cannot be used; the message says what is wrong with it."""


def read(path: str, unit: float) -> Mesh:
    """The solid cells of `path`, all of one kind, in m and turned to positive volume. Raises Unreadable."""
    data = _parsed(Path(path))
    there = {block.type for block in data.cells}
    solids = sorted(there & KINDS.keys())
    if not solids:
        kinds = ", ".join(sorted(there)) or "none"
        raise Unreadable(f"it has no tetrahedra and no hexahedra (its cells: {kinds})")
    others = (there & OTHERS) | set(solids[1:])
    if others:
        raise Unreadable(
            f"it has other solid cells beside its {solids[0]} cells ({', '.join(sorted(others))})"
        )
    cells = [block.data for block in data.cells if block.type == solids[0]]
    return _checked(_points(data, unit), np.concatenate(cells).astype(np.int64), KINDS[solids[0]])


def read_surface(path: str, unit: float) -> tuple[Floats, Ints]:
    """Points (n, 3) in m and triangles (t, 3): the boundary of a solid, or the facets of a file that has no solid.

    Facets of a surface file keep the sense in which the file turns them. Raises Unreadable.
    """
    data = _parsed(Path(path))
    there = {block.type for block in data.cells}
    if there & KINDS.keys() or not there & FACETS.keys():
        return surface(read(path, unit))
    found = [block.data[:, FACETS[block.type]].reshape(-1, 3) for block in data.cells if block.type in FACETS]
    triangles, points = np.concatenate(found).astype(np.int64), _points(data, unit)
    used, triangles = _used(points, triangles)
    return used, triangles


def read_points(path: str, unit: float) -> Floats:
    """The points (n, 3) in m that cells of a file use, in its order. Raises Unreadable."""
    data = _parsed(Path(path))
    cells = [block.data.ravel() for block in data.cells if block.type != "vertex"]
    points = _points(data, unit)
    chosen = np.unique(np.concatenate(cells)) if cells else np.arange(len(points))
    return points[chosen]


def converted(mesh: Mesh, kind: str, split: str) -> Mesh:
    """A mesh that was read as the kind that a model wants. Raises Unreadable where that cannot be."""
    if kind == mesh.kind:
        return mesh
    if mesh.kind == "hex8":
        try:
            linear = SPLITS[split](mesh)
        except NotTwoColourable:
            raise Unreadable(
                "its hexahedra cannot be split into five tetrahedra each: their points cannot be coloured like a "
                "chessboard; take `split = kuhn` or use hex8"
            ) from None
        return linear if kind == "tet4" else quadratic(linear)
    if (mesh.kind, kind) == ("tet4", "tet10"):
        return quadratic(mesh)
    if (mesh.kind, kind) == ("tet10", "tet4"):
        return Mesh(*_used(mesh.points, mesh.cells[:, :4]))
    raise Unreadable(f"it has {NAMES[mesh.kind]}, and the model wants {NAMES[kind]}")


def _points(data: Any, unit: float) -> Floats:
    points: Floats = unit * np.asarray(data.points, dtype=np.float64)[:, :3]
    if points.shape[1] < 3:  # a plane format
        points = np.pad(points, ((0, 0), (0, 3 - points.shape[1])))
    return points


def _parsed(path: Path) -> Any:
    """What meshio makes of the file in one of the formats of its name. Raises Unreadable."""
    if not path.is_file():
        raise Unreadable(f"there is no file {path}")
    if path.suffix.lower() == ".msh" and gmsh1.recognised(path):
        try:
            return gmsh1.read(path)
        except gmsh1.Malformed as error:
            raise Unreadable(f"it is no complete Gmsh file of format 1 ({error})") from error
    import meshio

    kinds = meshio.extension_to_filetypes.get(path.suffix.lower(), [None])  # None: let meshio say it
    return _tried(path, (k for k in kinds if k not in UNENDING))


def _tried(path: Path, kinds: Iterable[str | None]) -> Any:
    import meshio

    reasons = []
    for kind in kinds:
        said = StringIO()  # meshio prints why it fails, and exits
        try:
            with redirect_stdout(said), redirect_stderr(said):
                return meshio.read(path, kind)
        except SystemExit:
            reasons.append(
                " ".join(said.getvalue().partition("Error:")[0].split()) or f"it is no {kind} file"
            )
        except Exception as error:  # its readers raise what they like
            reasons.append(str(error) or type(error).__name__)
    raise Unreadable(f"meshio cannot read it ({'; '.join(reasons) or 'in this format it may never finish'})")


def _used(points: Floats, cells: Ints) -> tuple[Floats, Ints]:
    """The points that cells use, and the cells renumbered. Raises Unreadable."""
    if cells.min() < 0 or cells.max() >= len(points):
        raise Unreadable("a cell names a point that does not exist")
    used, renumbered = np.unique(cells, return_inverse=True)
    points, cells = np.ascontiguousarray(points[used]), renumbered.reshape(cells.shape)
    if not np.all(np.isfinite(points)):
        raise Unreadable("a coordinate is not a finite number")
    return points, cells


def _checked(points: Floats, cells: Ints, kind: str) -> Mesh:
    points, cells = _used(points, cells)
    if len(np.unique(np.sort(cells, axis=1), axis=0)) < len(cells):
        raise Unreadable("some of its cells are given twice")
    if (parts := _parts(len(points), cells)) > 1:
        raise Unreadable(f"it falls into {parts} parts that share no points")
    family = ELEMENTS[kind].family
    volumes = Mesh(points, cells, kind).volumes
    flat = np.abs(volumes) <= 1e-14 * np.ptp(points, axis=0).max() ** 3
    if np.any(flat):
        which = f"{int(flat.sum())} of its {len(cells)} {family} are flat"
        raise Unreadable(f"{which}, the first is cell {int(np.argmax(flat))}")
    turned = volumes < 0
    cells[turned] = cells[turned][:, _TURNED[kind]]
    return _unfolded(Mesh(points, cells, kind))


# Nodes of a cell that is inside out, in an order that is not: tetrahedra swap two corners, hexahedra their ends.
_TURNED = {
    "tet4": [0, 1, 3, 2],
    "tet10": [0, 1, 3, 2, 4, 8, 7, 6, 5, 9],
    "hex8": [4, 5, 6, 7, 0, 1, 2, 3],
}


def _unfolded(mesh: Mesh) -> Mesh:
    """The mesh, unless a cell folds over itself where it is integrated. Raises Unreadable."""
    folded: Any = (jacobians(mesh, mesh.element.quadrature()[0]) <= 0).any(axis=1)
    if folded.any():
        which = f"{int(folded.sum())} of its {len(folded)} {mesh.element.family} fold over themselves"
        raise Unreadable(f"{which}, the first is cell {int(np.argmax(folded))}")
    return mesh


def _parts(points: int, cells: Ints) -> int:
    """How many parts of a mesh are not connected by cells."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    edges = (np.repeat(cells[:, 0], cells.shape[1] - 1), cells[:, 1:].ravel())
    links = coo_matrix((np.ones(len(edges[0])), edges), shape=(points, points))
    return int(connected_components(links, directed=False)[0])
