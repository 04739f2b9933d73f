"""Free rigid bodies in motion: what they hit and how they fly on, against closed forms and laws of conservation."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from softmark import loads

COLUMN = """softmark 1
scene "a plate dropped on a column"
material gel   = linear_elastic(young = 100 kPa, poisson = 0, density = 1 kg/m^3)
body     bar   = solid(box(size = (10, 10, 40) mm), gel)
body     plate = rigid(box(size = (20, 20, 5) mm, origin = (-5, -5, 40.01) mm), mass=10 g, velocity = (0, 0, -0.2) m/s)
support  floor = fixed(bar, where = z <= 0 mm)
load     fall  = gravity(9.81 m/s^2)
contact  hit   = rigid_contact(plate, bar)
analysis fly   = dynamic(duration = 26 ms, step = 0.2 ms, integrator = {integrator})
model    hexes = fem(hex8, strain = small, size = 10 mm)
probe    top   = point(bar, at = (5, 5, 40) mm)
metric   way   = displacement(top, along = -z)
"""

HIT = """softmark 1
scene "a free ball and a free block"
material gel   = neo_hookean(young = 200 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     block = solid(box(size = (20, 20, 20) mm), gel)
body     stone = rigid({shape}, density = 3000 kg/m^3, velocity = (0.3, 0, -1) m/s, spin = (5, 0, 20) rad/s)
contact  hit   = rigid_contact(stone, block)
analysis fly   = dynamic(duration = {end}, step = {step}, integrator = {integrator})
model    hexes = fem(hex8, strain = finite, size = 10 mm)
probe    top   = point(block, at = (10, 10, 20) mm)
metric   way   = displacement(top, along = -z)
"""
BALL = "sphere(radius = 8 mm, origin = (13, 11, 28.1) mm)"
FAR = "cylinder(radius = 3 mm, length = 20 mm, axis = (0.6, 0, 0.8), origin = (0, 0, 300) mm)"


def run(text: str, name: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """What a report says of the solution, and of the free body, as arrays over time."""
    model = loads(text).run().models["hexes"]
    assert model.status == "converged"
    return model.solve, {key: np.array(values) for key, values in model.solve["rigid"][name].items()}


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize("integrator", ["trapezoidal", "generalized_alpha"])
def test_a_plate_on_a_column_is_a_mass_on_a_spring(integrator: str) -> None:
    """Of a column that weighs 4e-4 of the plate: z = -m g / k (1 - cos w t) - v / w sin w t, w^2 = k / m = E A / (L m).

    To 1 % of the deepest while it presses: waves in the column run to and fro 26 times and shake it by what it weighs.
    It leaves as fast as it came, to 1 %: energy is kept but for what the impact shakes.
    """
    solve, plate = run(COLUMN.format(integrator=integrator), "plate")
    m, k, g, drop = 0.01, 1e5 * 1e-4 / 0.04, 9.81, 1e-5
    w, v = (k / m) ** 0.5, (0.2**2 + 2.0 * g * drop) ** 0.5
    t = plate["times_s"] - (v - 0.2) / g
    z = -m * g / k * (1.0 - np.cos(w * t)) - v / w * np.sin(w * t)
    seen = plate["middle_m"][:, 2] - 0.0425
    on = (t > 0.0) & (t < 0.9 * np.pi / w)
    assert seen[on] == pytest.approx(z[on], abs=0.01 * np.abs(z).max())
    end = np.array(plate["velocity_m_s"][-1])
    assert (end[2] ** 2 + 2.0 * g * seen[-1]) ** 0.5 == pytest.approx(v, rel=0.01)
    assert np.abs(plate["rotation_rad"]).max() < 1e-9
    assert solve["energy"]["gain"] < 1e-5  # trapezoidal 1e-14, generalized_alpha 5e-6, which does not keep energy


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("integrator", [
    "implicit_euler", *(pytest.param(i, marks=pytest.mark.slow) for i in ("trapezoidal", "generalized_alpha", "bdf2"))
])  # fmt: skip
def test_what_a_ball_gives_a_block_takes(integrator: str) -> None:
    """Momentum of both: to 1e-8, which is the tolerance of a step. Contact does not turn a ball about its middle.

    What presses where it is at the end of a step brings energy where a surface is round, of a ball that is held as well
    (dynamics/dynamic_contact.py): 2.5e-3, 1.9e-3 and 6e-4 at steps of 0.4, 0.2 and 0.1 ms; implicit Euler takes more
    than that.
    """
    step = "0.4 ms" if integrator == "implicit_euler" else "0.2 ms"
    solve, ball = run(HIT.format(shape=BALL, integrator=integrator, end="20 ms", step=step), "stone")
    m, block = 3000.0 * 4.0 / 3.0 * np.pi * 0.008**3, 8e-3
    last = solve["impacts"][-1]
    at = int(np.argmin(np.abs(ball["times_s"] - last["end_s"])))
    v = ball["velocity_m_s"]
    assert m * v[at] + block * np.array(last["after_m_s"]) == pytest.approx(m * v[0], abs=1e-8 * m)
    assert np.linalg.norm(v[at] - v[0]) > 0.5
    assert ball["spin_rad_s"][-1] == pytest.approx([5.0, 0.0, 20.0], abs=1e-6)
    assert solve["energy"]["gain"] < (1e-9 if integrator == "implicit_euler" else 2.5e-3)


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize("integrator", ["trapezoidal", "bdf2"])
def test_a_top_without_torque(integrator: str) -> None:
    """Its axis goes round its angular momentum L at |L| / J1, and it turns about that axis by (1 - J3 / J1) w3 besides.

    J1 across the axis, J3 along it (Landau and Lifshitz 1976, section 33). Over one radian in 100 steps: the method is
    of second order in 0.01, to 1e-3 with its constants. Angular momentum in space to 1e-3 as well.
    """
    _, top = run(HIT.format(shape=FAR, integrator=integrator, end="50 ms", step="0.5 ms"), "stone")
    r, length = 0.003, 0.02
    J1, J3 = (3.0 * r**2 + length**2) / 12.0, 0.5 * r**2
    axis, w, t = np.array([0.6, 0.0, 0.8]), np.array([5.0, 0.0, 20.0]), top["times_s"][-1]
    L = J1 * w + (J3 - J1) * (axis @ w) * axis
    from scipy.spatial.transform import Rotation as Turn

    right = Turn.from_rotvec(L / J1 * t) * Turn.from_rotvec((1.0 - J3 / J1) * (axis @ w) * t * axis)
    off = (right * Turn.from_rotvec(top["rotation_rad"][-1]).inv()).magnitude()
    assert off < 1e-3 * float(np.linalg.norm(w) * t)
    now = Turn.from_rotvec(top["rotation_rad"][-1]).apply(axis)
    spin = top["spin_rad_s"][-1]
    assert J1 * spin + (J3 - J1) * (now @ spin) * now == pytest.approx(L, abs=1e-3 * float(np.linalg.norm(L)))
    assert top["middle_m"][-1] == pytest.approx(top["middle_m"][0] + t * np.array([0.3, 0.0, -1.0]), abs=1e-12)


def test_damping_of_a_body_brakes_no_free_one() -> None:
    """A stone that has yet to meet anything flies as it was thrown, whatever takes speed from the body: to rounding."""
    text = HIT.format(shape=FAR, integrator="trapezoidal, damping_mass = 200 / (1 s)", end="4 ms", step="1 ms")
    _, stone = run(text.replace("spin = (5, 0, 20)", "spin = (0, 0, 0)"), "stone")
    assert stone["velocity_m_s"][-1] == pytest.approx([0.3, 0.0, -1.0], abs=1e-12)
    assert stone["middle_m"][-1] - stone["middle_m"][0] == pytest.approx([1.2e-3, 0.0, -4e-3], abs=1e-12)


def test_pictures_show_a_free_body_where_it_is() -> None:
    """A brick that turns about a principal axis: 20 rad/s about z, and as far as it was thrown, at every moment."""
    shape = "box(size = (2, 3, 4) mm, origin = (0, 0, 300) mm)"
    text = HIT.format(shape=shape, integrator="trapezoidal", end="40 ms", step="5 ms")
    seen = loads(text.replace("spin = (5, 0, 20)", "spin = (0, 0, 20)")).run().models["hexes"].shape
    assert seen is not None
    assert seen.times is not None
    (stone,) = seen.instruments
    middle = np.array([1.0, 1.5, 302.0]) * 1e-3
    for i, t in enumerate(seen.times):
        c, s = np.cos(20.0 * t), np.sin(20.0 * t)
        Q = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        right = (stone.X - middle) @ Q.T + middle + t * np.array([0.3, 0.0, -1.0])
        np.testing.assert_allclose(stone.at(i), right, atol=1e-5)


PUSHED = """softmark 1
scene "a free stone is pushed and turned"
material gel   = neo_hookean(young = 200 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     block = solid(box(size = (20, 20, 20) mm), gel)
body     stone = rigid(box(size = (30, 20, 10) mm, origin = (100, 0, 0) mm), mass = 12 g, spin = (3, -2, 5) rad/s)
contact  hit   = rigid_contact(stone, block)
load     push  = point_force(stone, at = (130, 20, 10) mm, vector = (0.02, 0.01, 0.03) N)
load     turn  = torque(stone, moment = (1e-4, 2e-4, -1e-4) N*m, amplitude = ramp(over = 50 ms))
analysis fly   = dynamic(duration = 100 ms, step = 2 ms, integrator = {integrator})
model    hexes = fem(hex8, strain = finite, size = 10 mm)
probe    top   = point(block, at = (10, 10, 20) mm)
metric   way   = displacement(top, along = -z)
"""


def flown(t: float) -> tuple[Any, Any, Any]:
    """How far that stone has gone, m, its rotation and its spin, rad/s: Euler's equations in space, by Runge-Kutta."""
    from scipy.integrate import solve_ivp
    from scipy.spatial.transform import Rotation

    F, M, m, middle = np.array([0.02, 0.01, 0.03]), np.array([1e-4, 2e-4, -1e-4]), 0.012, np.array([0.115, 0.01, 0.005])
    J0, arm = m / 12.0 * np.diag([5e-4, 1e-3, 1.3e-3]), np.array([0.13, 0.02, 0.01]) - middle

    def rates(t: float, y: Any) -> Any:
        v, q, w = y[3:6], y[6:10], y[10:]
        Q = Rotation.from_quat(q / np.linalg.norm(q)).as_matrix()
        J = Q @ J0 @ Q.T
        turned = np.cross(Q @ arm, F) + M * min(t / 0.05, 1.0) - np.cross(w, J @ w)
        dq = 0.5 * np.concatenate([q[3] * w + np.cross(w, q[:3]), [-w @ q[:3]]])
        return np.concatenate([v, F / m, dq, np.linalg.solve(J, turned)])

    start = np.concatenate([np.zeros(6), [0.0, 0.0, 0.0, 1.0, 3.0, -2.0, 5.0]])
    y = solve_ivp(rates, (0.0, t), start, rtol=1e-10, atol=1e-13).y[:, -1]
    return y[:3], Rotation.from_quat(y[6:10]), y[10:]


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize(
    "integrator", ["trapezoidal", *(pytest.param(i, marks=pytest.mark.slow) for i in ("generalized_alpha", "bdf2"))]
)
def test_a_stone_that_is_pushed_and_turned(integrator: str) -> None:
    """F = m a of its middle, to rounding; turns by a force at its corner and a torque to second order.

    At steps of 2 ms its rotation is off by 4e-4, of bdf2 1.2e-3, and its spin by 8e-4 and 3.5e-3: a quarter of that at
    half the step.
    """
    from scipy.spatial.transform import Rotation

    _, stone = run(PUSHED.format(integrator=integrator), "stone")
    way, turn, spin = flown(0.1)
    assert stone["middle_m"][-1] - stone["middle_m"][0] == pytest.approx(way, rel=1e-9)
    off = (turn * Rotation.from_rotvec(stone["rotation_rad"][-1]).inv()).magnitude()
    assert off < (1.5e-3 if integrator == "bdf2" else 5e-4)
    assert stone["spin_rad_s"][-1] == pytest.approx(spin, abs=(4e-3 if integrator == "bdf2" else 1e-3) * 13.0)


@pytest.mark.long
@pytest.mark.slow
def test_a_free_plate_slides_until_friction_has_its_speed() -> None:
    """On a slab that deforms it stops after v^2 / (2 mu g), to 1 % of implicit Euler at these steps, and stays.

    The slab is pulled along by mu N meanwhile, to 1e-3 as the plate leans by 1e-4; it bears its weight, to 1 %, in the
    mean.
    """
    text = """softmark 1
scene "a free plate on a slab"
material rubber = linear_elastic(young = 500 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     slab   = solid(box(size = (30, 20, 5) mm, origin = (0, 0, -5) mm), rubber)
body     plate  = rigid(box(size = (60, 40, 2) mm, origin = (-18.4, -10, 0) mm), mass=10 g, velocity = (0.2, 0, 0) m/s)
support  floor  = fixed(slab, where = z <= -5 mm)
load     weight = gravity(9.81 m/s^2)
contact  rub    = rigid_contact(plate, slab, friction = 0.3)
analysis slide  = dynamic(duration = 80 ms, step = 0.5 ms)
model    hexes  = fem(hex8, size = 10 mm, strain = small)
metric   push   = force(rub, along = -z)
metric   drag   = force(rub, along = +x)
"""
    report = loads(text).run().models["hexes"]
    assert report.status == "converged"
    plate = {key: np.array(values) for key, values in report.solve["rigid"]["plate"].items()}
    way = plate["middle_m"][:, 0] - plate["middle_m"][0, 0]
    assert way[-1] == pytest.approx(0.2**2 / (2.0 * 0.3 * 9.81), rel=0.01)
    assert np.ptp(way[plate["times_s"] > 0.075]) < 1e-5
    push, drag = (report.metrics[name].curve for name in ("push", "drag"))
    assert push is not None
    assert drag is not None
    slides = (push.x > 5e-3) & (push.x < 60e-3)
    assert drag.y[slides] == pytest.approx(0.3 * push.y[slides], rel=1e-3)
    assert push.y[slides].mean() == pytest.approx(0.0981, rel=0.01)


@pytest.mark.long
@pytest.mark.slow
def test_what_friction_turns_of_a_ball_the_block_takes() -> None:
    """Momentum of both to 1e-8. The ball's moment of momentum about the origin changes by what the contact's moment on
    the block sums up to, to 3e-3 at steps of .2 ms: its arms are those of the ends of steps, of first order."""
    text = HIT.format(shape=BALL, integrator="trapezoidal", end="10 ms", step="0.2 ms")
    text = text.replace("rigid_contact(stone, block)", "rigid_contact(stone, block, friction = 0.3)")
    text += "".join(f"metric m{a} = moment(hit, along = +{a}, about = (0, 0, 0) mm)\n" for a in "xyz")
    report = loads(text).run().models["hexes"]
    assert report.status == "converged"
    ball = {key: np.array(values) for key, values in report.solve["rigid"]["stone"].items()}
    m, x, v, w = 3000.0 * 4.0 / 3.0 * np.pi * 0.008**3, *(ball[k] for k in ("middle_m", "velocity_m_s", "spin_rad_s"))
    assert m * (v[-1] - v[0]) == pytest.approx(-np.array(report.solve["momentum"]["contacts_Ns"]), abs=1e-8 * m)
    L = m * np.cross(x, v) + 0.4 * m * 0.008**2 * w
    curves = [report.metrics[f"m{a}"].curve for a in "xyz"]
    given = np.array([np.trapezoid(c.y, c.x) for c in curves if c is not None])
    assert L[-1] - L[0] == pytest.approx(-given, abs=3e-3 * float(np.linalg.norm(given)))
    assert np.linalg.norm(w[-1] - w[0]) > 5.0


@pytest.mark.parametrize("turned", [False, True])
def test_rigid_bodies_that_pass_through_each_other_are_told(turned: bool) -> None:
    """A stone comes to a wall that stays, 10 mm off, after 20 ms (W639), unless a quarter turn keeps it short of that.

    It is a rod of 40 mm along x, which turns about z by 25 pi rad/s: it lies along y when its end would be there.
    """
    spin = 25.0 * np.pi if turned else 0.0
    text = HIT.format(shape="box(size = (40, 4, 4) mm, origin = (100, 0, 0) mm)", integrator="trapezoidal", end="25 ms",
                      step="1 ms")  # fmt: skip
    text = text.replace("velocity = (0.3, 0, -1) m/s, spin = (5, 0, 20) rad/s",
                        f"velocity = (0.5, 0, 0) m/s, spin = (0, 0, {spin}) rad/s")  # fmt: skip
    text += "body wall = rigid(half_space(normal = (-1, 0, 0), origin = (150, 0, 0) mm))\n"
    text += "contact stays = rigid_contact(wall, block)\n"
    report = loads(text).run()
    said = [w.message for w in report.warnings if w.code == "W639"]
    assert said == ([] if turned else ["`stone` passes through `wall`: there is no contact between rigid bodies"])
