"""What stands beside the text: values in SI, and what was measured last."""

from __future__ import annotations

import hashlib
import json
import os
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("lsprotocol")

from lsprotocol import types
from marked_texts import marked, whole

from softmark.interpreter.cli.main import main
from softmark.interpreter.language_server import inlay_hints
from softmark.interpreter.language_server.text_document import Document

pytestmark = pytest.mark.slow

SCENE = """param L = 178 mm
param half = L / 2
param E = 60 kPa in 1 kPa .. 1 MPa
param n = 3
param g = 9.81 m/s^2
material gel = neo_hookean(young = E, poisson = 49 %, density = 1.07 g/cm^3)
body beam = solid(cylinder(length = L, radius = 19 mm, axis = +x), gel)
support wall = fixed(beam, where = x <= 0 mm)
load weight = gravity(g, direction = -z)
model rod = beam6dof(segments = 4)
model fine = beam6dof(segments = 8)
reference theory = simo_reissner(beam)
probe axis = line(beam, from = (0, 0, 0) mm, to = (L, 0 mm, 0 mm))
metric eta = relative_l2_error(axis, against = theory)
metric etalon = displacement(tip, along = -z)
probe tip = point(beam, at = (L, 0 mm, 0 mm))
expect rod.eta < 1e-9 %
expect rod.etalon  >  1 um
"""


def beside(document: Document) -> dict[str, str]:
    """What stands behind each text, of all hints of a document, by the text of the line up to there."""
    found = inlay_hints.hints(document, types.InlayHintParams(types.TextDocumentIdentifier(""), whole(document)))
    starts = document.starts
    return {document.text[starts[h.position.line] : document.offset(h.position)]: str(h.label).strip() for h in found}


def test_values_in_si_stand_behind_what_is_written_otherwise(tmp_path: Path) -> None:
    found = beside(marked(SCENE, tmp_path).document)
    assert found["param L = 178 mm"] == "= 0.178 m"
    assert found["param half = L / 2"] == "= 0.089 m"
    assert found["param E = 60 kPa"] == "= 60000 Pa"
    assert found["material gel = neo_hookean(young = E, poisson = 49 %"] == "= 0.49"
    assert found["material gel = neo_hookean(young = E, poisson = 49 %, density = 1.07 g/cm^3"] == "= 1070 kg/m^3"
    assert found["probe tip = point(beam, at = (L, 0 mm, 0 mm)"] == "= (0.178, 0, 0) m"
    assert not any(line.startswith(("param n", "param g", "model")) for line in found)


