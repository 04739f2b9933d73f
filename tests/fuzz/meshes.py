"""Mesh files: whatever their bytes, they give a mesh with finite points and positive cells, or a reason why not.

    python tests/fuzz/meshes.py -max_total_time=600     guided by coverage; needs atheris
    python tests/fuzz/meshes.py FILE...                 each file once, by its ending

The first byte of an input chooses the ending of its name. Findings go to $SOFTMARK_FUZZ/meshes.
"""

from __future__ import annotations

import io
import os
import random
import sys
import tempfile
from contextlib import nullcontext, redirect_stderr, redirect_stdout, suppress
from pathlib import Path
from typing import Any

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parent))

import guard
import numpy as np

GUIDED = __name__ == "__main__" and not any(os.path.isfile(a) for a in sys.argv[1:])


def _readers() -> Any:
    import atheris

    return atheris.instrument_imports(include=["meshio"])


with _readers() if GUIDED else nullcontext():
    import meshio

    from softmark.solvers.mesh.files import mesh_reader

ENDINGS = (".msh", ".vtk", ".vtu", ".stl", ".obj", ".ply", ".inp")
POINTS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]], dtype=float)
TETRAHEDRA = [("tetra", np.array([[0, 1, 2, 3], [1, 2, 3, 4]]))]
TRIANGLES = [("triangle", np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]))]
CUBE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], dtype=float)


class Broken(Exception):
    """A promise is not kept."""


def examine(path: Path) -> str:
    """Whether a file gives a mesh; both ways of reading it keep their promises. Raises Broken."""
    words = []
    for read in (_solid, _surface, _points):
        said = io.StringIO()
        with redirect_stdout(said), redirect_stderr(said):
            try:
                read(str(path))
                words.append("read")
            except mesh_reader.UnreadableMesh as reason:
                if not str(reason):
                    raise Broken("a reason says something") from reason
                words.append("refused")
        if said.getvalue():
            raise Broken("nothing is printed")
    return words[0] if words[0] == words[1] else "surface"


def _solid(path: str) -> None:
    mesh = mesh_reader.read_cells(path, 1e-3)
    if not np.isfinite(mesh.points).all() or not (mesh.volumes > 0).all() or not len(mesh.cells):
        raise Broken("a mesh has finite points and positive cells")
    if mesh.cells.min() < 0 or mesh.cells.max() >= len(mesh.points):
        raise Broken("a mesh has the points that its cells name")


def _surface(path: str) -> None:
    points, triangles = mesh_reader.read_surface(path, 1e-3)
    if not np.isfinite(points).all() or not len(triangles):
        raise Broken("a surface has finite points and a triangle")
    if triangles.min() < 0 or triangles.max() >= len(points):
        raise Broken("a surface has the points that its triangles name")


def _points(path: str) -> None:
    points = mesh_reader.read_points(path, 1e-3)
    if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
        raise Broken("points are finite")


# ------------------------------------------------------------------ inputs


def target(folder: Path) -> Any:
    """The promises as a function of bytes."""

    def one(data: bytes) -> str:
        path = folder / f"mesh{ENDINGS[data[0] % len(ENDINGS) if data else 0]}"
        path.write_bytes(data[1:])
        try:
            return path.suffix + " " + examine(path)
        finally:
            path.unlink()

    return one


def seeds() -> list[bytes]:
    """Small meshes in every format that is read, as text and as binary, and the files of the goldens."""
    found = []
    solid = meshio.Mesh(POINTS, TETRAHEDRA)
    brick = meshio.Mesh(CUBE, [("hexahedron", np.arange(8)[None])])
    surface = meshio.Mesh(POINTS[:4], TRIANGLES)
    kinds = [(".msh", "gmsh22", {"binary": b}) for b in (False, True)] + [
        (".msh", "gmsh", {"binary": b}) for b in (False, True)
    ]
    kinds += [(".vtk", f"vtk{v}", {"binary": b}) for v in ("42", "51") for b in (False, True)]
    kinds += [(".vtu", "vtu", {"binary": b}) for b in (False, True)] + [
        (".vtu", "vtu", {"compression": None}),
        (".inp", "abaqus", {}),
    ]
    kinds += [(".ply", "ply", {"binary": b}) for b in (False, True)] + [
        (".stl", "stl", {"binary": b}) for b in (False, True)
    ]
    kinds += [(".obj", "obj", {})]
    with tempfile.TemporaryDirectory() as name:
        for ending, kind, options in kinds:
            for mesh in (solid, brick, surface):
                path = Path(name) / f"m{ending}"
                with suppress(Exception), redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
                    meshio.write(path, mesh, kind, **options)
                    found.append(_input(path))
    parts = guard.REPOSITORY / "tests" / "errors" / "parts"
    found += [_input(p) for p in sorted(parts.iterdir()) if p.suffix in ENDINGS]
    found.append(bytes([0]) + FIRST.encode())
    corpus = Path(__file__).parent / "corpus"
    return found + [_input(p) for p in sorted(corpus.iterdir()) if p.suffix in ENDINGS]


FIRST = """$NOD
4
1 0 0 0
2 1 0 0
3 0 1 0
4 0 0 1
$ENDNOD
$ELM
1
1 4 1 1 4 1 2 3 4
$ENDELM
"""


def _input(path: Path) -> bytes:
    return bytes([ENDINGS.index(path.suffix)]) + path.read_bytes()


def changed(data: bytes, chance: random.Random, others: list[bytes]) -> bytes:
    """A number for another, a line gone or twice, a cut, a part of another file."""
    body = bytearray(data)
    for _ in range(chance.choice([1, 1, 2, 4])):
        i = chance.randint(1, max(1, len(body) - 1))
        j = min(len(body), i + chance.choice([1, 2, 4, 8, 40]))
        match chance.randrange(7):
            case 0:
                del body[i:j]
            case 1:
                body[i:i] = body[i:j] * chance.choice([1, 2, 50])
            case 2:
                del body[i:]
            case 3:
                other = chance.choice(others)
                k = chance.randint(0, len(other))
                body[i:j] = other[k : k + chance.choice([4, 20, 200])]
            case 4:
                body[i:j] = chance.choice(
                    [
                        b"-1",
                        b"0",
                        b"nan",
                        b"inf",
                        b"1e400",
                        b"99999999999",
                        b"4294967295",
                        b"\xff" * 8,
                        b"\n",
                        b" ",
                    ]
                )
            case 5:
                numbers = list(_NUMBER.finditer(bytes(body)))
                if numbers:
                    m = chance.choice(numbers)
                    body[m.start() : m.end()] = chance.choice(
                        [b"0", b"-1", b"1", b"2", b"5", b"100", b"2147483648", b"nan", b"1e308", b"x"]
                    )
            case 6:
                body[0:1] = bytes([chance.randrange(len(ENDINGS))]) if chance.random() < 0.1 else body[0:1]
    return bytes(body)


import re  # noqa: E402

_NUMBER = re.compile(rb"-?[0-9]+(?:\.[0-9]+)?")


def main() -> None:
    """Guided by coverage, or over files that are named."""
    folder = Path(tempfile.mkdtemp(prefix="softmark-fuzz-"))
    if not GUIDED:
        for name in sys.argv[1:]:
            data = Path(name).read_bytes()
            print(name, target(folder)(data) if name.endswith(".input") else examine(Path(name)))
        return
    own = seeds()
    watch = guard.Watch("meshes", guard.out("meshes"))  # without a fence: meshio imports as it reads
    guard.guided(watch, target(folder), own, lambda data, seed: changed(data, random.Random(seed), own))


if __name__ == "__main__":
    main()
