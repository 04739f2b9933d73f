"""Rigid bodies that loads press at rest, along the one way that is left to them: what a scene says, as one number.

The place that they come to is found (solvers/statics/force_controlled_rigid_body.py); from then on they are as if a
support had taken them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from softmark.interpreter.models.shared.rigid_body_load_setup import force_on
from softmark.interpreter.models.shared.rigid_contact_setup import Moving
from softmark.interpreter.problem.body_case import Case, Touch
from softmark.solvers.contact.rigid_friction import Rubbing
from softmark.solvers.contact.rigid_transform import Pose, Posed
from softmark.solvers.statics.force_controlled_rigid_body import Press


def press_of(case: Case, contacts: Mapping[str, Any]) -> Press | None:
    """What presses the rigid body of a case that loads move; None where there is none."""
    touches = [touch for touch in case.contacts if touch.along is not None]
    if not touches:
        return None
    along = touches[0].along
    assert along is not None
    first = [*contacts].index
    numbers = tuple(first(touch.name) - len(contacts) for touch in touches)  # they are the last of the loads
    begun = _shift(contacts[touches[0].name].earlier)[along]
    return Press(along, force_on(touches[0]), float(begun), numbers, _placed)


def _placed(contact: Any, d: float) -> Any:
    """A contact whose rigid body loads have pressed so far, m."""
    moving: Moving = contact.posed
    posed = replace(moving, touch=replace(moving.touch, gone=d))
    known: dict[str, Any] = {"posed": posed}
    if isinstance(contact, Rubbing):
        known["carries"] = posed.pose
    return replace(contact, **known)


def _shift(body: Any) -> tuple[float, float, float]:
    """How far a rigid body has gone from where it was declared, m."""
    return body.pose.shift if isinstance(body, Posed) else Pose().shift


def settled(case: Case, beside: Mapping[str, Any]) -> Case:
    """A case whose rigid bodies loads have pressed to where a state has them, by contact."""

    def each(touch: Touch) -> Touch:
        if touch.along is None or touch.name not in beside:
            return touch
        return replace(touch, gone=float(_shift(beside[touch.name])[touch.along]))

    return replace(case, contacts=tuple(map(each, case.contacts)))


def told(case: Case, known: Mapping[str, Any]) -> dict[str, Any]:
    """What a report says of the rigid body that loads press: `rigid`, by its name, of what solving it has found."""
    touch = next(touch for touch in case.contacts if touch.along is not None)
    assert touch.along is not None
    way, force = np.zeros((2, 3))
    way[touch.along], force[touch.along] = known["travel_m"], force_on(touch)
    own = {"travel_m": way.tolist(), "force_N": force.tolist(), **{n: v for n, v in known.items() if n != "travel_m"}}
    return {touch.rigid.name: own}
