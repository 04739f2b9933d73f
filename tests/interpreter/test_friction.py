"""Friction in scenes: slopes, and a plane that is dragged along; each state is checked by other formulas too."""

from __future__ import annotations

import math

import numpy as np
import pytest

from softmark import SceneError, loads
from softmark.solvers.energies.energy import Floats
from softmark.solvers.statics import friction_iteration
from softmark.solvers.statics.static_newton import Newton
from softmark.solvers.statics.static_problem import NotConverged

HEAD = """softmark 1
scene "Rubbing"
material gel   = neo_hookean(young = 10 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     block = solid(box(size = (40, 10, 10) mm, origin = (-20, 0, 0) mm), gel)
support  front = symmetric(block, where = y <= 0 mm)
model    hexes = fem(hex8, size = 5 mm, strain = finite, integration = selective)
metric   push  = force(touch, along = +z)
metric   drag  = force(touch, along = +x)
"""

SLOPE = (
    HEAD
    + """
body     hill  = rigid(half_space(normal = (0, 0, 1)))
contact  touch = rigid_contact(hill, block, friction = 0.3)
load     sag   = gravity(9.81 m/s^2, direction = ({x}, 0, {z}))
analysis rest  = static()
"""
)

DRAGGED = (
    HEAD
    + """
body     plane = rigid(half_space(normal = (0, 0, 1)))
contact  touch = rigid_contact(plane, block, friction = 0.3)
support  grip  = fixed(block, where = z >= 10 mm)
support  hand  = displaced(plane, by = (8, 0, 0.4) mm, amplitude = per_state)
analysis press = static(states = [25, 50, 75, 100] %)
metric   heat  = dissipation(block)
metric   way   = slip(touch)
metric   still = stick_area(touch)
"""
)


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("share", [0.99, 1.01])
def test_a_block_on_a_slope(share: float) -> None:
    """It stays within 1 % below arctan(mu), under its whole weight, and slides beyond, where nothing is in balance."""
    angle = share * math.atan(0.3)
    model = loads(SLOPE.format(x=math.sin(angle), z=-math.cos(angle))).run().models["hexes"]
    if share > 1.0:
        assert model.status == "not_converged"
        assert "all contact points slide" in str(model.message)
        return
    assert model.status == "converged"
    weight = 1000.0 * 9.81 * 4e-6  # N
    assert model.metrics["push"].value == pytest.approx(weight * math.cos(angle), rel=1e-6)
    assert model.metrics["drag"].value == pytest.approx(-weight * math.sin(angle), rel=1e-6)


def test_what_is_tried_in_vain_is_not_tried_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """The careful way went from rest to the whole load, as the one before it had: to the same failure."""
    tried = list[tuple[str, float]]()

    def fails(newton: Newton, x: Floats, load: float) -> Floats:
        tried.append((newton.phase, load))
        if load > 0.4:
            raise NotConverged("friction iteration does not converge")
        return rubbed(newton, x, load)

    rubbed = friction_iteration.solve_friction
    monkeypatch.setattr(friction_iteration, "solve_friction", fails)
    model = loads(DRAGGED.replace("[25, 50, 75, 100]", "[100]")).run().models["hexes"]
    assert model.status == "not_converged"
    assert tried[:3] == [("free", 1.0), ("careful", 0.5), ("careful", 0.25)]


@pytest.mark.slow
@pytest.mark.long
def test_what_is_dragged_along() -> None:
    """It slides under mu N along a plane, and what becomes heat from then on is that force times the way."""
    found = loads(DRAGGED).run().models["hexes"].metrics
    push, drag, heat, way, still = (found[name].states for name in ("push", "drag", "heat", "way", "still"))
    assert list(still[-2:]) == [0.0, 0.0]
    # 1e-4 is lacking where nodes slide across as well, as the block is squeezed and grows wider
    assert drag[-1] == pytest.approx(0.3 * push[-1], rel=1e-3)
    assert drag[-2] == pytest.approx(0.3 * push[-2], rel=1e-3)
    assert all(a >= 0.0 for a in np.diff([0.0, *heat]))
    assert all(a >= 0.0 for a in np.diff([0.0, *way]))
    # in a step the force of its end acts along all of its slip: the plane's way less what the block is sheared more
    assert heat[-1] - heat[-2] == pytest.approx(drag[-1] * 2e-3, rel=0.1)
    assert heat[-1] - heat[-2] < drag[-1] * 2e-3


@pytest.mark.slow
@pytest.mark.long
def test_what_sticks_does_not_lose_anything() -> None:
    """Of much friction all of a plane sticks, nothing becomes heat, and nothing slides."""
    text = DRAGGED.replace("friction = 0.3", "friction = 10").replace("(8, 0, 0.4)", "(0.05, 0, 0.4)")
    found = loads(text).run().models["hexes"].metrics
    heat, way, drag, push = (found[name].states[-1] for name in ("heat", "way", "drag", "push"))
    assert 0.0 < drag < 0.3 * push
    assert heat == pytest.approx(0.0, abs=1e-3 * drag * 5e-5)
    assert way < 1e-6


