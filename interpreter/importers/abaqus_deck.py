"""Reader of common CalculiX and Abaqus decks (`.inp`): static analyses of solids.

Where the two programs interpret a card differently, CalculiX's meaning is used and reported.
Source: Dhondt, "CalculiX CrunchiX User's Manual", version 2.20; Abaqus Analysis User's Guide.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from softmark.interpreter.importers import abaqus_materials, unreferenced_deck_sets
from softmark.interpreter.importers.abaqus_loads import AccumulatedLoads
from softmark.interpreter.importers.deck_amplitudes import Amplitudes, StepTimes, read_amplitude
from softmark.interpreter.importers.imported_deck import (
    Deck,
    FaceLoad,
    ImportedLaw,
    Ints,
    MaterialPart,
    NotImportable,
    NotImported,
)
from softmark.references.measured_data import Unreadable
from softmark.solvers.elements import ELEMENTS
from softmark.solvers.mesh.files.abaqus.deck_mesh import DeckMesh, MeshBuilder
from softmark.solvers.mesh.files.abaqus.element_types import meshio_cell_name
from softmark.solvers.mesh.files.abaqus.keyword_lines import Card, DeckError, UnsupportedDeck, read_cards, read_number

KINDS = {ELEMENTS[kind].meshio: kind for kind in ("tet4", "tet10", "hex8", "hex20")}
PLAIN = {"tetra": "C3D4", "tetra10": "C3D10", "hexahedron": "C3D8", "hexahedron20": "C3D20"}
SILENT = frozenset({
    "HEADING", "PREPRINT", "NODEPRINT", "NODEFILE", "NODEOUTPUT", "ELPRINT", "ELFILE", "ELEMENTOUTPUT", "OUTPUT",
    "RESTART", "CONTROLS", "CONTACTPRINT", "CONTACTFILE", "CONTACTOUTPUT", "SECTIONPRINT", "SECTIONFILE", "FILEFORMAT",
    "FILEOUTPUT", "MONITOR", "ENERGYPRINT", "ENERGYFILE", "ENERGYOUTPUT", "INTEGRATEDOUTPUT", "PRINT", "NODALENERGY",
    "SOLVERCONTROLS", "DIAGNOSTICS", "SYSTEM",
})  # fmt: skip
OTHERWISE = {  # cards that change the meaning of others: decks with them are refused
    "TRANSFORM": "supports and forces at some nodes are in local directions",
    "SUBMODEL": "it depends on the results of another model",
}  # fmt: skip
WHY = {  # reasons for common cards that are not read
    "TIE": "ties are not imported: declare `contact glue = tied(body)`, which ties coincident surfaces",
    "CONTACTPAIR": "contact is not imported: declare `contact c = self_contact(body)` between pieces of one body",
    "CONTACT": "contact is not imported: declare `contact c = self_contact(body)` between pieces of one body",
    "COUPLING": "supports and loads at reference points are not supported",
    "RIGIDBODY": "supports and loads at reference points are not supported",
    "MPC": "constraint equations between nodes are not supported",
    "EQUATION": "constraint equations between nodes are not supported",
    "TEMPERATURE": "temperatures are not supported",
    "INITIALCONDITIONS": "a scene starts at rest and free of stress",
    "SHELLSECTION": "only solid elements are supported",
    "BEAMSECTION": "only solid elements are supported",
    "MEMBRANESECTION": "only solid elements are supported",
}  # fmt: skip
OTHER_STEPS = frozenset({
    "DYNAMIC", "FREQUENCY", "BUCKLE", "MODALDYNAMIC", "HEATTRANSFER", "COUPLEDTEMPERATURE-DISPLACEMENT", "VISCO",
    "STEADYSTATEDYNAMICS", "UNCOUPLEDTEMPERATURE-DISPLACEMENT", "COMPLEXFREQUENCY", "GREEN", "SENSITIVITY",
    "COUPLEDTHERMAL-ELECTRIC", "SOILS", "GEOSTATIC", "MASSDIFFUSION", "RANDOMRESPONSE", "RESPONSESPECTRUM",
    "SUBSTRUCTUREGENERATE", "ANNEAL", "DIRECTCYCLIC", "ELECTROMAGNETICS", "CFD", "CRACKPROPAGATION",
    "FEASIBLEDIRECTION",
})  # fmt: skip
STATIC_OPTIONS = frozenset({"DIRECT", "SOLVER", "ALLSDTOL", "CONTINUE", "EXPLICIT", "TIMERESET", "TOTALTIMEATSTART"})
SECTION_OPTIONS = frozenset({"ELSET", "MATERIAL", "CONTROLS"})
ONLY_C3D8 = "C3D8 is fully integrated, as in CalculiX; Abaqus uses the mean volume change"
ACTING = frozenset({"BOUNDARY", "CLOAD", "DLOAD", "DSLOAD"})


def read(path: Path) -> Deck:
    """Read a deck. Raises Unreadable, NotImportable."""
    try:
        builder, reader = MeshBuilder(), _Reader()
        for card in read_cards(path):
            scoped = replace(card, scope=builder.scope)
            if not builder.take(card):
                reader.take(scoped)
        return reader.deck(builder.finish(path.name))
    except UnsupportedDeck as error:
        raise NotImportable(f"{error.place}: {error.reason}", error.remedy or "") from None
    except DeckError as error:
        raise Unreadable(error.place, error.reason, error.remedy or "") from None


@dataclass
class _Step:
    """Step of an analysis: its cards, its kind of analysis, and its duration."""

    card: Card
    cards: list[Card] = field(default_factory=list)
    other: Card | None = None  # a card of an analysis that is not static
    static: Card | None = None
    ended: bool = False

    @property
    def period(self) -> float:
        """Duration of the step, in the time unit of the deck."""
        rows = self.static.rows if self.static is not None else []
        word = rows[0][1] if rows and len(rows[0]) > 1 else ""
        value = read_number(word, self.static) if word and self.static is not None else 0.0
        return value if value > 0.0 else 1.0

    @property
    def finite(self) -> bool:
        """True if the step uses large displacements (NLGEOM)."""
        told = self.card.options.get("NLGEOM")
        return told is not None and (told or "YES").upper() not in ("NO", "OFF")


class _Reader:
    """Collector of the cards that do not define the mesh, in their order; combines them with the mesh."""

    def __init__(self) -> None:
        self.materials: dict[str, abaqus_materials.MaterialCards] = {}
        self.material: abaqus_materials.MaterialCards | None = None
        self.sections: list[Card] = []
        self.before: list[Card] = []  # supports and loads of all steps
        self.steps: list[_Step] = []
        self.amplitudes = Amplitudes({})
        self.left: list[NotImported] = []
        self.loads = AccumulatedLoads()
        self.finite = self.static = False
        self.taken: list[str] = []

    def take(self, card: Card) -> None:
        """Add one card. Raises DeckError, NotImportable."""
        step = self.steps[-1] if self.steps and not self.steps[-1].ended else None
        if card.keyword in OTHERWISE:
            raise NotImportable(f"{card.title} in line {card.line}: {OTHERWISE[card.keyword]}",
                          "remove the card, and give supports and forces along x, y and z")  # fmt: skip
        if card.keyword in abaqus_materials.CARDS and self.material is not None:
            self.material.cards.append(card)
            return
        if card.keyword not in SILENT:
            self.material = None
        if card.keyword == "MATERIAL":
            self.material = abaqus_materials.MaterialCards(card, [])
            self.materials[card.options.get("NAME", "").upper()] = self.material
        elif card.keyword == "SOLIDSECTION":
            self._section(card)
        elif card.keyword == "AMPLITUDE":
            self.amplitudes = Amplitudes({**self.amplitudes.curves, card.options.get("NAME", "").upper():
                                          read_amplitude(card)})  # fmt: skip
        elif card.keyword == "STEP":
            if step is not None:
                raise step.card.error("the step that starts here has no *END STEP")
            self.steps.append(_Step(card))
        elif card.keyword == "ENDSTEP" and step is not None:
            step.ended = True
        elif card.keyword in ACTING:
            (step.cards if step is not None else self.before).append(card)
        elif card.keyword == "STATIC" and step is not None:
            self._static(card, step)
        elif card.keyword in OTHER_STEPS:
            if step is not None:
                step.other = card
            else:
                self.left.append(NotImported(card.title, "it is outside of a step", card.line))
        elif card.keyword not in SILENT:
            self.left.append(NotImported(card.title, WHY.get(card.keyword, "not supported"), card.line))

    def _section(self, card: Card) -> None:
        for option in card.unknown_options(SECTION_OPTIONS):
            why = {"ORIENTATION": "material orientations are not supported",
                   "COMPOSITE": "composite layers are not supported"}.get(option, "not supported")  # fmt: skip
            self.left.append(NotImported(f"{option} of *SOLID SECTION", why, card.line))
        self.sections.append(card)

    def _static(self, card: Card, step: _Step) -> None:
        step.static = card
        if "RIKS" in card.options:
            self.left.append(
                NotImported(
                    "RIKS of *STATIC",
                    "a RIKS step may end before the full load; use `static(path = arc_length)` to follow the path",
                    card.line,
                )
            )
        for option in card.unknown_options(STATIC_OPTIONS | {"RIKS"}):
            self.left.append(NotImported(f"{option} of *STATIC", "the scene is solved without this option", card.line))

    # -------------------------------------------------------------- steps

    def _follow_steps(self) -> None:
        """Accumulate supports and loads up to the end of the last static step. Raises DeckError."""
        if self.steps and not self.steps[-1].ended:
            raise self.steps[-1].card.error("the step that starts here has no *END STEP")
        kept = [step for i, step in enumerate(self.steps) if self._accept_step(step, i)]
        total = sum(step.period for step in kept) or 1.0
        self.loads = AccumulatedLoads(self.amplitudes, StepTimes(0.0, total))
        for card in self.before:
            self.left += self.loads.take(card)
        for step in kept:
            self.finite |= step.finite and "PERTURBATION" not in step.card.options
            self.static |= step.static is not None
            self.loads = self.loads.in_next_step(StepTimes(step.period, total))
            for card in step.cards:
                self.left += self.loads.take(card)
        if len(self.steps) > 1:
            self.taken.append(
                f"of {len(self.steps)} steps, the scene contains the loads and supports at the end of the last "
                f"*STATIC step"
            )
        self.taken += self.loads.taken

    def _accept_step(self, step: _Step, number: int) -> bool:
        what = step.other
        if what is None and "PERTURBATION" in step.card.options:
            if number == 0 and step.static is not None:  # a linear step, before which no load acts
                self.taken.append(
                    f"the step in line {step.card.line} is a linear perturbation of the undeformed body: small strain"
                )
                return True
            what = step.card
        if what is None:
            return True
        kind = what.title if what is step.other else "PERTURBATION"
        self.left.append(NotImported(f"a step of {kind}", "only *STATIC steps are imported", what.line))
        return False

    # -------------------------------------------------------------- combination with the mesh

    def deck(self, mesh: DeckMesh) -> Deck:
        """Return the whole deck as a record. Raises DeckError, NotImportable."""
        self._follow_steps()
        body = _Body(mesh, self.left)
        found = body.deck
        found.static = self.static
        found.parts = list(self._material_parts(body))
        found.strain = "finite" if self.finite or any(_is_nonlinear_law(p.law) for p in found.parts) else "small"
        if found.strain == "finite":
            found.parts = [abaqus_materials.with_finite_strain_law(part) for part in found.parts]
        found.left += [NotImported(own.what, own.why, own.line) for own in mesh.ignored]
        found.left += [NotImported(f"the part `{name[:60]}`", "no instance of it exists") for name in mesh.unplaced]
        self._note_assumptions(found)
        self._apply_loads(body)
        self._name_sets(body)
        found.taken += mesh.taken
        return found

    def _material_parts(self, body: _Body) -> Iterator[MaterialPart]:
        owner = np.full(len(body.deck.cells), -1)
        named: list[str] = []
        laws: dict[str, tuple[ImportedLaw | None, str]] = {}  # law of each material, or why there is none
        for card in self.sections:
            elset, material = card.options.get("ELSET", ""), card.options.get("MATERIAL", "").upper()
            if not elset:
                raise card.error("*SOLID SECTION has no element set", "add ELSET=NAME")
            if not len(which := body.cells(elset, card)):
                continue
            owner[which] = len(named)
            if material not in laws:
                laws[material] = self._law_or_reason(material, card)
            named.append(material)
        for name, law in laws.items():
            if len(own := np.flatnonzero(np.isin(owner, [i for i, told in enumerate(named) if told == name]))):
                yield MaterialPart(name, own, *law)
        if len(rest := np.flatnonzero(owner == -1)):
            why = f"they have no *SOLID SECTION; the first is {body.mesh.describe_element(int(body.elements[rest[0]]))}"
            self.left.append(NotImported(f"the material of {len(rest)} cells", why))
            yield MaterialPart("rest", rest, None, why)

    def _law_or_reason(self, material: str, card: Card) -> tuple[ImportedLaw | None, str]:
        """Return the law of a material, or None and the reason why there is none. Raises DeckError."""
        if (told := self.materials.get(material)) is None:
            why = f"the material `{material[:60]}` is not defined" if material else "its section has no material"
            self.left.append(NotImported(f"the material `{material[:60]}`", "not defined", card.line))
            return None, why
        before = len(self.left)
        law = abaqus_materials.read_law(told, self.left)
        reason = self.left[-1] if law is None and len(self.left) > before else None
        return law, f"{reason.what}: {reason.why}" if reason is not None else ""

    def _note_assumptions(self, found: Deck) -> None:
        laws = [p.law for p in found.parts if p.law is not None]
        if found.strain == "finite" and any(law.word == "st_venant_kirchhoff" for law in laws):
            found.taken.append(
                "*ELASTIC with NLGEOM is read as St Venant-Kirchhoff, as in CalculiX; Abaqus uses another law at "
                "large strain"
            )
        if found.strain == "finite" and not self.finite:
            found.taken.append("*HYPERELASTIC without NLGEOM is read with finite strain, as in CalculiX")
        if found.kind == "hex8":
            found.taken.append(ONLY_C3D8)
        found.taken += self.taken

    def _apply_loads(self, body: _Body) -> None:
        found = body.deck
        found.holds = self.loads.holds(body.nodes)
        found.forces = self.loads.forces(body.nodes)
        for press in self.loads.presses:
            faces = (body.surface(press.who, press.card) if press.card.keyword == "DSLOAD" else
                     body.sides([(body.cells(press.who, press.card), press.label, press.who)], press.card))  # fmt: skip
            border = faces[found.sides.border.reshape(len(found.cells), -1)[faces[:, 0], faces[:, 1]]]
            if len(border) < len(faces):
                why = "faces between two cells are not on the surface"
                found.left.append(NotImported(f"pressure on {len(faces) - len(border)} faces", why, press.card.line))
            if len(border):
                found.pushes.append(FaceLoad(press.who or "surface", border, press.value))
        self._merge_gravity_loads(body)

    def _merge_gravity_loads(self, body: _Body) -> None:
        """Replace gravity loads on sets that together form the whole body by one load on the body."""
        cells: dict[tuple[float, float, float], list[Ints]] = {}
        cards: dict[tuple[float, float, float], tuple[Card, str]] = {}
        for weight in self.loads.weights:
            cells.setdefault(weight.vector, []).append(body.cells(weight.who, weight.card))
            cards[weight.vector] = weight.card, weight.who
        for vector, own in cells.items():
            whole = np.concatenate(own)
            if len(np.unique(whole)) < len(body.deck.cells):
                card, who = cards[vector]
                self.left.append(
                    NotImported(f"GRAV on the set `{who}`", "gravity can only act on the whole body", card.line)
                )
                continue
            body.deck.weights += [vector] * (len(whole) // len(body.deck.cells))
            if len(whole) % len(body.deck.cells):
                card, who = cards[vector]
                self.left.append(
                    NotImported(
                        f"repeated GRAV on the set `{who}`", "gravity can only act on the whole body", card.line
                    )
                )

    def _name_sets(self, body: _Body) -> None:
        """Add named sets, surfaces and materials that nothing else refers to."""
        found, mesh = body.deck, body.mesh
        for name, definition, own in mesh.named_sets("elements"):
            if id(definition) not in body.used and not definition.internal:
                unreferenced_deck_sets.add_cell_set(found, name, body.places(own))
        for name, definition, own in mesh.named_sets("nodes"):
            if id(definition) not in body.used and not definition.internal:
                nodes = body.node_places[own]
                unreferenced_deck_sets.add_node_set(found, name, nodes[nodes >= 0])
        for name, surface, rows in mesh.named_surfaces():
            if id(surface) not in body.used and "INTERNAL" not in surface.card.options:
                sides = [(body.places(own), side, who) for own, side, who in rows]
                unreferenced_deck_sets.add_face_set(found, name, body.sides(sides, surface.card))
        made_of = {card.options.get("MATERIAL", "").upper() for card in self.sections}
        for name, told in self.materials.items():
            if name not in made_of:
                found.left.append(
                    NotImported(f"the material `{name[:60]}`", "no cells have this material", told.card.line)
                )


def _is_nonlinear_law(law: ImportedLaw | None) -> bool:
    return law is not None and law.word != "linear_elastic"


class _Body:
    """Solid cells of a deck, which looks up named sets among them."""

    def __init__(self, mesh: DeckMesh, left: list[NotImported]) -> None:
        self.mesh = mesh
        self.used: set[int] = set()  # definitions that are referred to
        solids = {cell: mesh.cells[cell] for cell in KINDS if cell in mesh.cells}
        self._refuse_others(solids, left)
        ((cell, own),) = solids.items()
        used, cells = np.unique(own.nodes, return_inverse=True)
        self.elements = own.elements
        self.node_places = np.full(len(mesh.points), -1, dtype=np.int64)
        self.node_places[used] = np.arange(len(used))
        table = cells.reshape(own.nodes.shape).astype(np.int64)
        self.deck = Deck(mesh.name, KINDS[cell], mesh.points[used], table, [], left=left)

    def _refuse_others(self, solids: Mapping[str, object], left: list[NotImported]) -> None:
        """Refuse decks whose solids have no cells or several kinds, and list elements that are not solids."""
        others, name = 0, self.mesh.name
        for kind, (card, many) in self.mesh.kinds.items():
            cell = meshio_cell_name(kind)
            if cell in KINDS and kind.startswith("C3D"):
                if kind != PLAIN[cell]:
                    why = f"is imported as {PLAIN[cell]} with full integration, without its special formulation"
                    left.append(NotImported(kind, why, card.line))
            elif kind.startswith("C3D"):
                raise NotImportable(f"{kind} in line {card.line} are not supported as cells",
                              "use tetrahedra with 4 or 10 nodes, or hexahedra with 8 or 20 nodes")  # fmt: skip
            else:
                others += many
                left.append(
                    NotImported(f"{many} elements {kind or '*ELEMENT'}", "only solid elements are supported", card.line)
                )
                if cell in solids:
                    raise NotImportable(f"{kind} in line {card.line} are not solid elements for stress analysis",
                                  "use C3D4, C3D10, C3D8 or C3D20")  # fmt: skip
        if not solids:
            words = f" ({others} elements of other kinds)" if others else ""
            raise NotImportable(f"{name} has no tetrahedra or hexahedra{words}",
                          "only solid elements are imported: C3D4, C3D10, C3D8 and C3D20")  # fmt: skip
        if len(solids) > 1:
            raise NotImportable(f"{name} has several kinds of cells: {', '.join(sorted(PLAIN[c] for c in solids))}",
                          "a model has cells of one kind: write one deck for each")  # fmt: skip

    def _mark_set_used(self, kind: str, word: str, card: Card) -> None:
        for space, name in self.mesh.find_sets("nodes" if kind == "nodes" else "elements", word, card, card.scope):
            own = space.definition("nodes" if kind == "nodes" else "elements", name.upper())
            if own is not None:
                self.used.add(id(own))

    def places(self, elements: Ints) -> Ints:
        """Return the indices (k,) of the body's cells that are among the given `elements` of the model."""
        place = np.minimum(np.searchsorted(self.elements, elements), len(self.elements) - 1)
        found: Ints = place[self.elements[place] == elements]
        return found

    def cells(self, name: str, card: Card) -> Ints:
        """Return the cells (k,) of a named set, or all cells without a name. Raises DeckError."""
        if not name:
            return np.arange(len(self.deck.cells))
        self._mark_set_used("elements", name, card)
        return self.places(self.mesh.members("elements", name, card, card.scope))

    def nodes(self, name: str, card: Card) -> Ints:
        """Return the nodes (k,) of the body in a named set or with a number. Raises DeckError.

        Nodes outside the body are listed as not imported.
        """
        self._mark_set_used("nodes", name, card)
        own = self.mesh.members("nodes", name, card, card.scope)
        if not len(own):
            self.deck.left.append(NotImported(f"{card.title} on `{name[:60]}`", "it has no nodes", card.line))
        places = self.node_places[own]
        if lost := int((places < 0).sum()):
            why = "they belong to no solid cell, for example reference points"
            self.deck.left.append(NotImported(f"{card.title} on {lost} nodes (`{name[:60]}`)", why, card.line))
        found: Ints = np.sort(places[places >= 0])
        return found

    def surface(self, name: str, card: Card) -> Ints:
        """Return the faces (f, 2) of a named surface. Raises DeckError."""
        rows = list(self.mesh.surface_rows(name, card, card.scope))
        self.used |= {id(own) for own in self.mesh.find_surfaces(name, card, card.scope)}
        return self.sides([(self.places(elements), label, who) for elements, label, who in rows], card)

    def sides(self, rows: list[tuple[Ints, str, str]], card: Card) -> Ints:
        """Return the faces (f, 2) of cells at labelled sides such as S3 or P3; list invalid labels as not imported."""
        count = len(ELEMENTS[self.deck.kind].facets)
        faces = [np.zeros((0, 2), dtype=np.int64)]
        for cells, label, who in rows:
            if not label[1:].isdigit() or not 1 <= int(label[1:]) <= count:
                self.deck.left.append(NotImported(f"`{who}, {label}`", "not a face of a solid element", card.line))
                continue
            faces.append(np.stack([cells, np.full(len(cells), int(label[1:]) - 1)], axis=1))
        found: Ints = np.unique(np.concatenate(faces), axis=0)
        return found
