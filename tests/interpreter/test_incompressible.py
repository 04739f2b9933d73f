"""Scenes of solids that hardly or never change their volume: mixed elements and the mean dilatation."""

from __future__ import annotations

import pytest

import softmark
from softmark.interpreter.pipeline.run_pipeline import RunOptions, run_scene
from softmark.interpreter.results.run_report import ModelResult

SCENE = """
param    nu     = 0.49
material gel    = neo_hookean(young = 60 kPa, poisson = nu, density = 1000 kg/m^3)
body     beam   = solid(box(size = (100, 20, 20) mm), gel)
support  wall   = fixed(beam, where = x <= 0 mm)
load     weight = gravity(9.81 m/s^2, direction = -z)
probe    tip    = point(beam, at = (100, 10, 10) mm)
metric   drop   = displacement(tip, along = -z)
"""


def solved(text: str, *overrides: str) -> softmark.Report:
    """The report of the scene with more in it."""
    return softmark.loads(SCENE + text, **dict(o.split("=") for o in overrides)).run()


def drop(model: ModelResult) -> float:
    """How far the tip sinks, m."""
    assert model.status == "converged", model.message
    value = model.metrics["drop"].value
    assert value is not None
    return float(value)


FORMS = """
model tets    = fem(tet10, strain = finite, formulation = mixed, size = 10 mm)
model turned  = fem(tet10, strain = corotational, formulation = mixed, size = 10 mm)
model bricks  = fem(hex8, strain = finite, formulation = mixed, size = 10 mm)
"""
MEANS = """
model means   = fem(hex8, strain = finite, formulation = mean_dilatation, size = 10 mm)
model centres = fem(hex8, strain = finite, integration = selective, size = 10 mm)
model single  = fem(hex8, strain = finite, formulation = mean_dilatation, size = 10 mm, precision = single)
"""


@pytest.mark.slow
def test_forms_agree_and_say_nothing_of_locking() -> None:
    """Mixed hexahedra are those of the mean dilatation; others within 5 %, their errors of discretisation here."""
    report = solved(FORMS + MEANS)
    drops = {name: drop(model) for name, model in report.models.items()}
    assert drops["bricks"] == pytest.approx(drops["means"], rel=1e-7)
    assert drops["single"] == pytest.approx(drops["means"], rel=1e-4)
    assert all(value == pytest.approx(drops["tets"], rel=0.05) for value in drops.values())
    assert not any(d.code == "W301" for d in report.warnings)
    assert all(m.solve["iterations"] < 15 for m in report.models.values())


@pytest.mark.slow
@pytest.mark.parametrize("nu", ["0.4999", "0.499999999", "0.5"])
def test_the_limit_in_a_scene(nu: str) -> None:
    """From 0.4999 to 0.5 the drop moves by less than 1e-3, as 1/K does; every state is stable and refined."""
    near, limit = solved(FORMS, f"nu={nu}"), solved(FORMS, "nu=0.5")
    for name, model in near.models.items():
        assert drop(model) == pytest.approx(drop(limit.models[name]), rel=1e-3)
        assert model.solve["stable"] is True
        assert "refined for pressures" in model.solve["linear_solver"]


def test_beams_take_no_compressibility_as_it_is() -> None:
    """A rod has no volume to keep: at 0.5 its drop is that at 0.4999, to the shear modulus' part."""
    rod = "model rod = beam6dof(segments = 20)\n"
    assert drop(solved(rod, "nu=0.5").models["rod"]) == pytest.approx(
        drop(solved(rod, "nu=0.4999").models["rod"]), rel=1e-4
    )


def test_a_start_from_another_model_and_a_cap() -> None:
    """A mixed model starts from a coarse one of displacements, which has no pressures; a cap stops it as any other."""
    text = """
model coarse = fem(hex8, strain = finite, integration = selective, size = 10 mm)
model begun  = fem(tet10, strain = finite, formulation = mixed, size = 10 mm, initial_guess = coarse)
model plain  = fem(tet10, strain = finite, formulation = mixed, size = 10 mm)
model capped = fem(tet10, strain = finite, formulation = mixed, size = 10 mm, max_iterations = 2)
"""
    report = solved(text)
    assert drop(report.models["begun"]) == pytest.approx(drop(report.models["plain"]), rel=1e-7)
    assert report.models["capped"].status == "capped"


@pytest.mark.slow
@pytest.mark.long
def test_the_mean_dilatation_moves_and_can_be_reduced() -> None:
    """It is an energy of displacements: dynamics and reduced models take it; its modes sag as it does, to 2 %."""
    text = "model means = fem(hex8, strain = corotational, formulation = mean_dilatation, size = 10 mm)\n"
    moved = solved(text + "analysis fall = dynamic(duration = 20 ms, step = 10 ms)\n")
    assert moved.models["means"].status == "converged"
    report = solved(text + "model modes = modal(of = means, modes = 12, cells = all)\n")
    assert drop(report.models["modes"]) == pytest.approx(drop(report.models["means"]), rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("strain", ["small", "corotational"])
def test_what_their_strain_leaves_out_is_stated(strain: str) -> None:
    # The same cells in finite strain are solved from the state of the model: with pressures among the unknowns, whose
    # pivots are negative in every stable state.
    text = SCENE.replace("(100, 20, 20)", "(40, 20, 20)").replace("(100, 10, 10)", "(40, 10, 10)")
    text += f"model tets = fem(tet10, strain = {strain}, formulation = mixed, size = 20 mm)\n"
    scene = softmark.loads(text)
    model = run_scene(scene.scene, list(scene.warnings), RunOptions(draw=False, stated=("tets",))).models["tets"]
    part = model.stated["drop"].parts["model"]
    finite = softmark.loads(text.replace(f"strain = {strain}", "strain = finite")).run().models["tets"]
    apart = abs(drop(model) - drop(finite))
    assert part is not None
    assert apart <= part < 4.0 * apart
