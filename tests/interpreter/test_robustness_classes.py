"""The class of a point, from outcomes as plain JSON: every class, and what counts as saying so."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from softmark.interpreter.study.configurations.task_outcome import PointOutcome, TruthStatement
from softmark.interpreter.study.robustness.point_classification import classify
from softmark.interpreter.study.robustness.reference_uncertainty import LeanOutcome, reduce_outcome, uncertainty_of

WITHIN = 0.05


def outcome(error: float | None = 0.01, status: str = "converged", **more: Any) -> LeanOutcome:
    point = {
        "status": status, "message": more.get("message"),
        "warnings": [{"code": c, "message": c} for c in more.get("codes", ())],
        "errors": {"eta": {"value": error, "unit": "1", "against": "theory", "reason": more.get("reason")}},
    }  # fmt: skip
    if "stated" in more:
        point["stated"] = more["stated"]
    reference = {"status": more.get("truth", "converged"), "message": "it says so", "estimated_error": 0.0}
    return LeanOutcome.from_json({"key": "k", "point": point, "references": {"theory": reference}})


def stated(value: float | None, *doubts: str) -> dict[str, Any]:
    reason = None if value is not None else "no coarser mesh"
    return {"value": value, "parts": {}, "doubts": list(doubts), "reason": reason}


@pytest.mark.parametrize(
    ("found", "expected"),
    [
        (outcome(0.05), "right"),
        (outcome(0.059), "right"),  # 0.05 and the truth's own 0.01
        (outcome(0.061), "silent"),  # nothing is stated: nothing says so
        (outcome(0.061, stated=stated(0.02)), "silent"),  # it states less than it is off
        (outcome(0.061, stated=stated(0.052)), "inaccurate"),  # 0.061 - 0.01 at most
        (outcome(0.5, stated=stated(None)), "inaccurate"),  # it vouches for nothing
        (outcome(0.5, stated=stated(0.0, "W351")), "inaccurate"),  # it doubts itself
        (outcome(0.5, codes=["W301"]), "inaccurate"),
        (outcome(0.5, codes=["W353"]), "inaccurate"),  # its forces were not found again
        (outcome(0.5, codes=["W314"]), "inaccurate"),  # it buckled
        (outcome(0.5, codes=["W319"]), "silent"),  # that stability is not known says nothing about the answer
        (outcome(0.5, codes=["W310"]), "silent"),  # an unlikely stiffness says nothing about the answer
        (outcome(0.5, status="capped"), "inaccurate"),
        (outcome(0.01, status="capped"), "right"),
        (outcome(0.01, codes=["W301"]), "right"),
        (outcome(None, status="not_converged", message="no equilibrium"), "not_converged"),
        (outcome(None, status="diverged"), "diverged"),
        (outcome(None, status="timed_out"), "timed_out"),
        (outcome(None, status="failed", message="it stopped with an error"), "failed"),
        (outcome(None, status="failed", message="E304: a mesh that does not fit (line 2 of a.scene)"), "refused"),
        (outcome(None, status="failed", message="E503: `theory` does not hold for this scene"), "unjudged"),
        (outcome(None, status="skipped"), "unjudged"),
        (outcome(0.5, truth="failed"), "unjudged"),
        (outcome(None, reason="the reference does not move"), "unjudged"),
    ],
)
def test_classes(found: LeanOutcome, expected: str) -> None:
    assert classify(found, "eta", WITHIN, 0.01).word == expected


def test_a_truth_that_is_uncertain_judges_nothing() -> None:
    assert classify(outcome(0.01), "eta", WITHIN, 0.06).word == "unjudged"
    doubted = classify(outcome(0.5), "eta", WITHIN, 0.0, "strains are too large for the theory")
    assert (doubted.word, doubted.message) == ("unjudged", "strains are too large for the theory")


def by_model(status: str = "converged", said: dict[str, Any] | None = None, error: float = 0.1) -> LeanOutcome:
    """An outcome that is measured from a model."""
    found = outcome(error, stated=stated(0.0))
    truth = TruthStatement.from_json({"status": status, "message": "a cap", "stated": said})
    return replace(found, references={}, truths={"theory": truth})


@pytest.mark.parametrize(
    ("found", "message"),
    [
        (by_model("capped", stated(0.0)), "has no result: a cap"),
        (by_model("converged", stated(0.0, "W301")), "has warnings (W301, the element locks)"),
        (by_model("converged", stated(None)), "has no error estimate: no coarser mesh"),
        (by_model("converged", stated(0.06)), "the uncertainty of the reference, 0.06, exceeds the limit 0.05"),
        (replace(by_model(), truths={}), "the accuracy of `theory` is unknown"),
    ],
)
def test_a_model_that_is_no_truth_judges_nothing(found: LeanOutcome, message: str) -> None:
    known = classify(found, "eta", WITHIN, uncertainty_of(found, "theory", "axis"))
    assert known.word == "unjudged"
    assert message in str(known.message)


def test_what_a_model_states_is_the_uncertainty_of_a_truth() -> None:
    near, far = (by_model(said=stated(0.04), error=error) for error in (0.085, 0.095))
    assert uncertainty_of(near, "theory", "axis") == 0.04
    assert [classify(o, "eta", WITHIN, 0.04).word for o in (near, far)] == ["right", "silent"]


def test_a_truth_that_cannot_be_built_refuses_nobody() -> None:
    found = outcome(None, status="failed", message="E304: too fine")
    assert classify(found, "eta", WITHIN, None).word == "refused"
    refused = replace(found, truths={"fine": TruthStatement("failed", "E304: too fine", None)})
    known = classify(refused, "eta", WITHIN, None)
    assert (known.word, known.code) == ("unjudged", "E304")


def test_a_locking_truth_judges_nothing(tmp_path: Any) -> None:
    """The task asks the model that is taken as right what it states, and one that cannot be built is no fault."""
    import softmark
    from softmark.interpreter.planning.robustness_plan import resolve_study
    from softmark.interpreter.study.configurations.configuration_expansion import SceneSubject
    from softmark.interpreter.study.configurations.configuration_task import perform
    from softmark.interpreter.study.robustness.robustness_points import VariedScene

    text = """