ROLL = """softmark 1
material gel   = neo_hookean(young = 10 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     block = plane_strain(
    quadrilateral((0, 0, 0) mm, (20, 0, 0) mm, (20, 20, 0) mm, (0, 20, 0) mm), gel, thickness = 10 mm
)
body     roll  = rigid(cylinder(radius = 8 mm, length = 20 mm, axis = +z, origin = (10, 28, -10) mm))
support  floor = fixed(block, where = y <= 0 mm)
support  down  = displaced(roll, by = (0, -1, 0) mm)
support  spin  = rotated(roll, angle = {angle} deg, axis = +z, through = (10, 28, 0) mm, amplitude = per_state)
contact  touch = rigid_contact(roll, block, friction = 0.3)
analysis press = static(states = {states} %)
model    quads = fem(quad4, strain = finite, size = 2 mm)
metric   drag  = force(touch, along = +x)
metric   torque = moment(touch, along = +z, about = (10, 27, 0) mm)
metric   heat  = dissipation(block)
"""


@pytest.mark.slow
@pytest.mark.long
def test_what_turns_drags_along() -> None:
    """Below a roll that turns about +z all slides to +x; once it does, its torque times the turn becomes heat.

    In each state points slide along a straight line, by the sine of the turn: 1.1 % less of 15 deg.
    """
    found = loads(ROLL.format(angle=90, states=[0, *(100 * k / 6 for k in range(1, 7))])).run().models["quads"].metrics
    drag, torque, heat = (found[name].states for name in ("drag", "torque", "heat"))
    assert min(drag[1:]) > 0.0
    assert heat[-1] - heat[-3] == pytest.approx(torque[-1] * math.radians(30.0), rel=0.015)


@pytest.mark.parametrize(("angle", "refused"), [(15, False), (16, True), (180, True), (-270, True)])
def test_what_turns_past_what_it_drags_is_refused(angle: float, refused: bool) -> None:
    """By 180 deg in one state nothing was dragged, and by 270 deg the wrong way."""
    text = ROLL.format(angle=angle, states=[0, 100])
    if not refused:
        loads(text)
        return
    with pytest.raises(SceneError, match="E663"):
        loads(text)


PRESSED = """softmark 1
scene "a sphere in a gel"
material gel   = linear_elastic(young = 10 kPa, poisson = 0.45, density = 1000 kg/m^3)
body     block = axisymmetric(
    quadrilateral((0, -20, 0) mm, (20, -20, 0) mm, (20, 0, 0) mm, (0, 0, 0) mm), gel)
body     ball  = rigid(sphere(radius = 10 mm, origin = (0, 10, 0) mm))
support  floor = fixed(block, where = y <= -20 mm)
support  hand  = displaced(ball, by = (0, -1, 0) mm)
contact  touch = rigid_contact(ball, block, where = y >= 0 mm{friction})
model    quads = fem(quad8, size = 4 mm, strain = small)
metric   push  = force(touch, along = -y)
"""


@pytest.mark.slow
def test_friction_does_not_change_what_is_kept_clear() -> None:
    """Of 1e-4 it changes the force by less than itself; eight-node facets without their middle were 13 % too soft.

    The independent check takes all forces of its own, at points inside facets too, and balances to 1e-9.
    """
    with_, without = (loads(PRESSED.format(friction=f)).run().models["quads"] for f in (", friction = 0.0001", ""))
    assert with_.metrics["push"].value == pytest.approx(without.metrics["push"].value, rel=1e-4)
    assert with_.solve["checks"]["residual"] < 1e-9


FLAT = """softmark 1
material gel   = linear_elastic(young = 100 kPa, poisson = 0, density = 1000 kg/m^3)
body     block = solid(box(size = (20, 20, 20) mm), gel)
body     wall  = rigid(half_space(normal = (0, 0, 1)))
contact  hit   = rigid_contact(wall, block, friction = 0.5)
support  lid   = displaced(block, where = z >= 20 mm, by = (0, 0, -0.2) mm)
model    cells = fem(hex8, size = 5 mm, strain = small)
metric   still = stick_area(hit)
metric   whole = contact_area(hit)
"""


def test_all_of_a_face_that_is_pressed_sticks_and_nothing_beyond_its_edge() -> None:
    """Of 20 mm by 20 mm; nodes at its edge stand for parts of the sides as well, which touch nothing."""
    found = loads(FLAT).run().models["cells"].metrics
    assert found["still"].value == pytest.approx(found["whole"].value, rel=1e-12)
    assert found["still"].value == pytest.approx(4e-4, rel=1e-3)  # as pressed sides bulge
