"""Surfaces whose gaps are larger than they are: beside soft barriers, and of what touches when a motion begins."""

from __future__ import annotations

import numpy as np
import pytest

from softmark.solvers.contact.barrier_law import Barrier
from softmark.solvers.contact.rigid_contact import RigidContact
from softmark.solvers.contact.rigid_transform import MovedGap, RigidMotion
from softmark.solvers.contact.signed_distance.rounded_shapes import BallGap

BALL = BallGap(5.0, (0.0, 0.0, 5.05))
X = np.array([(x, y, 0.0) for x in (-2.0, 0.0, 2.0) for y in (-2.0, 0.0, 2.0)])


@pytest.fixture
def touching() -> RigidContact:
    """Nodes of a plane, one within the distance of the barrier, under a ball that goes down by 1."""
    return RigidContact(
        np.arange(9), X, np.ones(9), Barrier(0.1, 1.0), lambda s: MovedGap(BALL, RigidMotion((0.0, 0.0, -s))), share=0
    )


def test_what_a_body_that_goes_on_does(touching: RigidContact) -> None:
    """To first order it is how forces change over 1e-7 of its way: to 1e-4, whatever gaps are larger by."""
    x, h = np.tile((0.0, 0.0, 1e-3), 9), 1e-7
    for own in (touching, touching.with_scaled_stiffness(0.05), touching.at(0.05).without_initial_energy()):
        change, g, there = np.zeros((3, 27))
        to = own.at(own.share + h)
        own.add_force_change_of_motion(x, to.body, change)
        own.add_gradient(x, g)
        to.add_gradient(x, there)
        assert np.abs(change).max() > 0.0
        assert change == pytest.approx(there - g, abs=1e-4 * np.abs(change).max())


def test_what_is_soft_begins_at_the_same_gap(touching: RigidContact) -> None:
    """And bears so much less at the surface: what presses lies behind it; what begins to move stores nothing."""
    x = np.zeros(27)
    soft = touching.with_scaled_stiffness(0.05)
    assert ((soft.pressures(x) > 0.0) == (touching.pressures(x) > 0.0)).all()
    assert 0.0 < soft.pressures(x).max() < 0.05 * touching.pressures(x).max()
    assert soft.body == touching.body
    assert touching.with_scaled_stiffness(1.0) is touching
    assert touching.value(x) > 0.0
    assert touching.without_initial_energy().value(x) == 0.0
