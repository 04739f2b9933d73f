"""Beams of bodies that taper: what members of networks that taper are, in every load, at rest and in motion."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import softmark
from softmark.interpreter.language.coordinate_conditions import Condition
from softmark.interpreter.problem.cross_section_coverage import coverage, single_selected_end
from softmark.solvers.mesh.cross_sections import Disc, Rectangle
from softmark.solvers.mesh.extruded_shapes import Extruded
from softmark.solvers.mesh.revolved_bodies import Cone

HEAD = """softmark 1
scene "tapers"
material gum = linear_elastic(young = 1 MPa, poisson = 0.3, density = 1000 kg/m^3)
"""
HORN = "body pole = solid(cone(length = 1 m, radius = 20 mm, end = 10 mm), gum)\n"
MEMBER = "body pole = network([(0, 0, 0), (1, 0, 0)] m, [(1, 2)], gum, radius = 20 mm, end_radius = 10 mm)\n"
WALL = "support wall = fixed(pole, where = x <= 0 m)\n"
PROBES = """probe tip = point(pole, at = (1, 0, 0) m)
probe rim = point(pole, at = (1, 0, 0.01) m)
metric ux = displacement(tip, along = +x)
metric uy = displacement(rim, along = +y)
metric uz = displacement(tip, along = +z)
"""
LOADS = """load weight = gravity(20 mm/s^2)
load push = point_force(pole, at = (0.6, 0, 0) m, vector = (1, 2, -1) mN)
load line = line_load(pole, from = (0.2, 0, 0) m, to = (0.9, 0, 0) m, vector = (0, 1, 0) mN/m)
"""


def run(text: str) -> Any:
    """The model `m`, whose forces balance by other formulas too."""
    model = softmark.loads(HEAD + text).run().models["m"]
    assert model.status == "converged", model.message
    checks = model.solve["checks"]
    if "reactions" in checks:
        assert checks["residual"] is not None
        assert max(checks["reactions"][name] for name in ("force", "moment")) < 1e-8
        assert checks["reactions"]["apart"] < 1e-6
    return model


def both(loads: str, more: str = "") -> tuple[Any, Any]:
    """As a cone, and as a member of a network."""
    horn = run(HORN + WALL + loads + PROBES + "model m = beam6dof(segments = 12)\n" + more)
    member = run(MEMBER + WALL + loads + PROBES + "model m = frame6dof(segments = 12)\n" + more)
    return horn, member


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("loads", [LOADS, "load turn = torque(pole, where = x >= 1 m, moment = (1, 0, 3) uN*m)\n"])
def test_a_cone_is_a_member_that_tapers(loads: str) -> None:
    """Bent far by its weight, a force and a line, and twisted: to the tolerance of both, 1e-8."""
    horn, member = both(loads)
    for name in ("ux", "uy", "uz"):
        assert horn.metrics[name].value == pytest.approx(member.metrics[name].value, rel=1e-7, abs=1e-12)


def test_its_tones_are_those_of_a_member() -> None:
    horn, member = both("load weight = gravity(20 mm/s^2)\n", "metric tones = frequency(pole, mode = 5)\n")
    found, other = (model.metrics["tones"].details["frequencies_Hz"] for model in (horn, member))
    np.testing.assert_allclose(found, other, rtol=1e-6)


@pytest.mark.slow
def test_it_moves_as_a_member() -> None:
    """Let go under a hundred times its weight: a swing of 0.3 of its length, to the tolerance of both."""
    more = "analysis a = dynamic(duration = 0.3 s, step = 10 ms)\n"
    horn, member = both("load weight = gravity(1 m/s^2)\n", more)
    assert horn.metrics["uz"].value < -0.02
    assert horn.metrics["uz"].value == pytest.approx(member.metrics["uz"].value, rel=1e-6)


def test_traction_acts_on_the_end_that_it_is_on() -> None:
    """A pull of 1 Pa on the small end is pi b^2 Pa: P L / (pi E a b), of which strain adds 1e-9."""
    load = "load pull = traction(pole, where = x >= 1 m, vector = (1e-3, 0, 0) Pa)\n"
    model = run(HORN + WALL + load + PROBES + "model m = beam6dof(segments = 2)\n")
    assert model.metrics["ux"].value == pytest.approx(1e-3 * 0.01 / (1e6 * 0.02), rel=1e-7)
    assert model.loads["pull"].force[0] == pytest.approx(1e-3 * math.pi * 0.01**2, rel=1e-12)


@pytest.mark.parametrize("shear", ["yes", "no"])
def test_a_wedge_sags_as_its_closed_form(shear: str) -> None:
    """12 P L^3 / (E w d^3) (8 ln 2 - 5) for depths d to d / 2; of second order in its segments; shear adds 6/5 P / G A.

    The shear factor is Cowper's: the integral of 1 / depth from d to d / 2 is 2 ln 2 / d.
    """
    body = """body pole = solid(extruded(
    corners = [(0, -20), (1000, -10), (1000, 10), (0, 20)] mm, height = 30 mm, base = -15 mm), gum)
