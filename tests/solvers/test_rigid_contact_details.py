"""Distances to rigid bodies by formulas that share nothing with those that solve: the two agree outside."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from softmark.interpreter.verification.contact_forces_check import DISTANCES, _shape_distance
from softmark.solvers.contact.barrier_law import Barrier
from softmark.solvers.contact.rigid_contact import node_areas
from softmark.solvers.contact.rigid_transform import MovedGap, RigidMotion
from softmark.solvers.contact.signed_distance import GAPS, gap_of
from softmark.solvers.independent_forces import rigid_contact_forces
from softmark.solvers.mesh.extruded_shapes import Extruded
from softmark.solvers.mesh.revolved_bodies import Cone, Revolved
from softmark.solvers.mesh.rigid_shapes import HalfSpace, Punch, RoundedBox, RoundedCone
from softmark.solvers.mesh.shape import Shape
from softmark.solvers.mesh.shapes import SHAPES as WORDS
from softmark.solvers.mesh.shapes import Box, Cylinder
from softmark.solvers.mesh.spheres import Sphere, SphericalShell
from softmark.solvers.mesh.tubes import Tube

AXIS = (0.6, 0.0, 0.8)
SHAPES: dict[str, Any] = {
    "half space": HalfSpace((0.1, 0.2, 0.3), AXIS),
    "sphere": Sphere(1.0, (0.1, 0.2, 0.3)),
    "shell": SphericalShell(1.0, 0.4, (0.1, 0.2, 0.3)),
    "box": Box((1.0, 2.0, 0.5), (-0.5, -1.0, 0.0)),
    "rounded box": RoundedBox((1.0, 2.0, 0.5), 0.1, (-0.5, -1.0, 0.0)),
    "cylinder": Cylinder(1.0, 0.5, AXIS, (0.1, 0.0, -0.2)),
    "tube": Tube(length=1.0, radius=0.8, inner=0.4, axis=AXIS),
    "cone": Cone(1.0, 0.8, 0.2, AXIS),
    "sharp cone": Cone(1.0, 0.8, 0.0, AXIS),
    "revolved": Revolved(((0.0, 0.0), (0.5, 0.2), (1.0, 0.0), (0.8, 1.0), (0.0, 0.7)), AXIS),
    "punch": Punch(0.6, 0.1, 1.0, AXIS),
    "tip": RoundedCone(1.2, 0.1, 1.0, AXIS),
    "extruded": Extruded(((0.0, 0.0), (1.0, 0.0), (1.0, 0.4), (0.4, 0.4), (0.4, 1.0), (0.0, 1.0)), 0.7, "y", -0.3),
}


def around(shape: Any, n: int = 400) -> Any:
    """Points around it, and some on axes of symmetry."""
    rng = np.random.default_rng(5)
    x = rng.uniform(-1.6, 1.6, (n, 3))
    on_axis = np.array(getattr(shape, "origin", (0.0, 0.0, 0.0))) + np.outer(np.linspace(-1.3, 1.9, 9), AXIS)
    return np.concatenate([x, on_axis])


@pytest.mark.parametrize("name", SHAPES)
def test_distances_and_ways_out_agree_outside(name: str) -> None:
    """To rounding: both are exact. Inside the two agree that it is inside, which is all that is asked there."""
    x, gap = around(SHAPES[name]), gap_of(SHAPES[name])
    assert gap is not None
    g, n = _shape_distance(SHAPES[name])(x)
    mine, normal, _ = gap.look(x)
    out = mine > 1e-6
    assert out.sum() > 50
    assert g[out] == pytest.approx(mine[out], abs=1e-13)
    out[-9:] = False  # on an axis a hollow is as far all around
    assert n[out] == pytest.approx(normal[out], abs=1e-8)
    assert np.all((g < 0.0) == (mine < 0.0))


def test_a_closed_surface_is_seen_from_all_sides() -> None:
    """A box as twelve triangles: the distance of the box, inside and outside."""
    shape = Box((1.0, 2.0, 0.5), (-0.5, -1.0, 0.0))
    points, triangles = shape.surface(5.0)
    x = around(shape)
    g, n = rigid_contact_forces.closed_surface_distance(points, triangles)(x)
    mine, way = rigid_contact_forces.box_distance((-0.5, -1.0, 0.0), (0.5, 1.0, 0.5))(x)
    assert g == pytest.approx(mine, abs=1e-13)
    assert n[mine > 0.0] == pytest.approx(way[mine > 0.0], abs=1e-10)


def test_a_motion_by_quaternions_is_that_of_rodrigues() -> None:
    """Of a box turned by 200 degrees about a skew axis through a point, and shifted."""
    shape, w = SHAPES["box"], 3.5 * np.array([0.36, 0.48, 0.8])
    x, shift, about = around(shape), (0.2, -0.1, 0.4), (0.3, 0.1, 0.2)
    gap = gap_of(shape)
    assert gap is not None
    mine, normal, _ = MovedGap(gap, RigidMotion(shift, tuple(w.tolist()), about)).look(x)
    g, n = rigid_contact_forces.moved_distance(_shape_distance(shape), np.array(shift), w, np.array(about))(x)
    out = mine > 1e-6
    assert g[out] == pytest.approx(mine[out], abs=1e-13)
    assert n[out] == pytest.approx(normal[out], abs=1e-9)


def test_the_law_of_the_gap_is_written_again() -> None:
    """Both forms of k s^2 / (1 - s), beyond the bend too, and their slopes."""
    law, g = Barrier(1e-3, 5e3), np.linspace(-1e-3, 2e-3, 301)
    p, slope = rigid_contact_forces.barrier_pressure(g, law.distance, law.stiffness, law.bend)
    assert p == pytest.approx(law.pressure(g), rel=1e-12, abs=1e-9)
    assert slope == pytest.approx(law.energy_second_derivative(g), rel=1e-12, abs=1e-6)


@pytest.mark.parametrize("depth", [0.0, 0.1])
def test_areas_of_nodes_are_those_of_linear_shape_functions(depth: float) -> None:
    points, triangles = Cylinder(1.0, 0.5, (0.0, 1.0, 0.0)).surface(0.4)
    nodes, areas = node_areas(np.abs(points), triangles, ((0, 1, 2),), depth)
    again = rigid_contact_forces.nodal_areas(np.abs(points), triangles, depth)
    assert again[nodes] == pytest.approx(areas, rel=1e-11)


def test_every_shape_with_a_gap_is_one_that_a_scene_may_have_and_that_is_found_again() -> None:
    """A shape knows it without numerics; one table solves, and another one finds the distance again."""
    known = {cls for cls in WORDS.values() if cls.has_signed_distance is not Shape.has_signed_distance}
    for table in (GAPS, DISTANCES):
        assert {cls for cls in WORDS.values() if issubclass(cls, tuple(table))} == known
    tried = {type(shape) for shape in SHAPES.values()}
    assert {name for name, cls in WORDS.items() if not (cls.meshed or cls in tried)} == set(), "add them to SHAPES"
