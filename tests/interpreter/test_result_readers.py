"""Files of results are read as they are: points, cells in our order, vectors at their times; or refused in words."""

from __future__ import annotations

import os
import re
import shutil
import struct
import subprocess
import zlib
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
import results as made

from softmark.interpreter.models.imported_results.readers import INSTEAD, READERS, read
from softmark.interpreter.models.imported_results.result_file import ResultFile
from softmark.references.measured_data import Unreadable
from softmark.solvers.elements import ELEMENTS
from softmark.solvers.mesh.mesh import Mesh
from softmark.solvers.mesh.structured_meshes import mesh_extrusion, mesh_rectangle


def box(size: float, kind: str) -> Mesh:
    """1 x 2 x 3."""
    return mesh_extrusion(mesh_rectangle(1.0, 2.0, size), 3.0, size, kind)


def told(folder: Path, **files: bytes) -> ResultFile:
    """Of the first of these files; `name__suffix` is name.suffix."""
    paths = [folder / name.replace("__", ".") for name in files]
    for path, data in zip(paths, files.values(), strict=True):
        path.write_bytes(data)
    return read(paths[0])


def refused(folder: Path, **files: bytes) -> str:
    """What is said of the first of these files: its name, the reason and the remedy."""
    with pytest.raises(Unreadable) as error:
        told(folder, **files)
    assert error.value.remedy
    return str(error.value)


@pytest.mark.parametrize("files", made.whole(), ids=lambda files: next(iter(files)))
def test_every_format_tells_its_vectors_at_their_times(files: made.Files, tmp_path: Path) -> None:
    """Five points, two tetrahedra, u = n / 8: exact in every format, .frd with its six digits included."""
    for name, data in files.items():
        (tmp_path / name).write_bytes(data)
    found = read(tmp_path / next(iter(files)))
    np.testing.assert_array_equal(found.points, made.X)
    (u,) = found.fields.values()
    scale = {"series.pvd": [1, 2], "series.xdmf": [0, 1], "ccx.frd": [0.5, 1], "points.csv": [0, 0.5]}
    scale |= {"plain.xplt": [0.5, 1], "packed.xplt": [0.5, 1]}
    shares = np.array(scale.get(next(iter(files)), [1]))
    np.testing.assert_array_equal(u, shares[:, None, None] * made.U)
    if found.kind is not None:
        assert found.kind == "tet4"
        np.testing.assert_array_equal(found.cells, made.CELLS)
    assert found.moved is None


def test_times_ids_and_what_is_left_are_told(tmp_path: Path) -> None:
    assert told(tmp_path, a__frd=made.frd()).times == pytest.approx([0.5, 1.0], abs=0)
    np.testing.assert_array_equal(told(tmp_path, a__frd=made.frd()).ids, [10, 20, 30, 40, 50])
    assert told(tmp_path, a__vtu=made.raw()).times == pytest.approx([2.5], abs=0)
    assert told(tmp_path, a__vtu=made.vtu()).left == ("2 triangles", "scalars `p`")
    assert told(tmp_path, a__vtu=made.vtu()).times is None
    assert told(tmp_path, a__xplt=made.xplt()).times == pytest.approx([0.5, 1.0], abs=0)
    assert told(tmp_path, a__xplt=made.xplt(failed=True)).left == ("the state at 1, which did not converge",)
    assert told(tmp_path, a__csv=made.csv()).left == ("column `name`",)


@pytest.mark.parametrize("element", list(ELEMENTS.values()), ids=lambda e: e.name)
def test_cells_are_in_our_order(element: Any, tmp_path: Path) -> None:
    """A box that our own mesher has made comes back with its volume."""
    mesh = box(1.5, element.name)
    for name in ("x.vtu", "x.vtk"):
        meshio.Mesh(mesh.points, [(element.meshio, mesh.cells)]).write(tmp_path / name)
        found = read(tmp_path / name)
        assert found.kind == element.name
        assert Mesh(found.points, found.cells, found.kind).volumes.sum() == pytest.approx(6.0)


def test_the_kind_with_most_cells_is_taken_and_the_others_are_said(tmp_path: Path) -> None:
    hexes, tets = np.arange(8)[None], np.array([[0, 1, 2, 4], [1, 2, 3, 5]])
    mesh = meshio.Mesh(np.random.default_rng(1).random((8, 3)), [("hexahedron", hexes), ("tetra", tets)])
    mesh.write(tmp_path / "x.vtu")
    found = read(tmp_path / "x.vtu")
    assert (found.kind, found.left) == ("tet4", ("1 cell `hex8`",))
    np.testing.assert_array_equal(found.cells, tets)


