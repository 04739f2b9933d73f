"""Probes as scenes declare them: which material points they are, and what they carry."""

from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import meshio
import numpy as np
import pytest

import softmark
from softmark.interpreter.metrics.energy_norm_error import EnergyNormError
from softmark.interpreter.metrics.measurement import MetricInput, ReferenceData
from softmark.interpreter.problem.body_case import case_of
from softmark.interpreter.problem.probe_points import _volume_probe_points, held_face
from softmark.solvers.materials.linear_elastic import LinearElastic
from softmark.solvers.mesh.shapes import Box

BLOCK = """
material gel   = linear_elastic(young = 1 MPa, poisson = 0.3, density = 1000 kg/m^3)
body     block = solid(box(size = (60, 20, 20) mm), gel)
support  left  = fixed(block, where = x <= 0 mm)
support  right = displaced(block, where = x >= 60 mm, by = (6, 0, 0) mm)
model    cells = fem(hex8, strain = small, size = 10 mm)
"""


def probe(declaration: str, more: str = "") -> softmark.ProbeResult:
    report = softmark.loads(BLOCK + f"probe here = {declaration}\n" + more).run()
    return report.models["cells"].probes["here"]


def test_a_line_has_both_its_ends() -> None:
    found = probe("line(block, from = (0, 10, 10) mm, to = (60, 10, 10) mm, points = 4)")
    np.testing.assert_allclose(found.points[:, 0], [0, 0.02, 0.04, 0.06], atol=1e-15)
    np.testing.assert_allclose(found.displacement[[0, -1]], [[0, 0, 0], [0.006, 0, 0]], atol=1e-12)


@pytest.mark.parametrize("size", [5, 10])
def test_a_surface_is_closed_and_lies_outward(size: int) -> None:
    found = probe(f"surface(block, size = {size} mm)")
    assert found.triangles is not None
    a, b, c = (found.points[found.triangles[:, i]] for i in range(3))
    # divergence theorem: areas add up to nothing over a closed surface, and x . n dA / 3 to the volume
    areas = np.cross(b - a, c - a) / 2
    np.testing.assert_allclose(areas.sum(axis=0), 0, atol=1e-15)
    assert np.linalg.norm(areas, axis=1).sum() == pytest.approx(2 * (0.02 * 0.02 + 2 * 0.06 * 0.02))
    assert np.einsum("ti,ti->", (a + b + c) / 3, areas) / 3 == pytest.approx(0.06 * 0.02 * 0.02)


def test_a_part_of_a_surface_has_its_own_triangles_only() -> None:
    found = probe("surface(block, size = 5 mm, where = z >= 20 mm)")
    assert found.triangles is not None
    np.testing.assert_allclose(found.points[:, 2], 0.02)
    assert found.triangles.max() == len(found.points) - 1  # numbered anew
    a, b, c = (found.points[found.triangles[:, i]] for i in range(3))
    areas = np.cross(b - a, c - a) / 2
    np.testing.assert_allclose(areas.sum(axis=0), [0, 0, 0.06 * 0.02], atol=1e-12)


@pytest.mark.parametrize(
    ("where", "area"),
    [
        ("z >= 20 mm and x <= 48 mm", 960.0),  # 800 mm^2 by whole triangles
        ("z >= 20 mm and x >= 42 mm and x <= 48 mm", 120.0),  # refused: no node
        ("z >= 20 mm and x + y <= 33 mm", 460.0),
        ("x <= 7 mm", 400.0 + 4 * 140.0),
        ("not (z >= 20 mm) or x <= 1 mm", 4400.0 + 20.0),
    ],
)
def test_a_part_of_a_surface_ends_where_its_condition_does(where: str, area: float) -> None:
    """Of a block of 60 x 20 x 20 mm, in triangles of 10 mm: areas of rectangles and of a trapezium, mm^2."""
    found = probe(f"surface(block, size = 10 mm, where = {where})")
    assert found.triangles is not None
    a, b, c = (found.points[found.triangles[:, i]] for i in range(3))
    normals = np.cross(b - a, c - a) / 2
    assert 1e6 * np.linalg.norm(normals, axis=1).sum() == pytest.approx(area, rel=1e-9)
    inside = 0.5 * (found.points.min(axis=0) + found.points.max(axis=0))
    assert np.einsum("ti,ti->", (a + b + c) / 3 - inside, normals) >= 0.0  # outward still
    ends = np.sort(found.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    _, counts = np.unique(ends, axis=0, return_counts=True)
    assert counts.max() == 2  # neighbours share the points of cuts
    assert len(np.unique(found.triangles)) == len(found.points)


def test_a_curved_border_says_what_it_leaves_out() -> None:
    """A disc of 8 mm, 201.06 mm^2, in whole triangles of 5 mm: the share is told to the chords' 2 %."""
    disc = "z >= 20 mm and (x - 30 mm)^2 + (y - 10 mm)^2 <= 64 mm^2"
    report = softmark.loads(BLOCK + f"probe here = surface(block, size = 5 mm, where = {disc})\n").run()
    found = report.models["cells"].probes["here"]
    assert found.triangles is not None
    a, b, c = (found.points[found.triangles[:, i]] for i in range(3))
    area = 1e6 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()) / 2
    note = next(d for d in report.warnings if d.code == "W380")
    told = float(re.search(r"([0-9.]+) %", note.message)[1])  # type: ignore[index]
    assert told < 90.0
    assert told == pytest.approx(100.0 * area / (np.pi * 64), rel=0.02)


