"""Reader of VTU, VTK's unstructured grids in XML: text, base64 or raw data, compressed by zlib or LZMA, in one file.

meshio is not used, because it searches raw arrays at offsets that it has changed, and fails at words that
ParaView writes between numbers.

Source: VTK File Formats, section "XML file formats" (vtk.org).
"""

from __future__ import annotations

import base64
import binascii
import lzma
import re
import zlib
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from softmark.interpreter.models.imported_results.readers.result_frames import (
    AGAIN,
    Block,
    ResultState,
    checked_state,
    combine_states,
)
from softmark.interpreter.models.imported_results.readers.xml_trees import ElementT, numbers, parse_xml
from softmark.interpreter.models.imported_results.result_file import Ints, ResultFile
from softmark.records import dataclass
from softmark.references.measured_data import Unreadable
from softmark.resource_limits import FACTOR, FLOOR, limited_resources
from softmark.safe_files import read_regular

Array = NDArray[np.generic]

TYPES = {
    f"{sign}{bits}": f"{code}{bits // 8}" for sign, code in (("Int", "i"), ("UInt", "u")) for bits in (8, 16, 32, 64)
}
TYPES |= {"Float32": "f4", "Float64": "f8"}
HEADERS = {"UInt32": "u4", "UInt64": "u8"}
COMPRESSED = {"vtkZLibDataCompressor": "zlib", "vtkLZMADataCompressor": "LZMA"}
# VTK's number of a cell -> meshio's word; those of Lagrange have the nodes of these in their order
CELLS = {1: "vertex", 3: "line", 5: "triangle", 9: "quad", 10: "tetra", 12: "hexahedron", 13: "wedge", 14: "pyramid",
         22: "triangle6", 23: "quad8", 24: "tetra10", 25: "hexahedron20", 26: "wedge15",
         28: "quad9", 29: "hexahedron27"}  # fmt: skip
LAGRANGE = {(69, 3): 5, (69, 6): 22, (70, 4): 9, (70, 9): 28, (71, 4): 10, (71, 10): 24, (72, 8): 12}


def read(file: Path) -> ResultFile:
    """Return the points, cells and vectors of a VTU file, which has one state. Raises Unreadable."""
    return combine_states(file.name, [read_moment(file)])


def read_moment(file: Path) -> ResultState:
    """Return the content of a VTU file as one state of a series. Raises Unreadable."""
    with limited_resources(file):
        data = read_regular(file)
        name, (root, appended) = file.name, _split_appended_data(data)
        top = parse_xml(name, root, "VTKFile")
        if top.get("type") != "UnstructuredGrid":
            raise Unreadable(name, f"it contains `{top.get('type')}`, not an unstructured grid", "save it as .vtu")
        grid = top.find("UnstructuredGrid")
        pieces = [] if grid is None else grid.findall("Piece")
        if grid is None or not pieces:
            raise Unreadable(name, "it has no grid", AGAIN)
        source = _source(name, top, appended, FLOOR + FACTOR * len(data))
        return _join_pieces(source, grid, pieces)


def _split_appended_data(data: bytes) -> tuple[bytes, tuple[bytes, bytes] | None]:
    """Return the XML of a file, and the tag of its appended data with these data; None if there are none.

    The file is scanned once, however often the tag begins.
    """
    start = data.find(b"<AppendedData")
    end = data.find(b">", start) + 1 if start >= 0 else 0
    if not end:
        return data, None
    return data[:start] + b"</VTKFile>", (data[start:end], data[end:])


def _join_pieces(source: VtuArrays, grid: ElementT, pieces: list[ElementT]) -> ResultState:
    """Return the pieces of a grid as one state, with the time that ParaView writes."""
    points, blocks, arrays, before = [], list[Block](), list[dict[str, Array]](), 0
    for piece in pieces:
        n = source.count(piece, "NumberOfPoints")
        item = piece.find("Points/DataArray")
        if item is None:
            raise Unreadable(source.name, "it has no points", AGAIN)
        if n:
            points.append(source.rows(item, n, 3))
            arrays.append({str(a.get("Name")): source.rows(a, n) for a in piece.findall("PointData/DataArray")
                           if a.get("type") in TYPES})  # fmt: skip
            blocks += [(word, cells + before) for word, cells in _cells(source, piece)]
        before += n
    if not points:
        raise Unreadable(source.name, "it has no points", AGAIN)
    shared = {w: None for w in arrays[0] if all(w in a and a[w].shape[1:] == arrays[0][w].shape[1:] for a in arrays)}
    lost = tuple(dict.fromkeys(f"`{w}`, in some of its pieces" for a in arrays for w in a if w not in shared))
    on_cells = [a.get("Name") for a in pieces[0].findall("CellData/DataArray")]
    clock = grid.find("FieldData/DataArray[@Name='TimeValue']")
    time = None if clock is None else source.array(clock)
    return checked_state(
        source.name, np.concatenate(points), blocks, {w: np.concatenate([a[w] for a in arrays]) for w in shared},
        float(time[0]) if time is not None and time.size == 1 else None,
        (*lost, *(f"`{word}` (cell data)" for word in on_cells)),
    )  # fmt: skip


