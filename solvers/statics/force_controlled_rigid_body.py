"""Force-controlled rigid body: finds its position along one direction where contact balances a given force.

The contact force at any position is found as if a support had moved the body there. So the position is the only
unknown. It is found by Newton's method between positions with too small and too large contact forces. The stiffness
includes all deformation; the position is unstable if it is not positive.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats
from softmark.solvers.linear.factorisations import Singular, factor
from softmark.solvers.statics.static_problem import Equilibrium, Iteration, NotConverged, Statics

PLACES = 60  # largest number of positions
CLOSER = 0.1  # of the tolerance: tolerance of the equilibrium at each position
GROWS = 6.0  # times force over stiffness (the present depth): longest step
FIRST = 30.0  # times the barrier distance: first step
NOTHING = 1e-9  # of the force: less is no resistance, as of a piece that is not supported
LONGEST = 0.1  # of the size of the body: longest step without resistance
FAILURES = 12  # largest number of positions without an equilibrium
FAR = 4.0  # times size of the body plus gap: farther away there is nothing to meet
LOOKS = 1000  # largest number of steps in the search for first contact
WITHIN, AIMED = 0.9, 0.5  # of the barrier distance: contact, and target of each search step
SMALL = 1e-4  # of the barrier distance: step of the difference quotient for the stiffness
ROUNDED = 4.0  # times the rounding error: least tolerance
LEAST = 1e-16  # of the size of the body: nearer positions are the same
LOOKED = 12  # largest number of positions added between others to detect a fall of the force
STEEP = 3.0  # times the mean slope: largest root of the sum of squared end slopes of a monotonic cubic
NEAR = 1e-3  # of the force: smaller differences between neighbouring positions are not examined

Find = Callable[[Statics], Equilibrium]


@dataclass(frozen=True)
class ForceControl:
    """Rigid body that moves along one axis under a given force.

    `along` is the number of the axis (x, y or z), `force` the force in this direction, N, and `begun` the travel at the
    start, m. The travel is the displacement from the position without the force. `contacts` are the names of the
    body's contacts. `placed` is a function that returns a contact with the body at a given travel, m.
    """

    along: int
    force: float
    begun: float
    contacts: tuple[str, ...]
    placed: Callable[[Any, float], Any]


@dataclass(frozen=True)
class TravelPoint:
    """Equilibrium `found` with the rigid body at a travel d, m.

    `push` is the force of the rigid body on the deformable body in the direction of travel, N.
    """

    d: float
    found: Equilibrium
    push: float


def solve_force_balance(problem: Statics, press: ForceControl, find: Find) -> Equilibrium:
    """Return the equilibrium at the travel of the rigid body where the contact force balances the given force.

    `find` solves contact at a fixed travel. In the facts of the result, `pressed` holds the travel, m, the unbalanced
    force `left_N`, N, the stiffness, N/m, the number of positions solved, and whether the body `gave_way` (snapped
    through) on the way. Raises NotConverged if nothing stops the rigid body, or the position is unstable.
    """
    return _PositionSearch(problem, press, find).solve_equilibrium()


@dataclass(frozen=True)
class TravelStiffness:
    """Equilibrium at a travel of the rigid body, and the derivative k of the contact force by the travel, N/m."""

    place: TravelPoint
    k: float


class _PositionSearch:
    """Search for the equilibrium position of one rigid body."""

    def __init__(self, problem: Statics, press: ForceControl, find: Find) -> None:
        self.problem, self.press, self.find = problem, press, find
        self.history = tuple[Iteration, ...]()
        self.places = 0
        self.least = LEAST * problem.extent
        self.failures, self.stride = 0, 0.0
        self.seen = list[TravelStiffness]()  # positions with resistance
        self.low, self.high = -np.inf, np.inf  # bracket of the travel: too small and too large contact force

    def solve_equilibrium(self) -> Equilibrium:
        """Return the equilibrium where the given force is balanced. Raises NotConverged."""
        here = self._solve_at_travel(self.press.begun)
        while self.places < PLACES:
            left = self._unbalanced_force(here)
            if here.push == 0.0 and left == 0.0:
                return self._finished_equilibrium(here, 0.0, 0.0)
            if here.push == 0.0:
                there = self._travel_to_contact(here, float(np.sign(left)))
            else:
                stiffness = self._stiffness(here)
                if self._has_contact_force(here):
                    self.seen.append(TravelStiffness(here, stiffness))
                if abs(left) <= self.problem.tolerance * abs(self.press.force) + self._rounding(here):
                    return self._finished_equilibrium(here, left, stiffness)
                there = self._next(here, left, stiffness)
            if abs(there - here.d) <= self.least:
                break
            here = self._solve_towards_travel(here, there)
        left = abs(self._unbalanced_force(here))
        reason = f"the force on the rigid body is not balanced to the tolerance: {left:.1e} N are left"
        raise NotConverged(reason, self.history)

    def _unbalanced_force(self, here: TravelPoint) -> float:
        """Return the unbalanced force at a position, N, and narrow the bracket of positions."""
        left = self.press.force - here.push
        if left > 0.0:
            self.low = max(self.low, here.d)
        if left < 0.0:
            self.high = min(self.high, here.d)
        return left

    def _rounding(self, here: TravelPoint) -> float:
        """Return the error of the contact force due to rounding of positions, N."""
        return ROUNDED * float(sum(contact.rounding(here.found.x) for contact in self._body_contacts(here.found)))

    def _next(self, here: TravelPoint, left: float, stiffness: float) -> float:
        """Return the next travel, m, by Newton's method from the unbalanced force `left`, N, and the stiffness, N/m.

        The step is at most GROWS times the present depth, and the result stays inside the bracket. If the given force
        is zero, the body also moves out of the barrier, where its force would otherwise decrease without end.
        """
        distance = min(c.barrier.distance for c in self._body_contacts(here.found))
        first = FIRST * distance
        if stiffness > 0.0 and self._has_contact_force(here):
            most, self.stride = max(first, GROWS * abs(here.push) / stiffness), 0.0
            step = left / stiffness + (0.0 if self.press.force else float(np.copysign(distance, left)))
        else:
            most = self.stride = float(np.clip(GROWS * self.stride, first, LONGEST * self.problem.extent))
            step = float(np.copysign(most, left))
        there = here.d + float(np.clip(step, -most, most))
        return there if self.low < there < self.high else self._bracket_middle(there)

    def _has_contact_force(self, here: TravelPoint) -> bool:
        """Return whether the contact force at a position is not negligible."""
        return abs(here.push) > NOTHING * abs(self.press.force)

    def _bracket_middle(self, there: float) -> float:
        """Return the middle of the bracket, or `there` if the bracket is still open on one side."""
        return 0.5 * (self.low + self.high) if np.isfinite(self.low) and np.isfinite(self.high) else there

    def _solve_towards_travel(self, here: TravelPoint, there: float) -> TravelPoint:
        """Return the equilibrium at the travel `there`, m, or nearer to `here` if that fails. Raises NotConverged."""
        while True:
            try:
                return self._solve_at_travel(there, here)
            except NotConverged as failure:
                self.history, self.failures = (*self.history, *failure.history), self.failures + 1
                there = here.d + 0.25 * (there - here.d)
                if self.failures > FAILURES or abs(there - here.d) <= self.least:
                    reason = (
                        f"the rigid body meets a contact force of only {abs(here.push):.3g} N of "
                        f"{abs(self.press.force):.3g} N"
                    )
                    raise NotConverged(f"{reason}; farther on, {failure.reason}", self.history) from failure

    def _solve_at_travel(self, d: float, near: TravelPoint | None = None) -> TravelPoint:
        """Return the equilibrium at the travel d, m, solved from the equilibrium `near`.

        With friction, which depends on the path, it is solved from the start of the problem. Raises NotConverged.
        """
        self.places += 1
        problem = replace(self.problem, tolerance=CLOSER * self.problem.tolerance)
        contacts = problem.assembly.rigid_contacts
        contacts |= {name: self.press.placed(contacts[name], d) for name in self.press.contacts}
        if near is not None and not problem.has_friction:
            for name, own in near.found.contacts.items():
                moved = replace(contacts[name], earlier=own.body)
                contacts[name] = moved.with_added_points(own.extra, near.found.x)
            problem = replace(problem, start=near.found.x)
        found = self.find(problem.with_energies(contacts))
        self.history = (*self.history, *found.history)
        return TravelPoint(d, found, self._contact_force(found, found.x, d))

    def _body_contacts(self, found: Equilibrium) -> list[Any]:
        """Return the contacts of the rigid body in an equilibrium."""
        return [found.contacts[name] for name in self.press.contacts]

    def _contact_force(self, found: Equilibrium, x: Floats, d: float) -> float:
        """Return the force on the deformable body along the travel, N, in a state x with the rigid body at d, m."""
        each = (self.press.placed(contact, d) for contact in self._body_contacts(found))
        return float(sum(contact.point_forces(x).sum(axis=0)[self.press.along] for contact in each))

    def _stiffness(self, here: TravelPoint) -> float:
        """Return the derivative of the contact force by the travel, N/m, including all deformation.

        It is 0 for a singular tangent.
        """
        x, found = here.found.x, here.found
        assembly = self.problem.assembly.with_energies(found.contacts)
        own = self._body_contacts(found)
        e = SMALL * min(c.barrier.distance for c in own)
        change = np.zeros(assembly.dofs)
        for sign in (1.0, -1.0):
            for contact in own:
                self.press.placed(contact, here.d + sign * e).add_gradient(x, change, 0.5 * sign)
        way = np.zeros(assembly.dofs)
        try:
            K = factor(assembly.tangent(x, 1.0), symmetric=assembly.conservative)
        except Singular:
            return 0.0
        way[assembly.free] = -K.solve(change[assembly.free])
        ahead, behind = (self._contact_force(found, x + sign * way, here.d + sign * e) for sign in (1.0, -1.0))
        return float((ahead - behind) / (2.0 * e))

    def _travel_to_contact(self, here: TravelPoint, sign: float) -> float:
        """Return the travel, m, at which the rigid body first touches the body in its present state.

        `sign` is the direction of the search. Raises NotConverged if there is no contact.
        """
        contacts, x, way = self._body_contacts(here.found), here.found.x, 0.0
        distance = min(c.barrier.distance for c in contacts)
        far = None
        for _ in range(LOOKS):
            gap = min(float(self.press.placed(c, here.d + sign * way).gaps(x).min()) for c in contacts)
            far = FAR * (self.problem.extent + abs(gap)) if far is None else far
            if gap < WITHIN * distance:
                return here.d + sign * way
            way += gap - AIMED * distance
            if way > far or not self.low <= here.d + sign * way <= self.high:
                break
        if np.isfinite(self.low) and np.isfinite(self.high):
            return self._bracket_middle(here.d)
        along = f"{'+' if sign > 0.0 else '-'}{'xyz'[self.press.along]}"
        raise NotConverged(f"nothing stops the rigid body: it moves on along {along}", self.history)

    def _snaps_through(self, here: TravelPoint) -> bool:
        """Return whether the contact force falls between solved positions up to `here`, so that the body snaps through.

        Steps may jump over such a fall. So between two neighbouring positions the middle one is solved as well, unless
        the cubic through both forces and stiffnesses must be monotonic (Fritsch and Carlson 1980).
        """
        low, high = sorted((self.press.begun, here.d))
        way = sorted((own for own in self.seen if low <= own.place.d <= high), key=lambda own: own.place.d)
        near = NEAR * max([abs(self.press.force), *(abs(own.place.push) for own in way)])
        pairs, looked = list(pairwise(way)), 0
        if any(not own.k > 0.0 for own in way):
            return True
        while pairs and looked < LOOKED:
            a, b = pairs.pop()
            far, rise = b.place.d - a.place.d, b.place.push - a.place.push
            if rise < -near:
                return True
            if max(abs(rise), far * a.k, far * b.k) <= near or np.hypot(a.k, b.k) * far <= STEEP * rise:
                continue
            try:
                middle = self._solve_at_travel(0.5 * (a.place.d + b.place.d), a.place)
            except NotConverged:
                continue
            own, looked = TravelStiffness(middle, self._stiffness(middle)), looked + 1
            if not own.k > 0.0:
                return True
            pairs += [(a, own), (own, b)]
        return False

    def _finished_equilibrium(self, here: TravelPoint, left: float, stiffness: float) -> Equilibrium:
        """Return the equilibrium with the facts of the search added. Raises NotConverged if it is unstable."""
        if here.push != 0.0 and not stiffness > 0.0:
            reason = (
                "the equilibrium of the rigid body is unstable: it snaps through at a contact force of "
                f"{abs(here.push):.3g} N"
            )
            raise NotConverged(reason, self.history)
        gave_way = {"gave_way": True} if self._snaps_through(here) else {}
        known = {"travel_m": here.d, "left_N": left, "stiffness_N_m": stiffness, "places": self.places} | gave_way
        return replace(here.found, history=self.history, facts=here.found.facts | {"pressed": known})
