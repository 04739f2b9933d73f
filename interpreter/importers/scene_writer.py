"""Writer of an imported record as a scene in canonical form, followed by the items that were not imported."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from softmark.grammar.diagnostic import Source, make_visible
from softmark.grammar.parser import parse
from softmark.grammar.printer import format_source
from softmark.interpreter.importers import imported_mesh
from softmark.interpreter.importers.deck_units import FileUnits, MissingUnit
from softmark.interpreter.importers.imported_deck import (
    Deck,
    EndedLoad,
    FaceLoad,
    Ints,
    MaterialPart,
    NodeForces,
    NodeSupport,
    NotImportable,
    NotImported,
)
from softmark.solvers.mesh.files.mesh_validation import (
    find_coincident_nodes,
    find_components,
    find_overlap,
    format_position,
)
from softmark.solvers.mesh.mesh import Mesh

FORCES = 10_000  # maximum number of nodal forces; each takes some 7 ms of a run
DOUBLED = "some coincide with other nodes, and a scene selects nodes by position"
DUST = 1e-16  # relative to the largest force: smaller ones are round-off
WIDE = 100
ANY_DENSITY = "1000.0 kg/m^3"  # density for materials without one, where no result depends on it
NO_DENSITY = (
    f"a material has no density; the scene uses {ANY_DENSITY}, which does not affect a static analysis without gravity"
)


@dataclass(frozen=True)
class SuppliedValues:
    """Values that a file lacks and the user supplies: a material for cells without one, a density for laws."""

    material: str | None = None  # a constructor of the language
    density: str | None = None  # a quantity


class MissingValue(Exception):
    """Exception for a value that a scene requires and the file lacks; it has the reason and how to supply the value."""

    def __init__(self, reason: str, remedy: str) -> None:
        super().__init__(reason)
        self.reason, self.remedy = reason, remedy


@dataclass(frozen=True)
class WrittenScene:
    """Text of a scene and of its mesh file (None if that exists already), and the items that were not imported.

    `turned` reports inverted cells, if any; `taken` are the choices made where the file is ambiguous.
    """

    scene: str
    mesh: str | None
    left: tuple[NotImported, ...]
    turned: str | None
    taken: tuple[str, ...] = ()
    ended: tuple[EndedLoad, ...] = ()


def write_scene(deck: Deck, units: FileUnits, filled: SuppliedValues, mesh_name: str) -> WrittenScene:
    """Return the scene of a record; `mesh_name` is the name of its mesh.

    Raises MissingUnit, MissingValue, NotImportable.
    """
    _count_pieces(deck)
    writer = _Writer(deck, units, filled, mesh_name)
    lines = list(writer.lines())
    mesh = None
    if deck.mesh is None:
        mesh = imported_mesh.mesh_text(
            deck.kind, deck.points, deck.cells, writer.sets, writer.surfaces, writer.node_sets
        )
    left, turned, taken = (
        _merge_repeated(deck.left),
        _report_inverted_cells(deck, units),
        tuple(dict.fromkeys(deck.taken)),
    )
    deck.taken = [*taken, *([] if turned is None else [f"{turned}: a scene turns them"])]
    text = "\n".join([*lines, "", *_notes(deck, left)]).rstrip() + "\n"
    scene = format_source(Source(deck.title, text))
    return WrittenScene(scene, mesh, left, turned, taken, tuple(dict.fromkeys(deck.ended)))


def _merge_repeated(every: Sequence[NotImported]) -> tuple[NotImported, ...]:
    """Return the items that were not imported, equal ones merged into one with their number."""
    return tuple(
        own if many == 1 else replace(own, what=f"{own.what}, {many} times") for own, many in Counter(every).items()
    )


def _count_pieces(deck: Deck) -> None:
    """Count the separate pieces of a body and report their connections.

    Raises NotImportable if a scene would refuse the mesh.
    """
    width = deck.cells.shape[1]
    part = find_components(len(deck.points), np.repeat(deck.cells[:, 0], width - 1), deck.cells[:, 1:].ravel())
    deck.pieces = len(np.unique(part[deck.cells[:, 0]]))
    if deck.pieces == 1:
        return
    if deck.mesh is not None:
        raise NotImportable(f"{deck.title} has {deck.pieces} pieces that share no nodes",
                      "declare the body yourself, with `pieces = keep` of `mesh(...)`")  # fmt: skip
    if (place := find_overlap(Mesh(deck.points, deck.cells, deck.kind))) is not None:
        where = ", ".join(f"{v:g}" for v in place[0].tolist())
        raise NotImportable(f"{deck.title} has {deck.pieces} pieces that overlap: ({where}) lies inside two of them",
                      "move the pieces apart, or write each to its own deck")  # fmt: skip
    deck.taken.append(
        f"the body has {deck.pieces} pieces that share no nodes: they are not connected, so each needs supports; "
        f"`contact glue = tied(body)` ties them where they touch, `contact c = self_contact(body)` prevents penetration"
    )


def _report_inverted_cells(deck: Deck, units: FileUnits) -> str | None:
    """Return a text with the number of inverted cells and the place of the first; None if there are none."""
    if not len(own := deck.inverted_cells):
        return None
    middle = deck.points[deck.cells[own[0]]].mean(axis=0) * units.length.factor
    place = format_position(middle)
    return f"{len(own)} of its {len(deck.cells)} cells are inverted, the first one at {place}"


def _notes(deck: Deck, left: Sequence[NotImported]) -> Iterator[str]:
    for ended in dict.fromkeys(deck.ended):
        yield from _comment(f"without effect: {ended.described}")
    for what in deck.taken:
        yield from _comment(f"interpreted: {what}")
    for own in left:
        where = "" if own.line is None else f" (line {own.line})"
        yield from _comment(f"not imported: {own.what}{where}: {own.why}")


def _comment(text: str) -> Iterator[str]:
    line = "#"
    for word in make_visible(text).split():
        if len(line) + 1 + len(word) > WIDE and line != "#":
            yield line
            line = "#    "
        line += f" {word}"
    yield line


@dataclass
class _Writer:
    deck: Deck
    units: FileUnits
    filled: SuppliedValues
    mesh_name: str
    names: set[str] = field(default_factory=set)
    sets: dict[str, Ints] = field(default_factory=dict)
    surfaces: dict[str, Ints] = field(default_factory=dict)
    node_sets: dict[str, Ints] = field(default_factory=dict)

    def name(self, kind: str, told: str) -> str:
        """Return an unused name that is not a word of the language, similar to the name in the file."""
        plain = re.sub(r"\W+", "_", told, flags=re.ASCII).strip("_").lower()[:60]
        first = f"{kind}_{plain}" if plain else kind
        found, i = first, 2
        while found in self.names:
            found, i = f"{first}_{i}", i + 1
        self.names.add(found)
        return found

    def lines(self) -> Iterator[str]:
        """Yield the declarations of the scene. Raises MissingUnit, MissingValue."""
        deck = self.deck
        system = f" ({self.units.system})" if self.units.system else ""
        yield from ("softmark 1", f"scene {_quote_text(deck.title)}", "")
        yield from _comment(f"Imported from {deck.title}{system}; parts that were not imported are listed at the end.")
        yield ""
        parts = sorted(deck.parts, key=lambda part: -len(part.cells))
        materials = [self.name("solid", part.name if part.law else "told") for part in parts]
        for name, part in zip(materials, parts, strict=True):
            yield f"material {name} = {self._material_text(part)}"
        unit = self.units.length.text
        kept = ", coincident = keep" if len(self.coincident_nodes) else ""
        if kept:
            deck.taken.append(f"{len(self.coincident_nodes)} nodes coincide with others but are not connected to them")
        kept += ", pieces = keep" if deck.pieces > 1 else ""
        yield f"body body = solid(mesh({_quote_text(self.mesh_name)}, unit = {unit}{kept}), {materials[0]})"
        for name, part in zip(materials[1:], parts[1:], strict=True):
            region = self.name("part", part.name)
            self.sets[region] = part.cells
            yield f"region {region} = group(body, {_quote_text(region)}, material = {name})"
        for told in deck.groups:
            yield f"region {self.name('group', told)} = group(body, {_quote_text(told)})"
        for own in deck.named:
            region = self.name("group", own.name)
            {"cells": self.sets, "faces": self.surfaces, "nodes": self.node_sets}[own.kind][region] = own.members
            yield f"region {region} = group(body, {_quote_text(region)})"
        yield ""
        yield from self._support_and_load_lines()
        yield ""
        yield from self._model()

    def _model(self) -> Iterator[str]:
        deck = self.deck
        if not deck.holds or not deck.static:
            lacks = "supports the body" if not deck.holds else "is a static analysis"
            yield from _comment(
                f"Nothing in the imported file {lacks}: declare it, with an analysis and a model such as "
                f"`fem({deck.kind}, strain = {deck.strain})`."
            )
            return
        yield "analysis rest = static()"
        kept = f", formulation = {deck.formulation}" if deck.formulation else ""
        yield f"model fe = fem({deck.kind}, strain = {deck.strain}{kept})"

    def _support_and_load_lines(self) -> Iterator[str]:
        deck = self.deck
        if not (deck.holds or deck.pushes or deck.forces or deck.weights):
            return
        for hold in deck.holds:
            yield from self._support_lines(hold)
        for push in deck.pushes:
            yield from self._face_load_lines(push)
        yield from self._nodal_force_lines(deck.forces)
        for vector in deck.weights:
            size = math.sqrt(sum(v * v for v in vector))
            if size > 0.0:
                told = self.units.acceleration_in_si(size)
                yield (f"load {self.name('load', 'weight')} = gravity({told!r} m/s^2, direction = "
                       f"{_vector([v / size + 0.0 for v in vector])})")  # fmt: skip

    def _material_text(self, own: MaterialPart) -> str:
        law, part, cells = own.law, own.name, len(own.cells)
        if law is None:
            why = f" ({own.why})" if own.why else ""
            if self.filled.material is None:
                raise MissingValue(f"{cells} cells (`{part}`) have no imported material{why}",
                              "give their material: `--material 'neo_hookean(young = 60 kPa, poisson = 0.45, "
                              "density = 1000 kg/m^3)'`")  # fmt: skip
            return _supplied_constructor(self.filled.material)
        fields = [f"{name} = {self.units.format_stress(value)}" for name, value in law.stresses.items()]
        fields += [f"{name} = {value!r}" for name, value in law.plain.items()]
        fields += [
            f"{name} = [{', '.join(map(self.units.format_stress, own))}]" for name, own in law.stress_lists.items()
        ]
        fields += [f"{name} = [{', '.join(map(repr, own))}]" for name, own in law.lists.items()]
        if law.density is not None:
            density = self.units.format_density(law.density)
        elif self.filled.density is not None:
            density = self.filled.density
        elif self.deck.static and not self.deck.weights:
            density = ANY_DENSITY
            if NO_DENSITY not in self.deck.taken:
                self.deck.taken.append(NO_DENSITY)
        else:
            raise MissingValue(
                f"the material `{part}` has no density, which a scene requires",
                "give it, `--density 1000kg/m^3`; in static analyses it affects only gravity",
            )
        fields += [f"density = {density}", *(f"{name} = {word}" for name, word in law.choices.items())]
        return f"{law.word}({', '.join(fields)})"

    def _support_lines(self, hold: NodeSupport) -> Iterator[str]:
        faces, alone = self.deck.sides.within(hold.nodes)
        where = self.name("at", hold.name)
        if len(alone):
            self.node_sets[where] = hold.nodes
        else:
            self.surfaces[where] = faces
        yield f"region {where} = group(body, {_quote_text(where)})"
        by = [0.0, 0.0, 0.0]
        for c, value in zip(hold.components, hold.values, strict=True):
            by[c] = value
        moves = any(by)
        along = "" if hold.components == (0, 1, 2) else f", components = {_format_components(hold.components)}"
        vector = f", by = {_vector(by)} {self._unit()}" if moves else ""
        word = "displaced" if moves else "fixed"
        yield f"support {self.name('held', hold.name)} = {word}(body, where = {where}{vector}{along})"

    def _unit(self) -> str:
        number, unit = self.units.length.text.split(" ")
        return unit if number == "1" else f"* {self.units.length.text}"

    @cached_property
    def coincident_nodes(self) -> Ints:
        """Nodes (k,) that coincide with another node, so that their position does not identify them."""
        if self.deck.mesh is not None:
            return np.zeros(0, dtype=np.int64)
        return np.unique(find_coincident_nodes(self.deck.points, self.deck.cells))

    def _face_load_lines(self, push: FaceLoad) -> Iterator[str]:
        region = self.name("at", push.name)
        self.surfaces[region] = push.faces
        yield f"region {region} = group(body, {_quote_text(region)})"
        name = self.name("load", push.name)
        if push.pressure is not None:
            magnitude = self.units.format_stress(push.pressure)
            yield f"load {name} = pressure(body, where = {region}, magnitude = {magnitude})"
        elif push.traction is not None:
            items = ", ".join(self.units.format_stress(v) for v in push.traction)
            yield f"load {name} = traction(body, where = {region}, vector = ({items}))"

    def _nodal_force_lines(self, forces: Sequence[NodeForces]) -> Iterator[str]:
        known = self._forces_at_unique_nodes(self._without_roundoff_forces(forces))
        many = sum(len(force.nodes) for force in known)
        if many > FORCES:
            total = np.sum([len(f.nodes) * np.array(f.force) for f in known], axis=0) * self.units.force_in_newtons(1.0)
            self.deck.left.append(NotImported(f"forces on {many} nodes, {_vector(total.tolist())} N in all",
                                       f"a scene has one declaration per force, at most {FORCES}"))  # fmt: skip
            return
        for force in known:
            vector = _vector([self.units.force_in_newtons(v) for v in force.force])
            for node in force.nodes.tolist():
                at = f"{_vector(self.deck.points[node].tolist())} {self._unit()}"
                yield f"load {self.name('load', force.name)} = point_force(body, at = {at}, vector = {vector} N)"

    def _forces_at_unique_nodes(self, forces: Sequence[NodeForces]) -> list[NodeForces]:
        """Return the forces at nodes with a unique position; list the others as not imported."""
        own = [np.isin(force.nodes, self.coincident_nodes) for force in forces]
        if many := sum(int(double.sum()) for double in own):
            each = (double.sum() * np.array(force.force) for force, double in zip(forces, own, strict=True))
            total = np.sum(list(each), axis=0) * self.units.force_in_newtons(1.0)
            self.deck.left.append(NotImported(f"forces on {many} nodes, {_vector(total.tolist())} N in all", DOUBLED))
        told = (replace(force, nodes=force.nodes[~double]) for force, double in zip(forces, own, strict=True))
        return [force for force in told if len(force.nodes)]

    def _without_roundoff_forces(self, forces: Sequence[NodeForces]) -> list[NodeForces]:
        """Return the forces without round-off residues, which may be smaller than any quantity of a scene."""
        least = DUST * max((abs(v) for force in forces for v in force.force), default=0.0)
        if any(0.0 < abs(v) < least for force in forces for v in force.force):
            self.deck.taken.append(f"force components below {DUST:g} of the largest are set to 0")
        told = []
        for own in forces:
            x, y, z = (v if abs(v) >= least else 0.0 for v in own.force)
            told += [replace(own, force=(x, y, z))] if x or y or z else []
        return told


def _supplied_constructor(told: str) -> str:
    """Return the constructor that the user supplied for a material. Raises MissingValue."""
    tree, problems = parse(Source("--material", f"material told = {told}\n"))
    if problems or len(tree.declarations) != 1 or "\n" in told:
        example = "`--material 'neo_hookean(young = 60 kPa, poisson = 0.45, density = 1000 kg/m^3)'`"
        raise MissingValue(f"`{told}` is not a material in the language of scenes", f"write it like {example}")
    return told


def _format_components(components: tuple[int, ...]) -> str:
    names = ["xyz"[c] for c in components]
    return names[0] if len(names) == 1 else f"({', '.join(names)})"


def _vector(values: Sequence[float]) -> str:
    return f"({', '.join(map(repr, values))})"


def _quote_text(text: str) -> str:
    return '"' + make_visible(text).replace("\\", "\\\\").replace('"', '\\"')[:390] + '"'


__all__ = ["MissingUnit", "MissingValue", "SuppliedValues", "WrittenScene", "write_scene"]
