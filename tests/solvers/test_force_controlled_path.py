"""Snap-through of what a force-driven rigid body presses on, told from the places that its search has looked at."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from softmark.solvers.statics.force_controlled_rigid_body import (
    ForceControl,
    TravelPoint,
    TravelStiffness,
    _PositionSearch,
)
from softmark.solvers.statics.static_problem import NotConverged

E = 1e-6


class Curve(_PositionSearch):
    """A search whose body is a known force over the way, N and m."""

    def __init__(self, force: Callable[[float], float], places: list[float], begun: float = 0.0) -> None:
        self.force, self.places = force, 0
        self.press = ForceControl(1, force(places[-1]), begun, (), lambda contact, d: contact)
        self.seen = [TravelStiffness(place := self._solve_at_travel(d), self._stiffness(place)) for d in places]
        self.places, self.end = 0, self.seen[-1].place

    def _solve_at_travel(self, d: float, near: TravelPoint | None = None) -> TravelPoint:
        self.places += 1
        found: Any = None
        return TravelPoint(d, found, self.force(d))

    def _stiffness(self, here: TravelPoint) -> float:
        return (self.force(here.d + E) - self.force(here.d - E)) / (2.0 * E)


def snaps(d: float) -> float:
    """A force that falls from d = 1 to d = 3: slope (d - 1) (d - 3)."""
    return d**3 / 3.0 - 2.0 * d**2 + 3.0 * d


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("places", [[0.5, 0.9, 4.5], [0.99, 6.0], [0.2, 0.9, 9.0, 4.2], [0.5, 2.0, 4.5]])
def test_a_force_that_falls_between_places_is_found(places: list[float], sign: float) -> None:
    """Whatever places the search has leapt over it by, and in either direction."""
    search = Curve(lambda d: sign * snaps(sign * d), [sign * d for d in places])
    assert search._snaps_through(search.end)


def test_a_place_beyond_the_answer_is_not_on_the_way() -> None:
    """A search that overshoots into the falling part and comes back has not snapped."""
    search = Curve(snaps, [0.2, 2.0, 0.8])
    assert not search._snaps_through(search.end)


@pytest.mark.parametrize(
    "force",
    [
        lambda d: float(np.sign(d) * abs(d) ** 1.5),  # Hertz
        lambda d: d + d**3,
        lambda d: float(np.tanh(d)),  # softens without an end
    ],
)
def test_a_force_that_rises_needs_no_further_place(force: Callable[[float], float]) -> None:
    search = Curve(force, [0.05, 0.4, 1.5, 1.2, 1.201, 1.2010001])
    assert not search._snaps_through(search.end)
    assert search.places == 0


def test_a_stop_that_is_met_late_is_no_snap() -> None:
    """A soft spring and from d = 0.95 a stiff one beside it: few places more tell that the force rises."""
    search = Curve(lambda d: d + 100.0 * max(0.0, d - 0.95), [0.1, 1.0])
    assert not search._snaps_through(search.end)
    assert 0 < search.places <= 5


def test_places_without_an_equilibrium_tell_nothing() -> None:
    class Gap(Curve):
        def _solve_at_travel(self, d: float, near: TravelPoint | None = None) -> TravelPoint:
            if near is not None:
                raise NotConverged("no equilibrium")
            return super()._solve_at_travel(d)

    search = Gap(snaps, [0.99, 6.0])
    assert not search._snaps_through(search.end)
