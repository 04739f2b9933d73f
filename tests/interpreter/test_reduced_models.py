"""Reduced models in scenes: errors against the full model, training, what is said beyond it, motion."""

from __future__ import annotations

import json
import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

import softmark
from softmark.interpreter.models.model_builders import build
from softmark.interpreter.models.reduced import reduced_declaration
from softmark.interpreter.models.reduced.reduced_builder import PreparedReduced
from softmark.interpreter.models.shared.prepared_model import BuildContext
from softmark.interpreter.problem.body_case import case_of
from softmark.interpreter.results.run_report import ModelResult, Report

BEAM = """
param    pull   = 20 m/s^2
material gel    = neo_hookean(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     beam   = solid(box(size = (80, 20, 20) mm), gel)
support  wall   = fixed(beam, where = x <= 0 mm)
load     weight = gravity(pull, direction = -z)
model    full   = fem(hex8, strain = corotational, size = 10 mm)
probe    axis   = line(beam, from = (0, 10, 10) mm, to = (80, 10, 10) mm, points = 9)
metric   error  = relative_l2_error(axis, against = full)
metric   drop   = displacement(axis, along = -z)
"""
EIGHT = "[0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875, 1]"


def run(text: str, **parameters: Any) -> Report:
    return softmark.loads(text, **parameters).run()


def error(result: ModelResult) -> float:
    assert result.status == "converged", result.message
    value = result.metrics["error"].value
    assert value is not None
    return value


def said(result: ModelResult) -> dict[str, Any]:
    found: dict[str, Any] = result.solve["reduced"]
    return found


def prepared(text: str, name: str) -> PreparedReduced:
    scene = softmark.loads(text).scene
    declared = scene.declared[name]
    built = build(declared, case_of(scene, "beam"), BuildContext(scene=scene))
    assert isinstance(built, PreparedReduced)
    return built


# ------------------------------------------------------------------ error and cost


@pytest.mark.slow
def test_the_error_falls_as_modes_are_added() -> None:
    """Each further principal field of a smooth curve of states takes away more than a factor 2; measured: 20 or more.

    With as many fields as there are training states, those states are held exactly: what is left is what the tolerance
    1e-8 of both solutions leaves.
    """
    counts = (1, 2, 3, 4, 8)
    models = "".join(f"model p{n} = pod(of = full, training = {EIGHT}, modes = {n})\n" for n in counts)
    report = run(BEAM + models)
    errors = [error(report.models[f"p{n}"]) for n in counts]
    assert all(b < 0.5 * a for a, b in pairwise(errors[:4]))
    assert errors[-1] < 1e-6
    residuals = [said(report.models[f"p{n}"])["full_residual"] for n in counts]
    assert all(b < a for a, b in pairwise(residuals[:4]))
    assert report.models["p3"].size["dofs"] == said(report.models["p3"])["dimension"] == 3


def test_a_tolerance_takes_as_many_fields_as_it_needs() -> None:
    """What is left of each state is at most a few times the root mean square, and so is the error of the solution."""
    models = ("model rough = pod(of = full, tolerance = 2 %)\n", "model fine = pod(of = full, tolerance = 0.01 %)\n")
    report = run(BEAM + "".join(models))
    rough, fine = said(report.models["rough"]), said(report.models["fine"])
    assert rough["dimension"] < fine["dimension"] <= 4
    for found, tolerance in ((rough, 0.02), (fine, 1e-4)):
        assert found["captured_energy"] >= 1.0 - tolerance**2
        assert found["projection_error"] <= 4.0 * tolerance
    assert error(report.models["fine"]) < 1e-3


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("element", ["hex8, strain = finite", "tet4, strain = corotational", "tet10, strain = finite"])
def test_sampled_cells_cost_little_accuracy(element: str) -> None:
    """`sampling = 0.5 %` bounds how far the training states move; the scene is one of them. Twice for higher orders."""
    text = BEAM.replace("hex8, strain = corotational", element)
    text += "model few = pod(of = full, modes = 4, cells = sampled, sampling = 0.5 %)\n"
    report = run(text)
    few = report.models["few"]
    assert error(few) < 0.01 * math.sqrt(5.0)  # root mean square over four states and the stiffness
    assert 0 < said(few)["cells"] == few.size["elements"] < 0.5 * said(few)["of_cells"]
    assert said(few)["sampling_error"] <= 0.005


