"""The watchdog: wrong answers become failures, and nothing that is not a finite number gets into a report."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest

import softmark
from softmark.interpreter.models.shared.prepared_model import Solution
from softmark.interpreter.report.run import report_page
from softmark.interpreter.results import vtk_writer
from softmark.interpreter.results.run_report import Report
from softmark.interpreter.verification.error_estimate import is_doubt
from softmark.solvers.independent_forces import solid_forces as formulas
from softmark.solvers.independent_forces.mixed_formulation_forces import MixedBody, split_law

BEAM = """softmark 1
scene "watched"
material gel = neo_hookean(young = 60 kPa, poisson = 0.3, density = 1070 kg/m^3)
body beam = solid(cylinder(length = 100 mm, radius = 10 mm, axis = +x), gel)
support wall = fixed(beam, where = x <= 0 mm)
load weight = gravity(9.81 m/s^2, direction = -z)
reference theory = simo_reissner(beam)
probe axis = line(beam, from = (0, 0, 0) mm, to = (100, 0, 0) mm, points = 5)
metric eta = relative_l2_error(axis, against = theory)
metric mean = mean_error(axis, against = theory)
metric drop = displacement(axis, along = -z)
"""
MODELS = """model tet = fem(tet4, strain = corotational, size = 10 mm)
model hex = fem(hex8, strain = finite, integration = selective, size = 10 mm)
model ten = fem(tet10, strain = small, size = 15 mm)
model ser = fem(hex20, strain = corotational, size = 15 mm)
model lag = fem(hex27, strain = finite, mass = lumped, size = 15 mm)
model cell = fem(hex8, strain = corotational, rotation = element, size = 10 mm)
model single = fem(hex8, strain = finite, precision = single, size = 10 mm)
model springs = mass_spring(size = 10 mm, stiffness = from_material())
model rod = beam6dof(segments = 10)
model stiff = beam6dof(segments = 10, shear = no, axial = no)
model few = modal(tet, modes = 8)
"""
PRESSED = "".join(
    f"model {kind}_{strain} = fem({element}, strain = {strain}, size = 15 mm, formulation = {formulation})\n"
    for kind, element, formulation in (
        ("ten", "tet10", "mixed"), ("hex", "hex8", "mixed"), ("mean", "hex8", "mean_dilatation"),
        ("ser", "hex20", "mixed"), ("lag", "hex27", "mixed"),
    )
    for strain in ("small", "corotational", "finite")
)  # fmt: skip
MOTION = """analysis swing = dynamic(duration = 40 ms, step = 10 ms)
model tet = fem(tet4, strain = corotational, size = 20 mm)
"""


@pytest.mark.slow
@pytest.mark.long
def test_every_model_is_checked_again_by_other_formulas() -> None:
    """Loads by pressure and traction are in the test below; here is every kind of model."""
    report = softmark.loads(BEAM + MODELS).run()
    assert {m.status for m in report.models.values()} == {"converged"}
    for name, model in report.models.items():
        checks, claimed = model.solve["checks"], model.solve["residual"]
        if name == "few":  # of a reduced model, what is left of the full equations
            claimed = model.solve["reduced"]["full_residual"]
        if name != "stiff":  # what constraints carry is chosen to balance best
            # the same number from other formulas, but for what rounding leaves in both
            assert checks["residual"] == pytest.approx(claimed, rel=1e-2, abs=50 * checks["rounding"]), name
        assert checks["residual"] < max(1e-8, 2 * claimed), name
        assert checks.get("inverted", 0) == 0


@pytest.mark.long
@pytest.mark.slow
def test_loads_on_surfaces_and_imposed_motion_are_checked() -> None:
    report = softmark.loads("""