def _cells(source: VtuArrays, piece: ElementT) -> list[Block]:
    """Return the cells of a piece, in blocks of one type. Raises Unreadable."""
    m = source.count(piece, "NumberOfCells")
    items = {a.get("Name"): a for a in piece.findall("Cells/DataArray")}
    if not m:
        return []
    if lacking := {"connectivity", "offsets", "types"} - items.keys():
        raise Unreadable(source.name, f"its cells have no `{min(lacking)}`", AGAIN)
    nodes, ends, types = (_integer_array(source, items[w]) for w in ("connectivity", "offsets", "types"))
    starts = np.concatenate([[0], ends[:-1]])
    sizes = ends - starts
    if (types < 0).any() or (types > 255).any():
        raise Unreadable(source.name, f"its cells have types up to {types.max()}, but VTK has 255", AGAIN)
    if len(ends) != m or len(types) != m or (sizes < 0).any() or ends[-1] != len(nodes):
        reason = (
            f"it announces {m} cells, but has {len(types)} types, {len(ends)} offsets and {len(nodes)} "
            "connectivity entries"
        )
        raise Unreadable(source.name, reason, AGAIN)
    found = []
    every = 256 * sizes + types
    for size, kind in (divmod(code, 256) for code in np.unique(every).tolist()):
        rows = starts[every == 256 * size + kind]
        number = LAGRANGE.get((kind, size), kind)
        word = CELLS.get(number, f"of VTK type {number}")
        found.append((word, nodes[rows[:, None] + np.arange(size)]))
    return found


def _integer_array(source: VtuArrays, item: ElementT) -> Ints:
    """Return an array of integers. Raises Unreadable."""
    found = source.array(item)
    if found.dtype.kind not in "iu" or (found.size and int(found.max()) >= 2**62):
        raise Unreadable(source.name, f"`{item.get('Name')}` of its cells are not point numbers", AGAIN)
    return found.astype(np.int64)


