"""Mesh file reader based on meshio; Abaqus and CalculiX decks and Gmsh's first format have readers of their own.

meshio fails on valid Gmsh files with elements in no group; these files are repaired before reading.
"""

from __future__ import annotations

import logging
import tempfile
from collections.abc import Iterable
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import replace
from io import BytesIO, StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.mesh_file_hazards import find_hazard
from softmark.resource_limits import describe_read_error, limited_resources
from softmark.safe_files import UnsafeFile, open_regular, path_within, read_regular
from softmark.solvers.elements import ELEMENTS, element_of
from softmark.solvers.elements.element import Element
from softmark.solvers.elements.reference_cells import Hexahedron
from softmark.solvers.mesh.cell_splitting import SPLITS, NotTwoColourable, add_midside_nodes
from softmark.solvers.mesh.files import bounded_reader, gmsh1, gmsh4
from softmark.solvers.mesh.files.mesh_formats import MESHES, advise_filling
from softmark.solvers.mesh.files.mesh_validation import UnreadableMesh, drop_unused_points, validate
from softmark.solvers.mesh.files.vtk import legacy_vtk, vtu_conversion
from softmark.solvers.mesh.mesh import Floats, Ints, Mesh, boundary_surface

if TYPE_CHECKING:
    from softmark.solvers.mesh.mesh_group import Group

VTK = frozenset({".vtk", ".vtu"})  # either may hold a legacy or an XML file
UNENDING = frozenset({"ansys", "tecplot"})  # meshio's readers of these never return from a truncated file

KINDS = {element.meshio: name for name, element in ELEMENTS.items()}  # meshio's cell name -> our element name
OTHERS = frozenset({"wedge", "pyramid", "wedge15", "wedge18", "pyramid13", "pyramid14"})
AGAIN = "export the file again as .vtu, .vtk, .msh, .inp or .mesh: it may be incomplete, or have the wrong extension"
NO_SURFACE = "E573"
BY_TRIMESH = frozenset({".stl", ".obj", ".ply", ".off"})
SURFACE_AGAIN = "write the surface again as .stl, .obj or .ply: the file may be incomplete, or have the wrong extension"
FACETS = {"triangle": ((0, 1, 2),), "quad": ((0, 1, 2), (0, 2, 3))}
NODES = {element.meshio: element.nodes for element in ELEMENTS.values()} | {
    "line": 2, "line3": 3, "triangle": 3, "triangle6": 6, "quad": 4, "quad8": 8, "quad9": 9,
}  # number of nodes of a cell, by meshio's name  # fmt: skip


__all__ = ["UnreadableMesh", "convert_cells", "read_cells", "read_points", "read_surface", "read_triangles"]


def read_cells(path: str, unit: float, coincident: str = "refuse", named: bool = False, pieces: str = "refuse") -> Mesh:
    """Return the solid cells of a mesh file, all of one type, in m with positive volumes. Raises UnreadableMesh.

    `unit` is the file's unit of length in m. `coincident` is `refuse`, `merge` or `keep`, for nodes at the same
    position; `pieces` is `refuse` or `keep`, for pieces that share no nodes. The named groups are read if `named`.
    """
    data = parse(Path(path))
    before = keep_node_order(data, Path(path), unit)
    mesh = validate(before.points, before.cells, before.kind, coincident, pieces)
    return replace(mesh, groups=_read_named_groups(data, Path(path), before, mesh)) if named else mesh


def keep_node_order(data: Any, path: Path, unit: float) -> Mesh:
    """Return the solid cells of a parsed file as a mesh, with nodes in the file's order. Raises UnreadableMesh."""
    there = {block.type for block in data.cells}
    solids = sorted(there & KINDS.keys())
    if not solids:
        kinds = ", ".join(sorted(there)) or "none"
        raise UnreadableMesh(
            f"it has no tetrahedra and no hexahedra (its cells: {kinds})",
            remedy=advise_filling(path) if there & FACETS.keys() else None,
        )
    others = (there & OTHERS) | set(solids[1:])
    if others:
        raise UnreadableMesh(
            f"it has other solid cells in addition to its {solids[0]} cells ({', '.join(sorted(others))})"
        )
    cells = [block.data for block in data.cells if block.type == solids[0]]
    points, kind = points_in_metres(data, unit), KINDS[solids[0]]
    whole = np.concatenate(cells).astype(np.int64, order="C")  # kernels are compiled for one memory order
    return Mesh(points, whole, kind)


