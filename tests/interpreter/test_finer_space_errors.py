"""Errors that models state from a finer space over their own cells: they hold the true ones, shrink with the mesh, are
there for meshes from files, and cost about as much as a solution.

Truths: a finer mesh of ten-node tetrahedra, good to 0.5 %. tests/benchmarks/stated_errors.py has more.
"""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import softmark
from softmark.interpreter.cli.main import main
from softmark.interpreter.pipeline.run_pipeline import RunOptions, run_scene
from softmark.interpreter.verification import grid_convergence
from softmark.interpreter.verification.estimation_budget import Budget, BudgetExceeded
from softmark.interpreter.verification.probe_errors import NoErrorEstimate
from softmark.solvers.elements import ELEMENTS

BEAM = """
material gel  = neo_hookean(young = 60 kPa, poisson = {poisson}, density = 1000 kg/m^3)
body     b    = solid({body}, gel)
support  wall = fixed(b, where = x <= 0 mm)
load     down = gravity(1 m/s^2, direction = -z)
model    fine = fem(tet10, strain = finite, {fine})
{models}
probe    line = line(b, from = (0, 5, 5) mm, to = (40, 5, 5) mm, points = 9)
metric   eta  = relative_l2_error(line, against = fine)
metric   sag  = displacement(line, along = -z)
"""
BOX = "box(size = (40, 10, 10) mm)"


def asked(models: str, body: str = BOX, fine: str = "size = 1.67 mm", poisson: float = 0.3) -> Any:
    """The report of a short beam whose models are asked, without the one that is the truth."""
    scene = softmark.loads(BEAM.format(models=models, poisson=poisson, body=body, fine=fine))
    names = tuple(n for n in scene.models if n != "fine")
    return run_scene(scene.scene, list(scene.warnings), RunOptions(draw=False, stated=names))


def ratio(report: Any, name: str) -> float:
    """Stated over true, relative."""
    model = report.models[name]
    return float(model.stated["eta"].value / model.metrics["eta"].value)


SLOW = pytest.mark.slow
KINDS = [
    "tet4", pytest.param("tet10", marks=SLOW), "hex8", pytest.param("hex20", marks=SLOW),
    pytest.param("hex27", marks=SLOW), pytest.param("hex8, formulation = mean_dilatation", marks=SLOW),
]  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("element", KINDS)
def test_they_hold_the_true_ones_and_shrink_with_the_mesh(element: str) -> None:
    """4.9 -> 10.3 % was stated while the error halved; 35 % for a true 0.54 %."""
    report = asked("\n".join(f"model m{i} = fem({element}, strain = corotational, size = {h} mm)"
                             for i, h in enumerate((10, 5) if element == "hex27" else (5, 2.5))))  # fmt: skip
    assert all(1.0 <= ratio(report, name) <= 4.0 for name in ("m0", "m1"))
    coarse, fine = (report.models[n].stated["eta"].value for n in ("m0", "m1"))
    assert fine < 0.6 * coarse


@pytest.mark.slow
def test_what_means_of_the_volume_leave_out_is_no_error_of_a_strain() -> None:
    """A tip that sinks by a 60th of the length: 8.3 % was stated for corotational strain, of cells alone.

    Turning by 0.025 rad, the two measures differ in the order of the square of strains of 0.6 %: below 0.2 %.
    """
    report = asked("model m = fem(hex8, formulation = mean_dilatation, strain = corotational, size = 5 mm)")
    assert 0.0 < report.models["m"].stated["eta"].parts["model"] < 0.002


@pytest.mark.slow
def test_the_displacement_of_a_point_has_one_in_metres() -> None:
    report = asked("model m = fem(tet4, strain = corotational, size = 5 mm)")
    said, model = report.models["m"].stated["sag"], report.models["m"]
    assert said.unit == "m"
    off = abs(model.metrics["sag"].value - report.models["fine"].metrics["sag"].value)
    assert off <= said.value <= 4.0 * off


@pytest.mark.slow
@pytest.mark.parametrize(("element", "poisson"), [("hex8", 0.49), ("tet4", 0.499)])
def test_elements_that_lock_have_one_that_holds_or_none(element: str, poisson: float) -> None:
    """Of hexahedra at 0.49, 49 % off, 110 % would be stated: more than all that moves, which is none."""
    report = asked(f"model m = fem({element}, strain = corotational, size = 5 mm)", poisson=poisson)
    said = report.models["m"].stated["eta"]
    assert report.models["m"].metrics["eta"].value > 0.2
    assert "W301" in said.doubts
    if element == "hex8":
        assert said.value is None
        assert (
            "the mesh is too coarse for an error estimate: the solution on a finer space differs by 48.9 %"
            in said.reason
        )
    else:
        assert 1.0 <= ratio(report, "m") <= 3.0


