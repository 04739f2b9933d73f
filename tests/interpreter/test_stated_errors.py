"""The error that models state themselves: it holds, it says where it cannot, and it costs nothing unasked.

tests/benchmarks/stated.py tries hundreds of cases; here are few of each kind.
"""

from __future__ import annotations

import importlib.util
import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import softmark
from softmark.interpreter.cli.main import main
from softmark.interpreter.pipeline.run_pipeline import RunOptions, run_scene
from softmark.interpreter.study.configurations.configuration_task import perform
from softmark.interpreter.study.configurations.task_outcome import PointTask
from softmark.interpreter.verification.error_estimate import DOUBTS, is_doubt

BENCHMARK = Path(__file__).parents[1] / "benchmarks" / "stated.py"
BEAM = """softmark 1
scene "stated"
material gel = neo_hookean(young = 60 kPa, poisson = {poisson}, density = 1070 kg/m^3)
body beam = solid(cylinder(length = 100 mm, radius = 5 mm, axis = +x), gel)
support wall = fixed(beam, where = x <= 0 mm)
load weight = gravity({g} m/s^2, direction = -z)
reference theory = simo_reissner(beam)
probe axis = line(beam, from = (0, 0, 0) mm, to = (100, 0, 0) mm, points = 5)
metric eta = relative_l2_error(axis, against = theory)
{models}
"""


def asked(models: str, poisson: float = 0.3, g: float = 1.0) -> Any:
    """The report of a beam whose models are all asked."""
    scene = softmark.loads(BEAM.format(models=models, poisson=poisson, g=g))
    return run_scene(scene.scene, list(scene.warnings), RunOptions(draw=False, stated=()))


@pytest.fixture(scope="module")
def benchmark() -> Any:
    """The command of tests/benchmarks, as a module."""
    spec = importlib.util.spec_from_file_location("stated_benchmark", BENCHMARK)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


@pytest.mark.slow
def test_no_model_is_silent_about_an_error(benchmark: Any) -> None:
    """A case of the benchmark with all its models: a stated error is at least the true one, or there is a doubt."""
    rows = list(benchmark.outcomes(benchmark.Case("block", 0.3, 1.0), small=True))
    assert len(rows) > 10
    words = [benchmark.word(row) for row in rows]
    assert "silent" not in words
    assert words.count("stated") > len(words) / 4  # it is no way out to say nothing
    assert benchmark.table(rows).splitlines()[-1].startswith("all")


@pytest.mark.slow
def test_errors_against_theory_are_below_what_is_stated() -> None:
    models = """model rod = beam6dof(segments = 12)
model hex = fem(hex8, strain = finite, integration = selective, size = 4 mm)
model turn = fem(hex8, strain = small, integration = selective, size = 4 mm)"""
    report = asked(models)
    for name in ("rod", "hex"):
        said = report.models[name].stated["eta"]
        # the theory and solids differ by (d/L)^2 = 1 % at most
        assert report.models[name].metrics["eta"].value <= said.value + 0.01
        assert said.value < 0.5
        assert set(said.parts) == {"discretisation", "model", "rounding", "solver"}
    # under such a load the tip turns by 0.2 rad, which small strain does not follow
    assert report.models["turn"].stated["eta"].parts["model"] > 0.05


@pytest.mark.slow
def test_what_cannot_be_told_is_not_stated() -> None:
    models = """model springs = mass_spring(size = 5 mm, stiffness = from_material(), network = hex8)
model locked = fem(hex8, strain = finite, size = 5 mm)"""
    report = asked(models, poisson=0.499)
    springs, locked = report.models["springs"].stated["eta"], report.models["locked"].stated["eta"]
    assert springs.value is None
    assert "modelling error of a spring network" in springs.reason
    assert "W321" in springs.doubts
    assert locked.value is None
    assert "locks" in locked.reason
    assert "W301" in locked.doubts


@pytest.mark.slow
def test_a_capped_state_states_what_its_cap_left() -> None:
    report = asked("model fast = fem(hex8, strain = corotational, size = 5 mm, max_iterations = 1)", g=3.0)
    said = report.models["fast"].stated["eta"]
    assert said.value is None or said.parts["solver"] > 1e-3


@pytest.mark.slow
@pytest.mark.long
def test_motion_states_the_error_of_its_step() -> None:
    scene = softmark.loads("""
material gel = neo_hookean(young = 60 kPa, poisson = 0.3, density = 1070 kg/m^3)
body b = solid(box(size = (40, 10, 10) mm), gel)
support wall = fixed(b, where = x <= 0 mm)
load weight = gravity(2 m/s^2, direction = -z)
analysis fall = dynamic(duration = 20 ms, step = 1 ms, integrator = trapezoidal)
model hex = fem(hex8, strain = corotational, size = 5 mm)
probe tip = point(b, at = (40, 5, 5) mm)
""")
    report = run_scene(scene.scene, list(scene.warnings), RunOptions(draw=False, stated=()))
    parts = report.models["hex"].stated["tip"].parts
    assert 0.0 < parts["time"] < 0.1


