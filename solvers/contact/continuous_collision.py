"""Continuous collision check: finds points that pass through a rigid body during a straight motion."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from softmark.records import dataclass
from softmark.solvers.contact.rigid_contact import RigidContact
from softmark.solvers.contact.rigid_transform import MovedGap, gap_as_declared
from softmark.solvers.contact.signed_distance.distance_function import Gap, depth_of_centroid
from softmark.solvers.energies.energy import Floats

LOOKS = 256  # along the way of a point that may have gone through
LEAST = 1.0 / 512  # of a way that a look goes on by, or half as far as the middle of the body is deep
SHORTEST = 1e-5  # of a motion: given up below


@dataclass(frozen=True)
class PointsInBodyFrame:
    """Contact points X (n, 3), m, in the frame of the rigid body `own`, with their gaps (n,), m."""

    own: Gap
    X: Floats
    gaps: Floats


def locate_contact_points(contact: RigidContact, x: Floats) -> PointsInBodyFrame:
    """Return the points of a contact in a state x, in the frame of its rigid body."""
    body, X = contact.body, contact.places(x)
    if isinstance(body, MovedGap):
        return PointsInBodyFrame(body.own, back := body.pose.back(X), body.own.gap(back))
    return PointsInBodyFrame(body, X, body.gap(X))


def collision_free_fraction(
    contacts: Sequence[RigidContact], x: Floats, d: Floats, to: Sequence[RigidContact] | None = None
) -> float:
    """Return the fraction (at most 1, by halves) of a motion d (dofs,) from x that moves no point through a rigid body.

    It is 0 if there is none. Rigid bodies move to where they are in the contacts `to`, whatever the fraction; by
    default they stay.
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
    """Return whether a motion is long enough to pass through the body, and the body has another side."""
    way = end.places(x + d) - start.places(x)
    far = float(np.sqrt(np.einsum("ni,ni->n", way, way).max(initial=0.0)))
    moves = start.body is not end.body
    return (moves or far > start.barrier.distance) and depth_of_centroid(gap_as_declared(start.body)) < np.inf


def has_passed_through(start: PointsInBodyFrame, end: PointsInBodyFrame) -> bool:
    """Return whether a point has entered the rigid body on one side and is leaving it on another.

    Positions are in the frame of the rigid body. Its gap is 1-Lipschitz: points that moved by less than the sum of
    their gaps at both ends have touched nothing. Paths are straight lines: over an edge the body may cut up to half of
    one.
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
    """Return whether a straight path from X0 to X1 (n, 3) leads behind the surface."""
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
    return True  # not shown to be clear
