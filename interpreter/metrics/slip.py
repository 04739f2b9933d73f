"""Metrics of friction: slip distance and stick area of a contact."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar

from softmark.interpreter.metrics.contact import ContactMetric
from softmark.interpreter.metrics.metric_base import WHEN, When
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np

    from softmark.interpreter.metrics.metric_base import Floats
    from softmark.interpreter.results.reaction_results import EquilibriumForces, Friction
else:
    from softmark.solvers.runtime.lazy_modules import np


class FrictionMetric(ContactMetric):
    """Base class of metrics that evaluate the friction of one contact."""

    numbers: ClassVar[tuple[str, ...]] = ("slip", "sticks")

    def friction(self, rest: EquilibriumForces) -> Friction:
        """Return the friction results of the contact. Raises Undefined if it has no friction."""
        found = self.contact_numbers(rest).rubbing
        if found is None:
            raise Undefined(f"`{self.of}` has no friction")
        return found


@dataclass(frozen=True)
class Slip(FrictionMetric):
    """Largest slip distance of a surface point in contact on the other body, accumulated over all states.

    It is the length of the path, not the distance from its start: sliding back and forth adds up. Where a point sticks
    it still moves elastically by friction times pressure over the barrier's stiffness, less than the barrier's
    distance; that does not count as slip. In a dynamic analysis the states are its time steps, and the report also
    gives largest_in_time_m and its time largest_at_s.
    """

    of: Annotated[str, "contact", "the contact"]
    over: Annotated[When, WHEN] = "end"
    against: Annotated[str | None, "reference or model", "solution taken as correct"] = None
    natural: ClassVar[str] = "m"

    def amount(self, rest: EquilibriumForces) -> Floats:
        """Return the largest slip distance, m. Raises Undefined if there is no friction."""
        return np.array(self.friction(rest).slip)

    def acting(self, rest: EquilibriumForces) -> float:
        """Return the largest nodal displacement of the body, m."""
        return rest.moved


@dataclass(frozen=True)
class StickArea(FrictionMetric):
    """Undeformed area of a body's surface that is in contact and does not slide in this state.

    Each node represents a part of the surface, so the area is accurate to about the area of the cells along its border.
    For a sphere on a half-space under a shear force Q it is a circle of (1 - Q / (friction P))^(1/3) times the contact
    radius (Cattaneo 1938, Mindlin 1949).

    In a dynamic analysis the report also gives largest_in_time_m2 and its time largest_at_s.
    """

    of: Annotated[str, "contact", "the contact"]
    over: Annotated[When, WHEN] = "end"
    against: Annotated[str | None, "reference or model", "solution taken as correct"] = None
    natural: ClassVar[str] = "m^2"

    def amount(self, rest: EquilibriumForces) -> Floats:
        """Return the stick area, m^2. Raises Undefined if there is no friction."""
        return np.array(self.friction(rest).area)

    def acting(self, rest: EquilibriumForces) -> float:
        """Return the largest contact area of all contacts, m^2."""
        return max(touch.area for touch in rest.touches.values())
