"""Contacts: which bodies must not pass through each other.

To add one: a class, a line in CONTACTS.
"""

from __future__ import annotations

from typing import Annotated, Any

from softmark.interpreter.language.coordinate_conditions import EVERYWHERE
from softmark.records import dataclass


@dataclass(frozen=True)
class Between:
    """Keeps the surface of a body clear of a rigid one: what presses on it is found, and nothing passes through.

    The rigid body stays where it is declared, or goes where a support takes it: `support hand = displaced(ball, by =
    (0, 0, -1) mm)`, or as far as a known force presses it: `load hand = point_force(ball, ...)`. No node of the surface
    comes behind that of the rigid body, nor the middle of facets of eight nodes, and in space points inside facets that
    are longer than the rigid body is sharp. Where an edge, a corner or a tip still cuts in between these, points join
    them and the state, or the step of a motion, is found again until nothing does: `solve.joined` of the report has how
    many press in the last state. Where no such state is found, as it may be between fine facets, the one without these
    points stays; and what is blunter than a facet is long may cut in by as much as facets are flat: the table of
    contacts in the report says how deep all that is left goes. A thin barrier does it: it has no pressure beyond the
    `distance`, which is chosen at a hundred-thousandth of the size of the body, at rest at no more than 1/2000 of how
    far supports move anything, and more than the body can bear at
    touch, so that a gap of less than that distance is left, which is part of the stated error.
    `force(NAME, along = +z)` is the contact force on the deformable body. Finite elements take it, in space and in the
    plane, where the rigid body is cut by z = 0.

    With `friction` the surface sticks up to friction times pressure, and slides beyond: Coulomb's law at points, by
    return mapping (Simo and Laursen 1992). What sticks gives way by less than the barrier's distance, friction times
    pressure over its stiffness per distance. What slides depends on the way there: each of the `states` of a static
    analysis is one step from the state before, along a straight line, so that more states are a finer path, and rigid
    bodies turn by 15 degrees at most in one; without states all of the load is one step. `slip(NAME)` and
    `stick_area(NAME)` say what slides, `dissipation(BODY)` what has become heat.

    In motion every step in time is one of these steps. Pressures and friction are those of its end, whatever integrator
    makes it; heat never falls, and is told beside the other energies, `solve.energies.friction` of the report, as the
    farthest slip and the share of the forces that sticks are in `solve.friction`. With an integrator that damps nothing
    nodes that stick may have velocities of less than friction times g h / 2, h the step, which change sign with every
    step and lead nowhere. What touches when a motion begins is not thrown off: its gaps count from the `distance` on,
    so that there it may come behind the surface by as much.

    At rest a body that supports leave free may be held by what it touches, with friction or without: the report says
    which contacts hold it, and what still is free.
    """

    rigid: Annotated[str, "body", "the rigid body"]
    body: Annotated[str, "body", "the deformable body"]
    where: Annotated[Any, "condition", "which part of its surface may touch, by coordinates before deformation"] = (
        EVERYWHERE
    )
    friction: Annotated[float, "1 in [0, 10]", "Coulomb's coefficient of friction"] = 0.0
    distance: Annotated[float | None, "m in (0, inf)", "where the barrier begins; chosen by the size without"] = None