BLOCK = """
param    x0   = 0 m
material gel  = neo_hookean(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     b    = solid(box(size = (20, 10, 10) mm, origin = (x0, 0 m, 0 m)), gel)
support  wall = fixed(b, where = x <= x0)
"""


def block(more: str, **values: str) -> Any:
    """The report of a short block whose models are all asked."""
    scene = softmark.loads(BLOCK + more, **values)
    return run_scene(scene.scene, list(scene.warnings), RunOptions(draw=False, stated=()))


@pytest.mark.slow
def test_the_error_in_a_norm_of_strains_is_stated_in_it() -> None:
    """Strains of linear cells are of first order, displacements of second: an l2 norm is no bound of theirs."""
    report = block("""
load   weight = gravity(2 m/s^2, direction = -z)
model  fine   = fem(hex8, strain = finite, integration = selective, size = 2 mm)
model  coarse = fem(hex8, strain = finite, integration = selective, size = 4 mm)
model  rod    = beam6dof(segments = 8)
probe  all    = volume(b, size = 2 mm)
metric energy = energy_norm_error(all, against = fine)
metric points = mean_error(all, against = fine, statistic = relative_mean)
metric spread = mean_error(all, against = fine, statistic = relative_sd)
metric eta    = relative_l2_error(all, against = fine)
""")
    coarse, fine, rod = (report.models[n] for n in ("coarse", "fine", "rod"))
    # that of the model taken as right is stated as well, in the terms of the metric that does so
    assert fine.stated["energy"].value > 5 * fine.stated["eta"].value
    assert coarse.metrics["energy"].value > coarse.stated["eta"].value
    for name in ("energy", "points", "eta"):
        stated = coarse.stated[name].value
        assert stated is None or stated >= coarse.metrics[name].value
    assert coarse.stated["spread"].value is None
    assert "no error estimate is available for this metric" in coarse.stated["spread"].reason
    assert rod.stated["energy"].value is None
    assert "model error: no error estimate is available for this metric" in rod.stated["energy"].reason


def test_cells_inside_out_vouch_for_nothing() -> None:
    report = block("""
load   press = traction(b, where = x >= 20 mm, vector = (-90000, 0, 0) Pa)
model  tet   = fem(tet4, strain = small, size = 5 mm)
probe  tip   = point(b, at = (20, 5, 5) mm)
""")
    said = report.models["tet"].stated["tip"]
    assert "W351" in said.doubts
    assert said.value is None
    assert "inverted" in said.reason


@pytest.mark.slow
@pytest.mark.long
def test_digits_that_coordinates_lose_are_stated() -> None:
    """Without a factor of the stiffness: a cell of 5 mm, 1 m and 1000 km away, by eps * distance / (cell * strain)."""
    more = """
load     pull = gravity(2 m/s^2, direction = +x)
analysis rest = dynamic(duration = 2 ms, step = 1 ms)
model    hex  = fem(hex8, strain = corotational, size = 5 mm)
probe    tip  = point(b, at = (x0 + 20 mm, 5 mm, 5 mm))
"""
    parts = {x0: block(more, x0=x0).models["hex"].stated["tip"] for x0 in ("0 m", "10 km", "100000 km")}
    near, far, lost = (said.parts["rounding"] for said in parts.values())
    assert 2e-9 < near < 1e-6
    assert far > 100 * near
    assert lost is None
    assert "rounding errors reach" in parts["100000 km"].reason


