"""Commands with hostile files under `ulimit -v` of 4 GB: each ends in a message within 20 s of the processor.

Each file promises more than it holds, unpacks to more than memory has, nests deep, or has one very long line. The
command reads it as a user would: by `run` as part of a scene, by `judge` as a result, by `import` as a deck. The
readers themselves are given many more files by `fuzz/hostile_files.py`.
"""

from __future__ import annotations

import gzip
import io
import re
import struct
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest
from hostile_files import ADDRESSES, SECONDS, nifti, nrrd, promised

COUNT = 10**11  # what files claim: 1 TB and more of anything
BLOCKED = 120  # s on the wall, on a machine that is busy
SCENE = """
material gel = linear_elastic(young = 10 kPa, poisson = 0.3, density = 1000 kg/m^3)
{field}
body block = solid({shape}, {material})
support floor = fixed(block, where = z <= 0 mm)
load weight = gravity(9.81 m/s^2)
model own = fem({element}, strain = small)
{reference}
probe end = point(block, at = (1, 1, 1) mm)
probe skin = surface(block, size = 1 mm)
metric down = displacement(end, along = -z)
"""
BOX = "box(size = (1, 1, 1) mm)"


def scene(shape: str = BOX, reference: str = "", field: str = "") -> str:
    """A block that is read from a file, or compared with one, or has constants from one."""
    size = "" if shape.startswith("mesh") else ", size = 1 mm"
    element = "tet4" if shape.startswith(("mesh", "filled")) else "hex8"
    material = "soft" if field else "gel"
    return SCENE.format(shape=shape, reference=reference, field=field, element=element + size, material=material)


def mesh(file: str) -> str:
    return scene(f'mesh("{file}", unit = 1 mm)')


def filled(file: str) -> str:
    return scene(f'tetrahedralized("{file}", unit = 1 mm)')


def scan(file: str) -> str:
    reference = f'reference scan = surface("{file}", unit = 1 mm, uncertainty = 0.1 mm)'
    return scene(reference=reference) + "metric off = surface_distance(skin, against = scan)\n"


def voxels(file: str) -> str:
    own = ", spacing = (1, 1, 1) mm, unit = 1 mm" if file.endswith((".npy", ".npz")) else ""
    reference = f'reference scan = ct_volume("{file}", iso = 0.5, uncertainty = 0.1 mm{own})'
    return scene(reference=reference) + "metric off = surface_distance(skin, against = scan)\n"


def field(file: str) -> str:
    young = f'field("{file}", unit = 1 kPa, length = 1 mm)'
    material = f"material soft = linear_elastic(young = {young}, poisson = 0.3, density = 1000 kg/m^3)"
    return scene(field=material)


def curve(file: str) -> str:
    own = f'reference pulled = curve("{file}", x = "x", y = "y", x_unit = 1 mm, y_unit = 1 mm, uncertainty = 1 %)'
    return scene(reference=own)


def markers(file: str) -> str:
    return scene(reference=f'reference beads = markers("{file}", unit = 1 mm, uncertainty = 0.1 mm)')


def used(file: str) -> str:
    return f'use "{file}" as other\n' + scene()


def bomb(suffix: str, what: str) -> bytes:
    """A file that the readers are given too."""
    written = next(make for name, make in promised(suffix) if name == what)
    return made_bytes(written)


def made_bytes(write: Callable[[Path], object]) -> bytes:
    """Return the bytes that a maker of hostile files writes to the path that it is given."""

    class Sink:
        data = b""

        def write_bytes(self, data: bytes) -> None:
            self.data = data

    sink = Sink()
    write(sink)  # type: ignore[arg-type]  # it only calls `write_bytes` of a path
    return sink.data


