"""Scenes of bodies whose stress relaxes, and of courses of time without inertia."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest
from loaded_modules import loaded_by

import softmark
from softmark.interpreter.results.run_report import Report
from softmark.solvers.energies.viscoelastic_memory import ViscoelasticHistory

GEL = """
material gel   = viscoelastic(neo_hookean_isochoric(young = 60 kPa, poisson = 0.4, density = 1000 kg/m^3),
    g = [0.3, 0.2],
    tau = [1, 10] s)
"""
ELASTIC = "material gel = neo_hookean_isochoric(young = 60 kPa, poisson = 0.4, density = 1000 kg/m^3)\n"
BAR = """
body     bar   = solid(box(size = (20, 10, 10) mm), gel)
support  left  = fixed(bar, where = x <= 0 mm)
support  right = displaced(bar, where = x >= 20 mm, by = (6, 0, 0) mm, components = x, amplitude = ramp(over = 2 s))
probe    end   = point(bar, at = (20, 10, 10) mm)
metric   pull  = force(right, along = +x)
metric   thin  = displacement(end, along = -y)
metric   heat  = dissipation(bar)
metric   kept  = strain_energy(bar)
model    cubes = fem(hex8, strain = finite, size = 5 mm, formulation = mean_dilatation)
"""
TIMED = "analysis hold = quasistatic(duration = 4 s, step = 0.25 s, times = [1, 2, 4] s)\n"


def report(text: str) -> Report:
    """The report of a scene."""
    return softmark.loads(text).run()


def test_an_elastic_body_is_at_every_time_where_its_course_has_brought_it() -> None:
    own = report(ELASTIC + BAR + TIMED).models["cubes"]
    static = "analysis pulled = static(states = [50, 100] %)\n"
    still = report(ELASTIC + BAR.replace("ramp(over = 2 s)", "per_state") + static).models["cubes"]
    for metric in ("pull", "thin", "kept"):
        first, second, last = own.curve(metric).values
        np.testing.assert_allclose([first, second], still.curve(metric).values, rtol=1e-8)
        assert last == pytest.approx(second, rel=1e-8)
    assert own.curve("heat").values == (0.0, 0.0, 0.0)


@pytest.mark.slow
@pytest.mark.long
def test_what_relaxes_is_checked_and_its_energies_add_up() -> None:
    own = report(GEL + BAR + TIMED).models["cubes"]
    assert own.status == "converged"
    pull = own.curve("pull").values
    assert pull[1] > pull[2] > 0.5 * pull[1]
    heat = own.curve("heat").values
    assert 0.0 < heat[0] < heat[1] < heat[2]
    for state in own.each:
        checks, energies = state.solve["checks"], state.solve["energies_in_time"]
        assert checks["residual"] < 1e-8
        whole = energies["stored_J"] + energies["dissipated_J"]
        assert energies["work_J"] == pytest.approx(whole, rel=6e-3)  # the trapezoidal rule in eight steps


def test_a_report_of_what_remembers_can_be_pickled() -> None:
    own = report((GEL + BAR + TIMED).replace("size = 5 mm", "size = 10 mm").replace("[1, 2, 4]", "[4]"))
    copy = pickle.loads(pickle.dumps(own))
    assert copy.to_json() == own.to_json()
    np.testing.assert_array_equal(copy.models["cubes"].mesh.displacement, own.models["cubes"].mesh.displacement)


def test_the_watchdog_finds_a_memory_that_forgets_wrongly(monkeypatch: pytest.MonkeyPatch) -> None:
    right = ViscoelasticHistory.history_after_step
    monkeypatch.setattr(ViscoelasticHistory, "history_after_step", lambda self, x, h: right(self, x, 1.01 * h))
    own = report(GEL + BAR + TIMED).models["cubes"]
    assert own.status == "failed"
    assert "independent formulas" in own.message


def test_a_curve_over_time_is_held_against_a_measured_one(tmp_path: Path) -> None:
    """A table of 60 mN (1 + exp(-t / s)) / 2, which the force of a bar of one term is."""
    t = np.linspace(0.2, 4.0, 200)
    rows = "\n".join(f"{a:.12g},{30.0 * (1.0 + np.exp(-a)):.12g}" for a in t)
    (tmp_path / "rig.csv").write_text(f"t,f\n{rows}\n")
    text = """
