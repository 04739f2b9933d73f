"""Muscle whose tension follows a course, or varies in space, and fibres that grow shorter, from scenes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

import softmark

CUBE = """
material tissue = {law}
material muscle = {muscle}
body     cube   = solid(box(size = (10, 10, 10) mm), muscle)
support  left   = fixed(cube, where = x <= 0 mm, components = x)
support  front  = fixed(cube, where = y <= 0 mm, components = y)
support  below  = fixed(cube, where = z <= 0 mm, components = z)
{more}
model    one    = fem({model}, strain = finite, size = {size})
probe    end    = point(cube, at = (10, 10, 10) mm)
metric   less   = displacement(end, along = -x)
metric   wider  = displacement(end, along = +y)
metric   sigma  = stress(end, component = xx)
"""
SIGMA = "metric   sigma  = stress(end, component = xx)\n"
HEART = "guccione(stiffness = 2 kPa, bf = 8, bt = 2, bfs = 4, density = 1000 kg/m^3, fibres = +x{bulk})"
RUBBER = "neo_hookean(young = 10 kPa, poisson = {nu}, density = 1000 kg/m^3)"
TIGHT = "hex8, formulation = mixed"
HELD = "support right = fixed(cube, where = x >= 10 mm, components = x)"
L = 0.01  # m


ONE_CELL = """*NODE
1, 0, 0, 0\n2, 10, 0, 0\n3, 10, 10, 0\n4, 0, 10, 0\n5, 0, 0, 10\n6, 10, 0, 10\n7, 10, 10, 10\n8, 0, 10, 10
*ELEMENT, TYPE=C3D8
1, 1, 2, 3, 4, 5, 6, 7, 8
"""


def computed(law: str, muscle: str, more: str = "", model: str = TIGHT, size: str = "10 mm", at: Any = None) -> Any:
    """The model of a cube of muscle, of a state whose forces are found again by other formulas where it rests.

    Of a single cell, from a file, where a folder is given.
    """
    text = CUBE.format(law=law, muscle=muscle, more=more, model=model, size=size)
    if "viscoelastic" in more:  # whose stress is not recovered to points
        text = text.replace(SIGMA, "")
    if at is None:
        scene = softmark.loads(text)
    else:
        (at / "one.inp").write_text(ONE_CELL, encoding="utf-8")
        text = text.replace("box(size = (10, 10, 10) mm)", 'mesh("one.inp", unit = 1 mm)')
        (at / "a.scene").write_text(text.replace(f", size = {size})", ")"), encoding="utf-8")
        scene = softmark.load(at / "a.scene")
    found = scene.run().models["one"]
    assert found.status == "converged", found.message
    if "dynamic" not in more:
        assert found.solve["checks"]["residual"] < 1e-8, found.solve["checks"]
    return found


def free(tension: float) -> float:
    """How much shorter a cube of Guccione's law is that pulls with T, m: S + T = 0 along fibres, with J = 1."""

    def stress(stretch: float) -> float:
        along, across = 0.5 * (stretch**2 - 1.0), 0.5 * (1.0 / stretch - 1.0)
        c = 2e3 * np.exp(8.0 * along**2 + 4.0 * across**2)
        return float(stretch**2 * (8.0 * c * along + tension) - 2.0 * c * across / stretch)

    return L * float(1.0 - brentq(stress, 0.5, 1.1, xtol=1e-14))


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize(("analysis", "course", "shares"), [
    ("static(states = [0, 25, 100, 50] %)", "per_state", (0.0, 0.25, 1.0, 0.5)),
    ("quasistatic(duration = 1 s, step = 1 s, times = [0.5, 1] s)", "smooth(over = 1 s)", (0.5, 1.0)),
    ("quasistatic(duration = 1 s, step = 1 s, times = [0.25, 0.75] s)", "ramp(over = 0.5 s)", (0.5, 1.0)),
])  # fmt: skip
def test_a_tension_follows_its_course(analysis: str, course: str, shares: tuple[float, ...]) -> None:
    """Where it is free, each share of the tension has the stretch of the closed form: to what the solver leaves."""
    muscle = f"active(tissue, tension = 5 kPa, amplitude = {course})"
    found = computed(HEART.format(bulk=""), muscle, f"analysis now = {analysis}")
    assert found.metrics["less"].states == pytest.approx([free(5e3 * share) for share in shares], rel=1e-7, abs=1e-12)


