"""Nodes, elements, sets and surfaces of one scope of a deck: a part, an instance or the assembly.

A set is a list of entries, which refer to numbers, ranges of numbers and other sets. Ranges are never expanded; the
numbers that the deck defines are compared with their ends.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from softmark.records import dataclass
from softmark.solvers.mesh.files.abaqus.element_types import COUNTS, meshio_cell_name
from softmark.solvers.mesh.files.abaqus.keyword_lines import SHORTEST, Card, UnsupportedDeck, read_integer, read_number

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]
Kind = Literal["nodes", "elements"]
MOST = 2**62  # largest supported integer
SET_OPTIONS = frozenset({"NSET", "ELSET", "GENERATE", "INSTANCE", "INTERNAL", "UNSORTED"})
NODE_OPTIONS = frozenset({"NSET"})
ELEMENT_OPTIONS = frozenset({"TYPE", "ELSET", "OFFSET"})


@dataclass(frozen=True)
class Entry:
    """One entry of a set: numbers, a range, the name of another set, or (in a node set) the nodes of elements.

    `instance` is the instance to which the numbers and names belong; "" for the scope of the set itself.
    """

    card: Card
    instance: str = ""
    numbers: Ints | None = None
    range: tuple[int, int, int] | None = None  # first, last, step
    name: str = ""
    of_elements: bool = False


@dataclass
class SetDefinition:
    """A set of nodes or of elements, merged from all cards that define it."""

    name: str
    internal: bool
    entries: list[Entry] = field(default_factory=list)


@dataclass(frozen=True)
class Surface:
    """A surface of elements: rows with an element set or number, and the label of a side (S1, S2, ...)."""

    name: str
    card: Card
    rows: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class ElementBlock:
    """Elements of one type: their numbers (m,) and their node numbers (m, a).

    Node numbers are stored for solids, shells and lines only.
    """

    kind: str
    card: Card
    numbers: Ints
    nodes: Ints | None


@dataclass
class Scope:
    """All definitions of one part, one instance or the assembly, by the numbers and names used there."""

    kind: Literal["assembly", "part", "instance"]
    name: str
    node_numbers: list[Ints] = field(default_factory=list)
    coordinates: list[Floats] = field(default_factory=list)
    blocks: list[ElementBlock] = field(default_factory=list)
    nodes: dict[str, SetDefinition] = field(default_factory=dict)
    elements: dict[str, SetDefinition] = field(default_factory=dict)
    surfaces: dict[str, Surface] = field(default_factory=dict)

    def sets(self, kind: Kind) -> dict[str, SetDefinition]:
        """Return the sets of nodes or of elements (`kind`) by their upper-case names."""
        return self.nodes if kind == "nodes" else self.elements

    def define(self, kind: Kind, name: str, internal: bool = False) -> SetDefinition:
        """Return the set of this kind and name; create it if there is none."""
        return self.sets(kind).setdefault(name.upper(), SetDefinition(name, internal))

    # -------------------------------------------------------------- cards

    def add_nodes(self, card: Card) -> Iterator[str]:
        """Add the nodes of a card *NODE; yield the options that are ignored. Raises DeckError."""
        if "SYSTEM" in card.options and card.options["SYSTEM"].upper() not in ("", "R"):
            raise UnsupportedDeck(card.place, "*NODE, SYSTEM: its nodes are in cylindrical or spherical coordinates",
                                  "write the nodes in Cartesian coordinates")  # fmt: skip
        numbers, places = [], []
        for row in card.each_row():
            if not 1 <= len(row) <= 7:  # after the coordinates there may be a normal
                raise card.error("a line of *NODE must have a number and up to three coordinates")
            numbers.append(read_integer(row[0], card))
            x, y, z = (*(read_number(word, card) if word else 0.0 for word in row[1:4]), 0.0, 0.0, 0.0)[:3]
            places += [x, y, z]
        own = _valid_number_array(numbers, card)
        self.node_numbers.append(own)
        self.coordinates.append(np.array(places, dtype=np.float64).reshape(-1, 3))
        if card.options.get("NSET"):
            self.define("nodes", card.options["NSET"]).entries.append(Entry(card, numbers=own))
        yield from card.unknown_options(NODE_OPTIONS | {"SYSTEM"})

    def add_elements(self, card: Card) -> Iterator[str]:
        """Add the elements of a card *ELEMENT; yield the options that are ignored. Raises DeckError."""
        kind = card.options.get("TYPE", "").upper()
        cell = meshio_cell_name(kind)
        nodes: Ints | None = None
        if cell is None:
            own = _valid_number_array(
                [read_integer(row[0], card) for row in _continued_rows(card) if row and row[0].isdigit()], card
            )
        else:
            each = COUNTS[cell] + 1
            words, further = _element_words(card, each)
            if further:
                yield f"`{further} further nodes of {kind}`"
            scoped = any("." in word for word in words) if self.kind == "assembly" else False
            if scoped:  # elements between instances: connectors and springs, no cells
                own = _valid_number_array([read_integer(word, card) for word in words[::each]], card)
            else:
                table = _valid_number_array([read_integer(word, card) for word in words], card).reshape(-1, each)
                own, nodes = np.ascontiguousarray(table[:, 0]), np.ascontiguousarray(table[:, 1:])
        self.blocks.append(ElementBlock(kind, card, own, nodes))
        if card.options.get("ELSET"):
            self.define("elements", card.options["ELSET"]).entries.append(Entry(card, numbers=own))
        yield from card.unknown_options(ELEMENT_OPTIONS)

    def add_set(self, card: Card) -> Iterator[str]:
        """Add the members of a card *NSET or *ELSET to its set; yield ignored options. Raises DeckError."""
        kind: Kind = "nodes" if card.keyword == "NSET" else "elements"
        name, instance = card.options.get(card.keyword, ""), card.options.get("INSTANCE", "")
        if not name:
            raise card.error(f"{card.title} has no name: {card.keyword}=NAME")
        unknown = card.unknown_options(SET_OPTIONS)
        generate = "GENERATE" in card.options
        if abbreviated := [o for o in unknown if len(o) >= SHORTEST and "GENERATE".startswith(o)]:
            generate = True
            unknown = [o for o in unknown if o not in abbreviated]
        own = self.define(kind, name, "INTERNAL" in card.options)
        if kind == "nodes" and card.options.get("ELSET"):
            own.entries.append(Entry(card, instance, name=card.options["ELSET"], of_elements=True))
        elif generate:
            own.entries.extend(Entry(card, instance, range=found) for found in _read_ranges(card))
        else:
            words = [word for row in card.each_row() for word in row if word]
            numbers = [read_integer(word, card) for word in words if word.isascii() and word.isdigit()]
            if numbers:
                own.entries.append(Entry(card, instance, numbers=_valid_number_array(numbers, card)))
            for word in dict.fromkeys(word for word in words if not (word.isascii() and word.isdigit())):
                own.entries.append(Entry(card, instance, name=word))
        yield from unknown

    def add_surface(self, card: Card) -> str | None:
        """Add the surface of a card *SURFACE; return why it is not supported, or None if it is. Raises DeckError."""
        name, kind = card.options.get("NAME", ""), card.options.get("TYPE", "ELEMENT").upper()
        if kind != "ELEMENT" or not name:
            return f"TYPE={kind} is not supported, only surfaces of elements" if name else "it has no name"
        if unknown := card.unknown_options(frozenset({"NAME", "TYPE", "INTERNAL"})):
            return f"its option {unknown[0]} is not supported"
        rows = tuple((row[0], row[1].upper() if len(row) > 1 else "") for row in card.rows if row)
        before = self.surfaces.setdefault(name.upper(), Surface(name, card, rows))
        if before.rows != rows:
            raise card.error(f"the surface `{name[:60]}` is defined twice, first in line {before.card.line}",
                             "give each surface a different name")  # fmt: skip
        return None


def _element_words(card: Card, each: int) -> tuple[list[str], int]:
    """Return the words of all elements of a card, `each` words per element, and the number of ignored words.

    An element may continue on the next line. Words after the last node of an element on a line are ignored, as in
    CalculiX: the orientation node of a beam, or nodes of another element type. Raises DeckError.
    """
    found: list[str] = []
    further = 0
    for row in card.each_row():
        words = [word for word in row if word]
        if len(found) % each == 0 and len(words) > each:
            further += len(words) - each
            words = words[:each]
        elif len(found) % each + len(words) > each:
            raise card.error(f"an element {card.options['TYPE']} needs a number and {each - 1} nodes, but "
                             f"one of its lines has {len(words)} more entries: `{', '.join(row)[:60]}`",
                             "write the number and all nodes of each element")  # fmt: skip
        found += words
    if len(found) % each:
        raise card.error(f"an element {card.options['TYPE']} needs a number and {each - 1} nodes, but the "
                         f"last one has {len(found) % each - 1} nodes")  # fmt: skip
    return found, further


def _continued_rows(card: Card) -> Iterator[list[str]]:
    """Yield the rows of a card; a line that ends with a comma continues on the next line."""
    words: list[str] = []
    for line, row in zip(card.lines, card.each_row(), strict=True):
        words += row
        if not line.endswith(","):
            yield words
            words = []
    if words:
        yield words


def _valid_number_array(numbers: list[int], card: Card) -> Ints:
    if numbers and (max(numbers) > MOST or min(numbers) < 1):
        raise card.error(
            f"{min(numbers) if min(numbers) < 1 else max(numbers)} is not a valid number of a node or element"
        )
    return np.array(numbers, dtype=np.int64)


def _read_ranges(card: Card) -> Iterator[tuple[int, int, int]]:
    for row in card.each_row():
        words = [word for word in row if word]
        if len(words) not in (2, 3) or not all(word.isascii() and word.isdigit() for word in words):
            raise card.error("a range of a set (GENERATE) needs a first number, a last one and a step")
        first, last, step = ([read_integer(word, card) for word in words] + [1])[:3]
        if step == 0 and first == last:  # Abaqus writes a single number so
            step = 1
        if step < 1 or last < first:
            raise card.error(f"the range {first} to {last} by {step} of a set is empty",
                             "write a first number, a last one not below it, and a positive step")  # fmt: skip
        yield first, last, step
