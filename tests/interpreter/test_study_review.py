"""What a comparison must not say: that configurations of different problems compete, or what rests on something else.

Scenes are rods of few segments, which take milliseconds; expected numbers are made up by hand or follow from the scene.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from softmark.interpreter.cli.main import main
from softmark.interpreter.report.comparison.comparison_page import page
from softmark.interpreter.report.comparison.comparison_terminal import table
from softmark.interpreter.study.analysis.comparison_advice import training_remarks
from softmark.interpreter.study.analysis.comparison_point import ComparedPoint
from softmark.interpreter.study.analysis.comparison_record import ComparisonRecord
from softmark.interpreter.study.analysis.configuration_pairs import compute_distances
from softmark.interpreter.study.configurations.reference_changes import mark_problems

BEAM = """
param    E      = 60 kPa
param    n      = 4
material gel    = neo_hookean(young = E, poisson = 0.3, density = 1000 kg/m^3)
body     beam   = solid(cylinder(length = 178 mm, radius = 19 mm), gel)
support  wall   = fixed(beam, where = x <= 0 mm)
load     weight = gravity(9.81 m/s^2)
analysis sag    = static()
model    rod    = beam6dof(segments = n)
model    stiff  = beam6dof(segments = 6, shear = no, axial = no)
reference theory = elastica(beam)
probe    axis   = line(beam, from = (0, 0, 0) mm, to = (178, 0, 0) mm, points = 5)
metric   eta    = relative_l2_error(axis, against = theory)
study    worth  = pareto(eta)
"""


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    scene = tmp_path / "beam.scene"
    scene.write_text(BEAM, encoding="utf-8")
    return scene


def compared(*arguments: str) -> dict[str, Any]:
    assert main(["compare", "--repeats", "0", "--fresh", *arguments]) == 0
    found: dict[str, Any] = json.loads(Path("beam-comparison/compare.json").read_text(encoding="utf-8"))
    return found


# ------------------------------------------------------------------ problems


@pytest.mark.slow
def test_values_that_change_the_truth_are_problems_of_their_own(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A stiffer beam sags less: its errors are against another theory, and what is quick there is no choice here."""
    found = compared("beam.scene", "--vary", "E=30kPa,120kPa")
    assert [p["problem"] for p in found["points"]] == [{"E": "30 kPa"}] * 2 + [{"E": "120 kPa"}] * 2
    assert list(found["analysis"]["scenes"]) == ["beam, E = 30 kPa", "beam, E = 120 kPa"]
    for value, (name, own) in zip(("30 kPa", "120 kPa"), found["analysis"]["scenes"].items(), strict=True):
        assert own["metrics"]["eta"]["front"], "each has its own"
        mine = [p for p in found["points"] if ComparedPoint.from_json(p).part == name]
        assert {p["variation"]["E"] for p in mine} == {value}
        keys = {p["key"] for p in mine}
        assert set(own["metrics"]["eta"]["front"]) <= keys
        # the matrix compares with the theory at this value: what it says of a model is the model's own error
        row, column = own["distances"]["names"].index("rod"), own["distances"]["names"].index("theory")
        eta = next(p for p in mine if p["model"] == "rod")["errors"]["eta"]["value"]
        assert own["distances"]["matrix"][row][column] == pytest.approx(eta, rel=1e-12)
    low, high = (found["references"][name]["theory"] for name in found["analysis"]["scenes"])
    assert low["probes"]["axis"]["displacement"] != high["probes"]["axis"]["displacement"]
    shown = capsys.readouterr().out
    assert "The reference changes with E: only configurations with the same value are compared." in shown
    assert shown.count("-> E = ") == 2
    assert "changes with <code>E</code>" in page(ComparisonRecord.from_json(found))


@pytest.mark.slow
def test_what_only_refines_is_one_problem(file: Path) -> None:
    for vary in ("n=3,6", "sag.tolerance=1e-4,1e-9"):
        found = compared("beam.scene", "--vary", vary)
        assert list(found["analysis"]["scenes"]) == ["beam"], vary
        assert all(p["problem"] == {} for p in found["points"])


@pytest.mark.slow
def test_a_model_that_is_measured_against_is_a_truth_too(file: Path) -> None:
    """rod is measured from stiff alone; with its segments, what `rod` is measured from changes."""
    file.write_text(BEAM.replace("against = theory", "against = stiff"), encoding="utf-8")
    found = compared("beam.scene", "--vary", "stiff.segments=3,6")
    assert [p["problem"] for p in found["points"] if p["model"] == "rod"] == [
        {"stiff.segments": "3"}, {"stiff.segments": "6"}
    ]  # fmt: skip
    found = compared("beam.scene", "--vary", "n=3,6")
    assert all(p["problem"] == {} for p in found["points"])


def made(variation: dict[str, str], trace: Any, **more: Any) -> dict[str, Any]:
    own = {"scene": "s", "model": "m", "study": None, "variation": variation, "measured_from": {"truth": trace}}
    return {**own, **more}


def test_only_what_changes_the_truth_is_in_a_problem() -> None:
    """|X|, a sum of X, |u|, a sum of u: 1e-6 of |u| is another tolerance, 1 % another load."""
    points = [
        made({"g": g, "tol": tol}, [1.0, 0.5, u * (1 + eps), 0.0])
        for g, u in (("1", 1.0), ("2", 1.01)) for tol, eps in (("a", 0.0), ("b", 1e-6))
    ]  # fmt: skip
    assert [p["problem"] for p in mark_problems(points)] == [{"g": g} for g in "1122"]


