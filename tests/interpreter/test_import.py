"""Decks and meshes of other programs become scenes that mean the same, and what they cannot mean is listed."""

from __future__ import annotations

import json
import random
import shutil
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest

from softmark.grammar.diagnostic import Source
from softmark.grammar.printer import format_source
from softmark.interpreter.cli.main import main
from softmark.interpreter.importers import deck_units, import_formats, scene_writer
from softmark.interpreter.importers.cell_faces import CellSides, side_nodes
from softmark.interpreter.importers.deck_units import MissingUnit
from softmark.interpreter.importers.imported_deck import Deck, NotImportable
from softmark.interpreter.importers.scene_writer import MissingValue, SuppliedValues
from softmark.references.measured_data import Unreadable
from softmark.solvers.elements import ELEMENTS

PARTS = Path(__file__).parents[1] / "errors" / "parts"
OWN = Path(__file__).parents[1] / "imported"
FILES = [PARTS / "deck-warm.inp", PARTS / "named.msh", OWN / "cube.feb", OWN / "rod.pml"]
GEL = "neo_hookean(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)"
TOLD = SuppliedValues(GEL, "1000 kg/m^3")
SAME = 1e-10  # the bar; a deck has 14 digits of each number, and Newton's method is run to 1e-12 here


def text_of(path: Path, filled: SuppliedValues = TOLD) -> str:
    """The scene of a file in mm, t and s."""
    units = deck_units.read_unit_options("mm-t-s", None, None, None)
    return scene_writer.write_scene(import_formats.read(path), units, filled, "x-mesh.inp").scene


def metrics(path: Path, model: str) -> dict[str, float]:
    """Of one model of a scene that is run."""
    assert main(["run", str(path), "--model", model, "--json", str(path.with_suffix(".json"))]) == 0
    own = json.loads(path.with_suffix(".json").read_text())["models"][model]
    return {name: told["value"] for name, told in own["metrics"].items()}


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.name)
def test_a_scene_is_in_canonical_form(path: Path) -> None:
    found = text_of(path)
    assert format_source(Source("x", found)) == found
    assert "# not imported: " in found


def test_a_deck_says_what_holds_and_loads_it() -> None:
    found = import_formats.read(PARTS / "deck.inp")
    (hold,), (push,), (force,), (weight,) = found.holds, found.pushes, found.forces, found.weights
    assert (hold.components, hold.values) == ((0, 1, 2), (0.0, 0.0, 0.0))
    assert found.points[hold.nodes, 0].tolist() == [0.0] * 4
    assert push.faces.tolist() == [[0, 1], [1, 1]]
    assert push.pressure == 0.25
    assert found.points[force.nodes].tolist() == [[20.0, 10.0, 10.0]]
    assert force.force == (0.0, 5.0, 0.0)
    assert weight == (0.0, 0.0, -9810.0)
    assert found.parts[0].law is not None
    assert found.parts[0].law.density == 7.8e-9
    assert not found.left


def deck(folder: Path, *changes: tuple[str, str], name: str = "deck.inp") -> Path:
    """The deck of a bar with some words in place of others."""
    text = (PARTS / "deck.inp").read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / name).write_text(text)
    return folder / name


LAWS = [  # of CalculiX, and what it is here: mu = 2 C10, K = 2/D1, so that E = 9 K mu/(3 K + mu)
    ("NEO HOOKE\n2., 0.1", "neo_hookean_isochoric", {"young": 9 * 20 * 4 / 64}),
    ("MOONEY-RIVLIN\n2., 1., 0.1", "mooney_rivlin", {"c1": 2.0, "c2": 1.0, "bulk": 20.0}),
    ("POLYNOMIAL, N=1\n2., 1., 0.1", "mooney_rivlin", {"c1": 2.0, "c2": 1.0, "bulk": 20.0}),
    ("YEOH\n2., 1., 3., 0.1, 1e30, 1e30", "yeoh", {"c1": 2.0, "c2": 1.0, "c3": 3.0, "bulk": 20.0}),
    ("REDUCED POLYNOMIAL, N=2\n2., 1., 0.1, 1e30", "yeoh", {"c1": 2.0, "c2": 1.0, "bulk": 20.0}),
    ("OGDEN, N=1\n2., 1.3, 0.1", "ogden", {"bulk": 20.0}),
    ("MOONEY-RIVLIN\n2., -0.5, 0.1", "ogden", {"bulk": 20.0}),
]


