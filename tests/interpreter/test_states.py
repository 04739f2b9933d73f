"""States of one body: each is the scene with that situation alone, known in all that a report has, and judged.

Truth is the same scene without states, its loads and supports at the part of their size that the state is: it goes
through none of what makes states, and starts from rest.
"""

from __future__ import annotations

import json
import pickle
import re
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import meshio
import numpy as np
import pytest

import softmark
from softmark.interpreter.language.compiler import recompile
from softmark.interpreter.language.parameter_overrides import read_override
from softmark.interpreter.language.scene_states import in_state, states_of
from softmark.interpreter.pipeline.run_options import CheckedScene, RunOptions
from softmark.interpreter.pipeline.run_pipeline import run_to_report
from softmark.interpreter.report.run import report_page, report_terminal
from softmark.interpreter.results.vtk_writer import write_vtu
from softmark.interpreter.validation.constructor_registry import CATALOGUE

STATES = (0.1, 0.4, 1.0)
BAR = """
material gel = neo_hookean(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
body bar = solid(box(size = (40, 20, 20) mm), gel)
support wall = fixed(bar, where = x <= 0 mm)
support grip = displaced(bar, where = x >= 40 mm, by = ({by} mm, 0 mm, 0 mm){course})
load weight = gravity(9.81 m/s^2)
load side = traction(bar, where = x >= 40 mm, vector = (0, {side}, 0) Pa{course})
probe axis = line(bar, from = (0, 10, 10) mm, to = (40, 10, 10) mm)
metric pull = force(grip, along = +x)
metric root = moment(wall, along = -y)
metric stored = strain_energy(bar)
metric sag = displacement(middle, along = -z)
probe middle = point(bar, at = (20, 10, 10) mm)
"""
MODELS = """
model finite = fem(hex8, strain = finite, integration = selective, size = 10 mm)
model springs = mass_spring(size = 10 mm, stiffness = from_material())
"""
OTHERS = """
model small = fem(tet4, strain = small, size = 10 mm)
model mixed = fem(tet10, strain = finite, formulation = mixed, size = 20 mm)
model single = fem(hex8, strain = corotational, size = 10 mm, precision = single)
model few = modal(of = small, modes = 6)
"""
ROD = """
material gel = neo_hookean(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
body bar = solid(box(size = (40, 20, 20) mm), gel)
support wall = fixed(bar, where = x <= 0 mm)
load weight = gravity({g} m/s^2{course})
probe axis = line(bar, from = (0, 10, 10) mm, to = (40, 10, 10) mm)
metric root = moment(wall, along = -y)
model rod = beam6dof(segments = 8)
reference theory = simo_reissner(bar)
metric eta = relative_l2_error(axis, against = theory)
"""
ANALYSIS = "analysis rest = static(states = [10, 40, 100] %)\n"


def several(expect: str = "", models: str = MODELS) -> softmark.Report:
    return softmark.loads(
        BAR.format(by=10, side=300, course=", amplitude = per_state") + ANALYSIS + models + expect
    ).run()


def alone(share: float, models: str = MODELS) -> softmark.Report:
    return softmark.loads(BAR.format(by=10 * share, side=300 * share, course="") + models).run()


@pytest.fixture(scope="module")
def report() -> softmark.Report:
    return several("expect finite.pull > 0.1 N\nexpect finite.pull.at(40 %) < 5 N\nexpect finite.pull < 5 N\n")


@pytest.mark.slow
@pytest.mark.long
def test_each_state_is_the_scene_with_that_situation_alone(report: softmark.Report) -> None:
    same(report, 2, MODELS)


@pytest.mark.slow
@pytest.mark.parametrize("models", [MODELS, OTHERS], ids=["models", "others"])
def test_each_state_of_every_model_is_the_scene_with_that_situation_alone(models: str) -> None:
    report = several(models=models)
    for number in range(3):
        same(report, number, models)
    assert all(own.solve["started"] for n, model in report.models.items() if n != "few" for own in model.each[1:])


