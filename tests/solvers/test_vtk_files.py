"""Files of VTK by content: text arrays, surfaces, XML under the name .vtk and the reverse; groups of Gmsh 2.2."""

from __future__ import annotations

import contextlib
import struct
from pathlib import Path

import meshio
import numpy as np
import pytest

from softmark.interpreter.models.imported_results import readers
from softmark.solvers.mesh.files.mesh_reader import UnreadableMesh, read_cells, read_triangles

POINTS = np.array([[x, y, z] for z in (0.0, 1.0) for y in (0.0, 1.0) for x in (0.0, 1.0, 2.0)])
CELLS = np.array([[0, 1, 4, 3, 6, 7, 10, 9], [1, 2, 5, 4, 7, 8, 11, 10]])
MOVED = 0.25 * POINTS + 1.0
TEXTS = ("two words", "", "x" * 70, "y" * 20000)  # whose lengths take one, two and four bytes in a binary file


def legacy(binary: bool, version: str, dataset: str, lists: dict[str, list[list[int]]], types: list[int]) -> bytes:
    """A legacy file with arrays of text and of numbers, as VTK's own writer has them."""
    out = [
        f"# vtk DataFile Version {version}\nby hand\n{'BINARY' if binary else 'ASCII'}\nDATASET {dataset}\n".encode()
    ]

    def numbers(values: object, code: str) -> None:
        flat = np.asarray(values).ravel()
        out.append(
            flat.astype(code).tobytes() + b"\n" if binary else " ".join(map(str, flat.tolist())).encode() + b"\n"
        )

    def texts(name: str, own: tuple[str, ...]) -> None:
        out.append(f"FIELD FieldData 1\n{name} 1 {len(own)} string\n".encode())
        for text in own:
            n = len(text)
            head = struct.pack(">B", 0xC0 | n) if n < 64 else struct.pack(">H", 0x8000 | n)
            head = struct.pack(">I", 0x40000000 | n) if n >= 1 << 14 else head
            out.append(head + text.encode() if binary else text.replace(" ", "%20").encode() + b"\n")
        out.append(b"\n")

    texts("title", TEXTS)
    out.append(f"POINTS {len(POINTS)} double\n".encode())
    numbers(POINTS, ">f8")
    out.append(b"\nMETADATA\nINFORMATION 1\nNAME L2_NORM_RANGE LOCATION vtkDataArray\nDATA 2 0 3.46\n\n")
    for key, cells in lists.items():
        if version[0] == "5":
            ends = np.cumsum([0, *map(len, cells)])
            out.append(f"{key} {len(ends)} {ends[-1]}\nOFFSETS vtktypeint64\n".encode())
            numbers(ends, ">i8")
            out.append(b"CONNECTIVITY vtktypeint64\n")
            numbers([n for cell in cells for n in cell], ">i8")
        else:
            flat = [n for cell in cells for n in (len(cell), *cell)]
            out.append(f"{key} {len(cells)} {len(flat)}\n".encode())
            numbers(flat, ">i4")
    count = sum(map(len, lists.values()))
    if types:
        out.append(f"CELL_TYPES {len(types)}\n".encode())
        numbers(types, ">i4")
    out.append(f"CELL_DATA {count}\n".encode())
    texts("label", tuple(f"cell {i}" for i in range(count)))
    out.append(b"SCALARS part int\nLOOKUP_TABLE default\n")
    numbers(np.arange(count) % 2, ">i4")
    out.append(f"POINT_DATA {len(POINTS)}\nVECTORS displacement double\n".encode())
    numbers(MOVED, ">f8")
    texts("names", tuple(f"p{i}" for i in range(len(POINTS))))
    return b"".join(out)


XML = """<?xml version="1.0"?>
<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64"><UnstructuredGrid>
<FieldData><Array type="String" Name="title" NumberOfTuples="1" format="FIRST">TITLE</Array></FieldData>
<Piece NumberOfPoints="12" NumberOfCells="2">
<PointData><DataArray type="String" Name="names" format="ascii">112 0 113 0</DataArray>
<DataArray type="Float64" Name="displacement" NumberOfComponents="3" ARRAY_moved</DataArray></PointData>
<CellData><DataArray type="Int32" Name="part" ARRAY_part</DataArray></CellData>
<Points><DataArray type="Float64" Name="Points" NumberOfComponents="3" ARRAY_points
<InformationKey name="L2_NORM_RANGE" location="vtkDataArray" length="2"><Value index="0">0</Value></InformationKey>
</DataArray></Points>
<Cells><DataArray type="Int64" Name="connectivity" ARRAY_cells</DataArray>
<DataArray type="Int64" Name="offsets" ARRAY_ends</DataArray>
<DataArray type="UInt8" Name="types" ARRAY_types</DataArray></Cells></Piece></UnstructuredGrid>APPENDED</VTKFile>
"""
VALUES = {"moved": MOVED, "part": np.array([0, 1], dtype="i4"), "points": POINTS, "cells": CELLS,
          "ends": np.array([8, 16]), "types": np.array([12, 12], dtype="u1")}  # fmt: skip