material gel = st_venant_kirchhoff(young = 10 kPa, poisson = 0.3, density = 1000 kg/m^3)
body b = solid(cylinder(length = 40 mm, radius = 10 mm, axis = +z), gel)
support low = fixed(b, where = z <= 0 mm)
support side = displaced(b, where = z >= 40 mm, by = (2, 0, 0) mm, components = x)
load push = pressure(b, where = z >= 40 mm, magnitude = 300 Pa)
load pull = traction(b, where = x >= 5 mm, vector = (0, 100, 0) Pa)
load prod = point_force(b, at = (0, 0, 30) mm, vector = (0, 1, 0) mN)
model ten = fem(tet10, strain = finite, size = 10 mm)
model hex = fem(hex8, strain = corotational, size = 8 mm)
model tet = fem(tet4, strain = small, size = 8 mm, mass = lumped)
model ser = fem(hex20, strain = finite, size = 10 mm)
model lag = fem(hex27, strain = corotational, size = 10 mm)
probe top = point(b, at = (0, 0, 40) mm)
""").run()
    for model in report.models.values():
        assert model.status == "converged", model.message
        assert model.solve["checks"]["residual"] < 1e-8


def with_pressures(poisson: str) -> str:
    """The beam and every solid with pressures that can take a Poisson's ratio."""
    lines = PRESSED.splitlines(keepends=True)
    known = (line for line in lines if poisson != "0.5" or "mean_dilatation" not in line)
    return BEAM.replace("poisson = 0.3", f"poisson = {poisson}") + "".join(known)


@pytest.mark.slow
@pytest.mark.parametrize("poisson", ["0.3", pytest.param("0.499999", marks=pytest.mark.slow), "0.5"])
def test_solids_with_pressures_are_checked_again(poisson: str) -> None:
    report = softmark.loads(with_pressures(poisson)).run()
    assert {m.status for m in report.models.values()} == {"converged"}
    assert "W353" not in {w.code for w in report.warnings}
    for name, model in report.models.items():
        checks = model.solve["checks"]
        # the same number from other formulas, but for what rounding leaves in both; much of it where K is 5e5 mu
        assert checks["residual"] == pytest.approx(model.solve["residual"], rel=1e-2, abs=50 * checks["rounding"]), name
        assert checks["rounding"] < 1e-7
        assert ("volume" in checks) == (poisson == "0.5")
        if name in ("hex_small", "hex_corotational") and poisson == "0.5":
            assert checks["volume"] < 1e-10  # in each cell; in tetrahedra only what linear pressures see
        if poisson == "0.5":  # with g = ln J the mean of J may change, in second order of its spread
            assert abs(checks["body_volume"]) < (1e-3 if "finite" in name else 1e-10), name


def wrong(solution: Solution) -> Solution:
    """A solution that is off by 1 %, and does not know it."""
    field, mesh = solution.displacement, solution.mesh
    assert field is not None
    moved = None if mesh is None else replace(mesh, displacement=1.01 * mesh.displacement)
    return replace(solution, displacement=lambda X: 1.01 * field(X), mesh=moved)


PRESSURES = re.findall(r"model (\w+)", PRESSED)


@pytest.mark.parametrize("name", ["tet", "hex", "ten", "cell", "single", "springs", "rod", *PRESSURES])
def test_an_answer_that_is_none_is_refused(name: str, tampered: Any) -> None:
    tampered(wrong)
    report = softmark.loads(BEAM + MODELS + PRESSED).run(name)
    model = report.models[name]
    assert model.status == "failed"
    assert "do not balance" in str(model.message)
    assert model.solve["checks"]["residual"] > 1e-4  # a per cent of the stresses
    assert model.metrics["eta"].value is None
    assert report.exit_status == 3


def wrong_pressures(solution: Solution) -> Solution:
    """The right displacements with pressures that are off by 1 %."""
    return replace(solution, mesh=replace(solution.mesh, pressures=1.01 * solution.mesh.pressures))


