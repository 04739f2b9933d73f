"""FEBio, PolyFEM and SOFA, which are not installed here: stand-ins read the decks and answer as their sources say.

Their answers are our own solution of the same mesh, or others that are not; what they write is in tests/shared/
answering.py, with where each line comes from. That these programs read the decks as they are meant is not shown here.
"""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from program_stand_ins import PROGRAMS as ANSWERING
from program_stand_ins import stand_in

import softmark
from softmark.interpreter.models.external.adapters import PROGRAMS, adapter, executables
from softmark.interpreter.models.external.external_builder import PreparedExternalModel
from softmark.interpreter.models.external.external_problem import NoAnswer
from softmark.interpreter.models.model_preparation import Measurements, prepared_model
from softmark.interpreter.models.shared.prepared_model import BuildContext, Solution
from softmark.interpreter.problem.body_case import case_for

Solved = tuple[Any, np.ndarray]  # a scene, and our displacements (n, 3), m
BLOCK = """softmark 1
scene "A block, pulled and bent"
material gel = neo_hookean(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
body block = solid(box(size = (20, 10, 10) mm), gel)
support wall = fixed(block, where = x <= 0 mm)
load weight = gravity(9.81 m/s^2, direction = -z)
load pull = traction(block, where = x >= 20 mm, vector = (3, 0, 2) kPa)
model ours = fem(tet4, strain = finite, size = 5 mm)
"""
HOW = {  # what a stand-in does, its status, and what is said of it
    "wrong": ("not_converged", ["the displacements of {title} leave a residual of 5.5e-01 of the loads"] * 3),
    "nothing": ("failed", ["it wrote no model.log", "it wrote no answer.vtu", "it wrote no answer*.vtu"]),
    "cut": (
        "failed",
        [
            "u.csv does not list the displacements of all 45 nodes in order",
            "answer.vtu has no point at 1 of 45 nodes",
            "the points of answer0.vtu are not the nodes of the scene",
        ],
    ),
    "NaN": (
        "failed",
        ["1 of its 135 displacements are not finite numbers", "`solution` is nan", "`u` is nan at point 0"],
    ),
    "dies": ("failed", ["it ended with exit status 3; last output: no licence"] * 3),
    "lost": (
        "not_converged",
        [
            "FEBio reports no solution: error termination, after time 0.1 of 1: Negative jacobian.",
            "PolyFEM reports no solution: [Newton][Backtracking] Finished: Reached iteration limit",
            "SOFA reports no solution: The number of Newton iterations reached the maximum",
        ],
    ),
}


@pytest.fixture(scope="module")
def solved() -> Solved:
    """A scene with models of all of them, and our displacements (n, 3), m."""
    models = "".join(f"model {p} = external_solver({p}, tet4, strain = finite, size = 5 mm)\n" for p in ANSWERING)
    scene = softmark.loads(BLOCK + models).scene
    return scene, np.asarray(prepared(scene, "ours").solve(lambda *_: None).mesh.displacement)


def prepared(scene: Any, name: str) -> Any:
    """A model of a scene, ready to be solved."""
    declared = scene.declared[name]
    workshop = BuildContext(scene=scene, measured=Measurements(scene))
    return prepared_model(declared, case_for(scene, declared), workshop)[0]


def answered(solved: Solved, program: str, how: str, folder: Path, patch: pytest.MonkeyPatch) -> Solution:
    """What comes of asking a stand-in."""
    scene, u = solved
    theirs: PreparedExternalModel = prepared(scene, program)
    folder = stand_in(program, how, theirs.mesh.points, theirs.mesh.cells, 1.3 * u if how == "wrong" else u, folder)
    patch.setenv("PATH", f"{folder}:{os.environ['PATH']}")
    return theirs.solve(lambda *_: None)


