"""Tendons as scenes ask for them: against the equations of Rucker and Webster, in states and in motion, and checked."""

from __future__ import annotations

import numpy as np
import pytest
from loaded_modules import loaded_by
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import softmark
from softmark.solvers.energies.rod_kinematics import RodElements
from softmark.solvers.energies.rod_tendons import RodTendons

BODY = """material gum = linear_elastic(young = 1.8 MPa, poisson = 0.3, density = 1000 kg/m^3)
body bar = solid({shape}, gum)
support wall = fixed(bar, where = x {wall} mm)
probe axis = line(bar, from = (0, 0, 0) mm, to = (200, 0, 0) mm, points = 5)
probe tip = point(bar, at = (200, 0, 0) mm)
metric up = displacement(tip, along = +z)
"""
ROUND = "cylinder(length = 200 mm, radius = 3 mm)"
STRAIGHT = "load pull = tendon(bar, from = (0, 0, 8) mm, to = (200, 0, 8) mm, tension = {tension}{more})\n"


def run(text: str, shape: str = ROUND, wall: str = "<= 0") -> softmark.Report:
    return softmark.loads(BODY.format(shape=shape, wall=wall) + text).run()


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize(
    ("shape", "wall"),
    [
        (ROUND, "<= 0"),
        pytest.param("box(size = (200, 6, 5) mm, origin = (0, -3, -2.5) mm)", ">= 200", marks=pytest.mark.slow),
    ],
)
def test_any_tendons_come_to_the_theory_with_the_square_of_the_segments(shape: str, wall: str) -> None:
    """One that winds, one on a slant over a part, said from its far end, a weight and a force at the free end.

    Of second order: between 3.5 and 4.5 times nearer with twice as many segments. The other end may be the clamp.
    """
    free = 200 if wall == "<= 0" else 0
    report = run(f"""param around = -200 deg
load wind = tendon(bar, from = (0, 0, 8) mm, to = (200, 0, 8) mm, tension = 80 mN, winding = around)
load slant = tendon(bar, from = (100, -4, 2) mm, to = (0, -8, 0) mm, tension = 60 mN)
load weight = gravity(5 m/s^2, direction = (0, 1, -1))
load push = point_force(bar, at = ({free}, 0, 0) mm, vector = (1, 1, 0) mN)
model coarse = beam6dof(segments = 20)
model fine = beam6dof(segments = 40)
reference theory = rucker_webster(bar)
metric off = max_error(axis, against = theory)
""", shape, wall)  # fmt: skip
    coarse, fine = (report.models[n].metrics["off"].value for n in ("coarse", "fine"))
    assert fine is not None
    assert fine < 5e-4
    assert coarse / fine == pytest.approx(4.0, abs=0.5)
    assert {m.solve["checks"]["residual"] < 1e-8 for m in report.models.values()} == {True}


def rod_of(text: str, segments: int = 6) -> softmark.ModelResult:
    return run(text + f"model rod = beam6dof(segments = {segments})\n").models["rod"]


def up(rod: softmark.ModelResult) -> float:
    value = rod.metrics["up"].value
    assert value is not None
    return value


def test_what_a_tendon_comes_to_and_does() -> None:
    """No force and no moment; as work the tension times what is pulled out, twice what is stored, for all is linear.

    Two at half the tension are one; on opposite sides they press alone.
    """
    more = "metric done = work(pull)\nmetric stored = strain_energy(bar)\nmetric held = force(wall, along = +x)\n"
    rod = rod_of(STRAIGHT.format(tension="20 mN", more="") + more)
    told = rod.loads["pull"]
    assert told.exact_force == (0.0, 0.0, 0.0)
    assert np.abs([*told.force, *told.moment]).max() < 1e-16
    done, stored, held = (rod.metrics[n].value for n in ("done", "stored", "held"))
    assert done == pytest.approx(2 * stored, rel=1e-8)
    assert abs(held) < 1e-10
    half = STRAIGHT.format(tension="10 mN", more="")
    too = half.replace("load pull", "load too")
    assert up(rod_of(half + too)) == pytest.approx(up(rod), rel=1e-8)
    pressed = rod_of(half + too.replace(", 8)", ", -8)") + "metric back = displacement(tip, along = -x)\n")
    assert abs(up(pressed)) < 1e-9
    assert pressed.metrics["back"].value == pytest.approx(0.02 * 0.2 / (1.8e6 * np.pi * 9e-6), rel=1e-7)


