"""Scenes of porous bodies full of fluid."""

from __future__ import annotations

import pickle
from pathlib import Path

import meshio
import numpy as np
import pytest
from loaded_modules import loaded_by

import softmark
from softmark.interpreter.report.files.report_files import write_vtu
from softmark.interpreter.results.run_report import ModelResult, Report
from softmark.solvers.materials.biphasic import Biphasic

HEAD = """
param H = 10 mm
param dt = 5 s
param k = 1e-12 m^4/(N*s)
analysis wait = quasistatic(duration = 50 s, step = dt, times = [5, 50] s)
"""
SMALL = "material gel = biphasic(linear_elastic(young = 1 MPa, poisson = 0, density = 1000 kg/m^3), permeability = k)\n"
FINITE = """material gel = biphasic(
    neo_hookean(young = 1 MPa, poisson = 0.1, density = 1000 kg/m^3),
    permeability = k,
    exponent = 2,
    stiffening = 2,
    solid = 0.2,
)
"""
COLUMN = """
body plug = solid(box(size = (2 mm, 2 mm, H)), gel)
support below = fixed(plug, where = z <= 0 mm, components = z)
support sides = fixed(plug, where = x <= 0 mm or x >= 2 mm, components = x)
support front = fixed(plug, where = y <= 0 mm or y >= 2 mm, components = y)
support open = drained(plug, where = z >= H)
probe top = point(plug, at = (0 mm, 0 mm, H))
metric sink = displacement(top, along = -z)
metric deep = pore_pressure(plug, at = (0, 0, 0) mm)
metric out = outflow(open)
metric heat = dissipation(plug)
"""
PUSH = "load press = traction(plug, where = z >= H, vector = (0, 0, -1) kPa)\n"


def report(text: str, **parameters: str) -> Report:
    """The report of a scene."""
    return softmark.loads(text, **parameters).run()


def terzaghi(T: float) -> tuple[float, float]:
    """Pressure at the sealed end over the load, and the share of the settlement: two series of 400 terms."""
    M = 0.5 * np.pi * (2 * np.arange(400) + 1)
    decay = np.exp(-(M**2) * T)
    return float((2.0 / M * np.sin(M) * decay).sum()), float(1.0 - (2.0 / M**2 * decay).sum())


def looked_at(model: ModelResult) -> None:
    """It was found again by other formulas, and no fluid was lost."""
    assert model.status == "converged", model.message
    for state in model.each:
        assert state.solve["checks"]["residual"] < 1e-9
        assert state.solve["fluid"]["balance"] < 1e-10


@pytest.mark.slow
@pytest.mark.long
def test_a_column_consolidates() -> None:
    """Terzaghi's: H^2 / c = 100 s. To 0.3 % in five cells, of which the error is of second order (0.28 %)."""
    text = HEAD + SMALL + COLUMN + PUSH + "model m = fem(hex20, strain = small, size = 2 mm)\n"
    model = report(text, dt="2.5 s").models["m"]
    looked_at(model)
    p, U = terzaghi(0.5)
    assert model.metrics["deep"].value == pytest.approx(p * 1e3, rel=3e-3)
    assert model.metrics["sink"].value == pytest.approx(U * 1e-5, rel=4e-3)
    out = model.metrics["out"].value
    assert out == pytest.approx(4e-6 * model.metrics["sink"].value, rel=1e-9)
    assert model.solve["fluid"]["outflow_m3"]["open"] == out


@pytest.mark.long
@pytest.mark.slow
def test_steps_are_of_second_order() -> None:
    """Differences of halved steps shrink four times, within a tenth; and cells ten times as fine are right to 1e-4."""
    text = HEAD + SMALL + COLUMN + PUSH + "model m = fem(hex20, strain = small, size = h)\nparam h = 2 mm\n"
    found = [report(text, dt=f"{dt} s").models["m"].metrics for dt in (5, 2.5, 1.25, 0.625)]
    for metric in ("sink", "deep"):
        apart = np.diff([metrics[metric].value or 0.0 for metrics in found])
        np.testing.assert_allclose(apart[:-1] / apart[1:], 4.0, rtol=0.1)


@pytest.mark.long
@pytest.mark.slow
def test_cells_are_of_second_order() -> None:
    p, U = terzaghi(0.5)
    text = HEAD + SMALL + COLUMN + PUSH + "model m = fem(hex20, strain = small, size = h)\nparam h = 2 mm\n"
    text = text.replace("2 mm, 2 mm, H", "h, h, H").replace(">= 2 mm", ">= h")
    each = [report(text, dt="1 s", h=f"{h} mm").models["m"].metrics for h in (2, 1, 0.5)]
    off = np.array(
        [[(m["deep"].value or 0.0) / (p * 1e3) - 1.0, (m["sink"].value or 0.0) / (U * 1e-5) - 1.0] for m in each]
    )
    assert np.all(np.abs(off[2]) < 3e-4)
    np.testing.assert_allclose(np.abs(off[0] / off[1]), 4.0, rtol=0.2)


