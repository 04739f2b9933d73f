"""Export of a mesh as Gmsh 4.1 (ASCII, in m): materials as physical volumes, supports and loads as physical groups.

Facets that several supports and loads share form a separate entity, which belongs to all their groups. A support that
holds no whole facet, but for example an edge or a point, is a group of points.
Source: Geuzaine and Remacle, "Gmsh Reference Manual", MSH file format, version 4.1.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.models.external.exporters.named_parts import NamedParts
    from softmark.interpreter.models.external.external_problem import Floats, Ints, Problem

FILE = "mesh.msh"

# its number of each kind of cell by dimension and nodes, and which of our nodes (VTK's order) come in its own order
_EDGES = [8, 11, 16, 9, 17, 10, 18, 19, 12, 15, 13, 14]
KINDS: dict[tuple[int, int], tuple[int, Sequence[int]]] = {
    (0, 1): (15, range(1)),
    (2, 3): (2, range(3)),
    (2, 4): (3, range(4)),
    (2, 6): (9, range(6)),
    (2, 8): (16, range(8)),
    (2, 9): (10, range(9)),
    (3, 4): (4, range(4)),
    (3, 10): (11, [*range(8), 9, 8]),
    (3, 8): (5, range(8)),
    (3, 20): (17, [*range(8), *_EDGES]),
    (3, 27): (12, [*range(8), *_EDGES, 24, 22, 20, 21, 23, 25, 26]),
}


@dataclass(frozen=True)
class Entity:
    """Cells (k, a) of one dimension that belong to the same physical groups; `groups` are the tags of these."""

    dimension: int
    cells: Ints
    groups: tuple[int, ...]


def refuses(problem: Problem) -> list[tuple[str, str]]:
    """Return an error if the element of the mesh has no Gmsh type in this exporter."""
    if (3, problem.cells.shape[1]) in KINDS:
        return []
    return [(problem.element, "the mesh is a slice of a plane body and has no solid cells")]


def export(problem: Problem, named: NamedParts, folder: Path) -> list[str]:
    """Write the mesh with its physical groups. Return the file names."""
    groups: dict[tuple[int, str], int] = {}

    def group(dimension: int, name: str) -> int:
        """Return the tag of a physical group, which is created on first use."""
        return groups.setdefault((dimension, name), len(groups) + 1)

    entities = [Entity(3, problem.cells[cells], (group(3, name),)) for name, cells in named.parts.items()]
    faces = {name: facets for name, facets in named.facets.items() if len(facets)}
    entities += _split_by_groups(2, {group(2, name): facets for name, facets in faces.items()})
    points = {group(0, name): nodes[:, None] for name, nodes in named.supports.items() if name not in faces}
    entities += _split_by_groups(0, points)
    (folder / FILE).write_text("\n".join([*_file(problem.points, entities, groups), ""]), encoding="utf-8")
    return [FILE]


def _split_by_groups(dimension: int, groups: dict[int, Ints]) -> list[Entity]:
    """Return entities of cells that belong to the same set of groups; each cell is in one entity."""
    owners: dict[tuple[int, ...], tuple[Ints, list[int]]] = {}
    for number, cells in groups.items():
        for cell in cells:
            owners.setdefault(tuple(sorted(cell.tolist())), (cell, []))[1].append(number)
    together: dict[tuple[int, ...], list[Ints]] = {}
    for cell, numbers in owners.values():
        together.setdefault(tuple(numbers), []).append(cell)
    return [Entity(dimension, np.array(cells), numbers) for numbers, cells in together.items()]


def _file(points: Floats, entities: list[Entity], groups: dict[tuple[int, str], int]) -> Iterator[str]:
    """Yield the lines of the Gmsh mesh file."""
    yield from ("$MeshFormat", "4.1 0 8", "$EndMeshFormat", "$PhysicalNames", str(len(groups)))
    yield from (f'{dimension} {number} "{name}"' for (dimension, name), number in groups.items())
    yield from ("$EndPhysicalNames", "$Entities")
    yield " ".join(str(sum(e.dimension == d for e in entities)) for d in range(4))
    for d in range(4):
        for tag, own in enumerate((e for e in entities if e.dimension == d), start=1):
            yield _entity(points, own, tag)
    yield from ("$EndEntities", "$Nodes", f"1 {len(points)} 1 {len(points)}", f"3 1 0 {len(points)}")
    yield from map(str, range(1, len(points) + 1))
    yield from (" ".join(map(repr, p)) for p in points.tolist())
    total = sum(len(e.cells) for e in entities)
    yield from ("$EndNodes", "$Elements", f"{len(entities)} {total} 1 {total}")
    number = count(1)
    for d in range(4):
        for tag, own in enumerate((e for e in entities if e.dimension == d), start=1):
            kind, order = KINDS[d, own.cells.shape[1]]
            yield f"{d} {tag} {kind} {len(own.cells)}"
            for cell in (own.cells[:, list(order)] + 1).tolist():
                yield " ".join(map(str, (next(number), *cell)))
    yield "$EndElements"


def _entity(points: Floats, own: Entity, tag: int) -> str:
    """Return the line of an entity: its bounding box and its groups, without bounding entities."""
    X = points[np.unique(own.cells)]
    box = X[0].tolist() if own.dimension == 0 else [*X.min(axis=0).tolist(), *X.max(axis=0).tolist()]
    words = [tag, *map(repr, box), len(own.groups), *own.groups]
    return " ".join(map(str, words if own.dimension == 0 else [*words, 0]))
