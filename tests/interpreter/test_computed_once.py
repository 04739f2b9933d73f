"""What a command makes of a scene, counted: texts parsed, scenes compiled, plans and cases made, meshes cut.

Each once. Before, a run of one model of the silicone beam parsed its text 3 times, and made 64 cases and 2 plans; a
check of the scene of trade-offs made 43 cases for each of its 17 variations; a comparison compiled each twice.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

import pytest

import softmark
from softmark.grammar import parser
from softmark.interpreter.cli.main import main
from softmark.interpreter.language import compiler as compiling
from softmark.interpreter.language.parameter_overrides import read_overrides
from softmark.interpreter.models.shared import support_selection
from softmark.interpreter.planning import run_plan
from softmark.interpreter.problem import body_case
from softmark.interpreter.problem.body_case import case_of
from softmark.interpreter.study.configurations.configuration_expansion import subject_of, task_of
from softmark.interpreter.study.configurations.configuration_task import perform
from softmark.interpreter.validation.scene_checks import apply_overrides
from softmark.interpreter.verification import facet_sweep
from softmark.interpreter.verification.by_model import beam_forces_check
from softmark.references import measured_curve
from softmark.solvers.mesh import structured_meshes

COUNTED: dict[CodeType, str] = {
    parser.parse.__code__: "parsed",
    compiling._compile.__code__: "compiled",
    run_plan.plan_of.__code__: "planned",
    body_case._build_case.__code__: "cases",
    structured_meshes.mesh_extrusion.__code__: "meshes",
    measured_curve.CurveFromFile.load.__code__: "curves",
    facet_sweep._sweep_sides.__code__: "swept",
    support_selection._select_support_nodes.__code__: "grips",
    beam_forces_check.BeamLine.rod.__code__: "rods",
}
BEAM = """
material silicone = neo_hookean(young = 60 kPa, poisson = 0.4, density = 1070 kg/m^3)
body     beam     = solid(box(size = (80, 20, 20) mm), silicone)
support  wall     = fixed(beam, where = x <= 0 mm)
load     weight   = gravity(9.81 m/s^2, direction = -z)
model     solid   = fem(hex8, strain = corotational, size = 20 mm)
model     rod     = beam6dof(segments = 8)
reference theory  = simo_reissner(beam)
probe  axis = line(beam, from = (0, 0, 0) mm, to = (80, 0, 0) mm)
metric eta  = relative_l2_error(axis, against = theory)
"""
STUDIES = """
study mesh     = sweep(solid.size, over = [20, 10] mm, models = [solid])
study segments = sweep(rod.segments, over = [4, 8], models = [rod])
"""
TRAINED = """
param nu = 0.4
model few   = pod(of = solid, over = softer, modes = 2)
study softer = sweep(nu, over = [0.3, 0.35, 0.4])
"""


@contextmanager
def counting() -> Iterator[Counter[str]]:
    """How often each of COUNTED is called, in this thread."""
    found: Counter[str] = Counter()

    def called(frame: FrameType, event: str, _: Any) -> None:
        if event == "call" and (what := COUNTED.get(frame.f_code)) is not None:
            found[what] += 1

    before = sys.getprofile()
    sys.setprofile(called)
    try:
        yield found
    finally:
        sys.setprofile(before)


def counted(*arguments: str) -> dict[str, int]:
    with counting() as found:
        assert main(list(arguments)) == 0
    return dict(found)


@pytest.fixture
def scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    file = tmp_path / "beam.scene"
    file.write_text(BEAM, encoding="utf-8")
    return file


def test_a_check_makes_each_thing_once(scene: Path) -> None:
    assert counted("check", str(scene)) == {"parsed": 1, "compiled": 1, "cases": 1}


def test_a_plan_is_made_once(scene: Path) -> None:
    assert counted("plan", str(scene)) == {"parsed": 1, "compiled": 1, "cases": 1, "planned": 1}


def test_a_run_makes_each_thing_once_and_so_do_its_page_and_what_it_states(scene: Path) -> None:
    once = {"parsed": 1, "compiled": 1, "cases": 1, "planned": 1}
    assert counted("run", str(scene), "--model", "solid") == once | {"meshes": 1, "grips": 1}


@pytest.mark.slow
@pytest.mark.long
def test_a_file_is_read_and_a_selection_swept_once_for_all_states(scene: Path) -> None:
    """Of three states the curve was read three times, and the selection swept in each: on the mesh of the model, and on
    the finer one of the error that it states."""
    (scene.parent / "rig.csv").write_text("x,f\n0,0\n-1,1\n-9,2\n")
    text = BEAM.partition("model     rod")[0].replace(", direction = -z)", ", amplitude = per_state)")
    scene.write_text(
        text.replace(
            "load     weight   = gravity(9.81 m/s^2",
            "load weight = traction(beam, where = x >= 80 mm and y <= 13 mm, vector = (0, 0, -5) Pa",
        )
        + """
analysis  test  = static(states = [20, 60, 100] %)
reference rig   = curve("rig.csv", x = "x", y = "f", x_unit = 1 mm, y_unit = 1 mN, uncertainty = 1 %)
probe     tip   = point(beam, at = (80, 0, 0) mm)
metric    sag   = displacement(tip, along = +z)
metric    hold  = force(wall, along = +z)
metric    miss  = curve_error(hold, over = sag, against = rig)
""",
        encoding="utf-8",
    )
    found = counted("run", str(scene))
    assert (found["curves"], found["swept"]) == (1, 2)


def test_the_forces_and_the_strains_of_a_beam_are_those_of_one_rod(scene: Path) -> None:
    assert counted("run", str(scene), "--model", "rod")["rods"] == 1


@pytest.mark.slow
def test_a_comparison_compiles_each_variation_once(scene: Path) -> None:
    """Of two sweeps of two values, once more for the scene itself; workers compile in processes of their own."""
    scene.write_text(BEAM + STUDIES, encoding="utf-8")
    expected = {"parsed": 1, "compiled": 5, "cases": 5}
    found = counted("compare", str(scene), "--repeats", "0", "--out", str(scene.parent / "out"))
    assert {n: found[n] for n in expected} == expected


def test_a_task_of_a_comparison_compiles_its_scene_once(scene: Path) -> None:
    subject = subject_of(softmark.load(scene).scene)
    task = task_of(subject, subject.scene, "solid")
    with counting() as found:
        perform(task)
    assert found == {"parsed": 1, "compiled": 1, "cases": 1, "planned": 1, "meshes": 1, "grips": 1}


def test_a_sweep_that_a_model_is_trained_over_is_compiled_once(scene: Path) -> None:
    """Its values are tried, and the meshes there compared: of three values that was 16 times."""
    scene.write_text(BEAM.replace("poisson = 0.4", "poisson = nu") + TRAINED, encoding="utf-8")
    assert counted("check", str(scene)) == {"parsed": 1, "compiled": 4, "cases": 4}


def test_what_is_kept_of_a_scene_is_its_own(scene: Path) -> None:
    """Of other values a scene has cases of their own, and its own stay as they were."""
    loaded = softmark.load(scene).scene
    softer, again, thicker = (
        apply_overrides(loaded, read_overrides([text], []))[0]
        for text in ("silicone.young=2 kPa", "silicone.young=2 kPa", "rod.segments=9")
    )
    assert again is softer
    assert case_of(softer, "beam") is case_of(softer, "beam")
    assert case_of(softer, "beam").material.young == 2e3
    assert case_of(loaded, "beam").material.young == case_of(thicker, "beam").material.young == 6e4
    assert case_of(replace(loaded, declared=softer.declared), "beam").material.young == 2e3
