"""Bodies that other programs move, and NGSolve's hierarchical shape functions."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import softmark
from softmark.interpreter.models.external.adapters import newton_vbd, newton_xpbd, ngsolve
from softmark.interpreter.models.external.external_problem import ExternalMaterial, Motion, Problem
from softmark.interpreter.pipeline import run_pipeline

# a bar that falls by a fifth of its length in a tenth of a second: cells of 15 mm, which rotate by up to 20 degrees
FALL = """softmark 1
scene "moved by others"
material silicone = {law}(young = 60 kPa, poisson = 0.3, density = 1070 kg/m^3)
body beam = solid(box(size = (120, 30, 30) mm), silicone)
support wall = fixed(beam, where = x <= 0 mm)
support guide = fixed(beam, where = y <= 0 mm, components = y)
load weight = gravity(9.81 m/s^2, direction = -z)
load pull = traction(beam, where = x >= 120 mm, vector = (300, 0, 0) Pa)
analysis fall = dynamic(duration = 60 ms, step = 1 ms, integrator = {integrator}, damping_mass = 5 Hz,
    damping_stiffness = {b})
probe tip = point(beam, at = (120, 15, 15) mm)
metric drop = displacement(tip, along = -z)
metric strayed = trajectory_error(tip, against = ours)
metric frame = realtime_factor(rate = 1000 Hz)
model ours = fem(tet4, strain = finite, size = 15 mm, mass = lumped)
"""


def run(text: str) -> Any:
    loaded = softmark.loads(text)
    return run_pipeline.run_scene(loaded.scene, list(loaded.warnings), run_pipeline.RunOptions(draw=False))


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize(
    ("integrator", "step", "most"), [("implicit_euler", "1 ms", 0.01), ("central_differences", "0.1 ms", 0.01)]
)
def test_mujoco_moves_the_same_tetrahedra(integrator: str, step: str, most: float) -> None:
    """Its law is ours and so are its masses: two ways through time are apart by their order in the step alone.

    1 %: implicit Euler of ours is solved in each step and its own is linear there, of 60 steps; explicit steps are of
    the same scheme but for where the first velocity stands, half a step of 600.
    """
    pytest.importorskip("mujoco")
    b = "0.5 ms" if integrator == "implicit_euler" else "0 ms"
    text = FALL.format(law="st_venant_kirchhoff", integrator=integrator, b=b).replace("step = 1 ms", f"step = {step}")
    report = run(text + "model theirs = external_solver(mujoco, tet4, strain = finite, size = 15 mm)\n")
    ours, theirs = (report.models[n] for n in ("ours", "theirs"))
    assert (ours.status, theirs.status) == ("converged", "converged"), theirs.message
    assert ours.metrics["drop"].value > 0.015
    assert theirs.metrics["strayed"].value < most
    assert theirs.metrics["frame"].value > 0.0
    assert theirs.solve["means"].startswith("St Venant-Kirchhoff law")
    assert np.abs(theirs.mesh.displacement[theirs.mesh.points[:, 1] < 1e-9, 1]).max() == 0.0  # the guide


@pytest.mark.long
@pytest.mark.slow
def test_mujoco_with_its_own_step_and_a_step_too_long_for_it() -> None:
    """Explicit steps of 4 ms are forty times too long: its own warning ends as `diverged`."""
    pytest.importorskip("mujoco")
    text = FALL.format(law="neo_hookean", integrator="central_differences", b="0 ms").replace(
        "step = 1 ms", "step = 0.1 ms"
    )
    report = run(
        text
        + "model fine = external_solver(mujoco, tet4, strain = finite, size = 15 mm, step = 0.05 ms)\n"
        + "model coarse = external_solver(mujoco, tet4, strain = finite, size = 15 mm, step = 4 ms)\n"
        + "model odd = external_solver(mujoco, tet4, strain = finite, size = 15 mm, step = 7 ms)\n"
    )
    fine, coarse, odd = (report.models[n] for n in ("fine", "coarse", "odd"))
    assert (fine.status, fine.solve["steps"]) == ("converged", 1200)
    assert coarse.status == "diverged"
    assert "unstable after" in coarse.message
    assert (odd.status, "whole number of steps" in odd.message) == ("unsupported", True)


@pytest.mark.slow
def test_mujoco_says_when_its_iterations_do_not_solve_a_step() -> None:
    pytest.importorskip("mujoco")
    text = FALL.format(law="st_venant_kirchhoff", integrator="implicit_euler", b="0 ms")
    few = "model few = external_solver(mujoco, tet4, strain = finite, size = 15 mm, iterations = 3)\n"
    theirs = run(text + few).models["few"]
    assert theirs.status == "capped"
    assert theirs.message == "60 of 60 steps reached the iteration limit"
    assert theirs.metrics["frame"].value is None  # what is not solved is no frame


@pytest.mark.long
@pytest.mark.slow
def test_newton_moves_them_by_block_descent() -> None:
    """A hundred sweeps a step come near implicit Euler's: 5 %, for its law is another relative of the neo-Hookean."""
    pytest.importorskip("newton")
    text = FALL.format(law="neo_hookean", integrator="implicit_euler", b="0 ms")
    text = "\n".join(line for line in text.splitlines() if not line.startswith("support guide"))
    many = (
        "external_solver(newton_vbd, tet4, strain = finite, size = 15 mm, iterations = 100, time = 500 s, memory = 16)"
    )
    report = run(f"{text}\nmodel theirs = {many}\n")
    theirs = report.models["theirs"]
    assert (theirs.status, theirs.message[:8]) == ("capped", "100 iter")
    assert theirs.metrics["strayed"].value < 0.05


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize("program", [newton_vbd, newton_xpbd], ids=["vbd", "xpbd"])
def test_newton_lets_a_free_body_fall(program: Any, tmp_path: Path) -> None:
    """Implicit Euler's fall, a h^2 n (n + 1) / 2 after n steps of h, whatever the law.

    1e-4: positions in single precision leave up to 4e-5 of it, and nothing else does: the update of `xpbd` written out
    in NumPy strays as far in single precision, 2.03e-5 to each of these digits, and 4e-14 in double. Half the steps
    leave 2 to 4 times as much, where an error of the method would be less; a thousandth of the stiffness the same.
    """
    pytest.importorskip("newton")
    a, h, n = 9.81, 1e-3, 20
    motion = Motion(h, n, np.array([0, n]), np.full(4, 1e-3), iterations=5)
    points, cells = 0.01 * np.eye(4, 3), np.array([[0, 2, 1, 3]])
    gel = ExternalMaterial("neo_hookean", {"young": 6e4, "poisson": 0.3}, 1000.0, np.array([0]))
    forces = np.tile([0.0, 0.0, -a * 1e-3], (4, 1))
    none = np.zeros((0, 2), dtype=np.int64)
    falls = Problem(points, cells, "tet4", "finite", (gel,), none, np.zeros(0), forces, motion=motion)
    program.write(falls, tmp_path)
    subprocess.run(program.command(tmp_path), check=True, capture_output=True, timeout=300)
    fallen = np.tile([0.0, 0.0, -a * h**2 * n * (n + 1) / 2], (4, 1))
    np.testing.assert_allclose(program.read(tmp_path).u[1], fallen, rtol=0.0, atol=1e-4 * a * h**2 * n**2)