def test_points_that_move_from_file_to_file_are_positions(tmp_path: Path) -> None:
    files = {}
    for i, share in enumerate((0.0, 1.0)):
        mesh = meshio.Mesh(made.X + share * made.U, [("tetra", made.CELLS)])
        mesh.write(tmp_path / "x.vtu")
        files[f"m{i}__vtu"] = (tmp_path / "x.vtu").read_bytes()
    found = told(tmp_path, s__pvd=made.pvd("m1.vtu", "m0.vtu").replace(b'"0.5"', b'"-1"'), **files)
    assert found.moved is not None
    np.testing.assert_array_equal(found.points, made.X)  # of the first time, not of the first line
    np.testing.assert_array_equal(found.moved, [made.X, made.X + made.U])
    assert found.times == pytest.approx([-1, 0], abs=0)


@pytest.mark.parametrize(("header", "moved"), [
    ("X,Y,Z,ux,uy,uz", False), ("x,y,z,u_x,u_y,u_z", False), ("x0,y0,z0,U1,U2,U3", False), ("X,Y,Z,u,v,w", False),
    ("Points:0,Points:1,Points:2,u:0,u:1,u:2", False), ("x0,y0,z0,x1,y1,z1", True), ("X;Y;Z;x;y;z", True),
])  # fmt: skip
def test_columns_are_found_by_their_names(header: str, moved: bool, tmp_path: Path) -> None:
    comma = ";" if ";" in header else ","
    found = told(tmp_path, a__csv=f"{header}\n{comma.join('102030')}\n{comma.join('456789')}\n".encode())
    np.testing.assert_array_equal(found.points, [[1, 0, 2], [4, 5, 6]])
    vectors = found.moved if moved else next(iter(found.fields.values()))
    np.testing.assert_array_equal(vectors, [[[0, 3, 0], [7, 8, 9]]])
    assert not found.left