@dataclass(frozen=True)
class VtuArrays:
    """Data arrays of a VTU file, and their encoding."""

    name: str
    order: Literal["<", ">"]  # byte order
    header: str  # type of the sizes of blocks
    packed: str | None
    raw: bool
    appended: bytes
    ends: dict[int, int]  # end of each appended array, by its start
    room: list[int]  # bytes that blocks may still unpack to, however often they are named

    def count(self, piece: ElementT, word: str) -> int:
        """Return the number that the attribute `word` of a piece declares. Raises Unreadable."""
        told = piece.get(word, "")
        if not re.fullmatch(r"\d{1,10}", told):
            raise Unreadable(self.name, f"{word} is `{told[:40]}`", AGAIN)
        return int(told)

    def rows(self, item: ElementT, n: int, k: int | None = None) -> Array:
        """Return the values of an array at all n points, as (n, k). Raises Unreadable."""
        found, word = self.array(item), item.get("Name") or "Points"
        width = item.get("NumberOfComponents") or str(k or 1)
        if not re.fullmatch(r"\d{1,4}", width) or found.size != n * int(width) or (k or int(width)) != int(width):
            reason = f"`{word}` has {found.size} numbers, but {n} points of {width or 1} each are announced"
            raise Unreadable(self.name, reason, AGAIN)
        return found.reshape(n, int(width))

    def array(self, item: ElementT) -> Array:
        """Return all values of an array. Raises Unreadable."""
        word, form = item.get("Name") or "Points", item.get("format", "ascii")
        kind = TYPES.get(item.get("type", ""))
        if kind is None:
            raise Unreadable(self.name, f"`{word}` has the type `{item.get('type')}`", "write numbers")
        try:
            if form == "ascii":
                return numbers(item.text or "", kind)
            data = self._appended(item) if form == "appended" else _decode_base64((item.text or "").encode())
            return np.frombuffer(self._decode_bytes(data), dtype=np.dtype(kind).newbyteorder(self.order))
        except (ValueError, IndexError, EOFError, zlib.error, lzma.LZMAError, binascii.Error, OverflowError) as error:
            raise Unreadable(self.name, f"`{word}` cannot be decoded ({str(error)[:100]})", AGAIN) from None

    def _appended(self, item: ElementT) -> bytes:
        """Return the bytes of an array in the appended data."""
        start = int(item.get("offset", ""))
        if not 0 <= start < len(self.appended):
            raise ValueError(f"it starts at byte {start} of {len(self.appended)}")
        data = self.appended[start : self.ends[start]]
        return data if self.raw else _decode_base64(data)

    def _decode_bytes(self, data: bytes) -> bytes:
        """Return the decoded bytes of an array.

        The data are a size followed by bytes or, if compressed, sizes of blocks before and after compression and the
        blocks.
        """
        wide = np.dtype(self.header).itemsize

        def sizes(start: int, count: int) -> list[int]:
            if (start + count) * wide > len(data):
                raise ValueError("the block sizes are incomplete")
            kind = np.dtype(self.header).newbyteorder(self.order)
            return list(np.frombuffer(data, kind, count, start * wide).tolist())

        if self.packed is None:
            (promised,) = sizes(0, 1)
            return _check_byte_count(data[wide : wide + promised], promised)
        (count,) = sizes(0, 1)
        if not count:
            return b""
        size, last = sizes(1, 2)
        lengths, at = sizes(3, count), wide * (3 + count)
        self.room[0] -= (count - 1) * size + (last or size)
        if self.room[0] < 0:
            raise ValueError("its blocks expand to more than their size allows")
        parts = []
        for i, length in enumerate(lengths):
            promised = last if last and i == count - 1 else size
            parts.append(_check_byte_count(_unpack_block(self.packed, data[at : at + length], promised), promised))
            at += length
        return b"".join(parts)


def _source(name: str, top: ElementT, appended: tuple[bytes, bytes] | None, room: int) -> VtuArrays:
    """Return the encoding of a file's arrays, which may unpack to `room` bytes in total. Raises Unreadable."""
    packer, header = top.get("compressor"), top.get("header_type", "UInt32")
    if packer is not None and packer not in COMPRESSED:
        remedy = f"write it without compression, or compressed by {' or '.join(COMPRESSED.values())}"
        raise Unreadable(name, f"its numbers are compressed by `{packer[:60]}`, which is not supported", remedy)
    if header not in HEADERS:
        raise Unreadable(name, f"its header_type is `{header[:40]}`, not one of {', '.join(HEADERS)}", AGAIN)
    order: Literal["<", ">"] = ">" if top.get("byte_order") == "BigEndian" else "<"
    tag, data = appended or (b"", b"_")
    raw = b'"raw"' in tag or b"'raw'" in tag
    data = data.partition(b"_")[2] if raw else data.partition(b"<")[0].partition(b"_")[2]
    starts = {
        int(w) for item in top.iter("DataArray") if re.fullmatch(r"\d{1,12}", w := item.get("offset", "").strip())
    }
    ends = dict(pairwise([*sorted(starts), len(data)]))
    return VtuArrays(name, order, HEADERS[header], COMPRESSED.get(packer or ""), raw, data, ends, [room])


def _decode_base64(data: bytes) -> bytes:
    """Return bytes decoded from base64, in which the header may be padded separately."""
    parts = re.findall(rb"[^=]+={0,2}", b"".join(data.split()))
    return b"".join(base64.b64decode(part, validate=True) for part in parts)


def _unpack_block(packed: str, data: bytes, promised: int) -> bytes:
    """Return an unpacked block, limited to its declared size plus one byte, because small data may expand greatly."""
    if packed == "zlib":
        return zlib.decompressobj().decompress(data, promised + 1)
    return lzma.LZMADecompressor().decompress(data, promised + 1)


def _check_byte_count(found: bytes, promised: Any) -> bytes:
    """Return bytes whose number is as declared. Raises Unreadable if it differs."""
    if len(found) != promised:
        raise ValueError(f"{promised} bytes are announced, but there are {len(found)} or more")
    return found
