"""Continuous collision detection: finds points that pass through a rigid body during a straight motion."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from softmark.records import dataclass
from softmark.solvers.contact.rigid_contact import RigidContact
from softmark.solvers.contact.rigid_transform import MovedGap, gap_as_declared
from softmark.solvers.contact.signed_distance.distance_function import Gap, depth_of_centroid
from softmark.solvers.energies.energy import Floats

LOOKS = 256  # largest number of positions checked along the path of a point
LEAST = 1.0 / 512  # of a path: least step between positions (or half of the depth of the centroid)
SHORTEST = 1e-5  # of a motion: smaller fractions are not tried


@dataclass(frozen=True)
class PointsInBodyFrame:
    """Contact points X (n, 3), m, in the frame of a rigid body, with their gaps (n,), m.

    `own` is the signed distance to the rigid body.
    """

    own: Gap
    X: Floats
    gaps: Floats


def locate_contact_points(contact: RigidContact, x: Floats) -> PointsInBodyFrame:
    """Return the contact points in a state x (dofs,), in the frame of their rigid body."""
    body, X = contact.body, contact.places(x)
    if isinstance(body, MovedGap):
        return PointsInBodyFrame(body.own, back := body.pose.back(X), body.own.gap(back))
    return PointsInBodyFrame(body, X, body.gap(X))


def collision_free_fraction(
    contacts: Sequence[RigidContact], x: Floats, d: Floats, to: Sequence[RigidContact] | None = None
) -> float:
    """Return the largest fraction 1, 1/2, 1/4, ... of a motion for which no point passes through a rigid body.

    The motion is d (dofs,), m, from the state x (dofs,). The result is 0 if even the smallest fraction fails. During
    the motion the rigid bodies move to their positions in the contacts `to`, in full for every fraction; by default
    they do not move.
    """
    ends = contacts if to is None else to
    known = [
        (locate_contact_points(c, x), end)
        for c, end in zip(contacts, ends, strict=True)
        if _may_pass_through(c, end, x, d)
    ]
    length = 1.0
    while length > SHORTEST:
        if not any(has_passed_through(start, locate_contact_points(end, x + length * d)) for start, end in known):
            return length
        length *= 0.5
    return 0.0


def _may_pass_through(start: RigidContact, end: RigidContact, x: Floats, d: Floats) -> bool:
    """Return whether a motion d (dofs,) could move a point through the rigid body.

    It could if it is longer than the barrier distance, or the rigid body moves, and if the rigid body is finite.
    """
    way = end.places(x + d) - start.places(x)
    far = float(np.sqrt(np.einsum("ni,ni->n", way, way).max(initial=0.0)))
    moves = start.body is not end.body
    return (moves or far > start.barrier.distance) and depth_of_centroid(gap_as_declared(start.body)) < np.inf


def has_passed_through(start: PointsInBodyFrame, end: PointsInBodyFrame) -> bool:
    """Return whether a point has entered the rigid body on one side and has left, or is leaving, on another side.

    Positions are in the frame of the rigid body. Gaps change by at most the length of the motion, so a point that moved
    by less than the sum of its gaps at both ends has touched nothing. Paths are taken to be straight. A path that goes
    around an edge may cut through up to half of the body.
    """
    step = end.X - start.X
    far = np.sqrt(np.einsum("ni,ni->n", step, step))
    doubt = np.flatnonzero(far > start.gaps + end.gaps)
    if not len(doubt):
        return False
    n0, n1 = end.own.look(start.X[doubt])[1], end.own.look(end.X[doubt])[1]
    turned = doubt[np.einsum("ni,ni->n", n0, n1) < 0.0]
    return bool(len(turned)) and _path_enters_body(end.own, start.X[turned], end.X[turned], far[turned])


def _path_enters_body(own: Gap, X0: Floats, X1: Floats, far: Floats) -> bool:
    """Return whether a straight path from X0 to X1 (n, 3), m, of length `far` (n,), m, enters the rigid body."""
    share, least = np.zeros(len(far)), np.minimum(LEAST, 0.5 * (depth_of_centroid(own) or np.inf) / far)
    for _ in range(LOOKS):
        g = own.gap(X0 + share[:, None] * (X1 - X0))
        if (g < 0.0).any():
            return True
        share = share + np.maximum(g / far, least)
        going = share < 1.0
        if not going.any():
            return False
        share, X0, X1, far, least = (each[going] for each in (share, X0, X1, far, least))
    return True  # the path was not shown to be free
