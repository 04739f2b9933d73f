"""What is in the matter of a body: from its surface in space, from its section in the plane."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from softmark.interpreter.verification.contact_forces_check import _shape_distance
from softmark.solvers.contact.signed_distance import gap_of
from softmark.solvers.independent_forces import point_in_deformed_body
from softmark.solvers.mesh.extruded_shapes import Extruded
from softmark.solvers.mesh.rigid_shapes import Punch
from softmark.solvers.mesh.shapes import Box
from softmark.solvers.mesh.spheres import SphericalShell
from softmark.solvers.mesh.tubes import Tube

BLOCK = Box((2.0, 3.0, 1.0), (0.0, 0.0, 0.0))
SQUARE = np.array([[(0, 0), (2, 0), (2, 3)], [(0, 0), (2, 3), (0, 3)]], dtype=float)  # two triangles of 2 by 3

RIGID: dict[str, Any] = {
    "shell": SphericalShell(1.0, 0.9, (0.1, 0.2, 0.3)),
    "ring": Tube(length=0.1, radius=0.8, inner=0.7, axis=(0.0, 1.0, 0.0)),
    "tube that leans": Tube(length=1.0, radius=0.8, inner=0.4, axis=(0.6, 0.0, 0.8)),
    "punch": Punch(0.6, 0.1, 1.0, (0.0, 1.0, 0.0)),
    "angle": Extruded(((0.0, 0.0), (1.0, 0.0), (1.0, 0.1), (0.1, 0.1), (0.1, 1.0), (0.0, 1.0)), 0.7, "z", -0.3),
}


@pytest.mark.parametrize(
    ("place", "inside"),
    [
        ((1.0, 1.3, 0.4), True),
        ((1.0, 1.3, 1.1), False),
        ((-0.1, 1.3, 0.4), False),
        ((0.0, 1.3, 0.4), True),  # on a plane of symmetry: half of all is seen
        ((0.0, 0.0, 0.4), True),  # on two: a quarter
        ((0.0, 0.0, 0.0), True),  # on three: an eighth
        ((0.0, -1.0, 0.4), False),  # in the plane of a side, beside it
        ((0.0, 0.0, -0.2), False),  # in line with an edge
        ((0.0, 1e-13, 0.4), True),  # as what is on a plane is, in the digits that there are
        ((0.0, -1e-13, 0.4), True),
    ],
)
def test_a_point_is_in_a_box_or_not(place: tuple[float, float, float], inside: bool) -> None:
    points, triangles = BLOCK.surface(0.7)
    assert point_in_deformed_body.is_inside_volume(np.array(place), points[triangles]) is inside


def test_what_is_in_a_hollow_is_not_in_the_matter_around_it() -> None:
    points, triangles = SphericalShell(1.0, 0.5).surface(0.2)
    found = [
        point_in_deformed_body.is_inside_volume(np.array([r, 0.03, 0.02]), points[triangles]) for r in (0.1, 0.7, 1.2)
    ]
    assert found == [False, True, False]


@pytest.mark.parametrize("turn", [1, -1])
@pytest.mark.parametrize(
    ("place", "inside"),
    [
        ((1.0, 1.3), True),
        ((1.0, 1.5), True),  # on the side that both have
        ((2.1, 1.3), False),
        ((0.0, 1.3), True),  # on the axis, or a plane of symmetry
        ((0.0, 0.0), True),  # where two meet
        ((0.0, 3.4), False),  # on the axis, above it
        ((-0.1, 1.3), False),
        ((1e-13, 1.3), True),
        ((-1e-13, 1.3), True),
    ],
)
def test_a_point_is_in_a_section_or_not(place: tuple[float, float], inside: bool, turn: int) -> None:
    """Of either orientation: the face of a slice that is looked at has the one or the other."""
    assert point_in_deformed_body.is_inside_region(np.array(place), SQUARE[:, ::turn]) is inside


def test_what_is_between_the_parts_of_a_section_is_not_in_it() -> None:
    two = np.concatenate([SQUARE, SQUARE + np.array([3.0, 0.0])])
    assert [point_in_deformed_body.is_inside_region(np.array([x, 1.0]), two) for x in (1.0, 2.5, 4.0)] == [
        True,
        False,
        True,
    ]


@pytest.mark.parametrize("plane", [False, True])
@pytest.mark.parametrize("name", RIGID)
def test_places_on_a_rigid_body_are_on_it(name: str, plane: bool) -> None:
    """By the distance that solves: to rounding, and to 1e-3 of its size where a plane cuts it aslant; on all sides."""
    shape = RIGID[name]
    low, high = map(np.array, shape.bounds)
    places, gap = point_in_deformed_body.sample_surface(_shape_distance(shape), low, high, plane), gap_of(shape)
    assert gap is not None
    aslant = plane and name in ("shell", "tube that leans")  # the shell has its middle beside the plane
    assert np.abs(gap.gap(places)).max() <= (1e-3 * np.linalg.norm(high - low) if aslant else 1e-12)
    assert len(places) >= (8 if plane else 60)
    assert np.all(np.ptp(places, axis=0)[:2] > 0.3 * (high - low)[:2])  # aslant a section is narrower
    assert not (plane and places[:, 2].any())
