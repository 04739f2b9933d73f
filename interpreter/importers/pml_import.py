"""Reader of PML with LML, the exchange formats of the 2008 comparison of models.

PML describes a physical model, and LML its loads in a second file. Atoms are points, and a structural component of FEM
cells is a part. A load is a direction times a value, linear between events and constant after the last, whose value the
scene uses. `NULL` leaves a direction free.
Source: Chabanas and Promayon, "Physical Model Language: Towards a Unified Representation for Continuous and Discrete
Models" (2004); the library's readers in SOFA (extlibs/PML, extlibs/LML).
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from softmark.interpreter.importers.abaqus_loads import group_equal_supports
from softmark.interpreter.importers.imported_deck import (
    Deck,
    Floats,
    ImportedLaw,
    Ints,
    MaterialPart,
    NodeForces,
    NotImportable,
    NotImported,
)
from softmark.interpreter.importers.xml_numbers import NumberParser
from softmark.interpreter.models.imported_results.readers.xml_trees import ElementT, parse_xml, resolve_within_folder
from softmark.safe_files import read_regular

KINDS = {"TETRAHEDRON": ("tet4", 4), "HEXAHEDRON": ("hex8", 8)}
STRAINS = {"SMALL": "small", "LARGE": "corotational", "POLAR": "corotational"}
LIMIT = 1_000_000  # largest number of entries of a list


def read(path: Path) -> Deck:
    """Read a model and its loads. Raises Unreadable, NotImportable."""
    words = NumberParser(path.name)
    found, place = _read_model(parse_xml(path.name, read_regular(path), "physicalModel"), path.name, words)
    beside = path.with_suffix(".lml")
    if beside.exists():
        beside = resolve_within_folder(path.name, path.parent, beside.name)
        own = NumberParser(beside.name)
        _loads(parse_xml(beside.name, read_regular(beside), "loads"), own, found, place)
    else:
        found.left.append(NotImported("supports and loads", f"the file {beside.name} is missing in its folder"))
    return found


# ---------------------------------------------------------------------- PML


def _read_model(top: ElementT, name: str, words: NumberParser) -> tuple[Deck, dict[int, int]]:
    points: dict[int, list[float]] = {}
    for atom in top.iterfind("atoms//atomProperties"):
        points[words.whole(atom.get("index"))] = [words.number(atom.get(c)) for c in "xyz"]
    left: list[NotImported] = []
    blocks: dict[str, list[list[int]]] = {}
    parts: list[tuple[ElementT, int, int]] = []
    for body in _finite_element_components(top, left):
        rows: list[list[int]] = []
        for kind, row in _cells(body, words, left):
            blocks.setdefault(kind, []).append(row)
            rows.append(row)
        if rows:
            whole = sum(map(len, blocks.values()))
            parts.append((body, whole - len(rows), whole))
    if len(blocks) != 1:
        what = "several kinds of cells" if blocks else "no FEM tetrahedra or hexahedra"
        raise NotImportable(f"{name} has {what}", "use either TETRAHEDRON or HEXAHEDRON")
    ((kind, table),) = blocks.items()
    used, cells = np.unique(np.array(table, dtype=np.int64), return_inverse=True)
    if missing := [n for n in used.tolist() if n not in points]:
        raise words.unreadable_error(f"a cell refers to the missing atom {missing[0]}")
    X: Floats = np.array([points[n] for n in used.tolist()], dtype=np.float64)
    found = Deck(name, KINDS[kind][0], X, cells.reshape(len(table), -1).astype(np.int64), [], left=left)
    strains = {_read_strain_setting(body, found) for body, _, _ in parts}
    if len(strains) > 1:
        raise NotImportable(f"{name} has bodies with different values of `deformation`", "write one file for each")
    found.strain = strains.pop()
    found.parts = [_read_material_part(body, first, last, words, left) for body, first, last in parts]
    if kind == "HEXAHEDRON":
        found.taken.append("hexahedra are kept; SOFA's reader split each into five tetrahedra")
    return found, {n: i for i, n in enumerate(used.tolist())}


def _finite_element_components(top: ElementT, left: list[NotImported]) -> Iterator[ElementT]:
    """Yield the exclusive components of a model that consist of finite elements."""
    for body in top.iterfind("exclusiveComponents//structuralComponent"):
        kind = body.get("bodyType", "FEM")
        if kind == "FEM":
            yield body
        else:
            left.append(NotImported(f"the body `{body.get('name', '')[:60]}`", f"its type is {kind[:40]}, not FEM"))


def _cells(body: ElementT, words: NumberParser, left: list[NotImported]) -> Iterator[tuple[str, list[int]]]:
    odd: dict[str, int] = {}
    for cell in body.iterfind("cell"):
        properties = cell.find("cellProperties")
        kind = "" if properties is None else properties.get("type", "")
        if kind not in KINDS:
            odd[kind] = odd.get(kind, 0) + 1
            continue
        row = [words.whole(atom.get("index")) for atom in cell.iterfind("atomRef")]
        if len(row) != KINDS[kind][1]:
            raise words.unreadable_error(f"a cell {kind} has {len(row)} atoms")
        yield kind, row
    left += [NotImported(f"{n} cells {kind[:40]}", "not supported as solid cells") for kind, n in odd.items()]


def _read_strain_setting(body: ElementT, found: Deck) -> str:
    word = body.get("deformation", "LARGE").upper()
    if word != "SMALL":
        told = f"deformation = {word[:20]}" if "deformation" in body.attrib else "no value of `deformation`"
        said = (
            f"{told} is imported as corotational strain with a rotation at each integration point; SOFA has one per "
            f"cell"
        )
        found.taken += [said] if said not in found.taken else []
    return STRAINS.get(word, "corotational")


def _read_material_part(
    body: ElementT, first: int, last: int, words: NumberParser, left: list[NotImported]
) -> MaterialPart:
    name = body.get("name", "")
    if "mass" in body.attrib:
        left.append(NotImported(f"the mass of `{name[:60]}`", "a scene needs a density: give `--density`"))
    law = None
    if "young" in body.attrib and "poisson" in body.attrib:
        density = words.number(body.get("density")) if "density" in body.attrib else None
        young, poisson = words.number(body.get("young")), words.number(body.get("poisson"))
        law = ImportedLaw("linear_elastic", {"young": young}, {"poisson": poisson}, density)
    else:
        left.append(NotImported(f"the material of `{name[:60]}`", "`young` or `poisson` is missing"))
    return MaterialPart(name or "body", np.arange(first, last), law)


# ---------------------------------------------------------------------- LML


def _loads(top: ElementT, words: NumberParser, found: Deck, place: dict[int, int]) -> None:
    held: dict[tuple[int, int], float] = {}
    for number, load in enumerate(top.iterfind("load"), start=1):
        kind = load.get("type", "")
        what = f"load {number} of {words.name}, {kind[:40]}"
        nodes = _import_load(load, words, place, found, what)
        vector = _load_direction(load, words)
        value = _final_load_value(load, words)
        if kind not in ("Translation", "Force") or vector is None or value is None:
            found.left.append(NotImported(what, "only translations and forces along a direction are supported"))
        elif kind == "Force":
            x, y, z = (value * (c or 0.0) for c in vector)
            found.forces.append(NodeForces("force", nodes, (x, y, z)))
        else:
            for c, along in enumerate(vector):
                for node in nodes.tolist() if along is not None else ():
                    told = value * (along or 0.0)
                    if held.setdefault((node, c), told) != told:
                        raise NotImportable(
                            f"{what} and another prescribe different displacements of an atom", "keep only one of them"
                        )
    found.holds = group_equal_supports(held)
    found.taken.append("translations and forces have the value of their last event")


def _import_load(load: ElementT, words: NumberParser, place: dict[int, int], found: Deck, what: str) -> Ints:
    own = load.find("appliedTo")
    numbers: set[int] = set()
    for word in filter(None, ("" if own is None else own.text or "").replace(" ", "").split(",")):
        first, _, last = word.partition("-")
        low, high = words.whole(first), words.whole(last or first)
        if high < low:
            raise words.unreadable_error(f"`{word[:40]}` ends before it begins")
        if high - low + len(numbers) > LIMIT:
            raise words.unreadable_error(f"`{word[:40]}` has too many atoms")
        numbers.update(range(low, high + 1))
    if lost := len(numbers - place.keys()):
        found.left.append(NotImported(f"{what} on {lost} atoms", "they belong to no cell"))
    return np.array(sorted(place[n] for n in numbers if n in place), dtype=np.int64)


def _load_direction(load: ElementT, words: NumberParser) -> list[float | None] | None:
    own = load.find("direction")
    if own is None:
        return None
    told = [own.get(c, "NULL") for c in "xyz"]
    return [None if w.upper() == "NULL" else words.number(w) for w in told]


def _final_load_value(load: ElementT, words: NumberParser) -> float | None:
    """Return the value of a load at its last event, after which it stays constant."""
    events = [(words.number(e.get("date")), words.number(e.get("value"))) for e in load.iterfind("valueEvent")]
    return max(events, key=lambda event: event[0])[1] if events else None