def test_a_text_in_error_has_the_values_that_it_still_has(tmp_path: Path) -> None:
    found = beside(marked("param L = 178 mm\nparam a = 2 * L\nparam b = 2 * M\nparam c = (1\n", tmp_path).document)
    assert found == {"param L = 178 mm": "= 0.178 m", "param a = 2 * L": "= 0.356 m"}


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a scene that was run, and its report where `dsl run` leaves it."""
    folder = tmp_path_factory.mktemp("measured")
    file = folder / "hangs.scene"
    file.write_text(SCENE, encoding="utf-8")
    assert main(["run", str(file), "--stated", "--out", str(folder / "hangs-report")]) == 1  # one is not met
    return file


def test_the_last_number_and_its_verdict_stand_beside_what_is_expected(measured: Path) -> None:
    report: Any = json.loads((measured.parent / "hangs-report/report.json").read_text(encoding="utf-8"))
    found = beside(Document(SCENE, measured.parent, measured))
    expected = found["expect rod.eta < 1e-9 %"]
    assert expected.startswith("NOT MET: ")
    number = float(expected.split()[2])
    assert number == pytest.approx(100 * report["models"]["rod"]["metrics"]["eta"]["value"], rel=1e-3)
    assert "±" in expected  # what the model states of it
    assert found["expect rod.etalon  >  1 um"].startswith("met: ")
    metric = found["metric eta = relative_l2_error(axis, against = theory)"]
    assert metric.startswith("rod ")
    assert ", fine " in metric
    assert metric.endswith("expected: 1 NOT MET")
    assert found["metric etalon = displacement(tip, along = -z)"].endswith("expected: 1 met")


def test_what_was_measured_of_an_earlier_text_says_so_wherever_its_line_is_now(measured: Path) -> None:
    now = "# more\n" + SCENE.replace("178 mm", "180 mm")
    found = beside(Document(now, measured.parent, measured))
    assert found["expect rod.eta < 1e-9 %"].startswith("of an earlier text: NOT MET: ")
    assert found["metric eta = relative_l2_error(axis, against = theory)"].startswith("of an earlier text: rod ")
    changed = beside(Document(SCENE.replace("< 1e-9 %", "< 2 %"), measured.parent, measured))
    assert not any(line.startswith("expect rod.eta ") for line in changed)
    line = types.Range(types.Position(17, 0), types.Position(17, 9))
    asked = types.InlayHintParams(types.TextDocumentIdentifier(""), line)
    hint = inlay_hints.hints(Document(now, measured.parent, measured), asked)
    assert isinstance(hint[0].tooltip, types.MarkupContent)
    assert "has changed since" in hint[0].tooltip.value
    assert "hangs-report/report.json" in hint[0].tooltip.value


def test_what_was_measured_with_other_files_says_so(tmp_path: Path) -> None:
    file, used, table = (tmp_path / name for name in ("a.scene", "inner.scene", "table.csv"))
    text = 'use "inner.scene" as inner  # "table.csv"\nmetric gap = g()\n'
    file.write_text(text, encoding="utf-8")
    begun = datetime.now(UTC)
    scene = {"file": "a.scene", "sha256": hashlib.sha256(text.encode()).hexdigest(), "plugins": [{"file": "p.py"}]}
    report = {
        "schema": "softmark-report/1", "expectations": [], "references": {}, "scene": scene,
        "models": {"m": {"metrics": {"gap": {"value": 1.0, "unit": "m"}}}},
        "environment": {"started": (begun + timedelta(seconds=5)).isoformat(timespec="seconds")},
    }  # fmt: skip

    def said() -> str:
        return beside(Document(text, tmp_path, file))["metric gap = g()"]

    (tmp_path / "a-report").mkdir()
    (tmp_path / "a-report/report.json").write_text(json.dumps(report), encoding="utf-8")
    for path in (used, table, tmp_path / "p.py"):
        path.write_text("param E = 3 Pa\n", encoding="utf-8")
    assert said() == "m 1\u00a0m"
    for path in (used, table, tmp_path / "p.py"):
        os.utime(path, (begun.timestamp() + 60,) * 2)
        assert said() == f"of an earlier {path.name}: m 1\u00a0m"
        os.utime(path)
    del scene["plugins"]
    (tmp_path / "a-report/report.json").write_text(json.dumps(report), encoding="utf-8")
    used.unlink()
    assert said() == "of an earlier state of its files: m 1\u00a0m"


def test_a_report_that_leads_to_another_scene_of_the_same_name_is_not_of_this_one(measured: Path) -> None:
    own = measured.parent / "other/hangs.scene"
    own.parent.mkdir()
    assert not any(line.startswith("expect") for line in beside(Document(SCENE, own.parent, own)))


def test_what_a_metric_says_of_its_own_value_is_there(tmp_path: Path) -> None:
    metrics = {
        "clock": {"value": 1.5, "unit": "1", "verdict": False},
        "gap": {"value": 1e-6, "unit": "m", "uncertainty": 1e-3, "meaningful": False},
        "off": {"value": None, "unit": "m", "reason": "nothing moved"},
    }
    report = {
        "schema": "softmark-report/1", "expectations": [], "references": {},
        "scene": {"file": "a.scene", "sha256": "", "overrides": ["L=3mm"]}, "models": {"m": {"metrics": metrics}},
    }  # fmt: skip
    (tmp_path / "a-report").mkdir()
    (tmp_path / "a-report/report.json").write_text(json.dumps(report), encoding="utf-8")
    text = "metric clock = realtime_factor()\nmetric gap = g()\nmetric off = f()\nmetric none = f()\n"
    found = beside(marked(text, tmp_path, "a.scene").document)
    earlier = "of an earlier text, with L=3mm: m"
    assert found == {
        "metric clock = realtime_factor()": f"{earlier} 150\u00a0%, NOT in time",
        "metric gap = g()": f"{earlier} 1\u00a0µm, within the uncertainty of the reference",
        "metric off = f()": f"{earlier} no value: nothing moved",
    }


def test_a_report_above_the_scene_is_found_and_one_of_another_scene_or_in_pieces_is_not(
    measured: Path, tmp_path: Path
) -> None:
    own = tmp_path / "scenes/deep/hangs.scene"
    text = (measured.parent / "hangs-report/report.json").read_text(encoding="utf-8")
    text = text.replace(str(measured), "scenes/deep/hangs.scene")  # as if it had been run there
    other = text.replace("hangs.scene", "b.scene")
    for report, seen in ((text, True), (text[:500], False), ("[]", False), (other, False)):
        folder = tmp_path / "hangs-report"
        folder.mkdir(exist_ok=True)
        (folder / "report.json").write_text(report, encoding="utf-8")
        found = beside(Document(SCENE, own.parent, own))
        assert any(line.startswith("expect") for line in found) == seen
