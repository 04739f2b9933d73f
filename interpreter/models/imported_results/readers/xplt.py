"""Reader of FEBio plot files, .xplt of FEBio 3 and 4 (versions 3.0 to 3.5), with nodal vectors of all states.

A file is a tree of chunks. Each chunk has a number for its type, its size in bytes, and its content; states may
be compressed by zlib, each separately. States that FEBio marks as not converged are skipped. No file written by
FEBio was available for tests.

Source: FEBio's own readers, XPLTLib of FEBio Studio, and FEBio User's Manual, "Plot file format".
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from softmark.interpreter.models.imported_results.readers.result_frames import (
    AGAIN,
    Block,
    ResultState,
    checked_state,
    combine_states,
    state_on_mesh,
)
from softmark.interpreter.models.imported_results.result_file import Floats, Ints, ResultFile
from softmark.records import dataclass
from softmark.references.measured_data import Unreadable
from softmark.resource_limits import FACTOR, FLOOR, limited_resources
from softmark.safe_files import read_regular

TAG = 0x00464542  # FEB
VERSIONS = range(0x30, 0x36)
VTK = "open it in FEBio Studio and export VTK; its points are deformed positions"
WINDOW = 1 << 10  # bytes of packed data that are read first

ROOT, HEADER, VERSION, PACKED = 0x01000000, 0x01010000, 0x01010001, 0x01010004
NODAL, ITEM, ITEM_TYPE, ITEM_NAME = 0x01023000, 0x01020001, 0x01020002, 0x01020004
DICTIONARY, MESH = 0x01020000, 0x01040000
NODES, NODE_HEADER, NODE_SIZE, NODE_DIM, COORDS = 0x01041000, 0x01041100, 0x01041101, 0x01041102, 0x01041200
DOMAINS, DOMAIN, DOMAIN_HEADER, CELL_TYPE = 0x01042000, 0x01042100, 0x01042101, 0x01042102
CELL_COUNT, CELL_LIST, CELL = 0x01032104, 0x01042200, 0x01042201
STATE, STATE_HEADER, TIME, STATUS = 0x02000000, 0x02010000, 0x02010002, 0x02010003
STATE_DATA, NODE_DATA, VARIABLE, VARIABLE_ID, VARIABLE_DATA = 0x02020000, 0x02020300, 0x02020001, 0x02020002, 0x02020003
VECTOR = 1  # type of a variable with three numbers

# FEBio's number of a type of cell -> meshio's word, and its nodes; its hex27 has another order of faces than VTK's
TYPES = {0: ("hexahedron", 8), 1: ("wedge", 6), 2: ("tetra", 4), 3: ("quad", 4), 4: ("triangle", 3), 5: ("line", 2),
         6: ("hexahedron20", 20), 7: ("tetra10", 10), 8: ("FEBio's tet15", 15), 9: ("FEBio's hex27", 27),
         10: ("triangle6", 6), 11: ("quad8", 8), 12: ("quad9", 9), 13: ("wedge15", 15), 14: ("FEBio's tet20", 20),
         15: ("FEBio's tri10", 10), 16: ("pyramid", 5), 17: ("FEBio's tet5", 5), 18: ("pyramid13", 13),
         19: ("line3", 3)}  # fmt: skip


@dataclass(frozen=True)
class Chunk:
    """Chunk of a FEBio plot file: its bytes, and their byte order."""

    name: str  # of the file
    order: str  # of bytes: < or >
    data: memoryview

    def parts(self) -> Iterator[tuple[int, Chunk]]:
        """Yield the chunks within this chunk, with their types. Raises Unreadable."""
        at, size = 0, len(self.data)
        while at < size:
            if at + 8 > size:
                raise Unreadable(self.name, f"a chunk ends after {size - at} bytes", AGAIN)
            what, long = np.frombuffer(self.data[at : at + 8], f"{self.order}u4").tolist()
            at += 8
            if at + long > size:
                raise Unreadable(self.name, f"a chunk announces {long} bytes, but there are {size - at}", AGAIN)
            yield what, Chunk(self.name, self.order, self.data[at : at + long])
            at += long

    def all(self, *path: int) -> list[Chunk]:
        """Return the chunks at the end of a path of chunk types."""
        found = [self]
        for step in path:
            found = [part for each in found for what, part in each.parts() if what == step]
        return found

    def single_chunk_at(self, *path: int) -> Chunk:
        """Return the single chunk at the end of a path of chunk types. Raises Unreadable."""
        found = self.all(*path)
        if len(found) != 1:
            raise Unreadable(self.name, f"it has {len(found)} chunks {path[-1]:#010x}, but one is expected", AGAIN)
        return found[0]

    def numbers(self, kind: str) -> NDArray[np.generic]:
        """Return the content as numbers of the type `kind`. Raises Unreadable."""
        if len(self.data) % 4:
            raise Unreadable(self.name, f"a chunk of numbers has {len(self.data)} bytes", AGAIN)
        return np.frombuffer(self.data, f"{self.order}{kind}4")

    def number(self, *path: int) -> int:
        """Return the single integer at the end of a path of chunk types. Raises Unreadable."""
        found = self.single_chunk_at(*path).numbers("i")
        if found.size != 1:
            raise Unreadable(self.name, f"chunk {path[-1]:#010x} contains {found.size} numbers, not one", AGAIN)
        return int(found[0])


def read(file: Path) -> ResultFile:
    """Return the nodes, cells and nodal vectors of a FEBio file in all states that converged. Raises Unreadable."""
    with limited_resources(file):
        data = memoryview(read_regular(file))
        order = {TAG.to_bytes(4, "little"): "<", TAG.to_bytes(4, "big"): ">"}.get(bytes(data[:4]))
        if order is None:
            raise Unreadable(file.name, "it does not begin like an FEBio plot file", AGAIN)
        whole = Chunk(file.name, order, data[4:])
        root, mesh, states = _root_mesh_and_rest(whole)
        version = root.number(HEADER, VERSION)
        if version not in VERSIONS:
            raise Unreadable(file.name, f"it has version {version:#x}, but only 0x30 to 0x35 can be read", VTK)
        ids, X = _nodes(mesh)
        blocks = [_cells(domain) for domain in mesh.all(DOMAINS, DOMAIN)]
        names = [_variable_name_and_type(item) for item in root.all(DICTIONARY, NODAL, ITEM)]
        packed = any(each.numbers("i").any() for each in root.all(HEADER, PACKED))
        return combine_states(file.name, _converged_states(whole, states, packed, names, X, blocks), ids)


def _root_mesh_and_rest(whole: Chunk) -> tuple[Chunk, Chunk, memoryview]:
    """Return the root chunk, the mesh chunk, and the remaining bytes of the file. Raises Unreadable."""
    at, found = 0, []
    for expected in (ROOT, MESH):
        what, size = (*np.frombuffer(whole.data[at : at + 8], f"{whole.order}u4").tolist(), 0, 0)[:2]
        part = whole.data[at + 8 : at + 8 + size]
        if what != expected or len(part) < size:
            raise Unreadable(whole.name, f"chunk {expected:#010x} is in the wrong place, or incomplete", AGAIN)
        found.append(Chunk(whole.name, whole.order, part))
        at += 8 + size
    return found[0], found[1], whole.data[at:]


def _nodes(mesh: Chunk) -> tuple[Ints | None, Floats]:
    """Return node numbers (n,), which files have from version 3.3 on, and positions (n, 3). Raises Unreadable."""
    section = mesh.single_chunk_at(NODES)
    n, dim = section.number(NODE_HEADER, NODE_SIZE), section.number(NODE_HEADER, NODE_DIM)
    coordinates = section.single_chunk_at(COORDS)
    X = coordinates.numbers("f")
    if dim != 3 or n < 1 or X.size not in (3 * n, 4 * n):
        reason = f"it announces {n} nodes with {dim} coordinates, but has {X.size} numbers"
        raise Unreadable(mesh.name, reason, AGAIN)
    if X.size == 3 * n:
        return None, X.reshape(n, 3).astype(np.float64)
    ids = coordinates.numbers("i").reshape(n, 4)[:, 0].astype(np.int64)
    return ids, X.reshape(n, 4)[:, 1:].astype(np.float64)


def _cells(domain: Chunk) -> Block:
    """Return the cells of a domain as node indices, without the cell numbers. Raises Unreadable."""
    kind, m = domain.number(DOMAIN_HEADER, CELL_TYPE), domain.number(DOMAIN_HEADER, CELL_COUNT)
    if kind not in TYPES:
        raise Unreadable(domain.name, f"its cells have an unknown type {kind}", VTK)
    word, nodes = TYPES[kind]
    table, wide = (
        domain.single_chunk_at(CELL_LIST).numbers("i"),
        nodes + 3,
    )  # what it is, its size, its number, its nodes
    if m < 0 or table.size != m * wide:
        raise Unreadable(domain.name, f"it announces {m} cells of {nodes} nodes, but has {table.size} numbers", AGAIN)
    table = table.reshape(m, wide)
    if (table[:, :2] != (CELL, 4 * (nodes + 1))).any():
        raise Unreadable(domain.name, f"a list of cells of {nodes} nodes contains something else", AGAIN)
    return word, table[:, 3:].astype(np.int64)


def _variable_name_and_type(item: Chunk) -> tuple[str, int]:
    """Return the name and the type of a variable. Raises Unreadable."""
    word = bytes(item.single_chunk_at(ITEM_NAME).data).partition(b"\0")[0].decode("utf-8", "replace")
    return word.partition("=")[2] or word, item.number(ITEM_TYPE)


def _converged_states(whole: Chunk, rest: memoryview, packed: bool, names: list[tuple[str, int]],
             X: Floats, blocks: list[Block]) -> list[ResultState]:  # fmt: skip
    """Return the states that FEBio marks as converged. Raises Unreadable."""
    mesh, found, left = checked_state(whole.name, X, blocks, {}), list[ResultState](), list[str]()
    for what, state in _unpack_streams(whole, rest) if packed else Chunk(whole.name, whole.order, rest).parts():
        if what == MESH:
            raise Unreadable(whole.name, "its mesh changes between states", "write the states of one mesh")
        if what != STATE:
            raise Unreadable(whole.name, f"unexpected chunk {what:#010x} between its states", AGAIN)
        times = state.single_chunk_at(STATE_HEADER, TIME).numbers("f")
        if times.size != 1:
            raise Unreadable(whole.name, f"a state has {times.size} times", AGAIN)
        if any(status.numbers("i").any() for status in state.all(STATE_HEADER, STATUS)):
            left.append(f"the state at {times[0]:g}, which did not converge")
            continue
        found.append(state_on_mesh(whole.name, mesh, dict(_nodal_variables(state, names, len(X))), float(times[0])))
    if not found:
        raise Unreadable(whole.name, f"none of its {len(left)} states converged", "find the cause in the log of FEBio")
    return [replace(found[0], left=tuple(left)), *found[1:]]


def _unpack_streams(whole: Chunk, rest: memoryview) -> Iterator[tuple[int, Chunk]]:
    """Yield the chunks of a file in which each chunk is a zlib stream. Raises Unreadable.

    Streams are read in growing windows, so that many short streams cost no more than their bytes. The unpacked
    total is limited to the memory of a reader.
    """
    at, room = 0, FLOOR + FACTOR * len(rest)
    while at < len(rest):
        opener, parts, window = zlib.decompressobj(), [], WINDOW
        while not opener.eof:
            piece = rest[at : at + window]
            if not piece:
                raise Unreadable(whole.name, "its last state is incomplete", AGAIN)
            try:
                parts.append(opener.decompress(piece, room + 1))
            except zlib.error as error:
                raise Unreadable(whole.name, f"a state cannot be decompressed ({error})", AGAIN) from None
            room -= len(parts[-1])
            if room < 0:
                raise Unreadable(whole.name, "its states expand to more than their size allows", AGAIN)
            at, window = at + len(piece) - len(opener.unconsumed_tail), 2 * window
        at -= len(opener.unused_data)
        yield from Chunk(whole.name, whole.order, memoryview(b"".join(parts))).parts()


def _nodal_variables(state: Chunk, names: list[tuple[str, int]], n: int) -> Iterator[tuple[str, Floats]]:
    """Yield the nodal vectors (n, 3) and scalars (n,) of a state, by name. Raises Unreadable."""
    for variable in state.all(STATE_DATA, NODE_DATA, VARIABLE):
        at = variable.number(VARIABLE_ID)
        if not 1 <= at <= len(names):
            raise Unreadable(state.name, f"a state refers to variable {at}, but there are {len(names)}", AGAIN)
        word, kind = names[at - 1]
        parts = [part.numbers("f") for _, part in variable.single_chunk_at(VARIABLE_DATA).parts()]
        values = np.concatenate(parts) if parts else np.empty(0, "f4")
        if values.size % n or (kind == VECTOR and values.size != 3 * n):
            raise Unreadable(state.name, f"`{word}` has {values.size} numbers for {n} nodes", AGAIN)
        if values.size:
            yield word, values.reshape(n, -1).astype(np.float64)
