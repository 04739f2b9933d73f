"""Substeps for rigid bodies that are thinner than their motion: each moves a body by at most half its thickness.

In one step such a body would pass through the surface, or end behind it where the nearest point outside is at its side.
Loads act in full in every substep. Rigid bodies and imposed displacements move in equal parts. The motion is not split
with friction, where the path matters, or with rotating supports, where nodes move on circles.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from softmark.solvers.contact.rigid_transform import MovedGap, RigidMotion, gap_as_declared
from softmark.solvers.contact.signed_distance.distance_function import Gap, depth_of_centroid
from softmark.solvers.contact.tunnelling_check import sweeps_centroid
from softmark.solvers.energies.energy import Floats
from softmark.solvers.statics.static_problem import Equilibrium, Iteration, NotConverged, Statics

Find = Callable[[Statics], Equilibrium]

FINER = "cells are too large compared with the rigid body that presses between their nodes"
SHARE = 0.5  # of the depth of the centroid of a rigid body: longest motion in a substep
MOST = 200  # largest number of substeps


def count_substeps(problem: Statics) -> int:
    """Return the number of substeps for the rigid bodies of a problem.

    It is 1 if no body is thinner than its motion, or the motion cannot be split.
    """
    contacts = problem.assembly.rigid_contacts.values()
    if problem.has_friction or problem.way is not None or problem.exact is not None or problem.cap is not None:
        return 1
    return max((_substeps_needed(contact) for contact in contacts), default=1)


def presses_on_nodes(found: Equilibrium) -> bool:
    """Return whether, in an equilibrium, every rigid body presses on at least one mesh node."""
    return all(contact.presses_on_nodes(found.x) for contact in found.contacts.values())


def solve_in_substeps(problem: Statics, find: Find, count: int) -> Equilibrium:
    """Return the equilibrium after `count` substeps, each solved by `find` from the last one. Raises NotConverged."""
    contacts, history, x = problem.assembly.rigid_contacts, tuple[Iteration, ...](), problem.start
    first = np.zeros_like(problem.target) if x is None else (x - problem.rest)[problem.fixed]
    places = {name: (_body_at_start(c), c.extra) for name, c in contacts.items()}
    found: Equilibrium | None = None
    for number in range(1, count + 1):
        share = number / count
        moved = dict[str, Any]()
        for name, contact in contacts.items():
            place, extra = places[name]
            end = _interpolate_motion(_body_at_start(contact), contact.posed(1.0), share)
            own = replace(contact, posed=contact.posed if number == count else _FixedPosition(end), earlier=place)
            moved[name] = (
                own if extra is contact.extra else own.with_added_points(extra, problem.rest if x is None else x)
            )
        target = first + share * (problem.target - first)
        try:
            found = find(replace(problem.with_energies(moved), target=target, start=x))
        except NotConverged as failure:
            reason = f"{failure.reason} (in substep {number} of {count})"
            raise NotConverged(reason, (*history, *failure.history), failure.facts, failure.unstable) from failure
        history, before, x = (*history, *found.history), problem.rest if x is None else x, found.x
        if any(sweeps_centroid(contact, before, x) for contact in moved.values()):
            reason = f"facets penetrate a rigid body down to its centre (in substep {number} of {count}): {FINER}"
            raise NotConverged(reason, history, found.facts)
        places = {name: (contact.body, contact.extra) for name, contact in found.contacts.items()}
    assert found is not None
    return replace(found, history=history, load_steps=count)


class _FixedPosition:
    """Function of the load factor that always returns the same position of a rigid body."""

    def __init__(self, body: Gap) -> None:
        """Store the rigid body."""
        self.body = body

    def __call__(self, share: float) -> Gap:
        """Return the signed distance of the rigid body."""
        return self.body

    def pose(self, share: float) -> RigidMotion:
        """Return the motion of the body from its declared position, which does not depend on the load factor."""
        return _rigid_motion_of_body(self.body)


def _substeps_needed(contact: Any) -> int:
    """Return the number of substeps that one rigid body needs between its start and its end."""
    start, end = _body_at_start(contact), contact.posed(1.0)
    inner = depth_of_centroid(gap_as_declared(end))
    if not 0.0 < inner < math.inf:
        return 1
    way: Floats = _rigid_motion_of_body(end).moved(contact.X) - _rigid_motion_of_body(start).moved(contact.X)
    travel = float(np.linalg.norm(way, axis=1).max(initial=0.0))
    return min(MOST, max(1, math.ceil(travel / (SHARE * inner))))


def _body_at_start(contact: Any) -> Gap:
    """Return the signed distance of a rigid body at the start of its motion.

    This is its position in the last state, or at load factor zero if that is unknown.
    """
    found: Gap = contact.posed(0.0) if contact.earlier is None else contact.earlier
    return found


def _rigid_motion_of_body(body: Gap) -> RigidMotion:
    """Return the motion of a rigid body from its declared position."""
    return body.pose if isinstance(body, MovedGap) else RigidMotion()


def _interpolate_motion(start: Gap, end: Gap, share: float) -> Gap:
    """Return the signed distance of a rigid body at a fraction `share` of its motion from start to end."""
    a, b = _rigid_motion_of_body(start), _rigid_motion_of_body(end)
    shift, rotation = (
        tuple(((1.0 - share) * np.array(p) + share * np.array(q)).tolist())
        for p, q in ((a.shift, b.shift), (a.rotation, b.rotation))
    )
    return MovedGap(gap_as_declared(end), RigidMotion(shift, rotation, b.about))
