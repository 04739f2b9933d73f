"""Stress of beams and networks in scenes: by closed forms, turned with sections, and what they say of their ends."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from loaded_modules import loaded_by

import softmark
from softmark.interpreter.pipeline import run_pipeline

HEAD = """softmark 1
scene "sections"
material gum = linear_elastic(young = 1 GPa, poisson = 0.3, density = 1000 kg/m^3)
"""
BAR = """body bar = solid(box(size = (1, 0.02, 0.04) m, origin = (0, -0.01, -0.02) m), gum)
support wall = fixed(bar, where = x <= 0 m)
"""
ROD = "model rod = beam6dof(segments = 10)\n"
W, H, L = 0.02, 0.04, 1.0  # m
# of 3/2 V / A, in the middle of a rectangle of 1:2: 0.983 for nu = 0.25 (Timoshenko and Goodier, section 124), and what
# is left out goes with nu / (1 + nu)
MIDDLE = 1.0 - 0.017 * (0.3 / 1.3) / 0.2


def run(text: str, **options: Any) -> Any:
    loaded = softmark.loads(HEAD + text)
    return run_pipeline.run_scene(loaded.scene, list(loaded.warnings), run_pipeline.RunOptions(draw=False, **options))


def look(at: tuple[float, float, float], component: str, name: str = "s", body: str = "bar") -> str:
    place = ", ".join(f"{c:.9g}" for c in at)
    return (
        f"probe p{name} = point({body}, at = ({place}) m)\nmetric {name} = stress(p{name}, component = {component})\n"
    )


def test_weight_bends_and_shears_between_nodes_too() -> None:
    """M = w (L - s)^2 / 2 and V = w (L - s), where no node is: what acts along an element is in it. Sag 1e-6: 1e-5."""
    w = 1000.0 * 1e-3 * W * H
    text = BAR + "load weight = gravity(1e-3 m/s^2)\n" + ROD
    places = (0.31, 0.5, 0.77)
    for i, s in enumerate(places):
        text += look((s, 0.0, 0.5 * H), "xx", f"top{i}") + look((s, 0.0, 0.0), "zx", f"mid{i}")
    metrics = run(text).models["rod"].metrics
    for i, s in enumerate(places):
        bending = 0.5 * w * (L - s) ** 2 / (W * H**2 / 6.0)
        assert metrics[f"top{i}"].value == pytest.approx(bending, rel=1e-5)
        middle = -metrics[f"mid{i}"].value / (1.5 * w * (L - s) / (W * H))
        assert middle == pytest.approx(MIDDLE, abs=5e-4)


@pytest.mark.parametrize("load", ["gravity(2 m/s^2)", "line_load(bar, from = (0.2, 0, 0) m, to = (0.9, 0, 0) m, "
                                  "vector = (0, 0, -3) N/m)"])  # fmt: skip
def test_half_as_many_segments_find_the_same(load: str) -> None:
    """Bent by a tenth of its length and turned: of second order in the segments, in the middle of both."""
    found = []
    for segments in (5, 10, 20):
        text = BAR + f"load weight = {load}\nmodel rod = beam6dof(segments = {segments})\n"
        text += look((0.33, 0.0, 0.015), "xx", "a") + look((0.33, 0.005, 0.0), "zx", "b")
        metrics = run(text.replace("1 GPa", "1 MPa")).models["rod"].metrics
        found.append([metrics["a"].value, metrics["b"].value])
    first, second = np.abs(np.diff(found, axis=0))
    assert np.all(second <= 0.5 * first + 1e-4 * np.abs(found[-1]))


def test_a_line_of_force_is_the_same_from_either_end() -> None:
    """q (L - s)^2 / 2 amid an element of half the length: from its far end on it seemed 22 % more."""
    text = BAR + "load line = line_load(bar, from = ({}, 0, 0) m, to = ({}, 0, 0) m, vector = (0, 0, -1) mN/m)\n"
    text += "model rod = beam6dof(segments = 2)\n" + look((0.25, 0.0, 0.5 * H), "xx")
    there, back = (run(text.format(*ends)).models["rod"].metrics["s"].value for ends in ((0, 1), (1, 0)))
    assert there == pytest.approx(0.5e-3 * 0.75**2 / (W * H**2 / 6.0), rel=1e-5)
    assert back == pytest.approx(there, rel=1e-12)


def test_stress_turns_with_its_section() -> None:
    """Rolled up by an end moment to a half circle: E c / R along the axis, which looks along z half way.

    Of two more components none is left; nominal stress is along the axis by rest, sigma_zz = P_zX to 2 nu eps.
    """
    radius = L / math.pi
    moment = 1e9 * W * H**3 / 12.0 / radius
    text = BAR.replace("0.02, 0.04) m, origin = (0, -0.01, -0.02)", "0.02, 0.004) m, origin = (0, -0.01, -0.002)")
    text += f"load roll = torque(bar, where = x >= 1 m, moment = (0, {-moment * 1e-3:.12g}, 0) N*m)\n"
    text += "model rod = beam6dof(segments = 40)\n"
    for i, component in enumerate(("xx", "zz", "zx", "principal_3")):
        text += look((0.5, 0.0, 0.002), component, f"s{i}")
    text += "metric long = stretch(ps0, component = x)\n"
    model = run(text).models["rod"]
    assert model.status == "converged", model.message
    size = 1e9 * 0.002 / radius
    assert model.metrics["s1"].value == pytest.approx(-size, rel=1e-3)
    assert model.metrics["s3"].value == pytest.approx(-size, rel=1e-3)
    assert max(abs(model.metrics[f"s{i}"].value) for i in (0, 2)) < 1e-3 * size
    assert model.metrics["long"].value == pytest.approx(1.0 - 0.002 / radius, abs=1e-5)


def test_a_horn_is_thinner_towards_its_end() -> None:
    """4 M / (pi r^3) with r between 20 and 10 mm, and N / (pi r^2)."""
    text = (
        """body bar = solid(cone(length = 1 m, radius = 20 mm, end = 10 mm), gum)