material gel   = viscoelastic(linear_elastic(young = 60 kPa, poisson = 0, density = 1000 kg/m^3),
    g = [0.5], tau = [1] s,
    of = whole)
body     bar   = solid(box(size = (20, 10, 10) mm), gel)
support  left  = fixed(bar, where = x <= 0 mm)
support  right = displaced(bar, where = x >= 20 mm, by = (0.2, 0, 0) mm)
analysis hold  = quasistatic(duration = 4 s, step = 0.5 s)
model    cubes = fem(hex8, strain = small, size = 5 mm)
metric   pull  = force(right, along = +x)
reference rig  = curve("rig.csv", x = "t", y = "f", x_unit = 1 s, y_unit = 1 mN, uncertainty = 1 %)
metric   off   = curve_error(pull, against = rig)
"""
    (tmp_path / "bar.scene").write_text(text)
    own = softmark.load(tmp_path / "bar.scene").run().models["cubes"]
    assert own.metrics["off"].value < 2e-3  # chords of the 20 times


@pytest.mark.slow
def test_a_time_is_the_same_from_the_one_before_and_from_the_start() -> None:
    every = report(GEL + BAR + TIMED).models["cubes"]
    last = report(GEL + BAR + TIMED.replace("[1, 2, 4]", "[4]")).models["cubes"]
    for metric in ("pull", "thin", "heat", "kept"):
        assert every.metrics[metric].value == pytest.approx(last.metrics[metric].value, rel=1e-8)


@pytest.mark.slow
def test_elastic_bodies_load_nothing_of_what_remembers() -> None:
    text = ELASTIC + BAR.replace(", amplitude = ramp(over = 2 s)", "").replace(
        "metric   heat  = dissipation(bar)\n", ""
    )
    words = (
        "fem_relaxation",
        "beam_relaxation",
        "viscoelastic_memory",
        "viscoelastic_rod",
        "viscoelastic_increment",
        "viscoelastic_step",
        "quasistatic_history",
        "hereditary",
        "viscoelastic_limits",
        "prony",
        "maxwell_branch",
        "youngs_relaxation",
        "quasistatic_times",
    )
    found = {m for m in loaded_by(text) if any(w in m for w in words)}
    assert found <= {"references.prony"}  # a word of the table


@pytest.mark.slow
@pytest.mark.parametrize(
    ("law", "nominal"),
    [
        ("mooney_rivlin(c1 = 6 kPa, c2 = 4 kPa", 28.0),
        ("yeoh(c1 = 10 kPa, c2 = 0.5 kPa, c3 = 0.01 kPa", 42.42),
        ("ogden(mu = [10, 2] kPa, alpha = [2, -2]", 15.75),
    ],
)
def test_rubber_of_every_law_relaxes_alike(law: str, nominal: float) -> None:
    """Stretched to 2 at nu = 0.5 the force starts at the law's own (kPa: Mooney-Rivlin and Yeoh by the closed forms of
    uniaxial tension, 2 (l - l^-2) (W1 + W2 / l), Ogden's by sum mu (l^(a-1) - l^(-a/2-1))) and falls as G(t)."""
    scene = softmark.load("relaxing-rubber").scene.source.text
    text = scene.replace("neo_hookean_isochoric(young = 3 * mu", law, 1)
    model = softmark.loads(text[: text.index("expect")]).run(models=["hexes"]).models["hexes"]
    force = nominal * 1e3 * 1e-4
    for got, share in zip(model.metrics["pull"].states, (1.0, 0.791331, None, 0.573590, 0.501348), strict=True):
        assert share is None or got == pytest.approx(share * force, rel=2e-6)


# ------------------------------------------------------------------ courses that steps do not end with

