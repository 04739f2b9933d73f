"""Rigid bodies driven by a force along one free direction in static analyses.

Their position along that direction is one scalar unknown, which solvers/statics/force_controlled_rigid_body.py
finds. Afterwards the rigid bodies are treated as if a support had prescribed that position.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from softmark.interpreter.models.shared.rigid_body_load_setup import driving_force
from softmark.interpreter.models.shared.rigid_contact_setup import PrescribedPosition
from softmark.interpreter.problem.body_case import Case, RigidBodyContact
from softmark.solvers.contact.interaction_state import InteractionState
from softmark.solvers.contact.rigid_friction import RigidFriction
from softmark.solvers.contact.rigid_transform import MovedGap, RigidMotion
from softmark.solvers.statics.force_controlled_rigid_body import ForceControl


def force_driven_problem(case: Case, contacts: Mapping[str, Any]) -> ForceControl | None:
    """Return the problem of the force-driven rigid body of a case; None if there is no such body."""
    touches = [touch for touch in case.contacts if touch.along is not None]
    if not touches:
        return None
    along = touches[0].along
    assert along is not None
    names = tuple(touch.name for touch in touches)
    begun = _rigid_body_translation(contacts[touches[0].name].earlier)[along]
    return ForceControl(along, driving_force(touches[0]), float(begun), names, _contact_at_travel)


def _contact_at_travel(contact: Any, d: float) -> Any:
    """Return a contact whose rigid body has moved by the distance d, m, along its free direction."""
    moving: PrescribedPosition = contact.posed
    posed = replace(moving, touch=replace(moving.touch, force_travel=d))
    known: dict[str, Any] = {"posed": posed}
    if isinstance(contact, RigidFriction):
        known["carries"] = posed.pose
    return replace(contact, **known)


def _rigid_body_translation(body: Any) -> tuple[float, float, float]:
    """Return the translation (x, y, z), m, of a rigid body from its declared position."""
    return body.pose.shift if isinstance(body, MovedGap) else RigidMotion().shift


def move_rigid_bodies(case: Case, states: Mapping[str, InteractionState]) -> Case:
    """Return a case with its force-driven rigid bodies moved to their positions in a solved state.

    `states` has the states of the contacts, by name.
    """

    def each(touch: RigidBodyContact) -> RigidBodyContact:
        """Return a contact with its rigid body moved; the contact itself if its rigid body is not driven by a load."""
        if touch.along is None or touch.name not in states:
            return touch
        return replace(touch, force_travel=float(_rigid_body_translation(states[touch.name].body)[touch.along]))

    return replace(case, contacts=tuple(map(each, case.contacts)))


def rigid_body_report(case: Case, known: Mapping[str, Any]) -> dict[str, Any]:
    """Return the `rigid` part of a report: results of each force-driven rigid body, by its name.

    `known` has the results of the solver, such as the travel `travel_m`.
    """
    touch = next(touch for touch in case.contacts if touch.along is not None)
    assert touch.along is not None
    way, force = np.zeros((2, 3))
    way[touch.along], force[touch.along] = known["travel_m"], driving_force(touch)
    own = {"travel_m": way.tolist(), "force_N": force.tolist(), **{n: v for n, v in known.items() if n != "travel_m"}}
    return {touch.rigid.name: own}
