"""Random decks with scoped sets, read by the import and by `mesh(...)`, against a small reader that is written here.

The reader below keeps sets of (instance, number) and expands every range; it shares no code with that of the solver.
"""

from __future__ import annotations

import math
import random
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from softmark.interpreter.importers import import_formats
from softmark.solvers.mesh import mesh_groups
from softmark.solvers.mesh.shapes import MeshFile

SEEDS = 240
NAMES = ["Set-1", "Set-2", "soft.part", "hard.part", "part", "Set-1.inner"]
Place = tuple[float, float, float]
Id = tuple[str, int]

# ------------------------------------------------------------------ decks


def bar(cells: int, first: int) -> tuple[list[str], list[str], int]:
    """Lines of nodes and elements of a bar along x, the number of its nodes; numbers begin at `first`."""
    nodes, elements = [], []
    for i in range(cells + 1):
        for k, (y, z) in enumerate(((0, 0), (1, 0), (1, 1), (0, 1))):
            nodes.append(f"{first + 4 * i + k}, {i}., {y}., {z}.")
    for i in range(cells):
        a = first + 4 * i
        elements.append(f"{first + i}, {a}, {a + 4}, {a + 5}, {a + 1}, {a + 3}, {a + 7}, {a + 6}, {a + 2}")
    return nodes, elements, len(nodes)


def written(keyword: str, chance: random.Random) -> str:
    """A keyword in one of the ways in which programs write it."""
    way = chance.randrange(4)
    return (f"*{keyword}", f"*{keyword.title()}", f"*{keyword.lower()}", f"  *{keyword}")[way]


def sets_of(kind: str, numbers: range, known: list[str], chance: random.Random, instance: str = "") -> Iterator[str]:
    """Sets of nodes or elements of a scope: by numbers, ranges and names of known sets; of an instance or of a part.

    Those of a part are known from then on.
    """
    names = chance.sample(NAMES, chance.randrange(1, 4))
    more, others = f", instance={instance}" if instance else "", [name for name in known if name not in names]
    for name in names:
        head = f"{written(kind, chance)}, {kind.lower()}={name}{more}{chance.choice(('', ', internal', ', unsorted'))}"
        way = chance.randrange(3 if others else 2)
        if way == 0:
            yield head
            yield ", ".join(map(str, chance.sample(list(numbers), chance.randrange(1, min(6, len(numbers)) + 1)))) + ","
        elif way == 1:
            yield f"{head}, {chance.choice(('generate', 'GENERATE', 'gen'))}"
            low = chance.choice(list(numbers))
            yield f"{low}, {chance.choice((low + 3, low + 8, 10**11))}, {chance.choice((1, 2, 3))}"
        else:
            yield head
            yield f"{chance.choice(others)}, {chance.choice(list(numbers))}"
        if not instance:
            others.append(name)
            known.append(name)


