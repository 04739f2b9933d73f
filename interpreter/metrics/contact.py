"""What contacts come to: the area, the pressure and the gap."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from softmark.interpreter.metrics.metric_base import WHEN, OfForces, When
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np

    from softmark.interpreter.metrics.metric_base import Floats
    from softmark.interpreter.results.reaction_results import AtRest, Touch
else:
    from softmark.solvers.runtime.lazy_modules import np


class OfContact(OfForces):
    """One of a contact."""

    of_surface = True
    numbers: ClassVar[tuple[str, ...]] = ("pressure",)  # of a contact, by which shapes that it is asked of are coloured

    if TYPE_CHECKING:
        of: str

    @property
    def concerned(self) -> str:
        """The contact."""
        return self.of

    def touch(self, rest: AtRest) -> Touch:
        """What the contact comes to. Raises Undefined."""
        if self.of not in rest.touches:
            raise Undefined(f"nothing is known of `{self.of}` here but its force")
        return rest.touches[self.of]

    def size(self, value: Floats) -> float:
        """Of what is asked, which comes first."""
        return abs(self._along(value))

    def _along(self, value: Floats) -> float:
        return float(value.flat[0])


@dataclass(frozen=True)
class ContactArea(OfContact):
    """Area of a body's surface on which something presses, as it is deformed (of small strain, undeformed).

    Of `itself` it is half of that of both surfaces. It ends between a node that touches and one that does not, where
    pressure and gap say; in a coarse mesh it is the least sure of what is told of a contact, and it has no limit where
    contact opens and closes with the mesh. Against another model or a theory it is the difference relative to that
    one's.

    In a motion a report has besides largest_in_time_m2 and when that is, largest_at_s.
    """

    of: Annotated[str, "contact", "the contact"]
    over: Annotated[When, WHEN] = "end"
    against: Annotated[str | None, "reference or model", "what is taken as right"] = None
    natural: ClassVar[str] = "m^2"

    def amount(self, rest: AtRest) -> Floats:
        """In m^2. Raises Undefined where nothing is known of the contact."""
        return np.array(self.touch(rest).area)

    def acting(self, rest: AtRest) -> float:
        """The largest area of all contacts, m^2."""
        return max(touch.area for touch in rest.touches.values())


@dataclass(frozen=True)
class ContactPressure(OfContact):
    """Pressure of a contact on the surface of a body: the largest, or that at a place on the surface.

    Force per area as it is deformed (of small strain, undeformed), from the forces at nodes: the field, linear or
    bilinear on facets, that comes to the same forces. It has no limit at the edge of a sharp punch, where it grows with
    every refinement: a rounded one has. Against another model or a theory it is the difference relative to that one's.

    Beside its value a report has largest_Pa; in a motion largest_in_time_Pa and when that is, largest_at_s.
    """

    of: Annotated[str, "contact", "the contact"]
    at: Annotated[
        tuple[float, float, float] | None, "m", "a point of the surface, by its coordinates before deformation"
    ] = None
    over: Annotated[When, WHEN] = "end"
    against: Annotated[str | None, "reference or model", "what is taken as right"] = None
    natural: ClassVar[str] = "Pa"

    def amount(self, rest: AtRest) -> Floats:
        """What is asked, and the largest, Pa. Raises Undefined where nothing is known of the contact."""
        touch = self.touch(rest)
        return np.array([touch.pressure if self.at is None else self._there(touch), touch.pressure])

    def _there(self, touch: Touch) -> float:
        if touch.field is None:
            raise Undefined(f"the pressure of `{self.of}` is known here where it is largest alone: leave out `at`")
        assert self.at is not None
        found = float(touch.field.pressures(np.array([self.at]))[0])
        if math.isnan(found):
            raise Undefined(f"`at` is not on the part of the surface that `{self.of}` is about, before deformation")
        return found

    def acting(self, rest: AtRest) -> float:
        """The largest pressure of all contacts, Pa."""
        return max(touch.pressure for touch in rest.touches.values())

    def details(self, value: Floats) -> dict[str, Any]:
        """The largest."""
        return {"largest_Pa": float(value[1])}


@dataclass(frozen=True)
class ContactGap(OfContact):
    """Least distance between the points of a body's surface that keep clear and a rigid body: never zero or less.

    They are its nodes, the middle of facets of eight nodes, in space points inside facets longer than the rigid body
    is sharp, and points that have joined them where facets cut in. Of `itself` it is that between its flat faces.

    Before they touch it is how far they are apart; of a piece that may touch itself, how far parts of its surface are
    apart that face each other within 30 degrees, as the walls of a slot do. In contact it is what the barrier leaves,
    less than its distance: no property of the bodies, but a part of the stated error of all else.

    Beside its value a report has left_m, the mean where something presses, by the forces there; in a motion
    least_in_time_m and when that is, least_at_s.
    """

    of: Annotated[str, "contact", "the contact"]
    over: Annotated[
        Literal["end", "least", "mean"],
        "in a motion: its value at the end, the least of all times, or the mean over time",
    ] = "end"
    against: Annotated[str | None, "reference or model", "what is taken as right"] = None
    natural: ClassVar[str] = "m"
    extreme: ClassVar[str] = "least"
    numbers: ClassVar[tuple[str, ...]] = ()

    def amount(self, rest: AtRest) -> Floats:
        """The least, and the mean in contact, m. Raises Undefined where nothing is known of the contact."""
        touch = self.touch(rest)
        if touch.gap is None:
            raise Undefined(f"`{self.of}` does not touch, and no parts of the surface face each other")
        return np.array([touch.gap, touch.left])

    def acting(self, rest: AtRest) -> float:
        """The largest displacement, m."""
        return rest.moved

    def details(self, value: Floats) -> dict[str, Any]:
        """The mean in contact."""
        return {"left_m": float(value[1])}
