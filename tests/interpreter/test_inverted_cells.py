"""Small strain with cells that its displacements turn inside out: no part of a report calls that an answer."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import softmark
from softmark.interpreter.cli.main import main

BLOCK = """
material gel   = linear_elastic(young = 10 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     block = solid(box(size = (20, 20, 20) mm), gel)
support  wall  = fixed(block, where = x <= 0 mm)
load     press = traction(block, where = x >= 20 mm, vector = (-{push}, 0, 0) Pa)
model    tet   = fem(tet4, strain = small, size = 10 mm)
probe    tip   = point(block, at = (20, 10, 10) mm)
metric   far   = displacement(tip, along = -x)
expect tet.far > 0 mm
"""


def test_cells_inside_out_are_no_answer_anywhere(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The table, the page, JSON, the exit status, the expectation and Python say the same."""
    monkeypatch.chdir(tmp_path)
    Path("a.scene").write_text(BLOCK.format(push=15000), encoding="utf-8")
    assert main(["run", "a.scene", "--json", "a.json", "--out", "out"]) == 1
    shown = capsys.readouterr()
    assert "inverted cells" in shown.out
    assert " ok" not in shown.out
    found = json.loads(Path("a.json").read_text(encoding="utf-8"))
    assert found["models"]["tet"]["inverted"] == 40
    (expected,) = found["expectations"]
    assert expected["passed"] is None
    page = Path("out/report.html").read_text(encoding="utf-8")
    assert "Finished, with inverted cells in <code>tet</code>" in page or "with inverted cells in `tet`" in page
    report = softmark.load("a.scene").run()
    assert report.exit_status == 1
    assert "tet converged with inverted cells" in repr(report)
    assert "inverted cells" in repr(report.models["tet"])


def test_expectations_that_name_nothing_do_not_hide_it() -> None:
    report = softmark.loads(BLOCK.format(push=15000).replace("expect tet.far > 0 mm", "")).run()
    assert (report.models["tet"].inverted, report.exit_status) == (40, 1)


def test_a_sound_state_is_as_before() -> None:
    report = softmark.loads(BLOCK.format(push=500)).run()
    assert (report.models["tet"].inverted, report.exit_status) == (0, 0)
    assert report.expectations[0].passed


def test_a_comparison_recommends_no_such_model(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its points are on no front, with the reason."""
    from softmark.interpreter.study.analysis.comparison_point import ComparedPoint
    from softmark.interpreter.study.analysis.pareto_front import judge_points

    point = {
        "key": "a", "scene": "s", "model": "tet", "status": "converged", "size": {"dofs": 3},
        "errors": {"eta": {"value": 0.1, "unit": "1", "against": "fine"}},
        "warnings": [{"code": "W351", "message": "40 of 40 inverted cells", "line": 1}],
    }  # fmt: skip
    found = judge_points([ComparedPoint.from_json(point)], "eta", "unknowns")
    assert not found.candidates
    assert found.left_out["a"][1] == "its cells are inverted"
