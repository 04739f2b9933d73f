"""Supports that turn: what they turn comes there exactly, by any angle, in every model and in time."""

from __future__ import annotations

import math

import numpy as np
import pytest

import softmark

BODY = """softmark 1
scene "turned"
material gel = neo_hookean(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
body bar = solid(box(size = (20, 10, 10) mm), gel)
{rest}
probe inside = line(bar, from = (0, 5, 5) mm, to = (20, 5, 5) mm, points = 5)
metric first = displacement(inside, along = +x)
"""
AXIS, POINT = np.array([1.0, 2.0, 2.0]) / 3.0, np.array([0.005, -0.01, 0.02])
WORDS = "axis = (1, 2, 2), through = (5, -10, 20) mm"


def on_circles(X: np.ndarray, angle: float, axis: np.ndarray = AXIS, point: np.ndarray = POINT) -> np.ndarray:
    """Displacements of points turned about an axis: along it they stay, across it they turn (no Rodrigues)."""
    r = X - point
    along = np.outer(r @ axis, axis)
    e1 = np.cross(axis, [0.0, 0.0, 1.0])
    e1 /= np.linalg.norm(e1)
    e2 = np.cross(axis, e1)
    a, b, c, s = r @ e1, r @ e2, math.cos(angle), math.sin(angle)
    return along + np.outer(c * a - s * b, e1) + np.outer(s * a + c * b, e2) - r


def run(rest: str, length: int = 20) -> softmark.Report:
    report = softmark.loads(BODY.format(rest=rest).replace("(20, ", f"({length}, ")).run()
    assert {n: m.message for n, m in report.models.items() if m.status != "converged"} == {}
    return report


@pytest.mark.parametrize(
    "models",
    [
        "model hexes = fem(hex8, strain = finite, size = 10 mm)",
        pytest.param(
            """model tets = fem(tet4, strain = corotational, size = 10 mm)
model keeps = fem(hex8, strain = finite, formulation = mixed, size = 10 mm)
model net = mass_spring(size = 10 mm, stiffness = from_material())""",
            marks=pytest.mark.slow,
        ),
    ],
)
def test_a_body_that_is_turned_by_its_end_turns_as_a_whole(models: str) -> None:
    """By 400 degrees about an oblique axis beside it: a rigid motion, without forces, that is no turn by 40.

    Bar: tolerance 1e-8 of a force on a body of 10 mm; positions to 1e-9 of the way, some 60 mm.
    """
    report = run(f"""support grip = rotated(bar, where = x >= 20 mm, {WORDS}, angle = 400 deg)
{models}
metric stored = strain_energy(bar)
metric torque = moment(grip, along = (1, 2, 2))""")
    for name, model in report.models.items():
        seen = model.probes["inside"]
        assert np.allclose(seen.displacement, on_circles(seen.points, math.radians(400)), atol=1e-9), name
        assert abs(model.metrics["stored"].value) < 1e-12
        assert abs(model.metrics["torque"].value) < 1e-9


def test_a_beam_that_is_turned_by_its_end_turns_as_a_whole() -> None:
    report = run(f"""support grip = rotated(bar, where = x >= 20 mm, {WORDS}, angle = 400 deg)
model rod = beam6dof(segments = 4)""")
    seen = report.models["rod"].probes["inside"]
    assert np.allclose(seen.displacement, on_circles(seen.points, math.radians(400)), atol=1e-9)


def test_opposite_turns_cancel_and_a_whole_turn_is_not_none() -> None:
    """A rod twisted by 360 degrees stores (G J / L) angle^2 / 2, whatever its ends look like; G J of a box: its own."""
    text = """support wall = rotated(bar, where = x <= 0 mm, axis = -x, through = (0, 5, 5) mm, angle = 180 deg)
support grip = rotated(bar, where = x >= 20 mm, axis = +x, through = (0, 5, 5) mm, angle = {half} deg)
model rod = beam6dof(segments = 8)
metric stored = strain_energy(bar)
metric torque = moment(grip, along = +x)"""
    metrics = run(text.format(half=180)).models["rod"].metrics
    rigidity = 60e3 / 2.6 * 0.140577 * 0.01**4  # of a square bar (REFERENCES 3.2), to 1e-5
    assert metrics["torque"].value == pytest.approx(rigidity * 2 * math.pi / 0.02, rel=1e-4)
    assert metrics["stored"].value == pytest.approx(0.5 * rigidity * (2 * math.pi) ** 2 / 0.02, rel=1e-4)
    unloaded = run(text.format(half=-180)).models["rod"].metrics
    assert abs(unloaded["torque"].value) < 1e-9


