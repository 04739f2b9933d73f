"""Rigid bodies that go through a surface in one step: told from those that press it, or pass beside it."""

from __future__ import annotations

import numpy as np
import pytest

from softmark.solvers.contact.barrier_law import Barrier
from softmark.solvers.contact.rigid_contact import RigidContact
from softmark.solvers.contact.rigid_transform import MovedGap, RigidMotion
from softmark.solvers.contact.signed_distance.polyhedra import BoxGap
from softmark.solvers.contact.signed_distance.rounded_shapes import BallGap
from softmark.solvers.contact.tunnelling_check import surface_triangles, tunnelling_depth

BALL = BallGap(5.0, (0.0, 0.0, 5.0))  # on the plane of the nodes
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
    contact = RigidContact(
        np.arange(9), X, np.ones(9), Barrier(1e-3, 1.0), lambda s: MovedGap(BALL, RigidMotion((0.0, 0.0, -s * down)))
    )
    x = np.zeros(27)
    x[14] = up + np.sign(up) * near
    assert tunnelling_depth(contact, np.zeros(27), x) == pytest.approx(deep, abs=0.2)


SLAB = np.array([(x, y, z) for z in (-1.0, 1.0) for y in (-9.0, 9.0) for x in (-9.0, 9.0)])
AROUND = np.array([(0, 2, 3), (0, 3, 1), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4), (2, 6, 7), (2, 7, 3), (0, 4, 6),
                   (0, 6, 2), (1, 3, 7), (1, 7, 5)])  # fmt: skip
PIN = BallGap(0.5, (0.3, 0.2, 3.0))


@pytest.mark.parametrize(("way", "moved", "deep"), [
    ((0.0, 0.0, -6.0), 0.0, 0.5),  # in above and out below: between all nodes, by as much as its middle is deep
    ((0.0, 0.0, -3.0), 0.0, 0.0),  # in and not out: it lies in the slab, which is told by another check
    ((0.0, 0.0, -6.0), -6.0, 0.0),  # which has gone along
    ((0.0, 0.0, -2.0), 4.0, 0.5),  # to below the slab that comes up
    ((18.0, 0.0, -6.0), 0.0, 0.0),  # in above and out beside: around a corner, which a straight way cuts
    ((18.0, 0.0, 0.0), 0.0, 0.0),  # over it
])  # fmt: skip
def test_what_goes_through_between_nodes(way: tuple[float, float, float], moved: float, deep: float) -> None:
    """In mm; what is moved is the slab of 2 mm as a whole, whose nodes are at its corners."""
    contact = RigidContact(
        np.arange(8),
        SLAB,
        np.ones(8),
        Barrier(1e-3, 1.0),
        lambda s: MovedGap(PIN, RigidMotion((s * way[0], s * way[1], s * way[2]))),
        skin=surface_triangles(SLAB, AROUND),
    )
    x = np.tile([0.0, 0.0, moved], 8)
    assert tunnelling_depth(contact, np.zeros(24), x) == pytest.approx(deep)


def test_a_thin_plate_that_comes_to_press_from_the_other_side_has_gone_through() -> None:
    """Its middle is beside the nodes, and it is far thinner than its way is long: 0.05 of 12 mm."""
    plate = BoxGap((20.0, 0.0, 3.0), (30.0, 10.0, 0.025))
    contact = RigidContact(
        np.arange(9), X, np.ones(9), Barrier(1e-3, 1.0), lambda s: MovedGap(plate, RigidMotion((0.0, 0.0, -12.0 * s)))
    )
    for z, deep in ((-9.0 + 0.0254, 0.025), (-9.0 - 0.0254, 0.0)):  # the nodes above it in the end, or below
        assert tunnelling_depth(contact, np.zeros(27), np.tile([0.0, 0.0, z], 9)) == pytest.approx(deep, abs=0.01)
