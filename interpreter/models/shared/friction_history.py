"""Friction history: anchors, slip and dissipation recorded with a state, and contacts that continue from them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.interpreter.results.reaction_results import ContactNumbers, Friction
from softmark.records import dataclass
from softmark.solvers.contact.deformable_friction import DeformableFriction
from softmark.solvers.contact.rigid_friction import RigidFriction

LEAST = 1e-300  # N

if TYPE_CHECKING:
    from softmark.interpreter.models.shared.rigid_contact_setup import Bools
    from softmark.solvers.contact.rigid_contact import RigidContact
    from softmark.solvers.contact.surface_points import SurfacePoints
    from softmark.solvers.energies.energy import Energy, Floats


@dataclass(frozen=True)
class FrictionHistory:
    """Friction history of one contact after a solved state.

    For contact with a rigid body, `anchors` (m, 3), m, are the points of the rigid body in its declared position at
    which the `points` of the surface last stuck. For contact between deformable surfaces, `anchors` is a
    `FrictionHistory` of solvers/contact/deformable_friction.py. `slid` (m,) is the accumulated slip of each point or
    contact sample, m. `work` is the heat dissipated by friction up to and including this state, J, and `now` the heat
    of this state only, J.
    """

    anchors: Any
    slid: Floats
    work: float
    now: float
    points: SurfacePoints | None = None


Past = Mapping[str, FrictionHistory]


def histories_after(contacts: Mapping[str, Energy], u: Floats, before: Past) -> dict[str, FrictionHistory]:
    """Return the friction history of every contact with friction at displacements u (dofs,), m.

    `before` has the histories of the previous state, by contact.
    """
    found = {}
    for name, contact in contacts.items():
        anchors: Any
        points = None
        if isinstance(contact, DeformableFriction):
            anchors, slid, lost = contact.final_history(u)
        elif isinstance(contact, RigidFriction):
            anchors, slid, lost = contact.final_anchors(u), contact.gone + contact.slid(u), contact.lost(u)
            points = contact.points
        else:
            continue
        work = before[name].work if name in before else 0.0
        if name in before and isinstance(contact, DeformableFriction):
            slid = before[name].slid + slid
        found[name] = FrictionHistory(anchors, slid, work + lost, lost, points)
    return found


def add_friction_result(
    touch: ContactNumbers, contact: RigidContact, u: Floats, own: FrictionHistory | None
) -> ContactNumbers:
    """Return a contact result with slip, sticking share and dissipation added; unchanged for a frictionless contact.

    `own` is the friction history of this contact.
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


def resume_contacts(contacts: Mapping[str, Energy], past: Past) -> dict[str, Energy]:
    """Return contacts that continue from the friction history of an earlier state."""
    return {
        name: _resume_contact(contact, past[name]) if contact.has_friction else contact
        for name, contact in contacts.items()
    }


def _resume_contact(contact: Any, own: FrictionHistory) -> Energy:
    """Return one contact that continues from the anchors and the slip of its friction history `own`."""
    found: Energy = (
        replace(contact, since=own.anchors)
        if isinstance(contact, DeformableFriction)
        else replace(contact, anchors=own.anchors, gone=own.slid)
    )
    return found