def same(report: softmark.Report, number: int, models: str) -> None:
    """To what the tolerance of 1e-8 of the forces leaves; single precision to its own 1e-4 (`rounded` is 1e-3)."""
    truth = alone(STATES[number], models)
    for name, model in report.models.items():
        own, right = model.each[number], truth.models[name]
        assert own.status == right.status == "converged", name
        close = 1e-4 if name == "single" else 1e-6
        for metric, due in right.metrics.items():
            found = own.metrics[metric]
            assert found.reason == due.reason
            assert found.value == (due.value and pytest.approx(due.value, rel=close)), (name, metric)
        u, v = own.probes["axis"].displacement, right.probes["axis"].displacement
        assert np.linalg.norm(u - v) <= close * np.linalg.norm(v)
        for support, held in right.reactions.items():
            mine = own.reactions[support].reaction
            assert (mine is None) == (held.reaction is None)
            if mine is not None and held.reaction is not None:
                force, moment = np.array(held.reaction.force), np.array(held.reaction.moment)
                assert np.linalg.norm(mine.force - force) <= close * np.linalg.norm(force), (name, support)
                assert np.linalg.norm(mine.moment - moment) <= close * np.linalg.norm(moment), (name, support)


def test_every_state_is_checked_by_other_formulas(report: softmark.Report) -> None:
    """Forces found again, and balanced with what supports carry to 1e-8 of the loads, in each."""
    for model in report.models.values():
        for own in model.each:
            checks = own.solve["checks"]
            assert checks["residual"] <= (1e-3 if model.name == "single" else 1e-6), (model.name, checks)


def test_a_state_starts_from_the_one_before(report: softmark.Report) -> None:
    """And takes no more steps for it than from rest: of finite strain about half as many at the last."""
    rest = alone(1.0, "model finite = fem(hex8, strain = finite, integration = selective, size = 10 mm)\n")
    finite = report.models["finite"]
    assert [own.solve["started"] for own in finite.each] == [False, True, True]
    assert finite.each[2].solve["iterations"] <= rest.models["finite"].solve["iterations"]
    assert finite.solve["iterations"] == sum(own.solve["iterations"] for own in finite.each)


def test_the_whole_is_the_last_state_with_the_time_of_all(report: softmark.Report) -> None:
    for model in report.models.values():
        last, solve = model.each[-1], model.time["solve_s"]
        assert model.states == STATES
        assert model.probes == last.probes
        assert {n: m.value for n, m in model.metrics.items()} == {n: m.value for n, m in last.metrics.items()}
        assert solve is not None
        assert solve.median == pytest.approx(sum(own.time["solve_s"].median for own in model.each))  # type: ignore[union-attr]
        curve = model.curve("pull")
        assert curve.states == STATES
        assert curve.values == tuple(own.metrics["pull"].value for own in model.each)
        assert curve.unit == "N"
        assert curve.values == model.metrics["pull"].states
    with pytest.raises(KeyError):
        report.models["finite"].curve("nothing")


def test_theories_and_beams_are_solved_in_each_state() -> None:
    """The moment of a straight rod's weight is rho g A L^2 / 2 at its root to its own small bend."""
    text = ROD.format(g=9.81, course=", amplitude = per_state")
    model = softmark.loads(text + ANALYSIS).run().models["rod"]
    for share, own in zip(STATES, model.each, strict=True):
        right = softmark.loads(ROD.format(g=9.81 * share, course="")).run().models["rod"]
        for metric in ("root", "eta"):
            assert own.metrics[metric].value == pytest.approx(right.metrics[metric].value, rel=1e-6)


# ------------------------------------------------------------------ expectations


def test_an_expectation_is_asked_of_each_state_or_of_one(report: softmark.Report) -> None:
    every, one, broken = report.expectations
    assert (every.passed, every.states) == (True, (True, True, True))
    assert (one.passed, one.states) == (True, ())
    assert one.value == report.models["finite"].each[1].metrics["pull"].value
    assert (every.about, one.about, one.metric) == ((("finite", "pull"),), (("finite", "pull"),), "finite.pull")
    assert (broken.passed, broken.states) == (False, (True, True, False))
    assert broken.reason == "not met in the state 100 %"
    assert broken.value == report.models["finite"].metrics["pull"].value
    assert report.exit_status == 1


