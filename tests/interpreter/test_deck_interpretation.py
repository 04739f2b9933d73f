"""Cards of decks mean what Abaqus and CalculiX mean by them, or are listed; every refusal states its true reason."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from softmark.grammar.diagnostic import Source
from softmark.interpreter.cli.main import main
from softmark.interpreter.importers import deck_units, import_formats, scene_writer
from softmark.interpreter.importers.deck_amplitudes import Amplitude
from softmark.interpreter.importers.imported_deck import Deck, NotImportable
from softmark.references.measured_data import Unreadable

MM = deck_units.read_unit_options("mm-t-s", None, None, None)
NODES = """*NODE, NSET=ALL
1, 0., 0., 0.\n2, 0., 1., 0.\n3, 0., 0., 1.\n4, 0., 1., 1.
5, 1., 0., 0.\n6, 1., 1., 0.\n7, 1., 0., 1.\n8, 1., 1., 1.
9, 2., 0., 0.\n10, 2., 1., 0.\n11, 2., 0., 1.\n12, 2., 1., 1.
"""
CELLS = """*ELEMENT, TYPE=C3D8, ELSET=BAR
1, 1, 5, 6, 2, 3, 7, 8, 4
2, 5, 9, 10, 6, 7, 11, 12, 8
"""
SETS = "*NSET, NSET=WALL\n1, 2, 3, 4\n*NSET, NSET=TIP\n9, 10, 11, 12\n"
ELASTIC = "*MATERIAL, NAME=M\n*ELASTIC\n1000., 0.3\n*SOLID SECTION, ELSET=BAR, MATERIAL=M\n"
STEP = "*STEP\n*STATIC\n*BOUNDARY\nWALL, 1, 3\n*CLOAD\nTIP, 3, -10.\n*END STEP\n"
BAR = NODES + CELLS + SETS + ELASTIC + STEP


def read(folder: Path, text: str) -> Deck:
    """A deck of this text."""
    (folder / "d.inp").write_text(text)
    return import_formats.read(folder / "d.inp")


def changed(*changes: tuple[str, str]) -> str:
    """The bar with some words in place of others."""
    text = BAR
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    return text


def listed(found: Deck) -> dict[str, str]:
    """What is not carried over, and why."""
    return {own.what: own.why for own in found.left}


# ------------------------------------------------------------------ names


PARTS = f"""*PART, NAME=Bar
{NODES}{CELLS}*NSET, NSET=Set-1\n1, 2, 3, 4, 5, 6, 7, 8\n*NSET, NSET=Set-2\n9, 10, 11, 12\n*ELSET, ELSET=Set-1\n1
*ELSET, ELSET=Set-2\n2
*SOLID SECTION, ELSET=Set-1, MATERIAL=SOFT\n*SOLID SECTION, ELSET=Set-2, MATERIAL=HARD\n*END PART
*ASSEMBLY, NAME=Assembly\n*INSTANCE, NAME=Bar-1, PART=Bar\n*END INSTANCE
*NODE\n1, 5., 5., 5.\n*NSET, NSET=RP\n1
*NSET, NSET=Set-1, INSTANCE=Bar-1\n1, 2, 3, 4\n*NSET, NSET=Set-2, INSTANCE=Bar-1\n12\n*END ASSEMBLY
*MATERIAL, NAME=SOFT\n*ELASTIC\n1., 0.3\n*MATERIAL, NAME=HARD\n*ELASTIC\n100., 0.3
*STEP\n*STATIC\n*BOUNDARY\nSet-1, ENCASTRE\n*CLOAD\nSet-2, 3, -0.001\n*END STEP
"""


def test_sets_of_a_part_and_of_the_assembly_are_not_united(tmp_path: Path) -> None:
    """Of one name: the assembly's four nodes are held and its one node is pulled, the part's cells are its sections."""
    found = read(tmp_path, PARTS)
    (hold,), (force,) = found.holds, found.forces
    assert found.points[hold.nodes, 0].tolist() == [0.0] * 4
    assert found.points[force.nodes].tolist() == [[2.0, 1.0, 1.0]]
    assert [(p.name, p.cells.tolist()) for p in found.parts] == [("SOFT", [0]), ("HARD", [1])]
    assert {own.name for own in found.named} >= {"Bar-1.Set-1", "Bar-1.Set-2"}


def test_names_with_dots_are_whole_names_in_a_flat_deck(tmp_path: Path) -> None:
    text = changed(
        ("*MATERIAL", "*ELSET, ELSET=soft.part\n1\n*ELSET, ELSET=hard.part\n2\n"
         "*MATERIAL, NAME=H\n*ELASTIC\n9., 0.3\n*MATERIAL"),
        ("*SOLID SECTION, ELSET=BAR, MATERIAL=M", "*SOLID SECTION, ELSET=soft.part, MATERIAL=M\n"
         "*SOLID SECTION, ELSET=hard.part, MATERIAL=H"),
    )  # fmt: skip
    assert [(p.name, p.cells.tolist()) for p in read(tmp_path, text).parts] == [("M", [0]), ("H", [1])]


def test_a_name_of_one_instance_is_taken_and_said(tmp_path: Path) -> None:
    text = PARTS.replace("*NSET, NSET=RP", "*NSET, NSET=NE, ELSET=Only\n*NSET, NSET=RP").replace(
        "*END PART", "*ELSET, ELSET=Only\n2\n*END PART")  # fmt: skip
    found = read(tmp_path, text.replace("Set-1, ENCASTRE", "NE, 1, 1"))
    assert sorted(found.points[found.holds[0].nodes, 0].tolist()) == [1.0] * 4 + [2.0] * 4
    assert any("is read as `Bar-1.Only`" in how for how in found.taken)


def test_a_name_of_two_instances_is_refused_with_both_scopes(tmp_path: Path) -> None:
    text = PARTS.replace("*NODE\n1, 5.", "*INSTANCE, NAME=Bar-2, PART=Bar\n0., 3., 0.\n*END INSTANCE\n*NODE\n1, 5.")
    text = text.replace("*NSET, NSET=Set-1, INSTANCE=Bar-1\n1, 2, 3, 4\n", "")
    with pytest.raises(Unreadable, match=r"not defined in the assembly, but in 2 of its instances.*`Bar-1\.Set-1`"):
        read(tmp_path, text)


@pytest.mark.parametrize(
    ("words", "held"),
    [("XSYMM", (0,)), ("YSYMM", (1,)), ("ZSYMM", (2,)), ("XASYMM", (1, 2)), ("YASYMM", (0, 2)), ("ZASYMM", (0, 1)),
     ("ENCASTRE", (0, 1, 2)), ("pinned", (0, 1, 2)), ("2, 3", (1, 2)), ("1, 6", (0, 1, 2))],
)  # fmt: skip
def test_names_of_supports(words: str, held: tuple[int, ...], tmp_path: Path) -> None:
    """Source: Abaqus Analysis User's Guide, "Boundary conditions": XASYMM is u2 = u3 = 0, with a rotation of shells."""
    (hold,) = read(tmp_path, changed(("WALL, 1, 3", f"WALL, {words}"))).holds
    assert hold.components == held