def span(T: float, h: float, d: float, EA: float, GA: float, EI: float) -> tuple[float, np.ndarray]:
    """From one guide to the next of a rod with a tendon at a distance d, in its plane: the angle, and the way (2,), m.

    What it carries is the opposite of the tendon: - T t along the chord, and the moment of that. Shot from one guide
    with the direction of the chord that meets the next.
    """

    def shot(psi: float) -> tuple[np.ndarray, float]:
        t, begin = np.array([np.cos(psi), np.sin(psi)]), np.array([0.0, d])

        def rate(s: float, y: np.ndarray) -> np.ndarray:
            e1, e2 = np.array([np.cos(y[2]), np.sin(y[2])]), np.array([-np.sin(y[2]), np.cos(y[2])])
            away = begin - y[:2]
            moment = -T * (away[0] * t[1] - away[1] * t[0])
            return np.array([*((1.0 - T * t @ e1 / EA) * e1 - T * t @ e2 / GA * e2), moment / EI])

        y = solve_ivp(rate, (0.0, h), np.zeros(3), rtol=1e-11, atol=1e-14).y[:, -1]
        way = y[:2] + d * np.array([-np.sin(y[2]), np.cos(y[2])]) - begin
        return y, float(way[0] * t[1] - way[1] * t[0])

    angle = brentq(lambda psi: shot(psi)[1], -1.0, 1.0, xtol=1e-14)
    y = shot(angle)[0]
    return float(y[2]), y[:2]


@pytest.mark.slow
def test_between_guides_a_tendon_is_straight() -> None:
    """Six discs on a rod that would be bent by half a turn, guided all along: every span is the same, shot by itself.

    Of 8 and 16 segments in a span, of second order, carried on to none: to 5e-5 of the length, 228 degrees.
    """
    E, A, EI = 1.8e6, np.pi * 9e-6, 1.8e6 * np.pi / 4 * 81e-12
    GA = 6 * 1.3 / (7 + 6 * 0.3) * E / 2.6 * A
    T = float(np.pi * EI / (0.2 * 0.008))
    turn, way = span(T, 0.04, 0.008, E * A, GA, EI)
    turns = turn * np.arange(5)
    c, s = np.cos(turns), np.sin(turns)
    tip = [(c * way[0] - s * way[1]).sum(), 0.0, (s * way[0] + c * way[1]).sum()]
    text = STRAIGHT.format(tension=f"{T} N", more=", guides = 6")
    coarse, fine = rod_of(text, 40), rod_of(text, 80)
    u, v = (rod.probes["tip"].displacement[0] for rod in (coarse, fine))
    np.testing.assert_allclose((4.0 * v - u) / 3.0 + [0.2, 0.0, 0.0], tip, atol=5e-5 * 0.2)
    assert fine.solve["checks"]["residual"] < 1e-8
    smooth = rod_of(text.replace(", guides = 6", ""), 80).probes["tip"].displacement[0]
    assert np.linalg.norm(smooth - v) > 0.1 * 0.2


@pytest.mark.long
@pytest.mark.slow
def test_in_states_and_in_motion_it_follows_its_course() -> None:
    """At half its tension it is where it is with half; damped from a ramp, it comes to rest there to 10 um."""
    two = STRAIGHT.format(tension="20 mN", more=", amplitude = per_state")
    states = rod_of(two + "analysis rest = static(states = [50, 100] %)\n").metrics["up"].states
    for tension, value in zip(("10 mN", "20 mN"), states, strict=True):
        assert value == pytest.approx(up(rod_of(STRAIGHT.format(tension=tension, more=""))), rel=1e-7)
    damped = "damping_mass = 12 Hz, integrator = bdf2, tolerance = 1e-9"
    moved = rod_of(STRAIGHT.format(tension="20 mN", more=", amplitude = ramp(over = 0.3 s)")
                   + f"analysis motion = dynamic(duration = 3 s, step = 50 ms, {damped})\n")  # fmt: skip
    assert moved.status == "converged"
    assert moved.probes["axis"].displacement[-1, 2] == pytest.approx(states[-1], abs=1e-5)


def test_a_tendon_that_pulls_otherwise_than_it_should_is_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its pull taken a thousandth too large, forces and tangents alike: by other formulas it does not balance."""
    right = RodTendons._directions_and_lengths

    def wrong(tendons: RodTendons, segments: RodElements) -> tuple[np.ndarray, np.ndarray]:
        y, size = right(tendons, segments)
        return 1.001 * y, size

    monkeypatch.setattr(RodTendons, "_directions_and_lengths", wrong)
    rod = rod_of(STRAIGHT.format(tension="20 mN", more=""))
    assert rod.status == "failed"
    assert "balance" in rod.message


@pytest.mark.slow
def test_a_scene_without_tendons_imports_nothing_for_them() -> None:
    scene = (
        BODY.format(shape=ROUND, wall="<= 0") + "load weight = gravity(1 m/s^2)\nmodel rod = beam6dof(segments = 4)\n"
    )
    assert not {m for m in loaded_by(scene) if ("tendon" in m or "driven" in m) and "vocabulary" not in m}
