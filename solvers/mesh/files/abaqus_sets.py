"""Sets of an Abaqus or CalculiX file: ELSET, NSET and SURFACE, on lines of their own and of elements and nodes.

meshio reads the mesh and puts sets of elements into the wrong blocks where a block has no set, so they are read here.
A set of nodes stands for the boundary faces that have all corners in it; nodes that are of no such face count as
foreign.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import field
from pathlib import Path
from typing import Any

import numpy as np

from softmark.records import dataclass
from softmark.solvers.elements.element import Element
from softmark.solvers.mesh.files.flaws import UnreadableMesh
from softmark.solvers.mesh.groups import faces_of
from softmark.solvers.mesh.mesh import Ints, Mesh

# corners of the faces S1, S2, ... by the corners of a cell: Abaqus Analysis User's Guide, 28.1.4
SIDES = {
    4: ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)),
    8: ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)),
}
SHELLS = {"triangle": 3, "triangle6": 3, "quad": 4, "quad8": 4, "quad9": 4}


@dataclass(frozen=True)
class Members:
    """Cells (k,), faces (f, 2), corners of facets of other elements, and what is none of these."""

    cells: Ints
    faces: Ints
    corners: tuple[Ints, ...] = ()
    foreign: int = 0


@dataclass
class _File:
    """What lines of a file say: numbers of elements in their order by block, sets of them, of nodes, and of sides."""

    blocks: list[list[str]] = field(default_factory=list)
    owned: list[str] = field(default_factory=list)  # the set that an element's own line puts each block in, or ""
    nodes: list[int] = field(default_factory=list)
    elsets: dict[str, list[str]] = field(default_factory=dict)
    nsets: dict[str, list[str]] = field(default_factory=dict)
    surfaces: dict[str, list[tuple[str, str]]] = field(default_factory=dict)


def read(path: Path, data: Any, kind: str, cells: Ints, element: type[Element]) -> dict[str, Members]:
    """The sets of a file by name, of `cells` (m, a) of meshio's kind. Raises UnreadableMesh."""
    try:
        return _Sets(_parsed(path), data, kind, cells, element).all()
    except (ValueError, IndexError, KeyError, RecursionError) as error:
        raise UnreadableMesh(f"its sets cannot be read ({error})", remedy="write the file again") from error


def _parsed(path: Path) -> _File:
    found = _File()
    for words, rows in _sections(path):
        keyword, options = words[0].upper(), dict(_option(w) for w in words[1:])
        if keyword == "INCLUDE":
            raise UnreadableMesh("it includes another file, whose sets are not read", remedy="write one file")
        if keyword == "ELEMENT":
            found.blocks.append([w for row in rows for w in row])
            found.owned.append(options.get("ELSET", ""))
        elif keyword == "NODE":
            numbers = [row[0] for row in rows]
            found.nodes += map(int, numbers)
            if "NSET" in options:
                found.nsets.setdefault(options["NSET"], []).extend(numbers)
        elif keyword in ("ELSET", "NSET") and keyword in options:
            own = found.elsets if keyword == "ELSET" else found.nsets
            listed = own.setdefault(options[keyword], [])
            for row in rows:
                listed += _generated(row) if "GENERATE" in options else row
        elif keyword == "SURFACE" and "NAME" in options and options.get("TYPE", "ELEMENT").upper() == "ELEMENT":
            found.surfaces[options["NAME"]] = [(row[0], row[1].upper() if len(row) > 1 else "") for row in rows]
    return found


def _sections(path: Path) -> Iterator[tuple[list[str], list[list[str]]]]:
    """Words of every keyword line, and those of the lines below it."""
    words: list[str] = []
    rows: list[list[str]] = []
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        if line.startswith("**") or not line.strip():
            continue
        parts = [w.strip() for w in line.lstrip("*").split(",")]
        if line.startswith("*"):
            if words:
                yield words, rows
            words, rows = parts, []
        else:
            rows.append([w for w in parts if w])
    if words:
        yield words, rows


def _option(word: str) -> tuple[str, str]:
    name, _, value = word.partition("=")
    return name.strip().upper(), value.strip().strip('"')


