"""Beams in dynamic analyses as scenes ask for them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import softmark
from softmark.interpreter.pipeline.run_pipeline import RunOptions
from softmark.interpreter.pipeline.run_pipeline import run_scene as run_of
from softmark.scenes import ROOT

BAR = """
material gum = linear_elastic(young = 1.8 MPa, poisson = 0.3, density = 1000 kg/m^3)
body     bar = solid(box(size = (200, 6, 6) mm, origin = (0, -3, -3) mm), gum)
probe    axis = line(bar, from = (0, 0, 0) mm, to = (200, 0, 0) mm, points = 5)
metric   down = displacement(axis, along = -z)
"""
CLAMP = "support wall = fixed(bar, where = x <= 0 mm)\n"
WEIGHT = "load weight = gravity(9.81 m/s^2, direction = -z)\n"
ROD = "model rod = beam6dof(segments = {segments})\n"
BEAMS = ROOT / "beams"


def motion(duration: str, step: str, more: str = "") -> str:
    return f"analysis motion = dynamic(duration = {duration}, step = {step}{more})\n"


def run(text: str) -> softmark.Report:
    report = softmark.loads(BAR + text).run()
    assert {m.status for m in report.models.values()} == {"converged"}
    return report


def course(report: softmark.Report, model: str = "rod", probe: str = "axis") -> tuple[np.ndarray, np.ndarray]:
    seen = report.models[model].probes[probe]
    assert seen.times is not None
    assert seen.course is not None
    return seen.times, seen.course


# PyElastica 0.3: where the tip of the bar of `swinging-beam` is, mm, extrapolated from 80 and 160 elements; their own
# extrapolation from 40 and 80 lies 0.02 mm beside
PYELASTICA = {0.1: (180.790, 44.406, -64.964), 0.2: (43.007, 92.058, -152.891), 0.3: (-58.114, 65.409, -129.369)}


@pytest.mark.long
@pytest.mark.parametrize("_", ["swinging-beam"])
def test_a_swing_in_three_dimensions_is_that_of_another_program(
    _: str, report_of: Callable[[Path], softmark.Report]
) -> None:
    """At three times on the way, to 0.4 mm: 0.15 % of it, and what thinning sections make of 0.3 % of stretch."""
    times, found = course(report_of(BEAMS / "swinging-beam.scene"), "fine", "tip")
    for time, place in PYELASTICA.items():
        tip = found[np.argmin(np.abs(times - time)), 0] * 1e3 + [200.0, 0.0, 0.0]
        np.testing.assert_allclose(tip, place, atol=0.4)


@pytest.mark.long
@pytest.mark.slow
def test_a_swing_in_three_dimensions_is_that_of_a_solid() -> None:
    """Elements of second order over the section, corotational: to 0.5 % of the motion, all of it. Where the bar is
    clamped the solid cannot thin, and it is 33 times as long as thick."""
    text = CLAMP + WEIGHT + "load aside = point_force(bar, at = (200, 0, 0) mm, vector = (0, 15, 0) mN)\n"
    text += motion("0.2 s", "4 ms", ", integrator = midpoint") + ROD.format(segments=40)
    text += "model solid = fem(hex20, strain = corotational, size = 6 mm)\n"
    text += "metric apart = trajectory_error(axis, against = solid)\n"
    value = run(text).models["rod"].metrics["apart"].value
    assert value is not None
    assert value < 0.005


@pytest.mark.long
@pytest.mark.slow
def test_it_comes_to_rest_where_the_static_analysis_is() -> None:
    """Damped all but critically, to exp(-11) of the fall, 0.15 m: the same to 0.01 mm."""
    damped = ", damping_mass = 12 Hz, integrator = bdf2, tolerance = 1e-9"
    moved = run(CLAMP + WEIGHT + ROD.format(segments=8) + motion("2 s", "40 ms", damped))
    still = run(CLAMP + WEIGHT + ROD.format(segments=8))
    end, rest = moved.models["rod"].probes["axis"], still.models["rod"].probes["axis"]
    np.testing.assert_allclose(end.displacement, rest.displacement, atol=1e-5)


@pytest.mark.slow
def test_a_free_bar_flies_on_and_turns_about_its_centre() -> None:
    """Thrown at 1 m/s and 5 rad/s: its centre moves on, its ends turn by 0.5 rad about it. At rest in the turning frame
    each would be w^2 rho L^3 / 24 E = 5 um farther out; let go at once they swing to twice that, and
    a little more with as few segments."""
    thrown = ", integrator = midpoint, velocity = (1, 0, 0) m/s, spin = (0, 0, 5) rad/s"
    times, found = course(run(ROD.format(segments=4) + motion("0.1 s", "1 ms", thrown)))
    X = np.linspace([0.0, 0, 0], [0.2, 0, 0], 5)
    x = X + found
    np.testing.assert_allclose(x[:, 2], [[0.1 + t, 0.0, 0.0] for t in times], atol=1e-12)
    angle = np.array([5.0 * t for t in times])
    away = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    np.testing.assert_allclose(x[:, 4] - x[:, 2], 0.1 * away, atol=1.3e-5)


@pytest.mark.slow
@pytest.mark.long
def test_a_clamp_that_moves_takes_the_bar_along() -> None:
    """Raised by 20 mm in 1 s, which is slow, by damped steps: at the end all of it has moved as far, to 0.1 mm."""
    lifted = "support lift = displaced(bar, where = x <= 0 mm, by = (0, 0, 20) mm, amplitude = ramp(over = 1 s))\n"
    damped = ", damping_mass = 12 Hz, integrator = generalized_alpha"
    report = run(lifted + ROD.format(segments=6) + motion("3 s", "50 ms", damped))
    last = course(report)[1][-1]
    np.testing.assert_allclose(last, np.tile([0.0, 0.0, 0.02], (5, 1)), atol=1e-4)


@pytest.mark.slow
def test_what_turns_sections_comes_to_rest_where_the_static_analysis_is() -> None:
    """A torque on the end, a force on an arm and a clamp that turns, each on its course, and damped as above."""
    acting = """support grip = rotated(bar, where = x <= 0 mm, axis = (1, 2, 2), angle = 50 deg{ramp})
