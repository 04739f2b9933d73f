"""Legacy VTK files, text and binary, up to version 5.1: unstructured grids and surfaces (POLYDATA), with arrays.

Arrays of text are skipped. Polygons become triangles and quadrilaterals; strips become triangles.
Source: VTK File Formats, "Simple legacy formats" (vtk.org); strings and offsets as in vtkDataReader::ReadArray and
ReadCells.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np

from softmark.records import dataclass
from softmark.safe_files import read_regular
from softmark.solvers.mesh.files.gmsh1 import Block, MalformedMeshFile
from softmark.solvers.mesh.mesh import Floats, Ints

TYPES = {
    "bit": "?", "unsigned_char": "u1", "char": "i1", "unsigned_short": "u2", "short": "i2", "unsigned_int": "u4",
    "int": "i4", "unsigned_long": "u8", "long": "i8", "float": "f4", "double": "f8", "vtkidtype": "i4",
    "vtktypeint64": "i8", "vtktypeuint64": "u8", "vtktypeint32": "i4", "vtktypeuint32": "u4",
}  # fmt: skip
CELLS = {  # VTK's number of a cell -> meshio's word and the number of nodes
    1: ("vertex", 1), 3: ("line", 2), 5: ("triangle", 3), 9: ("quad", 4), 10: ("tetra", 4), 12: ("hexahedron", 8),
    13: ("wedge", 6), 14: ("pyramid", 5), 21: ("line3", 3), 22: ("triangle6", 6), 23: ("quad8", 8),
    24: ("tetra10", 10), 25: ("hexahedron20", 20), 26: ("wedge15", 15), 27: ("pyramid13", 13), 28: ("quad9", 9),
    29: ("hexahedron27", 27), 32: ("wedge18", 18),
}  # fmt: skip
LAGRANGE = {(69, 3): 5, (69, 6): 22, (70, 4): 9, (70, 9): 28, (71, 4): 10, (71, 10): 24, (72, 8): 12}
BRICKS = {8: (9, (0, 1, 3, 2)), 11: (12, (0, 1, 3, 2, 4, 5, 7, 6))}  # pixels and voxels: the same cell in another order
POLYGON, STRIP, LINE, POINTS = 7, 6, 4, 2
LISTS = {"VERTICES": POINTS, "LINES": LINE, "POLYGONS": POLYGON, "TRIANGLE_STRIPS": STRIP}  # of POLYDATA, in this order
WIDTHS = {"VECTORS": 3, "NORMALS": 3, "TENSORS": 9, "TENSORS6": 6, "GLOBAL_IDS": 1, "PEDIGREE_IDS": 1, "EDGE_FLAGS": 1}
DATASETS = frozenset({b"UNSTRUCTURED_GRID", b"POLYDATA"})


@dataclass(frozen=True)
class File:
    """Contents of a file in meshio's data layout: points (n, 3), blocks of cells, and arrays by name."""

    points: Floats
    cells: list[Block]
    point_data: dict[str, Any]
    cell_data: dict[str, list[Any]]


def is_legacy_vtk(data: bytes) -> bool:
    """Return whether the data are a legacy VTK file with a supported kind of grid."""
    if not data.startswith(b"# vtk DataFile"):
        return False
    kind = data[:4096].partition(b"DATASET")[2].split(None, 1)
    return bool(kind) and kind[0].upper() in DATASETS


def read(path: Path) -> File:
    """Return the points, cells and numeric arrays of a file. Raises MalformedMeshFile."""
    try:
        return _Reader(read_regular(path)).file()
    except (ValueError, IndexError, KeyError, OverflowError) as error:
        raise MalformedMeshFile(str(error) or type(error).__name__) from error