@pytest.mark.slow
def test_long_after_it_is_the_drained_law() -> None:
    """At a permeability at which a step is long after the load: the state of the skeleton alone, to 1e-9."""
    push = PUSH.replace("-1", "-200")
    wet = report(
        HEAD + FINITE + COLUMN + push + "model m = fem(tet10, strain = finite, size = 5 mm)\n", k="1e-6 m^4/(N*s)"
    )
    looked_at(wet.models["m"])
    assert wet.models["m"].metrics["deep"].value == pytest.approx(0.0, abs=1e-3)
    dry = "material gel = neo_hookean(young = 1 MPa, poisson = 0.1, density = 1000 kg/m^3)\n" + "\n".join(
        line for line in COLUMN.splitlines() if not any(word in line for word in ("open", "deep", "out", "heat"))
    )
    own = report(f"param H = 10 mm\n{dry}\n{push}model m = fem(tet10, strain = finite, size = 5 mm)\n").models["m"]
    assert wet.models["m"].metrics["sink"].value == pytest.approx(own.metrics["sink"].value, rel=1e-9)


def test_a_pump_presses_fluid_through() -> None:
    """Steady seepage: p falls in a straight line, and k p A / H leaves below in every second; to 1e-9."""
    bath = "support bath = pore_pressure(plug, where = z >= H, value = 2 kPa, amplitude = ramp(over = 1 s))\n"
    drain = "support drain = drained(plug, where = z <= 0 mm)\nmetric past = outflow(drain)\n"
    half = "metric half = pore_pressure(plug, at = (1, 1, 5) mm)\n"
    text = (
        HEAD + SMALL + COLUMN.replace("support open = drained(plug, where = z >= H)\n", "").replace("(open)", "(bath)")
    )
    text += bath + drain + half + "model m = fem(hex20, strain = small, size = 5 mm)\n"
    model = report(text, k="1e-10 m^4/(N*s)").models["m"]
    looked_at(model)
    assert model.metrics["half"].value == pytest.approx(1e3, rel=1e-9)
    through = 1e-10 * 2e3 * 4e-6 / 10e-3
    first, last = model.curve("past").values
    assert last - first == pytest.approx(45.0 * through, rel=1e-9)
    first, last = model.curve("out").values
    assert last - first == pytest.approx(-45.0 * through, rel=1e-9)


def test_a_sealed_body_keeps_its_volume() -> None:
    text = (
        HEAD
        + FINITE
        + COLUMN.replace("support open = drained(plug, where = z >= H)\n", "").replace(
            "metric out = outflow(open)\n", ""
        )
    )
    text = text.replace(
        "support sides = fixed(plug, where = x <= 0 mm or x >= 2 mm, components = x)",
        "support sides = fixed(plug, where = x <= 0 mm, components = x)",
    )
    text += "probe all = surface(plug)\nmetric grown = volume_change(all)\n"
    found = report(
        text + PUSH.replace("-1", "-100") + "model m = fem(tet10, strain = finite, size = 5 mm)\n", dt="25 s"
    )
    model = found.models["m"]
    looked_at(model)
    assert "W395" in {w.code for w in found.warnings}
    assert abs(model.solve["fluid"]["moved_m3"]) < 1e-16
    assert (model.metrics["sink"].value or 0.0) > 2e-4


