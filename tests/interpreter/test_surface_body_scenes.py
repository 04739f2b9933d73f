"""Bodies that are filled surfaces, from scene to report; the mesher's part is played by a mesh of the same box."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

import softmark
from softmark.interpreter.cli.main import main
from softmark.solvers.mesh import tetrahedralization
from softmark.solvers.mesh.shapes import Box

SIZE = (20e-3, 10e-3, 10e-3)
SCENE = """
material gel = linear_elastic(young = 1 MPa, poisson = 0.3, density = 1000 kg/m^3)
body block = solid({shape}, gel)
support wall = fixed(block, where = x <= 0 mm)
load pull = traction(block, where = x >= 20 mm, vector = (1, 0, 0) kPa)
model solid = {model}
probe tip = point(block, at = (20, 5, 5) mm)
probe skin = surface(block, size = 5 mm)
metric out = displacement(tip, along = +x)
metric all = displacement(skin, along = +x)
"""
FILLED = 'tetrahedralized("block.stl", unit = 1 mm)'
MODELS = ("fem(tet10, strain = small, size = 4 mm)", "mass_spring(stiffness = from_material(), size = 4 mm)")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """With a surface of the block, in millimetres, and a mesher that knows no other body."""
    box = trimesh.creation.box(bounds=1e3 * np.array([(0.0, 0.0, 0.0), SIZE]))
    box.export(tmp_path / "block.stl")
    monkeypatch.setattr(tetrahedralization, "_cache_folder", lambda: None)
    monkeypatch.setattr(tetrahedralization, "MESHER", "numpy")

    def mesher(surface: Any, size: float, tolerance: float, **field: Any) -> Any:
        mesh = Box(SIZE).mesh("tet4", size)
        return mesh.points, mesh.cells, 1.0

    monkeypatch.setattr(tetrahedralization, "_run_mesher", mesher)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(folder: Path, shape: str, model: str) -> softmark.Report:
    (folder / "block.scene").write_text(SCENE.format(shape=shape, model=model), encoding="utf-8")
    return softmark.load(folder / "block.scene").run()


@pytest.mark.parametrize("model", MODELS)
def test_a_filled_box_is_a_box(folder: Path, model: str) -> None:
    """The same cells give the same answer, forces and reactions; the report says how it was filled."""
    found, known = (run(folder, shape, model) for shape in (FILLED, "box(size = (20, 10, 10) mm)"))
    assert found.exit_status == known.exit_status == 0
    assert {w.code for w in found.warnings} == {w.code for w in known.warnings}
    ours, theirs = (r.models["solid"].probes["tip"].displacement for r in (found, known))
    np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-15)  # m
    filled = found.models["solid"].solve["filled"]
    assert "filled" not in known.models["solid"].solve
    assert filled["mesh_m3"] == pytest.approx(2e-6, rel=1e-12)
    assert filled["surface_m3"] == pytest.approx(2e-6, rel=1e-12)
    assert max(filled["mesh_to_surface_m"], filled["surface_to_mesh_m"]) < 1e-12
    assert filled["tolerance_m"] == pytest.approx(8e-5)
    json.dumps(filled)


@pytest.mark.slow
def test_the_report_has_a_line_for_it(folder: Path) -> None:
    (folder / "block.scene").write_text(SCENE.format(shape=FILLED, model=MODELS[0]), encoding="utf-8")
    assert main(["run", "block.scene", "--out", "report"]) == 0
    page = (folder / "report" / "report.html").read_text(encoding="utf-8")
    assert '<section id="filled"' in page
    assert "numpy" in page, "who filled it"


def test_a_public_surface_is_examined_when_it_is_here(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A check downloads nothing and knows nothing of it; the run says what the check could not."""
    box = trimesh.creation.box(bounds=1e3 * np.array([(0.0, 0.0, 0.0), SIZE]))
    box.faces[3] = box.faces[3][::-1]
    data = folder / "data" / "silicone-beam"
    data.mkdir(parents=True)
    box.export(data / "cylinder_Surface.stl")
    monkeypatch.setattr("softmark.references.data_download.find_file", lambda name: data / "cylinder_Surface.stl")
    shape = 'tetrahedralized("data:silicone-beam/cylinder_Surface.obj", unit = 1 mm)'
    found = run(folder, shape, "fem(tet4, strain = small, size = 5 mm)")
    assert [w.code for w in found.warnings if w.code in ("W348", "W350")] == ["W348", "W350"]
    assert found.models["solid"].solve["filled"]["repairs"] == ["1 triangle reoriented to match neighbours"]


def test_a_point_outside_is_refused(folder: Path) -> None:
    text = SCENE.format(shape=FILLED, model=MODELS[0]).replace("(20, 5, 5) mm", "(21, 5, 5) mm")
    (folder / "block.scene").write_text(text, encoding="utf-8")
    with pytest.raises(softmark.SceneError) as refused:
        softmark.load(folder / "block.scene").run()
    assert [d.code for d in refused.value.diagnostics] == ["E504"]


@pytest.mark.long
@pytest.mark.slow
def test_what_fills_no_surface_knows_nothing_of_it(folder: Path) -> None:
    """And a check of one that does needs no mesher."""
    import subprocess

    text = SCENE.format(shape="box(size = (20, 10, 10) mm)", model=MODELS[0])
    (folder / "box.scene").write_text(text, encoding="utf-8")
    (folder / "block.scene").write_text(SCENE.format(shape=FILLED, model=MODELS[0]), encoding="utf-8")
    for command, none in (
        (
            ["run", "box.scene", "--out", "r"],
            ("mesh.tetrahedralization", "files.watertight_repair", "files.triangle_proximity", "filled_mesh_notes"),
        ),
        (["check", "block.scene"], ("pytetwild",)),
    ):
        code = f"import sys\nfrom softmark.interpreter.cli.main import main\nassert main({command!r}) == 0\n"
        code += f"assert not [m for m in sys.modules if m.endswith({none!r})]"
        done = subprocess.run([sys.executable, "-c", code], cwd=folder, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
