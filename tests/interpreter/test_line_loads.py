"""Forces along lines in solids: integrals cell by cell against others, resultants, and what is said of limits."""

from __future__ import annotations

import numpy as np
import pytest

import softmark
from softmark.interpreter.pipeline.run_pipeline import RunOptions, run_scene
from softmark.interpreter.verification.point_and_line_loads_check import along_line
from softmark.solvers.mesh.element_interpolation import locate_points
from softmark.solvers.mesh.mesh import Floats, Mesh
from softmark.solvers.mesh.mesh_line import find_face_crossings, line_quadrature
from softmark.solvers.mesh.shapes import SHAPES

KINDS = ("tet4", "tet10", "hex8", "hex20", "hex27")


def shares(mesh: Mesh, begin: Floats, end: Floats) -> Floats:
    """What every node takes of a line, m."""
    X, w = line_quadrature(mesh, begin, end)
    place = locate_points(mesh, X)
    found = np.zeros(len(mesh.points))
    np.add.at(found, place.nodes, w[:, None] * place.N)
    return found


def test_a_line_is_cut_where_it_meets_faces_of_cells() -> None:
    """Through 4 x 2 x 1 unit cubes from corner to corner: x is whole at every quarter, y in the middle."""
    mesh = SHAPES["box"](size=(4.0, 2.0, 1.0)).mesh("hex8", 1.0)
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    assert find_face_crossings(mesh, low, high) == pytest.approx([0.0, 0.25, 0.5, 0.75, 1.0])


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("begin", "end"),
    [((2e-3, -4e-3, 3e-3), (37e-3, 5e-3, -6e-3)), ((40e-3, 0.0, 0.0), (0.0, 0.0, 0.0))],
    ids=["oblique", "along an axis of edges"],
)
def test_nodes_take_what_halving_without_faces_finds(
    kind: str, begin: tuple[float, float, float], end: tuple[float, float, float]
) -> None:
    """In a cylinder, whose cells are no boxes. Length and middle are those of the line on every mesh."""
    mesh = SHAPES["cylinder"](length=0.04, radius=0.01).mesh(kind, 5e-3)
    found = shares(mesh, np.array(begin), np.array(end))
    again, unsure = along_line(begin, end, (0.0, 0.0, 2.0), mesh)
    length = float(np.linalg.norm(np.array(end) - np.array(begin)))
    assert unsure < 1e-9 * length
    assert found == pytest.approx(again[:, 2] / 2.0, abs=1e-9 * length)
    assert found.sum() == pytest.approx(length, rel=1e-12)
    middle = 0.5 * (np.array(begin) + np.array(end))
    assert found @ mesh.points / length == pytest.approx(middle, abs=1e-12)


BLOCK = """
material gel   = neo_hookean(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     block = solid(box(size = (60, 20, 20) mm), gel)
support  floor = fixed(block, where = z <= 0 mm)
load     blade = line_load(block, from = (25, 0, 20) mm, to = (31, 20, 20) mm, vector = (0.1, 0, -0.5) N/m)
model    cells = fem({kind}, strain = finite, size = 5 mm)
probe    under = point(block, at = (28, 10, 20) mm)
probe    away  = point(block, at = (50, 10, 20) mm)
metric   sink  = displacement(under, along = -z)
metric   stays = displacement(away, along = -z)
metric   push  = force(floor, along = +z)
metric   turn  = moment(floor, along = +y, about = (0, 0, 0) mm)
"""


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("kind", ["tet4", "hex8"])
def test_the_report_has_force_and_moment_of_a_line_and_no_error_where_there_is_no_limit(kind: str) -> None:
    """F = q L at the middle of the line, (28, 10, 20) mm: the moment about y is z Fx - x Fz."""
    loaded = softmark.loads(BLOCK.format(kind=kind))
    report = run_scene(loaded.scene, list(loaded.warnings), RunOptions(draw=False, stated=()))
    found = report.models["cells"]
    assert found.status == "converged"
    length = float(np.hypot(6e-3, 20e-3))
    force = length * np.array([0.1, 0.0, -0.5])
    load = found.loads["blade"]
    assert load.force == pytest.approx(force, rel=1e-12)
    assert load.moment == pytest.approx(np.cross([28e-3, 10e-3, 20e-3], force), rel=1e-9)
    assert load.length == pytest.approx(length)
    assert found.metrics["push"].value == pytest.approx(-force[2], rel=1e-7)
    stated = found.stated
    assert "the line that `blade` acts along, where displacements grow" in str(stated["sink"].reason)
    assert stated["stays"].value is not None
    assert [w.code for w in report.warnings if w.code == "W384"] == ["W384"]


PINNED = """
material gel   = linear_elastic(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     block = solid(box(size = ({long}, 20, 20) mm), gel)
support  floor = fixed(block, where = {held} <= 0 mm)
load     pin   = point_force(block, at = ({long}, 10, 20) mm, vector = (0, 0, {push}) mN)
model    cells = fem(hex20, strain = small, size = {size} mm)
probe    under = point(block, at = ({long}, 10, 20) mm)
metric   sink  = displacement(under, along = -z)
metric   done  = work(pin)
metric   kept  = strain_energy(block)
"""


def pinned(size: float, long: float, held: str, push: float) -> softmark.Report:
    loaded = softmark.loads(PINNED.format(size=size, long=long, held=held, push=push))
    return run_scene(loaded.scene, list(loaded.warnings), RunOptions(draw=False, stated=()))


@pytest.mark.slow
def test_a_force_on_a_point_has_no_limit_beneath_it_and_its_work_has_none() -> None:
    """With cells of half the size nearly twice is found, of all three."""
    coarse, fine = (pinned(size, 20.0, "z", -1.0) for size in (10.0, 5.0))
    for name in ("sink", "done", "kept"):
        found = [report.models["cells"].metrics[name].value for report in (coarse, fine)]
        assert found[1] > 1.3 * found[0]
        assert "grows with every" in str(coarse.models["cells"].stated[name].reason).replace("grow ", "grows ")
    assert [w.code for w in coarse.warnings if w.code == "W384"] == ["W384"]


@pytest.mark.slow
def test_a_force_at_the_end_of_a_long_bar_dents_it_by_less_than_it_bends_it() -> None:
    """Bent by F L^3 / (3 E I), and dented by some F / (E h): a 54th of it on 60 mm, a 2000th on 200 mm."""
    short, long = (pinned(10.0, length, "x", -1e-3) for length in (60.0, 200.0))
    assert "W384" in [w.code for w in short.warnings]
    assert "W384" not in [w.code for w in long.warnings]
    assert "grow with every" not in str(long.models["cells"].stated["sink"].reason)