def xml(raw: bool) -> bytes:
    """A VTU file with arrays of text: as ASCII, or raw and appended, the text first."""
    text, blob = XML, b""
    if raw:
        blob = struct.pack("<Q", 3) + b"hi\0"
        text = text.replace('format="FIRST">TITLE', 'format="appended" offset="0">')
    else:
        text = text.replace('format="FIRST">TITLE', 'format="ascii">104 105 0')
    for name, values in VALUES.items():
        if raw:
            text = text.replace(f"ARRAY_{name}", f'format="appended" offset="{len(blob)}">')
            data = values.tobytes()
            blob += struct.pack("<Q", len(data)) + data
        else:
            text = text.replace(f"ARRAY_{name}", f'format="ascii">{" ".join(map(str, values.ravel().tolist()))}')
    before, after = text.split("APPENDED")
    return (
        before.encode()
        + (b'<AppendedData encoding="raw">_' + blob + b"</AppendedData>" if raw else b"")
        + after.encode()
    )


FILES = {
    **{f"legacy {v} {'binary' if b else 'text'}": (b, v) for v in ("3.0", "4.2", "5.1") for b in (False, True)},
    "xml ascii": (False, ""),
    "xml raw": (True, ""),
}


@pytest.mark.parametrize("suffix", [".vtk", ".vtu"])
@pytest.mark.parametrize("form", FILES)
def test_text_arrays_and_names_of_the_other_format(form: str, suffix: str, tmp_path: Path) -> None:
    """The same two cells, groups and displacements come from each, as the numbers were written: exactly."""
    binary, version = FILES[form]
    data = legacy(binary, version, "UNSTRUCTURED_GRID", {"CELLS": CELLS.tolist()}, [12, 12]) if version else xml(binary)
    (file := tmp_path / f"mesh{suffix}").write_bytes(data)
    mesh = read_cells(str(file), 1.0, named=True)
    assert (mesh.points == POINTS).all()
    assert (mesh.cells == CELLS).all()
    assert mesh.groups is not None
    assert {name: own.members.tolist() for name, own in mesh.groups.items()} == {
        "part": [1], "part=0": [0], "part=1": [1],
    }  # fmt: skip
    told = readers.read(file)
    assert (told.fields["displacement"][0] == MOVED).all()
    assert told.cells is not None
    assert (told.cells == CELLS).all()


CORNERS = [0, 2, 3, 5, 6, 8, 9, 11]
SIDES = [[0, 3, 5, 2], [6, 8, 11, 9], [0, 2, 8, 6], [3, 9, 11, 5], [0, 6, 9, 3], [2, 5, 11, 8]]  # outward
SURFACES = {
    "quadrilaterals": {"POLYGONS": SIDES},
    "triangles": {"POLYGONS": [t for a, b, c, d in SIDES for t in ([a, b, c], [a, c, d])]},
    "polygons of six": {"POLYGONS": [[0, 3, 4, 5, 2, 1], [6, 7, 8, 11, 10, 9], [0, 1, 2, 8, 7, 6],
                                     [3, 9, 10, 11, 5, 4], *SIDES[4:]]},
    "strips": {"TRIANGLE_STRIPS": [[a, b, d, c] for a, b, c, d in SIDES]},
    "points and lines as well": {"VERTICES": [[0], [1]], "LINES": [[0, 1, 2]], "POLYGONS": SIDES},
}  # fmt: skip


@pytest.mark.parametrize("version", ["4.2", "5.1"])
@pytest.mark.parametrize("binary", [False, True], ids=["text", "binary"])
@pytest.mark.parametrize("lists", SURFACES.values(), ids=SURFACES.keys())
def test_surfaces_of_vtk(lists: dict[str, list[list[int]]], binary: bool, version: str, tmp_path: Path) -> None:
    """The box of 2 x 1 x 1: facets outward, so that their signed volume is 2 and their area 10, to rounding."""
    (file := tmp_path / "box.vtk").write_bytes(legacy(binary, version, "POLYDATA", lists, []))
    points, triangles = read_triangles(str(file), 1.0)
    a, b, c = (points[triangles[:, i]] for i in range(3))
    assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0 == pytest.approx(2.0, rel=1e-14)
    assert 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() == pytest.approx(10.0, rel=1e-14)


