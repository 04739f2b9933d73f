"""Files of results that are broken at random: whole ones of every format, and what is done to them.

    python tests/fuzz/results.py [COUNT]      reads so many; exit 1 if one ends in anything but Told or Unreadable

Every file opened on the way is noted: what lies outside the folder is a trespass.
"""

from __future__ import annotations

import base64
import io
import random
import re
import signal
import struct
import sys
import tempfile
import time
import zlib
from collections import Counter
from contextlib import redirect_stderr
from pathlib import Path
from typing import Any

import guard
import meshio
import numpy as np

from softmark.interpreter.models.imported_results.readers import read
from softmark.interpreter.models.imported_results.result_file import ResultFile
from softmark.references.measured_data import Unreadable

X = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]])
CELLS = np.array([[0, 1, 2, 3], [1, 2, 3, 4]])
U = np.arange(15.0).reshape(5, 3) / 8
LIMIT_S = 5.0
Files = dict[str, bytes]  # the first is read


def written(name: str, mesh: meshio.Mesh, how: dict[str, Any]) -> bytes:
    """By meshio, which says what it thinks of text."""
    with tempfile.TemporaryDirectory() as folder, redirect_stderr(io.StringIO()):
        mesh.write(Path(folder) / name, **how)
        return (Path(folder) / name).read_bytes()


def vtu(u: Any = U, **how: Any) -> bytes:
    """As meshio writes it."""
    mesh = meshio.Mesh(X, [("tetra", CELLS), ("triangle", CELLS[:, :3])], point_data={"u": u, "p": X[:, 0]})
    return written("x.vtu", mesh, how)