LINEAR = """
material gel   = viscoelastic(linear_elastic(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3), g = [G],
    tau = [TAU] s, of = whole)
body     bar   = solid(box(size = (20, 10, 10) mm), gel)
support  left  = fixed(bar, where = x <= 0 mm, components = x)
support  front = fixed(bar, where = y <= 0 mm, components = y)
support  below = fixed(bar, where = z <= 0 mm, components = z)
model    cubes = fem(hex8, strain = small, size = 10 mm)
"""
MOVED = """
support  right = displaced(bar, where = x >= 20 mm, by = (0.2, 0, 0) mm, components = x, amplitude = COURSE)
reference rod  = prony(bar)
metric   off   = force(right, along = +x, against = rod)
metric   heat  = dissipation(bar, against = rod)
"""


def linear(g: str = "0.3, 0.2", tau: str = "1, 10") -> str:
    return LINEAR.replace("G", g).replace("TAU", tau)


def codes(text: str) -> list[str]:
    """Of all errors, or of all warnings of a run."""
    try:
        own = softmark.loads(text).run()
    except softmark.SceneError as refused:
        return [d.code for d in refused.diagnostics]
    return [d.code for d in own.warnings]


def test_a_swing_that_steps_do_not_show_is_refused_where_it_is_remembered() -> None:
    """A swing of 1 s in steps of 1 s stands still; without a memory nothing is lost between two times."""
    timed = "analysis hold = quasistatic(duration = 3 s, step = 1 s, times = [1.25, 3] s)\n"
    moved = MOVED.replace("COURSE", "sine(frequency = 1 Hz)")
    assert "E381" in codes(linear(tau="100, 1000") + moved + timed)
    few = timed.replace("step = 1 s", "step = 200 ms")
    assert "W377" in codes(linear(tau="100, 1000") + moved + few)
    elastic = (
        (linear() + moved)
        .replace("viscoelastic(", "")
        .replace(", g = [0.3, 0.2],\n    tau = [1, 10] s, of = whole)", "")
    )
    elastic = "\n".join(line for line in elastic.splitlines() if "rod" not in line)
    assert not {"E381", "W377"} & set(codes(elastic + "\n" + timed))


def test_courses_that_play_no_part_say_so() -> None:
    timed = "analysis hold = quasistatic(duration = 2 s, step = 0.25 s, times = [1, 2] s)\n"
    for course in ("ramp(over = 1 s, start = 5 s)", "pulse(start = 2 s, until = 1 s)"):
        assert "W378" in codes(linear() + MOVED.replace("COURSE", course) + timed)


@pytest.mark.parametrize("rows", ["0,0\n0.999,0\n1.0,1\n2.5,1\n2.6,0.2\n4,0.2", "-1,0\n2,1\n4,0.2"])
def test_steps_end_at_the_kinks_of_a_table(tmp_path: Path, rows: str) -> None:
    """Between them a bar is ramped, which is exact; the theory takes what a table does from time 0 on."""
    (tmp_path / "way.csv").write_text(f"t,v\n{rows}\n")
    timed = "analysis hold = quasistatic(duration = 4 s, step = 0.4 s, times = [1, 2.5, 4] s)\n"
    moved = MOVED.replace("COURSE", 'table("way.csv", at = "t", value = "v")')
    (tmp_path / "bar.scene").write_text(linear() + moved + timed)
    own = softmark.load(tmp_path / "bar.scene").run().models["cubes"]
    for metric in ("off", "heat"):
        assert max(own.curve(metric).values) < 1e-8


def test_creep_under_what_acts_at_once_says_where_steps_do_not_show_it() -> None:
    """Steps of ten times tau are 4 % off, and what is held at once is exact at any step."""
    timed = "analysis hold = quasistatic(duration = 30 s, step = 10 s, times = [10, 30] s)\n"
    load = "load pull = traction(bar, where = x >= 20 mm, vector = (600 Pa, 0 Pa, 0 Pa))\n"
    assert "W369" in codes(linear("0.5", "1") + load + timed)
    assert "W369" not in codes(linear("0.5", "1") + MOVED.replace(", amplitude = COURSE", "") + timed)


def test_the_theory_of_what_relaxes_is_refused_where_no_share_does() -> None:
    timed = "analysis hold = quasistatic(duration = 2 s, step = 0.5 s, times = [1, 2] s)\n"
    assert codes(linear("0", "1") + MOVED.replace(", amplitude = COURSE", "") + timed) == ["E503"]


