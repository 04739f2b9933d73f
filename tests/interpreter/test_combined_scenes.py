"""Bodies made of two, from scene to report; where it says so, by the library and the mesher themselves."""

from __future__ import annotations

import json
import math
import sys
from importlib.util import find_spec
from typing import Any

import manifold3d_stand_in
import pytest

import softmark
from softmark.solvers.mesh import tetrahedralization
from softmark.solvers.mesh.shapes import Cylinder

ROD = "cylinder(length = 20 mm, radius = 5 mm)"
HELD = f"union({ROD}, cylinder(length = 10 mm, radius = 2 mm, origin = (5, 0, 0) mm))"
CUT = f"intersection({ROD}, box(size = (50, 30, 30) mm, origin = (0, -15, -15) mm))"
SCENE = """
material gel = linear_elastic(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
body rod = solid({shape}, gel)
support wall = fixed(rod, where = x <= 0 mm)
load weight = gravity(9.81 m/s^2)
model solid = fem(tet10, strain = corotational, size = {size} mm)
probe tip = point(rod, at = (20, 0, 0) mm)
metric sag = displacement(tip, along = -z)
"""


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The sizes that the mesher is asked for, its part and the library's being played."""
    sizes: list[float] = []

    def mesher(surface: Any, size: float, tolerance: float, **field: Any) -> Any:
        sizes.append(size)
        mesh = Cylinder(0.02, 0.005).mesh("tet4", 0.004)
        return mesh.points, mesh.cells, 1.0

    monkeypatch.setitem(sys.modules, "manifold3d", manifold3d_stand_in)
    monkeypatch.setattr(manifold3d_stand_in.Manifold, "sound", True)
    monkeypatch.setattr(tetrahedralization, "_cache_folder", lambda: None)
    monkeypatch.setattr(tetrahedralization, "MESHER", "numpy")
    monkeypatch.setattr(tetrahedralization, "_run_mesher", mesher)
    return sizes


@pytest.mark.long
@pytest.mark.slow
def test_what_facets_miss_is_in_the_stated_error(asked: list[float]) -> None:
    """Twice the share of the volume, for a bending stiffness is off by that; the same body without facets has none.

    Of the size of the displacement, which is that along z but for a little.
    """
    made, whole = (softmark.loads(SCENE.format(shape=shape, size=4)).run().models["solid"] for shape in (HELD, ROD))
    share = made.solve["filled"]["facets_m3"] / made.solve["filled"]["surface_m3"]
    assert 0.01 < share < 0.05
    assert made.stated["sag"].parts["facets"] == pytest.approx(2.0 * share * made.metrics["sag"].value, rel=0.05)
    assert "facets" not in whole.stated["sag"].parts


@pytest.mark.slow
def test_a_probe_throughout_it_has_no_more_cells_than_in_another_body(asked: list[float]) -> None:
    """Its volume has no closed form, but its surface has one: 5000 cells, six to a cube."""
    softmark.loads(SCENE.format(shape=HELD, size=4) + "probe inside = volume(rod)").run()
    volume = math.pi * 0.005**2 * 0.02
    assert min(asked) == pytest.approx((6.0 * volume / 5000) ** (1 / 3), rel=0.02)  # and not 0.8 mm


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.skipif(not all(map(find_spec, ("manifold3d", "pytetwild"))), reason="needs `solids`, `meshing`")
def test_the_stated_error_holds_that_of_the_facets(tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a rod cut out of a longer box, against the same rod with curved sides and finer cells, which is 2.5 % off."""
    from softmark.interpreter.cli.main import main

    (tmp_path / "rod.scene").write_text(SCENE.format(shape=CUT, size=4), encoding="utf-8")
    assert main(["run", str(tmp_path / "rod.scene"), "--stated", "--out", str(tmp_path / "out")]) == 0
    found = json.loads((tmp_path / "out" / "report.json").read_text())["models"]["solid"]
    true = softmark.loads(SCENE.format(shape=ROD, size=2.5)).run().models["solid"].metrics["sag"].value
    off, said = abs(found["metrics"]["sag"]["value"] - true), found["stated"]["sag"]
    assert said["parts"]["discretisation"] < off < said["value"] < 5.0 * off
