"""Writer of an imported mesh as a file next to its scene: nodes, cells, and named parts of cells and surface.

The format is Abaqus input, in which parts may overlap; numbers keep all their digits.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from softmark.interpreter.importers.imported_deck import Floats, Ints

TYPES = {"tet4": "C3D4", "tet10": "C3D10", "hex8": "C3D8", "hex20": "C3D20"}


def mesh_text(
    kind: str, points: Floats, cells: Ints, sets: Mapping[str, Ints], surfaces: Mapping[str, Ints],
    node_sets: Mapping[str, Ints],
) -> str:  # fmt: skip
    """Return the text of the mesh file, with named sets of cells (k,), of faces (f, 2) and of nodes (k,)."""
    return "\n".join([*_lines(kind, points, cells, sets, surfaces, node_sets), ""])


def _lines(
    kind: str, points: Floats, cells: Ints, sets: Mapping[str, Ints], surfaces: Mapping[str, Ints],
    node_sets: Mapping[str, Ints],
) -> Iterator[str]:  # fmt: skip
    yield "*NODE"
    for i, point in enumerate(points.tolist(), start=1):
        yield ", ".join([str(i), *map(repr, point)])
    yield f"*ELEMENT, TYPE={TYPES[kind]}"
    for i, cell in enumerate((cells + 1).tolist(), start=1):
        row = [str(i), *map(str, cell)]
        yield from ([", ".join(row)] if len(row) <= 16 else [", ".join(row[:16]) + ",", ", ".join(row[16:])])
    for name, own in sets.items():
        yield f"*ELSET, ELSET={name}"
        yield from (str(c + 1) for c in own.tolist())
    for name, faces in surfaces.items():
        yield f"*SURFACE, NAME={name}, TYPE=ELEMENT"
        yield from (f"{cell + 1}, S{side + 1}" for cell, side in faces.tolist())
    for name, nodes in node_sets.items():
        yield f"*NSET, NSET={name}"
        yield from (str(n + 1) for n in nodes.tolist())
