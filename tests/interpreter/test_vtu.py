"""`dsl run --vtu`: files that other programs read, with the displacements of the report."""

from __future__ import annotations

import json
from pathlib import Path
from xml.etree import ElementTree

import meshio
import numpy as np
import pytest

from softmark.interpreter.cli.main import main

SCENE = """
material gel     = neo_hookean(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     block   = solid(box(size = (60, 20, 20) mm), gel)
support  wall    = fixed(block, where = x <= 0 mm)
load     weight  = gravity(9.81 m/s^2)
model    tets    = fem(tet4, strain = corotational, size = 10 mm)
model    quads   = fem(tet10, strain = corotational, size = 10 mm)
model    hexes   = fem(hex8, strain = finite, size = 10 mm)
model    ser     = fem(hex20, strain = finite, size = 10 mm)
model    lag     = fem(hex27, strain = finite, size = 10 mm)
model    springs = mass_spring(size = 10 mm, network = hex8, stiffness = from_material())
probe    edge    = line(block, from = (0, 0, 0) mm, to = (60, 0, 0) mm, points = 7)
"""
CELLS = {
    "tets": "tetra",
    "quads": "tetra10",
    "hexes": "hexahedron",
    "ser": "hexahedron20",
    "lag": "hexahedron27",
    "springs": "hexahedron",
}


@pytest.fixture
def written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder to run scenes in."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(folder: Path, text: str) -> Path:
    """The folder of the report."""
    (folder / "block.scene").write_text(text, encoding="utf-8")
    assert main(["run", "block.scene", "--vtu", "--out", "out"]) == 0
    return folder / "out"


@pytest.mark.slow
@pytest.mark.long
def test_meshes_hold_the_displacements_of_the_report(written: Path) -> None:
    out = run(written, SCENE)
    models = json.loads((out / "report.json").read_text())["models"]
    for name, cells in CELLS.items():
        mesh = meshio.read(out / "vtu" / f"{name}.vtu")
        assert list(mesh.cells_dict) == [cells]
        u = mesh.point_data["displacement"]
        assert u.shape == mesh.points.shape
        probe = models[name]["probes"]["edge"]
        for X, expected in zip(probe["points"], probe["displacement"], strict=True):
            distance = np.linalg.norm(mesh.points - X, axis=1)
            assert distance.min() < 1e-12  # the probe's points are nodes: 10 mm apart, as the mesh has them
            np.testing.assert_allclose(u[distance.argmin()], expected, atol=1e-12)


@pytest.mark.slow
@pytest.mark.long
def test_surfaces_are_the_deformed_ones(written: Path) -> None:
    out = run(written, SCENE)
    for name in CELLS:
        body, skin = (meshio.read(out / "vtu" / f"{name}{end}.vtu") for end in ("", "-surface"))
        assert "triangle" in skin.cells_dict
        deformed = body.points + body.point_data["displacement"]
        # the surface is drawn over material points of its own; its box is that of the deformed mesh
        np.testing.assert_allclose(skin.points.min(axis=0), deformed.min(axis=0), atol=2e-4)
        np.testing.assert_allclose(skin.points.max(axis=0), deformed.max(axis=0), atol=2e-4)


@pytest.mark.slow
def test_a_motion_is_a_series_with_its_times(written: Path) -> None:
    out = run(written, SCENE + "analysis fall = dynamic(duration = 50 ms, step = 10 ms)\n")
    models = json.loads((out / "report.json").read_text())["models"]
    for name in CELLS:
        root = ElementTree.parse(out / "vtu" / f"{name}-surface.pvd").getroot()
        collection = root.findall("Collection/DataSet")
        times = [float(str(entry.get("timestep"))) for entry in collection]
        np.testing.assert_allclose(times, models[name]["probes"]["edge"]["times"])
        first, last = (meshio.read(out / "vtu" / str(collection[i].get("file"))) for i in (0, -1))
        np.testing.assert_allclose(last.points - first.points, last.point_data["displacement"], atol=1e-12)
        # free fall would be g t^2 / 2 = 12 mm by now; the wall holds
        assert last.point_data["displacement"][:, 2].min() < -1e-3


def test_without_a_folder_they_go_where_a_report_would(written: Path) -> None:
    (written / "block.scene").write_text(SCENE, encoding="utf-8")
    assert main(["run", "block.scene", "--vtu", "--model", "tets", "--json", "out.json"]) == 0
    assert list((written / "block-report").rglob("*.vtu"))
