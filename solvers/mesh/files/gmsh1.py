"""Reader of Gmsh's file format 1 ($NOD and $ELM), which programs wrote until 2004, and some long after."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from softmark.records import dataclass
from softmark.safe_files import open_regular, read_regular
from softmark.solvers.mesh.mesh import Floats, Ints

# Gmsh's number of a type of cell -> meshio's word and the number of nodes
TYPES = {1: ("line", 2), 2: ("triangle", 3), 3: ("quad", 4), 4: ("tetra", 4), 5: ("hexahedron", 8)}
TYPES |= {6: ("wedge", 6), 7: ("pyramid", 5), 15: ("vertex", 1)}


class MalformedGmsh(Exception):
    """The file is incomplete or has content that is not part of the format."""


@dataclass(frozen=True)
class Block:
    """Cells of one type, in the layout of meshio."""

    type: str
    data: Ints


@dataclass(frozen=True)
class File:
    """Contents of a file, in the layout of meshio."""

    points: Floats  # (n, 3)
    cells: list[Block]


def is_format_1(path: Path) -> bool:
    """Return whether a file begins as format 1 does."""
    with open_regular(path) as file:
        return file.read(256).lstrip().startswith(b"$NOD")


def read(path: Path) -> File:
    """Return points and cells, numbered from zero. Raises Malformed."""
    try:
        words = read_regular(path).decode("ascii").split()
        points, number, at = _points(words)
        return File(points, _cells(words[at:], number))
    except (ValueError, IndexError, KeyError) as error:
        raise MalformedGmsh(str(error) or type(error).__name__) from error


def _points(words: list[str]) -> tuple[Floats, dict[int, int], int]:
    """Return points (n, 3), their indices by the numbers of the file, and the number of words read."""
    count = int(words[1])
    if not 0 <= count <= len(words) // 4:
        raise MalformedGmsh(f"it announces {count} points, but the file ends earlier")
    table = np.array(words[2 : 2 + 4 * count], dtype=np.float64).reshape(count, 4)
    number = {int(n): i for i, n in enumerate(table[:, 0])}
    end = 2 + 4 * count
    if words[end : end + 2] != ["$ENDNOD", "$ELM"]:
        raise MalformedGmsh("no $ENDNOD and $ELM after its points")
    return table[:, 1:].copy(), number, end + 2


def _cells(words: list[str], number: dict[int, int]) -> list[Block]:
    """Return the cells of lines `number type region region count node ...`, grouped by type."""
    found: dict[str, list[list[int]]] = {}
    at = 1
    for _ in range(int(words[0])):
        kind, nodes = TYPES[int(words[at + 1])]
        if int(words[at + 4]) != nodes:
            raise MalformedGmsh(f"a {kind} of {words[at + 4]} nodes")
        missing = [w for w in words[at + 5 : at + 5 + nodes] if int(w) not in number]
        if missing:
            raise MalformedGmsh(f"cell {words[at]} refers to node {missing[0]}, which does not exist")
        found.setdefault(kind, []).append([number[int(w)] for w in words[at + 5 : at + 5 + nodes]])
        at += 5 + nodes
    if words[at] != "$ENDELM":
        raise MalformedGmsh("no $ENDELM after its cells")
    return [Block(kind, np.array(rows, dtype=np.int64)) for kind, rows in found.items()]