@pytest.mark.slow
def test_a_loop_is_not_lost_where_segments_turn_past_each_other() -> None:
    """One end of a clamped bar turned by 360 degrees across its axis: it pops into the twist of a whole turn, of the
    energy 2 pi^2 GJ / L, or is not followed; found before was a straight bar without strain, a segment having turned
    by more than half a turn in one step."""
    text = """material gum = linear_elastic(young = 1.8 MPa, poisson = 0.3, density = 1000 kg/m^3)
body bar = solid(cylinder(length = 200 mm, radius = {radius} mm), gum)
support grip = rotated(bar, where = x <= 0 mm, axis = +y, angle = 360 deg)
support far = fixed(bar, where = x >= 200 mm)
model rod = beam6dof(segments = 20)
metric stored = strain_energy(bar)
"""
    thin = softmark.loads(text.format(radius=3)).run().models["rod"]
    assert thin.status == "not_converged"
    assert "past each other" in thin.message
    thick = softmark.loads(text.format(radius=15)).run().models["rod"].metrics["stored"].value
    GJ = 1.8e6 / 2.6 * math.pi / 2 * 0.015**4
    assert thick == pytest.approx(2 * math.pi**2 * GJ / 0.2, rel=1e-9)


def test_an_end_that_may_slide_grows_longer() -> None:
    """Free along its axis a twisted rod bears no thrust and grows longer (Poynting 1909), as small strain cannot."""
    report = run("""support wall = fixed(bar, where = x <= 0 mm)
support grip = rotated(bar, where = x >= 20 mm, axis = +x, through = (0, 5, 5) mm, angle = 90 deg, components = (y, z))
model hexes = fem(hex20, strain = finite, size = 5 mm)
metric thrust = force(grip, along = +x)""")
    assert abs(report.models["hexes"].metrics["thrust"].value) < 1e-9
    assert report.models["hexes"].probes["inside"].displacement[-1, 0] > 1e-4


def test_in_time_it_turns_along_its_course() -> None:
    """At half of the ramp half of the angle: on the circle, where a straight way would be half of the chord."""
    report = run("""param full = 180 deg
support grip = rotated(bar, where = x >= 20 mm, axis = +z, angle = full, amplitude = ramp(over = 0.2 s))
analysis swing = dynamic(duration = 0.1 s, step = 5 ms)
model hexes = fem(hex8, strain = corotational, size = 10 mm)
probe end = point(bar, at = (20, 0, 0) mm)
metric there = displacement(end, along = +y)""")
    seen = report.models["hexes"].probes["end"]
    assert np.allclose(seen.displacement, [[-0.02, 0.02, 0.0]], atol=1e-12)


CLAMPED = """support wall = fixed(bar, where = x <= 0 mm)
support grip = rotated(bar, where = x >= 20 mm, axis = +x, through = (0, 5, 5) mm, angle = {angle} deg{course})
model hexes = fem(hex8, strain = corotational, size = 10 mm)"""


@pytest.mark.slow
@pytest.mark.parametrize("angle", [270, 360, 540, 720])
def test_a_turn_that_cells_cannot_follow_is_no_answer(angle: int) -> None:
    """Two coarse cells between clamps: found before were the twists by 90, 0, 180 and 0 degrees, 360 and 720 less."""
    text = BODY.format(rest=CLAMPED.format(angle=angle, course=""))
    model = softmark.loads(text).run().models["hexes"]
    assert model.status == "not_converged"
    assert "use smaller cells" in str(model.message)
    assert model.solve["iterations"] < 200  # refused on the path from rest, once


@pytest.mark.slow
def test_a_whole_turn_in_states_that_cells_cannot_follow_is_no_answer() -> None:
    """The state at half of the turn has an answer, and the whole turn is no state without twist."""
    text = "analysis turn = static(states = [50, 100] %)\n" + CLAMPED.format(
        angle=360, course=", amplitude = per_state"
    )
    model = softmark.loads(BODY.format(rest=text)).run().models["hexes"]
    assert [state.status for state in model.each] == ["converged", "not_converged"]


@pytest.mark.slow
def test_a_bar_whose_cells_follow_keeps_its_whole_turns() -> None:
    """Torque and energy of a slender bar, by 180 and 360 degrees, are those of free torsion (Saint-Venant 1855).

    Within 5 %: its clamped ends do not warp, over about a tenth of the thickness each, and large strain counts.
    """
    for angle in (180, 360):
        metrics = (
            run(
                f"""support wall = fixed(bar, where = x <= 0 mm)
support grip = rotated(bar, where = x >= 60 mm, axis = +x, through = (0, 5, 5) mm, angle = {angle} deg)
model hexes = fem(hex20, strain = finite, size = 10 mm)
metric stored = strain_energy(bar)
metric torque = moment(grip, along = +x)""",
                length=60,
            )
            .models["hexes"]
            .metrics
        )
        torque = 60e3 / 2.6 * 0.140577 * 0.01**4 * math.radians(angle) / 0.06  # REFERENCES 3.2
        assert metrics["torque"].value == pytest.approx(torque, rel=0.05)
        assert metrics["stored"].value == pytest.approx(0.5 * torque * math.radians(angle), rel=0.05)