def _read_named_groups(data: Any, path: Path, before: Mesh, mesh: Mesh) -> dict[str, Group]:
    """Return the named groups of a file for the checked `mesh`; `before` is the mesh with the file's node order."""
    from softmark.solvers.mesh import mesh_groups
    from softmark.solvers.mesh.files import named_groups

    found, over = (
        named_groups.read_groups(data, path, mesh.element.meshio, before.cells, mesh.element),
        before.volumes < 0.0,
    )
    for name, own in found.items():
        if own.kind == "faces":
            known = replace(own, members=mesh_groups.reorder_faces(own.members, over, mesh.element))
            there = int(mesh_groups.facets_in(replace(mesh, groups={name: known}), name).sum())
            found[name] = replace(known, inside=len(known.members) - there)
        elif own.kind == "nodes":
            found[name] = replace(own, members=mesh_groups.reorder_nodes(own.members, over, mesh.element))
    return found


def read_surface(path: str, unit: float, coincident: str = "refuse", pieces: str = "refuse") -> tuple[Floats, Ints]:
    """Return points (n, 3), m, and triangles (t, 3): the boundary of a solid mesh, or the facets of a surface file.

    Facets of a surface file keep their orientation. Raises UnreadableMesh.
    """
    data = parse(Path(path))
    there = {block.type for block in data.cells}
    if there & KINDS.keys() or not there & FACETS.keys():
        return boundary_surface(read_cells(path, unit, coincident, pieces=pieces))
    return drop_unused_points(*_triangles_of_parsed_file(data, unit))[:2]


def read_triangles(path: str, unit: float) -> tuple[Floats, Ints]:
    """Return points (n, 3), m, and triangles (t, 3) of a file that contains only a surface. Raises UnreadableMesh."""
    if (suffix := Path(path).suffix.lower()) in BY_TRIMESH:
        return _read_surface_by_trimesh(Path(path), unit)
    _require_file(Path(path), SURFACE_AGAIN)
    if suffix not in MESHES:
        ending = suffix or Path(path).name
        known = "write the surface as .stl, .obj, .ply, .off or .vtk, and name that file"
        raise UnreadableMesh(f"`{ending}` is not a known extension of surface files", remedy=known)
    try:
        data = parse(Path(path))
    except UnreadableMesh as error:
        raise UnreadableMesh(str(error), error.code, SURFACE_AGAIN) from error
    there = {block.type for block in data.cells}
    if there & (KINDS.keys() | OTHERS):
        raise UnreadableMesh(
            "it contains cells, not only a surface", NO_SURFACE, f'use it as a mesh: `mesh("{Path(path).name}", ...)`'
        )
    if not there & FACETS.keys():
        raise UnreadableMesh("it has no triangles", NO_SURFACE, "name a surface file: STL, OBJ, PLY, OFF or VTK")
    return _triangles_of_parsed_file(data, unit)


def _read_surface_by_trimesh(path: Path, unit: float) -> tuple[Floats, Ints]:
    """Return points (n, 3), m, and triangles (t, 3) of a format that trimesh reads better. Raises UnreadableMesh."""
    _require_file(path, SURFACE_AGAIN)
    import trimesh

    log = logging.getLogger("trimesh")
    level = log.level
    log.setLevel(logging.CRITICAL)  # also of its children: missing textures and wrong normals do not matter here
    try:
        with limited_resources(path):  # without name and path, so that other files it names stay unread
            data = BytesIO(read_regular(path))
            found: Any = trimesh.load(data, file_type=path.suffix.lower()[1:], process=False, force="mesh",
                                 skip_materials=True)  # fmt: skip
    except Exception as error:  # its readers raise any exception
        raise UnreadableMesh(f"trimesh cannot read it ({describe_read_error(error)})", remedy=SURFACE_AGAIN) from error
    finally:
        log.setLevel(level)
    triangles = np.asarray(getattr(found, "faces", ()), dtype=np.int64)
    if triangles.ndim != 2 or not len(triangles):
        raise UnreadableMesh("it has no triangles", NO_SURFACE, SURFACE_AGAIN)
    with np.errstate(over="ignore", invalid="ignore"):
        return unit * np.asarray(found.vertices, dtype=np.float64), triangles


def _triangles_of_parsed_file(data: Any, unit: float) -> tuple[Floats, Ints]:
    """Return points (n, 3), m, and triangles (t, 3) of a parsed file; quadrilaterals are split into two triangles."""
    found = [block.data[:, FACETS[block.type]].reshape(-1, 3) for block in data.cells if block.type in FACETS]
    return points_in_metres(data, unit), np.concatenate(found).astype(np.int64)


