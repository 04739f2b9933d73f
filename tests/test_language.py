"""The scenes that the language was designed around run as they were drawn, but for what turned out to need saying.

The first, the paper's experiment:
  - `expect rod.eta < 5 %` is not met: a beam that may shear and stretch is 5.9 % away from a theory in which it may
    not, on any mesh. The expectation stays as drawn and fails; without shear and stretch it is met.
  - `calibrated` had to say to what and at which load: `calibrated(eta, load = 50 %)`. What a network is fitted to is
    not what it is judged by.
  - `surface("silicone-beam.ply")` had to give the unit of the file, and how uncertain the scan is.
  - `surface_distance(beam, ...)` takes a probe, as every metric does: `skin = surface(beam)` says which points.

The second, about time:
  - a vector times a ramp is no vector: how a load grows is its field `amplitude`, which a static analysis does without.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

import softmark

SCENE = """
scene "Silicone beam sagging under its own weight"

param L = 178 mm
param R = 19 mm
param h = 8 mm            # target edge length of the meshes

material silicone = linear_elastic(young = 60 kPa, poisson = 0.49, density = 1070 kg/m^3)
body     beam     = solid(cylinder(length = L, radius = R, axis = +x), silicone)
support  wall     = fixed(beam, where = x <= 0 mm)
load     weight   = gravity(9.81 m/s^2, direction = -z)
analysis sag      = static()

model linear_tet  = fem(tet4, strain = small,        size = h)
model corot_tet   = fem(tet4, strain = corotational, size = h)
model corot_hex   = fem(hex8, strain = corotational, size = h)
model rod         = beam6dof(segments = 20)
model springs     = mass_spring(size = h, stiffness = calibrated(eta, load = 50 %))

reference theory  = elastica(beam)               # large-deflection Bernoulli-Euler, from the scene itself
reference scan    = surface("silicone-beam.ply", unit = 1 m, uncertainty = 0.5 mm) # what the CT scanner saw

probe  axis       = line(beam, from = (0, 0, 0) mm, to = (L, 0 mm, 0 mm), points = 41)
probe  skin       = surface(beam)
metric eta        = relative_l2_error(axis, against = theory)
metric gap        = surface_distance(skin, against = scan)
metric frame      = realtime_factor(rate = 25 Hz)

expect rod.eta < 5 %
expect linear_tet.eta > 40 %     # small strain cannot follow a large rotation
"""
MODELS = ("linear_tet", "corot_tet", "corot_hex", "rod", "springs")


def without_scan(text: str) -> str:
    """The scene without what needs a file."""
    return "".join(f"{line}\n" for line in text.splitlines() if "scan" not in line)


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The scene beside a scan: the surface of a rod of 81.3 kPa, the modulus that the CT scan tells."""
    folder = tmp_path_factory.mktemp("drawn")
    made = softmark.loads(without_scan(SCENE), **{"silicone.young": "81.3 kPa"}).run(models=["rod"]).models["rod"]
    assert made.shape is not None
    mesh = trimesh.Trimesh(made.shape.position, made.shape.triangles, process=False)
    mesh.export(folder / "silicone-beam.ply")
    (folder / "beam.scene").write_text(SCENE, encoding="utf-8")
    return folder / "beam.scene"


@pytest.fixture(scope="module")
def report(file: Path) -> softmark.Report:
    """As drawn: five models on meshes of 8 mm."""
    return softmark.load(file).run()


def value(report: softmark.Report, model: str, metric: str) -> float:
    found = report.models[model].metrics[metric].value
    assert found is not None
    return found


@pytest.mark.slow
def test_the_scene_runs_as_drawn(report: softmark.Report) -> None:
    assert {n: m.status for n, m in report.models.items()} == dict.fromkeys(MODELS, "converged")
    assert {n: r.status for n, r in report.references.items()} == {"theory": "converged", "scan": "converged"}
    met = {e.text: e.passed for e in report.expectations}
    assert met == {"rod.eta < 5 %": False, "linear_tet.eta > 40 %": True}
    # Simo-Reissner against elastica: 0.0591 of the elastica's norm
    assert value(report, "rod", "eta") == pytest.approx(0.059, abs=0.001)


def test_on_a_coarse_mesh_all_is_there() -> None:
    """The scene without the file, for every change; as drawn, on meshes of 8 mm, it is slow."""
    report = softmark.loads(without_scan(SCENE), h="16 mm").run()
    assert {n: m.status for n, m in report.models.items()} == dict.fromkeys(MODELS, "converged")
    assert {e.text: e.passed for e in report.expectations}["rod.eta < 5 %"] is False
    assert all(set(m.metrics) == {"eta", "frame"} for m in report.models.values())


