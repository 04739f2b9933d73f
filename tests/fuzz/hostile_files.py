"""Hostile files for every reader: each call ends in a value or a reason, in 4 GB of addresses and 20 s of processor.

    python tests/fuzz/hostile_files.py READER FOLDER     all files of a reader, in a process with these limits

Files are made, not kept: they are cut off, promise more than they hold, unpack to more than memory has, nest deep, hold
NUL bytes or nothing, or are no files at all but pipes, devices, folders and links.
"""

from __future__ import annotations

import gzip
import io
import json
import os
import random
import resource
import signal
import struct
import sys
import traceback
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

ADDRESSES = 4 << 30  # bytes, as `ulimit -v 4194304` has it
SECONDS = 20  # of the processor
BLOCKED = 90  # s, which pass where a pipe is waited for, and on a machine that is busy
LONG = 1_000_000  # bytes of a text: a scan that is quadratic in them takes hours

Files = Iterator[tuple[str, Callable[[Path], object]]]


def written(data: bytes) -> Callable[[Path], object]:
    """A regular file with these bytes."""
    return lambda path: path.write_bytes(data)


def no_files() -> Files:
    """What is no regular file, and links."""
    yield "a pipe", os.mkfifo
    yield "a folder", Path.mkdir
    yield "a device by a link", lambda path: path.symlink_to("/dev/zero")
    yield "a terminal by a link", lambda path: path.symlink_to("/dev/tty")
    yield "a link to itself", lambda path: path.symlink_to(path.name)
    yield "a link to nothing", lambda path: path.symlink_to("nothing")
    yield "a process's memory", lambda path: path.symlink_to("/proc/self/mem")


