"""Pressure of a contact along a line: its curve, what it is held against, and where it has no limit."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from softmark import loads
from softmark.interpreter.language.compiled_scene import SceneError
from softmark.interpreter.metrics.pressure_along import PressureAlong
from softmark.interpreter.planning.robustness_plan import find_judging_metrics
from softmark.interpreter.problem.body_case import case_of
from softmark.interpreter.problem.rigid_surfaces import sharp_points, sharp_points_in_section, surface_in_space
from softmark.interpreter.problem.theories.reference_solution import solve_theory
from softmark.interpreter.report.run.report_page import render
from softmark.interpreter.verification.contact_singularities import singular_pressure
from softmark.solvers.mesh.revolved_bodies import Cone
from softmark.solvers.mesh.rigid_shapes import Punch, RoundedBox
from softmark.solvers.mesh.shape import Shape
from softmark.solvers.mesh.shapes import Box, Cylinder
from softmark.solvers.mesh.spheres import Sphere

PRESSED = """softmark 1
material gel   = linear_elastic(young = 10 kPa, poisson = {nu}, density = 1000 kg/m^3)
body     block = axisymmetric(quadrilateral((0, -20, 0) mm, (20, -20, 0) mm, (20, 0, 0) mm, (0, 0, 0) mm), gel)
body     tool  = rigid({shape})
support  floor = fixed(block, where = y <= -20 mm{held})
support  hand  = displaced(tool, by = (0, -{d}, 0) mm)
contact  touch = rigid_contact(tool, block, where = y >= 0 mm)
model    quads = fem(quad4, size = 2 mm, strain = small)
probe    top   = line(block, from = (0, 0, 0) mm, to = ({end}, 0, 0) mm, points = 9)
metric   p     = pressure_along(touch, probe = top)
"""
AGAINST = "reference theory = {theory}(block)\nmetric off = pressure_along(touch, probe = top, against = theory)\n"


def text(shape: str, d: float, end: float = 8.0, nu: float = 0.3, held: str = "") -> str:
    return PRESSED.format(shape=shape, d=d, end=end, nu=nu, held=held)


BALL = "sphere(radius = 30 mm, origin = (0, 30, 0) mm)"
PLATE = "half_space(normal = -y)"


def test_under_a_plate_it_is_the_same_everywhere() -> None:
    """Without Poisson's effect: E d / L, to what the barrier leaves of 0.1 mm, its distance of 1e-5 of the size."""
    metric = loads(text(PLATE, 0.1, nu=0.0, held=", components = y")).run().models["quads"].metrics["p"]
    assert metric.value == pytest.approx(10e3 * 0.1 / 20.0, rel=3e-3)
    assert metric.details["mean_Pa"] == pytest.approx(metric.value, rel=1e-3)
    assert metric.details["points"] == 9
    assert metric.curve is not None
    np.testing.assert_allclose(metric.curve.x, np.linspace(0.0, 8e-3, 9))


@pytest.mark.slow
def test_it_is_held_against_a_theory_and_drawn_beside_it() -> None:
    """Hertz: p0 = 2 E* a / (pi R) with a = sqrt(R d), and p = p0 sqrt(1 - r^2/a^2)."""
    report = loads(text(BALL, 0.5) + AGAINST.format(theory="hertz")).run()
    assert not [w for w in report.warnings if w.code == "W388"]
    off, own = (report.models["quads"].metrics[name] for name in ("off", "p"))
    assert off.curve is not None
    a, modulus = math.sqrt(30e-3 * 0.5e-3), 10e3 / (1.0 - 0.3**2)
    r = np.linspace(0.0, 8e-3, 9)
    right = 2.0 * modulus * a / (math.pi * 30e-3) * np.sqrt(np.maximum(1.0 - (r / a) ** 2, 0.0))
    np.testing.assert_allclose(off.curve.known, right, rtol=1e-9)
    assert own.curve is not None
    assert off.value == pytest.approx(np.sqrt(np.mean((own.curve.y - right) ** 2) / np.mean(right**2)))
    assert off.unit == "1"
    page = render(report)
    assert page.count("pressure along top</title>") == 1  # of both metrics one chart, with the theory


@pytest.mark.slow
def test_every_line_has_a_chart_with_all_that_it_is_held_against() -> None:
    """Two theories of one line are both in its chart; a chart of another line has a name of its own."""
    known = AGAINST.format(theory="hertz") + "reference other = pressed_layer(block)\n"
    known += "metric miss = pressure_along(touch, probe = top, against = other)\n"
    known += "probe short = line(block, from = (0, 0, 0) mm, to = (4, 0, 0) mm, points = 5)\n"
    page = render(loads(text(BALL, 0.5) + known + "metric q = pressure_along(touch, probe = short)\n").run())
    descs = dict(re.findall(r'<desc id="(along-[^"]*)">(.*?)</desc>', page))
    assert len(descs) == page.count('<desc id="along-') == 2
    assert all(f"{name}: at most" in next(iter(descs.values())) for name in ("theory", "other", "quads"))


