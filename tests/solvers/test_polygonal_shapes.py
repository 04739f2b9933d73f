"""Cones, extruded polygons and bodies of revolution: exact volumes and areas, sound cells, and their surfaces."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from softmark.interpreter.language.coordinate_conditions import Condition, Term
from softmark.interpreter.problem.surface_selection.exact_surface import select_surface
from softmark.solvers.elements import UnknownElement, element_of
from softmark.solvers.mesh import polygons
from softmark.solvers.mesh.conforming_planes import Cut
from softmark.solvers.mesh.extruded_shapes import Extruded
from softmark.solvers.mesh.mesh import jacobians
from softmark.solvers.mesh.mesh_distortion import cell_qualities
from softmark.solvers.mesh.mesh_refinement import build_finer_space
from softmark.solvers.mesh.quadrilateral_meshing import mesh_polygon
from softmark.solvers.mesh.revolved_bodies import Cone, Revolution, Revolved
from softmark.solvers.mesh.shape import Shape

SIZE = 0.005
PLACED: dict[str, Any] = {"axis": (0.0, 0.6, 0.8), "origin": (1.0, 2.0, 3.0)}


def mm(*corners: tuple[float, float]) -> polygons.Corners:
    return tuple((1e-3 * a, 1e-3 * b) for a, b in corners)


ANGLE = mm((0, 0), (40, 0), (40, 10), (10, 10), (10, 30), (0, 30))
POLAR = [(0.02 - 0.012 * (i % 2), math.pi * i / 5) for i in range(10)]
STAR = tuple((r * math.cos(t), r * math.sin(t)) for r, t in POLAR)
FLAT_SIDED: dict[str, Extruded] = {
    "angle": Extruded(ANGLE, 0.01, "x", 0.5),
    "angle, clockwise": Extruded(ANGLE[::-1], 0.01),
    "star": Extruded(STAR, 0.01, "y"),
    "triangle": Extruded(mm((0, 0), (40, 0), (0, 30)), 0.01),
    "quadrilateral": Extruded(mm((0, 0), (30, 0), (20, 20), (0, 10)), 0.01),
}
TURNED: dict[str, Revolution] = {
    "cone": Cone(0.03, 0.02, 0.01, **PLACED),
    "tip": Cone(0.03, 0.015, axis=(0.0, 0.0, 1.0)),
    "tube": Revolved(mm((10, 0), (20, 0), (14, 15), (20, 30), (10, 30)), **PLACED),
    "shaft": Revolved(mm((0, 0), (20, 0), (20, 10), (12, 20), (12, 30), (0, 30))[::-1]),
    "top": Revolved(mm((0, 0), (12, 20), (0, 30)), **PLACED),
    "hollow": Revolved(mm((0, 0), (20, 0), (20, 30), (0, 30), (0, 20), (8, 15), (0, 10))),
}
VOLUMES = {  # mm^3: pi h (R^2 + R r + r^2) / 3 of a frustum, added and taken away
    "cone": math.pi * 30 * 700 / 3, "tip": math.pi * 30 * 225 / 3,
    "tube": 2 * math.pi * 15 * (400 + 280 + 196) / 3 - math.pi * 3000,
    "shaft": math.pi * (4000 + 10 * (400 + 240 + 144) / 3 + 1440), "top": math.pi * 30 * 144 / 3,
    "hollow": math.pi * 12000 - math.pi * 10 * 64 / 3,
}  # fmt: skip
AREAS = {  # mm^2: pi (R + r) s of a frustum's side
    "cone": math.pi * (500 + 30 * math.hypot(10, 30)), "tip": math.pi * (225 + 15 * math.hypot(15, 30)),
    "tube": math.pi * (2 * 34 * math.hypot(6, 15) + 600 + 600),
    "shaft": math.pi * (400 + 400 + 32 * math.hypot(8, 10) + 240 + 144),
    "top": math.pi * 12 * (math.hypot(12, 20) + math.hypot(12, 10)),
    "hollow": math.pi * (800 + 1200 + 16 * math.hypot(8, 5)),
}  # fmt: skip


def kinds(shape: Shape) -> tuple[str, ...]:
    return ("tet4", "tet10") if shape.no_hexahedra_reason else ("tet4", "tet10", "hex8", "hex27")


@pytest.mark.parametrize("name", FLAT_SIDED)
def test_flat_sided_bodies_have_their_volume_and_sound_cells(name: str) -> None:
    """To the last digits, for every element; area by the length around; quality above 0.25, as seen of any angle."""
    shape = FLAT_SIDED[name]
    for kind in kinds(shape):
        mesh = shape.mesh(kind, SIZE)
        assert float(mesh.volumes.sum()) == pytest.approx(shape.volume, rel=1e-12)
        assert jacobians(mesh, element_of(kind).places()).min() > 0.0
        assert len(np.unique(mesh.cells)) == len(mesh.points)
    assert cell_qualities(shape.mesh("tet4", SIZE)).min() > 0.25
    assert shape.skin == pytest.approx(_by_facets(shape.mesh("tet4", SIZE)), rel=1e-12)


def _by_facets(mesh: Any) -> float:
    a, b, c = (mesh.points[mesh.faces[:, i]] for i in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()) / 2.0


@pytest.mark.parametrize("name", TURNED)
def test_volume_and_area_by_formulas_of_frustums(name: str) -> None:
    assert TURNED[name].volume == pytest.approx(1e-9 * VOLUMES[name], rel=1e-12)
    assert TURNED[name].skin == pytest.approx(1e-6 * AREAS[name], rel=1e-12)


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("name", TURNED)
def test_turned_bodies_are_met_with_the_order_of_the_facets(name: str) -> None:
    """Facets are inscribed: flat ones miss h^2 of the volume, quadratic ones h^4, and so do finer spaces. Of the latter
    the tip costs a power, for there facets span a quarter of a turn however small they are. A hollow's facets miss as
    much the other way, so that the sum may pass through zero."""
    shape = TURNED[name]
    size = math.pi * shape.largest_radius / 8.0  # two cells along an eighth of a turn, and then four
    for kind in kinds(shape):
        coarse, fine = (shape.mesh(kind, h) for h in (size, size / 2.0))
        for mesh in (coarse, fine):
            assert jacobians(mesh, element_of(kind).places()).min() > 0.0
            assert len(np.unique(mesh.cells)) == len(mesh.points)
            apart = np.unique(np.round(mesh.points / (1e-6 * mesh.extent)), axis=0)
            assert len(apart) == len(mesh.points)
        missing = [abs(float(m.volumes.sum()) / shape.volume - 1.0) for m in (coarse, fine)]
        order = 1.7 if kind in ("tet4", "hex8") else 2.7
        assert math.log2(missing[0] / missing[1]) > order or missing[1] < 1e-5, (kind, missing)
        if kind == "tet4":
            assert abs(float(build_finer_space(fine, shape).mesh.volumes.sum()) / shape.volume - 1.0) < missing[1] / 3.4


@pytest.mark.parametrize("name", ["top", "hollow"])
def test_wedges_at_the_axis_are_no_hexahedra(name: str) -> None:
    with pytest.raises(UnknownElement):
        TURNED[name].mesh("hex8", SIZE)


def half(axis: int, sense: str, at: float) -> Condition:
    return Condition.comparison(sense, Term.coordinate(axis).combine("-", Term.constant(at)), Term.constant(0.0), 1)


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("name", [*TURNED, *FLAT_SIDED])
def test_the_whole_surface_is_closed_and_of_its_area(name: str) -> None:
    """The integral of the normal over a closed surface is zero; a plane of symmetry halves the area."""
    shape = {**TURNED, **FLAT_SIDED}[name]
    low = shape.bounds[0][0] - 1.0
    area, vector = select_surface(shape, half(0, ">=", low)) or (0.0, np.zeros(3))
    assert area == pytest.approx(shape.skin, rel=1e-9)
    assert np.abs(vector).max() < 1e-9 * area
    if name in ("cone", "tip"):
        middle = TURNED[name].origin[0]
        part, looks = select_surface(shape, half(0, ">=", middle)) or (0.0, np.zeros(3))
        assert part == pytest.approx(area / 2.0, rel=1e-8)
        section = polygons.signed_area(TURNED[name].outline)  # what closes the half is twice the section
        assert looks[0] == pytest.approx(2.0 * section, rel=1e-8)


@pytest.mark.slow
def test_a_band_of_a_cone_is_a_frustum() -> None:
    """Between two sections of a cone along x; and the same on a mesh, to what its facets miss."""
    cone = Cone(0.03, 0.02, 0.01)
    band = Condition.junction("and", half(0, ">=", 0.006), half(0, "<=", 0.021))
    area, vector = select_surface(cone, band) or (0.0, np.zeros(3))
    r, q = cone.at(0.006), cone.at(0.021)
    assert area == pytest.approx(math.pi * (r + q) * math.hypot(0.015, r - q), rel=1e-9)
    np.testing.assert_allclose(vector, [math.pi * (r**2 - q**2), 0.0, 0.0], atol=1e-9 * area)


def test_meshes_have_nodes_on_cuts() -> None:
    """Planes across a cone; lines of a grid in a section whose sides go along the axes, and layers along it."""
    cone = Cone(0.03, 0.02, 0.01, **PLACED)
    X = cone.mesh("hex8", SIZE, (Cut("along", 0.0117),)).points
    assert (np.abs((X - PLACED["origin"]) @ PLACED["axis"] - 0.0117) < 1e-12).sum() > 20
    X = FLAT_SIDED["angle"].mesh("hex8", SIZE, (Cut("x", 0.5033), Cut("y", 0.0171))).points
    assert (np.abs(X[:, 0] - 0.5033) < 1e-12).sum() > 10
    assert (np.abs(X[:, 1] - 0.0171) < 1e-12).sum() > 4


def test_cells_are_of_the_size() -> None:
    """Quadrilaterals of triangles cut in three have about the area of a square of the size; sides may be short."""
    square = polygons.orient_counterclockwise(
        mm(*((20 * math.cos(0.1 + t), 20 * math.sin(0.1 + t)) for t in np.linspace(0, 5.8, 7)))
    )
    section = mesh_polygon(square, 0.002)
    each = polygons.signed_area(square) / len(section.quads)
    assert 0.4 < math.sqrt(each) / 0.002 < 1.1


FAULTS = {
    "two": (mm((0, 0), (1, 0)), "three corners"),
    "a line": (mm((0, 0), (1, 0), (2, 0)), "on one line"),
    "a bow": (mm((0, 0), (1, 1), (1, 0), (0, 1)), "from corner 1 and from corner 3 intersect"),
    "a corner on a side": (mm((0, 0), (4, 0), (4, 4), (2, 0), (0, 4)), "intersect or touch"),
    "a spike": (mm((0, 0), (2, 0), (1, 0), (1, 1)), "from corner 1 and from corner 2"),
    "a corner twice": (mm((0, 0), (1, 0), (1, 1), (0, 0)), "do not repeat the first corner"),
    "many": (tuple((math.cos(i), float(i)) for i in range(501)), "501 corners"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_what_is_no_polygon_is_said(name: str) -> None:
    corners, said = FAULTS[name]
    assert said in polygons.polygon_fault(corners)
    assert said in Extruded(corners, 0.01).fault