load twist = torque(bar, where = x >= 200 mm, moment = (2, 1, -2) N*mm{ramp})
load arm = point_force(bar, at = (200, 3, 3) mm, vector = (10, -10, 15) mN{ramp})
""" + ROD.format(segments=6)
    damped = ", damping_mass = 12 Hz, integrator = bdf2, tolerance = 1e-9"
    moved = run(acting.format(ramp=", amplitude = ramp(over = 0.3 s)") + motion("3 s", "60 ms", damped))
    still = run(acting.format(ramp=""))
    end, rest = moved.models["rod"].probes["axis"], still.models["rod"].probes["axis"]
    assert np.abs(rest.displacement).max() > 0.05
    np.testing.assert_allclose(end.displacement, rest.displacement, atol=1e-5)


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize("integrator", ["midpoint", "generalized_alpha"])
def test_a_clamp_that_turns_takes_the_bar_around_more_than_once(integrator: str) -> None:
    """By 400 degrees about an axis beside it, slowly: the clamp is on its circle to rounding whatever the steps.

    The bar behind it lags by what its inertia bends it, by 2 mm of the 1.4 m that its end goes.
    """
    turned = "support grip = rotated(bar, where = x <= 0 mm, axis = +z, through = (0, -20, 0) mm, angle = 400 deg, "
    turned += "amplitude = smooth(over = 8 s))\n"
    damped = f", damping_mass = 5 Hz, integrator = {integrator}"
    report = run(turned + ROD.format(segments=4) + motion("8 s", "0.1 s", damped))
    last, X = course(report)[1][-1], np.linspace([0.0, 20e-3, 0], [0.2, 20e-3, 0], 5)
    a = np.radians(400.0)
    on = X @ np.array([[np.cos(a), np.sin(a), 0], [-np.sin(a), np.cos(a), 0], [0, 0, 1.0]]) - X
    np.testing.assert_allclose(last[0], on[0], atol=1e-12)
    np.testing.assert_allclose(last, on, atol=2e-3)


@pytest.mark.slow
def test_it_states_its_error_and_warns_of_long_steps() -> None:
    """Asked for, the parts of the error are those of segments, steps and theory; three steps a period are few."""
    text = BAR + CLAMP + WEIGHT + ROD.format(segments=8)
    scene: Any = softmark.loads(text + motion("40 ms", "2 ms", ", integrator = midpoint"))
    stated = run_of(scene.scene, list(scene.warnings), RunOptions(draw=False, stated=())).models["rod"].stated["down"]
    assert {"discretisation", "model", "time"} <= set(stated.parts)
    report = run(CLAMP + WEIGHT + ROD.format(segments=8) + motion("1 s", "300 ms", ", integrator = implicit_euler"))
    assert "W362" in {w.code for w in report.warnings}
