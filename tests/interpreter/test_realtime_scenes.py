"""The verdict on real time as reports of scenes give it: consistent with its numbers, and given of nothing unsolved.

No test here asserts how long anything took: rates are chosen so far out that no computer decides them.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import pytest

import softmark

BLOCK = """
material gel    = neo_hookean(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     block  = solid(box(size = (60, 20, 20) mm), gel)
support  wall   = fixed(block, where = x <= 0 mm)
load     weight = gravity(9.81 m/s^2)
model    cells  = fem(tet4, strain = corotational, size = 10 mm, mass = lumped)
probe    tip    = point(block, at = (60, 10, 10) mm)
metric   ever   = realtime_factor(rate = 0.001 Hz)
metric   never  = realtime_factor(rate = 1 GHz)
metric   eye    = realtime_factor(rate = 25 Hz)
"""
MOTION = "analysis motion = dynamic(duration = 200 ms, step = 20 ms)\n"


def metrics(text: str, **run: Any) -> dict[str, Any]:
    report = softmark.loads(text).run(**run)
    found: dict[str, Any] = json.loads(report.dumps())["models"]["cells"]["metrics"]
    return found


def test_at_rest_a_frame_is_one_solution() -> None:
    found = metrics(BLOCK, repeat=3)
    assert found["ever"]["verdict"] is True
    assert found["never"]["verdict"] is False
    for name, rate in (("ever", 1e-3), ("never", 1e9), ("eye", 25.0)):
        one = found[name]
        assert one["frames"] == 3
        assert one["limit_s"] == pytest.approx(1 / rate)
        assert one["value"] == pytest.approx(one["p99_s"] * rate)
        assert one["margin"] == pytest.approx(1 - one["value"])
        assert one["verdict"] is (one["value"] <= 1)
        assert "step_s" not in one
        assert "from rest" in one["basis"]


def test_in_motion_a_frame_is_a_step_and_its_limit_the_step() -> None:
    found = metrics(BLOCK + MOTION)
    for one in found.values():
        assert one["frames"] == 10
        assert one["step_s"] == one["limit_s"] == pytest.approx(0.02)
        assert one["value"] == pytest.approx(one["p99_s"] / 0.02)
        assert one["missed"] == 0 or one["worst_s"] > 0.02
    assert found["ever"]["verdict"] is (found["ever"]["value"] <= 1)


def test_a_step_longer_than_a_frame_is_no_real_time_however_fast() -> None:
    """dt <= 1 / F_c is asked for besides t <= dt: steps of 1000 s are computed in time, and shown too rarely."""
    motion = "analysis motion = dynamic(duration = 3000 s, step = 1000 s, damping_mass = 1 Hz)\n"
    found = metrics(BLOCK + motion)
    for name, slow in (("ever", False), ("eye", True), ("never", True)):
        assert found[name]["value"] < 1
        assert found[name]["verdict"] is not slow
        assert ("longer than a frame" in found[name]["verdict_reason"]) is slow
    assert "1000 s" in found["eye"]["verdict_reason"]


COLLAPSE = "support top = displaced(block, where = x >= 60 mm, by = (-59, 0, 0) mm)\n"
HASTY = "analysis motion = dynamic(duration = 100 ms, step = 50 ms, max_iterations = 1, tolerance = 1e-12)\n"


@pytest.mark.slow
@pytest.mark.parametrize("more", [COLLAPSE, HASTY], ids=["static", "dynamic"])
def test_what_is_not_solved_has_no_verdict(more: str) -> None:
    """St Venant-Kirchhoff material pressed flat has no stable state; one Newton iteration solves no nonlinear step."""
    text = BLOCK.replace("neo_hookean(", "st_venant_kirchhoff(").replace("corotational", "finite")
    report = softmark.loads(text + more).run()
    assert report.models["cells"].status == "not_converged"
    for metric in report.models["cells"].metrics.values():
        assert metric.value is None
        assert metric.reason
        assert "verdict" not in metric.to_json()


def test_a_capped_model_has_numbers_and_no_verdict() -> None:
    """One iteration a step is accepted where a scene asks for it: the motion is shown, its speed is not judged."""
    report = softmark.loads(BLOCK.replace("mass = lumped", "mass = lumped, max_iterations = 1") + MOTION).run()
    cells = report.models["cells"]
    assert cells.status == "capped"
    assert cells.probes["tip"].course is not None
    assert cells.solve["unsolved"] > 0
    for metric in cells.metrics.values():
        assert metric.value is None
        assert "not solved" in str(metric.reason)
    assert report.exit_status == 0


def test_references_have_no_frames() -> None:
    report = softmark.loads(RODS).run()
    data = json.loads(report.dumps())
    assert "frame" not in data["references"]["theory"]["metrics"]
    assert data["models"]["rod"]["metrics"]["frame"]["verdict"] is True


RODS = """
material gel    = neo_hookean(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     beam   = solid(cylinder(length = 100 mm, radius = 10 mm), gel)
support  wall   = fixed(beam, where = x <= 0 mm)
load     weight = gravity(9.81 m/s^2)
model    rod    = beam6dof(segments = 10)
reference theory = simo_reissner(beam)
probe    axis   = line(beam, from = (0, 0, 0) mm, to = (100, 0, 0) mm, points = 5)
metric   frame  = realtime_factor(rate = 0.001 Hz)
"""


@pytest.mark.parametrize("scene", ["silicone-beam-release"])
def test_the_released_beam(scene: str, report_of: Callable[[str], softmark.Report]) -> None:
    """1 kHz cannot be met by steps of 10 ms, whatever computes them; every solved model has a verdict for each rate."""
    report = report_of(scene)
    for name, model in report.models.items():
        capped = model.status == "capped"
        for metric, rate in (("eye", 25), ("hand", 300), ("touch", 1000)):
            found = model.metrics[metric].to_json()
            assert (found["value"] is None) is capped, name
            if capped:
                continue
            fast = found["value"] <= 1 and rate <= 100
            assert found["verdict"] is fast
        assert len(model.solve["times"]) == 200  # 201 states, of which a report keeps 200
