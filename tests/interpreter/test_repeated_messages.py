"""`To repeat this run`: a scene of the library is called by its name, wherever the package is installed."""

from __future__ import annotations

from pathlib import Path

import pytest

import softmark
from softmark.interpreter.language.scene_sources import standard_name, standard_scenes
from softmark.interpreter.pipeline.run_environment import describe_scene
from softmark.interpreter.report.robustness.robustness_page import repeat_command
from softmark.interpreter.report.run.report_page import render
from softmark.interpreter.report.run.report_summary import ReportSummary
from softmark.interpreter.report.run.tables.provenance_table import command
from softmark.interpreter.study.robustness.robustness_record import ClassifiedPoint, RobustnessPoint

POINT = RobustnessPoint("rod", {"L": 1.0}, ClassifiedPoint("right"), {"L": "1 m"})


def test_a_scene_of_the_library_is_repeated_by_its_name() -> None:
    report = softmark.load("stiff-cantilever").run(models=["euler"])
    assert command(ReportSummary(report)) == "dsl run stiff-cantilever --model euler"
    page = render(report)
    assert str(standard_scenes()["stiff-cantilever"].parent) not in page, "no path into a package"


def test_a_point_of_a_study_is_repeated_by_the_name() -> None:
    known = describe_scene(softmark.load("beam-at-the-extremes").scene)
    assert known["standard"] == "beam-at-the-extremes"
    from softmark.interpreter.report.run.tables.provenance_table import scene_name

    assert repeat_command(scene_name(known, "-"), POINT) == "dsl run beam-at-the-extremes -p 'L=1 m' --model rod"


def test_a_file_of_ones_own_keeps_its_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    own = tmp_path / "silicone-beam.scene"
    own.write_text(standard_scenes()["silicone-beam"].read_text(encoding="utf-8"), encoding="utf-8")
    assert standard_name(own) is None
    assert describe_scene(softmark.load(own).scene)["standard"] is None
