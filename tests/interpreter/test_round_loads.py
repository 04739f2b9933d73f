"""Loads on curved surfaces act on the true surface, and on nothing beside it."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from softmark.interpreter.language.coordinate_conditions import Condition, Term
from softmark.interpreter.problem.surface_selection.exact_surface import select_surface
from softmark.interpreter.problem.surface_selection.loaded_surface_part import find_loaded_surface
from softmark.solvers.mesh.shape import Shape
from softmark.solvers.mesh.spheres import Ellipsoid, Sphere, SphericalShell
from softmark.solvers.mesh.tubes import Tube

Z = Term.coordinate(2)
ALL = Condition.comparison("<=", Z, Term.constant(9.0), 1)


def within(radius: float, axes: str) -> Condition:
    """No farther than a radius (m) from the origin, by these axes."""
    squares = [Term.coordinate("xyz".index(a)).combine("*", Term.coordinate("xyz".index(a))) for a in axes]
    square = squares[0]
    for other in squares[1:]:
        square = square.combine("+", other)
    return Condition.comparison("<=", square, Term.constant(radius**2), 2)


@pytest.mark.slow
def test_areas_of_true_surfaces() -> None:
    """A ball, a zone of it (Archimedes: 2 pi R h), a shell's octant, a tube; a spheroid by its closed form."""
    assert select_surface(Sphere(0.01), ALL)[0] == pytest.approx(4e-4 * math.pi, rel=1e-12)
    cap = Condition.comparison(">=", Z, Term.constant(0.0063), 1)
    area, vector = select_surface(Sphere(0.01), cap)
    assert area == pytest.approx(2 * math.pi * 0.01 * 0.0037, rel=1e-10)
    assert vector == pytest.approx([0.0, 0.0, math.pi * (0.01**2 - 0.0063**2)], abs=1e-14)
    shell = SphericalShell(0.02, 0.01, part="octant")
    assert select_surface(shell, ALL)[0] == pytest.approx(math.pi / 2 * 5e-4 + 0.75 * math.pi * 3e-4, rel=1e-12)
    area, vector = select_surface(shell, within(0.01, "xyz"))
    assert area == pytest.approx(math.pi / 2 * 1e-4, rel=1e-12)
    assert vector == pytest.approx(np.full(3, -math.pi / 4 * 1e-4), rel=1e-12), "outward is towards the centre"
    tube = Tube(0.1, 0.01, 0.006)
    assert select_surface(tube, ALL)[0] == pytest.approx(2 * math.pi * (0.1 * 0.016 + 64e-6), rel=1e-12)
    assert select_surface(tube, within(0.006, "yz"))[0] == pytest.approx(2 * math.pi * 0.0006, rel=1e-12)
    a, c = 0.01, 0.02  # prolate: 2 pi a^2 (1 + c / (a e) asin e)
    e = math.sqrt(1.0 - (a / c) ** 2)
    whole = 2 * math.pi * a * a * (1.0 + c / (a * e) * math.asin(e))
    assert select_surface(Ellipsoid((a, a, c)), ALL)[0] == pytest.approx(whole, rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("shape", "where"),
    [
        (Tube(0.02, 0.01, 0.006), within(0.006, "yz")),
        (SphericalShell(0.01, 0.006, part="octant"), within(0.006, "xyz")),
    ],
)
@pytest.mark.parametrize(("kind", "order"), [("tet4", 2), ("hex8", 2), ("tet10", 4), ("hex20", 4)])
def test_a_hollow_is_selected_without_slivers(shape: Shape, where: Condition, kind: str, order: int) -> None:
    """Between an arc and its chord lies no body: the ends of a tube are no part of its hollow's side.

    Nothing is left open, and the area comes to the true one from below, with the order of the facets.
    """
    exact, missing = select_surface(shape, where), []
    assert exact is not None
    for size in (0.004, 0.002):  # which halve the cells around
        found = find_loaded_surface(shape, shape.mesh(kind, size), where)
        assert found.remainder == 0.0
        assert found.leaning == 0.0
        assert len(found.nodes) == 0, "facets are selected whole or not at all"
        missing.append(1.0 - found.area / exact[0])
    assert abs(missing[1]) < abs(missing[0]) / 2 ** (order - 0.8)
    assert order > 2 or missing[1] > 0.0


@pytest.mark.slow
def test_meshes_that_lose_volume_say_so(tmp_path: Path) -> None:
    """W305 of a coarse ball of linear elements, and of none of curved ones."""
    import softmark

    report = softmark.loads("""
material gel = neo_hookean(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
body ball = solid(sphere(radius = 10 mm, part = octant), gel)
support x0 = symmetric(ball, where = x <= 0 mm)
support y0 = symmetric(ball, where = y <= 0 mm)
support z0 = symmetric(ball, where = z <= 0 mm)
load push = pressure(ball, where = x^2 + y^2 + z^2 >= (10 mm)^2, magnitude = 100 Pa)
model flat = fem(hex8, strain = small, size = 8 mm)
model curved = fem(hex20, strain = small, size = 8 mm)
probe skin = point(ball, at = (0, 0, 10) mm)
metric closer = displacement(skin, along = -z)
""").run()
    assert sum(w.code == "W305" for w in report.warnings) == 1
    # all round pressure p: u = p R (1 - 2 nu) / E of any mesh of a ball, to the shape of its facets
    assert report.models["curved"].metrics["closer"].value == pytest.approx(100 * 0.01 * 0.4 / 60e3, rel=0.01)


def test_a_tube_is_drawn_closed_and_cut_by_its_axis() -> None:
    """The picture's skin is closed and outward, a polygon's share of the volume; half a ring lies below its middle."""
    from softmark.interpreter.problem.surface_selection.section_selection import selected_share
    from softmark.solvers.mesh.shape_surfaces import triangulate_swept

    tube = Tube(0.1, 0.01, 0.006)
    X, triangles = triangulate_swept(tube, 128, 4)
    a, b, c = (X[triangles[:, i]] for i in range(3))
    volume = float(np.einsum("ti,ti->", a, np.cross(b, c))) / 6.0
    turn = 2.0 * math.pi / 128
    assert volume == pytest.approx(tube.volume * math.sin(turn) / turn, rel=1e-12)
    sides = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    assert set(np.unique(sides, axis=0, return_counts=True)[1].tolist()) == {2}
    assert selected_share(Condition.comparison("<=", Z, Term.constant(0.0), 1), tube, 0.05) == pytest.approx(
        0.5, rel=1e-12
    )
