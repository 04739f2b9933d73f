"""Closed forms that are written in a scene as what judges its walks; and defects that walks over laws have shown."""

from __future__ import annotations

from pathlib import Path

import pytest

from softmark.interpreter.api import python_api
from softmark.interpreter.pipeline.run_options import CheckedScene, RunOptions
from softmark.interpreter.pipeline.run_pipeline import run_to_report
from softmark.interpreter.planning.robustness_plan import find_judging_metrics, resolve_study

FORM = (Path(__file__).parents[1] / "errors" / "stress-closed-form.scene").read_text(encoding="utf-8")
SOUND = FORM.replace(", gel.poisson", "")

RING = """
material gel   = linear_elastic(young = 10 kPa, poisson = 0.3, density = 1000 kg/m^3)
shape    slice = quadrilateral((10, 0, 0) mm, (15, 0, 0) mm, (15, 5, 0) mm, (10, 5, 0) mm)
body     ring  = axisymmetric(slice, gel)
support  low   = symmetric(ring, where = y <= 0 mm)
support  in_   = displaced(ring, where = x <= 10 mm, by = ({}, 0, 0) mm, components = x)
support  out   = displaced(ring, where = x >= 15 mm, by = ({}, 0, 0) mm, components = x)
model    quads = fem(quad4, strain = small, size = 2.5 mm)
metric   work  = strain_energy(ring)
"""

PRESSED = """
material heart = {}
body     block = solid(box(size = (10, 10, 10) mm), heart)
support  left  = fixed(block, where = x <= 0 mm, components = x)
support  sides = fixed(block, where = y <= 0 mm or y >= 10 mm, components = y)
support  ends  = fixed(block, where = z <= 0 mm or z >= 10 mm, components = z)
support  press = displaced(block, where = x >= 10 mm, by = (-{}, 0, 0) mm, components = x)
model    cubes = fem(hex8, strain = finite, size = 5 mm)
metric   push  = force(press, along = -x)
"""
GUCCIONE = "guccione(stiffness = 2 kPa, bf = 30, bt = 2, bfs = 4, density = 1000 kg/m^3, fibres = {}, bulk = 20 kPa)"


def test_a_closed_form_of_parameters_judges() -> None:
    scene = python_api.loads(SOUND).scene
    assert list(find_judging_metrics(scene)) == ["off"]
    asked = resolve_study(scene, scene.declared["edges"])
    assert [q.name for q in asked.quantities] == ["mu", "cubes.size"]


def test_without_a_study_what_a_closed_form_does_not_follow_is_left_out() -> None:
    """Parameters with a range and fields of models stay; Poisson's ratio of the material, and its density, do not."""
    text = "\n".join(line for line in SOUND.splitlines() if not line.startswith("study"))
    scene = python_api.loads(text.replace("mu = 20 kPa", "mu = 20 kPa in 1 kPa .. 1 MPa")).scene
    assert [q.name for q in resolve_study(scene, None).quantities] == ["mu", "cubes.size", "cubes.precision"]


@pytest.mark.parametrize(
    ("old", "new"),
    [("3 * mu * (10 mm)^2 * 0.1", "0.6 N"), ("kind = theory", "kind = measurement"),
     ("against = form)", "against = form, relative_to = uncertainty)")],
)  # fmt: skip
def test_numbers_and_measurements_do_not_judge_other_bodies(old: str, new: str) -> None:
    with pytest.raises(python_api.SceneError) as refused:
        python_api.loads(SOUND.replace(old, new))
    assert [d.code for d in refused.value.diagnostics] == ["E513"]


def test_values_of_bodies_of_revolution_are_known() -> None:
    """What an error of a value is of is looked at by itself: it was refused whatever it was of."""
    more = """
probe     bore = point(ring, at = (10, 2, 0) mm)
metric    wide = displacement(bore, along = +x)
reference form = values(values = 1 mm, uncertainty = 1e-9, source = "what is imposed", kind = theory)
metric    off  = value_error(of = wide, against = form)
"""
    report = python_api.loads(RING.format(1, 1) + more).run()
    assert report.models["quads"].metrics["off"].value == pytest.approx(0.0, abs=1e-12)


def test_rings_that_were_drawn_through_their_axis_are_said() -> None:
    """Both across the axis and turned over within the plane det F > 0: that looked like a solid."""
    through, sound = (python_api.loads(RING.format(*by)).run() for by in ((-12, -22), (-1, -2)))
    assert "W351" in {w.code for w in through.warnings}
    assert "W351" not in {w.code for w in sound.warnings}


@pytest.mark.slow
def test_creep_of_finite_strain_states_the_error_of_its_steps() -> None:
    """Against its theory, 1e-5 off with 20 steps: the part of time had stopped with an error for any displacement."""
    scene = python_api.load("rates-at-the-extremes")
    report = run_to_report(
        CheckedScene(scene.scene, scene.warnings), RunOptions(only=("creeps",), stated=("creeps",), draw=False)
    )
    model = report.models["creeps"]
    said, off = model.stated["eta"], model.metrics["eta"].value
    assert said.value is not None
    assert said.parts["time"] is not None
    assert off is not None
    assert off < said.value < 10.0 * off


@pytest.mark.parametrize(
    ("material", "lost"),
    [(GUCCIONE.format("+x"), True),
     pytest.param(GUCCIONE.format("(1, x / 1 m, 0)"), True, marks=pytest.mark.slow),
     (GUCCIONE.format("+y"), False),
     ("transversely_isotropic(shear = 2 kPa, k1 = 60 kPa, k2 = 1, density = 1000 kg/m^3, fibres = +x, bulk = 20 kPa)",
      False)],
)  # fmt: skip
def test_fibres_that_give_way_in_compression_are_said(material: str, lost: bool) -> None:
    """By 35 %: along its fibres Guccione's law loses waves; across them it does not, nor where fibres are slack."""
    report = python_api.loads(PRESSED.format(material, 3.5)).run()
    assert ("W366" in {w.code for w in report.warnings}) == lost


@pytest.mark.slow
@pytest.mark.parametrize("study", ["muscle_edges", "chains_edges", "fibre"])
def test_nothing_is_silent_at_the_extremes_of_laws(study: str) -> None:
    """Over twelve decades of tension, of fibres, and to Gent's limit: what is not right says so."""
    found = python_api.stress("laws-at-the-extremes", study=study)
    words = [point.found.word for one in found.studies for point in one.points]
    assert "silent" not in words
    assert words.count("right") > 0.7 * len(words)
