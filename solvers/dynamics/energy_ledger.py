"""The balance of energy along a motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from softmark.records import dataclass
from softmark.solvers.dynamics.implicit_step import System
from softmark.solvers.dynamics.integrator import Motion
from softmark.solvers.energies.energy import Floats

NAMES = ("kinetic", "strain", "load_work", "support_work", "damping", "drift")


@dataclass(frozen=True)
class Entry:
    """Energies at a time, J (see Trajectory)."""

    motion: Motion
    internal: Floats  # minus the internal forces (dofs,), N
    kinetic: float
    strain: float
    load_work: float = 0.0
    support_work: float = 0.0
    damping: float = 0.0
    drift: float = 0.0
    muscle_work: float | None = None  # of what loads do, what muscle does; None where there is none
    contact: float | None = None  # what the barriers of contacts store; None where there are none
    contact_work: float = 0.0  # of rigid bodies that move
    friction: float | None = None  # what friction has turned into heat; None where nothing rubs
    impulses: Floats | None = None  # (3, 3) N s, of loads, supports and damping; None without contacts

    @property
    def names(self) -> tuple[str, ...]:
        """NAMES, and then those of muscle and of contacts where there are some."""
        muscle = () if self.muscle_work is None else ("muscle_work",)
        contact = () if self.contact is None else ("contact", "contact_work")
        friction = () if self.friction is None else ("friction",)
        return (*NAMES, *muscle, *contact, *friction)

    @property
    def values(self) -> tuple[float, ...]:
        """In the order of its names."""
        return tuple(float(getattr(self, name)) for name in self.names)

    def stiffened(self, system: System) -> Entry:
        """The same with barriers that have been made stiffer: what they store more came from nowhere."""
        stored = _stored(system, self.motion)
        more = (stored or 0.0) - (self.contact or 0.0)
        return replace(self, contact=stored, drift=self.drift + more)


def open_entry(system: System, motion: Motion) -> Entry:
    """Energies of a motion by itself."""
    kinetic = 0.5 * float(motion.v @ (system.forces.M @ motion.v))
    known = system.problem.remembering
    strain = system.forces.strain(motion.x) if known is None else known.stored(motion.x)
    muscle = 0.0 if system.problem.pulling else None
    here = Entry(motion, system.forces.within(motion.x), kinetic, strain, muscle_work=muscle)
    if (impact := system.forces.impact) is None:
        return here
    rubbed = 0.0 if impact.rubs else None
    return replace(here, contact=_stored(system, motion), friction=rubbed, impulses=np.zeros((3, 3)))


def _stored(system: System, motion: Motion) -> float | None:
    """What the barriers of contacts store, J."""
    impact = system.forces.impact
    return None if impact is None else impact.at(motion.time).stored(motion.x)


def next_entry(system: System, last: Entry, motion: Motion) -> Entry:
    """Work over a step by the trapezoidal rule, of loads by their mean over it; damping by the mean velocity."""
    here = open_entry(system, motion)
    h, way = motion.time - last.motion.time, motion.x - last.motion.x
    drag = system.damping.force(way / h) + system.damping.reaction(way / h)
    factors = system.forces.mean(last.motion.time, motion.time)
    pushed = 0.5 * (system.forces.pushed(last.motion.x, factors) + system.forces.pushed(motion.x, factors))
    mean = 0.5 * (last.internal + here.internal) + pushed
    reaction = system.forces.M @ ((motion.v - last.motion.v) / h) + mean + drag
    if (turning := system.problem.turning) is not None:
        reaction += 0.5 * (turning.gyroscopic(last.motion.v) + turning.gyroscopic(motion.v))
    impulses = last.impulses
    pressed, contact_work, friction = 0.0, last.contact_work, last.friction
    if (impact := system.forces.impact) is not None:
        since, touches = impact.at(last.motion.time), impact.at(motion.time)
        contact_work += touches.work(motion.x, since)
        reaction += touches.gradient(motion.x)
        impulses = None if impulses is None else impulses + h * _sums(system, -pushed, reaction, -drag)
        heat = touches.lost(motion.x) if impact.rubs else 0.0
        friction = None if friction is None else friction + heat
        pressed = (here.contact or 0.0) - (last.contact or 0.0) - (contact_work - last.contact_work) + heat
    fixed = system.forces.fixed
    load_work = last.load_work - float(pushed @ way)
    support_work = last.support_work + float(reaction[fixed] @ way[fixed])
    damping = last.damping + float(drag @ way)
    if (known := system.problem.remembering) is not None:
        damping += known.lost
    gained = here.kinetic + here.strain - last.kinetic - last.strain
    spent = (load_work - last.load_work) + (support_work - last.support_work) - (damping - last.damping)
    drift = last.drift + gained + pressed - spent
    muscle = _pulled(system, last, way, motion, factors)
    return replace(
        here,
        load_work=load_work,
        support_work=support_work,
        damping=damping,
        drift=drift,
        muscle_work=muscle,
        contact_work=contact_work,
        friction=friction,
        impulses=impulses,
    )


def _sums(system: System, loads: Floats, reaction: Floats, drag: Floats) -> Floats:
    """What acts on the body that deforms (3, 3), N: forces on degrees of freedom, of supports where they hold."""
    held = np.zeros_like(reaction)
    held[system.forces.fixed] = reaction[system.forces.fixed]
    return np.array([system.forces.resultant(f) for f in (loads, held, drag)])


def _pulled(system: System, last: Entry, way: Floats, motion: Motion, factors: Floats) -> float | None:
    """The work of muscle since the start, J; None where there is none. The last of the loads are muscle."""
    if last.muscle_work is None:
        return None
    own = factors.copy()
    own[: len(own) - system.problem.pulling] = 0.0
    f = 0.5 * (system.forces.pushed(last.motion.x, own) + system.forces.pushed(motion.x, own))
    return last.muscle_work - float(f @ way)


def finite(entry: Entry) -> bool:
    """Whether the motion and its energies are numbers, so that it may be shown."""
    motion = entry.motion
    arrays = (motion.x, motion.v, motion.a, np.array(entry.values))
    return all(bool(np.all(np.isfinite(a))) for a in arrays)