@pytest.mark.slow
def test_points_beside_the_surface_are_told() -> None:
    report = loads(text(BALL, 0.5).replace("to = (8.0, 0, 0)", "to = (8.0, -8, 0)")).run()
    reason = report.models["quads"].metrics["p"].reason
    assert reason is not None
    assert "8 of 9 points of the undeformed probe are not on the surface of the contact `touch`" in reason


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize(
    ("shape", "end", "why"),
    [
        ("cylinder(radius = 5 mm, length = 9 mm, axis = +y)", 8.0, "a sharp edge or corner of `tool`"),
        ("cylinder(radius = 9 mm, length = 9 mm, axis = +y)", 4.0, None),  # it ends before the edge
        ("punch(radius = 5 mm, rounding = 1 mm, length = 9 mm, axis = +y)", 8.0, None),
        (
            "cone(radius = 10 mm, length = 5 mm, axis = -y, origin = (0, 5, 0) mm)",
            8.0,
            "a sharp edge or corner of `tool`",
        ),
    ],
)
def test_sharp_edges_and_tips_are_told(shape: str, end: float, why: str | None) -> None:
    said = [w.message for w in loads(text(shape, 0.2, end)).run().warnings if w.code == "W388"]
    known = f"`p` is evaluated at {why}, where the pressure is singular: its value depends on the mesh"
    assert said == ([known] if why else [])


def test_no_limit_is_known_of_nothing() -> None:
    case = replace(case_of(loads(text(BALL, 0.2)).scene, "block"), contacts=())
    assert singular_pressure(PressureAlong("touch", "top"), case, None, np.zeros((1, 3))) is None


@pytest.mark.slow
@pytest.mark.parametrize(
    ("shape", "count"),
    [(Sphere(1.0), 0), (Punch(1.0, 0.2, 3.0), 0), (RoundedBox((1.0, 1.0, 1.0), 0.2), 0)],
)
def test_what_is_round_has_no_sharp_points(shape: Shape, count: int) -> None:
    assert len(sharp_points(*surface_in_space(shape, np.zeros((1, 3))))) == count


def test_sharp_points_are_on_rims_edges_and_tips() -> None:
    rims = sharp_points(*surface_in_space(Cylinder(radius=1.0, length=2.0, axis=(0.0, 0.0, 1.0)), np.zeros((1, 3))))
    np.testing.assert_allclose(np.hypot(rims[:, 0], rims[:, 1]), 1.0)
    assert set(rims[:, 2].round(9)) == {0.0, 2.0}
    edges = sharp_points(*surface_in_space(Box((1.0, 2.0, 3.0)), np.zeros((1, 3))))
    at_end = np.isclose(edges, 0.0) | np.isclose(edges, [1.0, 2.0, 3.0])
    assert (at_end.sum(axis=1) >= 2).all()
    tip = sharp_points(*surface_in_space(Cone(radius=1.0, length=1.0), np.zeros((1, 3))))
    assert np.linalg.norm(tip - [0.0, 0.0, 1.0], axis=1).min() < 1e-9
    square = surface_in_space(Box((1.0, 2.0, 3.0), (0.0, 0.0, -1.0)), np.zeros((1, 3)))
    assert len(sharp_points_in_section(*square)) == 4


@pytest.mark.slow
def test_forces_against_a_theory_of_contact_judge_where_models_end() -> None:
    """The theory says how far its own force may be off: d / R for a depth that is not small, and the far face."""
    known = AGAINST.format(theory="hertz") + "metric push = force(touch, along = -y, against = theory)\n"
    loaded = loads(text(BALL, 0.5) + known)
    assert list(find_judging_metrics(loaded.scene)) == ["off", "push"]
    metric = loaded.run().models["quads"].metrics["push"]
    case = case_of(loaded.scene, "block")
    theory = solve_theory(loaded.scene.declared["theory"], case)
    assert theory.relative_errors["depth"] == pytest.approx(0.5 / 30.0)
    assert metric.uncertainty == pytest.approx(sum(map(abs, theory.relative_errors.values())))


def test_levers_of_a_contact_leave_a_closed_form_as_it_is() -> None:
    value = "param k = 1\n"
    value += 'reference given = values(values = k * 1 mN, uncertainty = 1 %, source = "us", kind = theory)\n'
    value += "metric push = force(touch, along = -y)\nmetric far = value_error(of = push, against = given)\n"
    for target, codes in (("touch.distance", []), ("touch.friction", ["E512"])):
        scene = text(BALL, 0.5).replace("y >= 0 mm)", "y >= 0 mm, distance = 1 um, friction = 0.3)") + value
        assert codes_of(scene + f"study walk = robustness(over = [{target}], metric = far)\n") == codes


def codes_of(scene: str) -> list[str]:
    """Of errors."""
    try:
        loads(scene)
    except SceneError as error:
        return [d.code for d in error.diagnostics]
    return []