SQUEEZE = """
material gel = neo_hookean(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
body bar = solid(box(size = (20, 20, 20) mm), gel)
support wall = fixed(bar, where = x <= 0 mm)
support press = displaced(bar, where = x >= 20 mm, by = (-20, 0, 0) mm, amplitude = per_state)
analysis squeeze = static(states = [10, 20, 105, 30] %)
model hexes = fem(hex8, strain = finite, size = 10 mm)
metric resist = force(press, along = -x)
expect hexes.resist.at(20 %) > 1 N
expect hexes.resist > 1 N
expect hexes.resist > 4 N
"""


def test_what_comes_before_a_state_without_an_answer_stays(tmp_path: Path) -> None:
    """A cube cannot be squeezed through its wall: what was known before is told, and what was not tried is said."""
    report = softmark.loads(SQUEEZE).run()
    model = report.models["hexes"]
    assert [own.status for own in model.each] == ["converged", "converged", "not_converged", "skipped"]
    assert model.status == "not_converged"
    assert model.message is not None
    assert model.message.startswith("in the state 105 %: ")
    assert model.message.endswith("the 2 states before it have solutions; one state after it was not tried")
    assert model.each[3].message == "the previous state, 105 %, has no solution"
    values = model.curve("resist").values
    assert None not in values[:2]
    assert values[2:] == (None, None)
    one, every, broken = report.expectations
    assert one.passed is True
    assert (every.passed, every.states) == (None, (True, True, None, None))
    assert (broken.passed, broken.states) == (False, (False, True, None, None))
    assert report.exit_status == 3
    assert json.loads(report.dumps())["models"]["hexes"]["states"][1]["metrics"]["resist"]["value"] == values[1]
    assert "2.969" in report_terminal.table(report, False)
    assert "states-0" in report_page.render(report)
    assert [f.name for f in write_vtu(report, tmp_path)][:3] == ["hexes.pvd", "hexes-0000.vtu", "hexes-0001.vtu"]


def test_curves_of_a_scene_without_probes_are_drawn_at_first() -> None:
    """Forces need no probe: a figure opens with models that it has, not with those that probes saw."""
    report = softmark.loads(
        "material gel = linear_elastic(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)\n"
        "body bar = solid(box(size = (20, 10, 10) mm), gel)\nsupport wall = fixed(bar, where = x <= 0 mm)\n"
        "support grip = displaced(bar, where = x >= 20 mm, by = (1, 0, 0) mm, amplitude = per_state)\n"
        "analysis pull = static(states = [50, 100] %)\nmodel cubes = fem(hex8, strain = small, size = 10 mm)\n"
        "metric resist = force(grip, along = +x)\n"
    ).run()
    boxes = re.findall(r'<input[^>]*value="k0"[^>]*>', report_page.render(report))
    assert boxes
    assert all(" checked" in box for box in boxes)


def test_a_warning_says_in_which_states_it_holds() -> None:
    """Small strain turns too far under the whole load alone; that the mesh is coarse is said of all states once."""
    shown: list[Any] = []
    text = ROD.format(g=30, course=", amplitude = per_state").partition("model rod")[0]
    model = "model linear = fem(tet4, strain = small, size = 10 mm)\n"
    own = softmark.loads(
        text + ANALYSIS.replace("10, 40", "1, 2") + "probe tip = point(bar, at = (40, 0, 0) mm)\n" + model
    )
    report = run_to_report(CheckedScene(own.scene, own.warnings), RunOptions(warn=shown.extend))
    (turned,) = (w for w in report.warnings if w.code == "W306")
    assert turned.message.endswith(" (in the state 100 %)")
    assert [d.notes for d in shown if d.code == "W306"] == [("in the state 100 %",)]


# ------------------------------------------------------------------ measurements


