"""Ledger of the energies at each time of a motion, accumulated step by step."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from softmark.records import dataclass
from softmark.solvers.dynamics.dynamic_system import DynamicSystem
from softmark.solvers.dynamics.integrator import Motion
from softmark.solvers.energies.energy import Floats

NAMES = ("kinetic", "strain", "load_work", "support_work", "damping", "drift")


@dataclass(frozen=True)
class EnergyEntry:
    """Energies at one time, J (see `Trajectory`)."""

    motion: Motion
    internal: Floats  # minus the internal forces (dofs,), N
    kinetic: float
    strain: float
    load_work: float = 0.0
    support_work: float = 0.0
    damping: float = 0.0
    drift: float = 0.0
    muscle_work: float | None = None  # part of load_work done by muscle; None without muscle
    contact: float | None = None  # energy stored in contact barriers; None without contacts
    contact_work: float = 0.0  # of rigid bodies that move
    friction: float | None = None  # energy dissipated by friction; None without friction
    impulses: Floats | None = None  # (3, 3) N s, of loads, supports and damping; None without contacts

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the energies: NAMES, then those of muscle and of contacts if present."""
        muscle = () if self.muscle_work is None else ("muscle_work",)
        contact = () if self.contact is None else ("contact", "contact_work")
        friction = () if self.friction is None else ("friction",)
        return (*NAMES, *muscle, *contact, *friction)

    @property
    def values(self) -> tuple[float, ...]:
        """Energies in the order of `names`, J."""
        return tuple(float(getattr(self, name)) for name in self.names)

    def after_barrier_stiffening(self, system: DynamicSystem) -> EnergyEntry:
        """Return the entry after barriers were stiffened; the additional barrier energy is counted as drift."""
        stored = _barrier_energy(system, self.motion)
        more = (stored or 0.0) - (self.contact or 0.0)
        return replace(self, contact=stored, drift=self.drift + more)


def open_entry(system: DynamicSystem, motion: Motion) -> EnergyEntry:
    """Return the first entry, of the initial motion."""
    kinetic = 0.5 * float(motion.v @ (system.forces.M @ motion.v))
    known = system.problem.remembering
    strain = system.forces.strain(motion.x) if known is None else known.stored(motion.x)
    muscle = 0.0 if system.problem.pulling else None
    here = EnergyEntry(motion, system.forces.within(motion.x), kinetic, strain, muscle_work=muscle)
    if (impact := system.forces.impact) is None:
        return here
    rubbed = 0.0 if impact.has_friction else None
    return replace(here, contact=_barrier_energy(system, motion), friction=rubbed, impulses=np.zeros((3, 3)))


def _barrier_energy(system: DynamicSystem, motion: Motion) -> float | None:
    """Return the energy stored in contact barriers, J; None without contacts."""
    impact = system.forces.impact
    return None if impact is None else impact.at(motion.time).stored(motion.x)


def next_entry(system: DynamicSystem, last: EnergyEntry, motion: Motion) -> EnergyEntry:
    """Return the entry after a step.

    Work is trapezoidal, loads act with their mean over the step, and damping with the mean velocity.
    """
    here = open_entry(system, motion)
    h, way = motion.time - last.motion.time, motion.x - last.motion.x
    drag = system.damping.force(way / h) + system.damping.reaction(way / h)
    factors = system.forces.mean(last.motion.time, motion.time)
    pushed = 0.5 * (
        system.forces.load_gradient(last.motion.x, factors) + system.forces.load_gradient(motion.x, factors)
    )
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
        impulses = None if impulses is None else impulses + h * _force_resultants(system, -pushed, reaction, -drag)
        heat = touches.lost(motion.x) if impact.has_friction else 0.0
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
    muscle = _muscle_work(system, last, way, motion, factors)
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


def _force_resultants(system: DynamicSystem, loads: Floats, reaction: Floats, drag: Floats) -> Floats:
    """Return the resultants (3, 3), N, of loads, support reactions and damping forces on the deformable body."""
    held = np.zeros_like(reaction)
    held[system.forces.fixed] = reaction[system.forces.fixed]
    return np.array([system.forces.resultant(f) for f in (loads, held, drag)])


def _muscle_work(
    system: DynamicSystem, last: EnergyEntry, way: Floats, motion: Motion, factors: Floats
) -> float | None:
    """Return the work of muscle since the start, J; None without muscle.

    `last` is the entry before the step, and `way` (dofs,) the motion in the step.
    """
    if last.muscle_work is None:
        return None
    own = factors.copy()
    own[: len(own) - system.problem.pulling] = 0.0
    f = 0.5 * (system.forces.load_gradient(last.motion.x, own) + system.forces.load_gradient(motion.x, own))
    return last.muscle_work - float(f @ way)


def is_finite(entry: EnergyEntry) -> bool:
    """Return whether the motion and its energies are finite, so that they may be reported."""
    motion = entry.motion
    arrays = (motion.x, motion.v, motion.a, np.array(entry.values))
    return all(bool(np.all(np.isfinite(a))) for a in arrays)