@pytest.mark.long
@pytest.mark.slow
def test_energy_of_a_law_that_is_not_convex_is_said_to_be_unknown_in_a_motion() -> None:
    """The wrong example of W368, without inertia to speak of."""
    text = """
material gel    = viscoelastic(neo_hookean(young = 60 kPa, poisson = 0.4, density = 1e-3 kg/m^3),
    g = [0.9], tau = [1] s,
    of = whole)
body     bar    = solid(box(size = (20, 10, 10) mm), gel)
support  left   = fixed(bar, where = x <= 0 mm)
support  front  = fixed(bar, where = y <= 0 mm or y >= 10 mm, components = y)
support  below  = fixed(bar, where = z <= 0 mm or z >= 10 mm, components = z)
support  right  = displaced(bar, where = x >= 20 mm, by = (10, 0, 0) mm, components = x, amplitude = smooth(over = 1 s))
analysis hold   = dynamic(duration = 4 s, step = 0.2 s)
model    cubes  = fem(hex8, strain = finite, size = 10 mm)
probe    mid    = point(bar, at = (10, 5, 5) mm)
metric   far    = displacement(mid, along = +x)
"""
    assert "W368" in codes(text)
    assert "W368" not in codes(text.replace("(10, 0, 0) mm", "(0.1, 0, 0) mm"))


LARGE = """
material gel   = viscoelastic(LAW, density = 1000 kg/m^3), g = [0.6, 0.3], tau = [0.3, 3] s OF)
body     bar   = solid(box(size = (20, 10, 10) mm), gel)
support  left  = fixed(bar, where = x <= 0 mm)
support  right = displaced(bar, where = x >= 20 mm, by = (15, 5, 0) mm, amplitude = smooth(over = 1 s))
model    cubes = fem(hex8, strain = STRAIN, size = 10 mm)
metric   heat  = dissipation(bar)
metric   kept  = strain_energy(bar)
metric   pull  = force(right, along = +x)
analysis hold  = quasistatic(duration = 4 s, step = STEP, times = [1, 2, 4] s)
"""
LAWS = {
    "neo": ("neo_hookean_isochoric(young = 60 kPa, poisson = 0.3", "", "finite"),
    "yeoh": ("yeoh(c1 = 10 kPa, c2 = 2 kPa, c3 = 1 kPa, poisson = 0.3", "", "finite"),
    "mooney": ("mooney_rivlin(c1 = 6 kPa, c2 = 4 kPa, poisson = 0.3", "", "finite"),
    "whole": ("neo_hookean(young = 60 kPa, poisson = 0.2", ", of = whole", "finite"),
    "turned": ("linear_elastic(young = 60 kPa, poisson = 0.3", ", of = whole", "corotational"),
}


def large(law: str, step: str) -> Report:
    own, of, strain = LAWS[law]
    text = LARGE.replace("LAW", own).replace("OF", of).replace("STRAIN", strain)
    return report(text.replace("STEP", step))


@pytest.mark.slow
@pytest.mark.parametrize("law", sorted(LAWS))
def test_work_at_large_strain_is_what_is_stored_and_what_is_lost(law: str) -> None:
    """Pulled by 75 % and sheared within a second, and held: what is left of the three falls with the square of the
    step, from less than 4 % of the work; and what is lost never falls, whatever the step."""
    off = []
    for step in ("0.2 s", "0.1 s"):
        own = large(law, step).models["cubes"]
        assert own.status == "converged", own.message
        heat = own.curve("heat").values
        assert 0.0 < heat[0] < heat[1] < heat[2]
        known = own.each[0].solve["energies_in_time"]
        off.append(abs(known["work_J"] - known["stored_J"] - known["dissipated_J"]) / known["work_J"])
    assert off[0] < 0.04
    assert off[1] < 0.45 * off[0]


# ------------------------------------------------------------------ in the frame that turns with the material