def read_points(path: str, unit: float) -> Floats:
    """Return the points (n, 3), m, that the cells of a file use, in the order of the file. Raises UnreadableMesh."""
    data = parse(Path(path))
    cells = [block.data.ravel() for block in data.cells if block.type != "vertex"]
    points = points_in_metres(data, unit)
    named = np.concatenate(cells) if cells else np.arange(len(points))
    return drop_unused_points(points, named[:, None].astype(np.int64))[0]


def convert_cells(mesh: Mesh, kind: str, split: str) -> Mesh:
    """Return a mesh from a file with its cells converted to the element `kind`.

    `split` names the method of splitting hexahedra into tetrahedra, a key of SPLITS. Raises UnreadableMesh and
    UnknownElement.
    """
    own, element = mesh.element, element_of(kind)
    if own is element:
        return mesh
    if own.family != element.family:
        mesh = _split_hexahedra(mesh, element, split)
    elif own.nodes > element.nodes:  # common nodes come first in both
        return Mesh(*drop_unused_points(mesh.points, mesh.cells[:, : element.nodes])[:2], kind, groups=mesh.groups)
    return add_midside_nodes(mesh, element)


def _split_hexahedra(mesh: Mesh, element: type[Element], split: str) -> Mesh:
    """Return a mesh of tetrahedra made by splitting hexahedra by the method `split`. Raises UnreadableMesh."""
    if mesh.kind != Hexahedron.linear:
        raise UnreadableMesh(f"it has {mesh.element.described}, but the model needs {element.described}")
    try:
        return _copy_groups(mesh, SPLITS[split](mesh))
    except NotTwoColourable:
        raise UnreadableMesh(
            "its hexahedra cannot be split into five tetrahedra each, since their points cannot be "
            "coloured like a chessboard; write `split = kuhn`, or use hex8"
        ) from None


def _copy_groups(mesh: Mesh, new: Mesh) -> Mesh:
    """Return the mesh `new` with the groups of the mesh from which it was made."""
    if not mesh.groups:
        return new
    from softmark.solvers.mesh.mesh_groups import transfer_groups_to_split

    return transfer_groups_to_split(mesh, new)


def points_in_metres(data: Any, unit: float) -> Floats:
    """Return the points (n, 3) of a file, m. Raises UnreadableMesh."""
    read = np.asarray(data.points, dtype=np.float64)
    if read.ndim != 2 or not len(read):
        raise UnreadableMesh("it has no points", remedy=AGAIN)
    with np.errstate(over="ignore", invalid="ignore"):  # non-finite values are refused later, with their location
        points: Floats = unit * read[:, :3]
    if points.shape[1] < 3:  # formats of plane meshes have two coordinates
        points = np.pad(points, ((0, 0), (0, 3 - points.shape[1])))
    return points


def parse(path: Path) -> Any:
    """Read a mesh file into meshio's data layout. Raises UnreadableMesh.

    Every cell is checked to have the number of nodes of its type.
    """
    data = _parse_by_format(path)
    for block in data.cells:
        if not isinstance(block.data, np.ndarray):  # polyhedra, which are not supported
            continue
        shape, many = block.data.shape, NODES.get(block.type)
        if many is not None and (len(shape) != 2 or shape[1] != many):
            raise UnreadableMesh(f"its {block.type} cells have {shape[-1]} nodes each, not {many}")
        try:
            block.data.astype(np.int64)
        except (OverflowError, TypeError, ValueError):  # Python integers from text readers
            raise UnreadableMesh(f"its {block.type} cells refer to point numbers that cannot exist") from None
    return data


def _parse_by_format(path: Path) -> Any:
    """Read a mesh file by the reader of its format, without checks."""
    _require_file(path)
    if path.suffix.lower() == ".msh" and gmsh1.is_format_1(path):
        try:
            with limited_resources(path):
                return gmsh1.read(path)
        except (gmsh1.MalformedMeshFile, MemoryError) as error:
            why = describe_read_error(error)
            raise UnreadableMesh(f"it is not a complete Gmsh file of format 1 ({why})", remedy=AGAIN) from error
    try:
        with limited_resources(path):
            elsewhere = find_hazard(path)
    except Exception as error:  # the HDF5 readers raise any exception
        raise UnreadableMesh(f"it cannot be read ({describe_read_error(error)})", remedy=AGAIN) from error
    if elsewhere:
        raise UnreadableMesh(elsewhere, remedy=AGAIN)
    if path.suffix.lower() in VTK and (found := _read_vtk(path)) is not None:
        return found
    if path.suffix.lower() == ".inp":
        return _read_deck(path)
    import meshio

    kinds = meshio.extension_to_filetypes.get(path.suffix.lower(), [None])  # None: meshio reports it
    return _try_formats(path, (k for k in kinds if k not in UNENDING))