def raw(header: str = "<I", packed: bool = False, encoded: bool = False, u: Any = U) -> bytes:
    """As ParaView writes it: numbers after the tree, raw or in base64, compressed or not, and words beside them."""
    parts = {"u": u, "points": X, "connectivity": CELLS.ravel(), "offsets": np.array([4, 8])}
    parts |= {"types": np.array([10, 10], dtype=np.uint8), "TimeValue": np.array([2.5])}
    kinds, at, body = {"f": "Float64", "i": "Int64", "u": "UInt8"}, 0, b""
    tags = {}
    for word, values in parts.items():
        data = values.tobytes()
        if packed:  # two blocks
            size = max(8, len(data) // 16 * 8)
            blocks = [zlib.compress(data[i : i + size]) for i in range(0, len(data), size)]
            heads = [len(blocks), size, len(data) % size, *map(len, blocks)]
            head, data = b"".join(struct.pack(header, n) for n in heads), b"".join(blocks)
        else:
            head = struct.pack(header, len(data))
        part = base64.b64encode(head) + base64.b64encode(data) if encoded else head + data
        kind, wide = kinds[values.dtype.kind], values[0].size
        tags[word] = (
            f'<DataArray type="{kind}" Name="{word}" NumberOfComponents="{wide}" format="appended" offset="{at}"/>'
        )
        body, at = body + part, at + len(part)
    packer = ' compressor="vtkZLibDataCompressor"' if packed else ""
    order = ' byte_order="LittleEndian" header_type="UInt64"' if header == "<Q" else ' byte_order="LittleEndian"'
    tree = f"""<?xml version="1.0"?>
<VTKFile type="UnstructuredGrid" version="1.0"{order}{packer}>
<UnstructuredGrid><FieldData>{tags["TimeValue"]}<DataArray type="String" Name="who" format="ascii">65 0</DataArray>
</FieldData><Piece NumberOfPoints="5" NumberOfCells="2"><PointData Vectors="u">{tags["u"]}</PointData>
<Points>{tags["points"]}</Points><Cells>{tags["connectivity"]}{tags["offsets"]}{tags["types"]}</Cells></Piece>
</UnstructuredGrid><AppendedData encoding="{"base64" if encoded else "raw"}">
   _"""
    return tree.encode() + body + b"\n  </AppendedData>\n</VTKFile>\n"


def vtk(**how: Any) -> bytes:
    """A legacy file, as meshio writes it."""
    return written("x.vtk", meshio.Mesh(X, [("tetra", CELLS)], point_data={"u": U, "p": X[:, 0]}), how)


def pvd(*names: str) -> bytes:
    """A series of files at 0, 0.5, ..."""
    entries = "".join(f'<DataSet timestep="{i / 2}" part="0" file="{name}"/>\n' for i, name in enumerate(names))
    return f'<?xml version="1.0"?>\n<VTKFile type="Collection">\n<Collection>{entries}</Collection></VTKFile>'.encode()


def pvtu(*names: str) -> bytes:
    """Parts of one mesh."""
    pieces = "".join(f'<Piece Source="{name}"/>' for name in names)
    return f'<VTKFile type="PUnstructuredGrid"><PUnstructuredGrid>{pieces}</PUnstructuredGrid></VTKFile>'.encode()


def xdmf(moments: int = 2) -> bytes:
    """A series with its numbers in the file, on the mesh of its first grid."""

    def item(values: Any, kind: str) -> str:
        shape, text = " ".join(map(str, values.shape)), io.StringIO()
        np.savetxt(text, values.reshape(len(values), -1), "%.17g")
        tag = f'<DataItem Dimensions="{shape}" NumberType="{kind}" Precision="8" Format="XML">'
        return f"{tag}{text.getvalue()}</DataItem>"

    steps = "".join(
        f'<Grid Name="u"><xi:include xpointer="xpointer(//Grid[@Name=&quot;mesh&quot;]/*)"/><Time Value="{i / 2}"/>'
        f'<Attribute Name="u" AttributeType="Vector" Center="Node">{item(i * U, "Float")}</Attribute></Grid>'
        for i in range(moments)
    )
    return f"""<?xml version="1.0"?><Xdmf Version="3.0" xmlns:xi="http://www.w3.org/2001/XInclude"><Domain>
<Grid Name="mesh" GridType="Uniform"><Topology TopologyType="Tetrahedron" NumberOfElements="2">{item(CELLS, "Int")}
</Topology><Geometry GeometryType="XYZ">{item(X, "Float")}</Geometry></Grid>
<Grid Name="series" GridType="Collection" CollectionType="Temporal">{steps}</Grid></Domain></Xdmf>""".encode()


def frd(times: tuple[float, ...] = (0.5, 1.0)) -> bytes:
    """As CalculiX writes it, with nodes of their own numbers 10, 20, ..."""
    rows = ["    1C", "    1UUSER", f"    2C{'':18}{len(X):12d}{'':37}1"]
    rows += [f" -1{10 * i + 10:10d}" + "".join(f"{v:12.5E}" for v in x) for i, x in enumerate(X)]
    rows += [" -3", f"    3C{'':18}{len(CELLS):12d}{'':37}1"]
    for i, cell in enumerate(CELLS, 1):
        rows += [f" -1{i:10d}    3    0    1", " -2" + "".join(f"{10 * n + 10:10d}" for n in cell)]
    rows.append(" -3")
    for k, t in enumerate(times, 1):
        rows += [
            f"    1PSTEP{k:26d}{1:12d}{1:12d}",
            f"  100CL{100 + k:5d}{t:12.5E}{len(X):12d}{'':20} 0{k:5d}{'':10} 1",
        ]
        rows += [" -4  DISP        4    1", *(f" -5  D{c}          1    2    {c}    0" for c in (1, 2, 3))]
        rows.append(" -5  ALL         1    2    0    0    1ALL")
        rows += [f" -1{10 * i + 10:10d}" + "".join(f"{t * v:12.5E}" for v in u) for i, u in enumerate(U)]
        rows.append(" -3")
    return "\n".join([*rows, " 9999", ""]).encode()


def csv(times: tuple[float, ...] = (0.0, 0.5)) -> bytes:
    """A row for each point and time."""
    rows = ["time,X,Y,Z,ux,uy,uz,name"]
    rows += [",".join(f"{v:.6g}" for v in (t, *x, *(t * u))) + ",a" for t in times for x, u in zip(X, U, strict=True)]
    return "\n".join(rows).encode()


def chunk(order: str, what: int, *parts: bytes) -> bytes:
    """A part of FEBio's plot file."""
    data = b"".join(parts)
    return struct.pack(f"{order}2I", what, len(data)) + data


def xplt(packed: bool = False, order: str = "<", failed: bool = False) -> bytes:
    """As FEBio's own reader wants it: nodes 10, 20, ..., states at 0.5 and 1, the last not converged if `failed`."""

    def number(what: int, value: float, kind: str = "i") -> bytes:
        return chunk(order, what, struct.pack(order + kind, value))

    head = chunk(order, 0x01010000, number(0x01010001, 0x34), number(0x01010004, int(packed)))
    word = number(0x01020002, 1), number(0x01020003, 0), chunk(order, 0x01020004, b"displacement".ljust(64, b"\0"))
    words = chunk(order, 0x01020000, chunk(order, 0x01023000, chunk(order, 0x01020001, *word)))
    nodes = b"".join(struct.pack(f"{order}i3f", 10 * i + 10, *x) for i, x in enumerate(X))
    sizes = chunk(order, 0x01041100, number(0x01041101, len(X)), number(0x01041102, 3))
    cells = (chunk(order, 0x01042201, struct.pack(f"{order}5i", i, *cell)) for i, cell in enumerate(CELLS, 1))
    domain = chunk(order, 0x01042101, number(0x01042102, 2), number(0x01042103, 1), number(0x01032104, len(CELLS)))
    domains = chunk(order, 0x01042000, chunk(order, 0x01042100, domain, chunk(order, 0x01042200, *cells)))
    mesh = chunk(order, 0x01040000, chunk(order, 0x01041000, sizes, chunk(order, 0x01041200, nodes)), domains)
    states = []
    for t in (0.5, 1.0):
        header = chunk(order, 0x02010000, number(0x02010002, t, "f"), number(0x02010003, int(failed and t == 1.0)))
        data = chunk(order, 0, (t * U).astype(f"{order}f4").tobytes())
        variable = chunk(order, 0x02020001, number(0x02020002, 1), chunk(order, 0x02020003, data))
        state = chunk(order, 0x02000000, header, chunk(order, 0x02020000, chunk(order, 0x02020300, variable)))
        states.append(zlib.compress(state) if packed else state)
    return struct.pack(f"{order}I", 0x00464542) + chunk(order, 0x01000000, head, words) + mesh + b"".join(states)


def whole() -> list[Files]:
    """One of every kind."""
    return [
        {"text.vtu": vtu(binary=False)}, {"zlib.vtu": vtu()}, {"lzma.vtu": vtu(compression="lzma")},
        {"plain.vtu": vtu(compression=None)}, {"raw.vtu": raw()}, {"rawz.vtu": raw("<Q", packed=True)},
        {"base64.vtu": raw(encoded=True)}, {"base64z.vtu": raw("<Q", packed=True, encoded=True)},
        {"text.vtk": vtk(binary=False)}, {"binary.vtk": vtk()}, {"old.vtk": vtk(file_format="vtk42", binary=False)},
        {"series.pvd": pvd("a.pvtu", "b.vtu"), "a.pvtu": pvtu("a.vtu"), "a.vtu": raw(),
         "b.vtu": raw("<Q", packed=True, u=2 * U)},
        {"series.xdmf": xdmf()}, {"ccx.frd": frd()}, {"points.csv": csv()},
        {"plain.xplt": xplt()}, {"packed.xplt": xplt(packed=True, order=">")},
    ]  # fmt: skip


NUMBERS = [
    b"nan",
    b"-nan",
    b"inf",
    b"1e400",
    b"-1",
    b"0",
    b"99999999999",
    b"18446744073709551615",
    b"1e30",
    b"4294967295",
]
NUMBERS += [b"-9223372036854775808", b"", b"1_0", b"0x10", b"1,5"]
WORDS = [
    b"../out.vtu",
    b"/etc/passwd",
    b"a/../../out.vtu",
    b"<!DOCTYPE a [<!ENTITY b 'c'>]>",
    b"\0",
    b"<a>" * 200,
    b"\xff",
]
WORDS += [
    b"UInt64",
    b"Float32",
    b"raw",
    b"Mixed",
    b"HDF",
    b"out.h5:/u",
    b"BigEndian",
    b"vtkZLibDataCompressor",
    b"FIELD",
]


def broken(data: bytes, rng: random.Random) -> bytes:
    """Something is done to it, once or more."""
    for _ in range(rng.choice([1, 1, 1, 2, 5])):
        at, way = rng.randrange(len(data) or 1), rng.randrange(8)
        if way == 0:
            data = data[:at]
        elif way == 1:
            data = data[:at] + bytes([rng.randrange(256)]) + data[at + 1 :]
        elif way == 2:
            data = data[:at] + data[at + rng.randrange(1, 200) :]
        elif way == 3:
            data = data[:at] + data[at : at + rng.randrange(1, 200)] + data[at:]
        elif way in (4, 5) and (found := list(re.finditer(rb"[-+]?\d[\d.eE+-]*", data))):
            one = rng.choice(found)
            data = data[: one.start()] + rng.choice(NUMBERS) + data[one.end() :]
        elif way == 6 and (found := list(re.finditer(rb'<[^<>]*>|"[^"]*"|[A-Za-z0-9_]{2,}', data))):
            one = rng.choice(found)
            data = data[: one.start()] + rng.choice([b"", b'"x"', *WORDS]) + data[one.end() :]
        elif way == 7:
            data = data[:at] + bytes(byte ^ (1 << rng.randrange(8)) for byte in data[at : at + 4]) + data[at + 4 :]
    return data


class Hung(BaseException):
    """A file takes too long."""


def _hung(*_: Any) -> None:
    raise Hung


OPENED: list[str] | None = None  # of what is opened, while it is noted


def _note(event: str, arguments: Any) -> None:
    if OPENED is not None and event == "open" and isinstance(arguments[0], str | bytes):
        path = arguments[0]
        OPENED.append(path.decode(errors="replace") if isinstance(path, bytes) else path)


sys.addaudithook(_note)


def sound(told: ResultFile) -> None:
    """What Told promises holds."""
    n = len(told.points)
    t = len(told.times) if told.times is not None else max([len(f) for f in told.fields.values()] or [1])
    assert told.points.shape == (n, 3)
    assert np.isfinite(told.points).all()
    for values in [*told.fields.values(), *([] if told.moved is None else [told.moved])]:
        assert values.shape[1:] == (n, 3)
        assert np.isfinite(values).all()
        assert len(values) == t or told.times is None
    assert (told.cells is None) == (told.kind is None)
    assert told.cells is None or (told.cells.min() >= 0 and told.cells.max() < n)
    assert told.times is None or (np.diff(told.times) > 0).all()
    assert told.ids is None or told.ids.shape == (n,)


def tried(files: Files, folder: Path) -> str:
    """Return the result of reading the first: `ResultFile` or `Unreadable`. Raises other exceptions and trespasses."""
    global OPENED
    for name, data in files.items():
        (folder / name).write_bytes(data)
    OPENED, began = [], time.perf_counter()
    signal.signal(signal.SIGALRM, _hung)
    signal.setitimer(signal.ITIMER_REAL, 4 * LIMIT_S)
    try:
        sound(read(folder / next(iter(files))))
        found = "Told"
    except Unreadable as error:
        found = "Unreadable" if error.reason and error.remedy else "no words"
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        opened, OPENED = OPENED, None
    assert time.perf_counter() - began < LIMIT_S, "it takes too long"
    home = str(folder.resolve())
    assert found != "no words"
    data = [
        p
        for p in opened
        if not p.endswith((".py", ".so", ".pth")) and "__pycache__" not in p and not p.startswith(guard.FREE)
    ]
    assert all(str(Path(p).resolve()).startswith(home) for p in data), data
    return found


def sieged(count: int, seed: int, folder: Path) -> Counter[str]:
    """So many files, by format and end."""
    rng, seeds, found = random.Random(seed), whole(), Counter[str]()
    home = folder / "home"
    home.mkdir()
    (folder / "out.vtu").write_bytes(vtu())
    for i in range(count):
        files = dict(seeds[i % len(seeds)])
        name = rng.choice([next(iter(files)), rng.choice(list(files))])
        files[name] = broken(files[name], rng)
        try:
            end = tried(files, home)
        except BaseException:
            print(f"number {i} of seed {seed}: {name}")
            raise
        found[f"{Path(next(iter(files))).suffix} {end}"] += 1
    return found


if __name__ == "__main__":
    with tempfile.TemporaryDirectory(prefix="softmark-fuzz-") as place:
        for outcome, times in sorted(sieged(int(sys.argv[1]) if sys.argv[1:] else 1000, 1, Path(place)).items()):
            print(f"{outcome:24}{times:8d}")
