"""Repair of Gmsh 4.1 files that contain all elements (`Mesh.SaveAll`), including those in no physical group.

For each block of elements, meshio stores the physical groups only if there are any. It then fails because this list is
shorter than the list of blocks. The repair gives geometric entities without a group the group number 0, which means
none.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from pathlib import Path

from softmark.records import dataclass
from softmark.safe_files import open_regular

PLACE = {0: 3}  # count of an entity's coordinates by dimension: three of a point, else six of a box
BOX = 6
BEGIN, END = b"$Entities", b"$EndEntities"
MOST = 1 << 32  # largest count of any item: more means a broken file


@dataclass(frozen=True)
class Entity:
    """A geometric entity: its number `tag`, its coordinates, its physical groups, and the entities that bound it.

    `place` are the bytes of its coordinates in the file: those of a point, or of the corners of its bounding box.
    `bounds` is None for a point.
    """

    tag: int
    place: bytes
    groups: tuple[int, ...]
    bounds: tuple[int, ...] | None


Dims = list[list[Entity]]  # points, curves, surfaces, volumes


def repair(path: Path) -> bytes | None:
    """Return the content of a Gmsh file in a form that meshio can read; None if it needs no repair.

    Files of other formats and invalid files need none either.
    """
    with open_regular(path) as file:
        head = file.read(64).split()
        if head[:1] != [b"$MeshFormat"] or head[1:2] != [b"4.1"]:
            return None
        file.seek(0)
        data = file.read()
    start = data.find(BEGIN)
    if start < 0 or len(head) < 4:
        return None
    start = data.index(b"\n", start) + 1
    text, wide = head[2] == b"0", int(head[3])
    try:
        dims, end = _parse_text_entities(data, start) if text else _parse_binary_entities(data, start, wide)
    except (ValueError, IndexError, StopIteration, struct.error):
        return None  # meshio reports it
    grouped = {bool(own.groups) for entities in dims for own in entities}
    if len(grouped) < 2:
        return None
    return data[:start] + (_format_text_entities if text else _binary_entity_formatter(wide))(dims) + data[end:]


def _parse_text_entities(data: bytes, start: int) -> tuple[Dims, int]:
    """Parse the entities of a text file from the position `start`; return them and the end of their section."""
    end = data.index(END, start)
    words = iter(data[start:end].split())

    def whole() -> int:
        return int(next(words))

    def place(count: int) -> bytes:
        return b" ".join(next(words) for _ in range(count))

    return _parse_entities(whole, whole, place), end


def _parse_binary_entities(data: bytes, start: int, wide: int) -> tuple[Dims, int]:
    """Parse the entities of a binary file from the position `start`; return them and the end of their section.

    Counts are stored in `wide` bytes.
    """
    at = start

    def raw(count: int) -> bytes:
        nonlocal at
        at += count
        if at > len(data):
            raise IndexError("it is incomplete")
        return data[at - count : at]

    def whole() -> int:
        return int(struct.unpack("=i", raw(4))[0])

    def size() -> int:
        return int(struct.unpack("=Q" if wide == 8 else "=I", raw(wide))[0])

    dims = _parse_entities(whole, size, lambda count: raw(8 * count))
    return dims, at


def _parse_entities(whole: Callable[[], int], size: Callable[[], int], place: Callable[[int], bytes]) -> Dims:
    counts = [size() for _ in range(4)]
    if not 0 <= max(counts) < MOST:
        raise ValueError("the file declares more items than are possible")

    def several() -> tuple[int, ...]:
        return tuple(whole() for _ in range(size()))

    return [
        [
            Entity(whole(), place(PLACE.get(dim, BOX)), several(), several() if dim else None)
            for _ in range(count)
        ]
        for dim, count in enumerate(counts)
    ]  # fmt: skip


def _integer_lists(own: Entity) -> Iterator[tuple[int, ...]]:
    """Yield the integer lists of an entity: its physical groups, and the entities that bound it.

    An entity without physical groups gets the group number 0. A point has no list of bounding entities.
    """
    yield own.groups or (0,)
    if own.bounds is not None:
        yield own.bounds


def _format_text_entities(dims: Dims) -> bytes:
    lines = [" ".join(str(len(entities)) for entities in dims).encode()]
    for own in (own for entities in dims for own in entities):
        lists = (str(n).encode() for some in _integer_lists(own) for n in (len(some), *some))
        lines.append(b" ".join([str(own.tag).encode(), own.place, *lists]))
    return b"\n".join(lines) + b"\n"


def _binary_entity_formatter(wide: int) -> Callable[[Dims], bytes]:
    letter = "Q" if wide == 8 else "I"

    def written(dims: Dims) -> bytes:
        found = [struct.pack(f"=4{letter}", *map(len, dims))]
        for own in (own for entities in dims for own in entities):
            found += [struct.pack("=i", own.tag), own.place]
            found += [struct.pack(f"={letter}{len(some)}i", len(some), *some) for some in _integer_lists(own)]
        return b"".join(found)

    return written