@pytest.mark.parametrize(("card", "word", "stresses"), LAWS, ids=[own[0].split("\n")[0] for own in LAWS])
def test_laws_that_are_exactly_one_of_ours(card: str, word: str, stresses: dict[str, float], tmp_path: Path) -> None:
    found = import_formats.read(deck(tmp_path, ("*ELASTIC\n210000., 0.3", f"*HYPERELASTIC, {card}")))
    law = found.parts[0].law
    assert law is not None
    assert law.word == word
    assert found.strain == "finite"
    assert dict(law.stresses) == pytest.approx(stresses, rel=1e-15)


@pytest.mark.parametrize(
    "card",
    [
        "*HYPERELASTIC, NEO HOOKE\n2., 0.",  # D1 = 0 means one thing to Abaqus and another to CalculiX
        "*HYPERELASTIC, YEOH\n2., 1., 3., 0.1, 0.2, 0.3",
        "*HYPERELASTIC, OGDEN\n2., 1.3, 0.",
        "*HYPERELASTIC, OGDEN, N=2\n2., 1.3, 1., 3., 0.1, 0.",  # D2 = 0 means two things
        "*ELASTIC, TYPE=ORTHO\n1., 1., 1., 1., 1., 1., 1., 1.",
        "*ELASTIC\n210000., 0.3\n*PLASTIC\n200., 0.",
    ],
)
def test_other_laws_are_left_and_asked_for(card: str, tmp_path: Path) -> None:
    path = deck(tmp_path, ("*ELASTIC\n210000., 0.3", card))
    with pytest.raises(MissingValue, match="2 cells"):
        text_of(path, SuppliedValues())
    assert GEL.partition("(")[0] in text_of(path)
    assert "not imported" in text_of(path)


def test_large_strain_of_elastic_is_that_of_calculix_and_said(tmp_path: Path) -> None:
    found = text_of(deck(tmp_path, ("*STEP\n", "*STEP, NLGEOM\n")))
    assert "st_venant_kirchhoff(" in found
    assert "as in CalculiX; Abaqus" in found


def test_later_steps_say_anew_what_moves(tmp_path: Path) -> None:
    more = "*END STEP\n*STEP\n*STATIC\n*BOUNDARY\nWALL, 1, 1, 0.5\n*CLOAD\n12, 2, 7.\n*END STEP"
    found = import_formats.read(deck(tmp_path, ("*END STEP", more)))
    told = {(c, v) for hold in found.holds for c, v in zip(hold.components, hold.values, strict=True)}
    assert told == {(0, 0.5), (1, 0.0), (2, 0.0)}
    assert found.forces[0].force == (0.0, 7.0, 0.0)
    other = more.replace("*STATIC", "*FREQUENCY\n3")
    found = import_formats.read(deck(tmp_path, ("*END STEP", other)))
    assert found.forces[0].force == (0.0, 5.0, 0.0)
    assert [own.what for own in found.left] == ["a step of *FREQUENCY"]


def test_nodes_of_no_face_are_a_group_of_nodes(tmp_path: Path) -> None:
    read = import_formats.read(deck(tmp_path, ("1, 4, 5, 8\n", "1, 4, 5, 8, 12\n")))
    found = scene_writer.write_scene(read, deck_units.read_unit_options("mm-t-s", None, None, None), TOLD, "x-mesh.inp")
    assert "fixed(body, where = at_wall)" in found.scene
    assert "*NSET, NSET=at_wall\n1\n4\n5\n8\n12\n" in (found.mesh or "")


