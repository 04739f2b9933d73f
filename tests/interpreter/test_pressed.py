"""Rigid bodies that a known force presses at rest: where they come to, against supports that take them there."""

from __future__ import annotations

import re
from typing import Any

import pytest

from softmark import loads
from softmark.interpreter.results.report import Report

AXIAL = """softmark 1
scene "a ball on a pad"
material gel   = neo_hookean(young = 25 kPa, poisson = 0.45, density = 1000 kg/m^3)
body     pad   = axisymmetric(quadrilateral((0, -12, 0) mm, (24, -12, 0) mm, (24, 0, 0) mm, (0, 0, 0) mm), gel)
body     ball  = rigid(sphere(radius = 8 mm, origin = (0, 9, 0) mm){mass})
support  table = fixed(pad, where = y <= -12 mm)
contact  touch = between(ball, pad, where = y >= 0 mm{friction})
analysis rest  = static(states = [25, 100, 60] %)
model    quads = fem({element}, strain = finite, size = 1.5 mm{formulation})
metric   push  = force(touch, along = -y)
"""
SOLID = """softmark 1
scene "a ball on a block"
material gel   = neo_hookean(young = 10 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     block = solid(box(size = (20, 20, 20) mm, origin = (0, 0, -20) mm), gel)
body     ball  = rigid(sphere(radius = 5 mm, origin = (11, 10, 5.5) mm))
support  table = fixed(block, where = z <= -20 mm)
support  guide = {guide}
contact  touch = between(ball, block{friction})
analysis rest  = static(states = [30, 100] %)
model    cubes = fem(hex8, strain = finite, size = 5 mm)
metric   push  = force(touch, along = -z)
"""
PRESSED = "load hand = point_force(ball, at = {at} mm, vector = {vector} mN, course = state)\n"
GUIDE = "fixed(ball, components = (x, y))"


def solved(text: str) -> Report:
    return loads(text).run()


def travels(report: Report, model: str, body: str = "ball") -> list[dict[str, Any]]:
    """What a report says of the rigid body in each state."""
    return [state.solve["rigid"][body] for state in report.models[model].each]


@pytest.mark.parametrize(
    "form",
    [
        {"element": "quad8"},
        pytest.param({"element": "quad4", "formulation": ", formulation = mean_dilatation"}, marks=pytest.mark.slow),
        pytest.param({"element": "quad4", "friction": ", friction = 0.5"}, marks=pytest.mark.slow),
    ],
)
def test_a_ball_goes_as_deep_as_a_support_takes_it_for_that_force(form: dict[str, str]) -> None:
    """Loading and unloading: the force of a ball that is displaced by what was found, to 1e-6."""
    text = AXIAL.format(**{"mass": "", "friction": "", "formulation": "", **form})
    report = solved(text + PRESSED.format(at="(0, 8, 0)", vector="(0, -34, 0)"))
    found = report.models["quads"]
    assert found.status == "converged", found.message
    ways = [own["travel_m"][1] for own in travels(report, "quads")]
    parts = [0.25, 1.0, 0.6]
    for own, part in zip(travels(report, "quads"), parts, strict=True):
        assert own["force_N"] == pytest.approx([0.0, -34e-3 * part, 0.0])
        assert own["stiffness_N_m"] > 0.0
    assert [s.metrics["push"].value for s in found.each] == pytest.approx([34e-3 * p for p in parts], rel=1e-7)
    for i, way in enumerate(ways[: 1 if form.get("friction") else 3]):
        hand = f"support hand = displaced(ball, by = (0, {1e3 * way:.17g}, 0) mm)\n"
        one = re.sub(r"static\(.*\)", "static()", text) + hand
        assert solved(one).models["quads"].metrics["push"].value == pytest.approx(34e-3 * parts[i], rel=1e-6)


@pytest.mark.slow
def test_force_and_travel_are_inverse_in_space() -> None:
    """Of a ball that is displaced, the force; pressed by that, it goes as far: to 1e-6."""
    hand = "displaced(ball, by = (0, 0, -1.5) mm)"
    driven = solved(re.sub(r"static\(.*\)", "static()", SOLID).format(guide=hand, friction=""))
    force = driven.models["cubes"].metrics["push"].value
    assert force is not None
    text = SOLID.format(guide=GUIDE, friction="")
    report = solved(text + PRESSED.format(at="(11, 10, 5)", vector=f"(3, 0, {-1e3 * force:.17g})"))
    assert report.models["cubes"].status == "converged", report.models["cubes"].message
    assert travels(report, "cubes")[-1]["travel_m"] == pytest.approx([0.0, 0.0, -1.5e-3], rel=1e-6)
    checks = report.models["cubes"].solve["checks"]
    assert checks["pressed"]["residual"] < 1e-7