def test_a_truth_that_failed_says_nothing_and_files_are_known_by_what_is_in_them() -> None:
    assert [
        p["problem"] for p in mark_problems([made({"a": "1"}, [1.0, 0.0, 1.0, 0.0]), made({"a": "2"}, "digest")])
    ] == [{}, {}]
    assert mark_problems([made({"a": "1"}, "one"), made({"a": "2"}, "two")])[0]["problem"] == {"a": "1"}


def test_no_distance_between_shapes_that_were_computed_at_different_values() -> None:
    """Without a reference nothing says what a problem is; but E refines nothing, so the shapes differ by it."""
    probe = {"axis": {"points": [[0.0, 0.0, 0.0]], "displacement": [[0.0, 0.0, 1.0]]}}

    def point(model: str, value: str, status: str) -> ComparedPoint:
        label = f"{model}, E = {value}"
        entries = {"key": label, "label": label, "model": model, "scene": "s", "variation": {"E": value}}
        return ComparedPoint.from_json(entries | {"status": status, "size": {"dofs": 9}, "probes": probe})

    found = compute_distances(
        [point("a", "1", "converged"), point("b", "1", "failed"), point("b", "2", "converged")], {}
    )
    assert found.matrix == [[0.0, None], [None, 0.0]]
    assert {r.reason for r in found.reasons} == {"they were computed at different E"}


# ------------------------------------------------------------------ what is said


@pytest.mark.slow
def test_labels_leave_out_the_name_of_the_own_model(file: Path) -> None:
    found = compared("beam.scene", "--vary", "rod.segments=3,6", "--model", "rod")
    assert [p["label"] for p in found["points"]] == ["rod, segments = 3", "rod, segments = 6"]
    assert [p["variation"] for p in found["points"]] == [{"rod.segments": "3"}, {"rod.segments": "6"}]


@pytest.mark.slow
@pytest.mark.long
def test_answers_are_in_the_json(file: Path) -> None:
    (answer,) = compared("beam.scene")["analysis"]["scenes"]["beam"]["answers"]
    assert (answer["study"], answer["kind"], answer["counted"]) == ("worth", "pareto", 2)


def test_what_must_be_said_of_a_reduced_model() -> None:
    """Trained on the state that it is judged by; made in 2 s that its time leaves out."""
    spread = {"median": 2.0, "q1": 2.0, "q3": 2.0}
    reduced = {"of": "full", "repeats": True, "extrapolates": []}
    said = training_remarks(ComparedPoint.from_json({"solve": {"reduced": reduced}, "cost": {"setup_s": spread}}))
    assert said == [
        "It was trained on `full` in this same state: its error shows only how well it reproduces that state, not "
        "other loads.",
        "Its time excludes 2\u00a0s of training from `full`.",
    ]
    beyond = {"of": "full", "repeats": False, "extrapolates": ["load"]}
    assert training_remarks(ComparedPoint.from_json({"solve": {"reduced": beyond}})) == [
        "It extrapolates: `load` is outside its training range."
    ]
    assert training_remarks(ComparedPoint.from_json({"solve": {}})) == []


def test_remarks_stand_with_the_advice() -> None:
    """Of two that are equal in time and error the first is named; untimed, a reduced model has no effort to compare."""
    spread = {"median": 1.0, "q1": 0.99, "q3": 1.01, "min": 0.99, "max": 1.01, "runs": 5}
    point = {
        "key": "k", "scene": "s", "model": "m", "label": "m", "study": None, "variation": {}, "numbers": {},
        "status": "converged", "message": None, "size": {"dofs": 3}, "cost": {"cpu_s": spread}, "probes": {},
        "warnings": [],
        "errors": {"e": {"value": 0.01, "unit": "1", "against": "full"}},
        "solve": {"reduced": {"of": "full", "repeats": True}},
    }  # fmt: skip
    other = {**point, "key": "l", "model": "n", "label": "n", "solve": {}}
    (advice,) = ComparisonRecord.from_json({"points": [point, other]}).analysis.advice
    assert advice.text.startswith("For an error of 1\u00a0% or less in `e` against `full`, `m` is the fastest")
    untimed = [{**p, "cost": None} for p in (point, other)]
    (by_size,) = ComparisonRecord.from_json({"points": untimed}).analysis.advice
    assert by_size.text.startswith("For an error of 1\u00a0% or less in `e` against `full`, `n` is the smallest")
    assert advice.caveats[0].startswith("It was trained on `full` in this same state")


@pytest.mark.slow
def test_warnings_belong_to_the_models_that_they_are_about(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Each in a line as the command begins, and with the configurations of its model."""
    coarse = "model    tet    = fem(tet4, strain = small, size = 30 mm)\n"
    file.write_text(BEAM + coarse, encoding="utf-8")
    found = compared("beam.scene")
    codes = {p["model"]: [w["code"] for w in p["warnings"]] for p in found["points"]}
    assert "W312" in codes["tet"]
    assert not codes["rod"]
    said = capsys.readouterr().err
    line = 1 + (BEAM + coarse).splitlines().index(coarse.strip())
    assert f"W312 line {line}: " in said
    assert "= help" not in said


@pytest.mark.slow
def test_scenes_of_one_title_are_told_apart(file: Path) -> None:
    Path("other").mkdir()
    for place in ("beam.scene", "other/beam.scene"):
        Path(place).write_text('scene "A beam"\n' + BEAM, encoding="utf-8")
    assert main(["compare", "beam.scene", "other/beam.scene", "--repeats", "0", "--model", "rod", "--out", "o"]) == 0
    shown = table(ComparisonRecord.from_json(json.loads(Path("o/compare.json").read_text(encoding="utf-8"))), False)
    assert "A beam (beam.scene)" in shown
    assert "A beam (other/beam.scene)" in shown


def test_models_that_are_varied_have_names(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["compare", "beam.scene", "--repeats", "0", "--vary", "model="]) == 2
    assert "E220" in capsys.readouterr().err