def test_the_norm_of_the_strain_energy_spans_the_training_states_too() -> None:
    """Four states, four fields: whatever the norm, the states are held exactly."""
    report = run(BEAM + "model stiff = pod(of = full, modes = 4, norm = energy)\n")
    assert error(report.models["stiff"]) < 1e-6


def test_small_strain_is_reduced_to_its_linear_response() -> None:
    """Every state is a multiple of one field, and no cell is evaluated; a linear solution is good to rounding."""
    text = BEAM.replace("strain = corotational", "strain = small")
    report = run(text + "model one = pod(of = full)\nmodel modes = modal(of = full, modes = 2)\n")
    for name in ("one", "modes"):
        assert error(report.models[name]) < 1e-9
        assert said(report.models[name])["cells"] == report.models[name].size["elements"] == 0
        assert said(report.models[name])["full_residual"] < 1e-9
    assert said(report.models["one"])["dimension"] == 1


def test_all_modes_are_the_full_model() -> None:
    """54 modes of 54 unknowns; both solved to 1e-10, and equal to 1e-8 of their displacement."""
    text = BEAM.replace("size = 10 mm", "size = 20 mm") + "analysis still = static(tolerance = 1e-10)\n"
    unknowns = run(text).models["full"].size["dofs"]
    report = run(text + f"model all = modal(of = full, modes = {unknowns}, derivatives = no)\n")
    assert said(report.models["all"])["dimension"] == unknowns
    assert error(report.models["all"]) < 1e-8
    assert said(report.models["all"])["full_residual"] < 1e-8


def test_modal_derivatives_let_a_beam_turn() -> None:
    """A tip drops by half of the length: without them the reduced beam locks and is refused; with them it is near."""
    bare = "model bare = modal(of = full, modes = 8, derivatives = no)\n"
    report = run(BEAM + bare + "model bent = modal(of = full, modes = 8)\n")
    assert report.models["bare"].status == "not_converged"
    assert said(report.models["bare"])["estimated_error"] > 0.2
    assert error(report.models["bent"]) < 0.02
    assert said(report.models["bent"])["dimension"] > said(report.models["bare"])["dimension"]


def test_frequencies_of_a_slender_beam_are_those_of_euler_and_bernoulli() -> None:
    """f_n = (b_n^2 / 2 pi) sqrt(E I / rho A L^4), b = 1.8751, 4.6941 (Blevins 1979, table 8-1), each twice.

    L / h = 20: shear and rotary inertia (Timoshenko) lower them by (b_n h / L)^2 (1 + E / (k G)) / 24 = 0.1 % and
    0.9 % for nu = 0 and k = 5/6; quadratic tetrahedra of the size of the section raise them by less than 1 %.
    """
    report = run("""
material bar    = linear_elastic(young = 1 MPa, poisson = 0, density = 1000 kg/m^3)
body     beam   = solid(box(size = (200, 10, 10) mm), bar)
support  wall   = fixed(beam, where = x <= 0 mm)
load     weight = gravity(1 mm/s^2, direction = -z)
model    full   = fem(tet10, strain = small, size = 10 mm)
model    modes  = modal(of = full, modes = 4)
probe    tip    = point(beam, at = (200, 5, 5) mm)
""")
    radius = 0.01 / math.sqrt(12.0)  # of gyration
    exact = [b**2 / (2 * math.pi) * math.sqrt(1e6 / 1000.0) * radius / 0.2**2 for b in (1.8751, 4.6941)]
    found = said(report.models["modes"])["frequencies_Hz"]
    np.testing.assert_allclose(found[:2], exact[0], rtol=0.01)
    np.testing.assert_allclose(found[2:], exact[1], rtol=0.015)


