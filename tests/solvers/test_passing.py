"""Rigid bodies that go through a surface in one step: told from those that press it, or pass beside it."""

from __future__ import annotations

import numpy as np
import pytest

from softmark.solvers.contact.barrier import Barrier
from softmark.solvers.contact.gaps.round import Ball
from softmark.solvers.contact.passing import passed
from softmark.solvers.contact.pose import Pose, Posed
from softmark.solvers.contact.touching import Touching

BALL = Ball(5.0, (0.0, 0.0, 5.0))  # on the plane of the nodes
X = np.array([(x, y, 0.0) for x in (-4.0, 0.0, 4.0) for y in (-4.0, 0.0, 4.0)])


@pytest.mark.parametrize(("down", "up", "deep"), [
    (40.0, 0.0, 5.0),  # all the way through: nothing touches in the end, and the middle was at the nodes on the way
    (12.0, 0.0, 5.0),
    (8.0, 2.0, 5.0),  # the node in the middle is pushed out at the upper side
    (2.0, -2.0, 0.0),  # it is pressed down
    (-3.0, 0.0, 0.0),  # away from it
])  # fmt: skip
def test_what_goes_through(down: float, up: float, deep: float) -> None:
    """In mm; the node in the middle, which is 4 in the list, is as far as the barrier lets it."""
    near = 1e-4
    contact = Touching(
        np.arange(9), X, np.ones(9), Barrier(1e-3, 1.0), lambda s: Posed(BALL, Pose((0.0, 0.0, -s * down)))
    )
    x = np.zeros(27)
    x[14] = up + np.sign(up) * near
    assert passed(contact, np.zeros(27), x) == pytest.approx(deep, abs=0.2)