@pytest.mark.slow
@pytest.mark.parametrize("kind", ELEMENTS)
def test_a_mesh_from_a_file_has_one(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import meshio

    from softmark.solvers.mesh.shapes import Box

    for name, element, size in (("own", kind, 5e-3), ("fine", "tet10", 2e-3)):
        mesh = Box((0.04, 0.01, 0.01)).mesh(element, size)
        word = ELEMENTS[element].meshio
        meshio.Mesh(mesh.points, [(word, mesh.cells)]).write(tmp_path / f"{name}.vtu")
    monkeypatch.chdir(tmp_path)
    files = (f'mesh("{tmp_path}/{name}.vtu", unit = 1 m)' for name in ("own", "fine"))
    own, fine = files
    report = asked(f"model m = fem({kind}, strain = corotational)", body=own, fine=f"mesh = {fine}")
    assert 1.0 <= ratio(report, "m") <= 4.0


@pytest.mark.slow
def test_a_cylinder_of_hexahedra_states_what_its_flat_facets_miss() -> None:
    """10 % of the volume is missing at two cells across: finer cells have their nodes on the cylinder."""
    scene = softmark.loads("""
material gel  = neo_hookean(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     b    = solid(cylinder(length = 40 mm, radius = 5 mm), gel)
support  wall = fixed(b, where = x <= 0 mm)
load     pull = traction(b, where = x >= 40 mm, vector = (0, 0, 20) Pa)
model    fine = fem(tet10, strain = corotational, size = 2 mm)
model    hex  = fem(hex8, strain = corotational, formulation = mean_dilatation, size = 4 mm)
probe    line = line(b, from = (0, 0, 0) mm, to = (40, 0, 0) mm, points = 9)
metric   eta  = relative_l2_error(line, against = fine)
""")
    report = run_scene(scene.scene, list(scene.warnings), RunOptions(draw=False, stated=("hex",)))
    assert 1.0 <= ratio(report, "hex") <= 6.0


def test_stated_errors_do_not_depend_on_how_busy_the_machine_is(monkeypatch: pytest.MonkeyPatch) -> None:
    """A processor a thousand times slower states the same errors: costs are counted, not timed."""
    models = "model hex = fem(hex8, strain = corotational, size = 5 mm)"
    first = asked(models, fine="size = 10 mm").models["hex"].stated
    clock = time.process_time
    monkeypatch.setattr(time, "process_time", lambda: 1000.0 * clock())
    again = asked(models, fine="size = 10 mm").models["hex"].stated
    assert first["sag"].value is not None, first["sag"].reason
    assert first == again


def test_what_costs_more_than_it_may_is_not_begun_or_stopped() -> None:
    budget = Budget.of({"nominal_cpu_s": {"setup": 0.0, "solve": 10.0}}, asked=True)
    budget.must_hold(1.9)
    with pytest.raises(BudgetExceeded, match="more than 2 times the time of the solution"):
        budget.must_hold(2.1)
    with pytest.raises(BudgetExceeded, match="more than 5 s"):
        Budget.of({"nominal_cpu_s": {"setup": 0.0, "solve": 0.1}}, asked=True).must_hold(51.0)
    budget.spent = 41.0
    with pytest.raises(NoErrorEstimate, match="takes more than"):
        budget.check()
    with pytest.raises(BudgetExceeded, match="not computed by default"):
        Budget.of({}, asked=False).must_hold(0.1)


def test_indices_of_three_grids_hold_the_error_of_power_laws() -> None:
    """u = 1 + h^p on h = 1, 2, 4: at least h^p, and near theory no more than 1.25 times it."""
    for p in (0.6, 1.0, 1.5, 2.0, 2.4, 3.0):
        near, far = 2**p - 1, 4**p - 2**p
        found = grid_convergence.convergence_index(near, 2.0, 2.0, far)
        assert found >= 1.0 - 1e-12
        if p == 2.0:
            assert found == pytest.approx(1.25)
    assert grid_convergence.convergence_index(0.1, 2.0, 2.0) == pytest.approx(
        0.1
    )  # Roache (1994): a factor of 3 on 0.1 / (2^2 - 1)
    assert grid_convergence.convergence_index(1e-9, 2.0, 2.0, 0.4) == pytest.approx(
        0.1
    )  # two grids that agree by chance: the third tells


def test_distances_to_finer_solutions_hold_the_error_of_power_laws() -> None:
    """u = 1 + h^p on h = 1/2, 1, 2 is off by 1 at h = 1: at least that, and at the order of theory 1.25 times it."""
    for p in (0.6, 1.0, 1.5, 2.0, 2.4, 3.0):
        near, far = 1.0 - 0.5**p, 2.0**p - 1.0
        found = grid_convergence.error_from_finer(near, 2.0, 2.0, far)
        assert found >= 1.0 - 1e-12
        if p <= 2.0:
            assert found == pytest.approx(1.25)
    assert grid_convergence.error_from_finer(0.75, 2.0, 2.0) == pytest.approx(1.5)  # as if of half the order
    assert grid_convergence.error_from_finer(1e-9, 2.0, 2.0, 3.0) == pytest.approx(1.25)  # they agree by chance


SCENE = "softmark 1\n" + BEAM.format(
    models="model rod = beam6dof(segments = 8)\nmodel hex = fem(hex8, strain = finite, size = 5 mm)",
    poisson=0.3, body=BOX, fine="size = 5 mm",
)  # fmt: skip


def test_a_plain_run_says_what_is_free_and_who_was_not_asked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "a.scene"
    file.write_text(SCENE, encoding="utf-8")
    assert main(["run", str(file), "--out", str(tmp_path / "plain")]) == 0
    shown = capsys.readouterr().out
    row = next(line for line in shown.splitlines() if line.startswith("rod"))
    assert row.count("±") == 2
    unasked = "no error estimate for `fine`, `hex`: an estimate of the mesh error costs about as much as the solution"
    assert unasked in shown
    report = json.loads((tmp_path / "plain" / "report.json").read_text("utf-8"))
    said = report["models"]["hex"]["stated"]["sag"]
    assert said["value"] is None
    assert "`--stated` does" in said["reason"]
    assert said["parts"]["model"] == 0.0
    assert 0.0 < said["parts"]["rounding"] < 1e-9
    assert said["parts"]["solver"] < 1e-6
    assert "±" in (tmp_path / "plain" / "report.html").read_text("utf-8")


def test_the_step_that_would_come_next_is_known_from_the_last_factor() -> None:
    """The same as of a tangent that is made anew, to the digits that Newton's last step left."""
    scene = softmark.loads(SCENE.replace("softmark 1\n", ""))
    report = run_scene(scene.scene, list(scene.warnings), RunOptions(only=("hex",), draw=False))
    left = report.models["hex"].mesh.left
    assert left.shape == report.models["hex"].mesh.displacement.shape
    assert np.abs(left).max() < 1e-6 * np.abs(report.models["hex"].mesh.displacement).max()


@pytest.mark.slow
def test_a_finer_space_is_solved_in_what_bends_too() -> None:
    """nu = 0.499: after one step, whose energy is that of volumes, 2.3 % was stated for a true 6.8 %."""
    model = "model m = fem(hex8, integration = selective, strain = corotational, size = 5 mm)"
    assert 1.0 <= ratio(asked(model, poisson=0.499), "m") <= 4.0


@SLOW
def test_a_finer_space_that_does_not_fit_is_not_made(monkeypatch: pytest.MonkeyPatch) -> None:
    """With 10 MB left: eight-fold hexahedra take 20 (3 * 8)^2 bytes each, and coarser meshes tell instead."""
    from softmark import resource_limits as memory
    from softmark.solvers.mesh import mesh_refinement

    def unasked(*_: Any) -> Any:
        raise AssertionError("it was made")

    monkeypatch.setattr(memory, "available_memory", lambda: 1e7)
    monkeypatch.setattr(mesh_refinement, "build_finer_space", unasked)
    model = asked("model m = fem(hex8, strain = finite, size = 2.5 mm)", fine="size = 5 mm").models["m"]
    assert model.stated["sag"].parts["discretisation"] > 0.0
    assert finer_needs(256) == pytest.approx(20.0 * 8 * 256 * 24**2)
    monkeypatch.setattr("softmark.interpreter.verification.by_model.solid_verifier.error_from_coarser", _nothing)
    model = asked("model m = fem(hex8, strain = finite, size = 2.5 mm)", fine="size = 5 mm").models["m"]
    assert (
        "a solution on the finer space would need about 0.024 GB of memory, and 0.01 GB are free"
        in model.stated["sag"].reason
    )


def finer_needs(cells: int) -> float:
    """Of a box of 16 x 4 x 4 hexahedra."""
    from softmark.solvers.mesh.mesh_refinement import estimate_memory
    from softmark.solvers.mesh.shapes import Box

    mesh = Box((0.04, 0.01, 0.01)).mesh("hex8", 0.0025)
    assert len(mesh.cells) == cells
    return estimate_memory(mesh)


def _nothing(*_: Any) -> float:
    raise NoErrorEstimate("coarser meshes tell nothing")


FLAT = """
material gel  = neo_hookean(young = 60 kPa, poisson = 0.499, density = 1000 kg/m^3)
body     b    = plane_strain(quadrilateral((0, 0, 0) mm, {corners} mm, (0, 10, 0) mm), gel, thickness = 3 mm)
support  wall = fixed(b, where = {held})
load     push = {load}
model    m    = fem({model}, strain = small, size = 2 mm)
model    fine = fem(quad9, strain = small, formulation = mixed, size = 1 mm)
probe    line = line(b, from = {begin} mm, to = {end} mm, points = 9)
metric   eta  = relative_l2_error(line, against = fine)
"""


@pytest.mark.slow
def test_plane_cells_that_keep_their_volume_have_one() -> None:
    """Half of a block under a punch: iterations on the finer space led nowhere, and from coarser meshes 1.2 % was
    stated for 1.5. Truth: quadratic cells with pressures of half the size, 0.3 % off."""
    scene = softmark.loads(FLAT.format(
        corners="(20, 0, 0) mm, (20, 10, 0)", held="y <= 0 mm", begin="(0, 10, 0)", end="(20, 10, 0)", model="tri6",
        load="traction(b, where = y >= 10 mm and x <= 10 mm, vector = (0, -100, 0) Pa)"))  # fmt: skip
    report = run_scene(scene.scene, list(scene.warnings), RunOptions(draw=False, stated=("m",)))
    assert 1.0 <= ratio(report, "m") <= 4.0


@pytest.mark.long
@pytest.mark.slow
def test_iterations_on_a_finer_space_end_when_its_displacements_do(monkeypatch: pytest.MonkeyPatch) -> None:
    """A beam whose error is one of bending, and whose energy one of volumes: 4 times the way to go were left when the
    energy grew no more. What is stated is that of a factor to a fifth."""
    from softmark.solvers.statics import finer_space_solve

    scene = softmark.loads(FLAT.format(
        corners="(40, 0, 0) mm, (40, 10, 0)", held="x <= 0 mm", begin="(0, 5, 0)", end="(40, 5, 0)",
        model="quad4, formulation = mean_dilatation", load="gravity(0.3 m/s^2, direction = -y)"))  # fmt: skip
    said = []
    for most in (finer_space_solve.SMALL, 100):
        monkeypatch.setattr(finer_space_solve, "SMALL", most)
        report = run_scene(scene.scene, list(scene.warnings), RunOptions(draw=False, stated=("m",)))
        said.append(report.models["m"].stated["eta"].parts["discretisation"])
    assert said[1] == pytest.approx(said[0], rel=0.2)


def test_two_meshes_that_agree_at_one_point_by_chance_do_not_say_that_it_is_right() -> None:
    """The middle of a face that is pressed, on cells of half of the block: 0.165 % was stated of 0.67 %.

    There, and there alone, the finer space crosses the coarse one. The truth: quadratic cells of a quarter, good to
    0.1 % at this point. What is stated of the line is not touched by it.
    """
    scene = softmark.loads("""
material gel  = neo_hookean(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     b    = solid(box(size = (20, 20, 20) mm), gel)
support  wall = fixed(b, where = x <= 0 mm)
load     push = pressure(b, where = x >= 20 mm, magnitude = 3 kPa)
model    fine = fem(hex20, strain = finite, size = 5 mm)
model    own  = fem(hex8, formulation = mean_dilatation, strain = finite, size = 10 mm)
probe    tip  = point(b, at = (20, 10, 10) mm)
probe    root = point(b, at = (0, 10, 10) mm)
metric   off  = tip_error(tip, against = fine)
metric   way  = displacement(tip, along = -x)
metric   eta  = relative_l2_error(tip, against = fine)
metric   held = displacement(root, along = -x)
metric   side = displacement(tip, along = +y)
""")
    own = run_scene(scene.scene, list(scene.warnings), RunOptions(draw=False, stated=("own",))).models["own"]
    true, tip = own.metrics["off"].value, own.metrics["way"].value
    assert true is not None
    assert tip is not None
    assert true > 3e-3 * tip
    for name in ("off", "way"):
        assert true <= own.stated[name].value < 10.0 * true
    assert own.metrics["eta"].value <= own.stated["eta"].value
    assert own.stated["held"].parts["discretisation"] == 0.0  # what a support holds, or symmetry, is so in both
    assert own.stated["side"].value < 1e-6 * tip