def test_a_polygon_that_is_not_convex_is_refused(tmp_path: Path) -> None:
    star = {"POLYGONS": [[0, 4, 2, 5, 3]]}  # its second corner looks inward
    (file := tmp_path / "star.vtk").write_bytes(legacy(False, "5.1", "POLYDATA", star, []))
    with pytest.raises(UnreadableMesh, match="a polygon is not convex"):
        read_triangles(str(file), 1.0)


@pytest.mark.parametrize("form", FILES)
def test_broken_files_of_vtk_are_refused(form: str, tmp_path: Path) -> None:
    """A file cut anywhere, or with a byte changed, is read or refused, and nothing else is raised."""
    binary, version = FILES[form]
    data = legacy(binary, version, "UNSTRUCTURED_GRID", {"CELLS": CELLS.tolist()}, [12, 12]) if version else xml(binary)
    rng = np.random.default_rng(5)
    cuts = [data[:n] for n in rng.integers(1, len(data), 40)]
    for n in rng.integers(0, len(data), 40):
        cuts.append(data[:n] + bytes([int(rng.integers(0, 256))]) + data[n + 1 :])
    for i, broken in enumerate(cuts):
        (file := tmp_path / f"mesh{i}.vtk").write_bytes(broken)
        with contextlib.suppress(UnreadableMesh):
            read_cells(str(file), 1.0, named=True)


def gmsh22(tmp_path: Path, *elements: str) -> Path:
    """A mesh of two tetrahedra."""
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$PhysicalNames", "2", '3 2 "all"', '3 3 "tip"',
             "$EndPhysicalNames", "$Nodes", "5", "1 0 0 0", "2 1 0 0", "3 0 1 0", "4 0 0 1", "5 1 1 1", "$EndNodes",
             "$Elements", str(len(elements)), *(f"{i} {e}" for i, e in enumerate(elements, 1)),
             "$EndElements"]  # fmt: skip
    (file := tmp_path / "two.msh").write_text("\n".join([*lines, ""]))
    return file


def test_a_cell_of_gmsh_in_several_groups_is_one_cell(tmp_path: Path) -> None:
    file = gmsh22(tmp_path, "4 2 2 1 1 2 3 4", "4 2 2 2 2 5 3 4", "4 2 3 2 2 5 3 4", "4 2 7 2 2 5 3 4",
                  "2 2 4 1 1 3 2", "2 2 5 1 1 3 2")  # fmt: skip
    mesh = read_cells(str(file), 1.0, named=True)
    assert mesh.cells.tolist() == [[0, 1, 2, 3], [1, 4, 2, 3]]
    assert mesh.groups is not None
    assert {name: own.members.tolist() for name, own in mesh.groups.items()} == {
        "all": [0, 1], "tip": [1], "7": [1], "4": [[0, 0]], "5": [[0, 0]],
    }  # fmt: skip
    assert read_cells(str(file), 1.0).cells.tolist() == mesh.cells.tolist()


def test_a_cell_of_gmsh_twice_in_one_group_is_refused(tmp_path: Path) -> None:
    file = gmsh22(tmp_path, "4 2 2 1 1 2 3 4", "4 2 2 2 2 5 3 4", "4 2 2 2 2 5 3 4")
    with pytest.raises(UnreadableMesh, match="occur twice"):
        read_cells(str(file), 1.0)


def test_what_meshio_writes_is_read_as_before(tmp_path: Path) -> None:
    """Files of meshio, without text, in all its forms: the same points and cells."""
    mesh = meshio.Mesh(POINTS, [("hexahedron", CELLS)], point_data={"u": MOVED})
    for name, options in (("a.vtk", {"binary": False}), ("b.vtk", {}), ("c.vtu", {}), ("d.vtu", {"binary": False}),
                          ("e.vtu", {"compression": None}), ("f.vtu", {"compression": "lzma"})):  # fmt: skip
        mesh.write(tmp_path / name, **options)
        found = read_cells(str(tmp_path / name), 1.0)
        assert (found.points == POINTS).all()
        assert (found.cells == CELLS).all()