@pytest.mark.parametrize(
    "changes",
    [
        [("*SOLID SECTION", "*SOLIDSECTION"), ("*END STEP", "*ENDSTEP")],
        [("*SOLID SECTION", "  *Solid  Section"), ("*CLOAD", "\t*cload")],
        [("*NSET, NSET=TIP", "*NSET,\nNSET=TIP")],
        [("*ELEMENT, TYPE=C3D8, ELSET=BAR", '*Element, type="C3D8", elset="BAR"')],
        [("1, 1, 5, 6, 2, 3, 7, 8, 4", "1, 1, 5, 6, 2,\n3, 7, 8, 4")],
        [("1, 1, 5, 6, 2, 3, 7, 8, 4", "1, 1, 5, 6, 2, 3, 7, 8, 4, 9, 10,")],
        [("*NODE", "exported by hand\n*NODE")],
        [("1, 0., 0., 0.", "1, , , 0.D0, 0., 0., 1.")],
        [("9, 10, 11, 12\n", "9, 12, 1\n"), ("NSET=TIP", "NSET=TIP, GEN")],
        [("9, 10, 11, 12\n", "9, 100000000000\n"), ("NSET=TIP", "NSET=TIP, GENERATE")],
        [("*STATIC", "*NODE PRINT, NSET=ALL\nU\n*STATIC")],
    ],
    ids=str,
)
def test_ways_of_writing_the_same_deck(changes: list[tuple[str, str]], tmp_path: Path) -> None:
    ours, theirs = read(tmp_path, BAR), read(tmp_path, changed(*changes))
    np.testing.assert_array_equal(theirs.points, ours.points)
    np.testing.assert_array_equal(theirs.cells, ours.cells)
    assert [hold.nodes.tolist() for hold in theirs.holds] == [[0, 1, 2, 3]]
    assert [(own.nodes.tolist(), own.force) for own in theirs.forces] == [([8, 9, 10, 11], (0.0, 0.0, -10.0))]
    assert [p.law for p in theirs.parts] == [p.law for p in ours.parts]


