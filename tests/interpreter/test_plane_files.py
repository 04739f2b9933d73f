"""Plane bodies from mesh files: the same answers as those of the shape whose cells the file has, and refusals."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
from loaded_modules import loaded_by
from plane_mesh_files import KINDS, clockwise, outline, plane_cells, write

import softmark
from softmark.interpreter.pipeline.run_options import RunOptions
from softmark.interpreter.pipeline.run_pipeline import run_scene
from softmark.solvers.mesh import mesh_groups
from softmark.solvers.mesh.disjoint_shapes import DisjointShapes
from softmark.solvers.mesh.files.mesh_validation import UnreadableMesh
from softmark.solvers.mesh.mesh_refinement import build_finer_space
from softmark.solvers.mesh.plane_region_files import FileSlice
from softmark.solvers.mesh.plane_regions import PlaneRegion, Quadrilateral, QuarterRing
from softmark.solvers.mesh.shapes import MeshFile

SHEET = Quadrilateral((0.01, 0.0, 0.0), (0.05, 0.01, 0.0), (0.05, 0.03, 0.0), (0.01, 0.02, 0.0))
SAID = "quadrilateral((10, 0, 0) mm, (50, 10, 0) mm, (50, 30, 0) mm, (10, 20, 0) mm)"
PARTS = {"hard": "x > 30 mm", "wall": "x <= 10 mm", "tip": "x >= 50 mm"}
SIZE = 0.01  # 4 by 2 cells: numbers are those of the same cells however large these are
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
BODIES = {
    "plane_strain": "plane_strain(REGION, gel, thickness = 3 mm)",
    "plane_stress": "plane_stress(REGION, gel, thickness = 3 mm)",
    "axisymmetric": "axisymmetric(REGION, gel)",
}


def sheet(path: Path, element: str, region: PlaneRegion = SHEET) -> str:
    """A file of the region's cells, a third of them clockwise, with its parts by name."""
    points, cells = plane_cells(region, element, SIZE)
    corners = 3 if element.startswith("tri") else 4
    edges = outline(points, cells, corners)
    x = points[:, 0]
    on = {name: edges[(np.abs(x[edges] - at) < 1e-9).all(axis=1)] for name, at in (("wall", 0.01), ("tip", 0.05))}
    hard = x[cells[:, :corners]].mean(axis=1) > 0.03
    cells[::3] = clockwise(cells[::3], corners)
    return write(path, points, KINDS[element], cells, {"soft": ~hard, "hard": hard}, on)


@cache
def answers(text: str, stated: tuple[str, ...] | None = ()) -> dict[str, float]:
    """All metrics, and the errors that finer spaces over the same cells state, where there was time for these."""
    loaded = softmark.loads(text)
    report = run_scene(loaded.scene, list(loaded.warnings), RunOptions(draw=False, stated=stated))
    model = report.models["own"]
    assert model.status == "converged", model.message
    values = {name: own.value for name, own in model.metrics.items()}
    values |= {f"{name} +-": own.parts.get("discretisation") for name, own in model.stated.items()}
    return {name: value for name, value in values.items() if value is not None}


def texts(body: str, element: str, strain: str, file: str, **names: str) -> tuple[str, str, str]:
    """The scene of a file with its groups, of the shape, and of the file with conditions in their place."""
    text = SCENE.replace("BODY", BODIES[body]).replace("ELEMENT", element).replace("STRAIN", strain)
    grouped = "\n".join(
        f'region {n} = group(sheet, "{names.get(n, n)}"{", material = stiff" * (n == "hard")})' for n in PARTS
    )
    placed = "\n".join(
        f"region {n} = part(sheet, where = {w}{', material = stiff' * (n == 'hard')})" for n, w in PARTS.items()
    )
    of_file = text.replace("REGIONS", grouped).replace("REGION", f'mesh("{file}", unit = 1 m)').replace("SIZED", "")
    of_shape = text.replace("REGIONS", placed).replace("REGION", SAID).replace("SIZED", f", size = {SIZE} m")
    return of_file, of_shape, of_file.replace(grouped, placed)


def same(*which: str, **names: str) -> None:
    """The file's answers are those of the shape, to 1e-9: residuals are far below, nodes have other numbers."""
    one, other, third = map(answers, texts(*which, **names))
    for name in one.keys() & other.keys() - {"held +-"}:  # which is nothing but rounding
        assert one[name] == pytest.approx(other[name], rel=1e-9), name
    for name in one.keys() & third.keys():
        assert one[name] == pytest.approx(third[name], rel=1e-9), name
    assert {"down", "most", "held", "energy"} <= one.keys() & other.keys() & third.keys()