@pytest.mark.parametrize("program", ANSWERING)
def test_an_answer_is_read_and_judged(
    program: str, solved: Solved, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """FEBio's table has 12 digits, PolyFEM's file has doubles and SOFA's 6 digits of each displacement."""
    found = answered(solved, program, "right", tmp_path, monkeypatch)
    assert found.status == "converged", found.message
    digits = {"febio": 5e-12, "polyfem": 1e-15, "sofa": 5e-6}[program]
    most = np.abs(solved[1]).max()
    assert found.mesh is not None
    assert np.abs(found.mesh.displacement - solved[1]).max() <= digits * most
    version = "4.12.0" if program == "febio" else "unknown version"
    assert found.facts["program"] == f"{PROGRAMS[program].title} {version}"
    assert found.spent is not None
    if program == "sofa":  # it has no clock that counts the only step
        assert found.spent.most
    else:
        assert not found.spent.most
        assert found.spent.wall_s == pytest.approx(3e-3, rel=1e-12)  # as the stand-in says
    assert found.facts.get("iterations") == {"febio": 31, "polyfem": None, "sofa": 2}[program]


def test_what_its_deck_does_not_write_is_said_before_anything_is_run() -> None:
    """Quadratic cells at finite strain, by `dsl check` and by the plan."""
    lines = [line for line in BLOCK.splitlines() if not line.startswith("model")]
    theirs = "model theirs = external_solver(polyfem, tet10, strain = finite, size = 10 mm)\n"
    found = softmark.loads("\n".join([*lines, theirs])).warnings
    assert any("tet10 at finite strain" in w.message for w in found), found


def test_quadratic_cells_have_the_nodes_between_their_corners(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its mesh has corners alone, and its answer the nodes that it makes between them, which are ours."""
    models = "ours = fem(tet10", "polyfem = external_solver(polyfem, tet10"
    lines = [f"model {own}, strain = small, size = 10 mm)" for own in models]
    text = "\n".join([line for line in BLOCK.splitlines() if not line.startswith("model")] + lines)
    scene = softmark.loads(text + "\n").scene
    u = np.asarray(prepared(scene, "ours").solve(lambda *_: None).mesh.displacement)
    found = answered((scene, u), "polyfem", "right", tmp_path, monkeypatch)
    assert found.status == "converged", found.message
    assert found.mesh is not None
    assert np.array_equal(found.mesh.displacement, u)  # doubles go through base64 as they are


def test_digits_that_tell_nothing_are_too_few(solved: Solved, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """1e-2 of each displacement is 0.29 of the loads: three times that would let 1.3 u pass, which leaves 0.55."""
    monkeypatch.setattr(adapter("sofa"), "ROUNDING", 1e-2)
    found = answered(solved, "sofa", "wrong", tmp_path, monkeypatch)
    assert (found.status, "too few digits" in (found.message or "")) == ("not_converged", True)


@pytest.mark.parametrize("how", HOW)
@pytest.mark.parametrize("program", ANSWERING)
def test_what_goes_wrong_is_told(
    program: str, how: str, solved: Solved, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = answered(solved, program, how, tmp_path, monkeypatch)
    status, messages = HOW[how]
    message = messages[list(ANSWERING).index(program)].format(title=PROGRAMS[program].title)
    assert found.status == status, found.message
    assert message in (found.message or "")


def test_an_end_without_its_last_words_is_no_answer(
    solved: Solved, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """FEBio's table may be whole, and its log not: it was ended before it knew."""
    found = answered(solved, "febio", "unfinished", tmp_path, monkeypatch)
    assert (found.status, "no normal termination" in (found.message or "")) == ("failed", True)


BROKEN = {  # files as a program may leave them, by what is said
    "no normal termination": ("febio", {"model.log": "------- converged at time : 1e\n Solve time .. : 0 (e sec)\n"}),
    "not a table of times": ("febio", {"model.log": "{good}", "u.csv": "*Step  = 1\n*Time  = soon\n*Data  = u\n"}),
    "no displacements at time 1": ("febio", {"model.log": "{good}", "u.csv": "*Step  = 1\n"}),
    "not a table of displacements": (
        "febio",
        {"model.log": "{good}", "u.csv": "*Step  = 1\n*Time  = 1\n*Data  = u\n1,2\n1,2,3\n"},
    ),
    "it wrote no answer.vtu: \u241b[31mred": ("polyfem", {"log.txt": "[polyfem] [error] \x1b[31mred\n"}),
    "no vectors `solution`": ("polyfem", {"log.txt": "", "answer.vtu": "{vtu}"}),
    "it diverged": ("sofa", {"log.txt": "[DIVERGED]"}),
    "no vectors `u`": ("sofa", {"log.txt": "", "answer0.vtu": "{vtu}"}),
}
VTU = """<VTKFile type="UnstructuredGrid"><UnstructuredGrid><Piece NumberOfPoints="1" NumberOfCells="0">
<Points><DataArray type="Float64" NumberOfComponents="3" format="ascii">0 0 0</DataArray></Points>
</Piece></UnstructuredGrid></VTKFile>"""


@pytest.mark.parametrize("why", BROKEN)
def test_files_that_are_none_are_said(why: str, solved: Solved, tmp_path: Path) -> None:
    program, files = BROKEN[why]
    adapter(program).write(prepared(solved[0], program).asked(), tmp_path)
    for name, content in files.items():
        (tmp_path / name).write_text(content.replace("{good}", adapter("febio").GOOD).replace("{vtu}", VTU))
    with pytest.raises(NoAnswer) as found:
        adapter(program).read(tmp_path)
    assert why in str(found.value)


def test_what_a_program_writes_over_is_no_answer(solved: Solved, tmp_path: Path) -> None:
    adapter("sofa").write(prepared(solved[0], "sofa").asked(), tmp_path)
    (tmp_path / executables.NODES).write_bytes(b"none")
    with pytest.raises(NoAnswer, match="overwrote"):
        executables.read_nodes(tmp_path)


@pytest.mark.parametrize("program", ANSWERING)
def test_where_it_is_not_installed_it_is_skipped(
    program: str, solved: Solved, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    found = prepared(solved[0], program).solve(lambda *_: None)
    assert (found.status, adapter(program).places()) == ("skipped", ())
    assert adapter(program).install in (found.message or "")


def test_what_they_cannot_do_is_unsupported(solved: Solved) -> None:
    """Whole facets alone are held by PolyFEM, and nothing that moves by SOFA."""
    problem = prepared(solved[0], "polyfem").asked()
    held = np.concatenate([problem.held, [[int(problem.points[:, 0].argmax()), 0]]])
    point = replace(problem, held=held, values=np.append(problem.values, 0.0))
    moved = replace(problem, values=problem.values + 1e-3)
    assert [what for what, _ in adapter("polyfem").refuses(point)] == ["the supports"]
    assert [what for what, _ in adapter("sofa").refuses(moved)] == ["a support that moves"]
    assert [what for what, _ in adapter("febio").refuses(replace(problem, strain="small"))] == ["strain = small"]
    assert [adapter(program).refuses(problem) for program in ANSWERING] == [[], [], []]
    bent = replace(problem, forces=problem.forces * np.linspace(0.0, 1.0, len(problem.forces))[:, None])
    assert [what for what, _ in adapter("polyfem").refuses(bent)] == ["the loads"]


def test_what_was_never_run_says_so(solved: Solved) -> None:
    assert {name for name, own in PROGRAMS.items() if not own.tried} == set(ANSWERING)
    declared = solved[0].declared["sofa"]
    assert declared.thing.outline(case_for(solved[0], declared)).endswith(
        "this adapter has never been run with the program"
    )