def _read_deck(path: Path) -> Any:
    """Read an Abaqus or CalculiX deck with its sets. Raises UnreadableMesh."""
    from softmark.solvers.mesh.files.abaqus.deck_groups import DeckData
    from softmark.solvers.mesh.files.abaqus.deck_mesh import read_mesh

    try:
        with limited_resources(path):
            return DeckData(read_mesh(path))
    except (MemoryError, OSError, ValueError, LookupError, ArithmeticError, RecursionError) as error:
        raise UnreadableMesh(f"it cannot be read ({describe_read_error(error)})", remedy=AGAIN) from error


def _read_vtk(path: Path) -> Any:
    """Read a VTK file, recognised by its content; None if meshio should read it. Raises UnreadableMesh."""
    with open_regular(path) as file:
        head = file.read(4096)
    try:
        with limited_resources(path):
            if legacy_vtk.is_legacy_vtk(head):
                return legacy_vtk.read(path)
            if vtu_conversion.is_vtu(head):
                data = vtu_conversion.inline_arrays(read_regular(path))
            else:
                return None
    except (gmsh1.MalformedMeshFile, ValueError, MemoryError) as error:
        raise UnreadableMesh(f"it is not a complete VTK file ({describe_read_error(error)})", remedy=AGAIN) from error
    with tempfile.TemporaryDirectory(prefix="softmark-") as folder:
        (copy := Path(folder, "mesh.vtu")).write_bytes(data)
        return _try_formats(copy, ["vtu"], path.stat().st_size)


def _read_gmsh(path: Path, kind: str) -> Any:
    """Read a Gmsh file, including elements in no physical group."""
    import meshio

    from softmark.solvers.mesh.files import named_groups

    if (data := gmsh4.repair(path)) is None:
        return named_groups.merge_repeated_cells(meshio.read(path, kind))
    with tempfile.TemporaryDirectory(prefix="softmark-") as folder:
        (file := Path(folder, path.name)).write_bytes(data)
        return meshio.read(file, kind)


def _read_tetgen(path: Path, kind: str) -> Any:
    """Read a TetGen mesh from its two files, which must lie in the same folder."""
    import meshio

    other = path.with_suffix(".node" if path.suffix.lower() == ".ele" else ".ele").name
    try:
        path_within(path.parent, other)
    except UnsafeFile as error:
        raise UnsafeFile(f"the file {other} that belongs to it cannot be read: {error.strerror}") from None
    return meshio.read(path, kind)


def _read_dolfin_xml(path: Path, kind: str) -> Any:
    """Read a mesh in DOLFIN's XML without cell data, for which meshio would open other files."""
    import meshio
    from meshio.dolfin._dolfin import _read_mesh

    points, cells, _ = _read_mesh(path)
    return meshio.Mesh(points, cells)


OWN = {  # formats that meshio cannot read directly
    "gmsh": _read_gmsh, "tetgen": _read_tetgen, "dolfin-xml": _read_dolfin_xml,
}  # fmt: skip


def _require_file(path: Path, remedy: str = AGAIN) -> None:
    """Raise UnreadableMesh if the file is missing or empty."""
    try:
        with open_regular(path) as file:
            if not file.read(1):
                raise UnreadableMesh("it is empty", remedy=remedy)
    except FileNotFoundError:
        known = "the path is relative to the folder of the scene"
        raise UnreadableMesh(f"there is no file {path}", remedy=known) from None
    except OSError as error:
        raise UnreadableMesh(f"it cannot be read ({error.strerror})") from error


def _try_formats(path: Path, kinds: Iterable[str | None], size: int | None = None) -> Any:
    """Return the mesh in meshio's layout, read by the first of meshio's formats `kinds` that can read the file.

    If `path` is a copy, `size` is the size of the original file, by which memory is limited.
    """
    import meshio

    bounded_reader.patch_open("meshio")
    reasons = []
    for kind in kinds:
        said = StringIO()  # meshio prints why it fails, and exits
        try:
            with limited_resources(path, size), redirect_stdout(said), redirect_stderr(said):
                return OWN.get(kind or "", meshio.read)(path, kind)
        except SystemExit:
            reasons.append(" ".join(said.getvalue().partition("Error:")[0].split()) or f"it is not a {kind} file")
        except Exception as error:  # its readers raise any exception
            reasons.append(describe_read_error(error))
    why = "; ".join(dict.fromkeys(reasons)) or "reading this format may not terminate"
    raise UnreadableMesh(f"meshio cannot read it ({why})", remedy=AGAIN)
