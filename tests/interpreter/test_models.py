"""Models as a scene builds them: supports, loads, refusals, and agreement with closed forms."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

import softmark
from softmark.interpreter.models.beam.rigid_motions import free_motions, rigid_motion_rows

BAR = """
param L = 400 mm
param a = 20 mm
material gel = linear_elastic(young = {young}, poisson = {poisson}, density = 1000 kg/m^3)
body bar = solid(box(size = (L, a, a), origin = (0 mm, -a / 2, -a / 2)), gel)
support wall = fixed(bar, where = x <= 0 mm)
probe tip = point(bar, at = (L, 0 mm, 0 mm))
probe axis = line(bar, from = (0, 0, 0) mm, to = (L, 0 mm, 0 mm), points = 5)
"""


def bar(rest: str, young: str = "1 MPa", poisson: str = "0.3") -> softmark.Report:
    return softmark.loads(BAR.format(young=young, poisson=poisson) + rest).run()


def tip(report: softmark.Report, model: str) -> np.ndarray:
    result = report.models[model]
    assert result.status == "converged", result.message
    return result.probes["tip"].displacement[0]


ROD = "model rod = beam6dof(segments = 40)\n"
EI = 1e6 * 0.02**4 / 12  # N m^2
kGA = 10 * 1.3 / (12 + 11 * 0.3) * 1e6 / 2.6 * 0.02**2  # Cowper (1966) for a rectangle, N


def test_end_force_on_a_beam() -> None:
    # Timoshenko: P L^3 / (3 EI) + P L / (kappa G A); the load is so small that geometry stays linear: 1e-4 of
    # linear theory, and 40 linear segments integrate the parabola to 1 / (4 * 40^2) = 1.6e-4
    report = bar(ROD + "load p = point_force(bar, at = (L, 0 mm, 0 mm), vector = (0, 0, -1) mN)\n")
    exact = 1e-3 * 0.4**3 / (3 * EI) + 1e-3 * 0.4 / kGA
    assert tip(report, "rod")[2] == pytest.approx(-exact, rel=3e-4)


def test_force_between_two_nodes_is_shared() -> None:
    # the end displacement of a force at s: P s^2 (3 L - s) / (6 EI), with shear P s / kGA; s = 0.255 is between nodes
    report = bar(ROD + "load p = point_force(bar, at = (255, 0, 0) mm, vector = (0, -1, 0) mN)\n")
    s = 0.255
    exact = 1e-3 * s**2 * (3 * 0.4 - s) / (6 * EI) + 1e-3 * s / kGA
    assert tip(report, "rod")[1] == pytest.approx(-exact, rel=1e-3)


def test_traction_on_the_end_face_is_the_same_force() -> None:
    force = bar(ROD + "load p = point_force(bar, at = (L, 0 mm, 0 mm), vector = (0, 0, -4) mN)\n")
    traction = bar(ROD + "load p = traction(bar, where = x >= L, vector = (0, 0, -10) Pa)\n")  # 4e-4 m^2
    assert tip(traction, "rod") == pytest.approx(tip(force, "rod"), rel=1e-9)


def test_hanging_bar_stretches_by_its_weight() -> None:
    # rho g L^2 / (2 E) = 0.7848 mm; nodes of linear elements are exact for distributed axial load, up to the strain's
    # own size of 0.2 %, which a linear law of finite strain sees as the square of it
    report = bar(
        ROD + "model solid = fem(tet4, strain = small, size = 10 mm)\nload g = gravity(9.81 m/s^2, direction = +x)\n",
        poisson="0",
    )
    exact = 1000 * 9.81 * 0.4**2 / 2e6
    assert tip(report, "rod")[0] == pytest.approx(exact, rel=1e-3)
    assert tip(report, "solid")[0] == pytest.approx(exact, rel=1e-3)  # lumped exactly by linear shape functions along x


@pytest.mark.slow
def test_solid_beam_approaches_beam_theory_as_it_is_refined() -> None:
    text = "load p = traction(bar, where = x >= L, vector = (0, 0, -2.5) Pa)\n"
    cells = (2, 4, 6)  # across the section
    models = "".join(f"model m{n} = fem(tet4, strain = small, size = {20 / n} mm)\n" for n in cells)
    report = bar(text + models, poisson="0")
    kGA0 = 10 / 12 * 1e6 / 2 * 0.02**2
    exact = 1e-3 * 0.4**3 / (3 * EI) + 1e-3 * 0.4 / kGA0
    errors = [abs(-tip(report, f"m{n}")[2] / exact - 1) for n in cells]
    # the error of displacements falls with h^2 in the limit: by 4, then by 2.25; these meshes are not quite there
    assert errors[0] > 2.2 * errors[1]
    assert errors[1] > 1.7 * errors[2]


def test_displaced_support_moves_beam_and_solid_alike() -> None:
    text = "support grip = displaced(bar, where = x >= L, by = (8, 0, 0) mm)\n" + ROD
    report = bar(text + "model solid = fem(tet4, strain = corotational, size = 10 mm)\n", poisson="0")
    # homogeneous stretch of 2 %: the middle moves half as far
    for model in ("rod", "solid"):
        middle = report.models[model].probes["axis"].displacement[2]
        assert middle == pytest.approx([4e-3, 0, 0], abs=1e-9)


def test_large_rotation_of_a_support_is_followed() -> None:
    # the end moves along the chord of a quarter turn: only the corotational and finite models can follow
    text = "support grip = displaced(bar, where = x >= L, by = (-150, 0, -300) mm)\n"
    report = bar(text + "model solid = fem(tet4, strain = corotational, size = 10 mm)\n", poisson="0")
    assert report.models["solid"].status == "converged"


def test_switching_shear_and_stretch_off_gives_euler_bernoulli() -> None:
    text = "model stiff = beam6dof(segments = 40, shear = no, axial = no)\nreference textbook = small_deflection(bar)\n"
    report = bar(
        text
        + "load g = gravity(0.001 m/s^2, direction = -z)\nmetric eta = relative_l2_error(axis, against = textbook)\n"
    )
    value = report.models["stiff"].metrics["eta"].value
    assert value is not None
    assert value < 1e-3  # second order in 1/40: 1 / (4 * 40^2) = 1.6e-4 of the tip, and geometry linear to 1e-4


def test_roller_lets_a_beam_section_turn() -> None:
    # propped cantilever under uniform load: end reaction 3 w L / 8, slope at the roller w L^3 / (48 EI)
    text = "support roller = fixed(bar, where = x >= L, components = z)\n"
    text += "load g = gravity(0.001 m/s^2, direction = -z)\n"
    report = bar(text + ROD)
    shape = report.models["rod"].probes["axis"].displacement
    assert shape[-1, 2] == pytest.approx(0.0, abs=1e-12)
    w, L, x = 1000 * 4e-4 * 1e-3, 0.4, 0.2
    bending = w * x**2 * (3 * L**2 - 5 * L * x + 2 * x**2) / (48 * EI)
    assert -shape[2, 2] == pytest.approx(bending, rel=0.03)  # shear adds about 2 % here


@pytest.mark.parametrize(
    ("rest", "code"),
    [
        ("support s = fixed(bar, where = z <= -10 mm and x <= 20 mm)\n" + ROD, "E501"),
        ("load p = pressure(bar, where = z >= a / 2, magnitude = 1 kPa)\n" + ROD, "E501"),
        ("load p = line_load(bar, from = (0, 0, 0) mm, to = (200, 0, 10) mm, vector = (0, 0, 1) N/m)\n" + ROD, "E501"),
        ("load p = torque(bar, where = z >= a / 2, moment = (0, 0, 1) N*m)\n" + ROD, "E501"),
    ],
)
def test_a_beam_refuses_what_it_cannot_represent(rest: str, code: str) -> None:
    with pytest.raises(softmark.SceneError) as refused:
        bar(rest)
    assert code in {d.code for d in refused.value.diagnostics}


@pytest.mark.parametrize(
    ("support", "motion"),
    [
        ("fixed(bar, where = x <= 0 mm, components = x)", "turn about the axis through (200, 0, 0) mm along x"),
        ("fixed(bar, where = x <= 0 mm, components = (y, z))", "slide along x"),
    ],
)
def test_a_body_left_free_is_named_with_its_motion(support: str, motion: str) -> None:
    text = BAR.format(young="1 MPa", poisson="0.3").replace("fixed(bar, where = x <= 0 mm)", support)
    for model in (ROD, "model solid = fem(tet4, strain = small, size = 20 mm)\n"):
        with pytest.raises(softmark.SceneError) as refused:
            softmark.loads(text + model).run()
        (diagnostic,) = refused.value.diagnostics
        assert diagnostic.code == "E306"
        assert motion in diagnostic.message


def test_contradicting_supports_are_named() -> None:
    text = "support again = displaced(bar, where = x <= 0 mm, by = (1, 0, 0) mm)\n"
    text += "model solid = fem(tet4, strain = small, size = 20 mm)\n"
    with pytest.raises(softmark.SceneError) as refused:
        bar(text)
    assert [d.code for d in refused.value.diagnostics] == ["E305"]


def test_rigid_motions_of_points() -> None:
    corner = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    axes = [f"turn about the axis through (0, 0, 0) mm along {axis}" for axis in "xyz"]
    assert motions(rigid_motion_rows(corner, (0, 1, 2))) == []
    assert motions(rigid_motion_rows(corner[:1], (0, 1, 2))) == axes
    assert motions(rigid_motion_rows(corner[:2], (0, 1, 2))) == axes[:1]
    assert motions(rigid_motion_rows(corner, (2,))) == ["slide along x", "slide along y", axes[2]]
    assert motions(np.zeros((0, 6))) == ["move and turn as a whole"]


def test_an_axis_of_free_turns_is_found_where_it_lies() -> None:
    # held in two points (0, 1, 0) and (1, 2, 0): the line through both, nearest to the centre at (-1/2, 1/2, 0)
    hinge = np.array([[0.0, 1, 0], [1, 2, 0]])
    (named,) = motions(rigid_motion_rows(hinge, (0, 1, 2)))
    assert named == "turn about the axis through (-500, 500, 0) mm along (0.707, 0.707, 0)"
    # a nut on a thread: what is held is v - w / 10 along x, and all else but turning about x
    thread = np.eye(6)[[1, 2, 4, 5]]
    rows = np.concatenate([thread, [[1.0, 0, 0, -0.1, 0, 0]]])
    assert motions(rows) == ["screw about the axis through (0, 0, 0) mm along x"]


def test_what_holds_many_points_takes_memory_like_them_not_like_their_square() -> None:
    """2000 points: rows of 0.3 MB, whose left singular vectors would be 288 MB."""
    rows = rigid_motion_rows(np.random.default_rng(1).standard_normal((2000, 3)), (0, 1, 2))
    tracemalloc.start()
    assert motions(rows) == []
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 20 * rows.nbytes


def motions(rows: np.ndarray) -> list[str]:
    """What is free about the origin, in a body of 1 m."""
    return free_motions(rows, np.zeros(3), 1.0)


@pytest.mark.parametrize("segments", [3, 9, 41])
def test_a_beam_is_held_exactly_as_far_as_its_support_reaches(segments: int) -> None:
    # P (L - c)^3 / (3 EI) + P (L - c) / kGA beyond a clamp of length c = 55 mm, which is a node of no equal spacing;
    # the error of n segments over the free part is 1 / (4 n^2) of it
    text = BAR.format(young="1 MPa", poisson="0.3").replace("x <= 0 mm", "x <= 55 mm")
    report = softmark.loads(
        text + f"model rod = beam6dof(segments = {segments})\n"
        "load p = point_force(bar, at = (L, 0 mm, 0 mm), vector = (0, 0, -1) mN)\n"
    ).run()
    free = 0.4 - 0.055
    exact = 1e-3 * free**3 / (3 * EI) + 1e-3 * free / kGA
    assert -tip(report, "rod")[2] == pytest.approx(exact, rel=0.5 / (segments - 1) ** 2)


def test_a_traction_that_is_not_on_the_end_face_alone_is_refused_by_a_beam() -> None:
    with pytest.raises(softmark.SceneError, match=r"not on one whole end face"):
        bar(ROD + "load p = traction(bar, where = x >= 0.95 * L, vector = (0, 0, -1) Pa)\n")


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("size", [10, 7, 4])
def test_part_of_a_face_carries_its_part_of_the_force(size: int) -> None:
    # 70 % of the end face under 1 kPa along x: the mean strain, seen at 0.7 L, is 0.7 kPa / E; triangles across the
    # border count by 64 samples each, so the resultant is right to about 2 %
    text = "load p = traction(bar, where = x >= L and z >= -4 mm, vector = (1, 0, 0) kPa)\n"
    report = bar(
        text
        + f"model solid = fem(tet4, strain = small, size = {size} mm)\n"
        + "probe m = point(bar, at = (0.7 * L, 0 mm, 0 mm))\n",
        poisson="0",
    )
    found = report.models["solid"].probes["m"].displacement[0, 0]
    assert found == pytest.approx(0.7 * 0.7e3 * 0.4 / 1e6, rel=0.04)


def test_a_buckled_beam_says_that_its_direction_is_arbitrary() -> None:
    # Euler: pi^2 EI / (4 L^2) = 0.206 N; 1 kPa on 4e-4 m^2 is 0.4 N
    report = bar(ROD + "load p = traction(bar, where = x >= L, vector = (-1, 0, 0) kPa)\n")
    assert abs(tip(report, "rod")[1:]).max() > 0.05
    assert "W314" in {w.code for w in report.warnings}


def test_a_column_below_its_critical_load_stays_straight() -> None:
    report = bar(ROD + "load p = traction(bar, where = x >= L, vector = (-0.45, 0, 0) kPa)\n")
    assert abs(tip(report, "rod")[1:]).max() < 1e-9
    assert "W314" not in {w.code for w in report.warnings}