def test_it_is_in_every_report(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "a.scene"
    file.write_text(BEAM.format(models="model rod = beam6dof(segments = 8)", poisson=0.3, g=1.0), encoding="utf-8")
    assert main(["run", str(file), "--out", str(tmp_path / "plain")]) == 0
    assert "rod estimates an error of at most" in capsys.readouterr().out  # a beam's costs next to nothing
    assert main(["run", str(file), "--stated", "--out", str(tmp_path / "asked")]) == 0
    assert "rod estimates an error of at most" in capsys.readouterr().out
    plain, said = (json.loads((tmp_path / n / "report.json").read_text("utf-8")) for n in ("plain", "asked"))
    assert plain["models"]["rod"]["stated"] == said["models"]["rod"]["stated"]
    assert set(said["models"]["rod"]["stated"]) == {"eta", "axis"}
    assert "estimates an error of at most" in (tmp_path / "asked" / "report.html").read_text("utf-8")


def test_a_task_asks_for_one_model() -> None:
    text = BEAM.format(models="model rod = beam6dof(segments = 8)", poisson=0.3, g=1.0)
    task = PointTask("k", model="rod", models=("rod",), text=text, shown="a", stated=True)
    point = perform(task).point
    assert point["stated"]["metric"] == "eta"
    assert point["stated"]["value"] > 0.0
    assert "stated" not in perform(replace(task, stated=False)).point


def test_every_doubt_has_a_page() -> None:
    from softmark.interpreter.help.codes import pages

    assert {code for code in DOUBTS if code < "W5"} <= set(pages())
    assert is_doubt("W352")
    assert not is_doubt("W303")


NOTHING = """
material gel  = neo_hookean(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     b    = solid(box(size = (20, 10, 10) mm), gel)
support  wall = fixed(b, where = x <= 0 mm)
support  top  = fixed(b, where = x >= 20 mm, components = y)
load     pull = traction(b, where = x >= 20 mm, vector = (1000, 0, 0) Pa)
metric   side = force(top, along = +y)
metric   turn = moment(wall, along = +z)
probe    held = point(b, at = (0, 5, 5) mm)
metric   none = displacement(held, along = +x)
model    m    = {model}
"""


@pytest.mark.parametrize("model", ["fem(hex8, strain = corotational, size = 5 mm)", "beam6dof(segments = 4)"])
def test_what_is_nothing_states_what_rounding_and_the_solver_leave(model: str) -> None:
    """By symmetry, or held: a force of 1e-17 N stated 1e-28 N beside 0.1 N that pull, or 57 % between meshes, and what
    does not move stated that it has no error."""
    scene = softmark.loads(NOTHING.format(model=model))
    report = run_scene(scene.scene, list(scene.warnings), RunOptions(draw=False, stated=()))
    found = report.models["m"]
    for name, least, most in (("side", 1e-17, 1e-9), ("turn", 1e-19, 1e-11), ("none", 1e-19, 1e-11)):
        value, said = found.metrics[name].value, found.stated[name]
        assert value is not None
        assert said.value is not None, said.reason
        assert max(abs(value), least) < said.value < most


RUBBED = """
material gel   = neo_hookean(young = 100 kPa, poisson = 0.3, density = 1000 kg/m^3)
shape    pad   = quadrilateral((0, 0, 0) mm, (10, 0, 0) mm, (10, 5, 0) mm, (0, 5, 0) mm)
body     b     = plane_strain(pad, gel, thickness = 1 mm)
body     floor = rigid(half_space(normal = (0, 1, 0)))
contact  rub   = rigid_contact(floor, b, where = y <= 0 mm, friction = 0.4)
support  top   = displaced(b, where = y >= 5 mm, by = (0.05, -0.3, 0) mm, amplitude = per_state)
analysis s     = static(states = [50, 100] %)
model    m     = fem(quad4, strain = finite, size = 2.5 mm)
probe    side  = point(b, at = (10, 2.5, 0) mm)
metric   bulge = displacement(side, along = +x)
metric   push  = force(rub, along = +y)
metric   heat  = dissipation(b)
"""


@pytest.mark.slow
def test_states_with_friction_are_solved_again_on_finer_cells() -> None:
    """No error was stated of what friction's past decides: finer cells go through all states as well.

    Truth: cells of a fourth of the size, of which a twentieth of the error is left.
    """
    scene = softmark.loads(RUBBED)
    report = run_scene(scene.scene, list(scene.warnings), RunOptions(draw=False, stated=()))
    finer = softmark.loads(RUBBED.replace("2.5 mm)\nprobe", "0.625 mm)\nprobe"))
    truth = run_scene(finer.scene, list(finer.warnings), RunOptions(draw=False)).models["m"].metrics
    for name in ("bulge", "push"):
        off, said = abs(report.models["m"].metrics[name].value - truth[name].value), report.models["m"].stated[name]
        assert said.value is not None, said.reason
        assert 0.95 * off < said.value < 5.0 * off


RELAXING = """
material foam = viscoelastic(
    linear_elastic(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3), g = [0.5], tau = [1] s, of = whole
)
shape    bar  = quadrilateral((0, 0, 0) mm, (30, 0, 0) mm, (30, 10, 0) mm, (0, 10, 0) mm)
body     b    = plane_strain(bar, foam, thickness = 1 mm)
support  wall = fixed(b, where = x <= 0 mm)
load     down = traction(b, where = x >= 30 mm, vector = (0 Pa, -1 Pa, 0 Pa))
analysis t    = quasistatic(duration = 2 s, step = 1 s, times = [1, 2] s)
model    m    = fem(quad4, strain = small, size = 10 mm)
probe    tip  = point(b, at = (30, 5, 0) mm)
metric   sag  = displacement(tip, along = -y)
metric   heat = dissipation(b)
"""


@pytest.mark.slow
def test_a_body_that_relaxes_states_errors_of_cells_and_steps() -> None:
    """Small strain had no stated error before. Truth: an eighth of cell and step, with a sixtieth of the error left."""
    scene = softmark.loads(RELAXING)
    report = run_scene(scene.scene, list(scene.warnings), RunOptions(draw=False, stated=()))
    finer = softmark.loads(RELAXING.replace("10 mm)\nprobe", "1.25 mm)\nprobe").replace("step = 1 s", "step = 0.125 s"))
    truth = run_scene(finer.scene, list(finer.warnings), RunOptions(draw=False)).models["m"].metrics
    for name in ("sag", "heat"):
        off, said = abs(report.models["m"].metrics[name].value - truth[name].value), report.models["m"].stated[name]
        assert said.value is not None, said.reason
        assert set(said.parts) >= {"discretisation", "model", "time"}
        assert 0.98 * off < said.value < 5.0 * off