def test_a_tension_follows_a_table(tmp_path: Any) -> None:
    """Half way between two of its rows, and at one."""
    (tmp_path / "twitch.csv").write_text("t [s],part\n0,0\n1,0.8\n2,0.2\n", encoding="utf-8")
    more = "analysis now = quasistatic(duration = 2 s, step = 1 s, times = [0.5, 1, 2] s)"
    muscle = 'active(tissue, tension = 5 kPa, amplitude = table("twitch.csv", at = "t [s]", value = "part"))'
    text = CUBE.format(law=HEART.format(bulk=""), model=TIGHT, size="10 mm", more=more, muscle=muscle)
    (tmp_path / "a.scene").write_text(text, encoding="utf-8")
    found = softmark.load(tmp_path / "a.scene").run().models["one"].metrics["less"].states
    assert found == pytest.approx([free(2e3), free(4e3), free(1e3)], rel=1e-7)


BULK, OVER, END, FULL = 20e3, 0.006, 0.01, 5e3


def swinging() -> Any:
    """A free cube of Guccione's law with K that begins to pull: three stretches and the work, by Runge and Kutta."""

    def pull(t: float) -> float:
        return FULL * min(1.0, t / OVER)

    def rate(t: float, y: Any) -> Any:
        stretch, speed = y[:3], y[3:6]
        E = 0.5 * (stretch**2 - 1.0)
        b = np.array([8.0, 2.0, 2.0])
        S = 2e3 * np.exp(float(b @ E**2)) * b * E
        J = float(np.prod(stretch))
        P = stretch * S + BULK * (J - 1.0) * J / stretch
        P[0] += pull(t) * stretch[0]
        mass = 1000.0 * L**2 / 3.0  # of displacements that grow along an edge, per volume
        return np.concatenate([speed, -P / mass, [-(L**3) * pull(t) * stretch[0] * speed[0]]])

    start = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0])
    return solve_ivp(rate, (0.0, END), start, rtol=1e-10, atol=1e-13, max_step=0.001)


@pytest.mark.slow
def test_muscle_moves_a_body_and_its_work_is_told(tmp_path: Any) -> None:
    """One cell and three stretches of an ordinary differential equation: of second order in the step."""
    true = swinging().y[:, -1]
    off = []
    for step in ("0.2 ms", "0.1 ms"):
        muscle = "active(tissue, tension = 5 kPa, amplitude = ramp(over = 6 ms))"
        more = f"analysis move = dynamic(duration = 10 ms, step = {step}, integrator = trapezoidal, tolerance = 1e-9)"
        found = computed(HEART.format(bulk=", bulk = 20 kPa"), muscle, more, "hex8", at=tmp_path)
        off.append(abs(found.metrics["less"].value - L * (1.0 - true[0])) / L)
        energies = {name: values[-1] for name, values in found.solve["energies"].items()}
        assert energies["muscle_work"] == energies["load_work"]
        assert energies["muscle_work"] == pytest.approx(true[6], rel=2e-2)
    assert off[1] < 1e-3
    assert off[0] / off[1] == pytest.approx(4.0, rel=0.1)


@pytest.mark.parametrize(("course", "sigma"), [
    ("", 2e3), (", amplitude = pulse(until = 3 ms)", 0.0), (", amplitude = ramp(over = 8 ms)", 1e3),
    (", amplitude = pulse(until = 4 ms)", 2e3),  # up to the end
])  # fmt: skip
def test_stress_in_a_motion_is_of_the_tension_that_there_is(course: str, sigma: float) -> None:
    """Held at its length it does not move, and carries T: all of it was told at the end, whatever the course."""
    more = "analysis move = dynamic(duration = 4 ms, step = 1 ms)\n" + HELD
    found = computed(RUBBER.format(nu=0.3), f"active(tissue, tension = 2 kPa, own = +x{course})", more, "hex8")
    assert found.metrics["sigma"].value == pytest.approx(sigma, abs=1e-5)


def test_without_muscle_nothing_is_told_of_its_work() -> None:
    more = "analysis fall = dynamic(duration = 2 ms, step = 1 ms)\nload weight = gravity(9.81 m/s^2)"
    text = CUBE.format(law=RUBBER.format(nu=0.3), muscle="tissue", more=more, model="hex8", size="10 mm")
    text = text.replace("material muscle = tissue\n", "").replace("mm), muscle)", "mm), tissue)")
    assert "muscle_work" not in softmark.loads(text).run().models["one"].solve["energies"]