@pytest.mark.slow
def test_triangles_of_gmsh_are_those_of_the_shape(tmp_path: Path) -> None:
    of_file, of_shape, _ = texts("plane_strain", "tri3", "small", sheet(tmp_path / "sheet.msh", "tri3"))
    assert answers(of_file, None) == pytest.approx(answers(of_shape, None), rel=1e-9)


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("element", KINDS)
def test_answers_are_those_of_the_same_cells_made_by_a_shape(tmp_path: Path, element: str, body: str) -> None:
    """Materials, supports, loads, probes, reactions and stated errors, by groups and by coordinates."""
    same(body, element, "corotational" if body == "plane_stress" else "small", sheet(tmp_path / "sheet.4.msh", element))


@pytest.mark.slow
@pytest.mark.parametrize("ending", [".msh", ".4.msh", ".vtu", ".vtk"])
def test_every_format_has_cells_and_groups(tmp_path: Path, ending: str) -> None:
    numbered = {"hard": "part=2", "wall": "part=3", "tip": "part=4"} if ending.startswith(".v") else {}
    same("plane_strain", "tri6", "small", sheet(tmp_path / f"sheet{ending}", "tri6"), **numbered)


# ------------------------------------------------------------------ what is no plane region

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0], [2, 1, 0], [0.5, 0.2, 0]], dtype=float)
TWO = np.array([[0, 1, 2], [0, 2, 3]])


def lifted(node: int, by: tuple[float, float, float]) -> Any:
    points = SQUARE.copy()
    points[node] += by
    return points


FLAWS: dict[str, tuple[Any, list[tuple[str, Any]], str, str]] = {
    "tetrahedra": (lifted(3, (0, 0, 1)), [("tetra", np.array([[0, 1, 2, 3]]))], "E579", "solid cells (tetra)"),
    "solids beside": (lifted(6, (0, 0, 1)), [("triangle", TWO), ("tetra", np.array([[0, 1, 2, 6]]))], "E579", "tetra"),
    "off the plane": (lifted(2, (9, 0, 0.1)), [("triangle", TWO)], "E579",
                      "1 of its 4 nodes lie off the plane z = 0, the first is node 2 at (10, 1, 0.1) m"),
    "another plane": (SQUARE + np.array([0, 0, 1]), [("triangle", TWO)], "E579", "4 of its 4 nodes lie off the plane"),
    "several kinds": (SQUARE, [("triangle", TWO), ("quad", np.array([[1, 4, 5, 2]]))], "E579", "(quad, triangle)"),
    "edges alone": (SQUARE, [("line", np.array([[0, 1]]))], "E579", "no triangles and no quadrilaterals"),
    "turned over its neighbour": (lifted(3, (0.8, -0.6, 0)), [("triangle", TWO)], "E567",
                                  "lie on the same side of their common face"),
    "a bow tie": (SQUARE, [("quad", np.array([[0, 1, 3, 2]]))], "E564", "1 of its 1 quadrilaterals are flat"),
    "flat": (SQUARE, [("triangle", np.array([[0, 1, 2], [0, 1, 4]]))], "E564", "1 of its 2 triangles are flat"),
    "curled": (SQUARE[[0, 1, 3, 2, 2, 2]] * [[1], [1], [1], [.9], [.1], [.8]], [("triangle6", np.arange(6)[None])],
               "E564", "triangles are folded"),
    "twice": (SQUARE, [("triangle", TWO[[0, 1, 0]])], "E563", "2 of 3 triangles"),
    "cut apart": (SQUARE[[0, 1, 2, 3, 0, 2]], [("triangle", np.array([[0, 1, 2], [4, 5, 3]]))], "E565",
                  "2 pairs of its 6 nodes lie at the same position, the first are nodes 0 and 4"),
    "hung up by a node": (SQUARE[[0, 1, 2, 4, 5]], [("triangle", np.array([[0, 1, 2], [1, 3, 4]]))], "E568",
                          "such as node 1"),
    "islands": (SQUARE[[0, 1, 6, 4, 5, 2]], [("triangle", np.array([[0, 1, 2], [3, 4, 5]]))], "E566", "2 parts"),
}  # fmt: skip


@pytest.mark.parametrize("flaw", FLAWS)
def test_what_is_no_plane_region_is_refused_with_its_place(tmp_path: Path, flaw: str) -> None:
    points, cells, code, words = FLAWS[flaw]
    file = tmp_path / "flaw.vtu"
    meshio.Mesh(points, cells).write(file)
    shape = FileSlice(MeshFile(str(file), 1.0), 0.01)
    with pytest.raises(UnreadableMesh) as caught:
        shape.mesh_with_groups()
    assert words in str(caught.value)
    assert caught.value.code == code
    assert caught.value.remedy
    assert shape.bounds is None