def test_a_measurement_of_several_states_is_compared_one_by_one(tmp_path: Path) -> None:
    """Beads that move with a bar that is pulled evenly: state 2 of the table is off by 0.1 mm, and only it."""
    header = "x0,y0,z0,x1,y1,z1,x2,y2,z2\n"
    rows = (f"{x},10,10,{1.05 * x},10,10,{1.1 * x + 0.1},10,10\n" for x in (5, 10, 15))
    (tmp_path / "beads.csv").write_text(header + "".join(rows))
    text = """
material gel = linear_elastic(young = 60 kPa, poisson = 0, density = 1000 kg/m^3)
body bar = solid(box(size = (20, 20, 20) mm), gel)
support wall = fixed(bar, where = x <= 0 mm)
support pull = displaced(bar, where = x >= 20 mm, by = (2, 0, 0) mm, amplitude = per_state)
analysis rest = static(states = [100, 50, 100] %)
reference beads = markers("beads.csv", unit = 1 mm, uncertainty = 0.01 mm, states = [2, 1, 2])
model cubes = fem(hex8, strain = small, size = 10 mm)
probe seen = markers(bar, of = beads)
metric error = max_error(seen, against = beads)
expect cubes.error < 0.05 mm
expect cubes.error.at(50 %) < 1e-9 mm
"""
    (tmp_path / "my.scene").write_text(text)
    report = softmark.load(tmp_path / "my.scene").run()
    assert report.models["cubes"].curve("error").values == pytest.approx((1e-4, 0.0, 1e-4), abs=1e-12)
    assert [e.verdict for e in report.expectations] == ["not_met", "met"]
    assert report.references["beads"].states == (1.0, 0.5, 1.0)
    displaced = [own.probes["seen"].displacement[0, 0] for own in report.references["beads"].each]
    assert displaced == pytest.approx([0.6e-3, 0.25e-3, 0.6e-3])


# ------------------------------------------------------------------ reports


def test_the_report_has_every_state(report: softmark.Report) -> None:
    data = json.loads(report.dumps())["models"]["finite"]
    assert [own["state"] for own in data["states"]] == list(STATES)
    pulls = [{"state": own["state"], "value": own["metrics"]["pull"]["value"]} for own in data["states"]]
    assert data["metrics"]["pull"]["states"] == pulls  # the contract's pairs
    page, lines = report_page.render(report), report_terminal.table(report, False)
    assert 'id="states"' in page
    assert page.count('id="states-') >= len(report.models["finite"].metrics)
    assert '"labels": ["10 %", "40 %", "100 %"]' in page
    assert "Values are those in the last state, 100 %" in page
    assert "2 models in 3 states" in page
    assert "all other results belong to the last state, 100 %" in lines
    shape = report.models["finite"].shape
    assert shape is not None
    assert shape.frames is not None
    for frame, own in zip(shape.frames, report.models["finite"].each, strict=True):
        assert own.shape is not None
        np.testing.assert_array_equal(frame, own.shape.position)


def test_files_for_paraview_have_every_state(report: softmark.Report, tmp_path: Path) -> None:
    write_vtu(report, tmp_path)
    sets = ElementTree.parse(tmp_path / "vtu" / "finite.pvd").getroot().iter("DataSet")
    files = {float(s.attrib["timestep"]): s.attrib["file"] for s in sets}
    assert tuple(files) == STATES
    for state, own in zip(STATES, report.models["finite"].each, strict=True):
        found = meshio.read(tmp_path / "vtu" / files[state])
        np.testing.assert_allclose(found.point_data["displacement"], own.mesh.displacement)


# ------------------------------------------------------------------ scenes


def test_a_scene_in_a_state_stays_in_it() -> None:
    """In another process, and with other values: what trains and refines models compiles its scene again."""
    scene = softmark.loads(BAR.format(by=10, side=300, course=", amplitude = per_state") + ANALYSIS + MODELS).scene
    now = in_state(scene, 1)
    assert states_of(now) == ()
    copy, (other, _) = pickle.loads(pickle.dumps(now)), recompile(now, [_override("gel.young=30kPa")])
    for own in (now, copy, other):
        assert own.declared["grip"].thing.by == pytest.approx((4e-3, 0.0, 0.0))
        assert own.declared["grip"].thing.amplitude is None
        assert own.state == 1
    assert other.declared["gel"].thing.young == pytest.approx(30e3)


def _override(text: str) -> Any:
    return read_override(text, [])