def test_newton_holds_particles_whole_and_damps_in_its_own_way() -> None:
    motion = Motion(1e-3, 1, np.arange(2), np.ones(4), damping_stiffness=1e-3)
    points, held = np.eye(4, 3), np.array([[0, 1]])
    some = Problem(points, np.arange(4)[None], "tet4", "finite", (), held, np.zeros(1), points, motion=motion)
    assert [what for what, _ in newton_vbd.refuses(some)] == [
        "damping_stiffness",
        "supports that hold single components",
    ]


def test_what_steps_through_time_is_not_asked_for_rest() -> None:
    """The reason is in the warning of a check: nothing settles in silence."""
    text = FALL.format(law="neo_hookean", integrator="implicit_euler", b="0 ms")
    moving = ("analysis", "    damping", "metric strayed", "metric frame")
    rest = "\n".join(line for line in text.splitlines() if not line.startswith(moving))
    found = softmark.loads(f"{rest}\nmodel theirs = external_solver(mujoco, tet4, strain = finite, size = 15 mm)\n")
    (warning,) = [w for w in found.warnings if w.code == "W710"]
    assert "it steps through time and solves no static equilibrium" in warning.message


@pytest.mark.long
@pytest.mark.slow
def test_ngsolve_takes_curved_cells_several_materials_and_supports_that_move() -> None:
    """Both solve one linear system directly, in other unknowns: 1e-9 of the greatest displacement."""
    pytest.importorskip("ngsolve")
    report = run("""softmark 1
scene "curved"
material soft = neo_hookean(young = 60 kPa, poisson = 0.45, density = 1070 kg/m^3)
material hard = neo_hookean(young = 200 kPa, poisson = 0.2, density = 1000 kg/m^3)
body beam = solid(cylinder(length = 100 mm, radius = 19 mm), soft)
region half = part(beam, where = x > 50 mm, material = hard)
support wall = fixed(beam, where = x <= 0 mm)
support grip = displaced(beam, where = x >= 100 mm, by = (0, 0, 3) mm, components = z)
load weight = gravity(1 m/s^2, direction = -z)
probe tip = point(beam, at = (90, 0, 0) mm)
metric drop = displacement(tip, along = -z)
model ours = fem(tet10, strain = small, size = 20 mm)
model theirs = external_solver(ngsolve, tet10, strain = small, size = 20 mm)
""")
    ours, theirs = (report.models[n] for n in ("ours", "theirs"))
    assert theirs.status == "converged", theirs.message
    apart = np.abs(theirs.mesh.displacement - ours.mesh.displacement).max()
    assert apart < 1e-9 * np.abs(ours.mesh.displacement).max()


def test_ngsolve_refuses_what_holds_the_middle_of_an_edge_alone() -> None:
    points = np.zeros((10, 3))
    cells, none = np.arange(10)[None], np.zeros(0)
    held = [np.array([[node, 0]]) for node in (4, 0)]
    refused = [ngsolve.refuses(Problem(points, cells, "tet10", "small", (), at, none, points)) for at in held]
    assert [bool(r) for r in refused] == [True, False]