def zipped() -> bytes:
    """An .npz with an array of 10^15 numbers, of which there is none."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("a.npy", bomb(".npy", "more voxels than memory") + bytes(1 << 24))
    return out.getvalue()


def laughs() -> bytes:
    """Nested XML entities: 10^9 times `ha`."""
    entities = b"".join(b'<!ENTITY a%d "%b">' % (i, b"&a%d;" % (i - 1) * 10) for i in range(1, 10))
    return b'<?xml version="1.0"?><!DOCTYPE x [<!ENTITY a0 "ha">' + entities + b"]><febio_spec>&a9;</febio_spec>"


def dicom() -> bytes:
    """An image of 65535 by 65535 pixels in 2^31 - 1 frames, of which there is none."""

    def element(group: int, number: int, kind: bytes, value: bytes) -> bytes:
        value += b" " * (len(value) % 2)
        return struct.pack("<HH2sH", group, number, kind, len(value)) + value

    short = struct.Struct("<H").pack
    meta = element(2, 0x10, b"UI", b"1.2.840.10008.1.2.1\0")
    body = b"".join((
        element(0x28, 2, b"US", short(1)), element(0x28, 4, b"CS", b"MONOCHROME2"),
        element(0x28, 8, b"IS", b"2147483647"), element(0x28, 0x10, b"US", short(65535)),
        element(0x28, 0x11, b"US", short(65535)), element(0x28, 0x30, b"DS", b"1\\1"),
        element(0x28, 0x100, b"US", short(16)), element(0x28, 0x101, b"US", short(16)),
        element(0x28, 0x102, b"US", short(15)), element(0x28, 0x103, b"US", short(0)),
        struct.pack("<HH2sHI", 0x7FE0, 0x10, b"OW", 0, 0xFFFFFFFE) + bytes(100),
    ))  # fmt: skip
    return bytes(128) + b"DICM" + element(2, 0, b"UL", struct.pack("<I", len(meta))) + meta + body


FEB = b'<febio_spec version="4.0"><Mesh><Nodes name="n"><node id="1">0,0,0</node></Nodes>%b</Mesh></febio_spec>'
PVD = b'<VTKFile type="Collection"><Collection>%b</Collection></VTKFile>'
RESULT = b"x,y,z,ux,uy,uz\n"

# by name: the file, its bytes, and how a command reads it
CASES: dict[str, tuple[str, Callable[[], bytes], Callable[[str], str] | str]] = {
    "msh 2.2": ("a.msh", lambda: b"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n%d\n1 0 0 0\n" % COUNT, mesh),
    "msh 2.2 binary": ("a.msh", lambda: b"$MeshFormat\n2.2 1 8\n\1\0\0\0\n$EndMeshFormat\n$Nodes\n%d\n" % COUNT, mesh),
    "msh 4.1": ("a.msh", lambda: bomb(".msh", "more nodes than it holds"), mesh),
    "msh import": ("a.msh", lambda: bomb(".msh", "more nodes than it holds"), "import"),
    "vtk": ("a.vtk", lambda: bomb(".vtk", "more points than memory"), mesh),
    "vtk text": ("a.vtk", lambda: bomb(".vtk", "more numbers than memory"), mesh),
    "vtu": ("a.vtu", lambda: bomb(".vtu", "arrays that share a bomb"), mesh),
    "xdmf": ("a.xdmf", lambda: bomb(".xdmf", "more numbers than memory"), mesh),
    "mesh": ("a.mesh", lambda: bomb(".mesh", "more vertices than it holds"), mesh),
    "abaqus mesh": ("a.inp", lambda: bomb(".inp", "a set of all numbers"), mesh),
    "nastran": ("a.bdf", lambda: b"GRID," + b"1," * 3_000_000, mesh),
    "xml mesh": ("a.xml", laughs, mesh),
    "gzip": ("a.xml.gz", lambda: gzip.compress(bytes(1 << 25)), mesh),
    "stl": ("a.stl", lambda: bomb(".stl", "more triangles than it holds"), filled),
    "stl text": ("a.stl", lambda: b"solid a\nfacet normal " + b"1 " * 5_000_000, scan),
    "ply": ("a.ply", lambda: bomb(".ply", "more points than it holds"), scan),
    "off": ("a.off", lambda: bomb(".off", "more points than it holds"), scan),
    "obj": ("a.obj", lambda: b"v 0 0 0\nf" + b" 1" * 5_000_000, scan),
    "npy": ("a.npy", lambda: bomb(".npy", "more voxels than memory"), voxels),
    "npz": ("a.npz", zipped, voxels),
    "nrrd": ("a.nrrd", lambda: bomb(".nrrd", "more voxels than memory"), voxels),
    "nrrd zipped": ("a.nrrd", lambda: nrrd(b"1200 1200 1200", gzip.compress(bytes(1 << 25))), field),
    "nii": ("a.nii", lambda: nifti((32767, 32767, 32767)), voxels),
    "nii.gz": ("a.nii.gz", lambda: gzip.compress(nifti((1200, 1200, 1200)) + bytes(1 << 25)), field),
    "dicom": ("a.dcm", dicom, voxels),
    "csv": ("a.csv", lambda: b"x,y\n" + b"1," * 5_000_000, curve),
    "csv of markers": ("a.csv", lambda: b"x0,y0,z0,x1,y1,z1\n" + b'"1\n' * 2_000_000, markers),
    "vtu result": ("a.vtu", lambda: bomb(".vtu", "one name for many arrays"), "judge"),
    "pvd result": ("a.pvd", lambda: PVD % (b'<DataSet timestep="1" file="a.pvd"/>' * 200_000), "judge"),
    "vtk result": ("a.vtk", lambda: bomb(".vtk", "more points than memory"), "judge"),
    "xdmf result": ("a.xdmf", lambda: bomb(".xdmf", "more numbers than memory"), "judge"),
    "frd result": ("a.frd", lambda: bomb(".frd", "more nodes than it holds"), "judge"),
    "xplt result": ("a.xplt", lambda: bomb(".xplt", "many empty states"), "judge"),
    "csv result": ("a.csv", lambda: RESULT + b"9" * 10_000_000, "judge"),
    "abaqus deck": ("a.inp", lambda: bomb(".inp", "a set of all numbers"), "import"),
    "abaqus line": ("a.inp", lambda: b"*NODE\n1," + b"0," * 5_000_000, "import"),
    "febio deck": ("a.feb", lambda: FEB % b'<NodeSet name="a">1:%d:1</NodeSet>' % COUNT, "import"),
    "febio depth": ("a.feb", lambda: FEB % (b"<a>" * 1_000_000), "import"),
    "febio entities": ("a.feb", laughs, "import"),
    "pml": ("a.pml", lambda: b"<physicalModel>" + b"<a>" * 1_000_000, "import"),
    "scene depth": ("a.scene", lambda: b"param a = " + b"(" * 900_000, used),
    "scene line": ("a.scene", lambda: b"param a = 1" + b" + 1" * 200_000, used),
    "scene chain": ("a.scene", lambda: b"".join(b"param a%d = a%d\n" % (i, i + 1) for i in range(40_000)), used),
    "scene list": ("a.scene", lambda: b"param a = [" + b"1 mm, " * 140_000 + b"]", used),
}
QUICK = ("abaqus deck", "scene depth")


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("name", [pytest.param(n, marks=[] if n in QUICK else pytest.mark.slow) for n in CASES])
def test_a_command_with_a_hostile_file_ends_in_a_message(name: str, tmp_path: Path) -> None:
    file, data, usage = CASES[name]
    (tmp_path / file).write_bytes(data())
    (tmp_path / "s.scene").write_text(scene() if isinstance(usage, str) else usage(file), encoding="utf-8")
    words = {"judge": ["judge", "s.scene", file], "import": ["import", file]}
    command = words[usage] if isinstance(usage, str) else ["run", "s.scene"]
    limits = f'ulimit -v {ADDRESSES >> 10}; ulimit -t {SECONDS}; exec "$@"'
    done = subprocess.run(
        ["sh", "-c", limits, "sh", sys.executable, "-m", "softmark.interpreter", *command],
        cwd=tmp_path, capture_output=True, text=True, timeout=BLOCKED,
    )  # fmt: skip
    said = done.stdout + done.stderr
    assert done.returncode in (2, 3), (done.returncode, said[-2000:])  # 3: of a reference, the report gives the reason
    assert re.search(rf"(?m)^error\[E\d{{3}}\]: |^(scan|pulled|beads): {re.escape(file)}: ", said), said[-2000:]
    assert not re.search(r"Traceback|MemoryError|bad_alloc", said), said[-2000:]
    assert len(said) < 5000  # of a line of the file, a message shows a part
