"""A scene goes out as files for others with an exam sheet, and what went out is what the scene means."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest

import softmark
from softmark.interpreter.cli.main import main
from softmark.interpreter.language import units
from softmark.interpreter.models.external.exporters import FORMATS, OF_MM
from softmark.interpreter.report.exam_export import exam_readme
from softmark.solvers.mesh.files import mesh_reader

ELEMENTS = ("tet4", "tet10", "hex8", "hex27")
BAR = """softmark 1
scene "A bar of two materials"
material soft = neo_hookean(young = 10 kPa, poisson = 0.3, density = 1000 kg/m^3)
material hard = neo_hookean(young = 30 kPa, poisson = 0.2, density = 1200 kg/m^3)
body bar = solid(box(size = (30, 10, 10) mm), soft)
region half = part(bar, where = x >= 15 mm, material = hard)
support wall = fixed(bar, where = x <= 0 mm)
support edge = fixed(bar, where = x >= 30 mm and z <= 0 mm, components = y)
load push = traction(bar, where = x >= 30 mm, vector = (0, 20, 5) Pa)
load side = traction(bar, where = x >= 30 mm and z >= 5 mm, vector = (0, 0, 5) Pa)
load weight = gravity(9.81 m/s^2, direction = -z)
analysis rest = static()
model small = fem(ELEMENT, strain = small, size = 5 mm)
model turning = fem(ELEMENT, strain = corotational, size = 5 mm)
probe end = point(bar, at = (30, 5, 5) mm)
metric sink = displacement(end, along = -z)
expect small.sink > 0 mm
"""


def exported(text: str, to: str, folder: Path, *more: str) -> int:
    """The exit status of exporting a scene into FOLDER/out."""
    (folder / "my.scene").write_text(text)
    return main(["export", str(folder / "my.scene"), "--to", to, "--out", str(folder / "out"), *more])


def bar(element: str = "tet4") -> str:
    """The bar, of one element."""
    return BAR.replace("ELEMENT", element)


@pytest.mark.parametrize(
    "to",
    [
        pytest.param(f, marks=[pytest.mark.slow] * (f != "vtu"))
        for f in sorted(FORMATS.keys() - {"febio", "mujoco", "polyfem", "sofa"})
    ],
)  # which take less: test_decks.py
def test_the_exam_sheet_has_what_is_asked_and_known(
    to: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert exported(bar("hex8"), to, tmp_path) == 0
    said = capsys.readouterr()
    exam = json.loads((tmp_path / "out" / "exam.json").read_text())
    assert exam["schema"] == "softmark-exam/1"
    assert exam["probes"]["end"]["points"] == [[0.03, 0.005, 0.005]]
    assert exam["metrics"]["sink"] == {"text": "displacement(end, along = -z)", "unit": "m"}
    assert [own["text"] for own in exam["expectations"]] == ["small.sink > 0 mm"]
    model, *others = exam["models"].values()
    assert len(others) == (to != "calculix")  # a mesh goes out whatever its model solves
    assert model["materials"]["half"] == {"law": "linear_elastic", "young": 3e4, "poisson": 0.2, "density": 1200.0}
    written = {file.relative_to(tmp_path / "out").as_posix() for file in (tmp_path / "out").rglob("*.*")}
    assert written == {*(file for own in exam["models"].values() for file in own["files"]), "exam.json", "README.txt"}
    left = [] if others else ["model `turning`, strain = corotational"]
    assert [own["what"] for own in exam["left"]] == left
    assert said.err.count("not exported: model `turning`") == len(left)
    assert "dsl judge my.scene RESULT --as NAME --unit" in (tmp_path / "out" / "README.txt").read_text()


@pytest.mark.parametrize(
    ("to", "said"),
    [
        ("calculix", ["- sink: m (mm)", "- push, held: N (uN)", "- most: Pa", "- eta: a plain number", "- way: s"]),
        ("sofa", ["- sink: m", "- push, held: N", "- most: Pa", "- eta: a plain number", "- way: s"]),
    ],
)
def test_the_page_names_the_unit_of_everything_that_is_asked(to: str, said: list[str]) -> None:
    asked = {"sink": "m", "push": "N", "held": "N", "most": "Pa", "eta": "1", "way": "s"}
    scene = {"title": "A bar", "standard": None, "file": "my.scene"}
    metrics = {name: {"text": "", "unit": unit} for name, unit in asked.items()}
    shown = exam_readme.readme_text({"scene": scene, "softmark": "1", "models": {}, "metrics": metrics, "left": []}, to)
    first = "Requested values, in the unit of exam.json (and of the other files, if different):"
    assert "\n".join([first, *said, ""]) in shown


@pytest.mark.parametrize("si", OF_MM)
def test_units_of_decks_in_millimetres_are_what_grams_and_seconds_make_of_them(si: str) -> None:
    """A thousandth for every mm and every g in the dimension: a newton is 1e6 g mm/s^2."""
    there, here = units.parse_unit(OF_MM[si]), units.parse_unit(si)
    length, mass = (units.parse_unit(base).dimension for base in ("m", "kg"))
    powers = sum(p * (a + b) for p, a, b in zip(here.dimension, length, mass, strict=True))
    assert there.dimension == here.dimension
    assert there.factor == pytest.approx(1e-3**powers * here.factor, rel=1e-12)


def test_references_are_in_it_and_those_that_models_make_are_left_out(tmp_path: Path) -> None:
    """The tip of a cantilever under its weight w per length sinks by w L^4 / (8 E I) (Timoshenko): here 4.19 mm."""
    text = """softmark 1
