"""Contact in dynamics: moving rigid bodies, and contact forces that act at the end of every step.

Whatever weights an integrator gives to other forces, contact forces c act with their whole impulse at the end of the
step (Kane, Repetto, Ortiz and Marsden 1999, Comput. Methods Appl. Mech. Eng. 180:1). With

    x1 - x0 = h (v0 + v1) / 2  and  v1 - v0 = h M^-1 c(x1) + ...,

contact changes the kinetic energy by c(x1) . (x1 - x0). If the gap is convex in x along the surface, this is at most
the decrease of the contact potential, so an impact dissipates or conserves energy. If contact forces were weighted
between the ends of the step, they would act after contact has ended, and add energy.

Friction is part of c, evaluated with the pressures at the end of the step, and dissipates energy for the same reason.
With the traction t and the elastic slip e = t / k of sticking nodes, t1 . (x1 - x0) exceeds the change of the stored
energy k (e1^2 - e0^2) / 2 by at least t1 times the slip. The next step starts from the anchors at the end of the last
one (contact/rigid_friction.py).

Contact between deformable surfaces is treated in the same way (contact/deformable_contact.py,
contact/deformable_friction.py): action and reaction at the end of a step are equal and act at the same place.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import sparse

from softmark.records import dataclass
from softmark.solvers.contact.continuous_collision import PointsInBodyFrame, has_passed_through, locate_contact_points
from softmark.solvers.contact.rigid_contact import RigidContact
from softmark.solvers.dynamics.contact_output import (
    ContactResultant,
    SurfaceRecord,
    pair_contact_resultant,
    rigid_contact_resultant,
)
from softmark.solvers.dynamics.integrator import BarrierTooSoft, FacetPenetration, StepFailed
from softmark.solvers.energies.energy import DynamicPatternEnergy, Floats, Ints
from softmark.solvers.runtime.work_count import count_contact_search

if TYPE_CHECKING:
    from softmark.solvers.dynamics.integrator import Motion
    from softmark.solvers.dynamics.load_amplitudes import Amplitude

STIFFER = 8.0  # factor by which a penetrated barrier is stiffened
FLIGHT = 4.0  # steps: shorter separations count as contact
ROUNDS = 8  # largest number of times that contact points are added in a step
STIFFEST = 1e9  # largest total stiffening factor in double precision


class DynamicContacts:
    """All contacts of a dynamic analysis, with the amplitudes of their rigid bodies.

    The barrier of a contact is stiffened if points end a step inside its rigid body. `contacts` are those with rigid
    bodies, and `meets` those between deformable surfaces.
    """

    def __init__(
        self,
        contacts: Sequence[RigidContact],
        amplitudes: Sequence[Amplitude],
        slots: Sequence[Ints],
        meets: Sequence[DynamicPatternEnergy] = (),
        couple: Callable[[Ints], Ints] | None = None,
    ) -> None:
        self.contacts: list[Any] = list(contacts)
        self.meets: list[Any] = list(meets)
        self.amplitudes, self.slots = tuple(amplitudes), list(slots)
        # first unknown of free rigid bodies
        self.free = min((c.free.first for c in self.contacts if hasattr(c, "free")), default=None)
        self.has_friction = any(c.has_friction for c in (*contacts, *meets))
        self._met: list[Floats | float] = [0.0 for _ in meets]  # accumulated slip of samples of deformable contacts
        self._first = [c.barrier.stiffness for c in contacts]
        self.stiffened = 0  # number of stiffenings
        self.log: list[ContactRecord] = []
        self.mass = 0.0  # mass of the deformable body, kg
        self.surfaces = SurfaceRecord(self.contacts, self.meets)
        self.couple, self._rounds = couple, 0  # maps stencils to tangent entries; None: no points can be added
        self._shares: tuple[float, ...] = ()

    def at(self, time: float) -> ContactsAtTime:
        """Return all contacts with the rigid bodies at their positions at a time, s."""
        posed = [c.at(amplitude.at(time)) for c, amplitude in zip(self.contacts, self.amplitudes, strict=True)]
        return ContactsAtTime(posed, self.slots, self.meets)

    def contact_changed(self, start: Motion, end: Motion) -> bool:
        """Return whether contact has begun or ended in a step, where velocities jump."""
        before, after = self.at(start.time), self.at(end.time)
        return any(
            bool(np.any((b.gaps(start.x) < b.barrier.distance) != (a.gaps(end.x) < a.barrier.distance)))
            for b, a in zip(before.posed, after.posed, strict=True)
        ) or any(bool(np.any(c.samples_in_contact(start.x) != c.samples_in_contact(end.x))) for c in self.meets)

    def record_step(self, motion: Motion, momentum: Floats, mass: float) -> None:
        """Record an accepted step: contact, friction, resultants, and the velocity of the centre of mass."""
        here, self._rounds = self.at(motion.time), 0
        rubbed = tuple(self._update_rigid_friction(i, c, motion.x) for i, c in enumerate(here.posed) if c.has_friction)
        rubbed += tuple(
            self._update_deformable_friction(i, c, motion.x) for i, c in enumerate(self.meets) if c.has_friction
        )
        touches = any(c.gaps(motion.x).min(initial=np.inf) < c.barrier.distance for c in here.posed)
        shares = tuple(c.share for c in here.posed)
        moved = self.free is not None or shares != self._shares
        driven, self._shares = bool(self.log) and moved, shares
        acts = tuple(rigid_contact_resultant(c, motion.x) for c in here.posed) + tuple(
            pair_contact_resultant(c, motion.x) for c in here.meets
        )
        step = 0.0
        if self.log:
            step = motion.time - self.log[-1].time
            acts = tuple(a.after(b, step, motion.given) for a, b in zip(acts, self.log[-1].acts, strict=True))
        self.surfaces.record_step(here.posed, here.meets, motion.x, step)
        self.mass = mass
        for i, own in enumerate(self.contacts):  # drop added points without contact force
            if own.extra is not None:
                contact = own.at(self.amplitudes[i].at(motion.time))
                left = replace(contact, earlier=contact.body).without_unloaded_points(motion.x)
                if left.extra is not contact.extra:
                    self._replace_contact(i, left)
        self.log.append(ContactRecord(motion.time, touches, momentum / mass, driven, rubbed, acts))

    def _update_rigid_friction(self, i: int, here: Any, x: Floats) -> FrictionResult:
        """Update the friction anchors of rigid contact number i after a step, and return its friction result."""
        p, (_, held, area) = here.A * here.pressures(x), here.stick_masks_and_fraction(x)
        sticks = float(p[held].sum() / p.sum()) if p.any() else None
        gone, lost = here.gone + here.slid(x), here.lost(x)
        self.contacts[i] = self.contacts[i].with_anchors(here.final_anchors(x), gone)
        slip = float(np.max(np.where(p > 0.0, gone, 0.0), initial=0.0))
        return FrictionResult(slip, sticks, area, lost)

    def _update_deformable_friction(self, i: int, here: Any, x: Floats) -> FrictionResult:
        """Update the friction history of deformable contact number i after a step, and return its friction result."""
        hold = here.tangential_coupling(x)
        since, slid, heat = here.final_history(x)
        N, A, held = hold.N, here.skin.A[hold.which], ~hold.slip(x, here.friction).slides
        sticks = float(N[held].sum() / N.sum()) if N.any() else None
        self._met[i] = whole = self._met[i] + slid
        self.meets[i] = here.with_history(since)
        area = float(A[held].sum() / A.sum()) if len(A) else 0.0
        return FrictionResult(float(np.max(whole[hold.which], initial=0.0)), sticks, area, heat)

    def check_step_end(self, start: Motion, end: Motion, time: float) -> None:
        """Check the contacts at the end of a step.

        Raises BarrierTooSoft if a point ends inside a rigid body, and StepFailed if a point has passed through one.
        """
        here = self.at(time)
        if here.passed(end.x, self.at(start.time).places(start.x)):
            raise StepFailed("a point of the surface passes through a rigid body")
        for i, contact in enumerate(here.posed):
            if contact.gaps(end.x).min(initial=1.0) <= 0.0:
                self._stiffen_barrier(i)
        self._add_contact_points(start, end, here)

    def _add_contact_points(self, start: Motion, end: Motion, here: ContactsAtTime) -> None:
        """Add contact points to facets that penetrate a rigid body between points.

        Raises FacetPenetration, so that the step is repeated.
        """
        if self.couple is None or self._rounds > ROUNDS or all(c.facing is None for c in here.posed):
            return
        from softmark.solvers.contact.facet_penetration import MOST, find_penetrating_points, presses_off_surface

        last = self._rounds == ROUNDS  # last round: drop points without contact force
        before, found = self.at(start.time), False
        for i, contact in enumerate(here.posed):
            extra = None if last else find_penetrating_points(contact, end.x)
            if extra is None and not (last and presses_off_surface(contact, end.x, MOST)):
                continue
            found = True
            known = replace(self.contacts[i], earlier=before.posed[i].body)
            self._replace_contact(i, known.with_added_points(extra, start.x))
        self._rounds += 1
        if found:
            raise FacetPenetration("facets of the surface end inside a rigid body")

    def _replace_contact(self, i: int, contact: Any) -> None:
        """Replace contact number i by the same contact with other points."""
        assert self.couple is not None
        self.contacts[i], self.slots[i] = contact, self.couple(contact.stencils)

    def _stiffen_barrier(self, i: int) -> None:
        """Stiffen the barrier of contact number i.

        Raises BarrierTooSoft, so that the step is repeated, or StepFailed if the barrier has its largest stiffness.
        """
        barrier = self.contacts[i].barrier
        if barrier.stiffness * STIFFER > STIFFEST * self._first[i]:
            raise StepFailed("a point of the surface ends inside a rigid body")
        self.contacts[i] = self.contacts[i].stiffer(STIFFER)
        self.stiffened += 1
        raise BarrierTooSoft("a point of the surface ends inside a rigid body")


@dataclass(frozen=True)
class FrictionResult:
    """Friction result of one contact at one time.

    `slip`, m, is the largest accumulated slip of a node in contact. `sticks` is the fraction of the contact force at
    sticking points, or None without contact force. `area` is the sticking fraction of the contact area, and `heat` the
    energy dissipated by friction in the step, J.
    """

    slip: float
    sticks: float | None
    area: float = 0.0
    heat: float = 0.0


@dataclass(frozen=True)
class ContactRecord:
    """Contact record at one `time`, s: whether there is contact, and the velocity (3,), m/s, of the centre of mass."""

    time: float
    touches: bool
    velocity: Floats
    driven: bool = False  # rigid bodies moved since the previous step
    rubbed: tuple[FrictionResult, ...] = ()  # results of every contact with friction
    acts: tuple[ContactResultant, ...] = ()  # resultant of every contact over the step


@dataclass(frozen=True)
class ImpactEvent:
    """Impact: its begin and end, s, and the velocities (3,), m/s, of the centre of mass before and after."""

    begin: float
    end: float
    before: Floats
    after: Floats
    driven: bool = False  # the rigid bodies were moving

    @property
    def restitution(self) -> float | None:
        """Coefficient of restitution along the impulse.

        It is None if the rigid body moved, or the body did not approach it.
        """
        n = self.after - self.before
        brought = -float(n @ self.before)
        return None if self.driven or brought <= 0.0 else float(n @ self.after) / brought


def find_impacts(log: Sequence[ContactRecord]) -> list[ImpactEvent]:
    """Return the impacts of a motion, each between two free flights.

    A free flight is at least as long as the shorter of the contacts before and after it. A shorter interruption of
    contact is chatter: nodes leave a wall and return while the body still presses on it.
    """
    times, runs = [seen.time for seen in log], list[list[int]]()
    for i, seen in enumerate(log):
        if not seen.touches:
            continue
        if runs and times[i] - times[runs[-1][1]] <= max(
            times[runs[-1][1]] - times[runs[-1][0]], FLIGHT * _step_length(times, i)
        ):
            runs[-1][1] = i
        else:
            runs.append([i, i])
    return [
        ImpactEvent(
            times[a - 1],
            times[b + 1],
            log[a - 1].velocity,
            log[b + 1].velocity,
            any(seen.driven for seen in log[a : b + 2]),
        )
        for a, b in runs
        if a and b + 1 < len(log)
    ]


def _step_length(times: Sequence[float], i: int) -> float:
    """Return the length of the step that ended at time i, s."""
    return times[i] - times[i - 1] if i else 0.0


class ContactsAtTime:
    """All contacts at one time: with rigid bodies in position (`posed`), and between deformable surfaces (`meets`)."""

    def __init__(
        self, posed: Sequence[RigidContact], slots: Sequence[Ints], meets: Sequence[DynamicPatternEnergy] = ()
    ) -> None:
        self.slots = slots
        self.posed: list[Any] = list(posed)  # with or without friction
        self.meets: list[Any] = list(meets)

    @property
    def all_contacts(self) -> tuple[Any, ...]:
        """All contacts: with rigid bodies, then between deformable surfaces."""
        return (*self.posed, *self.meets)

    @property
    def has_friction(self) -> bool:
        """True if some contact has friction that depends on the present pressures."""
        return any(c.has_friction for c in self.all_contacts)

    def value(self, x: Floats) -> float:
        """Return the energy of the barriers, J; infinite if deformable surfaces intersect."""
        return sum(float(c.value(x)) for c in self.all_contacts)

    def stored(self, x: Floats) -> float:
        """Return the recoverable energy, J; with friction it is less than `value`."""
        return sum(float(c.stored(x)) for c in self.all_contacts)

    def lost(self, x: Floats) -> float:
        """Return the energy dissipated by friction over a step that ends in x, J."""
        return sum(float(c.lost(x)) for c in self.all_contacts if c.has_friction)

    def lagged(self, x: Floats, before: ContactsAtTime | None = None) -> ContactsAtTime:
        """Return the contacts with friction lagged at the pressures of a state x, so that friction has an energy.

        `before` are the contacts whose friction law determines these pressures.
        """
        was = self if before is None else before
        both: Any = zip(self.all_contacts, was.all_contacts, strict=True)
        each: list[Any] = [c.with_lagged_pressures(x, b) if c.has_friction else c for c, b in both]
        count = len(self.posed)
        return ContactsAtTime(each[:count], self.slots, each[count:])

    def gradient(self, x: Floats) -> Floats:
        """Return the negative contact forces (dofs,), N."""
        g = np.zeros(len(x))
        for contact in self.all_contacts:
            contact.add_gradient(x, g)
        return g

    def add_hessian(self, x: Floats, data: Floats, scale: float, projected: bool) -> None:
        """Add `scale` times the stiffness of rigid contacts to the entries data (nnz,)."""
        for contact, slots in zip(self.posed, self.slots, strict=True):
            contact.add_hessian(x, data, slots, scale, projected)

    def with_deformable_stiffness(
        self, x: Floats, J: sparse.csr_matrix, free: Ints, scale: float, projected: bool
    ) -> sparse.csr_matrix:
        """Return the matrix J (free, free) plus `scale` times the stiffness of deformable contacts, which adds entries.

        `free` are the numbers of the free degrees of freedom.
        """
        for energy in self.meets:
            count_contact_search()
            J = (J + scale * energy.matrix(x, projected)[free][:, free]).tocsr()
        return J

    def limit(self, x: Floats, d: Floats) -> float:
        """Return the fraction of an increment d (dofs,), at most 1, up to which deformable surfaces do not collide."""
        return min((energy.limit(x, d) for energy in self.meets), default=1.0)

    def rounding(self, x: Floats) -> float:
        """Return the norm of the rounding error in the contact forces, N."""
        return sum(float(c.rounding(x)) for c in self.all_contacts)

    def places(self, x: Floats) -> list[PointsInBodyFrame]:
        """Return the positions of the contact points in the frame of each rigid body."""
        return [locate_contact_points(c, x) for c in self.posed]

    def passed(self, x: Floats, start: Sequence[PointsInBodyFrame]) -> bool:
        """Return whether a point has passed through a rigid body since its positions `start` in the body frame."""
        return any(has_passed_through(a, b) for a, b in zip(start, self.places(x), strict=True))

    def work(self, x: Floats, since: ContactsAtTime) -> float:
        """Return the work of the rigid bodies since the contacts `since`, J.

        It is the forces at the end times the displacement of the rigid surfaces.
        """
        both = zip(self.posed, since.posed, strict=True)
        return sum(float(c.work(x, s)) for c, s in both if c.share != s.share)
