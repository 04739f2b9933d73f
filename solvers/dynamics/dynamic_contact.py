"""Contacts in time: rigid bodies that move by courses, and forces of contact that act at the end of every step.

Whatever weights an integrator gives to other forces, those of contact enter with their whole impulse as they are at
the end of the step (Kane, Repetto, Ortiz and Marsden 1999, Comput. Methods Appl. Mech. Eng. 180:1): where

    x1 - x0 = h (v0 + v1) / 2  and  v1 - v0 = h M^-1 c(x1) + ...,

contact changes the kinetic energy by c(x1) . (x1 - x0), which for a gap that is convex in x along the surface is no
more than its potential gives: an impact takes energy or keeps it. Weighted between the ends of the step, it would
act on where there is no touch any more, and bring energy.

Friction is a part of c, of the pressures of the end of the step, and takes energy for the same reason: with t the
traction and e = t / k what nodes that stick give way by, t1 . (x1 - x0) is no less than what k (e1^2 - e0^2) / 2
stores, and more by t1 times slip. What a step leaves of anchors (contact/rigid_friction.py), the next one starts from.

Surfaces that both deform meet in the same way (contact/deformable_contact.py, contact/deformable_friction.py): what
one does to the other at the end of a step, the other does to it, at the same place.
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
from softmark.solvers.dynamics.contact_output import Acting, Surfaces, acting, meeting
from softmark.solvers.dynamics.integrator import CutsIn, StepFailed, TooSoft
from softmark.solvers.energies.energy import DynamicPatternEnergy, Floats, Ints

if TYPE_CHECKING:
    from softmark.solvers.dynamics.integrator import Motion
    from softmark.solvers.dynamics.load_amplitudes import Course

STIFFER = 8.0  # times: the barrier that an impact has closed
FLIGHT = 4.0  # steps without contact: fewer are none
ROUNDS = 8  # of more points in a step, at most: what still cuts in then stays
STIFFEST = 1e9  # times what it was: more is no barrier for double precision


class Impact:
    """The contacts of a march, each with the course of its rigid body; barriers are stiffened where they must be."""

    def __init__(
        self,
        contacts: Sequence[RigidContact],
        courses: Sequence[Course],
        slots: Sequence[Ints],
        meets: Sequence[DynamicPatternEnergy] = (),
        couple: Callable[[Ints], Ints] | None = None,
    ) -> None:
        self.contacts: list[Any] = list(contacts)
        self.meets: list[Any] = list(meets)
        self.courses, self.slots = tuple(courses), list(slots)
        self.free = min((c.free.first for c in self.contacts if hasattr(c, "free")), default=None)  # unknowns of theirs
        self.rubs = any(c.rubs for c in (*contacts, *meets))
        self._met: list[Floats | float] = [0.0 for _ in meets]  # and each sample of surfaces that both deform
        self._first = [c.barrier.stiffness for c in contacts]
        self.stiffened = 0  # how often
        self.log: list[Seen] = []
        self.mass = 0.0  # kg, of the body that deforms
        self.surfaces = Surfaces(self.contacts, self.meets)
        self.couple, self._rounds = couple, 0  # where entries of stencils go in the tangent: without it no points join
        self._shares: tuple[float, ...] = ()

    def at(self, time: float) -> Touches:
        """All of them with the rigid bodies where they are at a time, s."""
        posed = [c.at(course.at(time)) for c, course in zip(self.contacts, self.courses, strict=True)]
        return Touches(posed, self.slots, self.meets)

    def struck(self, start: Motion, end: Motion) -> bool:
        """Whether contact has come or gone over a step, at which velocities jump."""
        before, after = self.at(start.time), self.at(end.time)
        return any(
            bool(np.any((b.gaps(start.x) < b.barrier.distance) != (a.gaps(end.x) < a.barrier.distance)))
            for b, a in zip(before.posed, after.posed, strict=True)
        ) or any(bool(np.any(c.pressed(start.x) != c.pressed(end.x))) for c in self.meets)

    def follow(self, motion: Motion, momentum: Floats, mass: float) -> None:
        """Note whether there is contact after an accepted step, and how fast the centre of mass is."""
        here, self._rounds = self.at(motion.time), 0
        rubbed = tuple(self._settled(i, c, motion.x) for i, c in enumerate(here.posed) if c.rubs)
        rubbed += tuple(self._left(i, c, motion.x) for i, c in enumerate(self.meets) if c.rubs)
        touches = any(c.gaps(motion.x).min(initial=np.inf) < c.barrier.distance for c in here.posed)
        shares = tuple(c.share for c in here.posed)
        moved = self.free is not None or shares != self._shares
        driven, self._shares = bool(self.log) and moved, shares
        acts = tuple(acting(c, motion.x) for c in here.posed) + tuple(meeting(c, motion.x) for c in here.meets)
        step = 0.0
        if self.log:
            step = motion.time - self.log[-1].time
            acts = tuple(a.after(b, step, motion.given) for a, b in zip(acts, self.log[-1].acts, strict=True))
        self.surfaces.follow(here.posed, here.meets, motion.x, step)
        self.mass = mass
        for i, own in enumerate(self.contacts):  # what presses no more goes
            if own.extra is not None:
                contact = own.at(self.courses[i].at(motion.time))
                left = replace(contact, earlier=contact.body).shed(motion.x)
                if left.extra is not contact.extra:
                    self._take(i, left)
        self.log.append(Seen(motion.time, touches, momentum / mass, driven, rubbed, acts))

    def _settled(self, i: int, here: Any, x: Floats) -> Rubbed:
        """Take on the anchors that a step has left of a contact, and say what friction made of it."""
        p, (_, held, area) = here.A * here.pressures(x), here.sticking(x)
        sticks = float(p[held].sum() / p.sum()) if p.any() else None
        gone, lost = here.gone + here.slid(x), here.lost(x)
        self.contacts[i] = self.contacts[i].holding(here.settled(x), gone)
        slip = float(np.max(np.where(p > 0.0, gone, 0.0), initial=0.0))
        return Rubbed(slip, sticks, area, lost)

    def _left(self, i: int, here: Any, x: Floats) -> Rubbed:
        """The same of surfaces that both deform."""
        hold = here.hold(x)
        since, slid, heat = here.settled(x)
        N, A, held = hold.N, here.skin.A[hold.which], ~hold.slip(x, here.friction).slides
        sticks = float(N[held].sum() / N.sum()) if N.any() else None
        self._met[i] = whole = self._met[i] + slid
        self.meets[i] = here.holding(since)
        area = float(A[held].sum() / A.sum()) if len(A) else 0.0
        return Rubbed(float(np.max(whole[hold.which], initial=0.0)), sticks, area, heat)

    def accept(self, start: Motion, end: Motion, time: float) -> None:
        """Raises TooSoft where a point ends behind a rigid surface, StepFailed where one went through."""
        here = self.at(time)
        if here.passed(end.x, self.at(start.time).places(start.x)):
            raise StepFailed("a point of the surface goes through a rigid body")
        for i, contact in enumerate(here.posed):
            if contact.gaps(end.x).min(initial=1.0) <= 0.0:
                self._stiffen(i)
        self._join(start, end, here)

    def _join(self, start: Motion, end: Motion, here: Touches) -> None:
        """Raises CutsIn where facets end behind a rigid surface between points: with more of them the step is new."""
        if self.couple is None or self._rounds > ROUNDS or all(c.facing is None for c in here.posed):
            return
        from softmark.solvers.contact.facet_penetration import MOST, find_penetrating_points, presses_off_surface

        last = self._rounds == ROUNDS  # then what presses on nothing goes
        before, found = self.at(start.time), False
        for i, contact in enumerate(here.posed):
            extra = None if last else find_penetrating_points(contact, end.x)
            if extra is None and not (last and presses_off_surface(contact, end.x, MOST)):
                continue
            found = True
            known = replace(self.contacts[i], earlier=before.posed[i].body)
            self._take(i, known.joining(extra, start.x))
        self._rounds += 1
        if found:
            raise CutsIn("facets of the surface end behind a rigid one")

    def _take(self, i: int, contact: Any) -> None:
        """A contact with other points."""
        assert self.couple is not None
        self.contacts[i], self.slots[i] = contact, self.couple(contact.stencils)

    def _stiffen(self, i: int) -> None:
        """Raises TooSoft, or StepFailed where it is stiff enough for anything."""
        barrier = self.contacts[i].barrier
        if barrier.stiffness * STIFFER > STIFFEST * self._first[i]:
            raise StepFailed("a point of the surface ends behind a rigid one")
        self.contacts[i] = self.contacts[i].stiffer(STIFFER)
        self.stiffened += 1
        raise TooSoft("a point of the surface ends behind a rigid one")


@dataclass(frozen=True)
class Rubbed:
    """What friction makes of a contact at a time.

    `slip` is how far a node that is pressed has slid in all, at most, m, `sticks` the share of the forces that press
    where nothing slides, None where nothing presses, `area` the share that sticks of the surface in contact, and `heat`
    what friction has made of the step that ends, J.
    """

    slip: float
    sticks: float | None
    area: float = 0.0
    heat: float = 0.0


@dataclass(frozen=True)
class Seen:
    """Whether anything touches at a time, s, and the velocity (3,), m/s, of the centre of mass."""

    time: float
    touches: bool
    velocity: Floats
    driven: bool = False  # rigid bodies have moved since the step before
    rubbed: tuple[Rubbed, ...] = ()  # of every contact with friction
    acts: tuple[Acting, ...] = ()  # what every contact does over the step that ends


@dataclass(frozen=True)
class Bounce:
    """One impact: when it begins and ends, s, and velocities (3,), m/s, of the centre of mass before and after."""

    begin: float
    end: float
    before: Floats
    after: Floats
    driven: bool = False  # the rigid bodies that it met were on their way

    @property
    def restitution(self) -> float | None:
        """Speed after over before, both along the impulse; None where the rigid body moved, or the body did not."""
        n = self.after - self.before
        brought = -float(n @ self.before)
        return None if self.driven or brought <= 0.0 else float(n @ self.after) / brought


def bounces(log: Sequence[Seen]) -> list[Bounce]:
    """Impacts between two free flights, each at least as long as the shorter of the contacts around it.

    Shorter flights are chatter: nodes let go of a wall, and come back, while the body still presses.
    """
    times, runs = [seen.time for seen in log], list[list[int]]()
    for i, seen in enumerate(log):
        if not seen.touches:
            continue
        if runs and times[i] - times[runs[-1][1]] <= max(
            times[runs[-1][1]] - times[runs[-1][0]], FLIGHT * _step(times, i)
        ):
            runs[-1][1] = i
        else:
            runs.append([i, i])
    return [
        Bounce(
            times[a - 1],
            times[b + 1],
            log[a - 1].velocity,
            log[b + 1].velocity,
            any(seen.driven for seen in log[a : b + 2]),
        )
        for a, b in runs
        if a and b + 1 < len(log)
    ]


def _step(times: Sequence[float], i: int) -> float:
    """The step that ended at a time, s."""
    return times[i] - times[i - 1] if i else 0.0


class Touches:
    """All contacts at one time: with rigid bodies, and of surfaces that both deform."""

    def __init__(
        self, posed: Sequence[RigidContact], slots: Sequence[Ints], meets: Sequence[DynamicPatternEnergy] = ()
    ) -> None:
        self.slots = slots
        self.posed: list[Any] = list(posed)  # with friction or without
        self.meets: list[Any] = list(meets)

    @property
    def every(self) -> tuple[Any, ...]:
        """Of both kinds."""
        return (*self.posed, *self.meets)

    @property
    def rubs(self) -> bool:
        """Whether some have friction, of pressures that are sought as well."""
        return any(c.rubs for c in self.every)

    def value(self, x: Floats) -> float:
        """What the barriers store, J; infinite where surfaces that both deform intersect."""
        return sum(float(c.value(x)) for c in self.every)

    def stored(self, x: Floats) -> float:
        """What they give back, J: with friction less than their value."""
        return sum(float(c.stored(x)) for c in self.every)

    def lost(self, x: Floats) -> float:
        """What friction turns into heat over a step that ends in x, J."""
        return sum(float(c.lost(x)) for c in self.every if c.rubs)

    def lagged(self, x: Floats, before: Touches | None = None) -> Touches:
        """With an energy, by pressures of a state, of which those `before` were the law."""
        was = self if before is None else before
        both: Any = zip(self.every, was.every, strict=True)
        each: list[Any] = [c.known(x, b) if c.rubs else c for c, b in both]
        count = len(self.posed)
        return Touches(each[:count], self.slots, each[count:])

    def gradient(self, x: Floats) -> Floats:
        """Minus the forces on all degrees of freedom (dofs,), N."""
        g = np.zeros(len(x))
        for contact in self.every:
            contact.add_gradient(x, g)
        return g

    def add_hessian(self, x: Floats, data: Floats, scale: float, projected: bool) -> None:
        """data (nnz,) += scale times the stiffness of contact."""
        for contact, slots in zip(self.posed, self.slots, strict=True):
            contact.add_hessian(x, data, slots, scale, projected)

    def coupled(self, x: Floats, J: sparse.csr_matrix, free: Ints, scale: float, projected: bool) -> sparse.csr_matrix:
        """J (free, free) with scale times the stiffness of surfaces that meet, which couples what has none in it."""
        for energy in self.meets:
            J = (J + scale * energy.matrix(x, projected)[free][:, free]).tocsr()
        return J

    def limit(self, x: Floats, d: Floats) -> float:
        """The part of an increment d (dofs,), at most 1, that can be gone before surfaces that both deform meet."""
        return min((energy.limit(x, d) for energy in self.meets), default=1.0)

    def rounding(self, x: Floats) -> float:
        """Norm of what rounding leaves in the forces, N."""
        return sum(float(c.rounding(x)) for c in self.every)

    def places(self, x: Floats) -> list[PointsInBodyFrame]:
        """Where the points are as seen from each rigid body."""
        return [locate_contact_points(c, x) for c in self.posed]

    def passed(self, x: Floats, start: Sequence[PointsInBodyFrame]) -> bool:
        """Whether a point has gone through a rigid body on its way from where it was, as seen from there."""
        return any(has_passed_through(a, b) for a, b in zip(start, self.places(x), strict=True))

    def work(self, x: Floats, since: Touches) -> float:
        """What moving rigid bodies have done, J: forces at the end times the way of the surfaces that press there."""
        both = zip(self.posed, since.posed, strict=True)
        return sum(float(c.work(x, s)) for c, s in both if c.share != s.share)