def test_what_would_be_wrong_around_a_word_is_refused(tmp_path: Path) -> None:
    for old, new in [
        ("*SURFACE", "*TRANSFORM, NSET=WALL\n1., 1., 0., -1., 1., 0.\n*SURFACE"),
        ("*ELEMENT, TYPE=C3D8, ELSET=BAR", "*NGEN\n1, 5, 1\n*ELEMENT, TYPE=C3D8, ELSET=BAR"),
        ("*NODE, NSET=NALL", "*SYSTEM\n1., 0., 0.\n*NODE, NSET=NALL"),
        ("TYPE=C3D8", "TYPE=C3D27"),
    ]:
        with pytest.raises(NotImportable):
            import_formats.read(deck(tmp_path, (old, new)))


def test_includes_stay_in_their_folder_and_end(tmp_path: Path) -> None:
    (tmp_path / "secret.inp").write_text("*NODE\n")
    inner = tmp_path / "inner"
    inner.mkdir()
    head, _, tail = (PARTS / "deck.inp").read_text().partition("*MATERIAL")
    (inner / "rest.inp").write_text("*MATERIAL" + tail)
    (inner / "whole.inp").write_text(head + "*INCLUDE, INPUT=rest.inp\n")
    assert len(import_formats.read(inner / "whole.inp").holds) == 1
    for told in ("../secret.inp", str(tmp_path / "secret.inp"), "loop.inp", "none.inp", "a\0b", "x" * 5000):
        (inner / "loop.inp").write_text(f"*NODE\n1, 0., 0., 0.\n*INCLUDE, INPUT={told}\n")
        with pytest.raises(Unreadable):
            import_formats.read(inner / "loop.inp")


def test_xml_without_entities(tmp_path: Path) -> None:
    text = (OWN / "cube.feb").read_text()
    bomb = '<!DOCTYPE x [<!ENTITY a "b">]>'
    (tmp_path / "x.feb").write_text(text.replace("<febio_spec", bomb + "<febio_spec", 1))
    with pytest.raises(Unreadable, match="entities"):
        import_formats.read(tmp_path / "x.feb")


def test_a_deck_of_febio_at_the_end_of_its_curves() -> None:
    found = import_formats.read(OWN / "cube.feb")
    law = found.parts[0].law
    assert law is not None
    assert (law.word, law.stresses["young"], law.plain["poisson"]) == ("neo_hookean", 0.01, 0.3)
    still, moved = found.holds
    assert (still.components, still.nodes.tolist()) == ((0, 1, 2), [0, 1, 2, 3])
    assert (moved.components, moved.values, moved.nodes.tolist()) == ((0,), (1.0,), [4, 5, 6, 7])  # half of 2
    assert found.pushes[0].pressure == 0.0005
    assert found.pushes[0].faces.tolist() == [[0, 1]]
    assert found.weights == [(0.0, 0.0, -4905.0)]  # against the vector, as FEBio has it
    tugs = {own.nodes.item(): own.force for own in found.forces}  # of nodes 8 and 7, in the set's order
    assert tugs == {7: (0.0, 0.0, 0.1), 6: (0.0, 0.2, 0.0)}
    assert [own.what for own in found.left] == ["`Contact`"]


def test_pml_with_lml() -> None:
    found = import_formats.read(OWN / "rod.pml")
    still, moved = found.holds
    assert (still.components, still.nodes.tolist()) == ((0, 1, 2), [0, 1, 2, 3])
    assert (moved.components, moved.values, moved.nodes.tolist()) == ((2,), (0.1,), [4, 5, 6, 7])
    assert found.forces[0].force == (2.0, 0.0, 0.0)
    assert found.forces[0].nodes.tolist() == [6]
    assert [own.what for own in found.left] == ["load 4 of rod.lml, Pressure"]


# one unit of force, density and acceleration of each system in SI, from its units of length, mass and time
SYSTEMS = {"m-kg-s": (1, 1, 1), "mm-t-s": (1e-3, 1e3, 1), "mm-kg-s": (1e-3, 1, 1), "mm-g-s": (1e-3, 1e-3, 1),
           "mm-kg-ms": (1e-3, 1, 1e-3), "mm-g-ms": (1e-3, 1e-3, 1e-3), "mm-mg-s": (1e-3, 1e-6, 1),
           "um-g-s": (1e-6, 1e-3, 1), "cm-g-s": (1e-2, 1e-3, 1)}  # fmt: skip