# ------------------------------------------------------------------ options of loads


TABLE = "*AMPLITUDE, NAME=A1\n0., 0., 0.5, 1.\n1., 0.5\n"


@pytest.mark.parametrize(
    ("curve", "step", "factor"),
    [
        (TABLE, "*STATIC", 0.5),
        (TABLE, "*STATIC\n0.1, 0.25", 0.5),
        (TABLE, "*STATIC\n0.1, 0.75", 0.75),
        (TABLE, "*STATIC\n1., 5.", 0.5),
        (TABLE.replace("A1", "a1, TIME=TOTAL TIME"), "*STATIC\n0.1, 0.25", 0.5),
        (TABLE.replace("A1", "A1, DEFINITION=SMOOTH STEP"), "*STATIC\n0.1, 0.25", 0.5),
        ("*AMPLITUDE, NAME=A1, DEFINITION=EQUALLY SPACED, FIXED INTERVAL=0.5\n0., 3., 4.\n", "*STATIC", 4.0),
    ],
)
def test_loads_have_the_end_of_their_amplitude(curve: str, step: str, factor: float, tmp_path: Path) -> None:
    text = changed(("*MATERIAL", f"{curve}*MATERIAL"), ("*STATIC", step), ("*CLOAD", "*CLOAD, AMPLITUDE=A1"))
    found = read(tmp_path, text)
    assert found.forces[0].force == (0.0, 0.0, pytest.approx(-10.0 * factor, rel=1e-14))
    assert any(f"values in the scene are multiplied by {factor:g}," in how for how in found.taken)


def test_an_amplitude_of_supports_and_pressures(tmp_path: Path) -> None:
    found = read(tmp_path, changed(("*MATERIAL", f"{TABLE}*MATERIAL"), ("*CLOAD\nTIP, 3, -10.",
                 "*BOUNDARY, AMPLITUDE=A1\nTIP, 1, 1, 3.\n*DLOAD, AMPLITUDE=A1\nBAR, P2, 8.\n")))  # fmt: skip
    assert [hold.values for hold in found.holds if any(hold.values)] == [(1.5,)]
    assert [push.pressure for push in found.pushes] == [4.0]


