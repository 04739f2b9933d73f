"""Bodies that are pulled from afar: tension on their surface, and the theories of a sphere and of a hole in scenes."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import softmark
from softmark.interpreter.language.compiled_scene import SceneError
from softmark.interpreter.problem.body_case import case_of
from softmark.interpreter.problem.theories.inclusion_theory_setup import InclusionSetup
from softmark.interpreter.problem.theories.reference_solution import problem_of
from softmark.interpreter.report.run.report_page import render
from softmark.interpreter.report.run.report_terminal import table
from softmark.references.inclusion import BodyWithRoundCore, Hookean

GELS = """material gel  = linear_elastic(young = 10 kPa, poisson = 0.4, density = 1000 kg/m^3)
material bead = linear_elastic(young = 80 kPa, poisson = 0.2, density = 1000 kg/m^3)
"""
MID_Z = "support mid_z = symmetric(ball, where = z <= 0 mm)\n"
PLANES = "".join(f"support mid_{x} = symmetric(ball, where = {x} <= 0 mm)\n" for x in "xyz")
THEORY = "reference theory = goodier(ball)\n"
OUTER = "x^2 + y^2 + z^2 >= (15 mm)^2"
BALL = f"""{GELS}body ball = solid(sphere(radius = 15 mm, part = octant), gel)
region core = part(ball, where = x^2 + y^2 + z^2 <= (5 mm)^2, material = bead)
{PLANES}load pull = remote_stress(ball, where = {OUTER}, magnitude = 100 Pa, direction = +x)
reference theory = goodier(ball)
probe place = point(ball, at = (6, 3, 2) mm)
"""
PLATE = f"""{GELS}body plate = plane_stress(quarter_ring(inner = 5 mm, outer = 20 mm), gel, thickness = 1 mm)
support mid_x = symmetric(plate, where = x <= 0 mm)
support mid_y = symmetric(plate, where = y <= 0 mm)
load pull = remote_stress(plate, where = x^2 + y^2 >= (20 mm)^2, magnitude = 100 Pa, direction = +x)
reference theory = kirsch(plate)
probe place = point(plate, at = (0, 5, 0) mm)
"""
SHELL = BALL.replace("sphere(radius = 15 mm,", "spherical_shell(radius = 15 mm, inner = 5 mm,").replace(
    "region core = part(ball, where = x^2 + y^2 + z^2 <= (5 mm)^2, material = bead)\n", ""
)
TURNED = f"""{GELS}body ball = axisymmetric(quarter_ring(inner = 5 mm, outer = 20 mm), gel)
support level = symmetric(ball, where = y <= 0 mm)
load pull = remote_stress(ball, where = x^2 + y^2 >= (20 mm)^2, magnitude = 100 Pa, direction = +y)
reference theory = goodier(ball)
probe place = point(ball, at = (5, 0, 0) mm)
metric along = stress(place, component = yy)
metric out = displacement(place, along = -x)
"""


def report_of(text: str) -> softmark.Report:
    report = softmark.loads(text).run()
    for model in report.models.values():
        assert model.status == "converged", model.message
    return report


def core(text: str) -> BodyWithRoundCore:
    """What the theory of a scene is about."""
    scene = softmark.loads(text).scene
    reference = scene.declared["theory"]
    found: BodyWithRoundCore = problem_of(reference, case_of(scene, reference.value("body")))
    return found


def refused(text: str) -> tuple[str, str]:
    """Code and message of the first error of a scene."""
    with pytest.raises(SceneError) as caught:
        softmark.loads(text)
    found = [d for d in caught.value.diagnostics if d.severity == "error"]
    return found[0].code, found[0].message


# ------------------------------------------------------------------ tension


@pytest.mark.slow
def test_on_a_whole_surface_it_makes_a_uniform_stress() -> None:
    """Whatever the shape and the direction, T d d everywhere: facets of a curved cell take exactly their tractions."""
    corners = (
        "support root = fixed(block, where = x <= 0 mm and y <= 0 mm and z <= 0 mm)\n"
        "support edge = fixed(block, where = x >= 20 mm and y <= 0 mm and z <= 0 mm, components = (y, z))\n"
        "support side = fixed(block, where = x <= 0 mm and y >= 10 mm and z <= 0 mm, components = z)\n"
    )
    block = f"{GELS}body block = solid(box(size = (20, 10, 10) mm), gel)\n{corners}"
    block += "load pull = remote_stress(block, where = x >= -1 mm, magnitude = 100 Pa, direction = (2, 1, 2))\n"
    block += "model m = fem(hex8, strain = small, size = 5 mm)\n"
    block += "probe inside = line(block, from = (1, 2, 3) mm, to = (20, 10, 10) mm)\n"
    ball = f"{GELS}body ball = solid(sphere(radius = 15 mm, part = octant), gel)\n{PLANES}"
    ball += f"load pull = remote_stress(ball, where = {OUTER}, magnitude = 100 Pa, direction = -y)\n"
    ball += "model m = fem(hex20, strain = small, size = 8 mm)\n"
    ball += "probe inside = line(ball, from = (0, 0, 0) mm, to = (9, 9, 7) mm)\n"
    for text, d in ((block, np.array([2.0, 1.0, 2.0]) / 3.0), (ball, np.array([0.0, 1.0, 0.0]))):
        names = {"xx": (0, 0), "yy": (1, 1), "zz": (2, 2), "xy": (0, 1), "yz": (1, 2), "zx": (2, 0)}
        report = report_of(text + "".join(f"metric s{n} = stress(inside, component = {n})\n" for n in names))
        for name, (i, j) in names.items():
            details = report.models["m"].metrics[f"s{name}"].details
            assert details["largest_Pa"] == pytest.approx(100.0 * d[i] * d[j], abs=1e-5)
            assert details["least_Pa"] == pytest.approx(100.0 * d[i] * d[j], abs=1e-5)
        pull = report.models["m"].loads["pull"]
        assert pull.share == pytest.approx(1.0, rel=2e-2)
        if d[0]:
            assert pull.force == pytest.approx((0.0, 0.0, 0.0), abs=1e-15)
            assert pull.exact_force == pytest.approx((0.0, 0.0, 0.0), abs=1e-15)
        else:  # the projected quarter disc, of facets that follow the sphere to a part of 1e-4
            assert pull.exact_force == pytest.approx((0.0, 100.0 * math.pi * 0.015**2 / 4, 0.0), rel=1e-9, abs=1e-12)
            assert pull.force == pytest.approx(pull.exact_force, rel=2e-3, abs=1e-12)


def test_on_a_flat_face_it_is_the_traction_along_it_alone() -> None:
    text = (
        f"{GELS}body block = solid(box(size = (20, 10, 10) mm), gel)\nsupport root = fixed(block, where = x <= 0 mm)\n"
    )
    text += "model m = fem(hex8, strain = small, size = 5 mm)\nprobe tip = point(block, at = (20, 10, 10) mm)\n"
    text += "metric far = displacement(tip, along = +x)\n"
    pulls = (
        "traction(block, where = x >= 20 mm, vector = (60, 80, 0) Pa)",  # 100 Pa (0.6, 0.8, 0) of 0.6 of the area
        "remote_stress(block, where = x >= 20 mm, magnitude = 166.66666666666667 Pa, direction = (3, 4, 0))",
    )
    traction, tension = (report_of(f"{text}load pull = {pull}\n").models["m"] for pull in pulls)
    assert tension.metrics["far"].value == pytest.approx(traction.metrics["far"].value, rel=1e-12)
    for name in ("force", "moment", "exact_force"):
        assert getattr(tension.loads["pull"], name) == pytest.approx(getattr(traction.loads["pull"], name), rel=1e-12)


@pytest.mark.long
@pytest.mark.slow
def test_a_body_of_revolution_is_pulled_along_its_axis_or_all_around() -> None:
    """Beside the cavity of a large ball: the exact solution of it, by elements that know nothing of it."""
    text = TURNED + "model m = fem(quad9, strain = small, size = 1 mm)\n"
    for way in "yx":
        report = report_of(text.replace("direction = +y", f"direction = +{way}"))
        own, right = report.models["m"].metrics, report.references["theory"].metrics
        assert own["along"].value == pytest.approx(right["along"].value, rel=0.05)
        assert own["out"].value == pytest.approx(right["out"].value, rel=0.005)


@pytest.mark.parametrize(
    ("text", "code"),
    [
        (BALL.replace("direction = +x", "direction = (1, 1, 0)"), "E582"),
        (PLATE.replace("direction = +x", "direction = +z"), "E544"),
        (TURNED.replace("direction = +y", "direction = (1, 1, 0)"), "E323"),
    ],
)
def test_what_it_cannot_pull_is_refused(text: str, code: str) -> None:
    assert refused(text)[0] == code


def test_a_plane_of_symmetry_has_no_surface_to_pull() -> None:
    text = BALL.replace(f"where = {OUTER}", "where = x^2 + y^2 + z^2 >= (10 mm)^2")
    text = text.replace(THEORY, "model m = fem(hex8, strain = small, size = 8 mm)\n")
    with pytest.raises(SceneError) as caught:
        softmark.loads(text).run()
    assert caught.value.diagnostics[0].code == "E582"


def test_beams_take_none(tmp_path: Any) -> None:
    text = f"{GELS}body bar = solid(box(size = (100, 10, 10) mm), gel)\nsupport root = fixed(bar, where = x <= 0 mm)\n"
    text += "load pull = remote_stress(bar, where = x >= 100 mm, magnitude = 1 Pa, direction = +x)\n"
    assert refused(text + "model m = beam6dof(segments = 4)\n")[0] == "E501"


# ------------------------------------------------------------------ what theories are about


def test_the_body_is_read_from_the_scene() -> None:
    """An inclusion, a cavity, a ball that turns, a hole: solids, radii, centre and stress."""
    gel, bead = Hookean(10e3 / 2.8, 0.4), Hookean(80e3 / 2.4, 0.2)
    found = core(BALL)
    assert found == BodyWithRoundCore(3, bead, gel, found.inner, 0.015, (100.0, 0.0, 0.0))
    assert found.inner == pytest.approx(0.005, rel=1e-12)
    assert core(SHELL) == BodyWithRoundCore(3, None, gel, 0.005, 0.015, (100.0, 0.0, 0.0))
    assert core(TURNED) == BodyWithRoundCore(3, None, gel, 0.005, 0.02, (0.0, 100.0, 0.0))
    assert core(TURNED.replace("+y", "+x")).stress == (100.0, 0.0, 100.0)
    plate = core(PLATE)
    assert plate == BodyWithRoundCore(2, None, Hookean(10e3 / 2.8, 0.4 / 1.4), 0.005, 0.02, (100.0, 0.0, 0.0), thin=0.4)
    strip = core(PLATE.replace("plane_stress", "plane_strain"))
    assert strip == BodyWithRoundCore(2, None, gel, 0.005, 0.02, (100.0, 0.0, 0.0))


def test_tensions_and_pressures_add_up() -> None:
    more = f"load squeeze = pressure(ball, where = {OUTER}, magnitude = 30 Pa)\n"
    more += (
        "load across = remote_stress(ball, where = x^2 + y^2 + z^2 >= (15 mm)^2, magnitude = 5 Pa, direction = -z)\n"
    )
    assert core(BALL + more).stress == pytest.approx((70.0, -30.0, -25.0))
    more = "load squeeze = pressure(plate, where = x^2 + y^2 >= (20 mm)^2, magnitude = 30 Pa)\n"
    assert core(PLATE + more).stress == pytest.approx((70.0, -30.0, 0.0))


def test_a_ball_elsewhere_has_its_centre_there() -> None:
    moved = BALL.replace("radius = 15 mm,", "radius = 15 mm, origin = (1, 2, 3) mm,").replace("x^2", "(x - 1 mm)^2")
    moved = (
        moved.replace("at = (6, 3, 2)", "at = (6, 5, 5)").replace("y^2", "(y - 2 mm)^2").replace("z^2", "(z - 3 mm)^2")
    )
    for axis, at in zip("xyz", (1, 2, 3), strict=True):
        moved = moved.replace(f"where = {axis} <= 0 mm", f"where = {axis} <= {at} mm")
    found = core(moved)
    assert found.centre == pytest.approx((1e-3, 2e-3, 3e-3))
    assert found.inner == pytest.approx(5e-3)


WRONG = {
    "another law": BALL.replace("= linear_elastic(young = 80", "= neo_hookean(young = 80"),
    "a quarter ball": BALL.replace("part = octant", "part = quarter").replace(MID_Z, ""),
    "no inclusion": SHELL.replace("spherical_shell(radius = 15 mm, inner = 5 mm,", "sphere(radius = 15 mm,"),
    "two": BALL + "region more = part(ball, where = x^2 + y^2 + z^2 >= (12 mm)^2, material = bead)\n",
    "an egg": BALL.replace("x^2 + y^2 + z^2 <= (5 mm)^2", "x^2 + 1.001 * y^2 + z^2 <= (5 mm)^2"),
    "beside the centre": BALL.replace("x^2 + y^2 + z^2 <= (5 mm)^2", "x^2 + y^2 + (z - 0.01 mm)^2 <= (5 mm)^2"),
    "cut off": BALL.replace("<= (5 mm)^2", "<= (5 mm)^2 and x >= 1 mm"),
    "the matrix": BALL.replace("<= (5 mm)^2", ">= (5 mm)^2"),
    "a clamp": BALL.replace("symmetric(ball, where = z", "fixed(ball, where = z"),
    "a half": BALL.replace(MID_Z, "support mid_z = fixed(ball, where = z <= 0 mm, components = z)\n"),
    "a force": BALL + "load push = point_force(ball, at = (6, 3, 2) mm, vector = (1, 0, 0) mN)\n",
    "a part of it": BALL.replace(f"where = {OUTER}", f"where = {OUTER} and x > 3 mm"),
    "nothing": BALL.replace(
        f"load pull = remote_stress(ball, where = {OUTER}, magnitude = 100 Pa, direction = +x)\n", ""
    ),
    "the hollow": SHELL.replace("(15 mm)^2, mag", "(4 mm)^2, mag"),
    "in motion": BALL + "analysis a = dynamic(duration = 1 s, step = 10 ms)\n",
    "an ellipse": PLATE.replace("inner = 5 mm", "inner = 5 mm, inner_y = 4 mm"),
    "no ring": PLATE.replace(
        "quarter_ring(inner = 5 mm, outer = 20 mm)",
        "quadrilateral((0, 0, 0) mm, (20, 0, 0) mm, (20, 20, 0) mm, (0, 20, 0) mm)",
    ),
    "a solid": BALL.replace("goodier", "kirsch"),
    "a plate": PLATE.replace("kirsch", "goodier"),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_breaks_an_assumption_is_refused(name: str) -> None:
    code, message = refused(WRONG[name])
    assert code == "E503", message
    assert message.startswith("`theory` does not apply to this scene: ")


def test_a_solid_that_varies_is_refused() -> None:
    assert refused(BALL.replace("young = 10 kPa", "young = 10 kPa * (1 + x / 100 mm)"))[0] == "E329"


# ------------------------------------------------------------------ what is held against them


@pytest.mark.slow
def test_stress_is_held_against_theory() -> None:
    """A hole in plane stress: hoop stress, strain across, and the difference relative to the tensor that is right."""
    text = PLATE + "metric hoop = stress(place, component = xx)\nmetric thin = strain(place, component = zz)\n"
    text += "metric far = stress(place, component = xx, against = theory)\nmetric off = stretch(place, component = z, "
    text += "against = theory)\nmetric eta = max_error(place, against = theory)\n"
    text += "model m = fem(quad8, strain = small, size = 1.5 mm)\n"
    report = report_of(text)
    own, theory = report.models["m"].metrics, report.references["theory"]
    right = theory.metrics["hoop"].value
    assert right == pytest.approx(core(text).stress_at(np.array([[0.0, 5e-3, 0.0]]))[0, 0, 0], rel=1e-14)
    assert own["hoop"].value == pytest.approx(right, rel=0.03)
    assert own["thin"].value == pytest.approx(theory.metrics["thin"].value, rel=0.03)
    assert own["far"].value == pytest.approx(abs(own["hoop"].value - right) / right, rel=1e-9)  # uniaxial: its norm
    assert own["off"].unit == "1"
    assert own["eta"].value < 0.005 * 5e-3 * 0.03
    assert theory.facts["size_matters"] == pytest.approx(9.6 / 16, rel=0.1)
    told = f"in an infinite body by up to {100 * theory.facts['size_matters']:.3g} % of the remote stress"
    assert told in table(report, terminal=False)
    assert told in render(report)
    assert theory.metrics["hoop"].details["where_materials_meet"] == 0


def test_it_is_said_where_small_strains_are_large() -> None:
    """A linear theory in proportion to its load: with what it calls small at 0.9 % nothing is said, at 10 % it is."""
    plate = core(PLATE)
    slight, large = (
        replace(plate, stress=(s / plate.largest_gradient * plate.stress[0], 0.0, 0.0)) for s in (9e-3, 0.1)
    )
    told = "it assumes small strains and rotations, but they reach "
    setup = InclusionSetup()
    assert told not in setup.facts(slight)["said"]
    assert setup.facts(large)["said"].endswith(f"{told}10 %: a body with large ones differs")


@pytest.mark.slow
@pytest.mark.long
def test_numbers_by_a_theory_at_large_strain_are_marked() -> None:
    """It was said beside the theory alone: its number, and an error against it, stood without any mark."""
    more = "metric hoop = stress(place, component = xx)\nmetric off = stress(place, component = xx, against = theory)\n"
    model = "model quads = fem(quad8, strain = small, size = 4 mm)\n"
    large, small = (softmark.loads(PLATE.replace("100 Pa", pull) + model + more).run() for pull in ("1 kPa", "1 Pa"))
    quads, theory = large.models["quads"].metrics, large.references["theory"].metrics
    why = "it assumes small strains and rotations, but they reach "
    assert all((m.doubt or "").startswith(why) for m in (quads["off"], theory["hoop"]))
    assert quads["hoop"].doubt is None  # its own number, by a model that says what it is
    assert quads["off"].to_json()["doubt"] == quads["off"].doubt
    shown, page = table(large, terminal=False), render(large)
    assert shown.count(" ‡") == 2
    assert "‡ hoop, off: the theory is not exact here: it takes" in shown or "‡ off, hoop: the" in shown
    assert page.count('href="#note-doubt"') == 2
    assert "‡" not in table(small, terminal=False) + render(small)


def test_theories_without_stress_are_refused() -> None:
    text = f"{GELS}body bar = solid(box(size = (100, 10, 10) mm), gel)\nsupport root = fixed(bar, where = x <= 0 mm)\n"
    text += "load weight = gravity(9.81 m/s^2)\nreference theory = elastica(bar)\n"
    text += "probe tip = point(bar, at = (50, 5, 5) mm)\nmetric far = stress(tip, against = theory)\n"
    text += "model m = fem(tet10, strain = small, size = 5 mm)\n"
    assert refused(text) == ("E509", "`far` compares stress or strain, but `theory` has none")


def test_forces_of_what_has_none_are_refused() -> None:
    text = BALL + "metric held = force(mid_x, along = +x, against = theory)\n"
    assert refused(text + "model m = fem(hex8, strain = small, size = 8 mm)\n")[0] == "E509"


def test_the_example_of_the_guide_is_sound() -> None:
    guide = (Path(__file__).parents[2] / "grammar" / "README.md").read_text(encoding="utf-8")
    example = guide.split("### Remote stress")[1].split("```text\n")[1].split("```")[0]
    assert softmark.loads(example).warnings == ()
