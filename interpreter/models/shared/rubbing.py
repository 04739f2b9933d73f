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
    from softmark.solvers.energies.energy import Energy, Floats
    from softmark.solvers.statics.problem import Statics


@dataclass(frozen=True)
class Rubbed:
    """What a state leaves of a contact with friction: the `contact` itself, with the anchors that it leaves.

    `slid` (m,) is how far each node has slid in all, m, `work` what friction has turned into heat up to this state, J,
    and `now` in it alone.
    """

    contact: Rubbing
    slid: Floats
    work: float
    now: float

    @property
    def anchors(self) -> Floats:
        """Points of the rigid body as it is declared (m, 3), m."""
        assert self.contact.anchors is not None
        return self.contact.anchors


Past = Mapping[str, Rubbed]


def past_of(contacts: Mapping[str, Touching], u: Floats, before: Past) -> dict[str, Rubbed]:
    """Of every contact with friction, after the displacements u (dofs,), m."""
    found = {}
    for name, contact in contacts.items():
        if isinstance(contact, Rubbing):
            slip, lost = contact.slip(u), contact.lost(u)
            slid = np.where(slip.t > 0.0, np.maximum(slip.size - slip.t / contact.spring, 0.0), 0.0)
            earlier = before.get(name)
            known = (np.zeros_like(slid), 0.0) if earlier is None else (earlier.slid, earlier.work)
            found[name] = Rubbed(replace(contact, anchors=contact.settled(u)), known[0] + slid, known[1] + lost, lost)
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
    return {n: replace(c, anchors=past[n].anchors) if n in past else c for n, c in contacts.items()}  # type: ignore[call-arg]


def begun(problem: Statics, x: Floats, contacts: Mapping[str, Touching], past: Past) -> Floats:
    """The state x (dofs,) before, carried along by what its nodes stick to."""
    from softmark.solvers.statics.friction import towed

    own = {id(contacts[name]): known.contact for name, known in past.items()}
    before: list[Energy] = [own.get(id(e), e) for e in problem.assembly.loads]
    return towed(problem, before, x)


def exchanged(problem: Statics, old: Mapping[str, Touching], new: Mapping[str, Touching]) -> Statics:
    """A problem with other contacts."""
    other = {id(old[n]): new[n] for n in old}
    loads: list[Energy] = [other.get(id(e), e) for e in problem.assembly.loads]
    assembly = problem.assembly.acting(problem.assembly.internal, loads)
    twin = None if problem.twin is None else problem.twin.acting(problem.twin.internal, loads)
    return replace(problem, assembly=assembly, twin=twin)