def test_a_smooth_step_is_flat_at_both_ends() -> None:
    """10 x^3 - 15 x^4 + 6 x^5 between 0 and 1: 0.5 in the middle, 0.103515625 at a quarter."""
    curve = Amplitude((0.0, 1.0), (0.0, 1.0), smooth=True)
    assert [curve.at(t) for t in (-1.0, 0.0, 0.25, 0.5, 1.0, 2.0)] == [0.0, 0.0, 0.103515625, 0.5, 1.0, 1.0]


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ("*CLOAD", "*CLOAD, FOLLOWER", "FOLLOWER"), ("*CLOAD", "*CLOAD, LOAD CASE=2", "LOADCASE=2"),
        ("*CLOAD", "*CLOAD, SECTOR=3", "SECTOR=3"), ("*CLOAD", "*CLOAD, NONSENSE=1", "NONSENSE=1"),
        ("*CLOAD", "*CLOAD, OP=LATER", "OP=LATER"), ("*CLOAD", "*CLOAD, AMPLITUDE=none", "`none` is not defined"),
        ("*BOUNDARY", "*BOUNDARY, TYPE=VELOCITY", "TYPE=VELOCITY"), ("*BOUNDARY", "*BOUNDARY, FIXED", "FIXED"),
        ("*BOUNDARY", "*BOUNDARY, USER", "USER"), ("*BOUNDARY", "*BOUNDARY, SUBMODEL, STEP=1", "SUBMODEL"),
        ("*BOUNDARY", "*BOUNDARY, ORIENTATION=O", "ORIENTATION=O"),
    ],
)  # fmt: skip
def test_options_that_are_not_read_are_listed_with_their_card(old: str, new: str, why: str, tmp_path: Path) -> None:
    found = read(tmp_path, changed((old, new)))
    assert why in listed(found)[f"{old} on 1 lines"]
    assert len(found.forces) + len(found.holds) == 1  # the other card stays


@pytest.mark.parametrize("line", ["WALL, 0", "WALL, 4, 4, 0.1", "WALL, 3, 11", "WALL, NOWARP"])
def test_directions_that_solids_do_not_have_are_listed(line: str, tmp_path: Path) -> None:
    assert any("of *BOUNDARY on `WALL`" in what for what in listed(read(tmp_path, changed(("WALL, 1, 3", line)))))


def test_new_loads_of_a_step_replace_those_of_earlier_steps_only(tmp_path: Path) -> None:
    """Abaqus/CAE writes OP=NEW on every card of a step: the second must not remove the first."""
    more = ("*STEP\n*STATIC\n*BOUNDARY, OP=NEW\nTIP, 1, 1\n*BOUNDARY, OP=NEW\nTIP, 2, 2\n*CLOAD, OP=NEW\n1, 1, 4.\n"
            "*CLOAD, OP=NEW\n2, 1, 5.\n*END STEP\n")  # fmt: skip
    found = read(tmp_path, BAR + more)
    (hold,) = found.holds
    assert (hold.components, hold.nodes.tolist()) == ((0, 1), [8, 9, 10, 11])
    assert {own.nodes.item(): own.force[0] for own in found.forces} == {0: 4.0, 1: 5.0}


def test_a_first_step_of_perturbation_is_at_rest(tmp_path: Path) -> None:
    found = read(tmp_path, changed(("*STEP", "*STEP, PERTURBATION, NLGEOM")))
    assert (len(found.forces), found.static, found.strain) == (1, True, "small")
    assert any("perturbation" in how for how in found.taken)


def test_loads_of_reference_points_are_listed_with_the_reason(tmp_path: Path) -> None:
    found = read(tmp_path, PARTS.replace("Set-2, 3, -0.001", "RP, 3, -0.001"))
    assert listed(found)["*CLOAD on 1 nodes (`RP`)"] == "they belong to no solid cell, for example reference points"
    assert not found.forces