support wall = fixed(bar, where = x <= 0 m)
load push = point_force(bar, at = (1, 0, 0) m, vector = (1, 0, -1) mN)
"""
        + ROD
    )
    for i, s in enumerate((0.3, 0.55, 0.8)):
        text += look((s, 0.0, 0.02 - 0.01 * s), "xx", f"s{i}")
    metrics = run(text).models["rod"].metrics
    for i, s in enumerate((0.3, 0.55, 0.8)):
        r = 0.02 - 0.01 * s
        exact = 4e-3 * (1.0 - s) / (math.pi * r**3) + 1e-3 / (math.pi * r**2)
        assert metrics[f"s{i}"].value == pytest.approx(exact, rel=2e-5)  # sagging by 1e-5 of its length


def test_a_wedge_bent_at_its_tip_is_stressed_along_its_rays() -> None:
    """Michell (1900): stress goes along rays alone, none is on the axis; of a bar it would be 3/2 P / A there.

    A trapezoid with the force and the moment at its end of 10 uN at the apex, 1 m beyond. To the square of its angle.
    """
    text = """body bar = solid(extruded([(0, -0.02), (1, -0.01), (1, 0.01), (0, 0.02)] m, height = 0.02 m), gum)
support wall = fixed(bar, where = x <= 0 m)
load push = point_force(bar, at = (1, 0, 0.01) m, vector = (0, -0.01, 0) mN)
load turn = torque(bar, where = x >= 1 m, moment = (0, 0, -0.01) mN*m)
"""
    text += ROD + look((0.4, 0.012, 0.01), "xy", "off") + look((0.4, 0.0, 0.01), "xy", "axis")
    metrics = run(text).models["rod"].metrics
    angle, r, theta, P = math.atan(0.01), math.hypot(1.6, 0.012), math.atan2(0.012, 1.6), 1e-5 / 0.02
    along = 2.0 * P * math.sin(theta) / (r * (2.0 * angle - math.sin(2.0 * angle)))
    assert abs(metrics["off"].value) == pytest.approx(along * math.sin(theta) * math.cos(theta), rel=3e-4)
    assert abs(metrics["axis"].value) < 1e-4 * 1.5 * 1e-5 / (0.02 * 0.032)


def test_shear_in_a_cone_is_that_of_a_solid() -> None:
    """57240 unknowns of hex27 in small strain find -57.7 kPa near the top and -38.9 kPa on the axis.

    A bar that does not taper has -4.9 and -61.5 kPa. What is stated holds the rest, of Poisson's ratio.
    """
    text = """material steel = linear_elastic(young = 200 GPa, poisson = 0.3, density = 7850 kg/m^3)