@pytest.mark.parametrize("poisson", ["0.3", "0.5"])
@pytest.mark.parametrize("name", ["ten_small", "hex_finite"])
def test_pressures_that_are_none_are_refused(name: str, poisson: str, tampered: Any) -> None:
    tampered(wrong_pressures)
    model = softmark.loads(with_pressures(poisson)).run(name).models[name]
    assert model.status == "failed"
    assert "do not balance" in str(model.message)


def test_what_volumes_lack_is_looked_at_where_nothing_else_is_wrong() -> None:
    """A cube that swells without a change of shape, and no pressure: only the second equation says no."""
    points, cells = formulas.node_positions("hex8") * 0.5, np.arange(8)[None]
    split = split_law(None, "small", 2.6, 0.3)
    assert split is not None
    body = MixedBody(points, cells, "hex8", 0.1 * points, split, 1.0, np.zeros((1, 1)))
    inside, lacking, noise = body.forces()
    assert np.abs(inside).max() < 1e-15
    assert lacking == pytest.approx(0.3)  # mu / edge times int tr eps
    assert body.largest_volume_changes() == pytest.approx((0.3, 0.3))
    loads, held = np.full((8, 3), 1.0), np.ones((8, 3), dtype=np.bool_)
    found = formulas.force_balance(inside, loads, held, noise, lacking=lacking)
    assert found.residual == pytest.approx(0.3 / np.sqrt(24.0))  # of the loads


def stops(*arguments: Any) -> Any:
    raise ZeroDivisionError("by accident")


def test_a_check_that_stops_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    """The answer stays, with a warning in the report and as a doubt of what it states."""
    monkeypatch.delenv("SOFTMARK_DEBUG", raising=False)
    monkeypatch.setattr("softmark.interpreter.verification.by_model.beam_verifier.BeamVerifier.balance", stops)
    report = softmark.loads(BEAM + MODELS).run("rod")
    model = report.models["rod"]
    assert model.status == "converged"
    assert model.solve["checks"] == {
        "residual": None,
        "reason": "the verification stopped with an error: ZeroDivisionError: by accident",
    }
    (said,) = (w for w in report.warnings if w.code == "W353")
    assert "`rod` could not be verified independently" in said.message
    assert is_doubt("W353")


# ------------------------------------------------------------------ not a number


def nan_displacement(s: Solution) -> Solution:
    return replace(s, displacement=lambda X: np.full(X.shape, math.nan))


def nan_at_one_point(s: Solution) -> Solution:
    own = s.displacement
    assert own is not None
    return replace(s, displacement=lambda X: np.where(X[:, :1] > 0.09, math.inf, own(X)))


def nan_off_the_probes(s: Solution) -> Solution:
    """Numbers on the axis, and none on the skin that is drawn."""
    own = s.displacement
    assert own is not None
    return replace(s, displacement=lambda X: np.where(np.abs(X[:, 1:2]) > 1e-3, math.nan, own(X)))


def nan_facts(s: Solution) -> Solution:
    return replace(s, facts=s.facts | {"residual": math.nan, "deep": {"a": [1.0, -math.inf, {"b": np.float64("nan")}]}})


def nan_mesh(s: Solution) -> Solution:
    u = np.array(s.mesh.displacement)
    u[3, 1] = math.nan
    return replace(s, mesh=replace(s.mesh, displacement=u))


def nan_energies(s: Solution) -> Solution:
    if s.history is None:
        return nan_mesh(s)
    return replace(s, history=replace(s.history, energies={"kinetic": np.array([0.0, math.nan])}))


def nan_history(s: Solution) -> Solution:
    if s.history is None:
        return nan_mesh(s)
    own = s.history.displacement
    return replace(s, history=replace(s.history, displacement=lambda X: own(X) * math.nan))


def nan_times(s: Solution) -> Solution:
    if s.history is None:
        return nan_mesh(s)
    return replace(s, history=replace(s.history, step_s=(math.inf,)))


