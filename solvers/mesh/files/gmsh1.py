"""Reader of Gmsh's file format 1 ($NOD and $ELM), which was common until 2004."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from softmark.records import dataclass
from softmark.safe_files import open_regular, read_regular
from softmark.solvers.mesh.mesh import Floats, Ints

# Gmsh's number of a type of cell -> meshio's cell name and the number of nodes
TYPES = {1: ("line", 2), 2: ("triangle", 3), 3: ("quad", 4), 4: ("tetra", 4), 5: ("hexahedron", 8)}
TYPES |= {6: ("wedge", 6), 7: ("pyramid", 5), 15: ("vertex", 1)}


class MalformedMeshFile(Exception):
    """Raised if a Gmsh or VTK file is incomplete or violates its format."""


@dataclass(frozen=True)
class Block:
    """Cells of one type, in meshio's data layout."""

    type: str
    data: Ints


@dataclass(frozen=True)
class File:
    """Contents of a Gmsh file, in meshio's data layout: points and blocks of cells."""

    points: Floats  # (n, 3)
    cells: list[Block]


def is_format_1(path: Path) -> bool:
    """Return whether a file begins like Gmsh's format 1."""
    with open_regular(path) as file:
        return file.read(256).lstrip().startswith(b"$NOD")


def read(path: Path) -> File:
    """Return the points and cells of a file, numbered from zero. Raises MalformedMeshFile."""
    try:
        words = read_regular(path).decode("ascii").split()
        points, number, at = _parse_points(words)
        return File(points, _parse_cells(words[at:], number))
    except (ValueError, IndexError, KeyError) as error:
        raise MalformedMeshFile(str(error) or type(error).__name__) from error


def _parse_points(words: list[str]) -> tuple[Floats, dict[int, int], int]:
    """Return the points (n, 3), their indices by their numbers in the file, and the number of words read."""
    count = int(words[1])
    if not 0 <= count <= len(words) // 4:
        raise MalformedMeshFile(f"it announces {count} points, but the file ends earlier")
    table = np.array(words[2 : 2 + 4 * count], dtype=np.float64).reshape(count, 4)
    number = {int(n): i for i, n in enumerate(table[:, 0])}
    end = 2 + 4 * count
    if words[end : end + 2] != ["$ENDNOD", "$ELM"]:
        raise MalformedMeshFile("no $ENDNOD and $ELM after its points")
    return table[:, 1:].copy(), number, end + 2


def _parse_cells(words: list[str], number: dict[int, int]) -> list[Block]:
    """Return the cells, grouped by type, from lines `number type region region count node ...`."""
    found: dict[str, list[list[int]]] = {}
    at = 1
    for _ in range(int(words[0])):
        kind, nodes = TYPES[int(words[at + 1])]
        if int(words[at + 4]) != nodes:
            raise MalformedMeshFile(f"a {kind} of {words[at + 4]} nodes")
        missing = [w for w in words[at + 5 : at + 5 + nodes] if int(w) not in number]
        if missing:
            raise MalformedMeshFile(f"cell {words[at]} refers to node {missing[0]}, which does not exist")
        found.setdefault(kind, []).append([number[int(w)] for w in words[at + 5 : at + 5 + nodes]])
        at += 5 + nodes
    if words[at] != "$ENDELM":
        raise MalformedMeshFile("no $ENDELM after its cells")
    return [Block(kind, np.array(rows, dtype=np.int64)) for kind, rows in found.items()]
