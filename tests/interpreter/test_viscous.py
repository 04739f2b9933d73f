"""Scenes of bodies whose stress relaxes, and of courses of time without inertia."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import softmark
from softmark.interpreter.results.report import Report
from softmark.solvers.energies.remembering import Memory

GEL = """
material gel   = viscous(neo_hookean_isochoric(young = 60 kPa, poisson = 0.4, density = 1000 kg/m^3), g = [0.3, 0.2],
    tau = [1, 10] s)
"""
ELASTIC = "material gel = neo_hookean_isochoric(young = 60 kPa, poisson = 0.4, density = 1000 kg/m^3)\n"
BAR = """
body     bar   = solid(box(size = (20, 10, 10) mm), gel)
support  left  = fixed(bar, where = x <= 0 mm)
support  right = displaced(bar, where = x >= 20 mm, by = (6, 0, 0) mm, components = x, course = ramp(over = 2 s))
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
    still = report(ELASTIC + BAR.replace("ramp(over = 2 s)", "state") + static).models["cubes"]
    for metric in ("pull", "thin", "kept"):
        first, second, last = own.curve(metric).values
        np.testing.assert_allclose([first, second], still.curve(metric).values, rtol=1e-8)
        assert last == pytest.approx(second, rel=1e-8)
    assert own.curve("heat").values == (0.0, 0.0, 0.0)


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
        assert energies["work_J"] == pytest.approx(whole, rel=5e-3)  # the trapezoidal rule in eight steps


def test_the_watchdog_finds_a_memory_that_forgets_wrongly(monkeypatch: pytest.MonkeyPatch) -> None:
    right = Memory.accepted
    monkeypatch.setattr(Memory, "accepted", lambda self, x, h: right(self, x, 1.01 * h))
    own = report(GEL + BAR + TIMED).models["cubes"]
    assert own.status == "failed"
    assert "other formulas" in own.message


def test_a_curve_over_time_is_held_against_a_measured_one(tmp_path: Path) -> None:
    """A table of 60 mN (1 + exp(-t / s)) / 2, which the force of a bar of one term is."""
    t = np.linspace(0.2, 4.0, 200)
    rows = "\n".join(f"{a:.12g},{30.0 * (1.0 + np.exp(-a)):.12g}" for a in t)
    (tmp_path / "rig.csv").write_text(f"t,f\n{rows}\n")
    text = """
material gel   = viscous(linear_elastic(young = 60 kPa, poisson = 0, density = 1000 kg/m^3), g = [0.5], tau = [1] s,
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


def test_a_time_is_the_same_from_the_one_before_and_from_the_start() -> None:
    every = report(GEL + BAR + TIMED).models["cubes"]
    last = report(GEL + BAR + TIMED.replace("[1, 2, 4]", "[4]")).models["cubes"]
    for metric in ("pull", "thin", "heat", "kept"):
        assert every.metrics[metric].value == pytest.approx(last.metrics[metric].value, rel=1e-8)


def test_elastic_bodies_load_nothing_of_what_remembers(tmp_path: Path) -> None:
    text = ELASTIC + BAR.replace(", course = ramp(over = 2 s)", "").replace("metric   heat  = dissipation(bar)\n", "")
    code = (
        "import sys; from softmark.interpreter.face import api; api.load(sys.argv[1]).run();"
        "words = ('ageing', 'remember', 'relaxing', 'hereditary', 'shared.viscous', 'prony');"
        "found = [m for m in sys.modules if m.startswith('softmark.') and any(w in m for w in words)];"
        "print(sorted(found))"
    )
    (tmp_path / "bar.scene").write_text(text)
    done = subprocess.run(
        [sys.executable, "-c", code, tmp_path / "bar.scene"], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip().splitlines()[-1] in ("[]", "['softmark.references.prony']")  # a word of the table


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
