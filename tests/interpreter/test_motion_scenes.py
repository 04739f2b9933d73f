"""Dynamic analyses as scenes ask for them: where motion ends, what it conserves, what it overshoots, how it fails."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest

import softmark
from softmark.solvers.mesh.shapes import Box

BAR = """
material gel  = linear_elastic(young = 1 MPa, poisson = 0, density = 1000 kg/m^3)
body     bar  = solid(box(size = (400, 20, 20) mm), gel)
support  wall = fixed(bar, where = x <= 0 mm)
probe    tip  = point(bar, at = (400, 10, 10) mm)
metric   end  = displacement(tip, along = +x)
"""
SPEED = (1e6 / 1000.0) ** 0.5  # m/s, of waves along the bar: sqrt(E / rho)
PERIOD = 4 * 0.4 / SPEED  # s, of its lowest oscillation along itself: 4 L / c
STRETCH = 1e3 / 1e6 * 0.4  # m, under 1 kPa: p L / E
PULL = "load pull = traction(bar, where = x >= 400 mm, vector = (1, 0, 0) kPa{course})\n"
HEXES = "model cells = fem(hex8, strain = small, size = 20 mm{more})\n"


def run(text: str) -> softmark.Report:
    report = softmark.loads(text).run()
    json.loads(report.dumps())  # every number is finite
    return report


def moving(duration: float, step: float, more: str = "") -> str:
    return f"analysis motion = dynamic(duration = {duration} s, step = {step} s{more})\n"


def course_of(report: softmark.Report, model: str, probe: str) -> tuple[np.ndarray, np.ndarray]:
    result = report.models[model].probes[probe]
    assert result.times is not None
    assert result.course is not None
    return result.times, result.course


# ------------------------------------------------------------------ where it ends

BLOCK = """
material gel    = neo_hookean(young = 60 kPa, poisson = {nu}, density = 1000 kg/m^3)
body     block  = solid(box(size = (60, 20, 20) mm), gel)
support  wall   = fixed(block, where = x <= 0 mm)
load     weight = gravity(9.81 m/s^2)
probe    axis   = line(block, from = (0, 10, 10) mm, to = (60, 10, 10) mm, points = 7)
{models}
"""
DAMPED = ", spectral_radius = 0.5, damping_mass = 40 Hz, tolerance = 1e-9"
KINDS = """
model tets    = fem(tet4, strain = corotational, size = 10 mm, mass = lumped)
model quads   = fem(tet10, strain = corotational, size = 20 mm)
model hexes   = fem(hex8, strain = finite, integration = selective, size = 10 mm)
model springs = mass_spring(size = 10 mm, network = hex8, stiffness = from_material())
"""


@pytest.mark.slow
@pytest.mark.parametrize("integrator", ["implicit_euler", "generalized_alpha"])
def test_what_comes_to_rest_rests_where_the_static_analysis_is(integrator: str) -> None:
    """At rest no step, mass or damping is left in the equations: the same state, to the tolerance of both."""
    text = BLOCK.format(nu="0.4", models=KINDS)
    rest = run(text)
    # the lowest mode has some 4 Hz; damped by a = 40 / s it is near critical: after 1 s, exp(-20) of it is left;
    # of modes far above 1 / step generalized_alpha leaves its spectral radius to the power of 50
    end = run(text + moving(1.0, 0.02, f", integrator = {integrator}{DAMPED}"))
    for name in rest.models:
        still, last = (r.models[name].probes["axis"].displacement for r in (rest, end))
        assert end.models[name].status == "converged"
        np.testing.assert_allclose(last, still, atol=1e-5 * np.abs(still).max())


@pytest.mark.slow
@pytest.mark.long
def test_a_moved_support_ends_where_it_is_moved_to() -> None:
    grip = "support grip = displaced(bar, where = x >= 400 mm, by = (8, 0, 0) mm, components = x{course})\n"
    time = moving(0.5, 0.005, ", damping_mass = 100 Hz")
    report = run(BAR + grip.format(course=", amplitude = smooth(over = 0.1 s)") + HEXES.format(more="") + time)
    times, u = course_of(report, "cells", "tip")
    share = 0.5 - 0.5 * np.cos(np.pi * np.minimum(1.0, times / 0.1))
    np.testing.assert_allclose(u[:, 0, 0], 8e-3 * share, atol=1e-12)


# ------------------------------------------------------------------ what it overshoots


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize(
    ("course", "overshoot", "tolerance"),
    [
        # a sudden load: the tip of an undamped bar swings between 0 and twice its stretch (wave equation); cells of
        # 20 mm cannot follow the kinks of that triangle wave
        ("", 2.0, 0.04),
        # a ramp over many periods, and not a whole number of them: 1 + T / (pi over) at the most for the lowest mode
        (f", amplitude = ramp(over = {20.5 * PERIOD} s)", 1.0, 1.2 / (np.pi * 20.5)),
    ],
    ids=["sudden", "slow"],
)
def test_overshoot(course: str, overshoot: float, tolerance: float) -> None:
    duration = 1.1 * PERIOD if not course else 22 * PERIOD
    step = PERIOD / (200 if not course else 40)
    report = run(
        BAR + PULL.format(course=course) + HEXES.format(more="")
        + moving(duration, step, ", integrator = trapezoidal")
    )  # fmt: skip
    times, u = course_of(report, "cells", "tip")
    assert u[:, 0, 0].max() / STRETCH == pytest.approx(overshoot, abs=tolerance)
    if not course:
        assert times[u[:, 0, 0].argmax()] == pytest.approx(PERIOD / 2, rel=0.05)
    energy = report.models["cells"].solve["energies"]
    assert max(map(abs, energy["drift"])) < 1e-6 * max(energy["strain"])


@pytest.mark.slow
@pytest.mark.long
def test_a_pulse_sends_a_wave_of_the_speed_of_sound() -> None:
    """What is pulled at the end is felt in the middle after L / 2c, and not before."""
    probe = "probe middle = point(bar, at = (200, 10, 10) mm)\n"
    pulse = f", amplitude = pulse(until = {PERIOD / 8} s)"
    report = run(
        BAR + probe + PULL.format(course=pulse) + HEXES.format(more="")
        + moving(PERIOD / 4, PERIOD / 400, ", integrator = trapezoidal")
    )  # fmt: skip
    times, u = course_of(report, "cells", "middle")
    arrived = times[np.argmax(u[:, 0, 0] > 0.05 * STRETCH)]
    # cells of 20 mm smear the front over two or three of them
    assert arrived == pytest.approx(0.2 / SPEED, rel=0.2)


# ------------------------------------------------------------------ what it conserves

FREE = """
material gel   = neo_hookean(young = 60 kPa, poisson = 0.4, density = 1000 kg/m^3)
shape    cells = mesh("block.vtk", unit = 1 m)
body     block = solid(cells, gel)
analysis drift = dynamic(
    duration = {duration} s, step = 1 ms, integrator = midpoint, velocity = (1, 2, -3) m/s, spin = (5, 20, 10) rad/s,
    tolerance = 1e-10
)
model    solid = fem(tet4, strain = finite, mass = uniform)
probe    all   = mesh_nodes(block, mesh = cells)
"""


def test_a_free_block_keeps_its_momentum(tmp_path: Path) -> None:
    """No support, no load: the mean of equal masses moves uniformly, and the angular momentum stays.

    The implicit midpoint rule keeps both to the tolerance of a step (it is symplectic and keeps quadratic invariants).
    Angular momentum is taken from positions alone, sum x_n cross x_{n+1}, which differs by the square of the angle of
    a step, (0.023 rad)^2, and by as little as that from state to state.
    """
    mesh = Box((0.04, 0.02, 0.02)).mesh("tet4", 0.01)
    meshio.write_points_cells(tmp_path / "block.vtk", mesh.points, [("tetra", mesh.cells)])
    (tmp_path / "free.scene").write_text(FREE.format(duration=0.1), encoding="utf-8")
    report = softmark.load(tmp_path / "free.scene").run()
    assert report.exit_status == 0
    times, u = course_of(report, "solid", "all")
    x = report.models["solid"].probes["all"].points + u  # (t, n, 3)
    centre = x.mean(axis=1)
    np.testing.assert_allclose(centre - centre[0], times[:, None] * [1, 2, -3], atol=1e-9)
    about = x - centre[:, None]
    momentum = np.cross(about[:-1], about[1:]).sum(axis=1)
    scale = np.linalg.norm(momentum[0])
    np.testing.assert_allclose(momentum, np.broadcast_to(momentum[0], momentum.shape), atol=2e-3 * scale)
    assert np.linalg.norm(about[-1] - about[0], axis=1).max() > 0.02  # it has turned by 2.3 rad
    energies = report.models["solid"].solve["energies"]
    assert abs(energies["drift"][-1]) < 1e-3 * energies["kinetic"][0]


def test_a_body_at_rest_must_be_held_and_one_in_motion_need_not_be() -> None:
    text = BAR.replace("support  wall = fixed(bar, where = x <= 0 mm)\n", "") + HEXES.format(more="")
    with pytest.raises(softmark.SceneError, match=r"E306"):
        run(text + "load weight = gravity(9.81 m/s^2)\n")
    report = run(text + "load weight = gravity(9.81 m/s^2)\n" + moving(0.2, 0.02, ", integrator = trapezoidal"))
    # free fall: g t^2 / 2, exactly, since the trapezoidal rule integrates a constant acceleration exactly
    _, u = course_of(report, "cells", "tip")
    assert u[-1, 0, 2] == pytest.approx(-9.81 * 0.2**2 / 2, rel=1e-9)


# ------------------------------------------------------------------ what a report keeps


@pytest.mark.slow
@pytest.mark.long
def test_a_history_is_in_the_json_with_its_times() -> None:
    report = run(BLOCK.format(nu="0.4", models=KINDS) + moving(0.1, 0.01))
    for model in json.loads(report.dumps())["models"].values():
        probe = model["probes"]["axis"]
        assert np.shape(probe["points"]) == (7, 3)
        assert np.shape(probe["displacement"]) == (11, 7, 3)  # (t, n, 3), the start included
        np.testing.assert_allclose(probe["times"], np.linspace(0, 0.1, 11), atol=1e-12)
        assert not np.any(probe["displacement"][0])
        assert model["time"]["step_s"]["runs"] == 10
        assert model["time"]["step_s"]["median"] > 0
        assert model["solve"]["reached_s"] == pytest.approx(0.1)
        assert model["solve"]["steps"] == 10
        assert model["solve"]["residual"] <= 1e-6
        assert {len(v) for v in model["solve"]["energies"].values()} == {len(model["solve"]["times"])}


def test_of_a_static_analysis_there_is_none() -> None:
    report = run(BAR + PULL.format(course="") + HEXES.format(more=""))
    data = json.loads(report.dumps())["models"]["cells"]
    assert np.shape(data["probes"]["tip"]["displacement"]) == (1, 3)
    assert "times" not in data["probes"]["tip"]
    assert data["time"]["step_s"]["median"] is None
    assert data["time"]["step_s"]["reason"]
    assert report.models["cells"].metrics["end"].value == pytest.approx(STRETCH, rel=1e-9)


# ------------------------------------------------------------------ how it fails


def explicit(step: float) -> softmark.Report:
    return run(
        BAR + PULL.format(course="") + HEXES.format(more=", mass = lumped")
        + moving(20 * step, step, ", integrator = central_differences")
    )  # fmt: skip


def test_an_explicit_step_that_is_too_long_is_refused_with_the_one_that_is_not() -> None:
    report = explicit(0.01)
    model = report.models["cells"]
    assert (model.status, model.probes, report.exit_status) == ("failed", {}, 3)
    message = str(model.message)
    assert "critical" in message
    found = re.search(r"([\d.]+(?:e-?\d+)?) s\b", message[message.index("critical") :])
    assert found is not None, message
    # 2 / w with the highest frequency of the mesh, whose cells are 20 x 10 x 10 mm: alternating along one of its short
    # edges h alone gives h / c, along all three at once no less than h / (c sqrt 3)
    critical = float(found[1])
    assert 0.01 / SPEED / 3**0.5 < critical < 1.01 * 0.01 / SPEED
    assert explicit(0.9 * critical).models["cells"].status == "converged"


def test_too_few_iterations_halve_the_step_or_end_the_march_and_never_give_nonsense() -> None:
    text = BLOCK.format(nu="0.3", models="model cells = fem(hex8, strain = finite, size = 10 mm)")
    report = run(text + moving(0.1, 0.05, ", max_iterations = 2"))
    cells = report.models["cells"]
    full = run(text + moving(0.1, 0.05))
    assert full.models["cells"].status == "converged"
    assert cells.status == "converged"
    assert "W315" in {w.code for w in report.warnings}
    assert cells.solve["halved"] == len(cells.solve["events"]) > 0
    assert all("halved" in e["what"] for e in cells.solve["events"])
    times, _ = course_of(report, "cells", "axis")
    assert len(times) > len(course_of(full, "cells", "axis")[0])  # the parts are kept
    assert times[-1] == pytest.approx(0.1)


def test_one_iteration_a_step_ends_the_march() -> None:
    text = BLOCK.format(nu="0.3", models="model cells = fem(hex8, strain = finite, size = 10 mm)")
    text += "metric drop = displacement(axis, along = -z)\nmetric frame = realtime_factor(rate = 1 Hz)\n"
    report = run(text + moving(0.1, 0.05, ", max_iterations = 1, tolerance = 1e-12"))
    cells = report.models["cells"]
    assert cells.status == "not_converged"
    assert "smaller step" in str(cells.message)
    assert cells.probes == {}
    # nothing is said of what is not solved, how fast it is least of all
    for metric in cells.metrics.values():
        assert metric.value is None
        assert metric.reason
        assert "verdict" not in metric.details
    assert report.exit_status == 3


@pytest.mark.parametrize(
    ("text", "code"),
    [
        (HEXES.format(more="") + moving(0.1, 0.001, ", integrator = central_differences"), "E508"),
        (HEXES.format(more="") + "analysis motion = dynamic(duration = 1 s, step = 0 s)\n", "E301"),
        (HEXES.format(more="") + "analysis motion = dynamic(duration = 1 s, step = 1 mm)\n", "E204"),
        (HEXES.format(more="") + "analysis motion = dynamic(duration = 1 s, step = 1 ms, integrator = rk4)\n", "E"),
    ],
)  # fmt: skip
def test_what_a_dynamic_analysis_refuses(text: str, code: str) -> None:
    with pytest.raises(softmark.SceneError, match=code):
        run(BAR + PULL.format(course="") + text)


def energies_of(report: softmark.Report) -> dict[str, Any]:
    found: dict[str, Any] = report.models["cells"].solve["energies"]
    return found


def test_numerical_damping_is_in_the_ledger() -> None:
    """Implicit Euler loses energy that the trapezoidal rule keeps; its ledger says how much."""
    text = BAR + PULL.format(course="") + HEXES.format(more="")
    euler = energies_of(run(text + moving(PERIOD, PERIOD / 20, ", integrator = implicit_euler")))
    kept = energies_of(run(text + moving(PERIOD, PERIOD / 20, ", integrator = trapezoidal")))
    assert euler["drift"][-1] < -0.1 * max(kept["strain"])
    assert abs(kept["drift"][-1]) < 1e-6 * max(kept["strain"])


# ------------------------------------------------------------------ courses between steps


STEADY = "analysis time = dynamic(duration = {end} s, step = {step} s, integrator = {name})\n"


@pytest.mark.slow
@pytest.mark.parametrize("name", ["trapezoidal", "generalized_alpha", "bdf2", "midpoint"])
def test_a_pulse_between_two_steps_moves_the_body(name: str) -> None:
    """A pulse of 0.6 of a step, between two, against one of the same impulse that fills a step: 2 % of the swing.

    The bar swings in 160 steps, so that when in a step it is hit moves its phase by 2 pi / 160 at most. Read at steps
    the short pulse is never seen, and nothing moves.
    """
    step = PERIOD / 160
    time = STEADY.format(end=0.5 * PERIOD, step=step, name=name)
    ends = []
    for force, begin, until in ((1.0, 4.2, 4.8), (0.6, 4.0, 5.0)):
        pulse = f", amplitude = pulse(start = {begin * step} s, until = {until * step} s)"
        pull = PULL.format(course=pulse).replace("(1, 0, 0) kPa", f"({force}, 0, 0) kPa")
        _, u = course_of(run(BAR + pull + HEXES.format(more="") + time), "cells", "tip")
        ends.append(u[:, 0, 0])
    assert np.abs(ends[1]).max() > 0.0
    np.testing.assert_allclose(ends[0], ends[1], atol=0.02 * np.abs(ends[1]).max())


def test_a_sine_that_the_step_does_not_show_is_refused() -> None:
    """990 Hz at steps of 1 ms came out as a swing of 10 Hz, 470 times too large."""
    text = BAR + PULL.format(course=", amplitude = sine(frequency = 990 Hz)") + HEXES.format(more="")
    with pytest.raises(softmark.SceneError, match="E381"):
        run(text + STEADY.format(end=0.1, step=1e-3, name="trapezoidal"))