FLAWS = {  # the file, and what must be said of it
    "no_such.vtu": (None, "there is no file"),
    "empty.vtu": (b"", "it is empty"),
    "other.xplt": (b"BEEF", "does not begin like"),
    "cut.xplt": (made.xplt()[:-5], "announces"),
    "packed.xplt": (made.xplt(packed=True)[:-5], "last state is incomplete"),
    "old.xplt": (made.xplt().replace(b"\x34\0\0\0", b"\x08\0\0\0", 1), "has version 0x8"),
    "range.xplt": (made.xplt().replace(struct.pack("<2i", 3, 4), struct.pack("<2i", 3, 5)), "refers to point 5"),
    "book.odb": (b"x", "results can be read from .vtu"),
    "cut.vtu": (made.raw()[:1200], "cannot be decoded"),
    "cut_text.vtu": (made.vtu(binary=False)[:900], "not complete XML"),
    "short.vtu": (re.sub(rb"\n1\.75\S*", b"", made.vtu(binary=False), count=1), "14 numbers, but 5 points"),
    "nan.vtu": (made.vtu(u=np.where(made.U == 1, np.nan, made.U)), "`u` is nan at point 2, counted from 0"),
    "large.vtu": (made.vtu(u=np.where(made.U == 1, 1e300, made.U)), "`u` is 1e+300 at point 2"),
    "range.vtu": (made.raw().replace(made.CELLS.tobytes(), (made.CELLS + 1).tobytes()), "refers to point 5, but"),
    "entities.vtu": (b'<!DOCTYPE a [<!ENTITY b "c">]><VTKFile/>', "document type or entities"),
    "deep.vtu": (b"<VTKFile>" + b"<a>" * 99999, "nested more than"),
    "poly.vtu": (b'<VTKFile type="PolyData"/>', "not an unstructured grid"),
    "lz4.vtu": (made.raw(packed=True).replace(b"ZLib", b"LZ4"), "vtkLZ4DataCompressor"),
    "cut.vtk": (made.vtk(binary=False)[:300], "it is not a complete VTK file"),
    "cut.frd": (made.frd()[:-6], "no last line 9999"),
    "nan.frd": (made.frd().replace(b" 1.75000E+00", b"         NAN"), "`DISP` is nan at point 4"),
    "binary.frd": (made.frd().replace(b"1\n -1", b"2\n -1", 1), "is binary"),
    "modes.frd": (made.frd().replace(b" 0    1           1", b" 2    1           1"), "modes"),
    "without.frd": (made.frd(()), "no vectors at nodes"),
    "count.frd": (made.frd().replace(b"5  ", b"6  ", 1), "announces 6 nodes, but there are 5"),
    "twice.frd": (made.frd((1.0, 1.0)), "appears twice at time 1"),
    "node.frd": (made.frd().replace(b"-2        10", b"-2        11", 1), "refers to node 11, which does not exist"),
    "unit.csv": (b"X,Y,Z,ux [mm],uy [mm],uz [mm]\n0,0,0,1,1,1\n", "`ux [mm]` contains a unit; name it `ux`"),
    "places.csv": (b"a,b,ux,uy,uz\n0,0,1,1,1\n", "do not contain positions"),
    "word.csv": (b"X,Y,Z,ux,uy,uz\n0,0,0,1,1,1\n0,0,0,nan,1,1\n", "line 3, column `ux`: `nan` is not a number"),
    "order.csv": (b"t,X,Y,Z,ux,uy,uz\n0,0,0,0,1,1,1\n1,0,0,1,1,1,1\n", "differ between times"),
    "count.csv": (b"t,X,Y,Z,ux,uy,uz\n0,0,0,0,1,1,1\n0,0,0,1,1,1,1\n1,0,0,0,1,1,1\n", "time 1 after it has 1"),
    "outside.pvd": (made.pvd("../x.vtu"), "`../x.vtu`: that lies outside the folder"),
    "absolute.pvd": (made.pvd("/etc/passwd"), "`/etc/passwd`: that lies outside the folder"),
    "missing.pvd": (made.pvd("no.vtu"), "it refers to `no.vtu`: there is no such file"),
    "parts.pvtu": (made.pvtu("a.vtu", "b.vtu"), "its mesh consists of 2 parts"),
    "outside.pvtu": (made.pvtu("../x.vtu"), "`../x.vtu`: that lies outside the folder"),
    "itself.pvd": (made.pvd("itself.pvd"), "a series must consist of .vtu files"),
    "none.pvd": (made.pvd(), "it has no results"),
    "outside.xdmf": (made.xdmf().replace(b'"XML">', b'"HDF">../x.h5:/u ', 1), "lies outside"),
    "binary.xdmf": (made.xdmf().replace(b'"XML"', b'"Binary"', 1), "have the format `Binary`"),
    "size.xdmf": (made.xdmf().replace(b'"5 3"', b'"5 4"', 1), "has 15 numbers, but 20 are announced"),
    "base.xdmf": (made.xdmf().replace(b"TopologyType", b'BaseOffset="1" TopologyType'), "from another number than 0"),
}  # fmt: skip


@pytest.mark.parametrize("name", FLAWS)
def test_what_is_wrong_with_a_file_is_said(name: str, tmp_path: Path) -> None:
    data, said = FLAWS[name]
    if data is not None:
        (tmp_path / name).write_bytes(data)
    with pytest.raises(Unreadable, match=re.escape(said)) as error:
        read(tmp_path / name)
    assert error.value.name == name
    assert error.value.remedy


def test_a_link_out_of_the_folder_is_a_trespass(tmp_path: Path) -> None:
    (tmp_path / "x.vtu").write_bytes(made.vtu())
    home = tmp_path / "home"
    home.mkdir()
    (home / "in.vtu").symlink_to(tmp_path / "x.vtu")
    assert "lies outside" in refused(home, a__pvd=made.pvd("in.vtu"))


def test_files_of_a_series_are_of_one_mesh(tmp_path: Path) -> None:
    other = made.raw().replace(made.CELLS.tobytes(), made.CELLS[::-1].tobytes())
    assert "the cells at time 1" in refused(
        tmp_path, a__pvd=made.pvd("a.vtu", "b.vtu"), a__vtu=made.raw(), b__vtu=other
    )
    again = made.pvd("a.vtu", "b.vtu").replace(b'"0.5"', b'"0.0"')
    assert "two of its entries have the time 0" in refused(tmp_path, a__pvd=again, a__vtu=made.raw(), b__vtu=made.raw())
    assert "one file for several" in refused(tmp_path, a__pvd=made.pvd("a.vtu", "a.vtu"), a__vtu=made.raw())