scene "A cantilever"
material soft = linear_elastic(young = 1 MPa, poisson = 0.3, density = 1000 kg/m^3)
body bar = solid(box(size = (80, 12, 12) mm, origin = (0, -6, -6) mm), soft)
support wall = fixed(bar, where = x <= 0 mm)
load weight = gravity(9.81 m/s^2, direction = -z)
model small = fem(hex8, strain = small, size = 6 mm)
model other = fem(tet10, strain = small, size = 6 mm)
reference thin = small_deflection(bar)
reference last = self_converged(methods = [small, other], sizes = [12, 9, 6] mm)
probe end = point(bar, at = (80, 0, 0) mm)
metric sink = displacement(end, along = -z)
metric off = max_error(end, against = last)
"""
    assert exported(text, "vtu", tmp_path, "--model", "small") == 0
    exam = json.loads((tmp_path / "out" / "exam.json").read_text())
    (thin,) = exam["references"].values()
    sinks = 1000 * 9.81 * 0.012**2 * 0.08**4 / (8 * 1e6 * 0.012**4 / 12)
    assert thin["metrics"]["sink"]["value"] == pytest.approx(sinks, rel=1e-12)
    assert thin["probes"]["end"]["displacement"][0][2] == pytest.approx(-sinks, rel=1e-12)
    assert thin["estimated_error"] < 1e-12
    assert [own["what"] for own in exam["left"]] == ["reference `last`"]


@pytest.mark.slow
@pytest.mark.parametrize("element", ["hex20", *ELEMENTS])
def test_a_mesh_for_gmsh_is_read_again_with_its_groups(element: str, tmp_path: Path) -> None:
    """Facets that two loads share are in both groups; an edge is a group of points."""
    assert exported(bar(element), "gmsh", tmp_path, "--model", "small") == 0
    file = tmp_path / "out" / "small" / "mesh.msh"
    assert exported(bar(element), "vtu", tmp_path, "--model", "small") == 0
    ours = meshio.read(tmp_path / "out" / "small" / "problem.vtu")
    again = mesh_reader.read_cells(str(file), 1.0)
    assert np.array_equal(again.points, ours.points)
    assert np.array_equal(again.cells, ours.cells[0].data)
    data = meshio.read(file)
    sizes = {name: sum(map(len, each)) for name, each in data.cell_sets.items() if not name.startswith("gmsh")}
    assert sizes["bar"] == sizes["half"] == len(again.cells) // 2
    assert sizes["wall"] == sizes["push"] == 2 * sizes["side"] > 0
    assert sizes["edge"] in (3, 5)
    assert sizes.keys() == {"bar", "half", "wall", "push", "side", "edge"}


def test_fields_of_a_vtu_are_those_of_the_problem(tmp_path: Path) -> None:
    """The weight of 1.5 cm^3 of each of two materials, and tractions times the areas that they act on."""
    assert exported(bar(), "vtu", tmp_path, "--model", "small") == 0
    fields = meshio.read(tmp_path / "out" / "small" / "problem.vtu").point_data
    weight = 1.5e-6 * (1000.0 + 1200.0) * 9.81
    assert fields["force_weight"].sum(axis=0) == pytest.approx([0.0, 0.0, -weight], abs=1e-15)
    assert fields["force_side"].sum(axis=0) == pytest.approx([0.0, 0.0, 5.0 * 5e-5], abs=1e-15)
    whole = fields["force_weight"] + fields["force_side"] + fields["force_push"]
    assert fields["forces"] == pytest.approx(whole, abs=1e-18)
    assert (fields["held"].sum(axis=1) == 3).sum() == fields["support_wall"].sum()


STATES = """softmark 1
scene "A bar in states"
material soft = linear_elastic(young = 10 kPa, poisson = 0.3, density = 1000 kg/m^3)
body bar = solid(box(size = (30, 10, 10) mm), soft)
support wall = fixed(bar, where = x <= 0 mm)
load push = traction(bar, where = x >= 30 mm, vector = (0, 20, 5) Pa, amplitude = per_state)
analysis rest = static(states = [25, 50, 100] %)
model small = fem(hex8, strain = small, size = 5 mm)
"""


def test_states_are_steps_of_one_deck_where_they_are_parts_of_one_load(tmp_path: Path) -> None:
    assert exported(STATES, "calculix", tmp_path) == 0
    deck = (tmp_path / "out" / "small" / "job.inp").read_text()
    assert deck.count("*STEP\n") == 3
    assert [line for line in deck.splitlines() if line in ("0.25,0.25", "0.5,0.5")] == ["0.25,0.25"] * 2 + ["0.5,0.5"]
    weighed = STATES + "load weight = gravity(9.81 m/s^2, direction = -z)\n"
    (tmp_path / "two").mkdir()
    assert exported(weighed, "calculix", tmp_path / "two") == 0
    found = sorted((tmp_path / "two" / "out").rglob("job.inp"))
    assert [file.parent.name for file in found] == ["state-1", "state-2", "state-3"]


def test_what_another_program_solves_goes_out_as_it_is_told(tmp_path: Path) -> None:
    theirs = STATES + "model theirs = external_solver(calculix, element = hex8, strain = small, size = 5 mm)\n"
    assert exported(theirs, "calculix", tmp_path) == 0
    small, other = ((tmp_path / "out" / name / "job.inp").read_text() for name in ("small", "theirs"))
    assert small == other


def test_a_mesh_says_which_loads_it_has_at_rest_alone(tmp_path: Path) -> None:
    blown = STATES + "load air = pressure(bar, where = z >= 10 mm, magnitude = 20 Pa)\n"
    assert exported(blown.replace("strain = small", "strain = corotational"), "vtu", tmp_path) == 0
    (left,) = json.loads((tmp_path / "out" / "exam.json").read_text())["left"]
    assert left["what"] == "model `small`, load `air`"


def test_regions_whose_names_do_not_go_out_are_listed(tmp_path: Path) -> None:
    named = STATES + "region end = part(bar, where = x >= 20 mm)\n"
    assert exported(named, "vtu", tmp_path) == 0
    assert [own["what"] for own in json.loads((tmp_path / "out" / "exam.json").read_text())["left"]] == ["region `end`"]


def test_a_folder_that_cannot_be_written_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "out").write_text("in the way")
    assert exported(STATES, "vtu", tmp_path) == 2
    assert "cannot be written" in capsys.readouterr().err


AGAIN = """softmark 1
scene "The same, of a file"
material soft = neo_hookean(young = 10 kPa, poisson = 0.3, density = 1000 kg/m^3)
material hard = neo_hookean(young = 30 kPa, poisson = 0.2, density = 1200 kg/m^3)
body bar = solid(mesh("mesh.msh", unit = 1 m), soft)
region stiff = group(bar, "half", material = hard)
region face = group(bar, "wall")
region tip = group(bar, "push")
region corner = group(bar, "side")
support wall = fixed(bar, where = face)
support edge = fixed(bar, where = x >= 30 mm and z <= 0 mm, components = y)
load push = traction(bar, where = tip, vector = (0, 20, 5) Pa)
load side = traction(bar, where = corner, vector = (0, 0, 5) Pa)
load weight = gravity(9.81 m/s^2, direction = -z)
analysis rest = static()
model small = fem(ELEMENT, strain = small)
probe end = point(bar, at = (30, 5, 5) mm)
metric sink = displacement(end, along = -z)
"""


@pytest.mark.slow
@pytest.mark.parametrize("element", ["hex20", *ELEMENTS])
def test_a_scene_of_the_exported_mesh_has_the_same_answer(element: str, tmp_path: Path) -> None:
    """1e-10: the points go out with all digits, so that what is left is rounding of sums in another order."""
    assert exported(bar(element), "gmsh", tmp_path, "--model", "small") == 0
    place = tmp_path / "out" / "small" / "again.scene"
    place.write_text(AGAIN.replace("ELEMENT", element))
    each: list[Any] = [softmark.loads(bar(element)), softmark.load(place)]
    first, again = (own.run(models="small").models["small"].metrics["sink"].value for own in each)
    assert again == pytest.approx(first, rel=1e-10)


FALLS = """softmark 1
scene "A bar that falls"
material silicone = st_venant_kirchhoff(young = 60 kPa, poisson = 0.3, density = 1070 kg/m^3)
body beam = solid(box(size = (60, 20, 20) mm), silicone)
support wall = fixed(beam, where = x <= 0 mm)
support guide = fixed(beam, where = y <= 0 mm, components = y)
load weight = gravity(9.81 m/s^2, direction = -z)
load pull = traction(beam, where = x >= 60 mm, vector = (300, 0, 0) Pa)
analysis fall = dynamic(duration = 20 ms, step = 1 ms, integrator = implicit_euler, damping_mass = 5 Hz)
probe tip = point(beam, at = (60, 10, 10) mm)
metric drop = displacement(tip, along = -z)
model theirs = external_solver(mujoco, tet4, strain = finite, size = 10 mm, step = 0.5 ms)
model full = fem(tet4, strain = finite, size = 10 mm)
"""


@pytest.mark.slow
def test_a_model_of_mujoco_moves_as_its_adapter_says(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The file alone, stepped as often as it says, ends where `external_solver(mujoco, ...)` does: it is the same
    model.
    """
    mujoco = pytest.importorskip("mujoco")
    monkeypatch.chdir(tmp_path)  # where it leaves its log
    assert exported(FALLS, "mujoco", tmp_path) == 0
    assert "mass = consistent" in capsys.readouterr().err
    told = json.loads((tmp_path / "out" / "exam.json").read_text())["models"]["theirs"]
    assert (told["step"], told["steps"]) == (5e-4, 40)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "out" / "theirs" / "model.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, told["steps"])
    mujoco.mj_kinematics(model, data)
    theirs = softmark.loads(FALLS).run(models="theirs").models["theirs"]
    mesh = theirs.mesh
    moved = data.xpos[1:] - mesh.points
    assert np.abs(mesh.displacement).max() > 1e-4
    assert moved == pytest.approx(mesh.displacement, abs=1e-12)


@pytest.mark.slow
def test_a_deck_of_polyfem_goes_out_of_a_scene(tmp_path: Path) -> None:
    """Quadratic cells as corners and their order; each pressure as tractions, where facets keep their direction."""
    squeezed = bar("tet10") + "load press = pressure(bar, where = z >= 10 mm, magnitude = 20 Pa)\n"
    whole = "\n".join(line for line in squeezed.splitlines() if not line.startswith(("load side", "support edge")))
    assert exported(whole, "polyfem", tmp_path, "--model", "small") == 0
    deck = json.loads((tmp_path / "out" / "small" / "model.json").read_text())
    assert deck["space"] == {"discr_order": 2}
    assert [own["id"] for own in deck["materials"]] == [1, 2]
    tractions = sorted(own["value"] for own in deck["boundary_conditions"]["neumann_boundary"])
    assert tractions == [pytest.approx([0.0, 0.0, -20.0]), pytest.approx([0.0, 20.0, 5.0])]
    assert "tetra" in meshio.read(tmp_path / "out" / "small" / "mesh.msh").cells_dict