@pytest.mark.parametrize("edge", ["wall", "tip"])
@pytest.mark.parametrize("element", KINDS)
def test_edges_go_with_cells_that_are_raised_lowered_and_refined(tmp_path: Path, element: str, edge: str) -> None:
    """Facets and nodes of a group are those at its coordinate, on every element of the family and on a finer mesh."""
    shape = FileSlice(MeshFile(sheet(tmp_path / "sheet.4.msh", element), 1.0), 0.002)
    at, family = {"wall": 0.01, "tip": 0.05}[edge], element[:3]
    for kind in (k for k in KINDS if k.startswith(family)):
        mesh = shape.mesh_with_groups(kind)
        for own in (mesh, build_finer_space(mesh).mesh):
            assert own.volumes.sum() == pytest.approx(SHEET.area * 0.002, rel=1e-12)
            on = np.abs(own.points[:, 0] - at) < 1e-9
            np.testing.assert_array_equal(mesh_groups.facets_in(own, edge), on[own.facets].all(axis=1))
            np.testing.assert_array_equal(mesh_groups.nodes_in(own, edge), on)
            right = own.points[own.cells].mean(axis=1)[:, 0] > 0.03
            np.testing.assert_array_equal(mesh_groups.cells_in(own, "hard"), right)
    tetrahedra = shape.mesh_with_groups("tet4")
    assert tetrahedra.volumes.min() > 0.0
    assert tetrahedra.volumes.sum() == pytest.approx(SHEET.area * 0.002, rel=1e-12)
    whole = shape.mesh_with_groups()  # three tetrahedra stand on a triangle; two triangles of the surface on an edge
    standing = len(whole.facets) - 2 * len(whole.cells)
    assert len(tetrahedra.facets) == 2 * (len(tetrahedra.cells) // 3) + 2 * standing


def test_cells_of_no_element_are_named(tmp_path: Path) -> None:
    file, ten = tmp_path / "cubic.msh", np.arange(10)[None]
    points = np.array([[0, 0, 0], [3, 0, 0], [0, 3, 0], [1, 0, 0], [2, 0, 0], [2, 1, 0], [1, 2, 0], [0, 2, 0],
                       [0, 1, 0], [1, 1, 0]], dtype=float)  # fmt: skip
    meshio.write(file, meshio.Mesh(points, [("triangle10", ten)]), "gmsh22", binary=False)
    with pytest.raises(UnreadableMesh, match=r"there is no element for its cells \(triangle10\)"):
        FileSlice(MeshFile(str(file), 1.0), 1.0).mesh_with_groups()


def test_the_other_family_is_refused(tmp_path: Path) -> None:
    shape = FileSlice(MeshFile(sheet(tmp_path / "sheet.msh", "tri3"), 1.0), 0.002)
    with pytest.raises(UnreadableMesh, match="it has triangles, but the model needs quadrilaterals"):
        shape.mesh("quad9")


def test_a_curved_side_stays_where_the_file_has_it(tmp_path: Path) -> None:
    """A quarter of a ring by its own cells: nodes of the file and of the shape are the same, middles and all."""
    ring = QuarterRing(inner=0.01, outer=0.02)
    shape = FileSlice(MeshFile(sheet(tmp_path / "ring.vtu", "quad9", ring), 1.0), ring.depth)
    places = [{tuple(x) for x in np.round(mesh.points, 12).tolist()} for mesh in (shape.mesh("quad9"),
                                                                               ring.mesh("quad9", SIZE))]  # fmt: skip
    assert places[0] == places[1]


@pytest.mark.long
@pytest.mark.slow
def test_shapes_load_nothing_of_plane_files(tmp_path: Path) -> None:
    """Neither plane bodies of shapes nor solids of files know of it; a plane body of a file does."""
    of_file, of_shape, _ = texts("plane_strain", "tri3", "small", sheet(tmp_path / "sheet.msh", "tri3"))
    known = {"solvers.mesh.plane_region_files", "solvers.mesh.files.plane_cells"}
    assert not known & loaded_by(of_shape)
    assert known <= loaded_by(of_file)


def test_a_region_of_a_file_is_apart_from_another(tmp_path: Path) -> None:
    """It is meshed by its own cells, beside those of a size: a sheet and its twin above it have twice its volume."""
    region = MeshFile(sheet(tmp_path / "sheet.msh", "quad4"), 1.0)
    twin = Quadrilateral(*((x, y + 0.04, z) for x, y, z in (SHEET.first, SHEET.second, SHEET.third, SHEET.fourth)))
    for pair in (DisjointShapes(twin, region), DisjointShapes(region, twin)):
        assert not pair.fault
        assert pair.flat
        np.testing.assert_allclose(pair.ends, [(0.01, 0.0), (0.05, 0.07)], atol=1e-12)
        made = pair.slice(0.002).mesh("quad4", SIZE)
        one = SHEET.slice(0.002).mesh("quad4", SIZE)
        assert len(made.cells) == 2 * len(one.cells)
        assert made.volumes.sum() == pytest.approx(2.0 * one.volumes.sum(), rel=1e-9)
    with pytest.raises(UnreadableMesh, match="overlap"):
        DisjointShapes(region, SHEET).slice(0.002).mesh("quad4", SIZE)
