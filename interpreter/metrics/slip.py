"""What friction makes of a contact: how far it has slid, and where it sticks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar

from softmark.interpreter.metrics.contact import OfContact
from softmark.interpreter.metrics.metric_base import WHEN, When
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np

    from softmark.interpreter.metrics.metric_base import Floats
    from softmark.interpreter.results.reaction_results import AtRest, Friction
else:
    from softmark.solvers.runtime.lazy_modules import np


class OfFriction(OfContact):
    """One of a contact with friction."""

    numbers: ClassVar[tuple[str, ...]] = ("slip", "sticks")

    def friction(self, rest: AtRest) -> Friction:
        """What friction makes of it. Raises Undefined."""
        found = self.touch(rest).rubbing
        if found is None:
            raise Undefined(f"`{self.of}` has no friction")
        return found


@dataclass(frozen=True)
class Slip(OfFriction):
    """The farthest that a point of a body's surface that is pressed has slid on what it touches, over all states.

    The way itself, not its distance from where it began: what slides to and fro has slid both. Where it sticks it gives
    way by friction times pressure over the stiffness of the barrier per distance, less than the barrier's distance, and
    that is no slip. In a motion the states are its steps, and a report has besides largest_in_time_m and largest_at_s.
    """

    of: Annotated[str, "contact", "the contact"]
    over: Annotated[When, WHEN] = "end"
    against: Annotated[str | None, "reference or model", "what is taken as right"] = None
    natural: ClassVar[str] = "m"

    def amount(self, rest: AtRest) -> Floats:
        """In m. Raises Undefined where there is no friction."""
        return np.array(self.friction(rest).slip)

    def acting(self, rest: AtRest) -> float:
        """The largest displacement, m."""
        return rest.moved


@dataclass(frozen=True)
class StickArea(OfFriction):
    """Area of a body's surface that is pressed and does not slide in this state, before deformation.

    Each node stands for a part of the surface, so that it is known to about the area of the cells at its border. Of a
    sphere on a half-space under a shear of Q it is a circle of (1 - Q / (friction P))^(1/3) of the radius of contact
    (Cattaneo 1938, Mindlin 1949).

    In a motion a report has besides largest_in_time_m2 and when that is, largest_at_s.
    """

    of: Annotated[str, "contact", "the contact"]
    over: Annotated[When, WHEN] = "end"
    against: Annotated[str | None, "reference or model", "what is taken as right"] = None
    natural: ClassVar[str] = "m^2"

    def amount(self, rest: AtRest) -> Floats:
        """In m^2. Raises Undefined where there is no friction."""
        return np.array(self.friction(rest).area)

    def acting(self, rest: AtRest) -> float:
        """The largest area of all contacts, m^2."""
        return max(touch.area for touch in rest.touches.values())
