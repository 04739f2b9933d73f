"""Bodies from mesh files: read, held, probed, and refused with a reason."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest

import softmark
from softmark.solvers.mesh.shapes import Box

SCENE = """
material gel = linear_elastic(young = 1 MPa, poisson = 0.3, density = 1000 kg/m^3)
body block = solid(mesh("block.vtk", unit = 1 mm), gel)
support floor = fixed(block, where = z <= 0 mm)
load squeeze = pressure(block, where = z >= 40 mm, magnitude = 1 kPa)
model solid = fem(tet4, strain = corotational, size = 10 mm)
probe top = point(block, at = {at})
"""


def written(folder: Path, at: str = "(10, 10, 40) mm", change: object = None) -> Path:
    """A scene with a mesh file beside it, in millimetres."""
    mesh = Box((20e-3, 20e-3, 40e-3)).mesh(10e-3)
    points, cells = mesh.points * 1e3, mesh.cells
    if callable(change):
        points, cells = change(points.copy(), cells.copy())
    meshio.write_points_cells(folder / "block.vtk", points, [("tetra", cells)])
    scene = folder / "block.scene"
    scene.write_text(SCENE.format(at=at), encoding="utf-8")
    return scene


def test_a_mesh_file_gives_the_same_as_the_shape_it_was_made_from(tmp_path: Path) -> None:
    read = softmark.load(written(tmp_path)).run()
    text = SCENE.format(at="(10, 10, 40) mm").replace(
        'mesh("block.vtk", unit = 1 mm)', "box(size = (20, 20, 40) mm)"
    )
    made = softmark.loads(text).run()
    assert read.exit_status == made.exit_status == 0
    u, v = (r.models["solid"].probes["top"].displacement for r in (read, made))
    np.testing.assert_allclose(u, v, rtol=1e-9)  # the file holds the coordinates to about 16 digits
    assert u[0, 2] < 0


def test_a_point_outside_the_mesh_is_refused(tmp_path: Path) -> None:
    with pytest.raises(softmark.SceneError) as refused:
        softmark.load(written(tmp_path, at="(10, 10, 41) mm")).run()
    (diagnostic,) = refused.value.diagnostics
    assert diagnostic.code == "E504"
    assert "outside `block`" in diagnostic.message


def not_a_number(points: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    points[3, 1] = np.nan
    return points, cells


def flat(points: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    cells[5, 3] = cells[5, 2]
    return points, cells


@pytest.mark.parametrize("change", [not_a_number, flat])
def test_a_bad_mesh_is_refused_with_its_reason(tmp_path: Path, change: object) -> None:
    with pytest.raises(softmark.SceneError) as refused:
        softmark.load(written(tmp_path, change=change)).run()
    (diagnostic,) = refused.value.diagnostics
    assert diagnostic.code == "E403"


def test_a_file_that_is_no_mesh_is_refused(tmp_path: Path) -> None:
    scene = written(tmp_path)
    (tmp_path / "block.vtk").write_text("this is not a mesh")
    with pytest.raises(softmark.SceneError) as refused:
        softmark.load(scene).run()
    assert [d.code for d in refused.value.diagnostics] == ["E403"]
