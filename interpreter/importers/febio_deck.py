"""Reader of common FEBio decks (`.feb`, versions 3.0 and 4.0): static analyses of one solid.

Source: FEBio User's Manual, version 3.4 (material models, boundary conditions, loads); a body force b acts as -density
b (FEElasticSolidDomain::BodyForce).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from softmark.interpreter.importers import unreferenced_deck_sets
from softmark.interpreter.importers.abaqus_loads import group_equal_forces, group_equal_supports
from softmark.interpreter.importers.deck_units import DeclaredUnits
from softmark.interpreter.importers.imported_deck import (
    Deck,
    EndedLoad,
    FaceLoad,
    Floats,
    ImportedLaw,
    Ints,
    MaterialPart,
    NotImportable,
    NotImported,
)
from softmark.interpreter.importers.xml_numbers import NumberParser, child_text
from softmark.interpreter.models.imported_results.readers.xml_trees import ElementT, parse_xml
from softmark.safe_files import read_regular

KINDS = {"tet4": 4, "tet10": 10, "hex8": 8, "hex20": 20}  # FEBio elements named as ours: numbers of nodes
FACETS = {"tri3": 3, "tri6": 3, "tri7": 3, "quad4": 4, "quad8": 4, "quad9": 4}
VERSIONS = ("3.0", "4.0")
ROOM = (
    "Module",
    "Globals",
    "Control",
    "Material",
    "Mesh",
    "MeshDomains",
    "Boundary",
    "Loads",
    "LoadData",
    "MeshData",
    "Output",
)
INSIDE = frozenset({"x_dof", "y_dof", "z_dof", "dofs", "dof", "scale", "value", "relative"})
LAWS = {  # FEBio's type: our word, constants by FEBio's names, and choices
    "neo-Hookean": ("neo_hookean", {"E": "young"}, {"v": "poisson"}, {}),
    "isotropic elastic": ("st_venant_kirchhoff", {"E": "young"}, {"v": "poisson"}, {}),
    "Mooney-Rivlin": ("mooney_rivlin", {"c1": "c1", "c2": "c2", "k": "bulk"}, {}, {"volumetric": "logarithmic"}),
}


UNITS = {  # FEBio's name of a system: ours. Source: FEBio User's Manual, version 4, section "Module"
    "SI": "m-kg-s",
    "mm-N-s": "mm-t-s",
    "mm-kg-s": "mm-kg-s",
    "um-nN-s": "um-g-s",
    "CGS": "cm-g-s",
    "mm-g-s": "mm-g-s",
    "mm-mg-s": "mm-mg-s",
}


def read(path: Path, moment: float | None = None) -> Deck:
    """Read a deck at a time of its analysis, by default its end. Raises Unreadable, NotImportable."""
    return _Reader(path, moment).deck()


class _Reader:
    def __init__(self, path: Path, moment: float | None = None) -> None:
        self.name = path.name
        self.moment = moment
        self.reading = ""  # the load or support that is being read
        self.ended: list[EndedLoad] = []
        self.below: list[str] = []  # loads that are smaller at the imported time than before
        self.words = NumberParser(path.name)
        self.top = parse_xml(path.name, read_regular(path), "febio_spec")
        self.left: list[NotImported] = []
        self.place: dict[int, int] = {}
        self.asked: set[str] = set()  # sets that loads or supports refer to

    def deck(self) -> Deck:
        """Return the whole deck as a record. Raises Unreadable, NotImportable."""
        version = self.top.get("version", "")
        if version not in VERSIONS:
            raise NotImportable(f"{self.name} has version {version[:20] or 'none'} of the FEBio format",
                          f"save it in version {' or '.join(VERSIONS)}")  # fmt: skip
        self.left += [NotImported(f"`{own.tag}`", "not supported") for own in self.top if own.tag not in ROOM]
        self._check_analysis_kind()
        found = self._mesh()
        found.parts = list(self._material_parts(found))
        self._boundary(found)
        for own in self._section("Loads"):
            self._load(own, found)
        self._formulation(found)
        self._sets(found)
        if found.kind in ("tet10", "hex20"):
            found.taken.append(f"{found.kind} uses softmark's integration points; FEBio may use others")
        if next(self._section("LoadData"), None) is not None:
            where = "at the end of the analysis" if self.moment is None else f"at time {self.moment:g}"
            found.taken.append(f"values that follow a load curve are taken {where}")
        found.taken += self.below
        found.left, found.ended, found.units = self.left, self.ended, self._units()
        self._check_acting_loads(found)
        return found

    def _section(self, tag: str) -> Iterator[ElementT]:
        own = self.top.find(tag)
        yield from () if own is None else own

    def _omit(self, what: str, why: str) -> None:
        """Add a thing that is not imported, and the reason, to the list that the user sees."""
        self.left.append(NotImported(what, why))

    def _units(self) -> DeclaredUnits | None:
        own = (child_text(self.top.find("Module"), "units") or "").strip()
        same = {theirs.lower(): ours for theirs, ours in UNITS.items()}
        return DeclaredUnits(own, same.get(own.lower().replace("_", "-"))) if own else None

    def _check_acting_loads(self, found: Deck) -> None:
        """Check that a load or motion acts at the imported time. Raises NotImportable if all have ended."""
        moves = any(any(hold.values) for hold in found.holds)
        if not found.ended or moves or found.pushes or found.forces or found.weights:
            return
        own = max(found.ended, key=lambda ended: abs(ended.peak))
        raise NotImportable(f"{self.name}: no load acts at the end: {own.described}",
                      f"choose a time: `--at {own.when:g}` has the largest load", "E758")  # fmt: skip

    def _check_analysis_kind(self) -> None:
        module = self.top.find("Module")
        kind = "solid" if module is None else module.get("type", "solid")
        if kind != "solid":
            raise NotImportable(f"{self.name} uses the module `{kind[:40]}`", "only `solid` models are imported")
        self.static = (child_text(self.top.find("Control"), "analysis") or "STATIC").strip().upper() in ("STATIC", "0")
        if not self.static:
            self._omit("a dynamic analysis", "only static analyses are imported")

    # ------------------------------------------------------------------ mesh

    def _mesh(self) -> Deck:
        mesh = self.top.find("Mesh")
        if mesh is None:
            raise self.words.unreadable_error("it has no `Mesh`")
        points: dict[int, list[float]] = {}
        for nodes in mesh.findall("Nodes"):
            for node in nodes:
                number, at = self.words.whole(node.get("id")), self.words.floats(node.text, 3).tolist()
                if points.setdefault(number, at) != at:
                    raise self.words.unreadable_error(f"node number {number} occurs twice, at different positions")
        blocks: dict[str, list[list[int]]] = {}
        self.ids: list[int] = []
        self.domains: list[tuple[str, int, int]] = []
        for elements in mesh.findall("Elements"):
            kind, name = elements.get("type", ""), elements.get("name", "")
            if kind not in KINDS:
                self._omit(f"{len(elements)} elements `{kind[:40]}` (`{name[:60]}`)", "not supported as solid cells")
                continue
            rows = blocks.setdefault(kind, [])
            first = len(rows)
            rows += [self.words.wholes(e.text).tolist() for e in elements]
            self.domains.append((name, first, len(rows)))
            self.ids += [self.words.whole(e.get("id")) for e in elements]
        if len(blocks) != 1 or not any(blocks.values()):
            raise NotImportable(
                f"{self.name} has {'no' if not blocks else 'several kinds of'} solid cells",
                f"use one kind of {', '.join(KINDS)}",
            )
        ((kind, rows),) = blocks.items()
        if any(len(row) != KINDS[kind] for row in rows):
            raise self.words.unreadable_error(f"an element `{kind}` does not have {KINDS[kind]} nodes")
        used, cells = np.unique(np.array(rows, dtype=np.int64), return_inverse=True)
        if missing := [n for n in used.tolist() if n not in points]:
            raise self.words.unreadable_error(f"an element refers to the missing node {missing[0]}")
        self.place = {n: i for i, n in enumerate(used.tolist())}
        X: Floats = np.array([points[n] for n in used.tolist()], dtype=np.float64)
        own = cells.reshape(len(rows), -1).astype(np.int64)
        return Deck(self.name, kind, X, own, [], strain="finite", static=self.static)

    def _material_parts(self, found: Deck) -> Iterator[MaterialPart]:
        materials = {own.get("name", ""): own for own in self._section("Material")}
        materials |= {own.get("id", ""): own for own in self._section("Material")}
        of = {own.get("name", ""): own.get("mat", "") for own in self._section("MeshDomains")}
        for domain in self._section("MeshDomains"):
            for odd in (*sorted(domain.attrib.keys() - {"name", "mat"}), *(inner.tag for inner in domain)):
                self._omit(
                    f"`{odd[:40]}` of the domain `{domain.get('name', '')[:60]}`",
                    "cells use softmark's own formulation",
                )
        together_: dict[str, list[int]] = {}
        for name, first, last in self.domains:
            together_.setdefault(of.get(name, ""), []).extend(range(first, last))
        for name, cells in together_.items():
            own = materials.get(name)
            if own is None:
                self._omit(f"the material of {len(cells)} cells", "not given in `MeshDomains`")
            law = None if own is None else self._law(own)
            yield MaterialPart(name or "rest", np.array(cells, dtype=np.int64), law)

    def _law(self, own: ElementT) -> ImportedLaw | None:
        kind, name = own.get("type", ""), own.get("name", "")[:60]
        if kind not in LAWS:
            self._omit(f"the material `{name}`, `{kind[:60]}`", "this law is not supported")
            return None
        word, stresses, plain, choices = LAWS[kind]
        known = {"density", *stresses, *plain}
        if odd := [c.tag for c in own if c.tag not in known or c.attrib]:
            self._omit(f"the material `{name}`, `{kind}`", f"its `{odd[0]}` is not supported, or is not a number")
            return None
        if missing := [n for n in (*stresses, *plain) if own.find(n) is None]:
            self._omit(f"the material `{name}`, `{kind}`", f"`{missing[0]}` is missing")
            return None
        density = child_text(own, "density")
        return ImportedLaw(
            word,
            {ours: self.words.number(child_text(own, theirs)) for theirs, ours in stresses.items()},
            {ours: self.words.number(child_text(own, theirs)) for theirs, ours in plain.items()},
            None if density is None else self.words.number(density),
            choices,
        )

    def _formulation(self, found: Deck) -> None:
        """Set the formulation of hexahedra with uncoupled laws: one pressure and one volume change per cell."""
        apart = [part.law is not None and part.law.word == "mooney_rivlin" for part in found.parts]
        if found.kind == "hex8" and any(apart):
            if all(apart):
                found.formulation = "mean_dilatation"
            else:
                self._omit("three fields of `Mooney-Rivlin` in hex8", "not supported for other materials")

    # ------------------------------------------------------------------ sets

    def _facets(self, name: str) -> list[Ints] | None:
        """Return the corner nodes of a surface's facets in the record, -1 outside all cells; None if unknown."""
        mesh = self.top.find("Mesh")
        for own in () if mesh is None else mesh.findall("Surface"):
            if own.get("name") == name:
                found = []
                for facet in own:
                    if facet.tag not in FACETS:
                        raise self.words.unreadable_error(f"`{facet.tag[:40]}` is not a facet")
                    found.append(self._node_indices(self.words.wholes(facet.text)))
                return found
        return None

    def _node_indices(self, numbers: Ints) -> Ints:
        return np.array([self.place.get(n, -1) for n in numbers.tolist()], dtype=np.int64)

    def _nodes_of_set(self, name: str) -> Ints | None:
        """Return the nodes of a named set or surface; None if the name is unknown."""
        self.asked.add(name)
        if name.startswith("@surface:"):
            facets = self._facets(name.removeprefix("@surface:"))
            return None if facets is None else np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *facets]))
        mesh = self.top.find("Mesh")
        for own in () if mesh is None else mesh.findall("NodeSet"):
            if own.get("name") == name:
                listed = [self.words.whole(n.get("id")) for n in own] if len(own) else self.words.wholes(own.text)
                return self._node_indices(np.array(listed, dtype=np.int64))
        return None

    def _read_node_map(self, node: ElementT | None, node_set: str) -> Floats | None:
        """Return the values (k, c) of a map at the nodes of a set at the imported time; None if it is not a map."""
        if node is None or node.get("type") != "map" or set(node.attrib) - {"lc", "type"}:
            return None
        factor = 1.0 if node.get("lc") in (None, "0") else self._evaluate_load_curve(str(node.get("lc")))
        data = next((own for own in self._section("MeshData") if own.tag == "NodeData" and own.get("name") ==
                     (node.text or "").strip() and own.get("node_set") == node_set), None)  # fmt: skip
        nodes = self._nodes_of_set(node_set)
        if factor is None or data is None or nodes is None or not len(data):
            return None
        rows = [self.words.floats(own.text) for own in data]
        places = [self.words.whole(own.get("lid")) for own in data]
        if sorted(places) != list(range(1, len(nodes) + 1)) or len({len(row) for row in rows}) != 1:
            return None
        found = np.empty((len(nodes), len(rows[0])))
        found[np.array(places) - 1] = rows
        return found * factor

    def _faces_of_surface(self, name: str, found: Deck) -> Ints | None:
        self.asked.add(f"@surface:{name}")
        facets = self._facets(name)
        if facets is None:
            return None
        many = found.sides.corners.shape[1]
        rows = np.array([f[:many] for f in facets if len(f) >= many], dtype=np.int64).reshape(-1, many)
        faces, foreign = found.sides.of(rows)
        if foreign:
            self._omit(f"{foreign} facets of `{name[:60]}`", "they are not faces on the surface")
        return faces

    def _sets(self, found: Deck) -> None:
        """Add named parts of the mesh that nothing refers to, and named values of elements and surfaces."""
        found.left = self.left
        place = {number: i for i, number in enumerate(self.ids)}
        mesh = self.top.find("Mesh")
        for own in () if mesh is None else mesh:
            name = own.get("name", "")
            if own.tag == "ElementSet":
                numbers = self.words.wholes(own.text).tolist() or [self.words.whole(e.get("id")) for e in own]
                unreferenced_deck_sets.add_cell_set(
                    found, name, np.array(sorted({place[n] for n in numbers if n in place}), dtype=np.int64)
                )
            elif own.tag == "NodeSet" and name not in self.asked:
                nodes = self._nodes_of_set(name)
                unreferenced_deck_sets.add_node_set(
                    found, name, np.zeros(0, dtype=np.int64) if nodes is None else nodes[nodes >= 0]
                )
            elif own.tag == "Surface" and f"@surface:{name}" not in self.asked:
                faces = self._faces_of_surface(name, found)
                unreferenced_deck_sets.add_face_set(
                    found, name, np.zeros((0, 2), dtype=np.int64) if faces is None else faces
                )
            elif own.tag not in ("Nodes", "Elements", "NodeSet", "Surface"):
                self._omit(f"`{own.tag[:40]}` `{name[:60]}` of the mesh", "not supported")
        for own in self._section("MeshData"):
            if own.tag != "NodeData":
                self._omit(f"`{own.tag[:40]}` `{own.get('name', '')[:60]}`", "only nodal values are supported")

    # ------------------------------------------------------- supports and loads

    def _values_at_time(self, node: ElementT | None) -> Floats | None:
        """Return the numbers of an XML element at the imported time; None if their load curve is unknown there."""
        if node is None:
            return None
        if set(node.attrib) - {"lc", "type"} or node.get("type", "const") not in ("const", "vector"):
            return None
        values = self.words.floats(node.text)
        lc = node.get("lc")
        factor = 1.0 if lc in (None, "0") else self._evaluate_load_curve(str(lc))
        return None if factor is None else values * factor

    def _imported_time(self) -> float | None:
        """Return the imported time. Raises NotImportable if the analysis does not reach it."""
        control = self.top.find("Control")
        steps, size = child_text(control, "time_steps"), child_text(control, "step_size")
        end = None if steps is None or size is None else self.words.number(steps) * self.words.number(size)
        if self.moment is None:
            return end
        if not 0.0 <= self.moment <= (math.inf if end is None else end * (1.0 + 1e-9)):
            raise NotImportable(f"time {self.moment:g} is outside the analysis of {self.name}",
                          "give one from 0 to its end" + ("" if end is None else f", `--at {end:g}`"))  # fmt: skip
        return self.moment

    def _evaluate_load_curve(self, number: str) -> float | None:
        """Return the value of a load curve at the imported time; None if it is unknown there."""
        end = self._imported_time()
        for own in self._section("LoadData"):
            if own.get("id") != number or own.get("type") != "loadcurve" or end is None:
                continue
            points = own.find("points")
            rows = np.array([self.words.floats(p.text, 2) for p in (points if points is not None else [])])
            if not len(rows) or (np.diff(rows[:, 0]) < 0).any():
                return None
            value = self._evaluate_curve_at(own, rows, end)
            if value is not None:
                self._record_lower_load(number, value, rows[rows[:, 0] <= end * (1.0 + 1e-9)], end)
            return value
        return None

    def _evaluate_curve_at(self, own: ElementT, rows: Floats, end: float) -> float | None:
        """Return the value of a load curve with points (n, 2) at a time; None if it is unknown there."""
        exact = np.flatnonzero(np.isclose(rows[:, 0], end, rtol=1e-9, atol=0.0))
        if len(exact):
            return float(rows[exact[-1], 1])
        straight = (child_text(own, "interpolate") or "LINEAR").strip().upper() in ("LINEAR", "1")
        constant = (child_text(own, "extend") or "CONSTANT").strip().upper() in ("CONSTANT", "0")
        if end > rows[-1, 0] and constant:
            return float(rows[-1, 1])
        inside = rows[0, 0] <= end <= rows[-1, 0]
        return float(np.interp(end, rows[:, 0], rows[:, 1])) if straight and inside else None

    def _record_lower_load(self, number: str, value: float, before: Floats, end: float) -> None:
        """Record a load curve that is smaller at the imported time than before; `before` are earlier points (n, 2)."""
        if not len(before):
            return
        when, peak = before[int(np.argmax(np.abs(before[:, 1])))].tolist()
        if abs(value) >= abs(peak) * (1.0 - 1e-9):
            return
        if abs(value) <= 1e-12 * abs(peak):
            self.ended.append(EndedLoad(self.reading, number, peak, when, end))
        else:
            self.below.append(
                f"{self.reading} follows load curve {number[:20]}: {value:g} at time {end:g}, {peak:g} at time {when:g}"
            )

    def _boundary(self, found: Deck) -> None:
        told: dict[tuple[int, int], float] = {}
        for own in self._section("Boundary"):
            what = self.reading = f"the support `{own.get('name', own.get('type', ''))[:60]}`"
            nodes = self._nodes_of_set(own.get("node_set", ""))
            acts = self._mapped_displacements(own) or self._prescribed_displacements(own)
            if own.tag != "bc" or nodes is None or acts is None:
                self._omit(what, "not a nodal displacement in x, y or z")
                continue
            if (nodes < 0).any():
                self._omit(f"{what} on nodes of no cell", "only nodes of cells are supported")
            for component, values in acts.items():
                for node, value in zip(nodes.tolist(), np.broadcast_to(values, len(nodes)).tolist(), strict=True):
                    if node < 0:
                        continue
                    if told.setdefault((node, component), value) != value:
                        raise NotImportable(
                            f"{what} and another prescribe different displacements of a node", "keep only one of them"
                        )
        found.holds = group_equal_supports(told)

    def _mapped_displacements(self, own: ElementT) -> dict[int, Floats] | None:
        """Return displacements prescribed by a map, by direction, at each node of a set; None without a map."""
        dof = (child_text(own, "dof") or "").strip()
        values = self._read_node_map(own.find("value"), own.get("node_set", ""))
        relative = (child_text(own, "relative") or "0").strip()
        whole = own.get("type") == "prescribed displacement" and relative == "0" and dof in ("x", "y", "z")
        if not whole or values is None or values.shape[1] != 1:
            return None
        return {"xyz".index(dof): values[:, 0]}

    def _prescribed_displacements(self, own: ElementT) -> dict[int, Floats] | dict[int, float] | None:
        """Return the prescribed displacement in each direction: one value, or one for each node of a set."""
        kind = own.get("type", "")
        if any(c.tag not in INSIDE for c in own) or (child_text(own, "relative") or "0").strip() not in ("0", "false"):
            return None
        if kind == "zero displacement":
            return {i: 0.0 for i, c in enumerate("xyz") if (child_text(own, f"{c}_dof") or "0").strip() == "1"}
        if kind == "fix":
            dofs = [w.strip() for w in (child_text(own, "dofs") or "").split(",")]
            return {"xyz".index(d): 0.0 for d in dofs} if all(d in ("x", "y", "z") for d in dofs) else None
        if kind in ("prescribed displacement", "prescribe"):
            dof = (child_text(own, "dof") or "").strip()
            value = self._values_at_time(own.find("value" if kind == "prescribed displacement" else "scale"))
            if dof not in ("x", "y", "z") or value is None or len(value) != 1:
                return None
            return {"xyz".index(dof): float(value[0])}
        return None

    def _load(self, own: ElementT, found: Deck) -> None:
        what = self.reading = f"the load `{own.get('name', own.get('type', ''))[:60]}`"
        if own.tag == "nodal_load" and own.get("type") == "nodal_force":
            self._read_nodal_force(own, what, found)
        elif own.tag == "surface_load":
            self._read_surface_load(own, what, found)
        elif own.tag == "body_load" and own.get("type") in ("const", "body force"):
            self._body_force(own, what, found)
        else:
            self._omit(what, "only pressures, dead tractions, nodal forces and body forces are supported")

    def _read_nodal_force(self, own: ElementT, what: str, found: Deck) -> None:
        nodes, node = self._nodes_of_set(own.get("node_set", "")), own.find("value")
        mapped = self._read_node_map(node, own.get("node_set", ""))
        one = self._values_at_time(node) if mapped is None and (node is None or node.get("type") != "map") else None
        rows = mapped if one is None else one[None, :]
        if nodes is None or rows is None or rows.shape[1] != 3 or (nodes < 0).any():
            self._omit(what, "its nodes or its final vectors are missing")
            return
        found.forces += group_equal_forces(
            zip(nodes.tolist(), np.broadcast_to(rows, (len(nodes), 3)).tolist(), strict=True)
        )

    def _read_surface_load(self, own: ElementT, what: str, found: Deck) -> None:
        kind, name = own.get("type", ""), own.get("surface", "")
        dead = (child_text(own, "linear") or "0").strip() in ("1", "true")
        if kind == "pressure" and not dead:
            value, count = self._values_at_time(own.find("pressure")), 1
        elif kind == "traction" and dead:
            scale = self._values_at_time(own.find("scale"))
            vector = self._values_at_time(own.find("traction"))
            known = vector is not None and (scale is not None or own.find("scale") is None)
            value, count = (vector * (1.0 if scale is None else scale) if known and vector is not None else None), 3
        else:
            if kind not in ("pressure", "traction"):
                self._omit(what, f"surface load `{kind[:40]}` is not supported, only pressures and tractions")
                return
            self._omit(what, "pressures must be follower loads (`linear` 0) and tractions dead loads (`linear` 1)")
            return
        faces = self._faces_of_surface(name, found)
        if value is None or len(value) != count or faces is None or not len(faces):
            self._omit(what, "its surface or its final magnitude is missing")
            return
        x, *yz = value.tolist()
        if not any(value.tolist()):
            return
        push = FaceLoad(name, faces, x) if count == 1 else FaceLoad(name, faces, traction=(x, yz[0], yz[1]))
        found.pushes.append(push)

    def _body_force(self, own: ElementT, what: str, found: Deck) -> None:
        vector = self._values_at_time(own.find("force"))
        if own.find("force") is None:
            each = [np.zeros(1) if own.find(c) is None else self._values_at_time(own.find(c)) for c in "xyz"]
            vector = None if any(e is None or len(e) != 1 for e in each) else np.concatenate(each)  # type: ignore[arg-type]
        if vector is None or len(vector) != 3 or own.get("elem_set"):
            self._omit(what, "not a uniform vector on the whole body at the end")
            return
        x, y, z = (-vector).tolist()
        if any((x, y, z)):
            found.weights.append((x, y, z))
        found.taken.append("a body force b acts as -density b, as in FEBio")
