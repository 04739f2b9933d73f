"""Tracked points and points of other meshes that lie outside the body they are said to be of."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from softmark.interpreter.api.python_api import load
from softmark.interpreter.language.compiled_scene import SceneError
from softmark.interpreter.problem.points_outside_body import BESIDE, _swept_distances
from softmark.solvers.mesh.shapes import Box, Cylinder

SCENE = """softmark 1
scene "beads"
material gel = linear_elastic(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
body bar = solid(box(size = (100, 20, 20) mm), gel)
support wall = fixed(bar, where = x <= 0 mm)
load pull = traction(bar, where = x >= 100 mm, vector = (500, 0, 0) Pa)
reference beads = markers("beads.csv", unit = 1 mm, uncertainty = 0.1 mm)
model hexes = fem(hex8, strain = corotational, size = 10 mm)
model rod = beam6dof(segments = 10)
probe inside = markers(bar, of = beads)
metric error = mean_error(inside, against = beads)
"""


def written(folder: Path, rows: list[tuple[float, float, float]]) -> Path:
    """A scene beside a table of beads that move by 0.1 mm along x."""
    lines = ["x0,y0,z0,x1,y1,z1", *(f"{x},{y},{z},{x + 0.1},{y},{z}" for x, y, z in rows)]
    (folder / "beads.csv").write_text("\n".join(lines), encoding="utf-8")
    file = folder / "my.scene"
    file.write_text(SCENE, encoding="utf-8")
    return file


def test_beads_outside_are_left_out_and_named(tmp_path: Path) -> None:
    """Two of five, 6 and 10 mm outside; one a tenth of a millimetre off the surface stays, as marks on it do."""
    rows = [(50, 10, 10), (100, 10, 10), (50, 20.1, 10), (50, 26, 10), (110, 10, 10)]
    report = load(written(tmp_path, rows)).run()
    warnings = [w for w in report.warnings if w.code == "W379"]
    assert len(warnings) == 1
    assert "2 of 5 points of `inside` lie outside `bar`, by up to 10 mm" in warnings[0].message
    for name in ("hexes", "rod"):
        assert len(report.models[name].probes["inside"].points) == 3


def test_all_outside_is_an_error(tmp_path: Path) -> None:
    """As with a unit that is wrong."""
    with pytest.raises(SceneError, match="E504"):
        load(written(tmp_path, [(500, 100, 100), (1000, 100, 100)])).run()


@pytest.mark.parametrize("shape", [Box((0.1, 0.02, 0.04), (0.3, 0.0, -0.1)), Cylinder(0.1, 0.02, (0.0, 0.6, 0.8))])
def test_how_far_outside(shape: Box | Cylinder) -> None:
    """Against the nearest of many points of the body: within half the spacing of those; zero inside."""
    random = np.random.default_rng(1)
    low, high = (np.array(end) for end in shape.bounds)
    X = random.uniform(low - 0.02, high + 0.02, (50, 3))
    mesh = shape.mesh("tet4", 0.004)
    gaps = np.linalg.norm(X[:, None] - mesh.points, axis=2).min(axis=1)
    found = _swept_distances(shape, X)
    assert np.all(found <= gaps + 1e-12)
    assert np.all(found >= gaps - 0.004)
    assert np.all(_swept_distances(shape, mesh.points) < 1e-12)
    assert BESIDE < 0.1
