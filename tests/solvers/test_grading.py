"""Meshes that are finer somewhere: lines of grids, whose cells, counts and refinements go together."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from softmark.interpreter.language.coordinate_conditions import Condition, Term
from softmark.interpreter.problem.conforming_mesh import graded_cuts
from softmark.solvers.mesh.conforming_planes import Cut, grid_lines
from softmark.solvers.mesh.extruded_shapes import Extruded
from softmark.solvers.mesh.mesh import jacobians
from softmark.solvers.mesh.revolved_bodies import Cone
from softmark.solvers.mesh.shape import Shape
from softmark.solvers.mesh.shapes import Box, Cylinder, Sphere
from softmark.solvers.mesh.spheres import SphericalShell
from softmark.solvers.mesh.tubes import Tube

CLAMP = Cut("x", 0.0, finer=4.0, reach=40.0)


def test_cells_are_so_many_times_shorter_there_and_grow_evenly() -> None:
    """Next to the place a cell of size / 4, and each is as much longer as its middle is farther away: h = s + k d, with
    k = 3/4 of the size over the reach. Beyond the reach all have the size, but for what makes their number whole."""
    found = grid_lines(0.0, 80.0, 160, [CLAMP]) or []
    sizes = [b - a for a, b in pairwise(found)]
    due = [0.125 + 0.375 * min(1.0, 0.5 * (a + b) / 40.0) for a, b in pairwise(found)]
    assert max(abs(own / size - 1.0) for own, size in zip(sizes, due, strict=True)) < 0.02
    assert sizes[-1] == pytest.approx(0.5, rel=0.01)


def test_half_the_size_is_graded_alike() -> None:
    """Every other line of the finer grid is one of the coarser: of 14 and 28 cells, as numbers are rounded alike."""
    coarse, fine = (grid_lines(0.0, 80.0, n, [CLAMP]) or [] for n in (10, 20))
    assert (len(coarse), len(fine)) == (15, 29)
    np.testing.assert_allclose(fine[::2], coarse, rtol=1e-9)


def test_a_graded_place_within_and_a_cut_have_lines() -> None:
    found = grid_lines(0.0, 80.0, 10, [Cut("x", 33.0, finer=4.0, reach=40.0), Cut("x", 10.0)]) or []
    assert {10.0, 33.0} <= set(found)
    assert all(b > a for a, b in pairwise(found))


def border(kind: str, at: float) -> Condition:
    if kind in "xyz":
        return Condition.comparison("<=", Term.coordinate("xyz".index(kind)), Term.constant(at), 1)
    square = Term.constant(0.0)
    for i in range(3 if kind == "ball" else 2):
        square = square.combine("+", Term.coordinate(i).combine("*", Term.coordinate(i)))
    return Condition.comparison("<=", square, Term.constant(at**2), 2)


ANGLE = ((0.0, 0.0), (0.03, 0.0), (0.03, 0.01), (0.01, 0.01), (0.01, 0.02), (0.0, 0.02))
ALONG_Z: dict[str, Any] = {"axis": (0.0, 0.0, 1.0)}
GRADED: dict[str, tuple[Shape, Condition]] = {
    "box": (Box((0.03, 0.02, 0.02)), border("y", 0.0)),
    "box, within": (Box((0.03, 0.02, 0.02)), border("x", 0.011)),
    "cylinder": (Cylinder(0.03, 0.01, **ALONG_Z), border("z", 0.03)),
    "cone": (Cone(0.03, 0.01, 0.005, **ALONG_Z), border("z", 0.0)),
    "tip": (Cone(0.03, 0.01, **ALONG_Z), border("z", 0.0)),
    "bore": (Tube(0.03, 0.02, 0.005, **ALONG_Z), border("circle", 0.005)),
    "shell": (SphericalShell(0.02, 0.005, part="octant"), border("ball", 0.005)),
    "angle": (Extruded(ANGLE, 0.01), border("x", 0.01)),
}  # fmt: skip


@pytest.mark.parametrize("name", GRADED)
def test_shapes_are_finer_where_a_border_lies(name: str) -> None:
    """More cells, all sound, the least about half as large as before, where a cone is not thinner anyway; the count
    that is told is that of the mesh."""
    shape, where = GRADED[name]
    cuts = graded_cuts(where, shape, 4.0)
    assert len(cuts) == 1
    plain, mesh = shape.mesh("hex8", 0.005), shape.mesh("hex8", 0.005, cuts)
    assert len(mesh.cells) > len(plain.cells)
    assert jacobians(mesh, mesh.element.places()).min() > 0.0
    if name not in ("cone", "tip", "angle"):
        finest, usual = (m.volumes.min() for m in (mesh, plain))
        assert finest < 0.55 * usual
    counts = [shape.counts(0.005, own) for own in ((), cuts)]
    if name in ("box", "box, within", "bore"):
        assert math.prod(counts[1] or ()) == len(mesh.cells)


@pytest.mark.parametrize(("shape", "where"), [
    (Sphere(0.01), border("ball", 0.005)), (Box((0.03, 0.02, 0.02)), border("circle", 0.01)),
    (Cylinder(0.03, 0.01, **ALONG_Z), border("x", 0.0)), (Box((0.03, 0.02, 0.02)), border("x", 0.05)),
])  # fmt: skip
def test_what_a_mesh_cannot_follow_grades_nothing(shape: Shape, where: Condition) -> None:
    """A ball in a ball has no layers of its own, nor a box circles; a plane outside is nowhere."""
    assert graded_cuts(where, shape, 4.0) == ()
