"""Contacts that only forces press, and rigid bodies that are thinner than their way."""

from __future__ import annotations

import pytest

import softmark

CUBE = """
material g = linear_elastic(young = {young}, poisson = 0.0, density = 1000 kg/m^3)
body b = solid(box(size = (100, 100, 100) mm), g)
body floor = rigid(half_space(origin = (0, 0, 0) mm, normal = +z))
contact c = rigid_contact(floor, b)
support sx = fixed(b, where = x <= 0 mm, components = x)
support sy = fixed(b, where = y <= 0 mm, components = y)
load t = {load}
model m = fem(hex8, strain = small, size = 50 mm)
probe p = point(b, at = (50, 50, 100) mm)
metric u = displacement(p, along = -z)
metric F = force(c, along = +z)
"""


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize(
    ("young", "load", "shortening", "force"),
    [
        ("1 GPa", "traction(b, where = z >= 100 mm, vector = (0, 0, -1000) Pa)", 1e-7, 10.0),
        ("200 GPa", "traction(b, where = z >= 100 mm, vector = (0, 0, -1e6) Pa)", 5e-7, 1e4),
        ("1 MPa", "gravity(9.81 m/s^2)", 1000 * 9.81 * 0.1**2 / 2 / 1e6, 9.81),
    ],
)
def test_a_gap_is_small_beside_what_forces_move(young: str, load: str, shortening: float, force: float) -> None:
    """u = p L / E, under gravity rho g L^2 / 2 E, F = p A or m g: linear cells have both at their nodes.

    The gap is 1e-9 of the size or 5e-4 of the motion: 0.4 % of the least. Its force is that of equilibrium, to 1e-8.
    """
    model = softmark.loads(CUBE.format(young=young, load=load)).run(stated=True).models["m"]
    u, F = (model.metrics[name].value for name in ("u", "F"))
    assert u == pytest.approx(shortening, rel=4e-3)
    assert pytest.approx(force, rel=1e-7) == F
    stated = model.stated["u"].value
    assert stated is not None
    assert abs(u - shortening) <= stated <= 0.02 * shortening
    assert (model.stated["F"].value or 0.0) <= 1e-6 * force


PRESSED = """
material g = neo_hookean(young = 100 kPa, poisson = 0.3, density = 1000 kg/m^3)
body b = solid(box(size = (40, 20, 20) mm), g)
body k = rigid({tool})
contact c = rigid_contact(k, b, where = z >= 20 mm)
support f = fixed(b, where = z <= 0 mm)
support d = displaced(k, by = (0, 0, -{by}) mm)
model m = fem(hex8, strain = finite, size = 5 mm)
metric F = force(c, along = -z)
"""


@pytest.mark.slow
@pytest.mark.long
def test_a_thin_plate_presses_as_a_thick_one() -> None:
    """1 and 10 mm thick, by 3 mm: refused in one step before. Edges are met between nodes: half a per cent."""
    known = []
    for thick in (1, 10):
        tool = f"box(size = (30, 30, {thick}) mm, origin = (5, -5, 20.1) mm)"
        model = softmark.loads(PRESSED.format(tool=tool, by=3)).run().models["m"]
        assert model.status == "converged", model.message
        known.append(model.metrics["F"].value)
    assert known[0] == pytest.approx(known[1], rel=5e-3)


def test_a_knife_between_nodes_is_refused() -> None:
    """Cells of 5 mm and a blade of 0.5 mm: it passed between their nodes, and its force was told as 0 N."""
    tool = "box(size = (0.5, 30, 10) mm, origin = (17.25, -5, 20.1) mm)"
    model = softmark.loads(PRESSED.format(tool=tool, by=2)).run().models["m"]
    assert model.status == "failed"
    assert "half its thickness" in str(model.message)


@pytest.mark.slow
@pytest.mark.long
def test_a_bar_that_is_twisted_too_far_buckles_or_is_refused_for_that() -> None:
    """Two turns: the straight equilibrium that steps lead to is not stable, the way of care ended at 150 degrees."""
    model = (
        softmark.loads("""
material g = neo_hookean(young = 100 kPa, poisson = 0.3, density = 1000 kg/m^3)
body b = solid(box(size = (100, 10, 10) mm, origin = (0, -5, -5) mm), g)
support l = fixed(b, where = x <= 0 mm)
support r = rotated(b, where = x >= 100 mm, axis = +x, angle = 540 deg)
model m = fem(hex8, strain = finite, size = 5 mm)
metric T = moment(r, along = +x)
""")
        .run()
        .models["m"]
    )
    assert model.status in ("converged", "not_converged")
    assert model.status == "converged" or "buckles" in str(model.message)


def test_a_tool_of_unknown_volume_is_pressed_by_a_force() -> None:
    """Only gravity needs the mass: a rounded cone has a density here, but softmark does not know its volume.

    A force of .1 N is carried by the contact to the tolerance of equilibrium. Before, computing the mass failed.
    """
    text = """
material g = neo_hookean(young = 100 kPa, poisson = 0.3, density = 1000 kg/m^3)
body b = solid(box(size = (40, 40, 20) mm), g)
shape tool = rounded_cone(angle = 60 deg, rounding = 5 mm, length = 30 mm, origin = (20, 20, 20) mm)
body k = rigid(tool, density = 7800 kg/m^3)
contact c = rigid_contact(k, b, where = z >= 20 mm)
support f = fixed(b, where = z <= 0 mm)
support guide = fixed(k, components = (x, y))
load hand = point_force(k, at = (20, 20, 20) mm, vector = (0, 0, -0.1) N)
model m = fem(hex8, strain = finite, size = 10 mm)
metric F = force(c, along = -z)
"""
    model = softmark.loads(text).run().models["m"]
    assert model.status == "converged"
    assert model.metrics["F"].value == pytest.approx(0.1, rel=1e-6)
