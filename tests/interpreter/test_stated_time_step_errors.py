"""Stated time-step errors of viscoelastic bars contain the true ones, and are at most three times as large."""

from __future__ import annotations

import math
from typing import Any

import pytest

import softmark
from softmark.interpreter.problem.body_case import case_of
from softmark.interpreter.verification.motion_errors import has_fading_vibrations

FACTOR = 3.0  # largest ratio of stated and true error
BAR = """
body b = solid(box(size = (20, 10, 10) mm), foam)
support foot = fixed(b, where = x <= 0 mm, components = x)
support back = fixed(b, where = y <= 0 mm, components = y)
support under = fixed(b, where = z <= 0 mm, components = z)
load weight = traction(b, where = x >= 20 mm, vector = (1, 0, 0) Pa)
model m = fem(hex8, strain = small, size = 20 mm)
probe end = point(b, at = (20, 10, 10) mm)
metric far = displacement(end, along = +x)
"""
CREEP = """
material foam = viscoelastic(
    linear_elastic(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3), g = [0.5], tau = [2] s, of = whole
)
analysis time = quasistatic(duration = 5 s, step = {step} s{times})
"""
ZENER = """
material foam = viscoelastic(
    linear_elastic(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3), g = [0.5], tau = [2] ms, of = whole
)
analysis swing = dynamic(duration = 40 ms, step = {step} ms, integrator = trapezoidal)
"""


def model_of(text: str, stated: bool) -> Any:
    return softmark.loads(text + BAR).run(stated=stated).models["m"]


@pytest.mark.parametrize("times", ["", ", times = [0.5, 1, 5] s"])
@pytest.mark.parametrize("step", [0.5, 0.25, 0.1])
def test_the_time_step_error_of_creep_holds_with_outputs_closer_than_the_step(step: float, times: str) -> None:
    """Zener's solid creeps as u = p L / E (2 - exp(-t / 2 tau)), the inverse Laplace transform of 1 / (s E(s)).

    By default there are 20 outputs, here every 0.25 s: with the half of a step of 0.5 s nothing changed, and an error
    of 1e-11 was stated.
    """
    model = model_of(CREEP.format(step=step, times=times), stated=True)
    truth = 1.0 / 60e3 * 0.02 * (2.0 - math.exp(-5.0 / 4.0))
    off = abs(model.metrics["far"].value - truth)
    assert off < model.stated["far"].value < FACTOR * off


@pytest.mark.slow
def test_the_time_step_error_of_a_damped_vibration_is_not_that_of_an_elastic_one() -> None:
    """The truth is the same mesh with an eighth of the step: the remaining 1/64 of the error is neglected.

    Modes of the elastic body, which do not fade, gave 60 times the error of a Zener bar.
    """
    model = model_of(ZENER.format(step=0.5), stated=True)
    fine = model_of(ZENER.format(step=0.0625), stated=False)
    off = abs(model.metrics["far"].value - fine.metrics["far"].value)
    assert off <= model.stated["far"].parts["time"] < FACTOR * off


@pytest.mark.parametrize(("g", "tau", "faded"), [(0.5, "2", True), (0.01, "1e5", False), (0.5, "500", False)])
def test_vibrations_fade_if_the_series_damps_them_within_the_analysis(g: float, tau: str, faded: bool) -> None:
    """A free vibration of a Maxwell chain decays as exp(-g t / (2 tau)) if it is fast; 5 % are exp(-3), in 40 ms."""
    text = ZENER.format(step=0.5).replace("g = [0.5], tau = [2] ms", f"g = [{g}], tau = [{tau}] ms")
    assert has_fading_vibrations(case_of(softmark.loads(text + BAR).scene, "b")) is faded
