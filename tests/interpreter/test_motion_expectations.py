"""What a report says of motions that are not right: gains of energy, steps too long, meshes made worse on purpose."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

import softmark
from softmark.interpreter.models.procedures.dynamic_warnings import energy_warning
from softmark.solvers.dynamics.energy_balance import EnergyBalance

BLOCK = """
material gel   = neo_hookean(young = 1 MPa, poisson = 0.3, density = 1000 kg/m^3)
body     block = solid(box(size = (40, 10, 10) mm), gel)
probe    tip   = point(block, at = (40, 5, 5) mm)
"""
HELD = BLOCK + "support wall = fixed(block, where = x <= 0 mm)\nload weight = gravity(9.81 m/s^2)\n"


def run(text: str) -> softmark.Report:
    return softmark.loads(text).run()


@pytest.mark.slow
@pytest.mark.parametrize(
    "integrator",
    ["trapezoidal", pytest.param("newmark", marks=pytest.mark.slow), pytest.param("midpoint", marks=pytest.mark.slow)],
)
def test_a_spin_that_gains_energy_is_never_converged_in_silence(integrator: str) -> None:
    """300 rad/s in steps of 10 ms, three radians each: no rule of second order without damping can follow that.

    The energy of the spin is all there is: what comes in addition is the integrator's.
    """
    cells = "model cells = fem(hex8, strain = corotational, size = 10 mm)\n"
    text = f"analysis turn = dynamic(duration = 0.3 s, step = 10 ms, integrator = {integrator}, "
    report = run(BLOCK + cells + text + "spin = (0, 0, 300) rad/s)\n")
    model = report.models["cells"]
    said = {w.code for w in report.warnings} & {"W318", "W361", "W362"}
    assert model.status in ("diverged", "not_converged") or said, model.solve["energy"]
    if model.status == "diverged":
        assert "has grown" in str(model.message)
        assert "smaller step" in str(model.message)
        assert model.probes == {}
        assert model.solve["energy"]["gained"] is True


@pytest.mark.parametrize(
    ("integrator", "remedy"),
    [("implicit_euler", "a smaller step, or `trapezoidal`"), ("trapezoidal", "a smaller step")],
)
def test_what_is_lost_is_no_reason_to_take_the_integrator_that_is_there(integrator: str, remedy: str) -> None:
    cells = "model cells = fem(hex8, strain = corotational, size = 10 mm)\n"
    text = f"analysis fall = dynamic(duration = 1 s, step = 10 ms, integrator = {integrator})\n"
    declared = softmark.loads(HELD + cells + text).scene.declared
    track: Any = SimpleNamespace(balance=EnergyBalance(drift=0.3, gain=0.0, loss=0.3, scale=1.0, time=0.0))
    (said,) = energy_warning(declared["cells"], declared["fall"].thing, track)
    assert said.code == "W361"
    assert str(said.help).startswith(f"use {remedy}:")


def test_a_refused_explicit_step_leaves_its_number() -> None:
    cells = "model cells = fem(hex8, strain = corotational, size = 5 mm, mass = lumped)\n"
    report = run(
        HELD + cells + "analysis fall = dynamic(duration = 1 s, step = 10 ms, integrator = central_differences)\n"
    )
    model = report.models["cells"]
    assert model.status == "failed"
    # cells of 5 mm, and waves of sqrt(E (1 - nu)/((1 + nu)(1 - 2 nu) rho)) = 37 m/s: of the order of 5 mm / 37 m/s
    assert 0.3 < model.solve["critical_step_s"] / (5e-3 / 36.7) < 1.1


def test_the_balance_and_the_resolution_are_in_the_report() -> None:
    cells = "model cells = fem(hex8, strain = corotational, size = 5 mm)\n"
    report = run(HELD + cells + "analysis fall = dynamic(duration = 40 ms, step = 1 ms, integrator = trapezoidal)\n")
    solve = report.models["cells"].solve
    assert not report.warnings
    energy = solve["energy"]
    assert energy["gained"] is False
    assert energy["drift"] < 0.01
    # the first bending mode of a cantilever: 3.516 sqrt(E I / rho A L^4) / 2 pi, 31.9 Hz by Euler and Bernoulli; at a
    # slenderness of four, shear and coarse cells move it by up to a tenth
    assert solve["resolution"]["period_s"] == pytest.approx(1 / 32.0, rel=0.15)
    assert solve["mesh"] == {"quality": pytest.approx(1.0, rel=1e-9)}


@pytest.mark.parametrize("element", ["tet4", "tet10", "hex8"])
def test_quality_is_that_of_the_mesh(element: str) -> None:
    cells = f"model cells = fem({element}, strain = small, size = 5 mm, quality = 0.01)\n"
    cells += f"model made = fem({element}, strain = small, size = 5 mm)\n"
    report = run(HELD + cells)
    moved, made = report.models["cells"], report.models["made"]
    assert moved.status == "converged"
    assert moved.solve["mesh"]["quality"] == pytest.approx(0.01, rel=1e-6)
    assert made.solve["mesh"]["quality"] > 0.5
    assert "worst cell of quality 0.01" in moved.outline
    assert moved.size == made.size
