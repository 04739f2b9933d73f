"""Networks of beams: closed forms of frames, one beam cut in pieces, themselves turned round, a watchdog that bites."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from loaded_modules import loaded_by
from scipy.integrate import solve_bvp
from scipy.optimize import brentq

import softmark
from softmark.interpreter.models.beam_frame import frame_builder
from softmark.interpreter.models.beam_frame.frame_layout import Layout
from softmark.interpreter.pipeline import run_pipeline

E, RHO, A = 200e6, 7.85, 0.02  # Pa, kg/m^3, and the side of square sections, m
EI, LINE = E * A**4 / 12.0, RHO * A * A  # N m^2, kg/m
HEAD = """softmark 1
scene "frames"
material foam = linear_elastic(young = 200 MPa, poisson = 0.3, density = 7.85 kg/m^3)
"""
BEAM = "body bar = network(points = [(0, 0, 0), (1, 0, 0)] m, members = [(1, 2)], material = foam, side = 20 mm)\n"
TIP = """probe tip = point(bar, at = (1, 0, 0) m)
metric ux = displacement(tip, along = +x)
metric uy = displacement(tip, along = +y)
metric uz = displacement(tip, along = +z)
"""


def run(text: str, **options: Any) -> dict[str, Any]:
    """The models of a scene, whose forces balance by other formulas."""
    loaded = softmark.loads(HEAD + text)
    report = run_pipeline.run_scene(loaded.scene, list(loaded.warnings), run_pipeline.RunOptions(draw=False, **options))
    assert {n: m.message for n, m in report.models.items() if m.status != "converged"} == {}
    for name, model in report.models.items():
        balance = model.solve["checks"]["reactions"]
        assert max(balance["force"], balance["moment"]) <= 1e-8, name
        assert balance["apart"] <= 1e-6, name
        assert model.solve["checks"]["residual"] is not None, name
    return dict(report.models)


def tip(model: Any) -> np.ndarray:
    return np.array([model.metrics[f"u{way}"].value for way in "xyz"])


def vector(v: np.ndarray) -> str:
    return "(" + ", ".join(f"{c:.15g}" for c in v) + ")"


def test_one_member_is_a_beam() -> None:
    """A cantilever that hangs and is pulled far, as `beam6dof` has it: to the tolerance of both, 1e-8."""
    load = (
        "load weight = gravity(900 m/s^2)\nload pull = point_force(bar, at = (1, 0, 0) m, vector = (0, 900, 300) mN)\n"
    )
    wall = "support wall = fixed(bar, where = x <= 0 m)\n"
    box = "body bar = solid(box(size = (1, 0.02, 0.02) m, origin = (0, -0.01, -0.01) m), foam)\n"
    one = run(f"{BEAM}{wall}{load}{TIP}model m = frame6dof(segments = 12)\n")["m"]
    other = run(f"{box}{wall}{load}{TIP}model m = beam6dof(segments = 12)\n")["m"]
    assert np.linalg.norm(tip(other)) > 0.1
    np.testing.assert_allclose(tip(one), tip(other), atol=1e-7)
    np.testing.assert_allclose(
        one.reactions["wall"].reaction.own_moment, other.reactions["wall"].reaction.own_moment, atol=1e-7
    )


def test_forces_and_probes_may_be_on_the_axis_of_hollow_members() -> None:
    """Where nothing is: sections take them whole, in networks, which take forces nowhere else, and in beams.

    They are the same rod, to 1e-8; and P a^2 (3 L - a) / (6 E I) at the tip of a slender tube, to its shear.
    """
    load = (
        "load pull = point_force(bar, at = (1, 0, 0) m, vector = (0, 900, 300) mN)\n"
        "load rain = line_load(bar, from = (0.2, 0, 0) m, to = (1, 0, 0) m, vector = (0, 100, 0) mN/m)\n"
    )
    wall = "support wall = fixed(bar, where = x <= 0 m)\n"
    tube = "body bar = solid(tube(length = 1 m, radius = 10 mm, inner = 8 mm), foam)\n"
    ring = BEAM.replace("side = 20 mm", "radius = 10 mm, inner = 8 mm")
    one = run(tube + wall + load + "model rod = beam6dof(segments = 20)\n" + TIP)["rod"]
    net = run(ring + wall + load + "model net = frame6dof(segments = 20)\n" + TIP)["net"]
    assert np.linalg.norm(tip(one) - tip(net)) < 1e-8 * np.linalg.norm(tip(one))
    light = "load pull = point_force(bar, at = (0.5, 0, 0) m, vector = (0, 0, 1) mN)\n"
    small = run(ring + wall + light + "model net = frame6dof(segments = 20)\n" + TIP)["net"]
    inertia = math.pi / 4 * (0.01**4 - 0.008**4)
    assert tip(small)[2] == pytest.approx(1e-3 * 0.5**2 * (3.0 - 0.5) / (6.0 * E * inertia), rel=3e-3)


FRAME = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.7, 0.3, 1.2], [1.2, -0.2, 0.0], [0.6, 0.9, 1.0]])
PAIRS = [(1, 2), (2, 3), (3, 4), (3, 5)]


def _turned(points: np.ndarray, pairs: list[tuple[int, int]], R: np.ndarray) -> tuple[np.ndarray, dict[str, Any]]:
    """The corner of a frame, by its points in any order, turned by R: how it moves, turned back, and its model."""
    net = f"[{', '.join(vector(R @ p) for p in points)}] m, members = {[tuple(p) for p in pairs]}"
    at = [f"{vector(R @ FRAME[i])} m" for i in range(5)]
    feet = "".join(
        f"support foot{i} = fixed(bar, where = " + " and ".join(
            f"{c} >= {v - 1e-6:.15g} m and {c} <= {v + 1e-6:.15g} m" for c, v in zip("xyz", R @ FRAME[i], strict=True)
        ) + ")\n"
        for i in (0, 3)
    )  # fmt: skip
    text = (
        f"body bar = network(points = {net}, material = foam, radius = 10 mm)\n{feet}"
        f"load push = point_force(bar, at = {at[4]}, vector = {vector(R @ [300.0, 100.0, -500.0])} mN)\n"
        f"load weight = gravity(100 m/s^2, direction = {vector(R @ [0.0, 0.0, -1.0])})\n"
        f"probe tip = point(bar, at = {at[4]})\n" + TIP.split("\n", 1)[1] + "model m = frame6dof(segments = 6)\n"
    )
    model = run(text)["m"]
    return R.T @ tip(model), model


def test_names_and_directions_are_free() -> None:
    """Points in another order, members the other way round, all of it turned: the same motion, to 1e-9 of 300 mm."""
    plain, _ = _turned(FRAME, PAIRS, np.eye(3))
    assert 0.1 < np.linalg.norm(plain) < 0.5
    order = [3, 1, 4, 0, 2]
    place = {old + 1: new + 1 for new, old in enumerate(order)}
    pairs = [(place[b], place[a]) for a, b in reversed(PAIRS)]
    shuffled, _ = _turned(FRAME[order], pairs, np.eye(3))
    np.testing.assert_allclose(shuffled, plain, atol=1e-10)
    a, b = 0.6, 1.1
    R = np.array([[math.cos(a), -math.sin(a), 0.0], [math.sin(a), math.cos(a), 0.0], [0.0, 0.0, 1.0]]) @ np.array(
        [[1.0, 0.0, 0.0], [0.0, math.cos(b), -math.sin(b)], [0.0, math.sin(b), math.cos(b)]]
    )
    turned, _ = _turned(FRAME, PAIRS, R)
    np.testing.assert_allclose(turned, plain, atol=1e-9)


def test_a_beam_on_two_hinges() -> None:
    """A force in the middle of a beam on a bolt and a roller: P L^3 / (48 E I) + P L / (4 kappa G A), P / 2 at either,
    no moment. 32 segments are 0.1 % short of bending."""
    text = (
        "body bar = network(points = [(0, 0, 0), (1, 0, 0)] m, members = [(1, 2)], material = foam, side = 20 mm)\n"
        "support bolt = pinned(bar, where = x <= 0 m, axis = +y)\n"
        "support roller = pinned(bar, where = x >= 1 m, axis = +y, components = (y, z))\n"
        "load push = point_force(bar, at = (0.5, 0, 0) m, vector = (0, 0, -10) mN)\n"
        "model m = frame6dof(segments = 32)\nprobe tip = point(bar, at = (0.5, 0, 0) m)\n" + TIP.split("\n", 1)[1]
    )
    model = run(text)["m"]
    kappa = 10.0 * 1.3 / (12.0 + 11.0 * 0.3)
    sag = 0.01 / (48.0 * EI) + 0.01 / (4.0 * kappa * E / 2.6 * A * A)
    assert -tip(model)[2] == pytest.approx(sag, rel=2e-3)
    for name in ("bolt", "roller"):
        assert model.reactions[name].reaction.force[2] == pytest.approx(5e-3, rel=1e-6)
        assert np.abs(model.reactions[name].reaction.own_moment).max() < 1e-8


def test_sections_one_for_each_member() -> None:
    """A stepped cantilever, thick near the wall: P (b^3 + (L^3 - b^3) I_b / I_a) / (3 E I_b), b the thin half."""
    text = (
        "body bar = network(points = [(0, 0, 0), (0.5, 0, 0), (1, 0, 0)] m, members = [(1, 2), (2, 3)], "
        "material = foam, radius = [20, 10] mm)\n"
        "support wall = fixed(bar, where = x <= 0 m)\n"
        "load push = point_force(bar, at = (1, 0, 0) m, vector = (0, 0, -1) mN)\n"
        f"model m = frame6dof(segments = 24)\n{TIP}"
    )
    thin, thick = (math.pi * r**4 / 4.0 for r in (0.01, 0.02))
    sag = 1e-3 * (0.125 + 0.875 * thin / thick) / (3.0 * E * thin)
    assert -tip(run(text)["m"])[2] == pytest.approx(sag, rel=2e-3)


def test_a_torque_at_a_joint() -> None:
    """M at the corner of a knee whose ends are clamped, held in place: arms take it as (4 + f) / (1 + f) E I / l, and
    hand (2 - f) / (4 + f) of it on, f = 12 E I / (kappa G A l^2) (Timoshenko's beam). 40 segments: 0.2 %.
    """
    text = (
        "body bar = network(points = [(0, 0, 0), (1, 0, 0), (1, 0.5, 0)] m, members = [(1, 2), (2, 3)], "
        "material = foam, side = 20 mm)\n"
        "support near = fixed(bar, where = x <= 0 m)\nsupport far = fixed(bar, where = y >= 0.5 m)\n"
        "support corner = pinned(bar, where = x >= 1 m and y <= 0 m, axis = +z)\n"
        "load turn = torque(bar, where = x >= 1 m and y <= 0 m, moment = (0, 0, 10) mN*m)\n"
        "model m = frame6dof(segments = 40)\nprobe tip = point(bar, at = (1, 0, 0) m)\n"
        "metric held = moment(near, along = +z)\nmetric other = moment(far, along = +z)\n"
    )
    metrics = run(text)["m"].metrics
    kappa = 10.0 * 1.3 / (12.0 + 11.0 * 0.3)
    arms = [(12.0 * EI / (kappa * E / 2.6 * A * A * l * l), EI / l) for l in (1.0, 0.5)]
    theta = 0.01 / sum((4.0 + f) / (1.0 + f) * k for f, k in arms)
    for name, (f, k) in zip(("held", "other"), arms, strict=True):
        assert metrics[name].value == pytest.approx((2.0 - f) / (1.0 + f) * k * theta, rel=2e-3)


def _dynamic(beta: float, length: float) -> np.ndarray:
    """Forces and moments at the ends of a Bernoulli beam that vibrates, by displacements and turns there (4, 4)."""

    def at(x: float, n: int) -> np.ndarray:
        s, c, S, C = math.sin(beta * x), math.cos(beta * x), math.sinh(beta * x), math.cosh(beta * x)
        return np.array([[c, s, C, S], [-s, c, S, C], [-c, -s, C, S], [s, -c, S, C]][n]) * beta**n

    ends = np.array([at(0.0, 0), at(0.0, 1), at(length, 0), at(length, 1)])
    forces = EI * np.array([at(0.0, 3), -at(0.0, 2), -at(length, 3), at(length, 2)])
    return np.asarray(forces @ np.linalg.inv(ends))


def _sway(frequency: float) -> float:
    """A portal of posts of 1 m and a beam of 1.5 m, clamped at its feet, swaying: zero at its tones."""
    w = 2.0 * math.pi * frequency
    beta = (LINE * w * w / EI) ** 0.25
    post, beam = _dynamic(beta, 1.0), _dynamic(beta, 1.5)
    return float(np.linalg.det([[2.0 * post[2, 2] - LINE * 1.5 * w * w, 2.0 * post[2, 3]],
                                [post[3, 2], post[3, 3] + beam[1, 1] + beam[1, 3]]]))  # fmt: skip


def test_the_tones_of_a_portal() -> None:
    """Those in which it sways, by the exact dynamic stiffness of Bernoulli beams: 12.3602 and 78.74 Hz.

    Sections that shear and turn make the first 0.05 % lower and the second 0.2 %.
    """
    exact = [brentq(_sway, 5.0, 20.0), brentq(_sway, 70.0, 90.0)]
    assert exact[0] == pytest.approx(12.3602, abs=1e-4)  # the number of the scene
    text = (
        "body bar = network(points = [(0, 0, 0), (0, 1, 0), (1.5, 1, 0), (1.5, 0, 0)] m, "
        "members = [(1, 2), (2, 3), (3, 4)], material = foam, side = 20 mm)\n"
        "support feet = fixed(bar, where = y <= 0 m)\nsupport level = pinned(bar, where = z <= 0 m, axis = +z, "
        "components = z)\nmodel m = frame6dof(segments = 30)\nprobe tip = point(bar, at = (0, 1, 0) m)\n"
        "metric tones = frequency(bar, mode = 4)\n"
        "load push = point_force(bar, at = (0, 1, 0) m, vector = (1, 0, 0) mN)\n"
    )
    found = run(text)["m"].metrics["tones"].details["frequencies_Hz"]
    for tone, near in zip(exact, (1e-3, 4e-3), strict=True):
        assert min(abs(f / tone - 1.0) for f in found) < near


def test_the_tone_of_a_thin_arm_on_a_thick_one() -> None:
    """A hundred times thinner, so that 1e8 less stiff: the thick arm is a wall, 1.8751^2 sqrt(E I / m) / (2 pi L^2).

    8 segments are 0.4 % low. All modes at once had lost this one to rounding, which leaves 1e-6 N of the thick arm.
    """
    text = (
        "body bar = network(points = [(0, 0, 0), (1, 0, 0), (2, 0, 0)] m, members = [(1, 2), (2, 3)], "
        "material = foam, radius = [100, 1] mm)\nsupport wall = fixed(bar, where = x <= 0 m)\n"
        "load push = point_force(bar, at = (2, 0, 0) m, vector = (0, 0, -1e-6) N)\n"
        "probe tip = point(bar, at = (2, 0, 0) m)\nmetric tone = frequency(bar)\nmodel m = frame6dof(segments = 8)\n"
    )
    exact = 1.8751**2 / (2.0 * math.pi) * math.sqrt(E / RHO) * 0.5e-3
    model = softmark.loads(HEAD + text).run().models["m"]
    assert model.metrics["tone"].value == pytest.approx(exact, rel=5e-3)
    assert model.solve["checks"]["reactions"]["reason"] == "the loads are below rounding error"


def test_what_is_imposed_at_a_hinge() -> None:
    """A hinge that moves: the point goes where it is told, and takes 3 E I d / L^3, 0.2 % by 20 segments."""
    text = (
        f"{BEAM}support wall = fixed(bar, where = x <= 0 m)\n"
        "support lift = pinned(bar, where = x >= 1 m, by = (0, 0, 1) mm, components = z)\n"
        f"model m = frame6dof(segments = 20)\n{TIP}metric force = force(lift, along = +z)\n"
    )
    model = run(text)["m"]
    assert tip(model)[2] == pytest.approx(1e-3, rel=1e-12)
    assert model.metrics["force"].value == pytest.approx(3.0 * EI * 1e-3, rel=2e-3)


def test_its_loads_are_those_that_were_asked_for() -> None:
    """Weight of all members, a line of force along one, a force between points: forces and moments exactly."""
    text = (
        "body bar = network(points = [(0, 0, 0), (0, 0, 1), (1, 0, 1)] m, members = [(1, 2), (2, 3)], "
        "material = foam, radius = 10 mm)\nsupport foot = fixed(bar, where = z <= 0 m)\n"
        "load weight = gravity(9.81 m/s^2)\n"
        "load rain = line_load(bar, from = (0.25, 0, 1) m, to = (0.8, 0, 1) m, vector = (0, 0, -2) N/m)\n"
        "load push = point_force(bar, at = (0, 0, 0.37) m, vector = (3, 0, 0) N)\n"
        "load turn = torque(bar, where = x >= 1 m, moment = (0, 1, 2) N*m)\n"
        "model m = frame6dof(segments = 6)\nprobe tip = point(bar, at = (1, 0, 1) m)\n"
    )
    loads = run(text)["m"].loads
    weight = RHO * math.pi * 1e-4 * 9.81
    np.testing.assert_allclose(loads["weight"].force, [0.0, 0.0, -2.0 * weight], rtol=1e-12)
    np.testing.assert_allclose(loads["weight"].moment, [0.0, 0.5 * weight, 0.0], atol=1e-10)
    np.testing.assert_allclose(loads["rain"].force, [0.0, 0.0, -1.1], rtol=1e-12)
    np.testing.assert_allclose(loads["rain"].moment, [0.0, 1.1 * 0.525, 0.0], atol=1e-12)
    np.testing.assert_allclose(loads["push"].moment, [0.0, 3.0 * 0.37, 0.0], atol=1e-12)
    np.testing.assert_allclose(loads["turn"].moment, [0.0, 1.0, 2.0], atol=1e-12)
    assert all(abs(load.share - 1.0) < 1e-12 for load in loads.values())


def test_a_wrong_stiffness_is_no_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    """Forces found again know the sections themselves: 0.1 % more of E I is refused."""
    right = frame_builder.stiffnesses
    monkeypatch.setattr(frame_builder, "stiffnesses", lambda *of: right(*of) * [1.0, 1.0, 1.0, 1.0, 1.001, 1.0])
    text = (
        f"{BEAM}support wall = fixed(bar, where = x <= 0 m)\nmodel m = frame6dof(segments = 8)\n{TIP}"
        "load push = point_force(bar, at = (1, 0, 0) m, vector = (0, 0, -10) mN)\n"
    )
    report = softmark.loads(HEAD + text).run()
    assert report.models["m"].status == "failed"
    assert "do not balance" in report.models["m"].message


@pytest.mark.parametrize("axis", ["+y", "(0.6, 0.8, 0)"])
def test_a_hinge_that_does_not_turn_is_no_answer(monkeypatch: pytest.MonkeyPatch, axis: str) -> None:
    """Forces found again know what a hinge leaves free: one that is solved as a clamp has a moment about its axis."""
    text = (
        "body bar = network(points = [(0, 0, 0), (1, 0, 0)] m, members = [(1, 2)], material = foam, side = 20 mm)\n"
        f"support bolt = pinned(bar, where = x <= 0 m, axis = {axis})\n"
        "support far = fixed(bar, where = x >= 1 m)\n"
        "load push = point_force(bar, at = (0.5, 0, 0) m, vector = (0, 0, -10) mN)\n"
        "model m = frame6dof(segments = 8)\nprobe tip = point(bar, at = (0.5, 0, 0) m)\n" + TIP.split("\n", 1)[1]
    )
    assert run(text)["m"].status == "converged"
    monkeypatch.setattr(Layout, "_prevented_rotation_axes", lambda self, support, point: (0, 1, 2))
    report = softmark.loads(HEAD + text).run()
    assert report.models["m"].status == "failed"
    assert "do not balance" in report.models["m"].message


@pytest.mark.slow
def test_the_largest_load_of_lees_frame() -> None:
    """18.5584 E I / L^2, by collocation of beams that do not stretch (scipy).

    The scene `rigid-frames` holds the model to it within 0.2 %.

    Three pieces of lengths 1, 1/5 and 4/5, each x, y, angle and moment over its own 0 to 1; forces at the foot and the
    load are unknown, and how far the loaded point goes down is given.
    """
    long = (1.0, 0.2, 0.8)

    def largest(down: float, t: np.ndarray, Y: np.ndarray, p: np.ndarray) -> Any:
        def rate(t: np.ndarray, Y: np.ndarray, p: np.ndarray) -> np.ndarray:
            found = []
            for i, up in enumerate((-p[1], -p[1], p[2] - p[1])):
                c, s = np.cos(Y[4 * i + 2]), np.sin(Y[4 * i + 2])
                found += [long[i] * c, long[i] * s, long[i] * Y[4 * i + 3], -long[i] * (c * up + s * p[0])]
            return np.array(found)

        def ends(a: np.ndarray, b: np.ndarray, p: np.ndarray) -> np.ndarray:
            corner = a[4:8] - b[:4] + [0.0, 0.0, 0.5 * np.pi, 0.0]
            held = [a[0], a[1], a[3], b[8] - 1.0, b[9] - 1.0, b[11], b[5] - 1.0 + down]
            return np.concatenate([corner, a[8:12] - b[4:8], held])

        found = solve_bvp(rate, ends, t, Y, p, tol=1e-8, max_nodes=5000)
        assert found.success
        return found

    t, w = np.linspace(0.0, 1.0, 21), 0.02
    z = 0.0 * t
    Y = np.array(
        [z, t, np.pi / 2 + w - 3 * w * t**2, -6 * w * t, 0.2 * t, 1 + z, z - 2 * w, z, 0.2 + 0.8 * t, 1 + z, z, z]
    )
    p, loads = np.array([0.0, 2.0, 3.0]), []
    places = [0.04, 0.08, 0.12, 0.16, 0.2, 0.24, 0.28, 0.32, 0.36, 0.39, 0.40, 0.41]
    for down in places:
        found = largest(down, t, Y, p)
        Y, p = found.sol(t), found.p
        loads.append(p[2])
    a, b, c = np.polyfit(places[-3:], loads[-3:], 2)
    assert c - b * b / (4.0 * a) == pytest.approx(18.5584, rel=1e-5)


@pytest.mark.slow
def test_its_stated_error_holds_the_true_one() -> None:
    """A portal of 4, 8 and 16 segments against the limit of refinement: stated is one to three times it."""
    text = (
        "body bar = network(points = [(0, 0, 0), (0, 1, 0), (1.5, 1, 0), (1.5, 0, 0)] m, "
        "members = [(1, 2), (2, 3), (3, 4)], material = foam, side = 10 mm)\n"
        "support feet = fixed(bar, where = y <= 0 m)\nprobe tip = point(bar, at = (0, 1, 0) m)\n"
        "load push = point_force(bar, at = (0, 1, 0) m, vector = (1, 0, 0) mN)\n"
        + TIP.split("\n", 1)[1]
        + "".join(f"model m{n} = frame6dof(segments = {n})\n" for n in (4, 8, 16, 128))
    )
    models = run(text, stated=())
    limit = models["m128"].metrics["ux"].value
    for n in (4, 8, 16):
        stated = models[f"m{n}"].stated["ux"]
        missing = abs(models[f"m{n}"].metrics["ux"].value - limit)
        assert stated.value is not None
        assert missing <= stated.parts["discretisation"] <= 3.0 * missing
        assert stated.parts["model"] > 0.0


@pytest.mark.slow
def test_a_scene_without_networks_imports_nothing_for_them() -> None:
    """A beam that is run loads words of models, as it does of all, and nothing that makes or solves networks."""
    scene = """material gel = linear_elastic(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
body bar = solid(box(size = (200, 10, 10) mm), gel)
support clamp = fixed(bar, where = x <= 0 mm)
load weight = gravity(9.81 m/s^2, direction = -z)
model rod = beam6dof(segments = 4)
probe end = point(bar, at = (200, 5, 5) mm)
metric down = displacement(end, along = -z)
"""
    new = {
        "solvers.mesh.frame_shapes",
        "solvers.energies.rod_joints",
        "solvers.statics.rod_frame_state",
        "solvers.energies.incremental_rotation.moving_rod_joints",
        "interpreter.validation.frame_checks",
        "interpreter.models.beam_frame.frame_layout",
        "interpreter.models.beam_frame.frame_builder",
        "interpreter.verification.by_model.frame_verifier",
    }
    assert not new & loaded_by(scene)