def deck_of_parts(chance: random.Random) -> tuple[str, list[str]]:
    """A deck with parts, instances and an assembly; and words that name node sets in its steps."""
    lines, sizes, named, elsets = ["*Heading"], {}, {}, {}
    for p in range(chance.randrange(1, 3)):
        part, cells, first = f"Bar{p}", chance.randrange(1, 4), chance.choice((1, 1, 7))
        nodes, elements, many = bar(cells, first)
        lines += [f"{written('PART', chance)}, name={part}", written("NODE", chance), *nodes,
                  f"{written('ELEMENT', chance)}, type=C3D8, elset=All", *elements]  # fmt: skip
        known: list[str] = []
        lines += sets_of("NSET", range(first, first + many), known, chance)
        own: list[str] = ["All"]
        lines += sets_of("ELSET", range(first, first + cells), own, chance)
        lines += ["*Solid Section, elset=All, material=M", ",", "*End Part"]
        sizes[part], named[part], elsets[part] = (first, many, cells), known, own
    lines += [f"{written('ASSEMBLY', chance)}, name=Assembly"]
    instances: dict[str, str] = {}
    for i in range(chance.randrange(1, 4)):
        part = chance.choice(list(sizes))
        name = chance.choice((f"{part}-{i}", f"I.{i}"))
        instances[name] = part
        lines += [f"*Instance, name={name}, part={part}"]
        if i or chance.random() < 0.5:
            lines += [f"{chance.choice((0, 2.5))}, {5.0 * i}, {chance.choice((0, 1))}"]
            if chance.random() < 0.4:
                lines += [
                    f"0., {5.0 * i}, 0., 0., {5.0 * i}, {chance.choice((1, 2.0))}, {chance.choice((90.0, 30.0, -45.0))}"
                ]
        lines += ["*End Instance"]
    words: list[str] = []
    for name, part in instances.items():
        first, many, cells = sizes[part]
        words += [f"{name}.{own}" for own in named[part]] + [f"{name}.{first}", f"Assembly.{name}.{first + 1}"]
        mine = list(named[part])
        lines += sets_of("NSET", range(first, first + many), mine, chance, name)
        lines += sets_of("ELSET", range(first, first + cells), list(elsets[part]), chance, name)
        if chance.random() < 0.5:
            lines += [f"*Nset, nset=from-cells, instance={name}, elset={chance.choice(elsets[part])}"]
            words += ["from-cells"]
        if chance.random() < 0.5:
            lines += ["*Nset, nset=from-both", f"{name}.{chance.choice(named[part])}, {name}.{first}"]
            words += ["from-both"]
        if chance.random() < 0.5:
            lines += [f"*Surface, name=skin-{name}, type=ELEMENT", f"{name}.All, S4"]
    lines += ["*End Assembly"]
    assembly = {line.split("=", 1)[1].split(",")[0] for line in lines if "nset=Set" in line and "instance=" in line}
    return "\n".join([*lines, *ending(words + sorted(assembly), chance)]) + "\n", words


def flat_deck(chance: random.Random) -> tuple[str, list[str]]:
    """A deck without parts, whose names have dots."""
    cells, first = chance.randrange(2, 6), chance.choice((1, 11))
    nodes, elements, many = bar(cells, first)
    lines = [f"{written('NODE', chance)}, nset=Nall", *nodes, f"{written('ELEMENT', chance)}, type=C3D8, elset=All",
             *elements]  # fmt: skip
    known: list[str] = []
    lines += sets_of("NSET", range(first, first + many), known, chance)
    own: list[str] = []
    lines += sets_of("ELSET", range(first, first + cells), own, chance)
    lines += [f"*Nset, nset=from.cells, elset={chance.choice(own)}", "*Solid Section, elset=All, material=M", ","]
    words = [*known, "from.cells", str(first), "NALL"]
    return "\n".join([*lines, *ending(words, chance)]) + "\n", words


def ending(words: list[str], chance: random.Random) -> list[str]:
    """A material, supports and forces."""
    held, pulled = chance.choice(words), chance.choice(words)
    return ["*Material, name=M", "*Elastic", "1., 0.3", "*Boundary", f"{held}, {chance.choice(('ENCASTRE', '1, 3'))}",
            written("STEP", chance), written("STATIC", chance), "*Cload", f"{pulled}, 2, 0.5", "*End Step"]  # fmt: skip


# ------------------------------------------------------------------ a small reader