def test_weights_of_sets_that_are_all_of_the_body_together(tmp_path: Path) -> None:
    text = changed(("*MATERIAL", "*ELSET, ELSET=A\n1\n*ELSET, ELSET=B\n2\n*MATERIAL"), ("*CLOAD\nTIP, 3, -10.",
                   "*DLOAD\nA, GRAV, 9810., 0., 0., -1.\nB, GRAV, 9810., 0., 0., -1."))  # fmt: skip
    assert read(tmp_path, text).weights == [(0.0, 0.0, -9810.0)]
    found = read(tmp_path, text.replace("B, GRAV, 9810., 0., 0., -1.", ""))
    assert found.weights == []
    assert listed(found)["GRAV on the set `A`"] == "gravity can only act on the whole body"


# ------------------------------------------------------------------ materials


@pytest.mark.parametrize(
    ("card", "why"),
    [
        ("*HYPERELASTIC, MOONEY-RIVLIN\n2., -3., 0.1", "its shear modulus is not positive"),
        ("*HYPERELASTIC, NEO HOOKE\n2., 0.", "D1 is missing or 0"),
        ("*HYPERELASTIC, OGDEN, N=2\n2., 1., 1., 3., 0.1, 0.", "D2 is missing or 0"),
        ("*HYPERELASTIC, OGDEN, N=2\n2., 1., 1., 3., 0.1, 0.2", "the volumetric terms of D2 and D3"),
        ("*HYPERELASTIC, OGDEN, N=1\n2., 0., 0.1", "an exponent alpha is 0"),
        (
            "*HYPERELASTIC, POLYNOMIAL, N=2\n2., 1., 1., 1., 1., 0.1, 1e30",
            "the law POLYNOMIAL with N=2 is not supported",
        ),
        ("*HYPERELASTIC, VAN DER WAALS\n2., 5., 0.1, 0., 0.1", "the law VANDERWAALS is not supported"),
        ("*HYPERELASTIC, NEO HOOKE, TEST DATA INPUT\n2., 0.1", "fitting constants to test data"),
        ("*HYPERELASTIC, NEO HOOKE, MODULI=LONG TERM\n2., 0.1", "viscoelastic solids"),
        ("*HYPERELASTIC, NEO HOOKE, POISSON=0.4\n2.", "its option POISSON is not supported"),
        ("*HYPERFOAM\n2., 1., 0.1", "foam is not supported"),
        ("*ELASTIC\n1., 0.3\n*VISCOELASTIC, TIME=PRONY\n0.1, 0., 1.", "the instantaneous or the long-term stiffness"),
        ("*ELASTIC, TYPE=ENGINEERING CONSTANTS\n1., 1., 1., 0., 0., 0., 1., 1.,\n1.", "only the isotropic law"),
        ("*ELASTIC\n1., 0.3, 0.\n2., 0.3, 100.", "without temperature dependence"),
        ("*ELASTIC\n1., 0.3\n*PLASTIC\n1., 0.", "plasticity is not supported"),
    ],
)
def test_reasons_of_materials_that_no_law_here_is(card: str, why: str, tmp_path: Path) -> None:
    found = read(tmp_path, changed(("*ELASTIC\n1000., 0.3", card)))
    with pytest.raises(scene_writer.MissingValue) as wanting:
        scene_writer.write_scene(found, MM, scene_writer.SuppliedValues(), "x.inp")
    assert why in str(wanting.value)


def test_constants_of_ogden_are_those_of_the_language(tmp_path: Path) -> None:
    """2 mu/alpha^2 there is mu/alpha here: mu = 2 * 4 / 3.2, and 2 * 1 / -2.5; C01 < 0 is a term of alpha = -2."""
    card = "*HYPERELASTIC, OGDEN, N=2\n4., 3.2, 1., -2.5, 0.1, 1e30"
    law = read(tmp_path, changed(("*ELASTIC\n1000., 0.3", card))).parts[0].law
    assert law is not None
    assert (law.word, law.stresses) == ("ogden", {"bulk": 20.0})
    assert (law.stress_lists, law.lists) == ({"mu": (2.5, -0.8)}, {"alpha": (3.2, -2.5)})
    card = "*HYPERELASTIC, MOONEY-RIVLIN\n2., -0.5, 0.1"
    law = read(tmp_path, changed(("*ELASTIC\n1000., 0.3", card))).parts[0].law
    assert law is not None
    assert (law.stress_lists, law.lists) == ({"mu": (4.0, 1.0)}, {"alpha": (2.0, -2.0)})