def _generated(row: list[str]) -> list[str]:
    first, last, step = (*map(int, row), 1)[:3]
    return [str(n) for n in range(first, last + 1, step)]


def sides_of(element: type[Element]) -> list[int]:
    """Which of an element's facets S1, S2, ... are."""
    own = [frozenset(side[: element.facet.corners]) for side in element.facets]
    return [own.index(frozenset(side)) for side in SIDES[element.corners]]


@dataclass
class _Sets:
    """Sets of a file as members of its mesh."""

    file: _File
    data: Any
    kind: str
    cells: Ints
    element: type[Element]
    numbers: dict[int, tuple[int, int]] = field(default_factory=dict)  # of elements: the block, and the place in it

    def all(self) -> dict[str, Members]:
        """By name; a set of nodes gives way to one of elements of the same name."""
        for b, (words, block) in enumerate(zip(self.file.blocks, self.data.cells, strict=True)):
            ids = list(map(int, words))[:: block.data.shape[1] + 1]
            self.numbers.update((n, (b, i)) for i, n in enumerate(ids))
            if self.file.owned[b]:
                self.file.elsets.setdefault(self.file.owned[b], []).extend(map(str, ids))
        found = {name: self._surface(rows) for name, rows in self.file.surfaces.items()}
        found |= {name: self._elements(self._flat(self.file.elsets, name)) for name in self.file.elsets}
        for name in self.file.nsets:
            if name not in found:
                found[name] = self._nodes(self._flat(self.file.nsets, name))
        return found

    def _flat(self, sets: dict[str, list[str]], name: str) -> list[int]:
        """Numbers of a set, whose members may be other sets."""
        known = {n.upper(): n for n in sets}
        found: list[int] = []
        for word in sets[name]:
            found += [int(word)] if word.lstrip("-").isdigit() else self._flat(sets, known[word.upper()])
        return found

    def _solid(self, number: int) -> int | None:
        """The cell that an element is, if it is one."""
        b, i = self.numbers[number]
        if self.data.cells[b].type != self.kind:
            return None
        return i + sum(len(c.data) for c in self.data.cells[:b] if c.type == self.kind)

    def _elements(self, numbers: list[int]) -> Members:
        cells = sorted({c for c in map(self._solid, numbers) if c is not None})
        corners: dict[int, list[Any]] = {}
        foreign = 0
        for b, i in (self.numbers[n] for n in numbers):
            block = self.data.cells[b]
            if block.type in SHELLS:
                corners.setdefault(SHELLS[block.type], []).append(block.data[i][: SHELLS[block.type]])
            elif block.type != self.kind:
                foreign += 1
        facets = tuple(np.array(rows, dtype=np.int64) for rows in corners.values())
        return Members(np.array(cells, dtype=np.int64), np.zeros((0, 2), dtype=np.int64), facets, foreign)

    def _surface(self, rows: list[tuple[str, str]]) -> Members:
        table = {f"S{k}": side for k, side in enumerate(sides_of(self.element), start=1)}
        known = {n.upper(): n for n in self.file.elsets}
        faces, foreign = [], 0
        for word, side in rows:
            numbers = [int(word)] if word.isdigit() else self._flat(self.file.elsets, known[word.upper()])
            for cell in map(self._solid, numbers):
                if cell is None or side not in table:
                    foreign += 1
                else:
                    faces.append((cell, table[side]))
        members = np.array(sorted(set(faces)), dtype=np.int64).reshape(-1, 2)
        return Members(np.zeros(0, dtype=np.int64), members, foreign=foreign)

    def _nodes(self, numbers: list[int]) -> Members:
        """The boundary faces all of whose corners are in a set of nodes."""
        place = {n: i for i, n in enumerate(self.file.nodes)}
        chosen = np.zeros(len(self.data.points), dtype=np.bool_)
        chosen[[place[n] for n in numbers]] = True
        facets = Mesh(np.asarray(self.data.points), self.cells, self.element.name).facets
        corners = facets[:, : self.element.facet.corners]
        rows = facets[chosen[corners].all(axis=1)]
        chosen[rows] = False
        faces, _ = faces_of(self.cells, self.element, rows[:, : self.element.facet.corners])
        return Members(np.zeros(0, dtype=np.int64), faces, foreign=int(chosen.sum()))