BIOT = """
material gel   = viscoelastic(linear_elastic(young = 60 kPa, poisson = NU, density = 1000 kg/m^3), g = [0.3, 0.2],
    tau = [1, 10] s, of = OF)
body     bar   = solid(box(size = (20, 10, 10) mm), gel)
support  left  = fixed(bar, where = x <= 0 mm, components = x)
support  front = fixed(bar, where = y <= 0 mm, components = y)
support  below = fixed(bar, where = z <= 0 mm, components = z)
support  right = displaced(bar, where = x >= 20 mm, by = (6, 0, 0) mm, components = x, amplitude = ramp(over = 2 s))
model    cubes = fem(ELEMENT, strain = corotational, size = 10 mm)
metric   pull  = force(right, along = +x)
analysis hold  = quasistatic(duration = 4 s, step = 0.5 s, times = [1, 2, 4] s)
"""


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize(
    ("element", "nu", "of"),
    [
        ("hex8", "0.3", "whole"),
        ("hex8, formulation = mixed", "0.5", "shape"),
        pytest.param("tet4", "0.3", "whole", marks=pytest.mark.slow),
        pytest.param("tet10", "0.3", "whole", marks=pytest.mark.slow),
        pytest.param("tet10, formulation = mixed", "0.5", "shape", marks=pytest.mark.slow),
    ],
)
def test_biots_stress_relaxes_in_proportion_to_the_stretch(element: str, nu: str, of: str) -> None:
    """E A (l - 1), ramped to 30 % in 2 s: the hereditary integral of a ramp, exact at any step, at large strain too."""
    own = report(BIOT.replace("ELEMENT", element).replace("NU", nu).replace("OF", of)).models["cubes"]
    assert own.status == "converged", own.message
    for t, pull, state in zip((1.0, 2.0, 4.0), own.curve("pull").values, own.each, strict=True):
        te = min(t, 2.0)
        left = sum(g * tau * (np.exp((te - t) / tau) - np.exp(-t / tau)) for g, tau in ((0.3, 1.0), (0.2, 10.0)))
        assert pull == pytest.approx(6.0 * 0.15 * (0.5 * te + left), rel=1e-8)
        assert state.solve["checks"]["residual"] < 1e-8


@pytest.mark.slow
@pytest.mark.parametrize("integrator", ["trapezoidal", "midpoint", "bdf2", "central_differences"])
def test_in_motion_small_and_corotational_strain_agree_and_a_beam_with_lumped_solids(integrator: str) -> None:
    """A bar at nu = 0 under 1 % of E: it does not turn, so that both strains are one; a beam has its mass at nodes."""
    text = """
material gel  = viscoelastic(linear_elastic(young = 60 kPa, poisson = 0, density = 1000 kg/m^3), g = [0.3, 0.2],
    tau = [0.01, 1] s, of = whole)
body     bar  = solid(box(size = (40, 10, 10) mm), gel)
support  left = fixed(bar, where = x <= 0 mm)
load     pull = traction(bar, where = x >= 40 mm, vector = (600, 0, 0) Pa)
probe    end  = point(bar, at = (40, 5, 5) mm)
metric   far  = displacement(end, along = +x)
model    cubes = fem(hex8, strain = small, size = 10 mm, mass = lumped)
model    turns = fem(hex8, strain = corotational, size = 10 mm, mass = lumped)
model    rod   = beam6dof(segments = 4)
"""
    text += f"analysis time = dynamic(duration = 60 ms, step = 0.5 ms, integrator = {integrator})\n"
    found = {name: model.metrics["far"].value for name, model in report(text).models.items()}
    assert found["turns"] == pytest.approx(found["cubes"], rel=1e-8)
    assert found["rod"] == pytest.approx(found["cubes"], rel=1e-7)


@pytest.mark.parametrize("model", ["modal(cubes, modes = 2)", "pod(cubes, modes = 2)"])
def test_reduced_models_are_refused_what_relaxes(model: str) -> None:
    text = linear() + "load pull = traction(bar, where = x >= 20 mm, vector = (600 Pa, 0 Pa, 0 Pa))\n"
    text += f"model few = {model}\nanalysis t = quasistatic(duration = 2 s, step = 0.25 s, times = [1, 2] s)\n"
    assert codes(text + "probe p = point(bar, at = (20, 5, 5) mm)\nmetric u = displacement(p, along = +x)\n") == [
        "E358"
    ]