@pytest.mark.slow
@pytest.mark.long
def test_muscle_beside_what_relaxes_pulls() -> None:
    """Two halves in a row, of which one remembers: its tension was left out, and is found again by the check."""
    more = """region soft = part(cube, where = x >= 5 mm, material = damper)
material matrix = neo_hookean_isochoric(young = 10 kPa, poisson = 0.3, density = 1000 kg/m^3)
material damper = viscoelastic(matrix, g = [0.5], tau = [1] s)
probe    mid  = point(cube, at = (5, 10, 10) mm)
metric   came = displacement(mid, along = -x)
analysis now = quasistatic(duration = 2 s, step = 0.5 s, times = [0, 1, 2] s)"""
    muscle = "active(tissue, tension = 2 kPa, amplitude = ramp(over = 1 s))"
    found = computed(HEART.format(bulk=", bulk = 20 kPa"), muscle, more + "\n" + HELD, "hex8", "5 mm")
    first, second, last = found.metrics["came"].states
    assert first == pytest.approx(0.0, abs=1e-12)
    assert last > 1.02 * second > 1e-4  # m: what relaxes gives way


def test_fibres_that_shorten_by_a_course_are_not_known_beside_what_relaxes() -> None:
    """They were as short as they would ever be from the start, and the check found that no state was at rest."""
    more = """region soft = part(cube, where = x >= 5 mm, material = damper)
material damper = viscoelastic(matrix, g = [0.5], tau = [1] s, of = whole)
material matrix = neo_hookean(young = 10 kPa, poisson = 0.3, density = 1000 kg/m^3)
analysis now = quasistatic(duration = 1 s, step = 0.5 s, times = [0.5, 1] s)"""
    text = CUBE.format(
        law=RUBBER.format(nu=0.3),
        muscle=SHORT.format("10 %", ", own = +x, amplitude = ramp(over = 1 s)"),
        more=more,
        model="hex8",
        size="5 mm",
    ).replace(SIGMA, "")
    with pytest.raises(softmark.SceneError) as refused:
        softmark.loads(text)
    assert [d.code for d in refused.value.diagnostics] == ["E362"]
    softmark.loads(text.replace(", amplitude = ramp(over = 1 s)", ""))


CONFINED = """
support  sides = fixed(cube, where = y >= 10 mm, components = y)
support  lids  = fixed(cube, where = z >= 10 mm, components = z)
probe    mid   = point(cube, at = (5, 0, 0) mm)
metric   moved = displacement(mid, along = +x)
support  right = fixed(cube, where = x >= 10 mm, components = x)
"""


def confined(tension: Any) -> float:
    """How far the middle of a bar of neo-Hookean rubber moves that is held on all sides, m.

    Force is the same along it: mu (l - 1/l) + lam ln(l) / l + T(x) l, and the stretches l add up to its length.
    """
    mu, lam = 10e3 / 2.6, 10e3 * 0.3 / (1.3 * 0.4)

    def stretch(x: float, force: float) -> float:
        return float(brentq(lambda s: mu * (s - 1.0 / s) + lam * np.log(s) / s + tension(x) * s - force, 0.3, 3.0,
                            xtol=1e-15))  # fmt: skip

    def length(force: float, end: float) -> float:
        return float(quad(stretch, 0.0, end, args=(force,), epsabs=1e-14)[0])

    force = brentq(lambda force: length(force, L) - L, 0.0, 8e3, xtol=1e-10)
    return length(force, 0.5 * L) - 0.5 * L


@pytest.mark.slow
@pytest.mark.parametrize(("given", "tension"), [
    ("4 kPa * x / 10 mm", lambda x: 4e3 * x / L),
    ("4 kPa * (x / 10 mm)^2", lambda x: 4e3 * (x / L) ** 2),
])  # fmt: skip
def test_a_tension_that_varies_in_space(given: str, tension: Any) -> None:
    """Against one stretch at every place; quadratic cells, 4 along the bar, leave 2e-5 of it."""
    found = computed(RUBBER.format(nu=0.3), f"active(tissue, tension = {given}, own = +x)", CONFINED, "hex20", "2.5 mm")
    assert found.metrics["moved"].value == pytest.approx(confined(tension), rel=5e-5)


@pytest.mark.slow
def test_a_tension_that_varies_follows_a_course() -> None:
    """Half of one that varies is one that varies by half as much."""
    text = "active(tissue, tension = {} * x / 10 mm, own = +x{})"
    more = CONFINED + "analysis now = static(states = [50] %)"
    half = computed(RUBBER.format(nu=0.3), text.format("4 kPa", ", amplitude = per_state"), more, "hex8", "2.5 mm")
    whole = computed(RUBBER.format(nu=0.3), text.format("2 kPa", ""), CONFINED, "hex8", "2.5 mm")
    assert half.metrics["moved"].value == pytest.approx(whole.metrics["moved"].value, rel=1e-9)


