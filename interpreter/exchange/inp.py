"""Decks of CalculiX and Abaqus (`.inp`) of the common kind: solids at rest.

Where the two programs mean different things by the same card it is read as CalculiX means it, which is said.
Source: Dhondt, "CalculiX CrunchiX User's Manual", version 2.20; Abaqus Analysis User's Guide.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from softmark.interpreter.exchange import inp_laws, sets
from softmark.interpreter.exchange.cards import AGAIN, Card, cards, number, whole
from softmark.interpreter.exchange.loads_of import Loads
from softmark.interpreter.exchange.mesh_file import TYPES
from softmark.interpreter.exchange.record import Deck, Floats, Foreign, Ints, Law, Left, OnFaces, Part
from softmark.references.measured import Unreadable
from softmark.solvers.elements import element_of

KINDS = {word: (kind, element_of(kind).nodes) for kind, word in TYPES.items()}
SILENT = frozenset({
    "HEADING", "PREPRINT", "END PART", "END ASSEMBLY", "END INSTANCE", "ASSEMBLY", "AMPLITUDE",
    "NODE PRINT", "NODE FILE", "NODE OUTPUT", "EL PRINT", "EL FILE", "ELEMENT OUTPUT", "OUTPUT", "RESTART", "CONTROLS",
    "CONTACT PRINT", "CONTACT FILE", "SECTION PRINT", "FILE FORMAT", "MONITOR", "ENERGY PRINT", "ENERGY FILE",
})  # fmt: skip
OTHERWISE = {  # what makes other cards mean something else: nothing can be carried over around it
    "TRANSFORM": "its supports and forces are in other directions at some nodes",
    "SYSTEM": "its coordinates are in another frame",
    **dict.fromkeys(("NGEN", "NFILL", "NCOPY", "NMAP"), "its nodes are made by rules"),
    **dict.fromkeys(("ELGEN", "ELCOPY"), "its elements are made by rules"),
    "SUBMODEL": "it is a part of another model",
}  # fmt: skip
OTHER_STEPS = frozenset({
    "DYNAMIC", "FREQUENCY", "BUCKLE", "MODAL DYNAMIC", "HEAT TRANSFER", "COUPLED TEMPERATURE-DISPLACEMENT", "VISCO",
    "STEADY STATE DYNAMICS", "UNCOUPLED TEMPERATURE-DISPLACEMENT", "COMPLEX FREQUENCY", "GREEN", "SENSITIVITY",
})  # fmt: skip
ONLY_C3D8 = "C3D8 is integrated in full, as CalculiX has it; Abaqus takes the mean of the change of volume"
LIMIT = 5_000_000  # numbers of a set
SPENT = 10 * LIMIT  # numbers of all sets as often as they are named


@dataclass
class _Sets:
    """Sets of numbers by name, whose members may be sets."""

    own: dict[str, list[str]] = field(default_factory=dict)
    known: dict[str, list[int]] = field(default_factory=dict)  # once all is read
    spent: int = 0

    def numbers(self, name: str, card: Card, above: tuple[str, ...] = ()) -> list[int]:
        """Of a set, or of the number itself. Raises Unreadable."""
        if name.isascii() and name.isdigit():
            return [whole(name, card)]
        key = _key(name)
        if key in self.known:
            return self._spend(self.known[key], card)
        if key not in self.own or key in above or len(above) > 50:
            why = "contains itself" if key in self.own else "is nowhere defined"
            raise Unreadable(f"{card.file}:{card.line}", f"the set `{name[:60]}` {why}", AGAIN)
        found: list[int] = []
        for word in self.own[key]:
            found += self.numbers(word, card, (*above, key))
            if len(found) > LIMIT:
                raise Unreadable(f"{card.file}:{card.line}", f"the set `{name[:60]}` has too many members", AGAIN)
        self.known[key] = list(dict.fromkeys(found))
        return self._spend(self.known[key], card)

    def _spend(self, found: list[int], card: Card) -> list[int]:
        self.spent += len(found)
        if self.spent > SPENT:
            raise Unreadable(f"{card.file}:{card.line}", "its sets are named too often for their size", AGAIN)
        return found


def _key(name: str) -> str:
    """Names are alike in either case, and those of an instance are those of its part."""
    return name.rpartition(".")[2].upper()


def read(path: Path) -> Deck:
    """A deck. Raises Unreadable, Foreign."""
    reader = _Reader()
    for card in cards(path):
        reader.take(card)
    return reader.deck(path)


class _Reader:
    """What cards say, in their order."""

    def __init__(self) -> None:
        self.points: dict[int, tuple[float, float, float]] = {}
        self.elements: dict[str, list[int]] = {}  # by kind: number, nodes, number, nodes, ...
        self.types: set[str] = set()
        self.nsets, self.elsets = _Sets(), _Sets()
        self.surfaces: dict[str, tuple[Card, list[tuple[str, str]]]] = {}
        self.materials: dict[str, inp_laws.Told] = {}
        self.material: inp_laws.Told | None = None
        self.sections: list[tuple[Card, str, str]] = []
        self.loads = Loads()
        self.before: Loads | None = None
        self.other_step: Card | None = None
        self.open: Card | None = None  # a step that has not ended
        self.finite = self.static = False
        self.steps = self.instances = 0
        self.left: list[Left] = []
        self.shells = 0
        self.known: dict[str, Callable[[Card], None]] = {
            "NODE": self._node, "ELEMENT": self._element, "NSET": self._set, "ELSET": self._set,
            "SURFACE": self._surface, "MATERIAL": self._material, "SOLID SECTION": self._section, "STEP": self._step,
            "STATIC": self._static, "END STEP": self._end, "INSTANCE": self._instance, "PART": lambda card: None,
            "BOUNDARY": self._act, "CLOAD": self._act, "DLOAD": self._act, "DSLOAD": self._act,
        }  # fmt: skip

    def take(self, card: Card) -> None:
        """One more card. Raises Unreadable, Foreign."""
        if card.keyword in OTHERWISE:
            raise Foreign(f"*{card.keyword} in line {card.line}: {OTHERWISE[card.keyword]}",
                          "write the deck without: one part, nodes and elements one by one, in one frame")  # fmt: skip
        if card.keyword in self.known:
            if card.keyword not in ("NSET", "ELSET", "NODE", "ELEMENT"):
                self.material = None
            self.known[card.keyword](card)
        elif card.keyword in inp_laws.CARDS and self.material is not None:
            self.material.cards.append(card)
        elif card.keyword in OTHER_STEPS:
            self.other_step = card
        elif card.keyword not in SILENT:
            self.left.append(Left(f"*{card.keyword}", "no reader for it", card.line))

    def _node(self, card: Card) -> None:
        if "SYSTEM" in card.options or "INPUT" in card.options:
            raise Foreign(f"*NODE in line {card.line} has its nodes elsewhere, or in another frame",
                          "write one deck with Cartesian coordinates")  # fmt: skip
        for row in card.rows:
            words = [w for w in row if w]
            if not 1 <= len(words) <= 4:
                raise Unreadable(f"{card.file}:{card.line}", "a node has a number and three coordinates", AGAIN)
            x, y, z = (*(number(w, card) for w in words[1:]), 0.0, 0.0, 0.0)[:3]
            if self.points.setdefault(whole(words[0], card), (x, y, z)) != (x, y, z):
                raise Unreadable(f"{card.file}:{card.line}", f"two nodes are called {words[0]}, in two places", AGAIN)
        if "NSET" in card.options:
            self.nsets.own.setdefault(_key(card.options["NSET"]), []).extend(row[0] for row in card.rows)

    def _element(self, card: Card) -> None:
        kind = card.options.get("TYPE", "").upper()
        plain = next((k for k in KINDS if kind.startswith(k) and not kind[len(k) :][:1].isdigit()), None)
        if plain is None:
            if kind.startswith("C3D"):
                raise Foreign(f"{kind} in line {card.line} are cells that no model here has",
                              "cells are tetrahedra of 4 or 10 nodes or hexahedra of 8 or 20")  # fmt: skip
            many = sum(1 for row in card.rows if row and row[0])
            self.shells += many
            self.left.append(
                Left(f"{many} elements {kind or '*ELEMENT'}", "only solids are cells of a body", card.line)
            )
            return
        if kind != plain and kind not in self.types:
            self.left.append(Left(kind, f"is taken as {plain}, integrated in full, without what makes it another",
                                  card.line))  # fmt: skip
        self.types.add(kind)
        each = KINDS[plain][1] + 1
        flat = [whole(w, card) for row in card.rows for w in row if w]
        if len(flat) % each:
            raise Unreadable(f"{card.file}:{card.line}", f"an element {kind} has a number and {each - 1} nodes", AGAIN)
        self.elements.setdefault(plain, []).extend(flat)
        if "ELSET" in card.options:
            self.elsets.own.setdefault(_key(card.options["ELSET"]), []).extend(map(str, flat[::each]))

    def _set(self, card: Card) -> None:
        name = card.options.get(card.keyword)
        if name is None or (card.keyword == "NSET" and "ELSET" in card.options):
            self.left.append(Left(f"*{card.keyword}", "only sets by a name and members are read", card.line))
            return
        own = (self.nsets if card.keyword == "NSET" else self.elsets).own.setdefault(_key(name), [])
        for row in card.rows:
            words = [w for w in row if w]
            own += _generated(words, card) if "GENERATE" in card.options else words

    def _surface(self, card: Card) -> None:
        if card.options.get("TYPE", "ELEMENT").upper() != "ELEMENT" or "NAME" not in card.options:
            self.left.append(Left("*SURFACE", "only surfaces of elements with a name are read", card.line))
            return
        rows = [(row[0], row[1].upper() if len(row) > 1 else "") for row in card.rows if row and row[0]]
        self.surfaces[_key(card.options["NAME"])] = (card, rows)

    def _material(self, card: Card) -> None:
        self.material = inp_laws.Told(card, [])
        self.materials[card.options.get("NAME", "").upper()] = self.material

    def _section(self, card: Card) -> None:
        for option in ("ORIENTATION", "COMPOSITE"):
            if option in card.options:
                self.left.append(Left(f"{option} of *SOLID SECTION", "directions are not read", card.line))
        self.sections.append((card, card.options.get("ELSET", ""), card.options.get("MATERIAL", "").upper()))

    def _instance(self, card: Card) -> None:
        self.instances += 1
        if self.instances > 1 or any(any(row) for row in card.rows):
            raise Foreign(f"*INSTANCE in line {card.line}: several parts, or a part that is moved",
                          "write a flat deck of one part where it lies")  # fmt: skip

    def _step(self, card: Card) -> None:
        self.steps += 1
        self._ended()
        self.open = card
        self.before, self.other_step = self.loads, None
        self.loads = self.loads.copied()
        if "PERTURBATION" in card.options:
            self.other_step = card
        if card.options.get("NLGEOM", "NO" if "NLGEOM" not in card.options else "YES").upper() != "NO":
            self.finite = True

    def _static(self, card: Card) -> None:
        self.static = True
        if "RIKS" in card.options:
            self.left.append(Left("RIKS of *STATIC", "`static(path = arc_length)` would follow it", card.line))

    def _ended(self) -> None:
        """Raises Unreadable in a step: what would have followed may be loads."""
        if self.open is not None:
            raise Unreadable(f"{self.open.file}:{self.open.line}", "the step that begins here has no *END STEP", AGAIN)

    def _end(self, card: Card) -> None:
        self.open = None
        if self.other_step is not None and self.before is not None:
            what, self.loads = self.other_step, self.before
            self.left.append(Left(f"a step of *{what.keyword}", "only steps of *STATIC are carried over", what.line))

    def _act(self, card: Card) -> None:
        self.left += self.loads.take(card)

    # -------------------------------------------------------------- together

    def deck(self, path: Path) -> Deck:
        """All of it. Raises Unreadable, Foreign."""
        self._ended()
        kind, numbers, cells = self._cells(path)
        used, cells = np.unique(cells, return_inverse=True)
        cells = cells.reshape(len(numbers), -1).astype(np.int64)
        place = {n: i for i, n in enumerate(used.tolist())}
        if missing := [n for n in place if n not in self.points]:
            raise Unreadable(path.name, f"an element has the node {missing[0]}, which is nowhere", AGAIN)
        points: Floats = np.array([self.points[n] for n in place], dtype=np.float64)
        found = Deck(path.name, kind, points, cells, [], static=self.static, left=self.left)
        index = {n: i for i, n in enumerate(numbers)}
        found.parts = list(self._parts(found, index))
        found.strain = "finite" if self.finite or any(_rubber(p.law) for p in found.parts) else "small"
        if found.strain == "finite":
            found.parts = [inp_laws.in_finite_strain(part) for part in found.parts]
        self._said(found)
        self._acting(found, place, index)
        self._sets(found, place, index)
        return found

    def _sets(self, found: Deck, place: dict[int, int], index: dict[int, int]) -> None:
        """Sets, surfaces and materials that have a name, and that nothing asks for."""
        asked, surfaces = self.loads.asked()
        used = {_key(who) for who in asked} | {_key(elset) for _, elset, _ in self.sections}
        used |= {_key(who) for key in surfaces for who, _ in self.surfaces.get(_key(key), (None, []))[1]}
        for word, known, number_of, take in (("ELSET", self.elsets, index, sets.of_cells),
                                             ("NSET", self.nsets, place, sets.of_nodes)):  # fmt: skip
            for name in (own for own in known.own if own not in used):
                own = known.numbers(name, Card(word, {}, [], 0, found.title))
                take(found, name, np.array(sorted({number_of[n] for n in own if n in number_of}), dtype=np.int64))
        elements, loaded = self._elements(found, index), {_key(key) for key in surfaces}
        for name, (card, _) in self.surfaces.items():
            if name not in loaded:
                sets.of_faces(found, name, self._faces(name, "", card, elements, found))
        for name, told in self.materials.items():
            if name not in {material for _, _, material in self.sections}:
                found.left.append(Left(f"the material `{name[:60]}`", "no cells are made of it", told.card.line))

    def _cells(self, path: Path) -> tuple[str, list[int], Ints]:
        if not self.elements:
            words = f" ({self.shells} elements of other kinds)" if self.shells else ""
            raise Foreign(f"{path.name} has no tetrahedra and no hexahedra{words}",
                          "decks of solids are carried over: C3D4, C3D10, C3D8 and C3D20")  # fmt: skip
        if len(self.elements) > 1:
            raise Foreign(f"{path.name} has several kinds of cells: {', '.join(sorted(self.elements))}",
                          "a model here has cells of one kind: write one deck for each")  # fmt: skip
        ((plain, flat),) = self.elements.items()
        kind, many = KINDS[plain]
        table = np.array(flat, dtype=np.int64).reshape(-1, many + 1)
        numbers = table[:, 0].tolist()
        if not numbers or len(set(numbers)) < len(numbers):
            raise Unreadable(path.name, "two elements have one number, or there are none", AGAIN)
        return kind, numbers, table[:, 1:]

    def _parts(self, found: Deck, index: dict[int, int]) -> Iterator[Part]:
        owner = np.full(len(found.cells), -1)
        named: list[tuple[str, Law | None]] = []
        for card, elset, material in self.sections:
            which = [index[n] for n in self.elsets.numbers(elset, card) if n in index]
            if not which:
                continue
            owner[which] = len(named)
            told = self.materials.get(material)
            if told is None:
                found.left.append(Left(f"the material `{material}`", "it is nowhere defined", card.line))
            named.append((material or elset, inp_laws.law(told, found.left) if told else None))
        for i, (name, law) in enumerate(named):
            if len(own := np.flatnonzero(owner == i)):
                yield Part(name, own, law)
        if len(rest := np.flatnonzero(owner == -1)):
            yield Part("rest", rest, None)

    def _said(self, found: Deck) -> None:
        laws = [p.law for p in found.parts if p.law is not None]
        if found.strain == "finite" and any(law.word == "st_venant_kirchhoff" for law in laws):
            found.taken.append("*ELASTIC with NLGEOM is the law of St Venant and Kirchhoff, as CalculiX has it; Abaqus "
                               "has another at large strain")  # fmt: skip
        if found.strain == "finite" and not self.finite:
            found.taken.append("*HYPERELASTIC without NLGEOM is of finite strain, as CalculiX has it")
        if found.kind == "hex8":
            found.taken.append(ONLY_C3D8)
        if self.steps > 1:
            found.taken.append(f"of {self.steps} steps the scene has what acts at the end of the last of *STATIC")

    def _acting(self, found: Deck, place: dict[int, int], index: dict[int, int]) -> None:
        def nodes(name: str, card: Card) -> Ints:
            asked = self.nsets.numbers(name, card)
            own = np.array(sorted({place[n] for n in asked if n in place}), dtype=np.int64)
            if lost := len({n for n in asked if n not in place}):
                found.left.append(Left(f"*{card.keyword} on {lost} nodes", "they are of no cell", card.line))
            return own

        elements = self._elements(found, index)
        found.holds = self.loads.holds(nodes)
        found.forces = self.loads.forces(nodes)
        for press in self.loads.presses:
            faces = self._faces(press.who, press.label, press.card, elements, found)
            border = faces[found.sides.border.reshape(len(found.cells), -1)[faces[:, 0], faces[:, 1]]]
            if len(border) < len(faces):
                why = "faces between two cells are no surface"
                found.left.append(Left(f"pressure on {len(faces) - len(border)} faces", why, press.card.line))
            if len(border):
                found.pushes.append(OnFaces(press.who or "surface", border, press.value))
        for weight in self.loads.weights:
            if weight.who and len(set(elements(weight.who, weight.card))) < len(found.cells):
                why = "gravity acts on a whole body here"
                found.left.append(Left(f"GRAV on the set `{weight.who}`", why, weight.card.line))
            else:
                found.weights.append(weight.vector)

    def _elements(self, found: Deck, index: dict[int, int]) -> Callable[[str, Card], list[int]]:
        """What finds the cells of a set by its name, or all without one."""

        def elements(name: str, card: Card) -> list[int]:
            return [index[n] for n in self.elsets.numbers(name, card) if n in index] if name else list(range(
                len(found.cells)))  # fmt: skip

        return elements

    def _faces(self, who: str, label: str, card: Card, elements: Callable[[str, Card], list[int]], found: Deck) -> Ints:
        """Faces (f, 2) of a set and a label P3, or of a surface."""
        rows = [(who, label)]
        if card.keyword in ("DSLOAD", "SURFACE"):
            if _key(who) not in self.surfaces:
                raise Unreadable(f"{card.file}:{card.line}", f"the surface `{who[:60]}` is nowhere defined", AGAIN)
            rows = self.surfaces[_key(who)][1]
        faces: list[tuple[int, int]] = []
        for name, side in rows:
            if not side[1:].isdigit() or not 1 <= int(side[1:]) <= len(element_of(found.kind).facets):
                found.left.append(Left(f"`{name}, {side}`", "no side of a solid is called so", card.line))
                continue
            faces += [(cell, int(side[1:]) - 1) for cell in elements(name, card)]
        return np.array(sorted(set(faces)), dtype=np.int64).reshape(-1, 2)


def _rubber(law: Law | None) -> bool:
    return law is not None and law.word != "linear_elastic"


def _generated(words: list[str], card: Card) -> list[str]:
    first, last, step = ([whole(w, card) for w in words] + [1])[:3] if len(words) in (2, 3) else (0, 0, 0)
    if step < 1 or last < first or (last - first) // step > LIMIT:
        raise Unreadable(f"{card.file}:{card.line}", "a set is generated by a first, a last and a step", AGAIN)
    return [str(n) for n in range(first, last + 1, step)]
