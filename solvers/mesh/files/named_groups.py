"""Named groups of a mesh file: physical groups of Gmsh, sets of Abaqus and CalculiX, integer arrays on cells.

A name that contains both cells and faces becomes two groups, NAME and `NAME:faces`. Integer arrays on cells, as in VTU,
become groups `ARRAY=VALUE`; an array of ones and zeros also becomes a group with its own name. Physical groups without
a name are called by their number.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.records import dataclass
from softmark.solvers.elements.element import Element
from softmark.solvers.mesh.mesh import Ints
from softmark.solvers.mesh.mesh_group import Group
from softmark.solvers.mesh.mesh_groups import find_faces_by_corners

if TYPE_CHECKING:
    from softmark.solvers.mesh.files.abaqus.deck_groups import Members

CORNERS = {"triangle": 3, "triangle6": 3, "quad": 4, "quad8": 4, "quad9": 4, "triangle7": 3}
VALUES = 1000  # largest number of distinct values of a group array; more are a result field
PHYSICAL = "gmsh:physical"
FACES, EDGES = ":faces", ":edges"


@dataclass(frozen=True)
class NamedMembers:
    """Members of one named group: numbers of solid cells (k,), and corners of facets (f, c) for each type of facet."""

    cells: Ints
    facets: tuple[Ints, ...]


def read_groups(data: Any, path: Path, kind: str, cells: Ints, element: type[Element]) -> dict[str, Group]:
    """Return the named groups of a parsed file. Raises UnreadableMesh.

    `cells` (m, a) are the solid cells of meshio's type `kind`, with the node numbers of the file.
    """
    if path.suffix.lower() == ".inp":
        from softmark.solvers.mesh.files.abaqus.deck_groups import DeckGroups

        return _groups_from_deck_sets(DeckGroups(data.deck, kind, cells, element).members_by_name(), cells, element)
    found: dict[str, Group] = {}
    for name, which in group_masks(data):
        own = _members_from_masks(data, which, kind)
        if len(own.cells) or not own.facets:
            found[name] = Group("cells", own.cells)
        if own.facets:
            found[name + FACES if len(own.cells) else name] = _group_of_cell_faces(own.facets, cells, element)
    return found


def _groups_from_deck_sets(sets: Mapping[str, Members], cells: Ints, element: type[Element]) -> dict[str, Group]:
    found = {}
    for name, own in sets.items():
        if own.nodes is not None:
            found[name] = Group("nodes", own.nodes, 0, own.foreign)
            continue
        faces = len(own.faces) or own.corners or own.foreign
        if len(own.cells) or not faces:
            found[name] = Group("cells", own.cells)
        if faces:
            more = _group_of_cell_faces(own.corners, cells, element)
            members = np.unique(np.concatenate([own.faces, more.members]), axis=0)
            found[name + FACES if len(own.cells) else name] = Group("faces", members, 0, own.foreign + more.foreign)
    return found


def _group_of_cell_faces(facets: tuple[Ints, ...], cells: Ints, element: type[Element]) -> Group:
    """Return the group of cell faces that coincide with facets of a file; each face occurs once."""
    own = [find_faces_by_corners(cells, element, corners) for corners in facets]
    members = np.concatenate([faces for faces, _ in own]) if own else np.zeros((0, 2), dtype=np.int64)
    return Group("faces", members, foreign=sum(none for _, none in own))


def _members_from_masks(data: Any, masks: list[Any], kind: str) -> NamedMembers:
    cells, facets, before = [np.zeros(0, dtype=np.int64)], [], 0
    for block, mask in zip(data.cells, masks, strict=True):
        if block.type == kind:
            cells.append(before + np.flatnonzero(mask))
            before += len(block.data)
        elif block.type in CORNERS and mask.any():
            facets.append(block.data[mask][:, : CORNERS[block.type]].astype(np.int64))
    return NamedMembers(np.concatenate(cells), tuple(facets))


def group_masks(data: Any, dims: tuple[int, int] = (3, 2)) -> Iterator[tuple[str, list[Any]]]:
    """Yield the name of every group of a file, with a mask of its cells in each block of cells.

    `dims` are the dimensions of the cells and of their sides.
    """
    said = set()
    for name, sets in getattr(data, "cell_sets", {}).items():
        if not name.startswith("gmsh:"):
            said.add(name)
            yield name, [_membership_mask(len(b.data), own) for b, own in zip(data.cells, sets, strict=True)]
    arrays = getattr(data, "cell_data", {})
    for array, blocks in arrays.items():
        if array == PHYSICAL:
            layers = [own for word, own in arrays.items() if word == PHYSICAL or word.startswith(f"{PHYSICAL} ")]
            yield from ((n, m) for n, m in _physical_groups(data, layers, dims) if n not in said)
        elif not array.startswith("gmsh:") and array not in said:
            yield from _groups_of_array(array, blocks)


def _membership_mask(count: int, members: Any) -> Any:
    found = np.zeros(count, dtype=np.bool_)
    if members is not None and len(members):
        found[np.asarray(members, dtype=np.int64)] = True
    return found


def _physical_groups(data: Any, layers: list[list[Any]], of: tuple[int, int]) -> Iterator[tuple[str, list[Any]]]:
    """Yield Gmsh's physical groups by name, or by number if unnamed, with a mask of their cells in each block.

    A cell has one group in each of the `layers`. `of` are the dimensions of the cells and of their sides.
    """
    names = {(int(tag), int(dim)): name for name, (tag, dim) in getattr(data, "field_data", {}).items()}
    dims = [block.dim for block in data.cells]
    used = {(int(t), d) for blocks in layers for own, d in zip(blocks, dims, strict=True) for t in np.unique(own)
            if t and d in of}  # fmt: skip
    for tag, dim in sorted(used):
        each = zip(dims, *layers, strict=True)
        which = [np.any([np.asarray(one) == tag for one in own], axis=0) & (d == dim) for d, *own in each]
        twice = (tag, sum(of) - dim) in used and (tag, dim) not in names
        beside = FACES if dim == 2 else EDGES
        yield names.get((tag, dim), f"{tag}{beside}" if twice and dim == of[1] else str(tag)), which


def _groups_of_array(array: str, blocks: list[Any]) -> Iterator[tuple[str, list[Any]]]:
    """Yield one group for each value of an integer array, with a mask of its cells in each block.

    An array of ones and zeros also gives a group of the ones with the array's name.
    """
    known = [np.asarray(own) for own in blocks]
    if any(own.dtype.kind not in "iub" or own.ndim != 1 for own in known):
        return
    values = np.unique(np.concatenate(known))
    if len(values) > VALUES:
        return
    if set(values.tolist()) <= {0, 1}:
        yield array, [own == 1 for own in known]
    for value in values.tolist():
        yield f"{array}={int(value)}", [own == value for own in known]


def merge_repeated_cells(data: Any) -> Any:
    """Return a Gmsh 2.2 mesh without repeated cells; the file repeats a cell for each of its physical groups.

    Further groups of a cell are stored in arrays `gmsh:physical 2` and so on. A cell that occurs twice in one group
    stays repeated, because that is a flaw of the mesh.
    """
    groups = data.cell_data.get(PHYSICAL)
    if groups is None:
        return data
    kept = [np.ones(len(block.data), dtype=np.bool_) for block in data.cells]
    extra: list[list[tuple[int, int, int]]] = []  # by layer: block, row and group
    for kind in {block.type for block in data.cells}:
        blocks = [i for i, block in enumerate(data.cells) if block.type == kind]
        rows = np.concatenate([data.cells[i].data for i in blocks])
        tags = np.concatenate([np.asarray(groups[i]) for i in blocks])
        if not len(rows):
            continue
        _, first, same, counts = np.unique(rows, axis=0, return_index=True, return_inverse=True, return_counts=True)
        same = same.reshape(-1)
        if (counts == 1).all():
            continue
        at = np.array([(i, j) for i in blocks for j in range(len(data.cells[i].data))], dtype=np.int64)
        known: dict[int, list[int]] = {}
        for i in np.flatnonzero(counts[same] > 1).tolist():
            own, tag = known.setdefault(int(same[i]), []), int(tags[i])
            if tag in own:
                continue
            if own:
                while len(extra) < len(own):
                    extra.append([])
                block, row = at[first[same[i]]].tolist()
                extra[len(own) - 1].append((block, row, tag))
                kept[at[i, 0]][at[i, 1]] = False
            own.append(tag)
    if not extra:
        return data
    for n, layer in enumerate(extra, start=2):
        arrays = [np.zeros(len(block.data), dtype=np.int64) for block in data.cells]
        for block, row, tag in layer:
            arrays[block][row] = tag
        data.cell_data[f"{PHYSICAL} {n}"] = arrays
    data.cell_data = {
        w: [np.asarray(a)[k] for a, k in zip(own, kept, strict=True)] for w, own in data.cell_data.items()
    }
    data.cell_sets = {}
    for block, keep in zip(data.cells, kept, strict=True):
        block.data = block.data[keep]
    return data
