"""Contact in motion, from a scene to what a report says of it."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import pytest

import softmark

BAR = """
material rod  = linear_elastic(young = 1 MPa, poisson = 0, density = 1000 kg/m^3)
body     bar  = solid(box(size = (10, 10, 40) mm, origin = (0, 0, {away}) mm), rod)
body     wall = rigid(half_space(normal = (0, 0, 1)))
{more}contact  hit  = rigid_contact(wall, bar)
analysis fly  = dynamic(duration = {end}, step = 0.1 ms, velocity = (0, 0, {speed}) m/s, integrator = trapezoidal)
model    hexes = fem(hex8, size = 10 mm, strain = small)
probe    head = point(bar, at = (5, 5, {away}) mm)
metric   near = displacement(head, along = +z)
"""


def written(folder: Path, **given: object) -> Path:
    file = folder / f"{folder.name}.scene"
    file.write_text(BAR.format(**{"away": 0.1, "end": "5 ms", "speed": -0.1, "more": "", **given}), encoding="utf-8")
    return file


@pytest.mark.slow
@pytest.mark.long
def test_a_report_tells_of_impacts_and_energies(tmp_path: Path, report_of: Callable[[Path], softmark.Report]) -> None:
    """One impact for 2 L / c = 2.5 ms to three steps, that leaves .9 of the speed at least; energies add up.

    None is gained: strain is linear, and the surface flat, so that the proof of solvers/dynamics/dynamic_contact.py
    holds.
    """
    solve = report_of(written(tmp_path)).models["hexes"].solve
    (bounce,) = solve["impacts"]
    assert 0.9 < bounce["restitution"] <= 1.0
    assert bounce["end_s"] - bounce["begin_s"] == pytest.approx(2.53e-3, abs=3e-4)
    assert bounce["before_m_s"] == pytest.approx([0.0, 0.0, -0.1], abs=1e-9)
    assert solve["energy"]["gain"] < 1e-9
    energies = solve["energies"]
    assert max(energies["contact"]) > 0.0
    assert set(energies["contact_work"]) == {0.0}


@pytest.mark.slow
def test_a_wall_follows_its_course_and_works(tmp_path: Path, report_of: Callable[[Path], softmark.Report]) -> None:
    """A wall that comes at .1 m/s brings 1/2 m (2 v)^2 = 8e-5 J to a bar of 4 g at rest: to 10 %, of which the
    integrator has lost what is missing."""
    more = "support  hand = displaced(wall, by = (0, 0, 1) mm, amplitude = ramp(over = 10 ms))\n"
    solve = report_of(written(tmp_path, speed=0, more=more)).models["hexes"].solve
    assert solve["energies"]["contact_work"][-1] == pytest.approx(8e-5, rel=0.1)
    assert [bounce["restitution"] for bounce in solve["impacts"]] == [None]  # as seen from the wall it would be one
    assert solve["energy"]["gain"] < 1e-9


@pytest.mark.slow
@pytest.mark.long
def test_a_report_tells_of_friction(tmp_path: Path, report_of: Callable[[Path], softmark.Report]) -> None:
    """A bar on its side slides on the wall that it lies on: how far, what sticks, and its heat, which never falls.

    It has lost mu g t of its .1 m/s after 10 ms: slip is v t - mu g t^2 / 2, to 5 %, as its weight comes at once and
    implicit Euler goes by the speeds of the ends of steps.
    """
    file = written(tmp_path, speed=0, end="10 ms", away=0.001)
    text = file.read_text(encoding="utf-8").replace(
        "rigid_contact(wall, bar)", "rigid_contact(wall, bar, friction = 0.3)"
    )
    text = text.replace("(0, 0, 0) m/s, integrator = trapezoidal", "(0.1, 0, 0) m/s").replace("0.1 ms", "0.5 ms")
    text = text.replace("(10, 10, 40)", "(40, 10, 10)")  # which does not bend
    file.write_text(text + "load     sag  = gravity(9.81 m/s^2)\n", encoding="utf-8")
    solve = report_of(file).models["hexes"].solve
    told, heat = solve["friction"]["hit"], solve["energies"]["friction"]
    assert len(told["slip_m"]) == len(told["sticks"]) == len(solve["times"])
    assert told["slip_m"][-1] == pytest.approx(0.1 * 0.01 - 0.5 * 0.3 * 9.81 * 0.01**2, rel=0.05)
    assert all(b >= a for a, b in pairwise(heat))
    assert told["sticks"][-1] == 0.0


@pytest.mark.parametrize("step", ["0.1 ms", "0.01 ms"])
def test_what_touches_at_the_start_is_not_thrown_off(
    step: str, tmp_path: Path, report_of: Callable[[Path], softmark.Report]
) -> None:
    """A bar that lies on a floor settles under its weight by steps of any length: its barrier stores nothing at first.

    It moves with no more energy than gravity gives as it is pressed together, by at most twice what it sags at rest,
    w L / (2 E) of its weight w per area (the barrier, 1e-5 of its size, is a thousandth of that).
    """
    sag = "load     sag  = gravity(9.81 m/s^2, direction = -z)\n"
    file = written(tmp_path, away=0, end="0.4 ms", speed=0, more=sag)
    file.write_text(file.read_text().replace("0.1 ms", step), encoding="utf-8")
    energies = report_of(file).models["hexes"].solve["energies"]
    pressure, area, long = 1e3 * 9.81 * 0.04, 1e-4, 0.04
    assert energies["contact"][0] == 0.0
    assert 0.0 < max(energies["kinetic"]) < pressure * area * 2.0 * 0.5 * pressure * long / 1e6