def test_a_tension_below_nothing_somewhere_is_refused() -> None:
    with pytest.raises(softmark.SceneError) as refused:
        computed(RUBBER.format(nu=0.3), "active(tissue, tension = 1 kPa * (x - 1 mm) / 10 mm, own = +x)")
    assert [d.code for d in refused.value.diagnostics] == ["E327"]


# ------------------------------------------------------------------ active strain

GENT = "gent(mu = 4 kPa, limit = 30, bulk = 20 kPa, density = 1000 kg/m^3)"
SHORT = "active_strain(tissue, shortening = {}{})"


@pytest.mark.parametrize(("law", "own", "model"), [
    (HEART.format(bulk=""), "", TIGHT),
    (HEART.format(bulk=", bulk = 20 kPa"), "", "hex8"),
    (RUBBER.format(nu=0.5), ", own = +x", TIGHT),
    (RUBBER.format(nu=0.4), ", own = +x", "tet10"),
    (GENT, ", own = +x", "hex8, formulation = mean_dilatation"),
])  # fmt: skip
def test_muscle_that_nothing_holds_is_as_short_as_it_says(law: str, own: str, model: str) -> None:
    """Shorter by the shortening and thicker by 1 / sqrt(1 - s), without stress, whatever the law: to the solver."""
    found = computed(law, SHORT.format("20 %", own), model=model)
    assert found.metrics["less"].value == pytest.approx(0.2 * L, rel=1e-9)
    assert found.metrics["wider"].value == pytest.approx((0.8**-0.5 - 1.0) * L, rel=1e-9)
    assert abs(found.metrics["sigma"].value) < 1e-5  # Pa


@pytest.mark.parametrize("s", [0.3, -0.3])
def test_muscle_that_is_held_has_the_stress_of_its_stretch(s: float) -> None:
    """Rubber that keeps its volume, its sides free: mu (l^2 - 1 / l), l = 1 / (1 - s)."""
    found = computed(RUBBER.format(nu=0.5), SHORT.format(s, ", own = +x"), HELD)
    stretch = 1.0 / (1.0 - s)
    assert found.metrics["sigma"].value == pytest.approx(10e3 / 3.0 * (stretch**2 - 1.0 / stretch), rel=1e-9)


def test_heart_that_is_held_has_the_stress_of_its_stretch() -> None:
    """Guccione's law of C = diag(l^2, 1 / l, 1 / l), l = 1 / (1 - s), by its own exponent."""
    found = computed(HEART.format(bulk=""), SHORT.format("10 %", ""), HELD)
    stretch = 1.0 / 0.9
    along, across = 0.5 * (stretch**2 - 1.0), 0.5 * (1.0 / stretch - 1.0)
    c = 2e3 * np.exp(8.0 * along**2 + 4.0 * across**2)
    sigma = stretch**2 * 8.0 * c * along - 2.0 * c * across / stretch
    assert found.metrics["sigma"].value == pytest.approx(sigma, rel=1e-9)