# ------------------------------------------------------------------ refusals


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ("ELSET=BAR, MATERIAL", "ELSET=BARR, MATERIAL", "the element set `BARR` of *SOLID SECTION is not defined"),
        ("TIP, 3", "TOP, 3", "the node set `TOP` of *CLOAD is not defined"),
        ("WALL, 1, 3", "WALL, XSIM", "`XSIM` is neither a direction nor a named type of *BOUNDARY"),
        ("*END STEP\n", "", "the step that starts here has no *END STEP"),
        ("1, 2, 3, 4\n", "WALL\n", "the set `WALL` contains itself"),
        ("1, 1, 5, 6, 2, 3, 7, 8, 4", "1, 1, 5, 6, 2, 3, 7, 8", "an element C3D8 needs a number and 8 nodes"),
        ("12, 2., 1., 1.", "12, 2., 1., nan", "`nan` in the data of *NODE is not a finite number"),
        ("2, 5, 9, 10", "1, 5, 9, 10", "two elements have the number 1"),
        ("12, 2., 1., 1.", "11, 2., 1., 1.", "two nodes with different positions have the number 11"),
        ("*STEP", "*INCLUDE, INPUT=../d.inp\n*STEP", "`../d.inp`: that lies outside the folder of the file"),
        ("*STEP", "*INCLUDE, INPUT=none.inp\n*STEP", "it includes `none.inp`: there is no such file"),
        ("*STEP", "*INCLUDE, INPUT=d.inp\n*STEP", "it includes itself"),
        ("*STEP", "*INCLUDE, INPUT=.\n*STEP", "it includes `.`: that is a folder"),
    ],
)
def test_reasons(old: str, new: str, reason: str, tmp_path: Path) -> None:
    with pytest.raises(Unreadable) as refused:
        read(tmp_path, changed((old, new)))
    assert reason in str(refused.value)


def test_frames_and_rules_are_refused(tmp_path: Path) -> None:
    for new, reason in (("*NGEN\n1, 4, 1\n*NSET", "generated by rules"),
                        ("*SYSTEM\n1., 0.\n*NSET", "another coordinate system"),
                        ("*TRANSFORM, NSET=WALL\n1., 1., 0., -1., 1., 0.\n*NSET", "local directions")):  # fmt: skip
        with pytest.raises(NotImportable, match=reason):
            read(tmp_path, changed(("*NSET", new)))


def test_included_files_stand_in_their_place(tmp_path: Path) -> None:
    """Data lines of a card too, as both programs have it; a file that holds nothing but numbers needs no keyword."""
    head, nodes = NODES.split("\n", 1)
    (tmp_path / "nodes.txt").write_text(nodes)
    (tmp_path / "cells.txt").write_text(CELLS.split("\n", 1)[1])
    text = BAR.replace(NODES, f"{head}\n*INCLUDE, INPUT=nodes.txt\n").replace(
        CELLS, "*ELEMENT, TYPE=C3D8, ELSET=BAR, INPUT=cells.txt\n"
    )
    np.testing.assert_array_equal(read(tmp_path, text).points, read(tmp_path, BAR).points)
    np.testing.assert_array_equal(read(tmp_path, text).cells, read(tmp_path, BAR).cells)


