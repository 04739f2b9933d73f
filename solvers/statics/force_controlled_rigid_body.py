"""Equilibrium of a rigid body under a known force in one direction: finds the position where contact balances it.

The contact force at any position is found as if a support had moved the body there. So the position is one unknown,
found by Newton's method between positions known to give too little and too much force. The stiffness includes all
deformation; it must be positive, or the position is unstable.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from softmark.records import dataclass
from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.energies.energy import Floats
from softmark.solvers.linear.factorisations import Singular, factor
from softmark.solvers.statics.static_problem import Equilibrium, Iteration, NotConverged, Statics

PLACES = 60  # at most
CLOSER = 0.1  # of the tolerance: what equilibria at one place may leave of theirs
GROWS = 6.0  # times the force that it presses with over its stiffness, which is as deep as it is: no farther at once
FIRST = 30.0  # times the barrier's distance: how far it goes at first
NOTHING = 1e-9  # of the force: what it meets does not resist yet, as a piece that nothing stops does not
LONGEST = 0.1  # of the size of the body: how far it goes at once then
FAILURES = 12  # places without an equilibrium, at most
FAR = 4.0  # times the size of the body and the gap: where nothing has stopped it, nothing does
LOOKS = 1000  # for what it meets on its way
WITHIN, AIMED = 0.9, 0.5  # of the barrier's distance: touch, and where it stops on its way there
SMALL = 1e-4  # of the barrier's distance: differences for a stiffness
ROUNDED = 4.0  # times what rounding leaves: no less is asked for
LEAST = 1e-16  # of the size of the body: places that are nearer are one
LOOKED = 12  # places between others, at most, where the force may have fallen on the way
STEEP = 3.0  # times the mean slope: what those at both ends may be, squared and added, of a cubic that only rises
NEAR = 1e-3  # of the force: neighbouring places whose forces are nearer are taken to have nothing between them

Find = Callable[[Statics], Equilibrium]


@dataclass(frozen=True)
class ForceControl:
    """Rigid body that moves along x, y or z, number `along`, under a `force` in that direction, N, from `begun`, m, on.

    `contacts` are the indices of its contacts among the loads; `placed` returns a contact with the body moved by a
    distance, m, from its position without the force.
    """

    along: int
    force: float
    begun: float
    contacts: tuple[int, ...]
    placed: Callable[[Any, float], Any]


@dataclass(frozen=True)
class TravelPoint:
    """Travel of the rigid body, m, the equilibrium there, and its force on the deformable body in that direction, N."""

    d: float
    found: Equilibrium
    push: float


def solve_force_balance(problem: Statics, press: ForceControl, find: Find) -> Equilibrium:
    """Return the equilibrium, by `find` with contact, at the position where the contact force balances the force.

    Its facts `pressed` hold the travel, m, the unbalanced force `left_N`, N, the stiffness, N/m, the number of
    positions solved, and whether the body `gave_way` on the way there. Raises NotConverged if nothing stops the rigid
    body, or the position is unstable.
    """
    return _PositionSearch(problem, press, find).found()


@dataclass(frozen=True)
class TravelStiffness:
    """Position and stiffness there, N/m."""

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
        self.seen = list[TravelStiffness]()  # where it met something that is held
        self.low, self.high = -np.inf, np.inf  # where it bears too little, and too much, in the direction of d

    def found(self) -> Equilibrium:
        """Return the equilibrium where the force is balanced. Raises NotConverged."""
        here = self._at(self.press.begun)
        while self.places < PLACES:
            left = self._left(here)
            if here.push == 0.0 and left == 0.0:
                return self._kept(here, 0.0, 0.0)
            if here.push == 0.0:
                there = self._met(here, float(np.sign(left)))
            else:
                stiffness = self._stiffness(here)
                if self._resists(here):
                    self.seen.append(TravelStiffness(here, stiffness))
                if abs(left) <= self.problem.tolerance * abs(self.press.force) + self._rounding(here):
                    return self._kept(here, left, stiffness)
                there = self._next(here, left, stiffness)
            if abs(there - here.d) <= self.least:
                break
            here = self._towards(here, there)
        reason = f"the force on the rigid body is not balanced to the tolerance: {abs(self._left(here)):.1e} N are left"
        raise NotConverged(reason, self.history)

    def _left(self, here: TravelPoint) -> float:
        """Return the unbalanced force, N, and narrow the bracket of positions."""
        left = self.press.force - here.push
        if left > 0.0:
            self.low = max(self.low, here.d)
        if left < 0.0:
            self.high = min(self.high, here.d)
        return left

    def _rounding(self, here: TravelPoint) -> float:
        """Return the error of the contact force due to rounding of positions, N."""
        return ROUNDED * float(sum(contact.rounding(here.found.x) for contact in self._contacts(here.found)))

    def _next(self, here: TravelPoint, left: float, stiffness: float) -> float:
        """Return Newton's next position, limited to GROWS times the present depth and to the bracket.

        Without a force the body also leaves the barrier, in which its force would decrease without end.
        """
        distance = min(c.barrier.distance for c in self._contacts(here.found))
        first = FIRST * distance
        if stiffness > 0.0 and self._resists(here):
            most, self.stride = max(first, GROWS * abs(here.push) / stiffness), 0.0
            step = left / stiffness + (0.0 if self.press.force else float(np.copysign(distance, left)))
        else:
            most = self.stride = float(np.clip(GROWS * self.stride, first, LONGEST * self.problem.extent))
            step = float(np.copysign(most, left))
        there = here.d + float(np.clip(step, -most, most))
        return there if self.low < there < self.high else self._between(there)

    def _resists(self, here: TravelPoint) -> bool:
        """Return whether the contact force is not negligible."""
        return abs(here.push) > NOTHING * abs(self.press.force)

    def _between(self, there: float) -> float:
        """Return the middle of the bracket, or `there` if it has no two sides yet."""
        return 0.5 * (self.low + self.high) if np.isfinite(self.low) and np.isfinite(self.high) else there

    def _towards(self, here: TravelPoint, there: float) -> TravelPoint:
        """Return the equilibrium at a position, or at a nearer one. Raises NotConverged if there is none."""
        while True:
            try:
                return self._at(there, here)
            except NotConverged as failure:
                self.history, self.failures = (*self.history, *failure.history), self.failures + 1
                there = here.d + 0.25 * (there - here.d)
                if self.failures > FAILURES or abs(there - here.d) <= self.least:
                    reason = (
                        f"the rigid body meets a contact force of only {abs(here.push):.3g} N of "
                        f"{abs(self.press.force):.3g} N"
                    )
                    raise NotConverged(f"{reason}, and further on {failure.reason}", self.history) from failure

    def _at(self, d: float, near: TravelPoint | None = None) -> TravelPoint:
        """Return the equilibrium at a position, from a near one; with friction, which depends on the path, from the
        start.
        """
        self.places += 1
        problem = replace(self.problem, tolerance=CLOSER * self.problem.tolerance)
        loads: list[Any] = list(problem.assembly.loads)
        for number in self.press.contacts:
            loads[number] = self.press.placed(loads[number], d)
        if near is not None and not problem.rubs:
            last = iter(near.found.beside)
            for number, energy in enumerate(loads):
                if energy.driven:
                    own = next(last)
                    loads[number] = replace(energy, earlier=own.body).joining(own.extra, near.found.x)
            problem = replace(problem, start=near.found.x)
        found = self.find(_with_loads(problem, loads))
        self.history = (*self.history, *found.history)
        return TravelPoint(d, found, self._push(found, found.x, d))

    def _contacts(self, found: Equilibrium) -> list[Any]:
        """Return the contacts of the rigid body in an equilibrium."""
        driven = [i for i, energy in enumerate(self.problem.assembly.loads) if energy.driven]
        count = len(self.problem.assembly.loads)
        own = {number % count for number in self.press.contacts}
        return [c for i, c in zip(driven, found.beside, strict=True) if i in own]

    def _push(self, found: Equilibrium, x: Floats, d: float) -> float:
        """Return the force on the deformable body in the direction of travel, N, in a state x at travel d, m."""
        each = (self.press.placed(contact, d) for contact in self._contacts(found))
        return float(sum(contact.pushes(x).sum(axis=0)[self.press.along] for contact in each))

    def _stiffness(self, here: TravelPoint) -> float:
        """Return the derivative of the contact force by travel, with all deformation, N/m; 0 for a singular tangent."""
        x, found = here.found.x, here.found
        last = iter(found.beside)
        loads: list[Any] = [next(last) if energy.driven else energy for energy in self.problem.assembly.loads]
        assembly = self.problem.assembly.joined(loads)
        own = self._contacts(found)
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
        ahead, behind = (self._push(found, x + sign * way, here.d + sign * e) for sign in (1.0, -1.0))
        return float((ahead - behind) / (2.0 * e))

    def _met(self, here: TravelPoint, sign: float) -> float:
        """Return the position of first contact with the body at rest, m. Raises NotConverged if there is none."""
        contacts, x, way = self._contacts(here.found), here.found.x, 0.0
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
            return self._between(here.d)
        along = f"{'+' if sign > 0.0 else '-'}{'xyz'[self.press.along]}"
        raise NotConverged(f"nothing stops the rigid body: it moves on along {along}", self.history)

    def _gave_way(self, here: TravelPoint) -> bool:
        """Return whether the contact force falls on the way to a position, so that the body snaps through.

        Steps may jump over that: if the cubic through two neighbouring positions with their stiffnesses need not be
        monotonic (Fritsch and Carlson 1980), the middle position is solved as well.
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
                middle = self._at(0.5 * (a.place.d + b.place.d), a.place)
            except NotConverged:
                continue
            own, looked = TravelStiffness(middle, self._stiffness(middle)), looked + 1
            if not own.k > 0.0:
                return True
            pairs += [(a, own), (own, b)]
        return False

    def _kept(self, here: TravelPoint, left: float, stiffness: float) -> Equilibrium:
        """Return the equilibrium with the facts of the search. Raises NotConverged if it is unstable."""
        if here.push != 0.0 and not stiffness > 0.0:
            reason = (
                "the equilibrium of the rigid body is unstable: it snaps through at a contact force of "
                f"{abs(here.push):.3g} N"
            )
            raise NotConverged(reason, self.history)
        gave_way = {"gave_way": True} if self._gave_way(here) else {}
        known = {"travel_m": here.d, "left_N": left, "stiffness_N_m": stiffness, "places": self.places} | gave_way
        return replace(here.found, history=self.history, facts=here.found.facts | {"pressed": known})


def _with_loads(problem: Statics, loads: Sequence[Any]) -> Statics:
    """Return the problem with other loads, also in its corotational twin."""

    def each(assembly: Assembly) -> Assembly:
        return assembly.joined(list(loads))

    return replace(problem, assembly=each(problem.assembly), twin=problem.twin and each(problem.twin))
