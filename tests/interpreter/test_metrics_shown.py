"""Every metric that a scene asks for is shown under what it is measured from, or with a reason that fits."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import softmark
from softmark.interpreter.cli.main import main
from softmark.interpreter.report.run.report_page import render
from softmark.interpreter.report.run.report_summary import ReportSummary

Parsed = Callable[[str], Any]
BEAM = """
material gel  = neo_hookean(young = 80 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     beam = solid(cylinder(length = 120 mm, radius = 10 mm), gel)
support  wall = fixed(beam, where = x <= 0 mm)
load     pull = gravity(9.81 m/s^2, direction = -z)
model    rod    = beam6dof(segments = 20)
model    coarse = beam6dof(segments = 4)
probe    axis = line(beam, from = (0, 0, 0) mm, to = (120, 0, 0) mm, points = 5)
metric   sag  = displacement(axis, along = -z)
"""
AGAINST_MODEL = BEAM + "metric diff = relative_l2_error(axis, against = rod)\n"
THEORIES = (
    BEAM
    + """
reference theory   = elastica(beam)
reference reissner = simo_reissner(beam)
metric eta     = relative_l2_error(axis, against = theory)
metric eta_rod = relative_l2_error(axis, against = reissner)
"""
)


@pytest.mark.slow
@pytest.mark.parametrize(("text", "sag", "others"), [(BEAM, True, ()), (AGAINST_MODEL, True, ("diff",))])
def test_compare_shows_metrics_that_need_no_reference(
    text: str, sag: bool, others: tuple[str, ...], tmp_path: Path, parsed: Parsed,
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    """`sag` of 20 segments is 80.49 mm, of 4 it is 80.64 mm: what `dsl run` shows of the same models."""
    monkeypatch.chdir(tmp_path)
    Path("beam.scene").write_text(text, encoding="utf-8")
    assert main(["compare", "beam.scene", "--repeats", "0"]) == 0
    said = capsys.readouterr().out
    page = Path("beam-comparison/compare.html").read_text(encoding="utf-8")
    value = softmark.loads(text).run(models="rod").models["rod"].metrics["sag"].value
    shown = f"{1e3 * (value or 0):.6g}"
    for where in (said, parsed(page).text):
        assert all(metric in where for metric in ("sag", *others))
        assert shown in where
    assert "sag [m]" in page.replace("%20", " ").replace("%5B", "[").replace("%5D", "]")


def test_a_model_against_itself_is_not_another_body() -> None:
    page = render(softmark.loads(AGAINST_MODEL).run())
    assert "another body" not in page
    assert "this is the model that others are compared with" in page
    assert "Difference from <code>rod</code>" in page


@pytest.mark.parametrize(("expect", "first", "metric"), [
    ("", "theory", "eta"),
    ("expect rod.eta_rod < 1 %\nexpect rod.eta < 50 %\n", "reissner", "eta_rod"),
    ("expect abs(theory.sag - 80 mm) < 9 mm\nexpect coarse.eta_rod < 9 %\n", "reissner", "eta_rod"),
])  # fmt: skip
def test_the_headline_is_what_the_scene_expects_of_its_models_first(expect: str, first: str, metric: str) -> None:
    """With both ends: the least error alone says how good the best is, and nothing of the others."""
    found = ReportSummary(softmark.loads(THEORIES + expect).run())
    said = found.conclusion.split("; ")[1]
    assert said.startswith(f"the closest to `{first}` is ")
    assert f"(`{metric}`), the farthest is `" in said