@pytest.mark.slow
@pytest.mark.long
def test_files_that_are_included_again_and_again_are_refused(tmp_path: Path) -> None:
    """Ten files that include the next one ten times would be 10^9 lines."""
    (tmp_path / "f9.inp").write_text("** a comment\n" * 2000)
    for i in range(9):
        (tmp_path / f"f{i}.inp").write_text(f"*INCLUDE, INPUT=f{i + 1}.inp\n" * 10)
    with pytest.raises(Unreadable, match="includes too many files"):
        import_formats.read(tmp_path / "f0.inp")


# ------------------------------------------------------------------ scenes


def imported(folder: Path, text: str, *options: str) -> str:
    """The scene that `dsl import` writes of a deck in mm, t and s."""
    (folder / "d.inp").write_text(text)
    assert main(["import", str(folder / "d.inp"), "--units", "mm-t-s", "--out", str(folder / "d.scene"), *options]) == 0
    return (folder / "d.scene").read_text()


def test_how_a_deck_was_taken_is_printed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = imported(tmp_path, changed(("*MATERIAL", f"{TABLE}*MATERIAL"), ("*CLOAD", "*CLOAD, AMPLITUDE=A1")))
    said = capsys.readouterr().err
    assert "W752" in said
    assert "*CLOAD in line" in said
    assert "values in the scene are multiplied by 0.5," in said
    assert "a material has no density" in said
    assert "# interpreted: *CLOAD in line" in text


def test_no_density_is_needed_but_for_weight(tmp_path: Path) -> None:
    assert "density = 1000.0 kg/m^3" in imported(tmp_path, BAR)
    found = read(tmp_path, changed(("*CLOAD\nTIP, 3, -10.", "*DLOAD\nBAR, GRAV, 9810., 0., 0., -1.")))
    with pytest.raises(scene_writer.MissingValue, match="no density"):
        scene_writer.write_scene(found, MM, scene_writer.SuppliedValues(), "x.inp")


@pytest.mark.slow
@pytest.mark.long
def test_forces_on_many_nodes_are_carried_over(tmp_path: Path) -> None:
    """A plate of 24 x 24 nodes with a force of its own on each."""
    n = 24
    nodes = "".join(
        f"{1 + i + n * (j + n * k)}, {i}., {j}., {k}.\n" for k in (0, 1) for j in range(n) for i in range(n)
    )
    cells = ""
    for j in range(n - 1):
        for i in range(n - 1):
            a = 1 + i + n * j
            low = (a, a + 1, a + 1 + n, a + n)
            cells += ", ".join(map(str, (i + 1 + n * j, *low, *(v + n * n for v in low)))) + "\n"
    forces = "".join(f"{n * n + 1 + i}, 3, {1 + i % 7}.\n" for i in range(n * n))
    text = (
        f"*NODE\n{nodes}*ELEMENT, TYPE=C3D8, ELSET=BAR\n{cells}{ELASTIC}*NSET, NSET=WALL, GENERATE\n1, {n * n}\n{STEP}"
    )
    text = imported(tmp_path, text.replace("TIP, 3, -10.\n", forces))
    assert text.count("point_force(") == n * n
    assert "not imported:" not in text
    assert format_of(text) == text


def format_of(text: str) -> str:
    """The canonical form of a scene."""
    from softmark.grammar.printer import format_source

    return format_source(Source("x", text))


def test_supports_of_single_nodes_bring_no_warning(tmp_path: Path) -> None:
    """The import writes them, so what it says of them must not be a doubt: no W375."""
    text = imported(tmp_path, changed(("WALL, 1, 3", "1, 1, 3\n2, 1\n2, 3\n3, 1\n4, 1")))
    (tmp_path / "d.scene").write_text(text + "probe p = point(body, at = (2, 1, 1) mm)\n")
    assert main(["run", str(tmp_path / "d.scene"), "--json", str(tmp_path / "d.json")]) == 0
    report = json.loads((tmp_path / "d.json").read_text())
    assert "W375" not in {own["code"] for own in report["warnings"]}
    assert all(own["held"] == 1.0 for own in report["models"]["fe"]["reactions"].values())


