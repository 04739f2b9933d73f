"""Friction from state to state: what a state leaves of anchors, and a model that starts from them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from softmark.interpreter.results.reactions import Friction
from softmark.records import dataclass
from softmark.solvers.contact.rubbing import Rubbing

PRESSED = 1e-6  # of the largest pressure: what is less is no contact
LEAST = 1e-300  # N

if TYPE_CHECKING:
    from softmark.interpreter.results.reactions import Touch
    from softmark.solvers.contact.touching import Touching
    from softmark.solvers.energies.energy import Floats


@dataclass(frozen=True)
class Rubbed:
    """What a state leaves of a contact with friction.

    `anchors` (m, 3) are points of the rigid body as it is declared, m, and `slid` (m,) how far each node has slid in
    all, m. `work` is what friction has turned into heat up to this state, J, and `now` in it alone.
    """

    anchors: Floats
    slid: Floats
    work: float
    now: float


Past = Mapping[str, Rubbed]


def past_of(contacts: Mapping[str, Touching], u: Floats, before: Past) -> dict[str, Rubbed]:
    """Of every contact with friction, after the displacements u (dofs,), m."""
    found = {}
    for name, contact in contacts.items():
        if isinstance(contact, Rubbing):
            slid, lost = contact.slid(u), contact.lost(u)
            earlier = before.get(name)
            known = (np.zeros_like(slid), 0.0) if earlier is None else (earlier.slid, earlier.work)
            found[name] = Rubbed(contact.settled(u), known[0] + slid, known[1] + lost, lost)
    return found


def slipped(touch: Touch, contact: Touching, u: Floats, own: Rubbed | None) -> Touch:
    """What a contact comes to, with what friction makes of it; without friction nothing is added."""
    if own is None or not isinstance(contact, Rubbing):
        return touch
    p = contact.pressures(u)
    pressed = p > PRESSED * p.max(initial=0.0)
    sticks = pressed & ~contact.slip(u).slides
    slip, area = float(own.slid[pressed].max(initial=0.0)), float(contact.A[sticks].sum())
    held = float((contact.A * p)[sticks].sum() / max((contact.A * p).sum(), LEAST))
    return replace(touch, rubbing=Friction(slip, held, area, own.now))


def resumed(contacts: Mapping[str, Touching], past: Past) -> dict[str, Touching]:
    """Contacts that go on from where a state has left their anchors."""
    return {n: replace(c, anchors=past[n].anchors) if isinstance(c, Rubbing) else c for n, c in contacts.items()}