def test_loads_that_follow_and_supports_that_move() -> None:
    """The scene is a training state: four fields hold it, so only the solutions' own tolerances of 1e-8 are left."""
    text = BEAM + "load push = pressure(beam, magnitude = 100 Pa, where = z >= 20 mm)\n"
    text += "support end = displaced(beam, where = x >= 80 mm, by = (0, 0, -30) mm)\n"
    report = run(text + "model p = pod(of = full, modes = 4)\nmodel few = pod(of = full, modes = 4, cells = sampled)\n")
    assert error(report.models["p"]) < 1e-6
    assert error(report.models["few"]) < 0.02  # sampling = 1 %
    assert report.models["few"].metrics["drop"].value == pytest.approx(0.03, rel=1e-12)  # imposed, not solved for


# ------------------------------------------------------------------ training and beyond


SWEPT = (
    BEAM
    + """
study ways = sweep(weight.direction, over = [-z, +y])
study soft = sweep(gel.young, over = [50, 60] kPa, with = ways)
model p = pod(of = full, over = ways)
model q = pod(of = full, over = soft, training = [0.5, 1])
"""
)


def test_training_goes_through_a_sweep() -> None:
    report = run(SWEPT)
    p, q = said(report.models["p"]), said(report.models["q"])
    assert len(p["training"]) == 2 * 4
    assert len(q["training"]) == 2 * 2 * 2
    assert p["training"][0] == "25 % of the load, weight.direction = -z"
    assert q["ranges"] == {
        "load": [0.5, 1.0], "gel.young": [50e3, 60e3], "weight.direction": [[0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]
    }  # fmt: skip
    assert p["extrapolates"] == q["extrapolates"] == []
    assert p["training_s"] > 0
    assert not [w for w in report.warnings if w.code == "W331"]
    assert max(error(report.models[name]) for name in "pq") < 1e-3
    json.dumps(report.to_json(), allow_nan=False)


@pytest.mark.slow
@pytest.mark.long
def test_beyond_the_training_it_says_so_and_the_residual_shows_it() -> None:
    """A direction that no training state has; the error is then not small, and `full_residual` is of order one."""
    report = run(SWEPT, **{"weight.direction": "(0, -1, -0.2)"})
    assert said(report.models["p"])["extrapolates"] == ["weight.direction"]
    assert [w for w in report.warnings if w.code == "W331"]
    assert said(report.models["p"])["full_residual"] > 0.1
    assert error(report.models["p"]) > 0.01


def test_training_is_solved_once_and_charged_to_all_who_share_it() -> None:
    text = BEAM + "model a = pod(of = full)\nmodel b = pod(of = full, cells = sampled)\n"
    report = run(text)
    assert said(report.models["a"])["training_s"] == said(report.models["b"])["training_s"]
    for name in "ab":
        clock = report.models[name].time["setup_s"]
        assert clock is not None
        assert clock.seconds[0] >= said(report.models[name])["training_s"]


def test_loads_that_move_none_of_the_fields_are_told() -> None:
    """Trained sideways along +y and -y, loaded along z: by symmetry the space has no field that gives way."""
    text = BEAM + "study ways = sweep(weight.direction, over = [+y, -y])\nmodel p = pod(of = full, over = ways)\n"
    result = run(text).models["p"]
    assert result.status == "not_converged"
    assert "no work on any mode" in str(result.message)


@pytest.mark.long
@pytest.mark.slow
def test_a_training_without_equilibrium_is_told() -> None:
    """St. Venant and Kirchhoff's law buckles under this end load in each part of the training that is tried."""
    text = BEAM.replace("neo_hookean", "st_venant_kirchhoff").replace("strain = corotational", "strain = finite")
    text = text.replace("gravity(pull, direction = -z)", "gravity(pull, direction = -x)")
    report = run(text + "model p = pod(of = full, training = [1])\n", pull="20000 m/s^2")
    assert report.models["full"].status == "not_converged"
    assert report.models["p"].status == "not_converged"
    assert "no equilibrium in training" in str(report.models["p"].message)


# ------------------------------------------------------------------ what a prepared model is


def test_the_space_is_orthonormal_and_zero_on_supports() -> None:
    """V^T M V = I to rounding of a sum over some hundred nodes."""
    for line in ("model p = pod(of = full, modes = 4)\n", "model p = modal(of = full, modes = 6)\n"):
        built = prepared(BEAM + line, "p")
        assert built.equations is not None
        V, M = built.equations.basis.V, built.static.mass()
        np.testing.assert_allclose(V.T @ (M @ V), np.eye(V.shape[1]), atol=1e-12)
        assert not V[built.static.problem.fixed].any()


def test_the_energy_and_its_gradient_agree_in_the_sampled_model() -> None:
    """Central differences with h = 1e-7: rounding of 1e-4 J over h is 1e-13; h^2 of a steep third field."""
    built = prepared(BEAM + "model p = pod(of = full, modes = 3, cells = sampled)\n", "p")
    assert built.problem is not None
    assembly, q, h = built.problem.assembly, np.array([2e-3, 1e-4, 1e-5]), 1e-7
    slopes = [(assembly.value(q + e, 1.0) - assembly.value(q - e, 1.0)) / (2 * h) for e in h * np.eye(3)]
    g = assembly.gradient(q, 1.0)
    np.testing.assert_allclose(slopes, g, atol=1e-6 * float(np.abs(g).max()))


def test_it_has_the_mesh_of_the_full_model_for_other_programs() -> None:
    report = run(BEAM + "model p = pod(of = full, modes = 4)\n")
    full, few = report.models["full"].mesh, report.models["p"].mesh
    np.testing.assert_array_equal(few.cells, full.cells)
    assert few.kind == full.kind
    np.testing.assert_allclose(few.displacement, full.displacement, atol=1e-8)


# ------------------------------------------------------------------ motion


@pytest.mark.slow
def test_a_reduced_body_moves_as_the_full_one() -> None:
    """A load that grows over a period of the beam: the motion stays near states at rest, on which it was trained."""
    text = BEAM.replace("direction = -z)", "direction = -z, amplitude = smooth(over = 100 ms))")
    text = text.replace("relative_l2_error", "trajectory_error")
    text += "analysis fall = dynamic(duration = 0.15 s, step = 5 ms, integrator = newmark)\n"
    text += "model p = pod(of = full, modes = 4)\n"
    text += "model few = pod(of = full, modes = 4, cells = sampled, sampling = 0.2 %)\n"
    text += "model m = modal(of = full, modes = 8)\n"
    report = run(text)
    assert error(report.models["p"]) < 0.05
    assert error(report.models["few"]) < 0.06
    assert error(report.models["m"]) < 0.02  # vibration modes know motions that states at rest do not
    assert report.models["p"].time["step_s"] is not None


@pytest.mark.slow
def test_explicit_steps_take_the_unit_mass_of_the_space() -> None:
    """0.1 ms is below the critical step of the full mesh; both march the same equations."""
    text = BEAM.replace("relative_l2_error", "trajectory_error").replace("size = 10 mm", "size = 10 mm, mass = lumped")
    text += "analysis fall = dynamic(duration = 20 ms, step = 0.1 ms, integrator = central_differences)\n"
    report = run(text + "model m = modal(of = full, modes = 12)\n")
    assert error(report.models["m"]) < 0.02


def test_words_for_the_plan() -> None:
    scene = softmark.loads(SWEPT + "model m = modal(of = full, cells = sampled)\n").scene
    case = case_of(scene, "beam")
    assert scene.declared["q"].thing.outline(case) == (
        "`full` reduced to modes to 0.0001 of its solutions, trained at 50, 100 % of the load over soft"
    )
    assert scene.declared["m"].thing.outline(case) == (
        "`full` reduced to 20 vibration modes with their derivatives and its linear responses, cells sampled"
    )
    assert reduced_declaration.PARTS[-1] == 1.0
