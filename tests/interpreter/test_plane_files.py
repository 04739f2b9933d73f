"""Plane bodies from mesh files: the same answers as those of the shape whose cells the file has, and refusals."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from flat_files import KINDS, clockwise, outline, plane_cells, write

import softmark
from softmark.interpreter.run.options import Options
from softmark.interpreter.run.pipeline import run
from softmark.solvers.mesh.files.flaws import UnreadableMesh
from softmark.solvers.mesh.flat import Flat, Quadrilateral, QuarterRing
from softmark.solvers.mesh.flat_file import FlatFile
from softmark.solvers.mesh.shapes import MeshFile

SHEET = Quadrilateral((0.01, 0.0, 0.0), (0.05, 0.01, 0.0), (0.05, 0.03, 0.0), (0.01, 0.02, 0.0))
SAID = "quadrilateral((10, 0, 0) mm, (50, 10, 0) mm, (50, 30, 0) mm, (10, 20, 0) mm)"
PARTS = {"hard": "x > 30 mm", "wall": "x <= 10 mm", "tip": "x >= 50 mm"}
SIZE = 0.005
SCENE = """material gel = linear_elastic(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
material stiff = linear_elastic(young = 120 kPa, poisson = 0.2, density = 2000 kg/m^3)
body sheet = BODY
REGIONS
support clamp = fixed(sheet, where = wall)
load weight = gravity(9.81 m/s^2, direction = -y)
load pull = traction(sheet, where = tip, vector = (1, 0, 0) kPa)
load push = pressure(sheet, where = tip and y >= 20 mm, magnitude = 100 Pa)
model own = fem(ELEMENT, strain = STRAIN SIZED)
probe end = point(sheet, at = (50, 20, 0) mm)
probe along = line(sheet, from = (20, 10, 0) mm, to = (40, 15, 0) mm, points = 5)
metric down = displacement(end, along = -y)
metric most = stress(along, component = von_mises, over = largest)
metric held = force(clamp, along = +y)
metric energy = strain_energy(sheet)
"""
OF_SIZES = ("held", "energy")  # whose errors are stated by meshes of other sizes, which no file has
BODIES = {
    "plane_strain": "plane_strain(REGION, gel, thickness = 3 mm)",
    "plane_stress": "plane_stress(REGION, gel, thickness = 3 mm)",
    "axisymmetric": "axisymmetric(REGION, gel)",
}


def sheet(path: Path, element: str, region: Flat = SHEET) -> str:
    """A file of the region's cells, a third of them clockwise, with its parts by name."""
    points, cells = plane_cells(region, element, SIZE)
    corners = 3 if element.startswith("tri") else 4
    edges = outline(points, cells, corners)
    x = points[:, 0]
    on = {name: edges[(np.abs(x[edges] - at) < 1e-9).all(axis=1)] for name, at in (("wall", 0.01), ("tip", 0.05))}
    hard = x[cells[:, :corners]].mean(axis=1) > 0.03
    cells[::3] = clockwise(cells[::3], corners)
    return write(path, points, KINDS[element], cells, {"soft": ~hard, "hard": hard}, on)


def answers(text: str) -> dict[str, float]:
    """All metrics and stated errors."""
    loaded = softmark.loads(text)
    report = run(loaded.scene, list(loaded.warnings), Options(draw=False, stated=()))
    model = report.models["own"]
    assert model.status == "converged", model.message
    values = {name: own.value for name, own in model.metrics.items()}
    stated = {f"{name} +-": own.value for name, own in model.stated.items() if name not in OF_SIZES}
    return values | {name: value for name, value in stated.items() if value is not None}


def same(body: str, element: str, strain: str, file: str, **names: str) -> None:
    """The file's answers are those of the shape, to 1e-9: residuals are far below, nodes have other numbers."""
    text = SCENE.replace("BODY", BODIES[body]).replace("ELEMENT", element).replace("STRAIN", strain)
    grouped = "\n".join(
        f'region {n} = group(sheet, "{names.get(n, n)}"{", material = stiff" * (n == "hard")})' for n in PARTS
    )
    placed = "\n".join(
        f"region {n} = part(sheet, where = {w}{', material = stiff' * (n == 'hard')})" for n, w in PARTS.items()
    )
    of_file = text.replace("REGIONS", grouped).replace("REGION", f'mesh("{file}", unit = 1 m)').replace("SIZED", "")
    of_shape = text.replace("REGIONS", placed).replace("REGION", SAID).replace("SIZED", f", size = {SIZE} m")
    one, other = answers(of_file), answers(of_shape)
    assert len(one) >= 6
    assert one.keys() == other.keys()
    for name, value in one.items():
        assert value == pytest.approx(other[name], rel=1e-9), name
    assert answers(of_file.replace(grouped, placed)) == pytest.approx(one, rel=1e-9)


def test_triangles_of_gmsh_are_those_of_the_shape(tmp_path: Path) -> None:
    same("plane_strain", "tri3", "small", sheet(tmp_path / "sheet.msh", "tri3"))


@pytest.mark.slow
@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("element", KINDS)
def test_answers_are_those_of_the_same_cells_made_by_a_shape(tmp_path: Path, element: str, body: str) -> None:
    """Materials, supports, loads, probes, reactions and stated errors, by groups and by coordinates."""
    same(body, element, "finite" if body == "plane_stress" else "small", sheet(tmp_path / "sheet.4.msh", element))


@pytest.mark.slow
@pytest.mark.parametrize("ending", [".msh", ".4.msh", ".vtu", ".vtk"])
def test_every_format_has_cells_and_groups(tmp_path: Path, ending: str) -> None:
    numbered = {"hard": "part=2", "wall": "part=3", "tip": "part=4"} if ending.startswith(".v") else {}
    same("plane_strain", "tri6", "small", sheet(tmp_path / f"sheet{ending}", "tri6"), **numbered)