@pytest.mark.parametrize("system", deck_units.SYSTEMS)
def test_units_of_a_system_belong_together(system: str) -> None:
    L, M, T = SYSTEMS[system]
    own = deck_units.read_unit_options(system, None, None, None)
    assert own.stress is not None
    assert own.stress.factor == pytest.approx(M / (L * T**2), rel=1e-14)
    assert own.force_in_newtons(1.0) == pytest.approx(M * L / T**2, rel=1e-14)
    assert own.acceleration_in_si(1.0) == pytest.approx(L / T**2, rel=1e-14)
    assert float(own.format_density(1.0).split()[0]) == pytest.approx(M / L**3, rel=1e-14)


@pytest.mark.parametrize(
    ("system", "length"),
    [(None, None), ("si", None), ("mm-t-s", "1mm"), (None, "1 Pa"), (None, "mm mm"), (None, "0mm")],
)
def test_units_that_are_none(system: str | None, length: str | None) -> None:
    with pytest.raises(MissingUnit):
        deck_units.read_unit_options(system, length, None, None)


@pytest.mark.parametrize("kind", ["tet4", "tet10", "hex8", "hex20"])
def test_sides_have_the_nodes_of_the_elements_own(kind: str) -> None:
    element = ELEMENTS[kind]
    own = {frozenset(row) for row in side_nodes(element.nodes).tolist()}
    assert own == {frozenset(np.asarray(facet).tolist()) for facet in element.facets}
    sides = CellSides(np.arange(element.nodes)[None, :])
    faces, alone = sides.within(np.arange(element.nodes))
    assert len(faces) == len(own)
    assert len(alone) == 0


def test_nothing_is_written_over(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["import", str(PARTS / "deck.inp"), "--units", "mm-t-s"]) == 0
    before = (tmp_path / "deck.scene").read_text()
    assert main(["fmt", "--check", "deck.scene"]) == 0
    assert main(["check", "deck.scene"]) == 0
    capsys.readouterr()
    assert main(["import", str(PARTS / "deck.inp"), "--units", "mm-g-s"]) == 2
    assert "deck.scene exists already" in capsys.readouterr().err
    assert (tmp_path / "deck.scene").read_text() == before
    assert main(["import", str(PARTS / "deck.inp"), "--units", "mm-t-s", "--out", "."]) == 2
    assert ". exists already" in capsys.readouterr().err


# ------------------------------------------------------------------ the same numbers

LOOKED_AT = """
probe  tip  = point(body, at = (15, 4, 6) mm)
metric sink = displacement(tip, along = -z)
metric away = displacement(tip, along = +y)
"""
OURS = """softmark 1
scene "The deck, said by hand"
material steel = linear_elastic(young = 210 GPa, poisson = 0.3, density = 7800 kg/m^3)
body body = solid(mesh("bar.vtu", unit = 1 cm), steel)
support wall = fixed(body, where = x <= 0 mm)
load press = pressure(body, where = z >= 10 mm, magnitude = 0.25 MPa)
load corner = point_force(body, at = (20, 10, 10) mm, vector = (0, 5, 0) N)
load weight = gravity(9.81 m/s^2, direction = -z)
analysis rest = static()
model fe = fem(hex8, strain = small)
"""
CORNERS = [[x, y, z] for x in (0.0, 1.0, 2.0) for y in (0.0, 1.0) for z in (0.0, 1.0)]
CUBES = [[0, 4, 6, 2, 1, 5, 7, 3], [4, 8, 10, 6, 5, 9, 11, 7]]


@pytest.mark.slow
def test_a_deck_by_hand_gives_the_numbers_of_the_scene_that_says_the_same(tmp_path: Path) -> None:
    (tmp_path / "ours.scene").write_text(OURS + LOOKED_AT)
    meshio.Mesh(np.array(CORNERS), [("hexahedron", np.array(CUBES))]).write(tmp_path / "bar.vtu")
    assert main(["import", str(PARTS / "deck.inp"), "--units", "mm-t-s", "--out", str(tmp_path / "theirs.scene")]) == 0
    with (tmp_path / "theirs.scene").open("a") as file:
        file.write(LOOKED_AT)
    ours, theirs = (metrics(tmp_path / f"{name}.scene", "fe") for name in ("ours", "theirs"))
    assert theirs == pytest.approx(ours, rel=SAME)