class SmallReader:
    """Sets of a deck as sets of (instance, number), with everything written out; a flat deck is the instance ""."""

    def __init__(self, text: str) -> None:
        self.nodes: dict[str, dict[int, Place]] = {}  # by part
        self.elements: dict[str, dict[int, list[int]]] = {}
        self.sets: dict[str, dict[tuple[str, str], list[tuple[dict[str, str], list[str]]]]] = {}
        self.instances: dict[str, tuple[str, list[list[float]]]] = {}
        self.acts: dict[str, list[list[str]]] = {"boundary": [], "cload": []}
        self.top: dict[tuple[str, str], list[tuple[dict[str, str], list[str]]]] = {}
        self._read(text)

    def _read(self, text: str) -> None:
        part, blocks = "", [block.strip() for block in text.replace("\n  *", "\n*").strip().split("\n*")]
        for block in blocks:
            head, *rows = block.lstrip("*").split("\n")
            word, *rest = [w.strip() for w in head.split(",")]
            options = {o.split("=")[0].strip().lower(): o.split("=")[-1].strip() for o in rest}
            word = word.lower()
            data = [[w.strip() for w in row.split(",") if w.strip()] for row in rows]
            if word == "part":
                part = options["name"]
            elif word in ("end part", "assembly"):
                part = ""
            elif word == "instance":
                self.instances[options["name"]] = options["part"], [list(map(float, row)) for row in data]
            elif word == "node":
                own = self.nodes.setdefault(part, {})
                own |= {int(n): (float(x), float(y), float(z)) for n, x, y, z in data}
                if "nset" in options:
                    self._add(part, "n", options["nset"], {}, [n for n, *_ in data])
            elif word == "element":
                self.elements.setdefault(part, {}).update({int(e): list(map(int, n)) for e, *n in data})
                self._add(part, "e", options["elset"], {}, [e for e, *_ in data])
            elif word in ("nset", "elset"):
                flat = [w for row in data for w in row]
                self._add(part, word[0], options[word], options, flat)
            elif word in self.acts:
                self.acts[word] += data

    def _add(self, part: str, kind: str, name: str, options: dict[str, str], words: list[str]) -> None:
        table = self.sets.setdefault(part, {}) if part else self.top
        table.setdefault((kind, name.lower()), []).append((options, words))

    @property
    def flat(self) -> bool:
        """Whether there are no instances."""
        return not self.instances

    def of(self, kind: str, word: str, where: str | None = None) -> set[Id]:
        """The members of a word: in the assembly (None), or in an instance."""
        key = kind, word.lower()
        if where is None:
            if key in self.top:
                return self._all(kind, self.top[key], None if not self.flat else "")
            if self.flat:
                return self._numbers(kind, "", [int(word)])
            tail = word.removeprefix("Assembly.")
            name = max((i for i in self.instances if tail.startswith(f"{i}.")), key=len)
            return self.of(kind, tail[len(name) + 1 :], name)
        own = self.sets.get(self.instances[where][0], {}) if where else self.top
        return self._all(kind, own[key], where) if key in own else self._numbers(kind, where, [int(word)])

    def _all(self, kind: str, entries: list[tuple[dict[str, str], list[str]]], where: str | None) -> set[Id]:
        found: set[Id] = set()
        for options, words in entries:
            inner = options.get("instance", where)
            if kind == "n" and "elset" in options:
                cells = self.of("e", options["elset"], inner)
                found |= {(i, n) for i, e in cells for n in self.elements[self.instances[i][0] if i else ""][e]}
            elif {"generate", "gen"} & {o.lower() for o in options}:
                low, high, step = map(int, words)
                assert inner is not None
                found |= self._numbers(kind, inner, list(range(low, min(high, 1000) + 1, step)))
            else:
                for word in words:
                    found |= self.of(kind, word, inner)
        return found

    def _numbers(self, kind: str, where: str, numbers: list[int]) -> set[Id]:
        part = self.instances[where][0] if where else ""
        known = self.nodes[part] if kind == "n" else self.elements[part]
        return {(where, n) for n in numbers if n in known}

    def place(self, node: Id) -> Place:
        """Where a node lies, to 6 digits: translated, then turned, by the angle in the plane across the axis z."""
        name, number = node
        if not name:
            x, y, z = self.nodes[""][number]
            return round(x, 6) + 0.0, round(y, 6) + 0.0, round(z, 6) + 0.0
        part, rows = self.instances[name]
        x, y, z = self.nodes[part][number]
        if rows:
            x, y, z = x + rows[0][0], y + rows[0][1], z + rows[0][2]
        if len(rows) > 1:
            a, b, angle = rows[1][0], rows[1][1], math.radians(rows[1][6])
            turned = complex(x - a, y - b) * complex(math.cos(angle), math.sin(angle))
            x, y = turned.real + a, turned.imag + b
        return round(x, 6) + 0.0, round(y, 6) + 0.0, round(z, 6) + 0.0

    def places(self, nodes: set[Id]) -> set[Place]:
        """Where nodes lie."""
        return {self.place(node) for node in nodes}

    def middles(self, cells: set[Id]) -> set[Place]:
        """Where the middles of cells lie."""
        found = set()
        for name, number in cells:
            part = self.instances[name][0] if name else ""
            X = np.array([self.place((name, n)) for n in self.elements[part][number]])
            found.add(rounded(X.mean(axis=0)[None])[0])
        return found

    def names(self, kind: str) -> dict[str, set[Id]]:
        """All sets by their scoped names in lower case."""
        found = {name: self.of(kind, name, "" if self.flat else None) for k, name in self.top if k == kind}
        for instance, (part, _) in self.instances.items():
            for k, name in self.sets[part]:
                if k == kind:
                    found[f"{instance}.{name}".lower()] = self.of(kind, name, instance)
        return found