def test_a_small_file_cannot_take_the_machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Counts of points that no file has; blocks that promise little and hold much."""
    much = made.vtu(binary=False).replace(b'NumberOfPoints="5"', b'NumberOfPoints="9999999999"')
    assert "9999999999 points" in refused(tmp_path, a__vtu=much)
    many = made.vtk().replace(b"POINTS 5", b"POINTS 999999999999")
    assert "but the file ends earlier" in refused(tmp_path, a__vtk=many)
    packed = zlib.compress
    monkeypatch.setattr(made.zlib, "compress", lambda data: packed(data + bytes(1_000_000)))
    assert "bytes are announced, but there are" in refused(tmp_path, b__vtu=made.raw(packed=True))


def test_numbers_in_hdf5_need_its_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "h5py", None)
    data = re.sub(rb'"XML">[^<]*', b'"HDF">a.h5:/u', made.xdmf())
    assert '`pip install "softmark[xdmf]"`' in refused(tmp_path, a__xdmf=data, a__h5=b"x")


@pytest.mark.slow
def test_numbers_in_hdf5_are_read_and_links_in_it_are_not_followed(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["u"] = made.U
        file["soft"], file["hard"] = h5py.SoftLink("/u"), h5py.ExternalLink("b.h5", "/u")
        file.create_dataset("raw", shape=(5, 3), dtype="f8", external=[("/etc/passwd", 0, 120)])
    for word, said in {
        "u": "",
        "soft": "another place",
        "hard": "another place",
        "raw": "of its own",
        "no": "not in",
    }.items():
        data = re.sub(
            rb'(Center="Node">\s*<DataItem[^>]*)"XML">[^<]*', rb'\1"HDF">a.h5:/' + word.encode(), made.xdmf(1)
        )
        if said:
            assert said in refused(tmp_path, a__xdmf=data)
        else:
            np.testing.assert_array_equal(told(tmp_path, a__xdmf=data).fields["u"], [made.U])


def deck(mesh: Mesh, kind: str) -> str:
    """A body of 1 x 2 x 3 that is held below and pulled above, in two steps; nodes are numbered 10, 17, 24, ..."""
    ids = 7 * np.arange(len(mesh.points)) + 10
    rows = ["*NODE, NSET=ALL", *(f"{i},{x:.9g},{y:.9g},{z:.9g}" for i, (x, y, z) in zip(ids, mesh.points, strict=True))]
    rows.append(f"*ELEMENT, TYPE={kind}, ELSET=BODY")
    for i, cell in enumerate(ids[mesh.cells].tolist(), 1):
        rows += [",".join(map(str, [i, *cell[:10]])) + ("," if cell[10:] else "")]
        rows += [",".join(map(str, cell[10:]))] if cell[10:] else []
    low, high = (ids[np.isclose(mesh.points[:, 2], z)] for z in (0.0, 3.0))
    rows += ["*NSET, NSET=LOW", *map(str, low), "*NSET, NSET=HIGH", *map(str, high), "*BOUNDARY", "LOW,1,3"]
    rows += ["*MATERIAL, NAME=M", "*ELASTIC", "1000.,0.3", "*SOLID SECTION, ELSET=BODY, MATERIAL=M"]
    for pull in (0.1, 0.3):
        rows += ["*STEP, NLGEOM", "*STATIC", "0.5,1.", "*BOUNDARY", f"HIGH,3,3,{pull}", "*NODE FILE", "U,RF"]
        rows += ["*EL FILE", "S", "*NODE PRINT, NSET=ALL", "U", "*END STEP"]
    return "\n".join([*rows, ""])


@pytest.mark.slow
@pytest.mark.parametrize(("name", "kind"), [("tet4", "C3D4"), ("tet10", "C3D10"), ("hex8", "C3D8"), ("hex20", "C3D20")])
def test_calculix_itself_is_read(name: str, kind: str, tmp_path: Path) -> None:
    """What it writes in .frd is what it prints in .dat, to the six digits that both have; cells have our order."""
    if shutil.which("ccx") is None:
        pytest.skip("CalculiX is not installed")
    mesh = box(1.0, name)
    (tmp_path / "job.inp").write_text(deck(mesh, kind))
    subprocess.run(["ccx", "-i", "job"], cwd=tmp_path, capture_output=True, timeout=120, check=True)
    found = read(tmp_path / "job.frd")
    assert found.kind == name
    assert found.times == pytest.approx([0.5, 1.0, 1.5, 2.0])
    assert {"DISP", "FORC"} == set(found.fields)
    assert found.left == ("`STRESS`", "`ERROR`")
    np.testing.assert_allclose(found.points, mesh.points, rtol=1e-5)
    np.testing.assert_array_equal(found.ids, 7 * np.arange(len(mesh.points)) + 10)
    np.testing.assert_array_equal(found.cells, mesh.cells)
    words = [line.split() for line in (tmp_path / "job.dat").read_text().splitlines()]
    printed = np.array([row for row in words if len(row) == 4 and row[0].isdigit()], dtype=float)
    u = printed[:, 1:].reshape(4, -1, 3)
    np.testing.assert_allclose(found.fields["DISP"], u, rtol=1e-5, atol=1e-12)


@pytest.mark.slow
def test_a_calculation_that_calculix_gave_up_is_no_result(tmp_path: Path) -> None:
    """It leaves in its .frd what is in no equilibrium."""
    if shutil.which("ccx") is None:
        pytest.skip("CalculiX is not installed")
    text = deck(box(1.0, "hex8"), "C3D8").replace("*BOUNDARY\nHIGH,3,3,0.1", "*CLOAD\nHIGH,1,1e6")
    (tmp_path / "job.inp").write_text(text)
    subprocess.run(["ccx", "-i", "job"], cwd=tmp_path, capture_output=True, timeout=120, check=False)
    with pytest.raises(Unreadable, match="not in equilibrium"):
        read(tmp_path / "job.frd")


@pytest.mark.slow
def test_vtk_itself_is_read_however_it_packs(tmp_path: Path) -> None:
    vtk = pytest.importorskip("vtk")
    from vtk.util.numpy_support import numpy_to_vtk

    grid, points = vtk.vtkUnstructuredGrid(), vtk.vtkPoints()
    points.SetData(numpy_to_vtk(made.X, deep=1))
    grid.SetPoints(points)
    for cell in made.CELLS.tolist():
        grid.InsertNextCell(10, 4, cell)
    u = numpy_to_vtk(made.U, deep=1)
    u.SetName("u")
    grid.GetPointData().AddArray(u)
    for mode in (0, 1, 2):  # text, base64, after the tree
        for packer in ("None", "ZLib", "LZMA"):
            for encoded, header, order in ((0, 32, 0), (1, 64, 1)):
                writer = vtk.vtkXMLUnstructuredGridWriter()
                writer.SetInputData(grid)
                writer.SetFileName(str(tmp_path / "x.vtu"))
                writer.SetDataMode(mode)
                getattr(writer, f"SetCompressorTypeTo{packer}")()
                writer.SetEncodeAppendedData(encoded)
                writer.SetHeaderType(header)
                writer.SetByteOrder(order)
                writer.Write()
                np.testing.assert_array_equal(read(tmp_path / "x.vtu").fields["u"], [made.U])


def test_broken_files_end_in_words(tmp_path: Path) -> None:
    ends = made.sieged(100, 0, tmp_path)
    assert sum(ends.values()) == 100


@pytest.mark.slow
@pytest.mark.long
def test_ten_thousand_broken_files_end_in_words(tmp_path: Path) -> None:
    """Told or Unreadable: no traceback, none that takes five seconds, none opened outside the folder."""
    ends = made.sieged(10_000, 1, tmp_path)
    assert {end.split()[0] for end in ends} == {".vtu", ".vtk", ".pvd", ".xdmf", ".frd", ".csv", ".xplt"}
    assert {end.split()[1] for end in ends} == {"Told", "Unreadable"}


def test_a_vtk_file_cut_after_dataset_is_refused(tmp_path: Path) -> None:
    (tmp_path / "cut.vtk").write_bytes(b"# vtk DataFile Version 3.0\nx\nASCII\nDATASET \n")
    with pytest.raises(Unreadable):
        read(tmp_path / "cut.vtk")


def test_every_ending_is_known_once() -> None:
    assert not READERS.keys() & INSTEAD.keys()


def test_a_file_that_may_not_be_read_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever runs tests as root may read everything: here nobody may open it."""

    def denied(*_: object, **__: object) -> None:
        raise PermissionError(13, "Permission denied")

    (tmp_path / "theirs.csv").write_text("X,Y,Z,ux,uy,uz\n0,0,0,0,0,0\n")
    monkeypatch.setattr(os, "open", denied)
    with pytest.raises(Unreadable, match=r"it cannot be read .*Permission denied"):
        read(tmp_path / "theirs.csv")
