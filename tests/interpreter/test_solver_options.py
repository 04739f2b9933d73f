"""Levers as scenes have them: fields of `fem`, their status, what the report says of them, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

import softmark
from softmark.interpreter.results.run_report import ModelResult

SCENE = """
param h = 15 mm
material gel    = neo_hookean(young = 60 kPa, poisson = 0.49, density = 1070 kg/m^3)
body     beam   = solid(cylinder(length = 178 mm, radius = 19 mm), gel)
support  wall   = fixed(beam, where = x <= 0 mm)
load     weight = gravity(9.81 m/s^2, direction = -z)
analysis sag    = static()
probe    tip    = point(beam, at = (178, 0, 0) mm)
metric   drop   = displacement(tip, along = -z)
model    plain  = fem(tet4, strain = corotational, size = h)
model    hex    = fem(hex8, strain = finite, integration = selective, size = h)
"""


def solved(text: str, *overrides: str) -> softmark.Report:
    """The report of the scene with more in it."""
    return softmark.loads(SCENE + text, **dict(o.split("=") for o in overrides)).run()


def drop(model: ModelResult) -> float:
    value = model.metrics["drop"].value
    assert value is not None
    return float(value)


LEVERS = """
model single = fem(tet4, strain = corotational, size = h, precision = single)
model reused = fem(tet4, strain = corotational, size = h, factorisation = reused)
model cg     = fem(tet4, strain = corotational, size = h, linear = conjugate_gradients)
model capped = fem(tet4, strain = corotational, size = h, max_iterations = 3)
model sofa   = fem(tet4, strain = corotational, size = h, max_iterations = 1,
    linear = conjugate_gradients, max_linear_iterations = 25)
model coarse = fem(hex8, strain = finite, integration = selective, size = 2 * h)
model fine   = fem(hex8, strain = finite, integration = selective, size = h, initial_guess = coarse)
"""


@pytest.fixture(scope="module")
def report() -> softmark.Report:
    return solved(LEVERS)


@pytest.mark.slow
def test_levers_that_cost_no_accuracy(report: softmark.Report) -> None:
    """Forces to 1e-8, or in single precision to 1e-3 and states to 1e-5 (tests/solvers/test_integration_options.py)."""
    exact = drop(report.models["plain"])
    for name, error in (("single", 1e-5), ("reused", 1e-7), ("cg", 1e-7)):
        assert report.models[name].status == "converged"
        assert drop(report.models[name]) == pytest.approx(exact, rel=error), name


@pytest.mark.slow
def test_single_precision_is_said_to_end_in_rounding(report: softmark.Report) -> None:
    solve = report.models["single"].solve
    assert solve["criterion"].startswith("rounding")
    assert 1e-8 < solve["residual"] < 1e-3
    assert "single precision" in report.models["single"].outline


@pytest.mark.slow
def test_a_capped_state_has_its_metrics_and_its_residual(report: softmark.Report) -> None:
    """Three Newton steps are within a few per cent of the drop already; their residual is far from the tolerance."""
    capped, exact = report.models["capped"], drop(report.models["plain"])
    assert capped.status == "capped"
    assert capped.solve["iterations"] == 3
    assert capped.solve["residual"] > 1e-4
    assert 0.0 < abs(drop(capped) / exact - 1.0) < 0.05


@pytest.mark.slow
def test_what_simulators_do_in_a_step_is_no_solution(report: softmark.Report) -> None:
    """One Newton step and 25 iterations: below 3 % of the drop, as measured with another framework in motion."""
    assert report.models["sofa"].status == "capped"
    assert report.models["sofa"].solve["linear_capped"] == 1
    assert drop(report.models["sofa"]) < 0.03 * drop(report.models["plain"])


@pytest.mark.slow
def test_a_start_saves_steps_and_is_charged(report: softmark.Report) -> None:
    """From the coarse mesh 4 to 5 steps where rest needs 8; both end in the same state to the tolerance."""
    fine, plain = report.models["fine"], report.models["hex"]
    start = fine.solve["start"]
    assert (start["model"], start["status"], start["used"]) == ("coarse", "converged", True)
    assert start["iterations"] == report.models["coarse"].solve["iterations"]
    assert 0.0 < start["cpu_s"] <= fine.time["solve_cpu_s"].seconds[0]
    assert fine.solve["iterations"] < plain.solve["iterations"]
    assert drop(fine) == pytest.approx(drop(plain), rel=1e-7)


@pytest.mark.slow
def test_levers_are_fields_that_overrides_change() -> None:
    found = solved("", "plain.precision=single", "hex.max_iterations=2", "sag.tolerance=1e-5")
    assert found.models["plain"].solve["criterion"].startswith("rounding")
    assert found.models["hex"].status == "capped"


@pytest.mark.slow
@pytest.mark.long
def test_the_tolerance_of_an_analysis_is_a_lever() -> None:
    """Fewer Newton steps for less: 1e-2 against 1e-8."""
    loose, tight = (solved("", f"sag.tolerance={t}").models["plain"].solve for t in ("1e-2", "1e-8"))
    assert loose["iterations"] < tight["iterations"]
    assert tight["residual"] <= 1e-8 < loose["residual"] <= 1e-2


def test_a_model_can_start_from_a_beam() -> None:
    """Any model of the body that has displacements: 40 segments know the rotations, and nothing of the sections."""
    rod = "model rod = beam6dof(segments = 40)\n"
    found = solved(rod + "model warm = fem(tet4, strain = corotational, size = h, initial_guess = rod)\n")
    warm, plain = found.models["warm"], found.models["plain"]
    assert warm.solve["start"]["used"]
    np.testing.assert_allclose(warm.probes["tip"].displacement, plain.probes["tip"].displacement, atol=1e-8)


@pytest.mark.parametrize(("linear", "package"), [("pardiso", "pypardiso"), ("multigrid", "pyamg")])
def test_a_linear_solver_that_is_missing_is_said_before_anything_is_solved(
    linear: str, package: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("softmark.interpreter.models.fem.solver_options.find_spec", lambda name: None)
    with pytest.raises(softmark.SceneError) as refused:
        solved(f"model other = fem(tet4, strain = corotational, size = h, linear = {linear})\n")
    (found,) = (d for d in refused.value.diagnostics if d.code == "E508")
    assert found.message == f"`linear = {linear}` needs the package `{package}`"
    assert "softmark[fast]" in found.help
