"""What contacts do over time: forces against exact solutions and the balance of momentum, and what they state."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import softmark
from softmark import loads
from softmark.interpreter.pipeline.run_pipeline import RunOptions, run_scene

SCENES = Path(__file__).parents[2] / "stdlib-scenes" / "contact"

BAR = """softmark 1
scene "a bar on a wall"
material rod   = linear_elastic(young = 1 MPa, poisson = 0, density = 1000 kg/m^3)
body     bar   = solid(box(size = (10, 10, 40) mm, origin = (0, 0, 0.1) mm), rod)
body     wall  = rigid(half_space(normal = (0, 0, 1)))
contact  hit   = rigid_contact(wall, bar)
analysis fly   = dynamic(duration = {end} ms, step = 0.1 ms, velocity = (0, 0, -0.1) m/s, integrator = {integrator})
model    hexes = fem(hex8, size = {size} mm, strain = small)
metric   push  = force(hit, along = +z)
metric   most  = force(hit, along = +z, over = largest)
metric   mean  = force(hit, along = +z, over = mean)
metric   turn  = moment(hit, along = +x, about = (0, 0, 0) mm)
metric   wide  = contact_area(hit)
metric   press = contact_pressure(hit)
metric   spot  = contact_pressure(hit, at = (5, 5, 0.1) mm)
metric   near  = gap(hit, over = least)
"""
PLATEAU = 1000.0 * np.sqrt(1e6 / 1000.0) * 0.1 * 1e-4  # rho c v A, N
MASS, STAYS = 1000.0 * 4e-6, 2.0 * 0.04 / np.sqrt(1e6 / 1000.0)  # kg, 2 L / c

REST = """softmark 1
scene "a block comes to lie on a floor"
material gel   = linear_elastic(young = 100 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     block = solid(box(size = (20, 20, 20) mm, origin = (0, 0, 0.1) mm), gel)
body     wall  = rigid(half_space(normal = (0, 0, 1)))
contact  hit   = rigid_contact(wall, block)
load     sag   = gravity(9.81 m/s^2)
analysis fall  = dynamic(duration = 200 ms, step = {step}, integrator = {integrator}, damping_mass = 100 / (1 s))
model    hexes = fem(hex8, size = {size} mm, strain = corotational)
metric   push  = force(hit, along = +z)
"""
WEIGHT = 1000.0 * 8e-6 * 9.81


def curve(metric: Any) -> tuple[Any, Any]:
    """Times and values of a metric in motion."""
    assert metric.curve is not None
    return metric.curve.x, metric.curve.y


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize(
    "integrator", ["trapezoidal", *(pytest.param(i, marks=pytest.mark.slow) for i in ("generalized_alpha", "bdf2"))]
)
def test_a_wall_presses_with_rho_c_v_for_the_time_of_a_wave_there_and_back(integrator: str) -> None:
    """Mean over the middle of the contact to 1 %, of bdf2, which damps, to 3 %; it lasts 2 L / c to two steps.

    The impulse of the curve is what momentum has changed by, mass times velocities before and after, to 1e-6: the
    tolerance of steps, 1e-6 of their largest forces.
    """
    model = loads(BAR.format(end=4, size=5, integrator=integrator)).run().models["hexes"]
    t, F = curve(model.metrics["push"])
    inside = (t > 0.2 * STAYS + 1e-3) & (t < 0.8 * STAYS + 1e-3)
    assert F[inside].mean() == pytest.approx(PLATEAU, rel=0.03 if integrator == "bdf2" else 0.01)
    on = t[0.5 * PLATEAU < F]
    assert on[-1] - on[0] == pytest.approx(STAYS, abs=2.5e-4)
    (bounce,) = model.solve["impacts"]
    gained = MASS * (bounce["after_m_s"][2] - bounce["before_m_s"][2])
    assert np.trapezoid(F, t) == pytest.approx(gained, rel=1e-6)
    told = model.solve["momentum"]
    assert told["contacts_Ns"][2] == pytest.approx(gained, rel=1e-6)
    assert told["off"] < 1e-6
    assert model.metrics["mean"].value == pytest.approx(gained / 4e-3, rel=1e-3)
    assert model.metrics["most"].value == pytest.approx(F.max())
    assert model.metrics["push"].details["largest_in_time_N"] == pytest.approx(F.max())
    assert 0.0 < model.metrics["near"].value < 1e-5  # the barrier begins at 1e-5 of the size


@pytest.mark.slow
@pytest.mark.long
def test_moment_area_and_pressure_are_those_of_the_force() -> None:
    """Of an even pressure over the end, half a wave into the contact: to what a wave of a coarse mesh leaves, 3 %."""
    report = loads(BAR.format(end=2, size=10, integrator="trapezoidal") + "expect hexes.push.at(1.8 ms) > 0 N\n").run()
    found = {name: metric.value for name, metric in report.models["hexes"].metrics.items()}
    assert found["push"] == pytest.approx(PLATEAU, rel=0.03)
    assert found["turn"] == pytest.approx(0.005 * found["push"], rel=1e-6)
    assert found["wide"] == pytest.approx(1e-4, rel=1e-3)
    assert found["press"] == pytest.approx(PLATEAU / 1e-4, rel=0.03)
    assert found["spot"] == pytest.approx(found["push"] / 1e-4, rel=0.03)
    (judged,) = report.expectations
    t, F = curve(report.models["hexes"].metrics["push"])
    assert judged.passed
    assert judged.value == pytest.approx(np.interp(1.8e-3, t, F))


@pytest.mark.slow
@pytest.mark.long
def test_the_page_and_the_file_have_the_curve(tmp_path: Path, report_of: Callable[[Path], softmark.Report]) -> None:
    """As a chart with its numbers, and as lists in SI."""
    from softmark.interpreter.report.run.report_page import render

    file = tmp_path / "bar.scene"
    file.write_text(BAR.format(end=2, size=10, integrator="trapezoidal"), encoding="utf-8")
    report = report_of(file)
    page = render(report)
    assert "push, force over time" in page
    assert 'download="push-over-time.csv"' in page
    assert ">x / ms</th>" in page
    told = json.loads(report.dumps())["models"]["hexes"]["metrics"]["push"]["curve"]
    assert told["units"] == ["s", "N"]
    assert len(told["x"]) == len(told["y"]) == 21


HELD = """softmark 1
scene "a ball is pressed on a block that lies on a floor"
material gel   = linear_elastic(young = 10 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     block = solid(box(size = (10, 10, 5) mm), gel)
body     ball  = rigid(sphere(radius = 8 mm, origin = (5, 5, 13.2) mm))
body     under = rigid(half_space(normal = (0, 0, 1), origin = (0, 0, -0.05) mm))
support  hand  = displaced(ball, by = (0.5, 0, -0.6) mm, amplitude = ramp(over = 5 ms))
contact  touch = rigid_contact(ball, block, where = z >= 5 mm, friction = 0.1)
contact  lies  = rigid_contact(under, block, where = z <= 0 mm, friction = 0.2)
analysis press = dynamic(duration = 5 ms, step = 1 ms)
model    hexes = fem(hex8, size = 5 mm, strain = small)
metric   turn  = moment(touch, along = +y, over = largest)
metric   push  = force(touch, along = -z, over = largest)
metric   area  = contact_area(touch)
"""


@pytest.mark.slow
@pytest.mark.long
def test_one_point_is_no_area_in_a_motion_either() -> None:
    """Said of its end, as at rest; and a ball on one point turns nothing about what it presses on, whenever it came."""
    scene = loads(HELD)
    report = run_scene(scene.scene, list(scene.warnings), RunOptions(draw=False))
    found = {name: metric.value for name, metric in report.models["hexes"].metrics.items()}
    assert abs(found["turn"]) < 1e-6 * found["push"] * 5e-3
    assert [warning.code for warning in report.warnings].count("W660") == 1


@pytest.mark.slow
def test_what_a_free_plate_loses_its_contact_has() -> None:
    """m (v1 - v0) + m g t of the plate is what the contact gave to the column, to 1e-6; the curve has that to 1 %, by
    the last of its 15 steps, and what the floor gave has gone from one to the other."""
    text = (SCENES / "plate-on-a-column.scene").read_text("utf-8")
    text = text.replace("duration = 11.8 ms", "duration = 3 ms") + "metric push = force(hit, along = -z)\n"
    model = loads(text.replace("expect", "# ")).run().models["hexes"]
    (t, F), plate = curve(model.metrics["push"]), model.solve["rigid"]["plate"]
    v = np.array(plate["velocity_m_s"])[:, 2]
    told = model.solve["momentum"]
    assert 0.1 * (v[-1] - v[0]) + 0.1 * 9.81 * t[-1] == pytest.approx(-told["contacts_Ns"][2], rel=1e-6)
    assert np.trapezoid(F, t) == pytest.approx(-told["contacts_Ns"][2], rel=0.01)
    assert told["supports_Ns"][2] == pytest.approx(-told["contacts_Ns"][2], rel=0.05)
    assert told["off"] < 1e-6


@pytest.mark.long
@pytest.mark.slow
def test_friction_of_a_block_that_slides() -> None:
    """After it has hopped the floor pulls at it with mu N, to 1e-6 at every step; its slip is its way; nothing sticks.

    In the mean it presses with the weight, to 1 %, as it stays where it is.
    """
    text = (SCENES / "sliding-block.scene").read_text("utf-8")
    text = text.replace("duration = 80 ms", "duration = 40 ms").replace("expect", "# ")
    text += "metric far = slip(rub)\nmetric holds = stick_area(rub)\n"
    model = loads(text).run().models["cubes"]
    (t, N), (_, T) = curve(model.metrics["push"]), curve(model.metrics["drag"])
    late = t > 10e-3
    assert T[late] == pytest.approx(0.3 * N[late], rel=1e-6)
    assert N[late].mean() == pytest.approx(1e-3 * 9.81, rel=0.01)
    assert model.metrics["far"].value == pytest.approx(model.metrics["way"].value, rel=0.02)
    assert model.metrics["holds"].value == 0.0


@pytest.mark.slow
@pytest.mark.parametrize(("integrator", "off"), [("implicit_euler", 1e-6), ("trapezoidal", 0.02)])
def test_a_block_that_has_come_to_rest_presses_with_its_weight(integrator: str, off: float) -> None:
    """Nodes of the trapezoidal rule turn their velocities round at each step: forces are told without that.

    To 2 %, by which it still vibrates at the end; of implicit Euler, which has ended that, to 1e-6.
    """
    model = loads(REST.format(step="2 ms", size=10, integrator=integrator)).run().models["hexes"]
    t, F = curve(model.metrics["push"])
    assert F[t > 0.19] == pytest.approx(WEIGHT, rel=off)
    assert model.solve["momentum"]["off"] < 1e-5


@pytest.mark.slow
@pytest.mark.parametrize(
    ("integrator", "most"), [("trapezoidal", 0.1), ("generalized_alpha", 0.1), ("implicit_euler", 0.01)]
)
def test_the_error_that_is_stated_of_a_resting_weight_holds_it(integrator: str, most: float) -> None:
    """The weight lies within what is stated, which is no more than a tenth of it."""
    scene = loads(REST.format(step="1 ms", size=5, integrator=integrator))
    model = run_scene(scene.scene, list(scene.warnings), RunOptions(draw=False, stated=())).models["hexes"]
    stated, value = model.stated["push"], model.metrics["push"].value
    assert stated.value is not None
    assert abs(value - WEIGHT) <= stated.value <= most * WEIGHT


@pytest.mark.slow
@pytest.mark.long
def test_an_even_pressure_has_no_moment_about_its_middle() -> None:
    """Not when it begins and ends either: a meter beside the origin, to rounding of force times that arm."""
    text = BAR.format(end=3, size=10, integrator="bdf2").replace("size = (10, 10, 40)", "size = (10, 10, 10)")
    text = text.replace("(0, 0, 0.1) mm", "(1000, 0, 0.1) mm").replace("(5, 5, 0.1)", "(1005, 5, 0.1)")
    text += "metric tilt = moment(hit, along = +y, over = largest)\nmetric round = moment(hit, along = +y)\n"
    model = loads(text.replace("duration = 3 ms", "duration = 2.5 ms")).run().models["hexes"]
    assert curve(model.metrics["push"])[1][-1] == 0.0  # it has gone
    assert model.metrics["most"].value > 0.2
    assert np.abs(curve(model.metrics["round"])[1]).max() < 1e-12
    assert abs(model.metrics["tilt"].value) < 1e-12


LEANING = """softmark 1
scene "a block slides along a floor and a rougher wall"
material gel   = linear_elastic(young = 500 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     block = solid(box(size = (10, 10, 10) mm), gel)
body     floor = rigid(half_space(normal = (0, 0, 1)))
body     wall  = rigid(half_space(normal = (0, 1, 0)))
body     back  = rigid(half_space(normal = (1, 0, 0)))
contact  even  = rigid_contact(back, block)
contact  lies  = rigid_contact(floor, block, friction = 0.1)
contact  leans = rigid_contact(wall, block, friction = 0.3)
load     sag   = gravity(9.81 m/s^2)
load     side  = gravity(5 m/s^2, direction = (0, -1, 0))
analysis slide = dynamic(duration = 3 ms, step = 0.5 ms, velocity = (0.2, 0, 0) m/s, damping_stiffness = 0.1 ms)
model    hexes = fem(hex8, size = 10 mm, strain = small)
metric   press = force(leans, along = +y)
"""


def test_each_contact_has_the_heat_of_its_own_friction() -> None:
    """Both together make the heat of the body in the last step, to rounding, and a smooth contact makes none."""
    model = loads(LEANING).run().models["hexes"]
    found = {name: seen.touch.rubbing for name, seen in model.contacts.items()}
    assert found["even"] is None
    heat = model.solve["energies"]["friction"]
    assert found["lies"].work + found["leans"].work == pytest.approx(heat[-1] - heat[-2], rel=1e-9)
    assert min(found["lies"].work, found["leans"].work) > 0.0
    for name, told in model.solve["friction"].items():
        assert found[name].slip == pytest.approx(told["slip_m"][-1])