body bar = solid(cone(length = 500 mm, radius = 50 mm, end = 25 mm), steel)
support wall = fixed(bar, where = x <= 0 mm)
load push = traction(bar, where = x >= 500 mm, vector = (0, 0, -100) kPa)
model rod = beam6dof(segments = 40)
"""
    text += look((0.25, 0.0, 0.036), "zx", "high") + look((0.25, 0.0, 0.0), "zx", "axis")
    model = run(text, stated=("rod",)).models["rod"]
    for name, exact, bar in (("high", -57699.2, 1e3), ("axis", -38866.2, 3e3)):
        error = abs(model.metrics[name].value - exact)
        assert error < bar
        assert error < model.stated[name].value


def test_members_of_a_network_have_their_own() -> None:
    """A knee: M = Q b - Q s on the arm, and the torque Q b on the other beside its bending."""
    text = """body bar = network(points = [(0, 0, 0), (1, 0, 0), (1, 1, 0)] m, members = [(1, 2), (2, 3)],
    material = gum, radius = [20, 10] mm)
support wall = fixed(bar, where = x <= 0 m)
load pull = point_force(bar, at = (1, 1, 0) m, vector = (0, 0, -1) mN)
model rod = frame6dof(segments = 8)
"""
    text += look((0.4, 0.0, 0.02), "xx", "bent") + look((0.4, 0.0, 0.02), "xy", "twisted")
    text += look((1.0, 0.3, 0.01), "yy", "arm")
    model = run(text).models["rod"]
    metrics = model.metrics
    assert metrics["bent"].value == pytest.approx(4.0 * 0.6e-3 / (math.pi * 0.02**3), rel=1e-5)
    assert abs(metrics["twisted"].value) == pytest.approx(2.0 * 1e-3 / (math.pi * 0.02**3), rel=1e-5)
    assert metrics["arm"].value == pytest.approx(4.0 * 0.7e-3 / (math.pi * 0.01**3), rel=1e-5)


def test_constraints_carry_as_well() -> None:
    """Without shear and stretch: forces are those of equilibrium."""
    text = BAR + "load push = point_force(bar, at = (1, 0, 0) m, vector = (3, 0, -1) mN)\n"
    text += "model rod = beam6dof(segments = 10, shear = no, axial = no)\n"
    text += look((0.45, 0.0, 0.0), "zx", "across") + look((0.45, 0.0, 0.0), "xx", "along")
    metrics = run(text).models["rod"].metrics
    assert metrics["along"].value == pytest.approx(3e-3 / (W * H), rel=1e-4)
    assert -metrics["across"].value / (1.5e-3 / (W * H)) == pytest.approx(MIDDLE, abs=5e-4)


@pytest.mark.long
@pytest.mark.slow
def test_errors_are_stated_where_sections_are_free() -> None:
    """Within a width of the clamp none is, and a warning says why; in motion there is no stress at all."""
    text = BAR + "load weight = gravity(1e-3 m/s^2)\n" + ROD
    text += look((0.5, 0.0, 0.02), "xx", "far") + look((0.03, 0.0, 0.02), "xx", "near")
    report = run(text, stated=("rod",))
    far, stated = report.models["rod"].metrics["far"], report.models["rod"].stated
    exact = 0.5 * 1000.0 * 1e-3 * W * H * 0.25 / (W * H**2 / 6.0)
    assert stated["near"].value is None
    assert abs(far.value - exact) <= stated["far"].value < 0.1 * exact
    assert [w.code for w in report.warnings] == ["W356"]
    moving = run(text + "analysis a = dynamic(duration = 20 ms, step = 10 ms)\n").models["rod"].metrics["far"]
    assert moving.value is None
    assert "static analysis" in moving.reason


@pytest.mark.slow
def test_what_no_metric_asks_for_is_not_loaded() -> None:
    """A beam that is bent and no more: no stress, no theory of sections, no balance of a theory of frames."""
    text = HEAD + BAR + "load weight = gravity(1e-3 m/s^2)\n" + ROD
    text += "probe tip = point(bar, at = (1, 0, 0) m)\nmetric sag = displacement(tip, along = -z)\n"
    loaded = loaded_by(text)
    assert {
        m
        for m in loaded
        if m.endswith((".mesh_stress", ".beam_stress", ".end_effect_zones", ".frame_theory_setup"))
        or "stress_recovery" in m
    } <= {"interpreter.models.postprocessing.mesh_stress"}