BLOCK = """softmark 1
scene "A block of two materials"
material soft = {law}
material hard = {hard}
body body = solid(box(size = (20, 10, 10) mm), soft)
region half = part(body, where = x >= 10 mm, material = hard)
support wall = fixed(body, where = x <= 0 mm)
support edge = displaced(body, where = x >= 20 mm, by = (1, 0, 0.5) mm, components = (x, z))
load push = traction(body, where = z >= 10 mm, vector = (0, 200, 50) Pa)
load weight = gravity(9.81 m/s^2, direction = -z)
analysis rest = static(tolerance = 1e-12)
model fe = fem({element}, strain = {strain}, size = 10 mm)
"""
SHARED = "density = 1000 kg/m^3)"
PAIRS = {
    "small": ("linear_elastic(young = 10 kPa, poisson = 0.3, ", "linear_elastic(young = 30 kPa, poisson = 0.2, "),
    "of febio": ("neo_hookean(young = 10 kPa, poisson = 0.3, ", "st_venant_kirchhoff(young = 30 kPa, poisson = 0.2, "),
    "finite": (
        "neo_hookean_isochoric(young = 10 kPa, poisson = 0.3, ",
        "mooney_rivlin(c1 = 3 kPa, c2 = 1 kPa, poisson = 0.3, ",
    ),
}

WAYS = [("calculix", "small"), ("calculix", "finite"), ("gmsh", "small"), ("gmsh", "finite"), ("febio", "of febio")]
TAKEN = {"febio": ("tet4", "hex8")}  # what `dsl export` has for it


@pytest.mark.slow
@pytest.mark.parametrize(
    ("element", "to", "laws"),
    [(e, *way) for way in WAYS for e in TAKEN.get(way[0], ("tet4", "tet10", "hex8", "hex20"))],
)
def test_out_and_in_again_gives_the_same_numbers(element: str, to: str, laws: str, tmp_path: Path) -> None:
    law, hard = (own + SHARED for own in PAIRS[laws])
    strain = "small" if laws == "small" else "finite"
    own = BLOCK.format(law=law, hard=hard, element=element, strain=strain)
    (tmp_path / "ours.scene").write_text(own + LOOKED_AT)
    assert main(["export", str(tmp_path / "ours.scene"), "--to", to, "--out", str(tmp_path / "out")]) == 0
    again = tmp_path / "again.scene"
    if to != "gmsh":
        (path,) = (tmp_path / "out").rglob("*.inp" if to == "calculix" else "*.feb")
        more = ["--units", "mm-g-s", "--density", "1000kg/m^3"]
    else:
        (path,) = (tmp_path / "out").rglob("*.msh")
        more = ["--unit", "1m", "--material", law]
    assert main(["import", str(path), *more, "--out", str(again)]) == 0
    text = again.read_text()
    if to == "gmsh":  # a mesh has its groups alone: what they are for is said by hand
        text = on_groups(text, own)
    text = text.replace("static()", "static(tolerance = 1e-12)")
    again.write_text(text + LOOKED_AT)
    ours, theirs = metrics(tmp_path / "ours.scene", "fe"), metrics(again, "fe")
    assert theirs == pytest.approx(ours, rel=SAME)


def on_groups(text: str, own: str) -> str:
    """The scene of a mesh, with what the first scene says of its parts said of the groups of these names."""
    lines = []
    for line in own.splitlines():
        name = line.split()[1] if line.startswith(("support", "load")) else ""
        if line.startswith("material hard"):
            lines.append(line)
        elif name and f"group_{name} " in text:
            head, _, tail = line.partition("where = ")
            lines.append(f"{head}where = group_{name}{tail[tail.index(',') :] if ',' in tail else ')'}")
        elif name or line.startswith(("analysis", "model")):
            lines.append(line.replace(", size = 10 mm", ""))
    return text.replace('"half")', '"half", material = hard)') + "\n".join(lines) + "\n"