@pytest.mark.parametrize("analysis", [
    "static(states = [50, 100] %)", "quasistatic(duration = 1 s, step = 1 s, times = [0.5, 1] s)",
])  # fmt: skip
def test_a_shortening_follows_its_course(analysis: str) -> None:
    course = "per_state" if "static(s" in analysis else "ramp(over = 1 s)"
    more = f"analysis now = {analysis}"
    found = computed(RUBBER.format(nu=0.5), SHORT.format("40 %", f", own = +x, amplitude = {course}"), more)
    assert found.metrics["less"].states == pytest.approx([0.2 * L, 0.4 * L], rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(("law", "model"), [(RUBBER.format(nu=0.5), TIGHT), (RUBBER.format(nu=0.3), "tet10")])
def test_a_shortening_and_directions_that_vary_in_space(law: str, model: str) -> None:
    """Forces of such a state are found again by other formulas (`computed` asks it)."""
    computed(law, SHORT.format("0.3 * x / 10 mm", ", own = (y + 10 mm, x, 0 mm)"), "", model, "5 mm")


@pytest.mark.slow
def test_short_fibres_in_a_motion(tmp_path: Any) -> None:
    """They swing about where they come to rest: a free cell, from rest, by Runge and Kutta."""
    mu, lam, s, end = 10e3 / 2.6, 10e3 * 0.3 / (1.3 * 0.4), 0.1, 5e-3
    rest = np.array([1.0 - s, (1.0 - s) ** -0.5, (1.0 - s) ** -0.5])

    def rate(t: float, y: Any) -> Any:
        stretch = y[:3] / rest
        P = (mu * (stretch - 1.0 / stretch) + lam * np.log(np.prod(stretch)) / stretch) / rest
        return np.concatenate([y[3:], -3.0 * P / (1000.0 * L**2)])

    true = solve_ivp(rate, (0.0, end), [1.0, 1.0, 1.0, 0.0, 0.0, 0.0], rtol=1e-10, atol=1e-13).y[0, -1]
    more = "analysis move = dynamic(duration = 5 ms, step = 20 us, integrator = trapezoidal, tolerance = 1e-9)"
    found = computed(RUBBER.format(nu=0.3), SHORT.format(s, ", own = +x"), more, "hex8", at=tmp_path)
    assert found.metrics["less"].value == pytest.approx(L * (1.0 - true), rel=1e-4)


PULLS = "active(tissue, tension = 1 kPa, amplitude = {})"
SLOWLY, MOVES = "quasistatic(duration = 1 s, step = 0.1 s)", "dynamic(duration = 2 ms, step = 1 ms)"


@pytest.mark.parametrize(("muscle", "more", "codes"), [
    (PULLS.format("sine(frequency = 1 Hz)"), SLOWLY, ["W398"]),
    (PULLS.format("sine(frequency = 0.5 Hz)"), SLOWLY, []),
    (PULLS.format("per_state"), "static(states = [-10, 100] %)", ["W398"]),
    (PULLS.format("per_state"), "static()", ["E311"]),
    (PULLS.format("per_state"), SLOWLY, ["E311"]),
    (SHORT.format("20 %", ", amplitude = per_state"), SLOWLY, ["E311"]),
    (PULLS.format("ramp(over = 1 s)"), "static()", ["W317"]),
    (PULLS.format("ramp(over = 1 s, start = 3 s)"), SLOWLY, ["W378"]),
    (PULLS.format("sine(frequency = 1 kHz)"), MOVES, ["E381"]),
    (SHORT.format("10 %", ", amplitude = per_state"), "static(states = [-10, 100] %)", []),
    (SHORT.format("10 %", ", amplitude = ramp(over = 1 ms)"), MOVES, ["E368"]),
    (SHORT.format("60 %", ""), "static()", ["E301"]),
    (SHORT.format("20 %", ", amplitude = per_state"), "static(states = [50, 300] %)", ["E379"]),
    ("active(first, tension = 1 kPa)\nmaterial first = " + SHORT.format("10 %", ""), "static()", ["E367"]),
])  # fmt: skip
def test_what_is_said_of_courses(muscle: str, more: str, codes: list[str]) -> None:
    text = CUBE.format(law=HEART.format(bulk=", bulk = 20 kPa"), muscle=muscle,
                       more=f"analysis now = {more}", model="hex8", size="5 mm")  # fmt: skip
    try:
        found = [d.code for d in softmark.loads(text).warnings]
    except softmark.SceneError as refused:
        found = [d.code for d in refused.diagnostics]
    assert found == codes


@pytest.mark.parametrize(("muscle", "code"), [
    ("active(damper, tension = 1 kPa, own = +x)", "E367"),
    ("active_strain(damper, shortening = 10 %, own = +x)", "E367"),
    ("viscoelastic(pulling, g = [0.5], tau = [1] s)", "E363"),
])  # fmt: skip
def test_what_relaxes_is_no_muscle(muscle: str, code: str) -> None:
    """Memory is known of isotropic laws alone, and is said to be so."""
    more = """material damper = viscoelastic(tissue, g = [0.5], tau = [1] s)
material pulling = active(tissue, tension = 1 Pa, own = +x)"""
    text = CUBE.format(law=RUBBER.format(nu=0.3), muscle=muscle, more=more, model="hex8", size="5 mm")
    with pytest.raises(softmark.SceneError) as refused:
        softmark.loads(text)
    assert code in [d.code for d in refused.value.diagnostics]


def test_a_wrong_state_without_loads_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Free muscle carries nothing, so that no share of the loads is left: what the check finds counts all the same.

    The check takes the law without shortening here; the state that it then refuses was let through.
    """
    monkeypatch.setattr(
        "softmark.solvers.independent_forces.fiber_axes_by_differences.energy_with_shortening",
        lambda stress, s, f: stress,
    )
    text = CUBE.format(law=RUBBER.format(nu=0.5), muscle=SHORT.format("20 %", ", own = +x"), more="", model=TIGHT,
                       size="10 mm")  # fmt: skip
    found = softmark.loads(text).run().models["one"]
    assert found.status == "failed"
    assert "forces do not balance" in (found.message or "")