"""
    load = "load push = point_force(pole, at = (1, 0, 0) m, vector = (0, -1, 0) uN)\n"
    d, w, P = 0.04, 0.03, 1e-6
    sag = 12.0 * P / (1e6 * w * d**3) * (8.0 * math.log(2.0) - 5.0)
    if shear == "yes":
        sag += P * 2.0 * math.log(2.0) / (10 * 1.3 / (12 + 11 * 0.3) * 1e6 / 2.6 * w * d)
    off = []
    for segments in (8, 16):
        probe = "probe tip = point(pole, at = (1, 0, 0) m)\nmetric drop = displacement(tip, along = -y)\n"
        model = run(body + WALL + load + probe + f"model m = beam6dof(segments = {segments}, shear = {shear})\n")
        off.append(model.metrics["drop"].value / sag - 1.0)
    assert off[0] / off[1] == pytest.approx(4.0, rel=0.1)
    assert abs(off[1]) < 2e-3


def test_what_is_selected_of_sections_that_taper() -> None:
    """Radii from 20 to 10 mm: below z = -12 mm there is a part of the wide end, and nothing of the narrow one."""
    case = softmark.loads(
        HEAD + HORN + "support wall = fixed(pole, where = z <= -12 mm and x <= 1 m)\n"
        "load weight = gravity(20 mm/s^2)\nmodel t = fem(tet4, strain = small, size = 10 mm)\n"
        "probe tip = point(pole, at = (1, 0, 0) m)\nmetric uz = displacement(tip, along = +z)\n"
    ).scene  # fmt: skip
    below: Condition = case.of_kind("support")["wall"].thing.where
    horn = Cone(1.0, 0.02, 0.01).swept
    assert horn is not None
    assert [coverage(below, horn, s) for s in (0.0, 0.7, 0.9, 1.0)] == ["some", "some", "none", "none"]
    assert single_selected_end(below, horn) is None


def test_which_outlines_have_an_axis() -> None:
    """The ends across the axis, in either sense; sections with the depth where it is, and the width across it."""
    corners = ((0.0, -2.0), (10.0, -1.0), (10.0, 1.0), (0.0, 2.0))
    wedge = Extruded(corners, 3.0, "z", 5.0).swept
    assert wedge is not None
    assert wedge.length == 10.0
    assert wedge.root == (0.0, 0.0, 6.5)
    assert (wedge.section_at(0.0).area, wedge.section_at(10.0).area) == (12.0, 6.0)
    for corner in ((0.0, 2.0, 5.0), (0.0, -2.0, 8.0), (10.0, 1.0, 5.0)):
        assert wedge.contains(tuple(0.999 * c + 0.001 * m for c, m in zip(corner, (5.0, 0.0, 6.5), strict=True)))
        assert not wedge.contains(tuple(1.001 * c - 0.001 * m for c, m in zip(corner, (5.0, 0.0, 6.5), strict=True)))
    assert wedge.volume == pytest.approx(90.0)
    upright = Extruded(tuple((y, x) for x, y in corners), 3.0, "x").swept
    assert upright is not None
    assert upright.axis == (0.0, 0.0, 1.0)
    assert isinstance(upright.section, Rectangle)
    skew = ((0.0, 0.0), (10.0, 0.0), (10.0, 1.0), (0.0, 2.0))
    assert Extruded(skew, 3.0).swept is None
    assert Extruded((*corners, (-1.0, 0.0)), 3.0).swept is None
    assert Cone(1.0, 0.1, 0.0).swept is None
    pole = Cone(1.0, 0.1, 0.05).swept
    assert pole is not None
    assert pole.section_at(0.5) == Disc(pytest.approx(0.075))  # type: ignore[arg-type]