# ------------------------------------------------------------------ the same numbers as CalculiX

FINE = "*STEP, NLGEOM, INC=1000\n*STATIC\n0.1, 1.\n*CONTROLS, PARAMETERS=FIELD\n1e-11, 1e-10\n"
PULLED = ("TIP, 3, -10.", "TIP, 1, 0.4")  # 1.6 N on 1 mm^2: both stay on the branch that is symmetric


def rubber(card: str) -> list[tuple[str, str]]:
    """The bar of rubber, pulled along x."""
    return [("*ELASTIC\n1000., 0.3", f"*HYPERELASTIC, {card}"), ("*STEP\n*STATIC\n", FINE), PULLED]


DECKS: dict[str, list[tuple[str, str]]] = {
    "amplitude": [("*MATERIAL", f"{TABLE}*MATERIAL"), ("*CLOAD", "*CLOAD, AMPLITUDE=A1")],
    "selects nodes by position": [("WALL, 1, 3", "1, 1, 3\n2, 1\n2, 3\n3, 1\n4, 1")],
    "dots": [("NSET=WALL", "NSET=x.WALL"), ("WALL, 1, 3", "x.WALL, 1, 3"), ("NSET=TIP", "NSET=y.WALL"),
             ("TIP, 3", "y.WALL, 3")],
    "steps": [("*END STEP\n", "*END STEP\n*STEP\n*STATIC\n*BOUNDARY, OP=NEW\nWALL, 1, 3\nTIP, 1, 1, 0.1\n"
               "*CLOAD, OP=NEW\n12, 2, 7.\n*END STEP\n")],
    "ogden 1": rubber("OGDEN, N=1\n4., 3.2, 0.1"),
    "ogden 2": rubber("OGDEN, N=2\n3., 1.3, 1., -2.5, 0.1, 1e30"),
    "mooney-rivlin": rubber("MOONEY-RIVLIN\n2.5, -0.5, 0.1"),
    "reduced polynomial": rubber("REDUCED POLYNOMIAL, N=2\n2., 0.3, 0.1, 1e30"),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", DECKS)
def test_calculix_finds_the_same_displacements(name: str, tmp_path: Path) -> None:
    """2e-6 of the greatest: CalculiX prints 7 digits, and its Newton is stopped at 1e-10 of the forces."""
    if shutil.which("ccx") is None:
        pytest.skip("needs CalculiX")
    text = changed(*DECKS[name])
    last = text.rindex("*END STEP")
    (tmp_path / "job.inp").write_text(text[:last] + "*NODE PRINT, NSET=ALL, FREQUENCY=1000\nU\n" + text[last:])
    subprocess.run(["ccx", "-i", "job"], cwd=tmp_path, check=True, capture_output=True, timeout=120)
    rows = [line.split() for line in (tmp_path / "job.dat").read_text().split("displacements")[-1].splitlines()[1:]]
    theirs = {int(row[0]): np.array(row[1:], dtype=np.float64) for row in rows if len(row) == 4}
    probes = "".join(f"probe n{n} = point(body, at = ({x}, {y}, {z}) mm)\n" for n, x, y, z in (
        (8, 1, 1, 1), (9, 2, 0, 0), (12, 2, 1, 1)))  # fmt: skip
    (tmp_path / "own.scene").write_text(
        imported(tmp_path, text).replace("static()", "static(tolerance = 1e-11)") + probes
    )
    assert main(["run", str(tmp_path / "own.scene"), "--json", str(tmp_path / "own.json")]) == 0
    found = json.loads((tmp_path / "own.json").read_text())["models"]["fe"]["probes"]
    scale = max(np.abs(u).max() for u in theirs.values())
    for n in (8, 9, 12):
        ours = np.array(found[f"n{n}"]["displacement"][0]) * 1e3
        np.testing.assert_allclose(ours, theirs[n], rtol=0.0, atol=2e-6 * scale)
