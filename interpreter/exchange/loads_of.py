"""*BOUNDARY, *CLOAD, *DLOAD and *DSLOAD as they add up from step to step."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from softmark.interpreter.exchange.cards import AGAIN, Card, number, whole
from softmark.interpreter.exchange.record import AtNodes, Foreign, Hold, Ints, Left, Vector
from softmark.references.measured import Unreadable

NAMED = {"ENCASTRE": (0, 1, 2), "PINNED": (0, 1, 2), "XSYMM": (0,), "YSYMM": (1,), "ZSYMM": (2,)}
Nodes = Callable[[str, Card], Ints]


@dataclass(frozen=True)
class Push:
    """A pressure: on whom, on which side, how much."""

    who: str
    label: str
    value: float
    card: Card
    step: int


@dataclass(frozen=True)
class Weight:
    """An acceleration of a set of elements, or of all."""

    who: str
    vector: Vector
    card: Card
    step: int


@dataclass
class Loads:
    """What acts: later steps say anew what moves and what pulls; forces and weights of one step add up."""

    moved: dict[tuple[str, int], tuple[float, Card]] = field(default_factory=dict)  # by set and component, in turn
    forced: dict[tuple[str, int], tuple[float, Card, int]] = field(default_factory=dict)
    presses: list[Push] = field(default_factory=list)
    weights: list[Weight] = field(default_factory=list)
    step: int = 0

    def copied(self) -> Loads:
        """The same, to be changed in the next step."""
        return Loads(dict(self.moved), dict(self.forced), list(self.presses), list(self.weights), self.step + 1)

    def take(self, card: Card) -> list[Left]:
        """One more card; what of it is left. Raises Unreadable."""
        if card.options.get("OP", "").upper() == "NEW":
            self._anew(card.keyword)
        for option in ("AMPLITUDE", "FOLLOWER", "SUBMODEL", "TYPE", "LOAD CASE", "SECTOR", "FIXED"):
            if option in card.options and not (option == "TYPE" and card.options[option].upper() == "DISPLACEMENT"):
                why = f"what {option} makes of it is not read"
                return [Left(f"*{card.keyword} on {len(card.rows)} lines", why, card.line)]
        return [left for row in card.rows for left in self._row(card, row)]

    def _anew(self, keyword: str) -> None:
        if keyword == "BOUNDARY":
            self.moved.clear()
        elif keyword == "CLOAD":
            self.forced.clear()
        else:
            kept = [p for p in self.presses if p.card.keyword != keyword]
            self.presses, self.weights = kept, [w for w in self.weights if w.card.keyword != keyword]

    def _row(self, card: Card, row: list[str]) -> Iterator[Left]:
        while row and not row[-1]:
            row = row[:-1]
        if len(row) < 2:
            raise Unreadable(f"{card.file}:{card.line}", f"a line of *{card.keyword} is too short", AGAIN)
        if card.keyword == "BOUNDARY":
            yield from self._boundary(card, row)
        elif card.keyword == "CLOAD":
            yield from self._force(card, row)
        else:
            yield from self._distributed(card, row)

    def _boundary(self, card: Card, row: list[str]) -> Iterator[Left]:
        if row[1].upper() in NAMED:
            for c in NAMED[row[1].upper()]:
                self._move(row[0], c, 0.0, card)
            return
        first = whole(row[1], card)
        last = whole(row[2], card) if len(row) > 2 and row[2] else first
        value = number(row[3], card) if len(row) > 3 and row[3] else 0.0
        for c in range(max(first, 1), min(last, 3) + 1):
            self._move(row[0], c - 1, value, card)
        if last > 3 and (value or last > 6 or first > 3):
            yield Left(f"direction {last} of *BOUNDARY on `{row[0]}`", "solids have three directions", card.line)

    def _move(self, who: str, component: int, value: float, card: Card) -> None:
        self.moved.pop((who, component), None)
        self.moved[who, component] = (value, card)

    def _force(self, card: Card, row: list[str]) -> Iterator[Left]:
        component, value = whole(row[1], card), number(row[2], card) if len(row) > 2 else 0.0
        if 1 <= component <= 3:
            before, _, step = self.forced.get((row[0], component - 1), (0.0, card, -1))
            self.forced[row[0], component - 1] = (value + (before if step == self.step else 0.0), card, self.step)
        else:
            yield Left(f"direction {component} of *CLOAD on `{row[0]}`", "solids have three directions", card.line)

    def _distributed(self, card: Card, row: list[str]) -> Iterator[Left]:
        label, values = row[1].upper(), row[2:]
        if label == "GRAV" and len(values) >= 4:
            size, *along = (number(w, card) for w in values[:4])
            length = float(np.linalg.norm(along))
            if length > 0.0:
                x, y, z = (size * a / length for a in along)
                self.weights = [w for w in self.weights if w.who != row[0] or w.step == self.step]
                self.weights.append(Weight(row[0], (x, y, z), card, self.step))
                return
        elif label == "P" or (label[:1] == "P" and label[1:].isdigit()):
            value = number(values[0], card) if values else 0.0
            same = [p for p in self.presses if (p.who, p.label) == (row[0], label)]
            if any(p.step == self.step for p in same):
                yield Left(f"`{label}` on `{row[0]}` once more", "programs differ in whether it adds up", card.line)
                return
            self.presses = [p for p in self.presses if p not in same]
            self.presses.append(Push(row[0], label, value, card, self.step))
            return
        why = "only P, P1 to P6 and GRAV are read" if label != "GRAV" else "it has no size and direction"
        yield Left(f"`{label}` of *{card.keyword} on `{row[0]}`", why, card.line)

    # -------------------------------------------------------------- together

    def asked(self) -> tuple[set[str], set[str]]:
        """The sets of nodes and elements that something acts on, and the surfaces, by their names."""
        on = {p.who for p in self.presses if p.card.keyword == "DSLOAD"}
        sets = {who for who, _ in (*self.moved, *self.forced)} | {own.who for own in self.weights}
        return sets | {p.who for p in self.presses} - on, on

    def holds(self, nodes: Nodes) -> list[Hold]:
        """Supports: each set with its directions, where no other says something else of the same nodes."""
        by_set: dict[tuple[str, bool], dict[int, float]] = {}
        members: dict[str, Ints] = {}
        told: dict[tuple[int, int], float] = {}
        clear = True
        for (who, c), (value, card) in self.moved.items():
            members.setdefault(who, nodes(who, card))
            by_set.setdefault((who, value != 0.0), {})[c] = value
            for node in members[who].tolist():
                clear = clear and told.get((node, c), value) == value
                told[node, c] = value
        if not clear or any(who.isdigit() for who in members):
            return together(told)
        found = [Hold(who, members[who], tuple(sorted(own)), tuple(own[c] for c in sorted(own)))
                 for (who, _), own in by_set.items()]  # fmt: skip
        return [hold for hold in found if len(hold.nodes)]

    def forces(self, nodes: Nodes) -> list[AtNodes]:
        """Of each node together. Raises Foreign."""
        told: dict[tuple[int, int], tuple[float, int]] = {}
        for (who, c), (value, card, step) in self.forced.items():
            for node in nodes(who, card).tolist():
                before, then = told.get((node, c), (0.0, step))
                if then != step:
                    raise Foreign(f"*CLOAD in line {card.line}: a node is loaded by several sets in several steps",
                                  "write one step with all that acts")  # fmt: skip
                told[node, c] = (before + value, step)
        total: dict[int, list[float]] = {}
        for (node, c), (value, _) in told.items():
            total.setdefault(node, [0.0, 0.0, 0.0])[c] = value
        return alike(sorted(total.items()))


def alike(told: Iterable[tuple[int, Sequence[float]]]) -> list[AtNodes]:
    """Forces of nodes: those that have the same become one set, and nothing is left of none."""
    by_vector: dict[Vector, list[int]] = {}
    for node, (x, y, z) in told:
        if x or y or z:
            by_vector.setdefault((x, y, z), []).append(node)
    return [AtNodes("force", np.array(own, dtype=np.int64), vector) for vector, own in by_vector.items()]


def together(told: dict[tuple[int, int], float]) -> list[Hold]:
    """Supports of nodes and components: sets that are the same in several directions become one."""
    sets: dict[tuple[int, float], list[int]] = {}
    for (node, c), value in told.items():
        sets.setdefault((c, value), []).append(node)
    same: dict[tuple[bytes, bool], list[tuple[int, float]]] = {}
    arrays: dict[bytes, Ints] = {}
    for (c, value), members in sets.items():
        own = np.unique(np.array(members, dtype=np.int64))
        arrays[own.tobytes()] = own
        same.setdefault((own.tobytes(), value != 0.0), []).append((c, value))
    found = []
    for (key, moves), each in same.items():
        each.sort()
        name = "moved" if moves else "still"
        found.append(Hold(name, arrays[key], tuple(c for c, _ in each), tuple(v for _, v in each)))
    return found