def bytes_of_any_kind() -> Files:
    """Contents that are of no format."""
    chance = random.Random(7)
    yield "nothing", written(b"")
    yield "one byte", written(b"\0")
    yield "NUL bytes", written(bytes(100_000))
    yield "noise", written(chance.randbytes(50_000))
    yield "line ends", written(b"\n" * LONG)
    yield "blanks", written(b" " * LONG)
    yield "digits", written(b"1" * LONG)
    yield "numbers", written(b"1 " * (LONG // 2))
    yield "commas", written(b"," * LONG)
    yield "stars", written(b"*" * LONG)
    yield "quotes", written(b'"' * LONG)
    yield "brackets", written(b"[" * LONG)
    yield "braces", written(b'{"a":' * (LONG // 5))
    yield "elements in elements", written(b"<a>" * (LONG // 3))
    yield "one tag", written(b"<a " + b'b="c" ' * (LONG // 6))
    yield "gzip", written(gzip.compress(bytes(20_000_000)))
    yield "UTF-16", written("\ufeffx,y\n1,2\n".encode("utf-16"))


def whole() -> dict[str, list[bytes]]:
    """Sound files by the ends of their names, from which others are cut and spoilt."""
    import meshio
    import numpy as np

    X = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]])
    solid = meshio.Mesh(X, [("tetra", np.array([[0, 1, 2, 3], [1, 2, 3, 4]]))], {"u": X})
    skin = meshio.Mesh(X, [("triangle", np.array([[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]))])
    found: dict[str, list[bytes]] = {}
    kinds = {".vtk": (None, {"binary": False}), ".vtu": (None, {}), ".inp": ("abaqus", {}), ".mesh": ("medit", {}),
             ".meshb": ("medit", {}), ".su2": ("su2", {}), ".bdf": ("nastran", {}), ".xml": ("dolfin-xml", {}),
             ".mdpa": ("mdpa", {}), ".vol": ("netgen", {}), ".avs": ("avsucd", {}), ".f3grid": ("flac3d", {}),
             ".post": ("permas", {}), ".ugrid": ("ugrid", {})}  # fmt: skip
    folder = Path("made")
    folder.mkdir(exist_ok=True)
    for suffix, (kind, options) in kinds.items():
        file = folder / f"sound{suffix}"
        solid.write(file, kind, **options)
        found[suffix] = [file.read_bytes()]
    for word in ("gmsh22", "gmsh"):
        solid.write(folder / "sound.msh", word, binary=False)
        found.setdefault(".msh", []).append((folder / "sound.msh").read_bytes())
    for suffix in (".stl", ".ply", ".obj", ".off"):
        skin.write(folder / f"sound{suffix}", suffix[1:], **({"binary": True} if suffix in (".stl", ".ply") else {}))
        found[suffix] = [(folder / f"sound{suffix}").read_bytes()]
    meshio.xdmf.write(str(folder / "sound.xdmf"), solid, data_format="XML")
    found[".xdmf"] = [(folder / "sound.xdmf").read_bytes()]
    out = io.BytesIO()
    np.save(out, np.ones((3, 3, 3)))
    found[".npy"] = [out.getvalue()]
    zipped = io.BytesIO()
    np.savez_compressed(zipped, a=np.zeros((1000, 1000, 20)))
    found[".npz"] = [zipped.getvalue()]
    found[".nrrd"] = [nrrd(b"4 4 4", zlib.compress(bytes(256))), nrrd(b"2000 2000 2000", gzip.compress(bytes(10**7)))]
    found[".nii"] = [nifti((4, 4, 4)) + bytes(256)]
    found[".csv"] = [b"x0,y0,z0,x1,y1,z1\n0,0,0,1,1,1\n", b"X,Y,Z,ux,uy,uz\n0,0,0,0,0,0\n"]
    return found


def nrrd(sizes: bytes, data: bytes, more: bytes = b"encoding: gzip\n") -> bytes:
    """An NRRD file."""
    head = b"NRRD0005\ntype: float\ndimension: 3\nsizes: %b\nspacings: 1 1 1\nunits: mm mm mm\nendian: little\n"
    return head % sizes + more + b"\n" + data


def nifti(shape: tuple[int, int, int]) -> bytes:
    """The header of a NIfTI-1 file of floats."""
    head = bytearray(352)
    struct.pack_into("<i", head, 0, 348)
    struct.pack_into("<8h", head, 40, 3, *shape, 1, 1, 1, 1)
    struct.pack_into("<2h", head, 70, 16, 32)
    struct.pack_into("<8f", head, 76, 1, 1, 1, 1, 0, 0, 0, 0)
    struct.pack_into("<f", head, 108, 352.0)
    head[123] = 2
    head[344:348] = b"n+1\0"
    return bytes(head)


def promised(suffix: str) -> Files:
    """Files of a format that promise or unpack to more than they hold, or name others."""
    bomb = zlib.compress(bytes(1 << 26))
    packed = struct.pack("<4I", 1, 1 << 26, 1 << 26, len(bomb)) + bomb
    if suffix == ".vtu":
        array = b'<DataArray type="Float64" Name="%d" NumberOfComponents="3" format="appended" offset="0"/>'
        vtu = (b'<VTKFile type="UnstructuredGrid" byte_order="LittleEndian" header_type="UInt32" '
               b'compressor="vtkZLibDataCompressor"><UnstructuredGrid><Piece NumberOfPoints="2796202" '
               b'NumberOfCells="0"><PointData>%b</PointData><Points>%b</Points></Piece></UnstructuredGrid>'
               b'<AppendedData encoding="raw">_%b</AppendedData></VTKFile>')  # fmt: skip
        many = b"".join(array % i for i in range(2000))
        yield "arrays that share a bomb", written(vtu % (many, array % 0, packed))
        yield "one name for many arrays", written(vtu % ((array % 0) * 2000, array % 0, packed))
        yield "appended tags that do not end", written(b"<VTKFile>" + b"<AppendedData " * (LONG // 14))
    if suffix == ".vtk":
        head = b"# vtk DataFile Version 4.2\nx\n%b\nDATASET UNSTRUCTURED_GRID\nPOINTS %d double\n"
        yield "more points than memory", written(head % (b"BINARY", 10**12))
        yield "more numbers than memory", written(head % (b"ASCII", 10**11) + b"1 2 3\n")
        yield "line ends before its kind", written(b"# vtk DataFile Version 4.2\nx\nASCII\n" + b"\n" * LONG)
    if suffix in (".xdmf", ".xmf"):
        item = (
            '<Xdmf Version="3.0"><Domain><Grid Name="g"><Geometry GeometryType="XYZ"><DataItem DataType="Float" '
            'Dimensions="{}" Format="{}" Precision="8">{}</DataItem></Geometry><Topology '
            'TopologyType="Tetrahedron" NumberOfElements="1"><DataItem DataType="Int" Dimensions="1 4" Format="XML" '
            'Precision="8">0 1 2 3</DataItem></Topology></Grid></Domain></Xdmf>'
        )
        for form, told in (("Binary", "pipe"), ("Binary", "/dev/zero"), ("HDF", "pipe:/a"), ("binary", "../x")):
            yield f"{form} numbers in {told}", written(item.format("4 3", form, told).encode())
        yield "more numbers than memory", written(item.format("99999999999 3", "XML", "1").encode())
    if suffix in (".stl",):
        yield "more triangles than it holds", written(bytes(80) + struct.pack("<I", 2**32 - 1) + bytes(50))
    if suffix in (".ply", ".off"):
        ply = b"ply\nformat binary_little_endian 1.0\nelement vertex 9999999999\nproperty float x\nend_header\n"
        yield (
            "more points than it holds",
            written(ply if suffix == ".ply" else b"OFF\n9999999999 9999999999 0\n0 0 0\n"),
        )
    if suffix == ".obj":
        yield "an index beyond all", written(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 99999999999999999999999\n")
        yield "an index of 64 bits", written(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9223372036854775807\n")
        yield "materials in a pipe", written(b"mtllib pipe\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    if suffix == ".msh":
        head = b"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 999999999999 1 999999999999\n2 1 0 999999999999\n1\n"
        yield "more nodes than it holds", written(head)
        yield "format 1 without its elements", written(b"$NOD\n999999999\n" + b"1 0 0 0\n" * 1000)
    if suffix in (".mesh", ".meshb"):
        yield (
            "more vertices than it holds",
            written(b"MeshVersionFormatted 2\nDimension 3\nVertices\n99999999999\n0 0 0 1\n"),
        )
    if suffix in (".nrrd", ".nhdr"):
        detached = b"encoding: raw\ndata file: %b\n"
        for told in (b"pipe", b"/dev/zero", b"../../x.raw", b"LIST\npipe", b"%03d.raw 1 9 1"):
            yield f"voxels in {told.decode()!r}", written(nrrd(b"4 4 4", b"", detached % told))
        yield "voxels far behind comments", written(nrrd(b"4 4 4", b"", b"# c\n" * 30_000 + detached % b"pipe"))
        yield "more voxels than memory", written(nrrd(b"99999 99999 99999", b"", b"encoding: raw\n"))
    if suffix in (".nii", ".nii.gz"):
        data = nifti((32767, 32767, 32767))
        yield "more voxels than memory", written(data if suffix == ".nii" else gzip.compress(data))
    if suffix == ".npy":
        head = b"{'descr': '<f8', 'fortran_order': False, 'shape': (99999, 99999, 99999), }"
        yield "more voxels than memory", written(b"\x93NUMPY\x01\0" + struct.pack("<H", len(head)) + head)
    if suffix == ".inp":
        yield "a set of all numbers", written(b"*NODE\n1,0,0,0\n*NSET,NSET=A,GENERATE\n1,100000000000,1\n")
        yield "itself", written(b"*INCLUDE, INPUT=hostile.inp\n")
        yield "a pipe within", written(b"*INCLUDE, INPUT=pipe\n")
    if suffix == ".frd":
        yield (
            "more nodes than it holds",
            written(b"    2C" + b" " * 18 + b"9999999999" + b" " * 37 + b"1\n -1" + b"1" * 46),
        )
    if suffix == ".xplt":
        states = zlib.compress(bytes(0)) * 50_000
        yield "many empty states", written(struct.pack("<3I", 0x00464542, 0x01000000, 0) + states)
    if suffix == ".json":
        yield "numbers without end", written(b'{"schema": "softmark-compare/1", "points": [' + b"9" * 10_000 + b"]}")


def files_of(suffix: str) -> Files:
    """All files that a reader of a format is given."""
    yield from no_files()
    yield from bytes_of_any_kind()
    yield from promised(suffix)
    chance = random.Random(suffix)
    for data in whole().get(suffix, []):
        for end in sorted({0, *(chance.randrange(len(data)) for _ in range(6))}):
            yield f"the first {end} bytes", written(data[:end])
        for _ in range(12):
            spoilt = bytearray(data)
            for _ in range(chance.choice((1, 3, 20))):
                spoilt[chance.randrange(len(spoilt))] = chance.choice((0, 9, 48, 57, 255, chance.randrange(256)))
            yield "spoilt bytes", written(bytes(spoilt))


# ------------------------------------------------------------------ readers


def readers() -> dict[str, tuple[tuple[str, ...], Callable[[Path], object], tuple[type[BaseException], ...]]]:
    """By name: endings, the reader, and what it raises of a file that it does not read."""
    from softmark.interpreter.importers import import_formats, imported_deck
    from softmark.interpreter.language import scene_sources
    from softmark.interpreter.models.imported_results import readers as results
    from softmark.interpreter.problem import field_files
    from softmark.interpreter.study.analysis import result_changes
    from softmark.interpreter.study.leaderboard import leaderboard_changes
    from softmark.interpreter.study.run_cache import cache_folder
    from softmark.interpreter.study.workers.task_journal import Journal, JournalRefused
    from softmark.interpreter.validation import plugin_loader
    from softmark.interpreter.vocabulary.field_words import Field
    from softmark.references import csv_tables, measured_surface, tracked_points, voxel_files
    from softmark.references.measured_data import Unreadable
    from softmark.solvers.mesh.files import mesh_formats as mesh_formats
    from softmark.solvers.mesh.files import mesh_reader

    def field(path: Path) -> object:
        field_files._load_field.cache_clear()
        amount = type("Amount", (), {"value": 1.0})()
        return field_files.load_field(Field(str(path), unit=amount, length=1e-3))

    def kept(path: Path) -> object:
        path.rename(path.with_name("key.kept"))
        return cache_folder.read_saved(path.parent, "key")

    def journal(path: Path) -> None:
        path.rename(path.with_name("journal.jsonl"))
        with Journal.open(path.parent):
            pass

    unread = (Unreadable,)
    return {
        "meshes": (
            tuple(sorted(mesh_formats.MESHES - {".gz"})),
            lambda p: mesh_reader.read_cells(str(p), 1.0, named=True),
            (mesh_reader.UnreadableMesh,),
        ),
        "surfaces": (
            (".stl", ".ply", ".obj", ".off", ".vtk", ".vtu", ".xdmf"),
            lambda p: mesh_reader.read_triangles(str(p), 1.0),
            (mesh_reader.UnreadableMesh,),
        ),
        "scans": (
            (".stl", ".ply", ".obj", ".off", ".vtk", ".vtu", ".msh", ".xdmf"),
            measured_surface.read_surface,
            unread,
        ),
        "volumes": (
            (".npy", ".npz", ".nrrd", ".nhdr", ".nii", ".nii.gz", ".dcm"),
            lambda p: voxel_files.read_volume(p, (1e-3, 1e-3, 1e-3), 1e-3),
            unread,
        ),
        "fields": ((".nrrd", ".nii", ".vtu", ".vtk"), field, unread),
        "tables": ((".csv",), lambda p: csv_tables.read_columns(p, ["x", "y"]), unread),
        "markers": ((".csv",), tracked_points.read_table, unread),
        "results": (tuple(results.READERS), results.read, unread),
        "decks": (tuple(import_formats.READERS), import_formats.read, (Unreadable, imported_deck.NotImportable)),
        "scenes": ((".scene",), scene_sources.read_scene_file, (scene_sources.UnreadableScene,)),
        "plugins": ((".py",), lambda p: plugin_loader._read(str(p)), (plugin_loader.NoPlugin,)),
        "comparisons": ((".json",), lambda p: result_changes.read_result(p), (result_changes.NotComparable,)),
        "boards": (
            (".json",),
            lambda p: leaderboard_changes.read_board(p),
            (result_changes.NotComparable, leaderboard_changes.NotALeaderboard),
        ),
        "kept results": ((".kept",), kept, (cache_folder.DamagedFile,)),
        "journals": ((".jsonl",), journal, (JournalRefused,)),
    }


def tried(name: str, folder: Path) -> Iterator[str]:
    """What is wrong with a reader, of all its files: an exception that is none of its own, or no reason."""
    suffixes, reader, known = readers()[name]
    for suffix in suffixes:
        for number, (what, make) in enumerate(files_of(suffix)):
            place = folder / f"{name}{suffix}-{number}"
            place.mkdir()
            os.mkfifo(place / "pipe")
            path = place / f"hostile{suffix}"
            make(path)
            signal.setitimer(signal.ITIMER_PROF, SECONDS)  # of the processor; by default this process ends then
            signal.alarm(BLOCKED)
            print(f"{suffix}: {what}", file=sys.stderr, flush=True)
            try:
                reader(path)
            except known as reason:
                if not str(reason):
                    yield f"{suffix}: {what}: no reason"
            except BaseException as error:
                yield f"{suffix}: {what}: {type(error).__name__}: {error}\n{traceback.format_exc(limit=-4)}"
            signal.setitimer(signal.ITIMER_PROF, 0)
            signal.alarm(0)


def main() -> None:
    """All files of a reader within the limits; what is wrong, as JSON."""
    name, folder = sys.argv[1], Path(sys.argv[2])
    os.chdir(folder)
    known: Any = readers()  # modules are loaded before the limit counts, as they are in a command
    assert name in known
    resource.setrlimit(resource.RLIMIT_AS, (ADDRESSES, ADDRESSES))
    print(json.dumps(list(tried(name, folder))))


if __name__ == "__main__":
    main()