def test_the_held_face_ends_where_its_support_does() -> None:
    """`register = clamp` fits a measured face to it: 7 of 20 mm of one end are held, whatever the triangles are."""
    text = BLOCK.replace("where = x <= 0 mm", "where = x <= 0 mm and z <= 7 mm", 1)
    scene = softmark.loads(text).scene
    held = held_face(case_of(scene, "block"))
    assert held is not None
    points, triangles = held
    a, b, c = (points[triangles[:, i]] for i in range(3))
    assert 1e6 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2 == pytest.approx(140.0, rel=1e-9)


@pytest.mark.parametrize(
    "declaration",
    ["surface(block, size = 5 mm, where = z > 25 mm)", "mesh_nodes(block, mesh = cells_of, where = z > 25 mm)"],
)
def test_a_condition_that_selects_nothing_is_refused(tmp_path: Path, declaration: str) -> None:
    scene = written(tmp_path, declaration)
    with pytest.raises(softmark.SceneError) as refused:
        scene.run()
    assert [d.code for d in refused.value.diagnostics] == ["E302"]


@pytest.mark.parametrize(
    ("declaration", "body", "owner"),
    [
        ("mesh_nodes(block, mesh = cells_of)", "box(size = (60, 20, 20) mm)", "here"),
        ("surface(block, mesh = cells_of)", "box(size = (60, 20, 20) mm)", "here"),
        ("surface(block)", "cells_of", "block"),
        ("volume(block)", "cells_of", "block"),
    ],
)
def test_a_mesh_that_cannot_be_read_is_refused(tmp_path: Path, declaration: str, body: str, owner: str) -> None:
    written(tmp_path, declaration)
    (tmp_path / "block.vtk").write_text("this is no mesh")
    text = (tmp_path / "block.scene").read_text().replace("box(size = (60, 20, 20) mm)", body)
    (tmp_path / "block.scene").write_text(text)
    with pytest.raises(softmark.SceneError) as refused:
        softmark.load(tmp_path / "block.scene").run()
    assert [d.code for d in refused.value.diagnostics] == ["E403"]
    assert f"the mesh of `{owner}`" in str(refused.value)


def written(folder: Path, declaration: str) -> softmark.LoadedScene:
    """A scene beside a mesh file of the block."""
    mesh = Box((0.06, 0.02, 0.02)).mesh("hex8", 0.01)
    meshio.write_points_cells(folder / "block.vtk", mesh.points, [("hexahedron", mesh.cells)])
    text = BLOCK + f'shape cells_of = mesh("block.vtk", unit = 1 m)\nprobe here = {declaration}\n'
    (folder / "block.scene").write_text(text, encoding="utf-8")
    return softmark.load(folder / "block.scene")


def test_nodes_are_those_of_the_mesh_in_its_order(tmp_path: Path) -> None:
    found = written(tmp_path, "mesh_nodes(block, mesh = cells_of)").run().models["cells"].probes["here"]
    np.testing.assert_allclose(found.points, Box((0.06, 0.02, 0.02)).mesh("hex8", 0.01).points, atol=1e-15)
    part = written(tmp_path, "mesh_nodes(block, mesh = cells_of, where = x >= 60 mm)").run().models["cells"]
    assert len(part.probes["here"].points) == 9
    np.testing.assert_allclose(part.probes["here"].displacement, np.tile([0.006, 0, 0], (9, 1)), atol=1e-12)


def test_a_surface_over_a_mesh_has_its_boundary_points(tmp_path: Path) -> None:
    found = written(tmp_path, "surface(block, mesh = cells_of)").run().models["cells"].probes["here"]
    assert len(found.points) == 63 - 5  # 7 x 3 x 3 points, 5 of them inside


