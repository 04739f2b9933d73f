"""Supports and loads of a deck (*BOUNDARY, *CLOAD, *DLOAD, *DSLOAD), accumulated over the steps."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from softmark.interpreter.importers.deck_amplitudes import Amplitudes, StepTimes
from softmark.interpreter.importers.imported_deck import (
    Ints,
    NodeForces,
    NodeSupport,
    NotImportable,
    NotImported,
    Vector,
)
from softmark.solvers.mesh.files.abaqus.keyword_lines import Card, read_integer, read_number

# Directions fixed by names of *BOUNDARY in a solid: Abaqus Analysis User's Guide, "Boundary conditions"
NAMED = {
    "ENCASTRE": (0, 1, 2), "PINNED": (0, 1, 2), "XSYMM": (0,), "YSYMM": (1,), "ZSYMM": (2,),
    "XASYMM": (1, 2), "YASYMM": (0, 2), "ZASYMM": (0, 1),
}  # fmt: skip
SHELLS = frozenset({"NOWARP", "NOOVAL", "NODEFORM"})  # constraints of pipe elements
READ = frozenset({"OP", "AMPLITUDE", "TYPE", "REGIONTYPE", "NAME"})
WHY = {
    "FOLLOWER": "such a follower load is not supported",
    "FIXED": "fixing nodes at their positions from the previous step is not supported",
    "LOADCASE": "load cases and harmonic loads are not supported",
    "USER": "values from a subroutine are not supported",
    "SUBMODEL": "values from another analysis are not supported",
    "SECTOR": "loads on one sector of a cyclic structure are not supported",
    "CYCLICMODE": "cyclic symmetry is not supported",
}
Nodes = Callable[[str, Card], Ints]
Target = tuple[str, str]  # set or node number in upper case, and its scope


@dataclass(frozen=True)
class PressureLoad:
    """Pressure on a surface, or on one side of a set of cells."""

    who: str
    label: str
    value: float
    card: Card
    step: int


@dataclass(frozen=True)
class GravityLoad:
    """Acceleration of gravity on a set of elements, or on all elements if `who` is empty."""

    who: str
    vector: Vector
    card: Card
    step: int


@dataclass(frozen=True)
class PrescribedDisplacement:
    """Prescribed displacement component: its value, and the step that prescribed it."""

    who: str
    value: float
    card: Card
    step: int


@dataclass(frozen=True)
class NodalForce:
    """Force component at each node of a set."""

    who: str
    value: float
    card: Card
    step: int


@dataclass
class AccumulatedLoads:
    """All supports and loads of a deck up to a step.

    Later steps replace displacements and forces of a set; forces of one step add up.
    """

    amplitudes: Amplitudes = field(default_factory=Amplitudes)
    times: StepTimes = field(default_factory=lambda: StepTimes(1.0, 1.0))
    moved: dict[tuple[Target, int], PrescribedDisplacement] = field(
        default_factory=dict
    )  # by set and component, in order
    forced: dict[tuple[Target, int], NodalForce] = field(default_factory=dict)
    presses: list[PressureLoad] = field(default_factory=list)
    weights: list[GravityLoad] = field(default_factory=list)
    step: int = 0
    taken: list[str] = field(default_factory=list)

    def in_next_step(self, times: StepTimes) -> AccumulatedLoads:
        """Return a copy of the supports and loads, to which the next step is added."""
        return replace(self, times=times, moved=dict(self.moved), forced=dict(self.forced), presses=list(self.presses),
                       weights=list(self.weights), step=self.step + 1, taken=list(self.taken))  # fmt: skip

    def take(self, card: Card) -> list[NotImported]:
        """Add one card, and return those of its parts that are not imported. Raises DeckError."""
        anew = card.options.get("OP", "MOD").upper()
        if anew == "NEW":
            self._remove_earlier(card.keyword)
        elif anew != "MOD":
            return [
                NotImported(f"{card.title} on {len(card.lines)} lines", f"OP={anew} is neither MOD nor NEW", card.line)
            ]
        unknown = card.unknown_options(READ)
        if card.options.get("TYPE", "DISPLACEMENT").upper() != "DISPLACEMENT":
            unknown.insert(0, "TYPE")
        if unknown:
            kind = f"{unknown[0]}={card.options[unknown[0]]}" if card.options[unknown[0]] else unknown[0]
            why = WHY.get(unknown[0], "is not supported and may change the meaning of the load")
            why = f"{kind}: {why}" if unknown[0] in WHY else f"{kind} {why}"
            return [NotImported(f"{card.title} on {len(card.lines)} lines", why, card.line)]
        factor = 1.0
        if (name := card.options.get("AMPLITUDE")) is not None:
            curve = self.amplitudes.factor(name, self.times)
            if isinstance(curve, str):
                return [NotImported(f"{card.title} on {len(card.lines)} lines", curve, card.line)]
            factor = curve
            self.taken.append(
                f"{card.title} in line {card.line} has the amplitude `{name}`: values in the scene are multiplied by "
                f"{factor:.12g}, the factor at the end of the step"
            )
        return [left for row in card.each_row() if row for left in self._row(card, row, factor)]

    def _remove_earlier(self, keyword: str) -> None:
        """Apply OP=NEW, which removes loads of earlier steps and keeps other cards of the same step."""
        if keyword == "BOUNDARY":
            self.moved = {key: own for key, own in self.moved.items() if own.step == self.step}
        elif keyword == "CLOAD":
            self.forced = {key: own for key, own in self.forced.items() if own.step == self.step}
        else:
            self.presses = [p for p in self.presses if p.card.keyword != keyword or p.step == self.step]
            self.weights = [w for w in self.weights if w.card.keyword != keyword or w.step == self.step]

    def _row(self, card: Card, row: list[str], factor: float) -> Iterator[NotImported]:
        if len(row) < 2:
            raise card.error(f"a line of {card.title} is too short: `{', '.join(row)[:60]}`")
        if card.keyword == "BOUNDARY":
            yield from self._boundary(card, row, factor)
        elif card.keyword == "CLOAD":
            yield from self._add_nodal_force(card, row, factor)
        else:
            yield from self._distributed(card, row, factor)

    def _boundary(self, card: Card, row: list[str], factor: float) -> Iterator[NotImported]:
        word = row[1].upper()
        if word in NAMED:
            for c in NAMED[word]:
                self._prescribe_displacement(row[0], c, 0.0, card)
            return
        if word in SHELLS:
            yield NotImported(f"{word} of *BOUNDARY on `{row[0]}`", "it applies to pipe elements", card.line)
            return
        if not word.isdigit():
            raise card.error(f"`{row[1][:40]}` is neither a direction nor a named type of *BOUNDARY",
                             f"use directions 1 to 3, or {', '.join(NAMED)}")  # fmt: skip
        first = read_integer(row[1], card)
        last = read_integer(row[2], card) if len(row) > 2 and row[2] else first
        value = factor * read_number(row[3], card) if len(row) > 3 and row[3] else 0.0
        for c in range(max(first, 1), min(last, 3) + 1):
            self._prescribe_displacement(row[0], c - 1, value, card)
        if first < 1 or last < first or (last > 3 and (value or last > 6 or first > 3)):
            beyond = first if first < 1 or first > 3 else last
            why = (
                "it is not a displacement" if beyond > 6 or beyond < 1 else "nodes of solid elements have no rotations"
            )
            yield NotImported(f"direction {beyond} of *BOUNDARY on `{row[0]}`", why, card.line)

    def _prescribe_displacement(self, who: str, component: int, value: float, card: Card) -> None:
        key = _target_key(who, card), component
        self.moved.pop(key, None)
        self.moved[key] = PrescribedDisplacement(who, value, card, self.step)

    def _add_nodal_force(self, card: Card, row: list[str], factor: float) -> Iterator[NotImported]:
        component, value = read_integer(row[1], card), factor * read_number(row[2], card) if len(row) > 2 else 0.0
        if 1 <= component <= 3:
            key = _target_key(row[0], card), component - 1
            before = self.forced.get(key)
            added = before.value if before is not None and before.step == self.step else 0.0
            self.forced[key] = NodalForce(row[0], value + added, card, self.step)
        else:
            why = "nodes of solid elements have no rotations" if 4 <= component <= 6 else "it is not a force component"
            yield NotImported(f"direction {component} of *CLOAD on `{row[0]}`", why, card.line)

    def _distributed(self, card: Card, row: list[str], factor: float) -> Iterator[NotImported]:
        label, values = row[1].upper(), row[2:]
        if label == "GRAV" and len(values) >= 4:
            size, *along = (read_number(w, card) if w else 0.0 for w in values[:4])
            length = float(np.linalg.norm(along))
            if length > 0.0:
                x, y, z = (factor * size * a / length for a in along)
                self.weights = [w for w in self.weights if w.who != row[0] or w.step == self.step]
                self.weights.append(GravityLoad(row[0], (x, y, z), card, self.step))
                return
        elif label == "P" or (label[:1] == "P" and label[1:].isdigit()):
            value = factor * read_number(values[0], card) if values else 0.0
            same = [p for p in self.presses if (p.who, p.label) == (row[0], label)]
            if any(p.step == self.step for p in same):
                yield NotImported(
                    f"repeated `{label}` on `{row[0]}`", "programs differ in whether the loads are added", card.line
                )
                return
            self.presses = [p for p in self.presses if p not in same]
            self.presses.append(PressureLoad(row[0], label, value, card, self.step))
            return
        why = "only P, P1 to P6 and GRAV are supported" if label != "GRAV" else "magnitude or direction is missing"
        yield NotImported(f"`{label}` of {card.title} on `{row[0]}`", why, card.line)

    # -------------------------------------------------------------- totals of all steps

    def surfaces_pressed(self) -> set[str]:
        """Return the names of surfaces under pressure, in upper case."""
        return {p.who.upper() for p in self.presses if p.card.keyword == "DSLOAD"}

    def holds(self, nodes: Nodes) -> list[NodeSupport]:
        """Return the supports: one per set, or grouped by node if sets prescribe different values there."""
        by_set: dict[tuple[Target, bool], dict[int, float]] = {}
        members: dict[Target, Ints] = {}
        names: dict[Target, str] = {}
        told: dict[tuple[int, int], float] = {}
        clear = True
        for (target, c), own in self.moved.items():
            if target not in members:
                members[target], names[target] = nodes(own.who, own.card), own.who
            by_set.setdefault((target, own.value != 0.0), {})[c] = own.value
            for node in members[target].tolist():
                clear = clear and told.get((node, c), own.value) == own.value
                told[node, c] = own.value
        if not clear or any(who.isdigit() for who in names.values()):
            return group_equal_supports(told)
        found = [NodeSupport(names[target], members[target], tuple(sorted(own)), tuple(own[c] for c in sorted(own)))
                 for (target, _), own in by_set.items()]  # fmt: skip
        return [hold for hold in found if len(hold.nodes)]

    def forces(self, nodes: Nodes) -> list[NodeForces]:
        """Return the total force of each node. Raises NotImportable."""
        told: dict[tuple[int, int], tuple[float, int]] = {}
        for (_, c), own in self.forced.items():
            for node in nodes(own.who, own.card).tolist():
                before, then = told.get((node, c), (0.0, own.step))
                if then != own.step:
                    raise NotImportable(
                        f"*CLOAD in line {own.card.line}: a node is loaded through several sets in several steps",
                        "write one step with all loads",
                    )
                told[node, c] = (before + own.value, own.step)
        total: dict[int, list[float]] = {}
        for (node, c), (value, _) in told.items():
            total.setdefault(node, [0.0, 0.0, 0.0])[c] = value
        return group_equal_forces(sorted(total.items()))


def _target_key(who: str, card: Card) -> Target:
    return who.upper(), f"{card.scope.kind}:{card.scope.name}" if card.scope is not None else ""


def group_equal_forces(told: Iterable[tuple[int, Sequence[float]]]) -> list[NodeForces]:
    """Group nodes that have equal forces into one set, and drop zero forces.

    `told` has pairs of the index of a node and its force (3,).
    """
    by_vector: dict[Vector, list[int]] = {}
    for node, (x, y, z) in told:
        if x or y or z:
            by_vector.setdefault((x, y, z), []).append(node)
    return [NodeForces("force", np.array(own, dtype=np.int64), vector) for vector, own in by_vector.items()]


def group_equal_supports(told: dict[tuple[int, int], float]) -> list[NodeSupport]:
    """Group prescribed displacements, given by (node, component), into supports of sets of nodes.

    Components that have the same set of nodes, and are all zero or all nonzero, become one support.
    """
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
        found.append(NodeSupport(name, arrays[key], tuple(c for c, _ in each), tuple(v for _, v in each)))
    return found