@pytest.mark.parametrize("wrong", ["permeable", "permeability"])
def test_a_wrong_flow_is_found(wrong: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The watchdog knows Darcy's law by itself: a solver whose permeability is a tenth too large has no answer."""
    strain, material = ("finite", FINITE) if wrong == "permeable" else ("small", SMALL)
    if wrong == "permeable":
        known = Biphasic.permeable
        monkeypatch.setattr(Biphasic, "permeable", lambda self, J: 1.1 * known(self, J))
    else:
        from softmark.solvers.energies.poroelastic import PoroelasticSolid

        flow = PoroelasticSolid._negative_fluid_flux
        monkeypatch.setattr(PoroelasticSolid, "_negative_fluid_flux", lambda self, x: 1.1 * flow(self, x))
    text = HEAD + material + COLUMN + PUSH + f"model m = fem(tet10, strain = {strain}, size = 5 mm)\n"
    model = report(text).models["m"]
    assert model.status == "failed"
    assert "do not balance" in (model.message or "")


@pytest.mark.parametrize(
    "power", [pytest.param(-24, marks=pytest.mark.slow), -15, pytest.param(-3, marks=pytest.mark.slow)]
)
def test_no_permeability_is_too_small_or_too_large(power: int) -> None:
    text = HEAD + FINITE + COLUMN + PUSH.replace("-1", "-300") + "model m = fem(hex20, strain = finite, size = 5 mm)\n"
    found = report(text, k=f"1e{power} m^4/(N*s)", dt="25 s")
    looked_at(found.models["m"])
    assert ("W393" in {w.code for w in found.warnings}) == (power < -3)
    heat = found.models["m"].curve("heat").values
    assert 0.0 <= heat[0] <= heat[1]


@pytest.mark.slow
def test_steps_of_the_smallest_size_do_not_oscillate() -> None:
    """At the step that W393 names pressures are at most 1 % above the load; at a hundredth of it they are more."""
    text = HEAD + SMALL + COLUMN + PUSH + "model m = fem(hex20, strain = small, size = 1 mm)\n"
    text = text.replace("times = [5, 50] s", "times = [T]\nparam T = 5 s").replace("duration = 50 s", "duration = T")
    text = text.replace("times = [T]\nparam T = 5 s)", "times = [T])\nparam T = 5 s")
    least = report(text, dt="5 s").models["m"].solve["fluid"]["smallest_step_s"]
    over = []
    for step in (least, 0.01 * least):
        own = report(text, dt=f"{step} s", T=f"{step} s")
        over.append(own.models["m"].metrics["deep"].details["largest_Pa"] / 1e3 - 1.0)
        assert ("W393" in {w.code for w in own.warnings}) == (step < 0.5 * least)
    assert over[0] < 0.01 < over[1]


def test_files_have_the_pressure_of_the_fluid(tmp_path: Path) -> None:
    """At every node, linear between corners: steady seepage, in a straight line from end to end."""
    bath = "support bath = pore_pressure(plug, where = z >= H, value = 2 kPa)\n"
    text = (
        HEAD
        + SMALL
        + COLUMN.replace("support open = drained(plug, where = z >= H)\n", bath).replace("(open)", "(bath)")
    )
    text += "support drain = drained(plug, where = z <= 0 mm)\nmodel m = fem(tet10, strain = small, size = 5 mm)\n"
    found = report(text, k="1e-9 m^4/(N*s)")
    write_vtu(found, tmp_path)
    mesh = meshio.read(tmp_path / "vtu" / "m-0001.vtu")
    np.testing.assert_allclose(mesh.point_data["pore_pressure"], 2e3 * mesh.points[:, 2] / 0.01, atol=1e-6)


@pytest.mark.slow
def test_what_leaves_at_once_is_not_vouched_for() -> None:
    """At the time of a jump, and at the end of the first step after it (5 % off, by Terzaghi); not later."""
    text = HEAD.replace("times = [5, 50] s", "times = [T]\nparam T = 5 s").replace(
        "times = [T]\nparam T = 5 s)", "times = [T])\nparam T = 5 s"
    )
    text += SMALL + COLUMN + PUSH + "model m = fem(hex20, strain = small, size = 2 mm)\n"
    said = [{w.code for w in report(text, T=f"{T} s").warnings} for T in (0, 5, 10)]
    assert ["W394" in codes for codes in said] == [True, True, False]
    late = text.replace("-1) kPa)", "-1) kPa, amplitude = pulse(start = 20 s, until = 40 s))")
    said = [{w.code for w in report(late, T=f"{T} s").warnings} for T in (30, 40)]
    assert ["W394" in codes for codes in said] == [False, True]


@pytest.mark.slow
@pytest.mark.long
def test_bodies_without_fluid_load_nothing_of_it() -> None:
    """But words of tables: no energy, no check, no builder."""
    text = """softmark 1
scene "dry"
material gel = neo_hookean(young = 1 MPa, poisson = 0.5, density = 1000 kg/m^3)
body bar = solid(box(size = (20, 10, 10) mm), gel)
support left = fixed(bar, where = x <= 0 mm)
load down = gravity(9.81 m/s^2)
model tets = fem(tet10, strain = finite, size = 5 mm, formulation = mixed)
"""
    words = ("poroelastic", "taylor_hood", "fluid")
    assert not {m for m in loaded_by(text) if any(w in m for w in words)}


def pumped(course: str, k: str, loads: str, strain: str = "small", value: str = "2 kPa") -> ModelResult:
    """A column whose fluid is pressed above and free below, as `loads` press it."""
    bath = f"support bath = pore_pressure(plug, where = z >= H, value = {value}{course})\n"
    bath += "support drain = drained(plug, where = z <= 0 mm)\n"
    column = COLUMN.replace("support open = drained(plug, where = z >= H)\n", bath).replace("(open)", "(bath)")
    material = SMALL if strain == "small" else FINITE
    made = HEAD + material + column + loads + f"model m = fem(hex20, strain = {strain}, size = 5 mm)\n"
    return report(made, k=k).models["m"]


@pytest.mark.slow
@pytest.mark.parametrize("strain", ["small", pytest.param("finite", marks=pytest.mark.slow)])
def test_what_a_pump_does_is_work(strain: str) -> None:
    """Seepage dissipates what a pump does: works, what is stored and what is lost agree, as forces alone do not."""
    model = pumped(", amplitude = ramp(over = 5 s)", "1e-12 m^4/(N*s)", "", strain)
    known = model.solve["energies_in_time"]
    assert known["work_J"] == pytest.approx(known["stored_J"] + known["dissipated_J"], rel=0.02)
    steady = pumped(", amplitude = ramp(over = 5 s)", "1e-9 m^4/(N*s)", "", strain).solve["energies_in_time"]
    through = 1e-9 * 2e3 * 4e-6 / 10e-3 * 2e3  # W
    assert steady["work_J"] == pytest.approx((45.0 + 5.0 / 3.0) * through, rel=0.01)


def test_fluid_that_passes_through_has_moved() -> None:
    """A steady flow of 4e4 times what pores take: its balance is over all of that, and the answer is one."""
    model = pumped(", amplitude = ramp(over = 5 s)", "1e-6 m^4/(N*s)", "")
    looked_at(model)
    assert model.solve["fluid"]["moved_m3"] == pytest.approx(47.5 * 1e-6 * 2e3 * 4e-6 / 10e-3, rel=0.01)


@pytest.mark.parametrize("strain", ["small", pytest.param("finite", marks=pytest.mark.slow)])
def test_a_body_in_a_bath_is_at_rest(strain: str) -> None:
    """Pressed all around as its fluid is, nothing moves: no share of nothing is lost, and nothing is unresolved."""
    text = HEAD + (SMALL if strain == "small" else FINITE)
    bath = "support open = pore_pressure(plug, where = z >= H, value = 20 kPa)\n"
    text += COLUMN.replace("support open = drained(plug, where = z >= H)\n", bath)
    text += "load press = pressure(plug, where = z >= H, magnitude = 20 kPa)\n"
    found = report(text + f"model m = fem(hex20, strain = {strain}, size = 5 mm)\n", k="1e-10 m^4/(N*s)")
    looked_at(found.models["m"])
    assert abs(found.models["m"].metrics["sink"].value or 0.0) < 1e-14
    assert found.models["m"].metrics["deep"].value == pytest.approx(20e3, rel=1e-9)
    assert "W394" not in {w.code for w in found.warnings}


def test_a_report_of_fluid_can_be_pickled() -> None:
    """Its mesh knows the problem that a later time goes on from, which asks functions: the copy does without."""
    found = report(HEAD + SMALL + COLUMN + PUSH + "model m = fem(tet10, strain = small, size = 10 mm)\n", dt="25 s")
    copy = pickle.loads(pickle.dumps(found))
    assert copy.to_json() == found.to_json()
    np.testing.assert_array_equal(copy.models["m"].mesh.pore_pressure, found.models["m"].mesh.pore_pressure)


SKELETON = "neo_hookean(young = 1 MPa, poisson = 0.1, density = 1000 kg/m^3)"


@pytest.mark.parametrize(
    ("code", "old", "new"),
    [
        ("E375", "young = 1 MPa", "young = 1 MPa + 1 MPa * z / H"),
        ("E375", "poisson = 0.1", "poisson = 0.1 + 0.1 * z / H"),
        (
            "E362",
            FINITE,
            f"material gel = viscoelastic({SKELETON.replace('0.1', '0.1 + 0.1 * z / H')}, g = [0.3], tau = [1 s])\n",
        ),
    ],
)
def test_constants_that_vary_are_refused_of_what_has_a_past(code: str, old: str, new: str) -> None:
    """They stand in the law within, where what is said of a material before anything is built did not find them."""
    column = COLUMN if code == "E375" else COLUMN[: COLUMN.index("support open")]
    text = (HEAD + FINITE).replace(old, new) + column + PUSH + "model m = fem(tet10, strain = finite, size = 5 mm)\n"
    with pytest.raises(softmark.SceneError) as refused:
        softmark.loads(text)
    assert {d.code for d in refused.value.diagnostics} == {code}


def test_a_drain_that_another_covers_is_refused() -> None:
    """Its outflow would be none, for what two share is the first's."""
    again = "support again = drained(plug, where = z >= H)\nmetric more = outflow(again)\n"
    with pytest.raises(softmark.SceneError, match="another drained support declared before it"):
        report(HEAD + SMALL + COLUMN + again + PUSH + "model m = fem(tet10, strain = small, size = 5 mm)\n")
