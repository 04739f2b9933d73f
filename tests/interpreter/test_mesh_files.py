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
    mesh = Box((20e-3, 20e-3, 40e-3)).mesh("tet4", 10e-3)
    points, cells = mesh.points * 1e3, mesh.cells
    if callable(change):
        points, cells = change(points.copy(), cells.copy())
    meshio.write_points_cells(folder / "block.vtk", points, [("tetra", cells)])
    scene = folder / "block.scene"
    scene.write_text(SCENE.format(at=at), encoding="utf-8")
    return scene


def test_a_mesh_file_gives_the_same_as_the_shape_it_was_made_from(tmp_path: Path) -> None:
    read = softmark.load(written(tmp_path)).run()
    text = SCENE.format(at="(10, 10, 40) mm").replace('mesh("block.vtk", unit = 1 mm)', "box(size = (20, 20, 40) mm)")
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


@pytest.mark.parametrize(("change", "code"), [(not_a_number, "E562"), (flat, "E564")])
def test_a_bad_mesh_is_refused_with_its_reason(tmp_path: Path, change: object, code: str) -> None:
    with pytest.raises(softmark.SceneError) as refused:
        softmark.load(written(tmp_path, change=change)).run()
    (diagnostic,) = refused.value.diagnostics
    assert diagnostic.code == code


def test_a_file_that_is_no_mesh_is_refused(tmp_path: Path) -> None:
    scene = written(tmp_path)
    (tmp_path / "block.vtk").write_text("this is not a mesh")
    with pytest.raises(softmark.SceneError) as refused:
        softmark.load(scene).run()
    assert [d.code for d in refused.value.diagnostics] == ["E403"]


MODELS = """
material gel = neo_hookean(young = 1 MPa, poisson = 0.45, density = 1000 kg/m^3)
body block = solid(box(size = (20, 20, 40) mm), gel)
support floor = fixed(block, where = z <= 0 mm)
load squeeze = pressure(block, where = z >= 40 mm, magnitude = 10 kPa)
probe top = point(block, at = (10, 10, 40) mm)
{models}
"""


def bricks(folder: Path) -> None:
    """A file of hexahedra, in millimetres."""
    mesh = Box((20e-3, 20e-3, 40e-3)).mesh("hex8", 10e-3)
    meshio.write_points_cells(folder / "bricks.vtk", 1e3 * mesh.points, [("hexahedron", mesh.cells)])


def displacements(folder: Path, models: str) -> dict[str, np.ndarray]:
    """Of the middle of the top, for each model."""
    (folder / "block.scene").write_text(MODELS.format(models=models), encoding="utf-8")
    report = softmark.load(folder / "block.scene").run()
    assert report.exit_status == 0
    return {name: model.probes["top"].displacement[0] for name, model in report.models.items()}


@pytest.mark.slow
@pytest.mark.long
def test_a_model_takes_its_cells_from_a_file(tmp_path: Path) -> None:
    """The file holds what the mesher makes of the box: hexahedra, or five tetrahedra for each, as chosen."""
    bricks(tmp_path)
    file = 'mesh("bricks.vtk", unit = 1 mm{split})'
    u = displacements(
        tmp_path,
        f"""
model made = fem(hex8, strain = finite, size = 10 mm, integration = selective)
model read = fem(hex8, strain = finite, mesh = {file.format(split="")}, integration = selective)
model tets = fem(tet4, strain = corotational, mesh = {file.format(split="")})
model made_tets = fem(tet4, strain = corotational, size = 10 mm)
model kuhn = fem(tet4, strain = corotational, mesh = {file.format(split=", split = kuhn")})
model quadratic = fem(tet10, strain = corotational, mesh = {file.format(split="")})
""",
    )
    np.testing.assert_allclose(u["read"], u["made"], rtol=1e-9)
    assert abs(u["tets"][2] / u["made_tets"][2] - 1) < 0.02  # the same cells, or those of the other colour
    assert abs(u["kuhn"][2] - u["tets"][2]) > 1e-6 * abs(u["tets"][2])
    assert u["quadratic"][2] < u["tets"][2] < 0  # softer


def test_models_share_a_mesh_where_all_agrees(tmp_path: Path) -> None:
    """By element, size, and all that is said of a file, and by nothing else: merged nodes are not those of a slit."""
    from softmark.interpreter.models.fem.fem_declaration import Fem
    from softmark.solvers.mesh.shapes import MeshFile

    file, other = MeshFile("a.msh", 1e-3), MeshFile("a.msh", 1e-3, "kuhn")
    keys = [
        Fem("tet4", "small", 0.01).mesh_key(),
        Fem("tet10", "small", 0.01).mesh_key(),
        Fem("tet4", "small", 0.02).mesh_key(),
        Fem("tet4", "small", mesh=file).mesh_key(),
        Fem("tet4", "small", mesh=other).mesh_key(),
        Fem("tet4", "small", mesh=MeshFile("a.msh", 1e-3, coincident="merge")).mesh_key(),
    ]
    assert len(set(keys)) == len(keys)
    assert Fem("tet4", "finite", 0.01, mass="uniform").mesh_key() == keys[0]


def test_a_mesh_of_another_size_than_the_body_is_noticed(tmp_path: Path) -> None:
    """A unit of 1.1 mm where it is 1 mm: 1.331 of the volume."""
    bricks(tmp_path)
    model = 'model solid = fem(hex8, strain = corotational, mesh = mesh("bricks.vtk", unit = 1.1 mm))'
    text = MODELS.format(models=model)
    (tmp_path / "block.scene").write_text(text, encoding="utf-8")
    report = softmark.load(tmp_path / "block.scene").run()
    assert any("has 33.1 % more volume" in w.message for w in report.warnings if w.code == "W305")


def test_hexahedra_cannot_be_made_of_tetrahedra(tmp_path: Path) -> None:
    scene = written(tmp_path)
    scene.write_text(scene.read_text(encoding="utf-8").replace("fem(tet4", "fem(hex8"), encoding="utf-8")
    with pytest.raises(softmark.SceneError) as refused:
        softmark.load(scene).run()
    (diagnostic,) = refused.value.diagnostics
    assert diagnostic.code == "E403"
    assert "four-node tetrahedra, but the model needs hexahedra" in diagnostic.message
