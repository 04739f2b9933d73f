"""Rigid bodies that a known force presses at rest: where they come to, against supports that take them there."""

from __future__ import annotations

import re
from typing import Any

import pytest

from softmark import loads
from softmark.interpreter.models.shared import force_driven_rigid_bodies
from softmark.interpreter.problem.body_case import RigidBodyContact
from softmark.interpreter.results.run_report import Report

AXIAL = """softmark 1
scene "a ball on a pad"
material gel   = neo_hookean(young = 25 kPa, poisson = 0.45, density = 1000 kg/m^3)
body     pad   = axisymmetric(quadrilateral((0, -12, 0) mm, (24, -12, 0) mm, (24, 0, 0) mm, (0, 0, 0) mm), gel)
body     ball  = rigid(sphere(radius = 8 mm, origin = (0, 9, 0) mm){mass})
support  table = fixed(pad, where = y <= -12 mm)
contact  touch = rigid_contact(ball, pad, where = y >= 0 mm{friction})
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
contact  touch = rigid_contact(ball, block{friction})
analysis rest  = static(states = [30, 100] %)
model    cubes = fem(hex8, strain = finite, size = 5 mm)
metric   push  = force(touch, along = -z)
"""
PRESSED = "load hand = point_force(ball, at = {at} mm, vector = {vector} mN, amplitude = per_state)\n"
GUIDE = "fixed(ball, components = (x, y))"


def solved(text: str) -> Report:
    return loads(text).run()


def travels(report: Report, model: str, body: str = "ball") -> list[dict[str, Any]]:
    """What a report says of the rigid body in each state."""
    return [state.solve["rigid"][body] for state in report.models[model].each]


@pytest.mark.parametrize(
    "form",
    [
        pytest.param({"element": "quad8"}, marks=pytest.mark.slow),
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
        assert "gave_way" not in own
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


@pytest.mark.parametrize("where", [("11, 10, 5.5", "3"), ("-8, 10, 5.5", "-3")])
def test_what_nothing_stops_is_no_answer(where: tuple[str, str]) -> None:
    """Away from the block, and past it: refused at once, with the way that it goes on."""
    at, force = where
    text = SOLID.format(guide=GUIDE, friction="").replace("origin = (11, 10, 5.5)", f"origin = ({at})")
    text = (
        re.sub(r"static\(.*\)", "static()", text)
        + f"load hand = point_force(ball, at = ({at}) mm, vector = (0, 0, {force}) mN)\n"
    )
    found = solved(text).models["cubes"]
    assert found.status == "not_converged"
    assert "nothing stops the rigid body: it moves on along" in str(found.message)


def test_a_force_that_is_wrong_by_a_thousandth_is_found_by_other_formulas(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is borne is held against the loads of the scene, read once more."""
    right = force_driven_rigid_bodies.driving_force

    def wrong(touch: RigidBodyContact) -> float:
        return 1.001 * right(touch)

    monkeypatch.setattr(force_driven_rigid_bodies, "driving_force", wrong)
    text = re.sub(r"static\(.*\)", "static()", SOLID).format(guide=GUIDE, friction="")
    found = solved(text + PRESSED.format(at="(11, 10, 5)", vector="(0, 0, -20)").replace(", amplitude = per_state", ""))
    assert found.models["cubes"].status == "failed"
    assert "the contact forces on `ball` do not balance its loads: 1.0e-03" in str(found.models["cubes"].message)


@pytest.mark.slow
@pytest.mark.long
def test_weight_and_forces_add_up_and_friction_goes_from_state_to_state() -> None:
    """A ball of 1 g that is dragged aside while 5 mN press it: the force along z is both, to the tolerance."""
    text = SOLID.format(guide="fixed(ball, components = y)", friction=", friction = 0.3")
    text = text.replace("10, 5.5) mm))", "10, 5.5) mm), mass = 1 g)")
    text += "support drag = displaced(ball, by = (0.5, 0, 0) mm, components = x, amplitude = per_state)\n"
    text += (
        "load weight = gravity(9.81 m/s^2)\n"
        + "load hand = point_force(ball, at = (11, 10, 5) mm, vector = (0, 0, -5) mN)\n"
    )
    report = solved(text)
    found = report.models["cubes"]
    assert found.status == "converged", found.message
    for state in found.each:
        assert state.metrics["push"].value == pytest.approx(9.81e-3 + 5e-3, rel=1e-7)
        assert state.solve["checks"]["pressed"]["residual"] < 1e-7


@pytest.mark.slow
@pytest.mark.long
def test_a_slice_is_pressed_in_its_plane_and_a_force_that_goes_lets_it_go() -> None:
    """A rod on a strip in plane strain; at no force it touches nothing any more."""
    text = """softmark 1
scene "a rod on a strip"
material gel   = neo_hookean(young = 10 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     strip = plane_strain(
    quadrilateral((0, -20, 0) mm, (20, -20, 0) mm, (20, 0, 0) mm, (0, 0, 0) mm), gel, thickness = 5 mm)
body     rod   = rigid(cylinder(length = 10 mm, radius = 5 mm, axis = +z, origin = (10, 6, -5) mm))
support  floor = fixed(strip, where = y <= -20 mm)
support  guide = fixed(rod, components = x)
support  side  = displaced(strip, where = y <= -20 mm, by = (0, 0.1, 0) mm)
load     hand  = point_force(rod, at = (10, 6, 0) mm, vector = (0, -20, 0) mN, amplitude = per_state)
contact  touch = rigid_contact(rod, strip, where = y >= 0 mm)
analysis rest  = static(states = [100, 0] %)
model    quads = fem(quad4, size = 4 mm, strain = finite)
metric   push  = force(touch, along = -y)
"""
    text = text.replace("support  floor = fixed(strip, where = y <= -20 mm)\n", "")
    found = solved(text).models["quads"]
    assert [state.status for state in found.each] == ["converged"] * 2
    assert found.each[0].metrics["push"].value == pytest.approx(20e-3, rel=1e-7)
    assert found.each[1].metrics["push"].value == 0.0


@pytest.mark.long
@pytest.mark.slow
def test_a_dome_that_snaps_is_said_to_have_given_way() -> None:
    """It bears 0.147 N at most before it turns over (W314), and more in the end, where it is stable again."""
    text = """softmark 1
scene "a shallow dome"
material gel   = neo_hookean(young = 10 MPa, poisson = 0.3, density = 1000 kg/m^3)
body     dome  = axisymmetric(quadrilateral((0, 5, 0) mm, (50, 0, 0) mm, (50, 1, 0) mm, (0, 6, 0) mm), gel)
body     ball  = rigid(sphere(radius = 8 mm, origin = (0, 14.01, 0) mm))
support  rim   = fixed(dome, where = x >= 50 mm)
load     hand  = point_force(ball, at = (0, 14, 0) mm, vector = (0, -0.2, 0) N, amplitude = per_state)
contact  touch = rigid_contact(ball, dome, where = y >= 1 mm)
analysis rest  = static(states = [50, 100] %)
model    quads = fem(quad8, strain = finite, size = 1 mm)
metric   push  = force(touch, along = -y)
"""
    report = solved(text)
    before, after = report.models["quads"].each
    assert "gave_way" not in before.solve["rigid"]["ball"]
    assert after.solve["rigid"]["ball"]["gave_way"] is True
    assert after.solve["rigid"]["ball"]["stiffness_N_m"] > 0.0
    assert any(d.code == "W314" and "could not resist" in d.message for d in report.warnings)
