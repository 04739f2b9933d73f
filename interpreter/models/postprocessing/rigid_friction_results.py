"""Friction results of a contact with a rigid body: slip, sticking share and dissipation in a solved state."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.interpreter.results.reaction_results import ContactNumbers, Friction
from softmark.solvers.contact.rigid_friction import RigidFriction

LEAST = 1e-300  # N

if TYPE_CHECKING:
    from softmark.interpreter.models.shared.rigid_contact_setup import Bools
    from softmark.solvers.contact.interaction_state import FrictionState
    from softmark.solvers.contact.rigid_contact import RigidContact
    from softmark.solvers.energies.energy import Floats


def add_friction_result(
    touch: ContactNumbers, contact: RigidContact, u: Floats, own: FrictionState | None
) -> ContactNumbers:
    """Return a contact result with slip, sticking share and dissipation added; unchanged for a frictionless contact.

    `own` is the friction state of this contact.
    """
    if own is None or not isinstance(contact, RigidFriction):
        return touch
    pressed, sticks, share = contact.stick_masks_and_fraction(u)
    push = contact.A * contact.pressures(u)
    slip, held = float(own.slid[pressed].max(initial=0.0)), float(push[sticks].sum() / max(push.sum(), LEAST))
    field: Any = touch.field
    seen = (
        None if field is None else replace(field, rubbed=_nodal_friction(contact, push, sticks, own.slid, len(field.X)))
    )
    return replace(touch, rubbing=Friction(slip, held, share * touch.area, own.now), field=seen)


def _nodal_friction(contact: RigidContact, push: Floats, sticks: Bools, slid: Floats, nodes: int) -> dict[str, Floats]:
    """Return the nodal slip and sticking state of a contact with a rigid body.

    `push` (p,), N, are normal forces of contact points, `sticks` (p,) their state and `slid` (p,), m, their slip.
    """
    from softmark.interpreter.models.postprocessing.contact_results import nodal_friction_results

    def to_nodes(values: Floats) -> Floats:
        """Return nodal sums of values (p,) of contact points."""
        found = np.zeros(nodes)
        np.add.at(found, contact.of, np.abs(contact.shares) * values[:, None])
        return found

    return nodal_friction_results(to_nodes, contact.A, slid, push, np.where(sticks, push, 0.0))