class _Reader:
    """Parser of one legacy VTK file."""

    def __init__(self, data: bytes) -> None:
        self.data, self.at = data, 0
        self.version = self._next_line()
        self._next_line()  # a title
        form = self._next_line().upper()
        if form not in ("ASCII", "BINARY"):
            raise MalformedMeshFile(f"`{form[:40]}` is neither ASCII nor BINARY")
        self.text = form == "ASCII"
        self.points: Floats | None = None
        self.lists: dict[str, tuple[Ints, Ints]] = {}  # ends (m,) and nodes of cells
        self.types: Ints | None = None
        self.arrays: dict[str, dict[str, Any]] = {"POINT_DATA": {}, "CELL_DATA": {}, "": {}}

    def file(self) -> File:
        """Return the contents of the whole file. Raises MalformedMeshFile, ValueError."""
        self._read_sections()
        if self.points is None:
            raise MalformedMeshFile("it has no POINTS")
        n, on_points = len(self.points), self.arrays["POINT_DATA"]
        rows = list(self._cells_by_type())
        total = sum(len(ends) for ends, _ in self.lists.values())
        blocks: dict[str, tuple[list[Ints], list[Ints]]] = {}
        for word, cells, which in rows:
            own = blocks.setdefault(word, ([], []))
            own[0].append(cells)
            own[1].append(which)
        found, order = [], []
        for word, (lists, numbers) in blocks.items():
            found.append(Block(word, np.concatenate(lists)))
            order.append(np.concatenate(numbers))
        on_cells = {name: [values[which] for which in order] for name, values in self.arrays["CELL_DATA"].items()
                    if len(values) == total}  # fmt: skip
        return File(self.points, found, {k: v for k, v in on_points.items() if len(v) == n}, on_cells)

    def _read_sections(self) -> None:
        where, count = "", 0
        while (line := self._next_line()) is not None and (self.at < len(self.data) or line):
            words = line.split()
            key = words[0].upper() if words else ""
            if not words or key == "DATASET":
                continue
            if key == "METADATA":
                while self._next_line(blank=True).strip():
                    pass
            elif key == "POINTS":
                self.points = self._read_numbers(3 * int(words[1]), words[2]).reshape(-1, 3).astype(np.float64)
            elif key == "CELLS" or key in LISTS:
                self.lists[key] = self._read_cell_list(int(words[1]), int(words[2]))
            elif key == "CELL_TYPES":
                self.types = self._read_numbers(int(words[1]), "int").astype(np.int64)
            elif key in ("POINT_DATA", "CELL_DATA"):
                where, count = key, int(words[1])
            elif key == "FIELD":
                for _ in range(int(words[2])):
                    self._read_field(where)
            elif key == "LOOKUP_TABLE":
                self._read_numbers(4 * int(words[2]), "float" if self.text else "unsigned_char")
            else:
                self._read_attribute(key, words, where, count)

    def _read_attribute(self, key: str, words: list[str], where: str, count: int) -> None:
        """Read one array of points or cells. Raises MalformedMeshFile.

        `key` and `words` are its keyword and header line, `where` is POINT_DATA or CELL_DATA, and `count` its number of
        rows.
        """
        if key == "COLOR_SCALARS":
            self._read_numbers(int(words[2]) * count, "float" if self.text else "unsigned_char")
            return
        if key == "SCALARS":
            kind, width = words[2], int(words[3]) if len(words) > 3 else 1
            before = self.at
            if not self._next_line().upper().startswith("LOOKUP_TABLE"):
                self.at = before
        elif key == "TEXTURE_COORDINATES":
            kind, width = words[3], int(words[2])
        elif key in WIDTHS:
            kind, width = words[2], WIDTHS[key]
        else:
            raise MalformedMeshFile(f"`{key[:40]}` is not a known section")
        self._store_array(where, words[1], self._read_numbers(width * count, kind), count)

    def _read_field(self, where: str) -> None:
        words = self._next_line().split()
        if words[0].upper() == "METADATA":  # belongs to the previous array
            while self._next_line(blank=True).strip():
                pass
            words = self._next_line().split()
        name, width, count, kind = words[0], int(words[1]), int(words[2]), words[3]
        if kind.lower() == "string":
            self._skip_strings(width * count)
        else:
            self._store_array(where, name, self._read_numbers(width * count, kind), count)

    def _store_array(self, where: str, name: str, values: Any, count: int) -> None:
        shaped = values.reshape(count, -1) if count else values
        self.arrays[where][unquote(name)] = shaped[:, 0] if shaped.ndim == 2 and shaped.shape[1] == 1 else shaped

    # ------------------------------------------------------------------ lines and numbers

    def _next_line(self, blank: bool = False) -> str:
        """Return the next line that is not empty; with `blank`, the next line even if it is empty."""
        while self.at < len(self.data):
            end = self.data.find(b"\n", self.at)
            end = len(self.data) if end < 0 else end
            line = self.data[self.at : min(end, self.at + 4096)].decode("utf-8", "replace").strip()
            self.at = end + 1
            if line or blank:
                return line
        return ""

    def _read_numbers(self, count: int, kind: str) -> Any:
        """Return the next `count` numbers of the VTK type `kind`. Raises MalformedMeshFile, ValueError."""
        code = TYPES.get(kind.lower())
        if code is None:
            raise MalformedMeshFile(f"`{kind[:40]}` is not a known number type")
        if count < 0 or count > 8 * len(self.data):
            raise MalformedMeshFile(f"it announces {count} numbers, but the file ends earlier")
        if self.text:
            words = self._read_words(count)
            return np.array(words, dtype=np.float64 if code[0] == "f" else np.int64)
        if code == "?":
            size = (count + 7) // 8
            found = np.unpackbits(np.frombuffer(self._read_bytes(size), np.uint8))[:count]
        else:
            found = np.frombuffer(self._read_bytes(count * int(code[1])), dtype=np.dtype(code).newbyteorder(">"))
        return found.astype(found.dtype.newbyteorder("="))

    def _read_words(self, count: int) -> list[bytes]:
        wide = 24 * count + 64
        while True:
            window = self.data[self.at : self.at + wide]
            parts = window.split(None, count)
            rest = parts[count] if len(parts) > count else b""
            if rest or self.at + wide >= len(self.data):
                if len(parts) < count:
                    raise MalformedMeshFile(f"it announces {count} numbers, but the file ends earlier")
                self.at += len(window) - len(rest)
                return parts[:count]
            wide *= 2

    def _read_bytes(self, size: int) -> bytes:
        if self.at + size > len(self.data):
            raise MalformedMeshFile("it is incomplete")
        self.at += size
        return self.data[self.at - size : self.at]

    def _skip_strings(self, count: int) -> None:
        """Skip `count` strings.

        They are lines in a text file. In a binary file each is preceded by its length, in 1, 2, 4 or 8 bytes.
        """
        if count < 0 or count > len(self.data):
            raise MalformedMeshFile(f"it announces {count} texts, but ends before")
        for _ in range(count):
            if self.text:
                self._next_line(blank=True)
            else:
                wide = (8, 4, 2, 1)[self.data[self.at] >> 6]
                self._read_bytes(
                    int.from_bytes(self._read_bytes(wide), "big") & ((1 << (8 * wide - (2 if wide < 8 else 0))) - 1)
                )

    # ------------------------------------------------------------------ cells

    def _read_cell_list(self, first: int, second: int) -> tuple[Ints, Ints]:
        """Return for each cell the end (m,) of its nodes in the node list, and the node list.

        Raises MalformedMeshFile.
        """
        before = self.at
        words = self._next_line().split()
        if words[:1] == ["OFFSETS"]:  # version 5
            starts = self._read_numbers(first, words[1]).astype(np.int64)
            words = self._next_line().split()
            if words[:1] != ["CONNECTIVITY"]:
                raise MalformedMeshFile("OFFSETS without CONNECTIVITY")
            nodes = self._read_numbers(second, words[1]).astype(np.int64)
            ends = starts[1:]
            if len(starts) and (starts[0] != 0 or (np.diff(starts) < 0).any() or starts[-1] != len(nodes)):
                raise MalformedMeshFile("the offsets of its cells are inconsistent")
            return ends, nodes
        self.at = before
        flat = self._read_numbers(second, "int").astype(np.int64)
        sizes, at = [], 0
        for _ in range(first):
            if at >= len(flat) or flat[at] < 0:
                raise MalformedMeshFile(f"it announces {first} cells, but ends before")
            sizes.append(int(flat[at]))
            at += 1 + sizes[-1]
        if at != len(flat):
            raise MalformedMeshFile("the node counts of its cells are inconsistent")
        ends = np.cumsum(np.array(sizes, dtype=np.int64))
        keep = np.ones(len(flat), dtype=np.bool_)
        keep[ends - np.array(sizes, dtype=np.int64) + np.arange(first)] = False
        return ends, flat[keep]

    def _cells_by_type(self) -> Iterator[tuple[str, Ints, Ints]]:
        """Yield for each cell type its name, its cells (k, a) and their numbers (k,) in the file.

        Raises MalformedMeshFile.
        """
        before = 0
        for key in ("CELLS", *LISTS):
            if key not in self.lists:
                continue
            ends, nodes = self.lists[key]
            types = self.types if key == "CELLS" else np.full(len(ends), LISTS[key], dtype=np.int64)
            if types is None or len(types) != len(ends):
                raise MalformedMeshFile(f"it has {len(ends)} cells but {0 if types is None else len(types)} cell types")
            sizes = np.diff(np.concatenate([[0], ends]))
            for kind, size in sorted({*zip(types.tolist(), sizes.tolist(), strict=True)}):
                which = np.flatnonzero((types == kind) & (sizes == size))
                cells = nodes[(ends[which] - size)[:, None] + np.arange(size)]
                for word, own, index in self._convert_to_meshio_cells(kind, size, cells):
                    yield word, own, before + which[index]
            before += len(ends)

    def _convert_to_meshio_cells(self, kind: int, size: int, cells: Ints) -> Iterator[tuple[str, Ints, Ints]]:
        """Yield cells (k, a) of a VTK type as cells of meshio's types, with their rows in `cells`.

        Raises MalformedMeshFile.
        """
        every = np.arange(len(cells))
        if kind in (POLYGON, STRIP) and size < 3:
            raise MalformedMeshFile(f"a polygon or strip of {size} points")
        if kind == POLYGON and size > 4:
            self._require_convex_polygons(cells)
            fan = np.stack([np.zeros(size - 2, dtype=np.int64), np.arange(1, size - 1), np.arange(2, size)], axis=1)
            yield "triangle", cells[:, fan].reshape(-1, 3), np.repeat(every, size - 2)
        elif kind == POLYGON:
            yield ("triangle" if size == 3 else "quad"), cells, every
        elif kind == STRIP:
            turns = np.array([(i, i + 1, i + 2) if i % 2 == 0 else (i + 1, i, i + 2) for i in range(size - 2)])
            yield "triangle", cells[:, turns].reshape(-1, 3), np.repeat(every, size - 2)
        elif kind in (LINE, POINTS):
            wide = 2 if kind == LINE else 1  # only the first line or point is kept: no solid uses it
            yield ("line" if kind == LINE else "vertex"), cells[:, :wide], every
        else:
            kind, order = BRICKS.get(kind, (LAGRANGE.get((kind, size), kind), tuple(range(size))))
            word, many = CELLS.get(kind, (f"VTK type {kind}", size))
            if many != size or len(order) != size:
                raise MalformedMeshFile(f"a {word} of {size} points")
            yield word, cells[:, list(order)], every

    def _require_convex_polygons(self, cells: Ints) -> None:
        """Raise MalformedMeshFile if a polygon is not convex.

        Triangles from the first point of such a polygon would overlap.
        """
        assert self.points is not None
        corners = self.points[cells]
        edges = np.roll(corners, -1, axis=1) - corners
        turns = np.cross(edges, np.roll(edges, -1, axis=1))
        normal = turns.sum(axis=1, keepdims=True)
        if (np.einsum("kij,kij->ki", turns, np.broadcast_to(normal, turns.shape)) < -1e-9 * (normal**2).sum(-1)).any():
            raise MalformedMeshFile("a polygon is not convex: triangulate the surface")
