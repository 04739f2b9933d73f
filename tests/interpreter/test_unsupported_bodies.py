"""Bodies that supports leave free and only touch holds: what bears them in the end, and what is said of it."""

from __future__ import annotations

import re
from typing import Any

import pytest

from softmark import loads
from softmark.interpreter.pipeline import run_pipeline
from softmark.interpreter.results.run_report import Report

HEAD = """softmark 1
scene "nothing but touch holds it"
material gel   = neo_hookean(young = 10 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     block = solid(box(size = (20, 20, 20) mm, origin = (0, 0, {z}) mm), gel)
body     floor = rigid(half_space(normal = ({slope}, 0, 1)))
contact  under = rigid_contact(floor, block{friction})
model    cubes = fem(hex8, size = 10 mm, strain = finite)
metric   rest  = force(under, along = +z)
"""
FALLS = HEAD + "load sag = gravity(9.81 m/s^2, direction = -z)\n"
PLATES = (
    HEAD
    + """
body     plate = rigid(half_space(origin = (0, 0, 21) mm, normal = (0, 0, -1)))
support  hand  = displaced(plate, by = (0, 0, -3) mm, amplitude = per_state)
contact  over  = rigid_contact(plate, block)
analysis press = static(states = [10, 50, 100] %)
metric   push  = force(over, along = -z)
"""
)
WEIGHT = 1000.0 * 9.81 * 8e-6  # N


def stated(text: str, model: str) -> Any:
    """The errors that a model states itself, by metric."""
    known = loads(text)
    options = run_pipeline.RunOptions(draw=False, stated=(model,))
    return run_pipeline.run_scene(known.scene, list(known.warnings), options).models[model].stated


def solved(text: str, **known: object) -> Report:
    return loads(text.format(**{"z": 0, "slope": 0, "friction": "", **known})).run()


@pytest.mark.parametrize("z", [0.0, 5.0, 50.0])
def test_a_block_comes_to_lie_on_a_plane_with_its_weight(z: float) -> None:
    """From any height below three times its size; to the tolerance of equilibrium, 1e-8, and what the spring bears."""
    report = solved(FALLS, z=z)
    found = report.models["cubes"]
    assert found.metrics["rest"].value == pytest.approx(WEIGHT, rel=2e-8)
    assert found.solve["grounded"]["bears"] <= 1e-10
    (said,) = [d for d in report.warnings if d.code == "W613"]
    assert "`under` holds it" in said.message
    assert "still free to slide along x, to slide along y and to turn" in str(said.help)
    assert "along z and stays at its initial position" in str(said.help)


@pytest.mark.slow
@pytest.mark.long
def test_what_nothing_stops_is_refused() -> None:
    """Too far from the plane; and on a slope without friction, where it slides on along it."""
    assert "it moves away along (0, 0, -1)" in str(solved(FALLS, z=500.0).models["cubes"].message)
    message = str(solved(FALLS, slope=0.17).models["cubes"].message)
    assert "move it along (0.99, 0, -0.17)" in message
    assert "add a support" in message


def test_friction_holds_all_of_it() -> None:
    """Nothing stays free of what lies on a plane with friction; one that falls on it is refused."""
    report = solved(FALLS, friction=", friction = 0.3")
    assert report.models["cubes"].metrics["rest"].value == pytest.approx(WEIGHT, rel=2e-8)
    (said,) = [d for d in report.warnings if d.code == "W613"]
    assert "still" not in str(said.help)
    above = solved(FALLS, z=8.0, friction=", friction = 0.3")
    assert "falls onto a contact with friction" in str(above.models["cubes"].message)


def test_what_is_pushed_before_it_meets_anything_goes_along() -> None:
    """A plate takes the block down by 2 mm, and does not come to the floor, 3 mm below it: nothing bears any force."""
    found = solved(PLATES.replace("origin = (0, 0, 21)", "origin = (0, 0, 24)"), z=3.0).models["cubes"]
    pushed = [found.metrics[name].states for name in ("push", "rest")]
    assert found.status == "converged"
    assert all(force == pytest.approx(0.0, abs=1e-12) for states in pushed for force in states)


def test_a_block_between_two_plates_is_pressed_as_one_that_a_mirror_holds() -> None:
    """Half a millimetre away from either; by symmetry the middle stays, and half of the block on it is the same.

    The mirror's half has cells of the same size. Gaps that barriers leave are 1e-5 of a diagonal, 0.35 um, at most: on
    both sides 3.5e-4 of the travel of 2 mm.
    """
    report = solved(PLATES, z=0.5)
    found = report.models["cubes"]
    said = [d.message for d in report.warnings if d.code == "W613"]
    assert [text.partition(" (in ")[2] for text in said] == ["the state 10 %)", "the states 50 %, 100 %)"]  # each once
    push, rest = (found.metrics[name].states for name in ("push", "rest"))
    assert push[0] == rest[0] == 0.0
    assert push[1:] == pytest.approx(rest[1:], rel=2e-8)
    half = """softmark 1
scene "half of it"
material gel   = neo_hookean(young = 10 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     block = solid(box(size = (10, 10, 10) mm), gel)
body     plate = rigid(half_space(origin = (0, 0, 10.5) mm, normal = (0, 0, -1)))
support  x_0   = symmetric(block, where = x <= 0 mm)
support  y_0   = symmetric(block, where = y <= 0 mm)
support  z_0   = symmetric(block, where = z <= 0 mm)
support  hand  = displaced(plate, by = (0, 0, -1.5) mm)
contact  over  = rigid_contact(plate, block)
model    cubes = fem(hex8, size = 10 mm, strain = finite)
metric   push  = force(over, along = -z)
"""
    assert push[2] == pytest.approx(4.0 * loads(half).run().models["cubes"].metrics["push"].value, rel=3.5e-4)