@pytest.mark.slow
def test_every_model_has_every_metric(report: softmark.Report) -> None:
    for model in report.models.values():
        assert set(model.metrics) == {"eta", "gap", "frame"}
        assert all(m.value is not None for m in model.metrics.values())
        assert isinstance(model.metrics["frame"].details["verdict"], bool)
    assert value(report, "springs", "eta") < value(report, "linear_tet", "eta")
    # fitted at half the load; under all of it springs along tetrahedra, which are the default, fold: the report says so
    assert value(report, "springs", "eta") < 0.2
    assert "W324" in {w.code for w in report.warnings}


def test_the_gap_is_that_of_the_two_moduli(file: Path) -> None:
    """60 against 81.3 kPa: the rod is 6.1 mm from the CT scan with one and 0.5 mm with the other (REFERENCES, 1.4)."""
    report = softmark.load(file).run(models=["rod"])
    assert value(report, "rod", "gap") == pytest.approx(6.1e-3, abs=0.7e-3)
    assert report.models["rod"].metrics["gap"].uncertainty == pytest.approx(0.5e-3)


def test_a_scan_of_the_model_itself_is_no_distance_away(file: Path) -> None:
    again = softmark.load(file, **{"silicone.young": "81.3 kPa"}).run(models=["rod"])
    metric = again.models["rod"].metrics["gap"]
    assert metric.value is not None
    assert metric.value < 1e-6  # coordinates of the file have 24 bits
    assert not metric.meaningful


def test_the_beam_without_shear_and_stretch_is_the_elastica() -> None:
    text = without_scan(SCENE).replace("segments = 20", "segments = 20, shear = no, axial = no")
    report = softmark.loads(text).run(models=["rod"])
    assert value(report, "rod", "eta") < 0.002  # second order: 1 / 20^2 = 0.0025


def test_overrides_of_the_scene() -> None:
    changes = {"silicone.young": "30kPa", "weight.magnitude": "1.62 m/s^2"}
    scene = softmark.loads(without_scan(SCENE), L="120mm", **changes)
    assert scene.run(models=["rod"]).models["rod"].status == "converged"


def test_ranges_make_a_wrong_override_an_error() -> None:
    text = without_scan(SCENE).replace("param R = 19 mm", "param R = 19 mm\nparam nu = 0.49 in 0 .. 0.49999")
    text = text.replace("poisson = 0.49", "poisson = nu")
    assert softmark.loads(text, nu="0.3").scene.parameters["nu"].overridden
    with pytest.raises(softmark.SceneError, match=r"E214"):
        softmark.loads(text, nu="0.5")


# ------------------------------------------------------------------ time

TIME = """
param L = 178 mm

material silicone = linear_elastic(young = 60 kPa, poisson = 0.49, density = 1070 kg/m^3)
body     beam     = solid(cylinder(length = L, radius = 19 mm, axis = +x), silicone)
support  wall     = fixed(beam, where = x <= 0 mm)
model    tets     = fem(tet4, strain = corotational, size = 12 mm)

analysis drop = dynamic(duration = 1 s, step = 1 ms, integrator = newmark)
load push     = traction(beam, where = x >= L, vector = (0, 0, -200) Pa, amplitude = ramp(over = 0.5 s))
probe  tip    = point(beam, at = (L, 0 mm, 0 mm))   # a history in a dynamic analysis
"""


@pytest.mark.long
@pytest.mark.slow
def test_the_second_scene_runs_as_drawn() -> None:
    report = softmark.loads(TIME).run()
    tets = report.models["tets"]
    assert tets.status == "converged"
    tip = tets.probes["tip"]
    assert tip.times is not None
    assert tip.course is not None
    assert tip.course.shape == (1001, 1, 3)
    np.testing.assert_allclose(tip.times, np.linspace(0, 1, 1001), atol=1e-12)
    drop = -tip.course[:, 0, 2]
    assert drop[0] == 0
    assert drop[100] < drop[300] < drop[500]  # it follows the ramp
    # undamped, it then swings about the state of rest under all of the load
    rest = softmark.loads(TIME.replace(TIME[TIME.index("analysis") : TIME.index("load")], "")).run().models["tets"]
    assert drop[500:].mean() == pytest.approx(-rest.probes["tip"].displacement[0, 2], rel=0.1)


def test_as_it_was_drawn_a_ramp_is_a_value_of_its_own() -> None:
    drawn = TIME.replace(" Pa, amplitude = ramp(over = 0.5 s))", " Pa * ramp(over = 0.5 s))")
    with pytest.raises(softmark.SceneError) as refused:
        softmark.loads(drawn)
    assert "amplitude" in str(refused.value)  # the message says where it goes