param    h    = 10 mm in 0.1 mm .. 100 mm
material gel  = neo_hookean(young = 600 kPa, poisson = 0.499, density = 1000 kg/m^3)
body     beam = solid(box(size = (40 mm, 20 mm, 20 mm)), gel)
support  wall = fixed(beam, where = x <= 0 mm)
load     pull = gravity(1 m/s^2, direction = -z)
model    fine = fem(tet4, strain = corotational, size = h)
model    same = fem(tet4, strain = finite, size = 10 mm)
probe    axis = line(beam, from = (0, 10, 10) mm, to = (40, 10, 10) mm, points = 3)
metric   eta  = relative_l2_error(axis, against = fine)
"""
    scene = softmark.loads(text).scene
    ground = VariedScene(SceneSubject("a", scene, tmp_path), resolve_study(scene, None))
    found = reduce_outcome(perform(ground.task((), "same")))
    known = classify(found, "eta", WITHIN, uncertainty_of(found, "fine", "axis"))
    assert known.error is not None
    assert known.error < WITHIN  # both lock, so they agree
    assert known.word == "unjudged"
    assert "W301" in str(known.message)


def test_what_a_class_keeps() -> None:
    refused = classify(outcome(None, status="failed", message="E304: too fine; use more"), "eta", WITHIN, None)
    assert (refused.code, refused.status) == ("E304", None)
    said = classify(outcome(0.5, codes=["W301", "W301"]), "eta", WITHIN, None)
    assert (said.error, said.warnings, said.message) == (0.5, ("W301",), "W301: W301")


def test_uncertainty_is_relative_to_what_the_truth_moves() -> None:
    """0.1 mm of a field of 3 and 4 mm: their root mean square is sqrt(12.5) mm."""
    probe = {"points": [[0, 0, 0], [1, 0, 0]], "displacement": [[0, 0, 3e-3], [0, 4e-3, 0]]}
    reference = {"status": "converged", "message": None, "estimated_error": 1e-4, "probes": {"axis": probe}}
    point = {"status": "converged", "probes": {"axis": probe}}
    small = reduce_outcome(PointOutcome.from_json({"key": "k", "point": point, "references": {"theory": reference}}))
    assert "probes" not in small.to_json()["point"]
    assert uncertainty_of(small, "theory", "axis") == pytest.approx(1e-4 / 12.5e-6**0.5, rel=1e-12)
    assert uncertainty_of(small, "theory", "other") is None
    assert uncertainty_of(small, "scan", "axis") is None


# ------------------------------------------------------------------ the truth


def theory(**replaced: str) -> tuple[float, str | None]:
    import softmark
    from softmark.interpreter.study.robustness.reference_uncertainty import beam_theory_error

    text = """
param    W      = 20 mm
param    g      = 2.5 m/s^2
param    nu     = 0.3
material gel    = neo_hookean(young = 600 kPa, poisson = nu, density = 1000 kg/m^3)
body     beam   = solid(box(size = (200 mm, W, 20 mm)), gel)
support  wall   = fixed(beam, where = x <= 0 mm)
load     weight = gravity(g, direction = -z)
model    rod    = beam6dof(segments = 8)
reference line  = simo_reissner(beam)
probe    axis   = point(beam, at = (200, 10, 10) mm)
metric   eta    = relative_l2_error(axis, against = line)
"""
    return beam_theory_error(softmark.loads(text, **replaced).scene, "line")


def test_what_a_theory_of_beams_leaves_out() -> None:
    """L / H = 10 and w L^3 / (E I) = 1: 1.2 * 0.3^2 / 10 + 0.2 / 100 + 0.5 * (0.05 * 0.5)^2."""
    assert theory() == (pytest.approx(0.0108 + 0.002 + 0.5 * 0.025**2, rel=1e-9), None)
    assert theory(nu="0")[0] == pytest.approx(0.002 + 0.5 * 0.025**2, rel=1e-9), "a clamp that keeps nothing back"
    assert theory(W="100 mm")[0] > 0.1, "a plate is no beam"


def test_a_theory_ends_where_its_material_does() -> None:
    """At 100 times the load fibres are strained by 0.05 * sqrt(200) = 0.71: no soft solid is linear there."""
    assert "strains reach 0.71" in str(theory(g="250 m/s^2")[1])
    assert theory(g="25 m/s^2")[1] is None
