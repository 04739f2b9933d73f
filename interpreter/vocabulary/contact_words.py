"""Contacts between a deformable body and a rigid one.

To add a contact: a class and a line in CONTACTS.
"""

from __future__ import annotations

from typing import Annotated, Any

from softmark.interpreter.language.coordinate_conditions import EVERYWHERE
from softmark.records import dataclass


@dataclass(frozen=True)
class RigidContactPair:
    """Contact of a deformable body with a rigid body, without penetration; friction is optional.

    The rigid body stays where it is declared unless a support moves it, `support hand = displaced(ball, by = (0, 0, -1)
    mm)`, or a known force presses it, `load hand = point_force(ball, ...)`. `force(NAME, along = +z)` is the contact
    force on the deformable body. Finite elements support this contact in three dimensions and in the plane, where the
    rigid body is cut at z = 0.

    Contact is enforced at the nodes of the surface, at the centres of eight-node facets and, in three dimensions where
    the rigid body is sharper than the facets, also at points inside the facets. If an edge, corner or tip of the rigid
    body still penetrates, points are added and the state or time step is solved again until nothing penetrates;
    `solve.joined` in the report counts the added points with pressure in the last state. If no such state is found,
    which can happen between fine facets, the solution without these points is kept. A rigid body that is blunter than
    the facets may penetrate by as much as the facets deviate from a curved surface. The table of contacts in the report
    gives the remaining penetration depth.

    The contact pressure comes from a barrier. It acts only at gaps below `distance` and grows without bound as the gap
    closes, so a gap smaller than `distance` remains, which is part of the stated error. By default `distance` is 1e-5
    of the body size and, in static analyses, at most 1/2000 of the largest displacement that supports impose.

    `friction` is Coulomb's law at points, by return mapping (Simo and Laursen 1992): the surface sticks up to friction
    times pressure and slides beyond. Sticking points slip elastically by less than `distance`: by friction times
    pressure, divided by the stiffness of the barrier. Sliding depends on the load path. Each of the `states` of a
    static analysis is one step along a straight line from the previous state, so more states resolve the path better;
    rigid bodies rotate by at most 15 degrees in one state. Without states the full load is one step. `slip(NAME)` and
    `stick_area(NAME)` measure the sliding, `dissipation(BODY)` the heat.

    In a dynamic analysis every time step is one such step. Pressure and friction are those of the end of the step, with
    any integrator. The dissipated heat never decreases; it is listed with the other energies in
    `solve.energies.friction`, and the largest slip and the sticking fraction of the forces in `solve.friction`. With an
    integrator without numerical damping, sticking nodes may oscillate from step to step with velocities below friction
    times g h / 2 (g gravity, h the time step); this motion does not grow. Surfaces that touch at the start of a motion
    are not pushed apart: their gap is measured from `distance`, so they may penetrate by as much there.

    In a static analysis contact, with or without friction, may hold a body that its supports leave free. The report
    lists the contacts that hold it and the rigid motions that remain free.
    """

    rigid: Annotated[str, "body", "the rigid body"]
    body: Annotated[str, "body", "the deformable body"]
    where: Annotated[Any, "condition", "part of its surface that may touch, by undeformed coordinates"] = EVERYWHERE
    friction: Annotated[float, "1 in [0, 10]", "Coulomb friction coefficient"] = 0.0
    distance: Annotated[
        float | None, "m in (0, inf)", "gap below which the barrier acts; default: from the size of the body"
    ] = None