def rounded(X: np.ndarray) -> list[Place]:  # type: ignore[type-arg]
    """Places to 5 digits, for middles, whose last digits are rounding."""
    return [(round(float(x), 5) + 0.0, round(float(y), 5) + 0.0, round(float(z), 5) + 0.0) for x, y, z in X]


def near(X: np.ndarray) -> set[Place]:  # type: ignore[type-arg]
    """Places to 6 digits."""
    return {(round(float(x), 6) + 0.0, round(float(y), 6) + 0.0, round(float(z), 6) + 0.0) for x, y, z in X}


# ------------------------------------------------------------------ both


def deck(seed: int) -> str:
    """A deck of that seed."""
    chance = random.Random(seed)
    return (flat_deck if seed % 3 == 0 else deck_of_parts)(chance)[0]


@pytest.mark.parametrize("block", range(8))
def test_supports_and_forces_act_on_the_nodes_of_their_scopes(block: int, tmp_path: Path) -> None:
    for seed in range(block, SEEDS, 8):
        text = deck(seed)
        (tmp_path / "d.inp").write_text(text)
        small, found = SmallReader(text), import_formats.read(tmp_path / "d.inp")
        ((held, *_),), ((pulled, *_),) = small.acts["boundary"], small.acts["cload"]
        whole = {p for hold in found.holds for p in near(found.points[hold.nodes])}
        assert whole == small.places(small.of("n", held)), (seed, held)
        assert {c for hold in found.holds for c in hold.components} <= {0, 1, 2}
        tugged = [p for own in found.forces for p in near(found.points[own.nodes])]
        assert set(tugged) == small.places(small.of("n", pulled)), (seed, pulled)
        assert {own.force for own in found.forces} == {(0.0, 0.5, 0.0)}
        assert len(found.cells) == len(small.names("e")["all"] if small.flat else [
            e for part, _ in small.instances.values() for e in small.elements[part]])  # fmt: skip


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("block", range(8))
def test_groups_of_a_mesh_file_have_scoped_names(block: int, tmp_path: Path) -> None:
    for seed in range(block, SEEDS, 8):
        text = deck(seed)
        (tmp_path / "d.inp").write_text(text)
        mesh = MeshFile(path=str(tmp_path / "d.inp"), unit=1.0, coincident="keep", pieces="keep").mesh_with_groups()
        assert mesh.groups is not None
        small, known = SmallReader(text), {name.lower(): name for name in mesh.groups}
        cells, nodes = small.names("e"), small.names("n")
        for name, own in cells.items():
            inside = mesh_groups.cells_in(mesh, known[name])
            X = mesh.points[mesh.cells[inside]].mean(axis=1)
            assert set(rounded(X)) == small.middles(own), (seed, name)
        for name, own in nodes.items():
            if name not in cells:
                there = near(mesh.points[mesh_groups.nodes_in(mesh, known[name])])
                assert there == small.places(own), (seed, name)
        assert {n for n in known if not n.startswith("skin-")} == cells.keys() | nodes.keys(), seed


def test_the_random_decks_have_what_is_to_be_tested() -> None:
    """Names that several scopes have, dots, ranges, sets of elements as nodes, turned instances: each in many decks."""
    texts = [deck(seed).lower() for seed in range(SEEDS)]
    for words in (("instance=", "nset=set-1"), ("soft.part",), ("gen",), ("from-cells",), ("from.cells",),
                  ("internal",), ("90.",), ("assembly.",), ("100000000000",)):  # fmt: skip
        assert sum(all(word in text for word in words) for text in texts) > 20, words