def test_weights_of_a_volume_add_up_to_it() -> None:
    text = (
        "probe inside = volume(block, size = 10 mm)\nmodel fine = fem(hex8, strain = small, size = 5 mm)\n"
        "metric eta = energy_norm_error(inside, against = fine)\n"
    )
    report = softmark.loads(BLOCK + text).run()
    metric = report.models["cells"].metrics["eta"]
    assert metric.details["volume_m3"] == pytest.approx(0.06 * 0.02 * 0.02)
    assert metric.value is not None
    assert 0 < metric.value < 0.2
    assert report.models["fine"].metrics == {}


@pytest.mark.parametrize("size", [0.06, 0.02, 0.007])
def test_an_integral_of_squared_strains_is_exact_on_any_mesh(size: float) -> None:
    """u = c x^2 / 2 along x against u = c L x / 2: eta^2 = int (x - L/2)^2 / int x^2 = (L^3/12) / (L^3/3) = 1/4.

    With c L = 1e-6 the squares of Green's strain are below 1e-6 of it, and the differences are exact to 1e-8 or so. At
    one point a cell, its centroid, the coarsest of these meshes found 0.35.
    """
    L, c = 0.06, 1e-6 / 0.06
    probe: Any = SimpleNamespace(thing=SimpleNamespace(where=None))
    whole: Any = SimpleNamespace(groups=(), parts=())
    place = _volume_probe_points(probe, whole, Box((L, 0.02, 0.02)), size)

    def right(X: np.ndarray) -> np.ndarray:
        return np.outer(0.5 * c * X[:, 0] ** 2, [1.0, 0.0, 0.0])

    def wrong(X: np.ndarray) -> np.ndarray:
        return np.outer(0.5 * c * L * X[:, 0], [1.0, 0.0, 0.0])

    case: Any = SimpleNamespace(materials=(LinearElastic(7.875, 0.3125, 1.0),), parts=())  # mu = 3, lam = 5
    known = ReferenceData("theory", right(place.X), right)
    seen = MetricInput("m", case, place.X, wrong(place.X), weights=place.weights, known=known, displacement=wrong)
    assert EnergyNormError("all", "theory").measure(seen).value == pytest.approx(0.5, rel=1e-5)


def test_a_whole_surface_encloses_a_volume_and_a_part_does_not() -> None:
    """Stretched by 10 % with both ends held: the volume grows by less than 10 %, and by more than nothing."""
    text = (
        "probe whole = surface(block, size = 5 mm)\nprobe top = surface(block, size = 5 mm, where = z >= 20 mm)\n"
        "metric grown = volume_change(whole)\nmetric none = volume_change(top)\n"
    )
    metrics = softmark.loads(BLOCK + text).run().models["cells"].metrics
    assert 0.02 < metrics["grown"].value < 0.06  # type: ignore[operator]  # (1 - 2 nu) 10 % = 4 % were it uniaxial
    assert metrics["none"].value is None
    assert "not closed" in str(metrics["none"].reason)


TABLE = "x0,y0,z0,x1,y1,z1\n10,10,10,11,10,10\n30,10,10,33,10,10\n50,10,10,55,10,10\n30,,10,33,10,10\n"


def test_markers_are_the_tracked_points(tmp_path: Path) -> None:
    """A uniform stretch of 10 % as it was tracked; the row without a position is left out and counted."""
    (tmp_path / "beads.csv").write_text(TABLE, encoding="utf-8")
    text = BLOCK + (
        'reference beads = markers("beads.csv", unit = 1 mm, uncertainty = 0.5 mm)\n'
        "probe here = markers(block, of = beads, where = x > 20 mm)\n"
        "metric away = mean_error(here, against = beads)\n"
    )
    (tmp_path / "block.scene").write_text(text, encoding="utf-8")
    report = softmark.load(tmp_path / "block.scene").run()
    probe = report.models["cells"].probes["here"]
    np.testing.assert_allclose(probe.points, [[0.03, 0.01, 0.01], [0.05, 0.01, 0.01]], atol=1e-15)
    seen = report.references["beads"].probes["here"].displacement
    np.testing.assert_allclose(seen, [[0.003, 0, 0], [0.005, 0, 0]], atol=1e-15)
    away = report.models["cells"].metrics["away"]
    assert away.value == pytest.approx(np.linalg.norm(probe.displacement - seen, axis=1).mean(), rel=1e-12)
    assert not away.meaningful
    assert report.references["beads"].metrics == {}  # it is not compared with itself
    assert "1 of 4 points" in str(report.references["beads"].facts["notes"])
