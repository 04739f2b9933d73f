"""What goes between processes, journals and pages as JSON: it is read back as it was, and older files are read."""

from __future__ import annotations

import json
from dataclasses import replace

import softmark
from softmark.interpreter.pipeline.run_environment import describe_scene
from softmark.interpreter.pipeline.scene_declarations import names_of
from softmark.interpreter.report.run.model_families import scene_poisson
from softmark.interpreter.report.run.report_summary import ReportSummary
from softmark.interpreter.report.view3d.view_camera import upward
from softmark.interpreter.results.error_statements import StatedError
from softmark.interpreter.results.run_report import Report
from softmark.interpreter.study.configurations.task_outcome import PointOutcome, PointTask, TruthRequest
from softmark.interpreter.study.robustness.reference_uncertainty import LeanOutcome, reduce_outcome
from softmark.interpreter.study.robustness.robustness_record import ChoiceEdge, RobustnessPoint, ValidityEdge

TEXT = """
param    nu     = 0.3
param    c      = 1
material gel    = neo_hookean(young = 60 kPa, poisson = nu / c, density = 1000 kg/m^3)
body     beam   = solid(cylinder(length = 178 mm, radius = 19 mm), gel)
support  wall   = fixed(beam, where = x <= 0 mm)
load     weight = gravity(9.81 m/s^2, direction = (0, -c, 0))
model    rod    = beam6dof(segments = 4, body = beam)
reference theory = elastica(beam)
probe    axis   = line(beam, from = (0, 0, 0) mm, to = (178, 0, 0) mm, points = 5)
metric   eta    = relative_l2_error(axis, against = theory)
metric   sag    = displacement(axis, along = -y)
expect   rod.sag > 0 mm
expect   rod.eta < 50 %
"""


def findings(**replaced: str) -> ReportSummary:
    scene = softmark.loads(TEXT, **replaced).scene
    return ReportSummary(Report(describe_scene(scene), {}, {}, {}, (), (), names=names_of(scene)))


def test_a_page_knows_the_scene_as_it_was_run() -> None:
    """An expression and an override count: the text alone has neither a ratio nor a direction that could be read."""
    assert scene_poisson(findings()) == 0.3
    assert scene_poisson(findings(nu="0.4")) == 0.4
    assert upward(findings()).tolist() == [0.0, 1.0, 0.0]
    known = findings().declared
    assert (known["eta"].probe, known["eta"].against, known["eta"].line) == ("axis", "theory", 11)
    assert (known["axis"].word, known["axis"].body, known["rod"].body) == ("line", "beam", "beam")
    assert findings().report.names.expected == ("sag", "eta")


def test_a_task_goes_to_a_worker_and_back() -> None:
    task = PointTask("k", "s", "rod", ("rod",), "text", "a", None, "/", ("n=4",), 600.0, TruthRequest("a", "eta"), True)
    assert PointTask.from_json(json.loads(json.dumps(task.to_json()))) == task
    plain = replace(task, limit_s=None, truth=None, stated=False).to_json()
    assert not {"limit_s", "truth", "stated", "alone"} & set(plain), "what is not asked is not said"


def test_outcomes_of_older_journals_are_read() -> None:
    """Without seconds, outline, warnings, sizes and what was stated: each has a default."""
    old = PointOutcome.from_json({"key": "k", "point": {"status": "converged"}, "references": {}, "later": 1})
    assert (old.cpu_s, old.unfinished, old.is_worth_retrying(1.0)) == (None, False, False)
    thin = reduce_outcome(old)
    assert LeanOutcome.from_json(json.loads(json.dumps(thin.to_json()))).point == thin.point
    assert (thin.point.outline, thin.point.warnings, thin.point.stated) == ("", (), None)
    late = {"key": "k", "point": {"status": "timed_out"}, "unfinished": True, "limit_s": 5.0}
    assert [LeanOutcome.from_json(late).is_worth_retrying(s) for s in (5.0, 6.0)] == [False, True]


def test_numbers_that_json_has_not_are_null() -> None:
    said = StatedError(float("nan"), "m", {"model": float("inf")})
    assert said.to_json() == {"value": None, "unit": "m", "parts": {"model": None}, "reason": None, "doubts": []}


def test_edges_of_older_studies_are_read() -> None:
    """A choice had no class for each option once; a walk did not say what was judged."""
    own = {"model": "m", "quantity": "q", "direction": "up", "class": "silent"}
    choice = ValidityEdge.read({**own, "right": ["a"], "wrong": ["b"]})
    assert isinstance(choice, ChoiceEdge)
    assert choice.classes == {"a": "right", "b": "silent"}
    assert choice.to_json()["wrong"] == ["b"]
    walk = ValidityEdge.read(own)
    assert (walk.word, walk.judged, type(walk)) == ("silent", 0, ValidityEdge)
    point = RobustnessPoint.from_json({"key": "k", "model": "m", "values": {}, "class": "right", "error": 0.1})
    assert (point.found.word, point.found.states, point.texts) == ("right", None, {})