CORNERS_OF = """
probe near = point(body, at = (20, 10, 10) mm)
probe far  = point(body, at = (20, 0, 0) mm)
probe mid  = point(body, at = (10, 10, 10) mm)
"""
NODES = {"near": 12, "far": 9, "mid": 7}
FINE = "*STEP, NLGEOM, INC=1000\n*STATIC\n0.1, 1.\n*CONTROLS, PARAMETERS=FIELD\n1e-11, 1e-10\n"
SOFT = [("*STEP\n*STATIC\n", FINE), ("BAR, P2, 0.25\n", ""), ("9810.", "4e6")]
TURNING = [SOFT[0], ("9810.", "4e6")]
RUBBER = ("*ELASTIC\n210000., 0.3", "*HYPERELASTIC, NEO HOOKE\n3., 0.2")
DECKS: dict[str, tuple[list[tuple[str, str]], float]] = {  # relative to the greatest: CalculiX prints 7 digits
    "small": ([], 2e-7),
    "st_venant_kirchhoff": ([*SOFT, ("210000., 0.3", "15., 0.3")], 2e-6),
    "neo_hookean_isochoric": ([*SOFT, RUBBER], 2e-6),
    # where a pressure turns with its face CalculiX's answer depends on its increments: of 0.1 it is 1e-5 from where it
    # goes to, and of 0.01 at 2e-6
    "pressure": ([*TURNING, RUBBER], 2e-5),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", DECKS)
def test_calculix_finds_what_the_scene_of_its_deck_does(name: str, tmp_path: Path) -> None:
    changes, within = DECKS[name]
    if shutil.which("ccx") is None:
        pytest.skip("needs CalculiX")
    path = deck(tmp_path, *changes, ("*NODE FILE", "*NODE PRINT, NSET=NALL, FREQUENCY=1000\nU\n*NODE FILE"))
    subprocess.run(["ccx", "-i", "deck"], cwd=tmp_path, check=True, capture_output=True, timeout=120)
    block = (tmp_path / "deck.dat").read_text().split("displacements")[-1].splitlines()[1:]
    theirs = np.array([line.split() for line in block if line.strip()], dtype=np.float64)[:, 1:]
    made = tmp_path / "made.scene"
    assert main(["import", str(path), "--units", "mm-t-s", "--out", str(made)]) == 0
    made.write_text(made.read_text() + CORNERS_OF)
    assert main(["run", str(made), "--json", str(tmp_path / "made.json")]) == 0
    probes = json.loads((tmp_path / "made.json").read_text())["models"]["fe"]["probes"]
    ours = np.array([probes[name]["displacement"][0] for name in NODES]) * 1e3  # mm
    assert np.abs(ours - theirs[[n - 1 for n in NODES.values()]]).max() < within * np.abs(theirs).max()


# ------------------------------------------------------------------ hostile files

HOSTILE = [
    ("1, 4, 5, 8\n", "--5, 1\n"),
    ("*NSET, NSET=WALL\n1, 4, 5, 8", "*NSET, NSET=WALL, GENERATE\n5"),
    ("*NSET, NSET=WALL\n1, 4, 5, 8", "*NSET, NSET=WALL, GENERATE\n8, 5, 1"),
    ("1, 4, 5, 8\n", "WALL\n"),
    ("1, 4, 5, 8\n", "S0, S0\n" + "".join(f"*NSET, NSET=S{i}\nS{i + 1}, S{i + 1}\n" for i in range(49))),
    ("7.8E-9", "1e305"),
    ("7.8E-9", "1_0"),
    ("*HEADING", "*HEADING\0"),
    ("12, 20., 10., 10.", "12, 20., nan, 10."),
]


@pytest.mark.parametrize(("old", "new"), HOSTILE, ids=[str(i) for i in range(len(HOSTILE))])
def test_decks_that_would_break_a_reader(old: str, new: str, tmp_path: Path) -> None:
    with pytest.raises((Unreadable, MissingUnit)):
        text_of(deck(tmp_path, (old, new)))


def test_atoms_from_the_last_to_the_first_are_none(tmp_path: Path) -> None:
    (tmp_path / "rod.pml").write_bytes((OWN / "rod.pml").read_bytes())
    (tmp_path / "rod.lml").write_text((OWN / "rod.lml").read_text().replace("0-3", "3-0"))
    with pytest.raises(Unreadable, match="ends before it begins"):
        import_formats.read(tmp_path / "rod.pml")


@pytest.mark.parametrize("told", ["gel(", "gel\nload a = gravity(1 m/s^2)", "", "a b"])
def test_a_material_that_is_none(told: str, tmp_path: Path) -> None:
    with pytest.raises(MissingValue, match="is not a material"):
        text_of(deck(tmp_path, ("*ELASTIC\n210000., 0.3", "")), SuppliedValues(told))


def mutated(data: bytes, chance: random.Random) -> bytes:
    """Cut, doubled, with bytes, words or lines of its own in other places, or numbers that are none."""
    found = bytearray(data)
    lines = data.split(b"\n")
    for _ in range(chance.choice((1, 1, 2, 5))):
        at = chance.randrange(len(found) + 1)
        way = chance.randrange(7)
        if way == 0:
            found = found[:at]
        elif way == 1:
            found[at:at] = chance.choice(lines) + b"\n"
        elif way == 2:
            found[at : at + chance.choice((1, 3, 20))] = chance.randbytes(chance.choice((0, 1, 4)))
        elif way == 3:
            words = (b"nan", b"1e999", b"-1", b"0", b"99999999999", b"1_0", b"", b"inf", b"9" * 30, b"0-999999999")
            found[at : at + chance.choice((0, 1, 2))] = chance.choice(words)
        elif way == 4:
            found[at:at] = chance.choice((b"\n*INCLUDE, INPUT=deck.inp\n", b"\n*NSET, NSET=WALL\nWALL\n", b"\n*STEP\n"))
        elif way == 5:
            random_order = data.split(b"\n")
            chance.shuffle(random_order)
            found = bytearray(b"\n".join(random_order)) if chance.random() < 0.1 else found
        else:
            end = min(len(found), at + chance.choice((5, 50, 500)))
            found = found[:at] + found[end:]
        if not found:
            return b""
    return bytes(found)


def tried(path: Path) -> Deck | None:
    """What is read and written of a file; None where it is refused in words."""
    try:
        deck = import_formats.read(path)
        told = deck_units.read_unit_options("mm-t-s", None, None, None)
        text = scene_writer.write_scene(deck, told, SuppliedValues(GEL, "1000 kg/m^3"), "m.inp").scene
    except (Unreadable, NotImportable, MissingUnit, MissingValue) as error:
        return None if str(error) else pytest.fail("it was refused without a word")
    return deck if format_source(Source("x", text)) == text else pytest.fail("it is not in canonical form")


def fuzzed(folder: Path, count: int, seed: int) -> int:
    """How many of so many mutated files were read."""
    chance, read = random.Random(seed), 0
    seeds: list[tuple[Path, Callable[[bytes], bytes]]] = [(path, path.read_bytes) for path in FILES]  # type: ignore[misc]
    seeds.append((OWN / "rod.lml", (OWN / "rod.lml").read_bytes))  # type: ignore[arg-type]
    for i in range(count):
        path = seeds[i % len(seeds)][0]
        file = folder / f"f{path.suffix}"
        file.write_bytes(mutated(path.read_bytes(), chance))
        if path.suffix == ".lml":
            (folder / "f.pml").write_bytes((OWN / "rod.pml").read_bytes())
            file = folder / "f.pml"
        start = time.perf_counter()
        read += tried(file) is not None
        assert time.perf_counter() - start < 10.0, file.read_bytes()[:2000]
    return read


def test_hostile_files_are_read_or_refused(tmp_path: Path) -> None:
    assert fuzzed(tmp_path, 60, 1) > 5


@pytest.mark.long
@pytest.mark.slow
def test_two_thousand_hostile_files_are_read_or_refused(tmp_path: Path) -> None:
    assert 200 < fuzzed(tmp_path, 2000, 2) < 1900