DOORS = (
    nan_displacement, nan_at_one_point, nan_off_the_probes, nan_facts, nan_mesh, nan_energies, nan_history, nan_times,
)  # fmt: skip
WORDS = re.compile(r"\b(nan|infinity|-?inf)\b", re.IGNORECASE)


def written(report: Report, folder: Path) -> Iterator[str]:
    """Everything that is written of a report."""
    yield report.dumps()
    page = report_page.render(report)
    yield re.sub(r"<style.*?</style>|<script(?! type=\"application).*?</script>", "", page, flags=re.DOTALL)
    for file in vtk_writer.write_vtu(report, folder):
        if file.suffix == ".vtu":  # its numbers are coded
            read = meshio.read(file)
            assert all(np.all(np.isfinite(values)) for values in (read.points, *read.point_data.values()))
        else:
            yield file.read_text(encoding="utf-8")


def assert_numbers_only(report: Report, folder: Path) -> None:
    for text in written(report, folder):
        assert not WORDS.search(text)
    json.loads(report.dumps(), parse_constant=lambda word: pytest.fail(f"{word} in the report"))


@pytest.mark.parametrize("door", DOORS, ids=lambda d: d.__name__)
@pytest.mark.parametrize("motion", [False, True], ids=["rest", "motion"])
def test_no_door_lets_what_is_no_number_in(door: Any, motion: bool, tampered: Any, tmp_path: Path) -> None:
    tampered(door)
    text = BEAM.replace("reference theory = simo_reissner(beam)\n", "") if motion else BEAM
    text = re.sub(r"metric (eta|mean).*\n", "", text) + MOTION if motion else text + MODELS.splitlines()[0]
    report = softmark.loads(text).run()
    assert_numbers_only(report, tmp_path)
    model = report.models["tet"]
    if door not in (nan_facts, nan_off_the_probes):
        assert model.status == "failed"
        assert "finite" in str(model.message)


@pytest.mark.parametrize("estimate", [math.nan, 1e-9])
def test_references_and_metrics_have_doors_too(
    estimate: float, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    from softmark.references.simo_reissner import SimoReissner

    honest = SimoReissner.solve

    class Line:
        def __init__(self, own: Any) -> None:
            self.own, self.estimated_error = own, estimate

        def displacement(self, X: Any) -> Any:
            return self.own.displacement(X) * (1.0 if math.isnan(estimate) else math.nan)

    monkeypatch.setattr(SimoReissner, "solve", lambda self, beam: Line(honest(self, beam)))
    report = softmark.loads(BEAM + MODELS.splitlines()[0]).run()
    assert report.references["theory"].status == "failed"
    assert report.models["tet"].metrics["eta"].value is None
    assert_numbers_only(report, tmp_path)


def test_details_and_samples_of_metrics(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    from softmark.interpreter.metrics import metric_evaluation
    from softmark.interpreter.metrics.measurement import Measurement

    odd = Measurement(1.0, {"a": math.nan, "b": [math.inf]}, np.array([1.0, math.nan]), np.array([math.nan] * 5))
    monkeypatch.setattr(metric_evaluation, "measure_metric", lambda thing, seen: odd)
    report = softmark.loads(BEAM + MODELS.splitlines()[0]).run()
    assert report.models["tet"].metrics["eta"].details == {"a": None, "b": [None]}
    assert_numbers_only(report, tmp_path)


# ------------------------------------------------------------------ warnings


def test_a_tolerance_that_hides_differences_is_said_and_a_tight_one_not() -> None:
    models = "model ten = beam6dof(segments = 10)\nmodel forty = beam6dof(segments = 40)\n"
    loose = softmark.loads(BEAM + models + "analysis rest = static(tolerance = 1e-2)\n").run()
    tight = softmark.loads(BEAM + models).run()
    assert "W352" in {w.code for w in loose.warnings}
    assert "W352" not in {w.code for w in tight.warnings}
