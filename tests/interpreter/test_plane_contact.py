"""Contacts of slices: a plane problem is the same whatever thickness its forces are told of."""

from __future__ import annotations

import pytest

from softmark import loads

HEAD = """softmark 1
material gel = neo_hookean(young = 10 kPa, poisson = {nu}, density = 1000 kg/m^3)
body block = plane_strain({region}, gel, thickness = {thickness} mm)
support floor = fixed(block, where = y <= 0 mm)
"""
SQUARE = "quadrilateral((0, 0, 0) mm, (20, 0, 0) mm, (20, 20, 0) mm, (0, 20, 0) mm)"
ROLL = """
body roll = rigid(cylinder(radius = 8 mm, length = 20 mm, axis = +z, origin = (10, 28, -10) mm))
support hand = displaced(roll, by = (0, -1, 0) mm)
contact touch = rigid_contact(roll, block{more})
model quads = fem(quad4, strain = finite, size = 2 mm)
metric push = force(touch, along = -y)
metric area = contact_area(touch)
metric left = gap(touch)
"""
PIECES = (
    "disjoint(quadrilateral((0, 0, 0) mm, (10, 0, 0) mm, (10, 10, 0) mm, (0, 10, 0) mm),"
    " quadrilateral((0, {low}, 0) mm, (10, {low}, 0) mm, (10, 20, 0) mm, (0, 20, 0) mm))"
)
PRESSED = """
support lid = displaced(block, where = y >= 20 mm, by = (0, -1, 0) mm)
contact touch = {contact}
model quads = fem(quad4, strain = {strain}, size = 2.5 mm)
metric push = force(lid, along = -y)
"""


def values(text: str) -> dict[str, float]:
    """Every metric of its one model."""
    model = loads(text).run().models["quads"]
    assert model.status == "converged", model.message
    return {name: float(metric.value or 0.0) for name, metric in model.metrics.items()}


def pressed(thickness: float) -> dict[str, float]:
    """A roller on a block."""
    return values(HEAD.format(region=SQUARE, thickness=thickness, nu=0.3) + ROLL.format(more=""))


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("thickness", [10.0, 1000.0])
def test_a_roller_on_a_slice(thickness: float) -> None:
    """Force and area are in proportion to the thickness, and the gap is what it is of 1 mm.

    Sides of triangles that go through a slice took the border of the contact along: of 10 mm the area was 17 % larger
    than of 1 mm, and of 1 m, 39 %; a barrier a hundred-thousandth of that thick held the roller 6 um off.
    """
    one, many = pressed(1.0), pressed(thickness)
    assert many["push"] == pytest.approx(thickness * one["push"], rel=1e-6)
    assert many["area"] == pytest.approx(thickness * one["area"], rel=1e-6)
    assert many["left"] == pytest.approx(one["left"], rel=1e-3)


def test_the_area_under_a_roller() -> None:
    """Cells of 2 mm against 44.5 mm^2, on which meshes of 0.5 and 0.25 mm and of quad8 agree within 1 %."""
    assert pressed(10.0)["area"] == pytest.approx(44.5e-6, rel=0.03)


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize(
    ("contact", "strain", "low"),
    [("self_contact(block, where = y >= 5 mm and y <= 15 mm)", "finite", 10.5), ("tied(block)", "small", 10.0)],
)
def test_pieces_of_a_slice(contact: str, strain: str, low: float) -> None:
    """Of 1 m a barrier as thick as the gap pressed 1.8 times as hard as of 1 mm, and a joint gave way by 0.5 %."""
    text = HEAD.replace("{region}", PIECES.format(low=low)) + PRESSED.format(contact=contact, strain=strain)
    one, many = (values(text.format(thickness=t, nu=0.0))["push"] for t in (1.0, 1000.0))
    assert many == pytest.approx(1000.0 * one, rel=1e-6)


def test_what_presses_beside_a_selection_is_looked_at_too() -> None:
    """Half of a roller presses, and the other half lies 0.36 mm deep in what the contact leaves out."""
    text = HEAD.format(region=SQUARE, thickness=10, nu=0.3) + ROLL.format(more=", where = y >= 20 mm and x <= 10 mm")
    found = loads(text).run().models["quads"]
    assert found.status == "failed"
    assert "`roll` penetrates by 0.36 mm where the contact `touch` does not act" in str(found.message)