def test_the_spring_is_no_part_of_what_is_told() -> None:
    """A block that fell has the strain energy of one that lay there, whatever it would take to keep it where it was.

    To the tolerance of equilibrium, whose error energy has twice: the spring of the first place would have 8e-4 more.
    And what is free to slide along a plane has no slowest vibration, but for that of a spring that is not there.
    """
    told = FALLS + "metric E = strain_energy(block)\nmetric f = frequency(block)\n"
    lay, fell = (solved(told, z=z).models["cubes"].metrics for z in (0.0, 5.0))
    assert fell["E"].value == pytest.approx(lay["E"].value, rel=1e-7)
    assert "free to slide along x, to slide along y" in str(fell["f"].reason)


@pytest.mark.slow
@pytest.mark.long
def test_a_block_that_keeps_clear_of_itself_as_well_is_held_in_every_state() -> None:
    """A later state takes over what is between its faces, and the spring stays: forces are those without the former."""
    beside = solved(PLATES + "contact folds = self_contact(block)\n", z=0.5).models["cubes"]
    alone = solved(PLATES, z=0.5).models["cubes"]
    assert beside.status == "converged"
    assert beside.metrics["push"].states == pytest.approx(alone.metrics["push"].states, rel=1e-6)


@pytest.mark.slow
@pytest.mark.long
def test_a_finer_space_is_kept_where_the_body_is() -> None:
    """What a mesh is stated to be off is that of a block that lay there: not what its spring of the first place does.

    Stiff and light, so that such a spring would pull with a twentieth of the weight: 2.5 times that error.
    """
    text = FALLS.replace("10 kPa", "10 MPa") + "probe p = point(block, at = (20, 20, {top}) mm)\n"
    text += "metric d = displacement(p, along = -z)\n"
    lay, fell = (stated(text.format(z=z, top=z + 20, slope=0, friction=""), "cubes")["d"].parts for z in (0, 10))
    assert fell["discretisation"] == pytest.approx(lay["discretisation"], rel=1e-2)


@pytest.mark.long
@pytest.mark.slow
def test_what_a_body_tips_off_from_does_not_let_it_through_a_thin_shelf() -> None:
    """A block whose middle is beside the ball under it tips, and comes to lie on 2 mm, 28 mm below, with its weight.

    To the tolerance of equilibrium, 1e-8, and what the spring bears, at forces that its contacts share.
    """
    report = loads("""softmark 1
material gel   = neo_hookean(young = 100 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     block = solid(box(size = (20, 20, 20) mm), gel)
body     ledge = rigid(sphere(radius = 3 mm, origin = (14, 10, -3) mm))
body     shelf = rigid(box(size = (200, 200, 2) mm, origin = (-100, -100, -30) mm))
contact  under = rigid_contact(ledge, block)
contact  below = rigid_contact(shelf, block)
load     sag   = gravity(9.81 m/s^2, direction = -z)
model    cubes = fem(hex8, size = 20 mm, strain = finite)
metric   rest  = force(below, along = +z)
""").run()
    assert report.models["cubes"].metrics["rest"].value == pytest.approx(WEIGHT, rel=2e-8)


@pytest.mark.parametrize(("thick", "z"), [(0.5, 20.0), (0.2, 5.0)])
def test_a_block_does_not_fall_through_a_thin_shelf(thick: float, z: float) -> None:
    """Whose thickness is a small part of the way from place to place: it lies on it, with its weight, as on any other.

    The bottom comes to where the shelf begins, but for the gap of the barrier, 1e-5 of a diagonal at most.
    """
    text = FALLS.format(z=z, slope=0, friction="").replace(
        "half_space(normal = (0, 0, 1))", f"box(size = (200, 200, {thick}) mm, origin = (-100, -100, {-thick}) mm)"
    )
    text += f"probe low = point(block, at = (10, 10, {z}) mm)\nmetric down = displacement(low, along = -z)\n"
    found = loads(text).run().models["cubes"].metrics
    assert found["rest"].value == pytest.approx(WEIGHT, rel=2e-8)
    assert found["down"].value == pytest.approx(1e-3 * z, abs=1e-5 * 0.0346)


@pytest.mark.slow
@pytest.mark.long
def test_a_body_that_is_balanced_on_a_point_is_refused_at_once() -> None:
    """A ball between a round pin and a plate: in equilibrium, of less energy beside it, whichever way it goes."""
    report = loads("""softmark 1
material gel   = neo_hookean(young = 10 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     ball  = solid(sphere(radius = 10 mm, origin = (0, 0, 10) mm), gel)
body     pin   = rigid(sphere(radius = 3 mm, origin = (0, 0, -3) mm))
body     plate = rigid(half_space(origin = (0, 0, 20) mm, normal = -z))
support  hand  = displaced(plate, by = (0, 0, -2) mm)
contact  touch = rigid_contact(pin, ball)
contact  over  = rigid_contact(plate, ball)
model    cells = fem(tet4, size = 4 mm, strain = finite)
metric   push  = force(touch, along = +z)
""").run()
    found = report.models["cells"]
    assert found.status == "not_converged"
    assert re.search(
        r"the contact equilibrium is unstable: it slides away along \(0\.\d+, -?0\.\d+, 0\)", str(found.message)
    )
    assert found.solve["iterations"] < 500  # that loads which grow took 2700 of