def test_a_scene_without_states_pays_nothing() -> None:
    """One run of the scene itself, and no word of states in its report."""
    from softmark.interpreter.pipeline.run_state import make_state_runs
    from softmark.interpreter.planning.run_plan import plan_of

    own = softmark.loads(ROD.format(g=9.81, course=""))
    (work,) = make_state_runs(own.scene, plan_of(own.scene), RunOptions(), [])
    assert work.scene is own.scene
    assert "states" not in own.run().models["rod"].to_json()


@pytest.mark.parametrize("kind", ["load", "support"])
def test_whatever_has_a_course_says_that_it_may_be_that_of_states(kind: str) -> None:
    """The page of each load and support that takes `amplitude = per_state` says so at the field."""
    known = (CATALOGUE.constructor(kind, name) for name in CATALOGUE[kind])
    amplitudes = {c.name: field for c in known if c is not None and (field := c.field("amplitude")) is not None}
    assert len(amplitudes) >= 2
    amplitudes.pop("pore_pressure", None)  # fluid flows in time: no state comes at once after another
    assert [name for name, field in amplitudes.items() if "from state to state" not in field.meaning] == []


def test_more_states_than_a_run_can_hold_are_refused() -> None:
    many = ", ".join(["50"] * 1001)
    text = SQUEEZE.replace("10, 20, 105, 30", many).partition("expect")[0]
    with pytest.raises(softmark.SceneError, match="has 1001 states"):
        softmark.loads(text)


def test_a_verdict_of_states_reads_as_one(report: softmark.Report) -> None:
    """It said `found 3 N not in the state 100 %`, as if the number had been looked for there."""
    assert "; not met in the state 100 %)" in report_terminal.table(report, False)


def test_a_scene_without_states_says_that_it_has_no_curves() -> None:
    found = softmark.loads(ROD.format(g=9.81, course="")).run().models["rod"]
    with pytest.raises(KeyError, match="no curve of `root`: the analysis has no states"):
        found.curve("root")


def test_a_file_that_cannot_be_read_is_wrong_in_all_states_alike(tmp_path: Path) -> None:
    """It said "in the state 10 %: ...; 2 states after it were not tried", as if it had to do with states."""
    (tmp_path / "rig.csv").write_text("x,f\n0,0\n1,1\n")
    (tmp_path / "a.scene").write_text(
        ROD.format(g=9.81, course=", amplitude = per_state")
        + ANALYSIS
        + """
reference rig  = curve("rig.csv", x = "x", y = "f", x_unit = 1 mm, y_unit = 1 N, uncertainty = 1 %)
metric    hold = force(wall, along = +z)
metric    gone = displacement(axis, along = -z)
metric    miss = curve_error(hold, over = gone, against = rig)
"""
    )
    scene = softmark.load(str(tmp_path / "a.scene"))
    (tmp_path / "rig.csv").unlink()
    failed = scene.run().references["rig"]
    assert failed.status == "failed"
    assert f"{tmp_path}/rig.csv: there is no file" in str(failed.message)
    assert "in the state" not in str(failed.message)


def test_states_hold_their_pattern_and_their_cells_once() -> None:
    """Of 9 states of 1 500 nodes each held 6 MB more, of which 5 are the same in all: memory grew by them."""
    from softmark.interpreter.pipeline import model_runs, probe_sampling, run_state
    from softmark.interpreter.pipeline.run_options import RunOptions
    from softmark.interpreter.planning.run_plan import plan_of

    bar = BAR.format(by=20, side=100, course=", amplitude = per_state")
    scene = softmark.loads(bar + ANALYSIS + "model hexes = fem(hex8, strain = finite, size = 5 mm)\n").scene
    works = run_state.make_state_runs(scene, plan_of(scene, ("hexes",)), RunOptions(draw=False), [])
    for work in works:
        probe_sampling.place_probes(work)
        model_runs.prepare_models(work)
    assemblies = [work.prepared["hexes"][0].problem.assembly for work in works]  # type: ignore[attr-defined]
    assert len({id(a.pattern) for a in assemblies}) == 1
    assert len({id(a) for a in assemblies}) == len(works)
